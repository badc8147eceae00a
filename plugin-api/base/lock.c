#include "base/lock.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"

static int refuse(const char *dir, int fd, struct base_err *err)
{
    struct flock holder = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    if (errno != EACCES && errno != EAGAIN)
        return base_fail(err, BASE_EIO, "%s: cannot be locked: %s", dir, strerror(errno));
    if (fcntl(fd, F_GETLK, &holder) != 0 || holder.l_type == F_UNLCK)
        holder.l_pid = 0;
    return base_fail(err, BASE_EINVAL, "%s: process %ld is writing there", dir, (long)holder.l_pid);
}

int base_lock_folder(struct base_lock *lock, const char *dir, struct base_err *err)
{
    struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    struct stat st = {0};
    lock->fd = 0;
    int rc = base_file_join(lock->path, dir, ".lock", err);
    while (!rc) {
        int fd = open(lock->path, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (fd < 0)
            return base_fail(err, BASE_EIO, "%s: %s", lock->path, strerror(errno));
        if (fcntl(fd, F_SETLK, &whole) != 0)
            rc = refuse(dir, fd, err);
        else if (fstat(fd, &st) == 0 && st.st_nlink > 0) {
            lock->fd = fd;
            break;
        }
        close(fd); /* its holder removed the file between the two calls: again */
    }
    return rc;
}

void base_lock_release(struct base_lock *lock)
{
    if (lock->fd <= 0)
        return;
    unlink(lock->path);
    close(lock->fd);
    lock->fd = 0;
}
