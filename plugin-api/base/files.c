#include "base/files.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, LINKS_MAX = 40, TRIES_MAX = 100, NAME_KEPT = 180 };
#define TMP_PREFIX ".tmp-lull" /* .tmp-lullPID-N.NAME */

int base_file_open(const char *path, FILE **file, struct base_err *err)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC); /* a FIFO without a writer would be waited for */
    if (fd < 0)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode)) {
        close(fd);
        return base_fail(err, BASE_EINVAL, "%s: not a regular file", path);
    }
    *file = fdopen(fd, "rb");
    if (!*file) {
        close(fd);
        return base_fail_nomem(err, path);
    }
    return 0;
}

int base_file_check_input(const char *path, struct base_err *err)
{
    FILE *f;
    int rc = base_file_open(path, &f, err);
    if (!rc)
        fclose(f);
    return rc;
}

int base_file_read(const char *path, size_t max_size, char **data, size_t *size, struct base_err *err)
{
    struct stat st;
    char *buffer = NULL;
    FILE *f = NULL;
    int rc = base_file_open(path, &f, err);
    if (rc)
        return rc;
    if (fstat(fileno(f), &st) != 0)
        rc = base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    else if ((unsigned long long)st.st_size > max_size)
        rc = base_fail(err, BASE_EINVAL, "%s: %lld bytes, more than the %zu this kind of file may have", path,
                       (long long)st.st_size, max_size);
    else if (!(buffer = malloc((size_t)st.st_size + 1)))
        rc = base_fail_nomem(err, path);
    else if (fread(buffer, 1, (size_t)st.st_size, f) != (size_t)st.st_size)
        rc = base_fail(err, BASE_EIO, "%s: read error", path);
    fclose(f);
    if (rc) {
        free(buffer);
        return rc;
    }
    buffer[st.st_size] = '\0';
    *data = buffer;
    *size = (size_t)st.st_size;
    return 0;
}

static int too_long(const char *path, struct base_err *err)
{
    return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", path);
}

const char *base_file_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

int base_file_has_ending(const char *path, const char *ending)
{
    const char *dot = strrchr(path, '.');
    return dot && strcasecmp(dot + 1, ending) == 0;
}

/* The file that writing to `path` changes: links are followed, also to where no file is yet. */
static int follow(const char *path, char *target, struct base_err *err)
{
    char link[PATH_ROOM], whole[2 * PATH_ROOM];
    if (strlen(path) >= PATH_ROOM)
        return too_long(path, err);
    strcpy(target, path);
    for (int i = 0; i < LINKS_MAX; i++) {
        ssize_t n = readlink(target, link, sizeof link - 1);
        if (n < 0)
            return 0;
        link[n] = '\0';
        int folder = link[0] == '/' ? 0 : (int)(base_file_name(target) - target);
        if (snprintf(whole, sizeof whole, "%.*s%s", folder, target, link) >= PATH_ROOM)
            return too_long(path, err);
        strcpy(target, whole);
    }
    return base_fail(err, BASE_EINVAL, "%s: %s", path, strerror(ELOOP));
}

static void folder_of(const char *path, char *folder)
{
    size_t n = (size_t)(base_file_name(path) - path);
    memcpy(folder, path, n);
    strcpy(folder + n, n > 0 ? "" : "./");
}

/* Whose temporary `name` is: a process, or 0 if it is none. */
static long owner_of(const char *name)
{
    long pid;
    char dash;
    return sscanf(name, TMP_PREFIX "%ld%c", &pid, &dash) == 2 && dash == '-' && pid > 0 ? pid : 0;
}

/* Removes the temporaries of processes that are gone. One on another machine, or in another container, holds its lock. */
static void sweep(const char *folder)
{
    DIR *d = opendir(folder);
    for (struct dirent *e; d && (e = readdir(d));) {
        long pid = owner_of(e->d_name);
        if (pid == 0 || kill((pid_t)pid, 0) == 0 || errno != ESRCH)
            continue;
        int fd = openat(dirfd(d), e->d_name, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
        if (fd < 0)
            continue;
        if (flock(fd, LOCK_EX | LOCK_NB) == 0)
            unlinkat(dirfd(d), e->d_name, 0);
        close(fd);
    }
    if (d)
        closedir(d);
}

/* Fills `target` with the file behind `path`, if it can be written. */
static int check_output(const char *path, char *target, struct base_err *err)
{
    struct stat st;
    char folder[PATH_ROOM + 4];
    int rc = follow(path, target, err);
    if (rc)
        return rc;
    if (base_file_name(target)[0] == '\0')
        return base_fail(err, BASE_EINVAL, "%s: not the name of a file", path);
    folder_of(target, folder);
    if (access(folder, W_OK | X_OK) != 0)
        return base_fail(err, BASE_EIO, "%s: cannot write there: %s", path, strerror(errno));
    if (lstat(target, &st) != 0 && errno != ENOENT)
        return errno == ENAMETOOLONG ? too_long(path, err)
                                     : base_fail(err, BASE_EIO, "%s: cannot write there: %s", path, strerror(errno));
    if (stat(target, &st) == 0 && !S_ISREG(st.st_mode))
        return base_fail(err, BASE_EINVAL, "%s: cannot write there: %s", path,
                         S_ISDIR(st.st_mode) ? "it is a folder" : "it is no regular file and would be replaced");
    sweep(folder);
    return 0;
}

int base_file_check_output(const char *path, struct base_err *err)
{
    char target[PATH_ROOM];
    return path ? check_output(path, target, err) : 0;
}

int base_file_check_kind(const char *path, const struct base_file_kind *kind, struct base_err *err)
{
    unsigned char begin[sizeof kind->magic];
    FILE *f;
    if (!path || access(path, F_OK) != 0)
        return 0;
    int rc = base_file_open(path, &f, err);
    if (rc)
        return rc;
    size_t n = fread(begin, 1, sizeof begin, f);
    fclose(f);
    if (n > 0 && (n < sizeof begin || memcmp(begin, kind->magic, sizeof begin) != 0))
        return base_fail(err, BASE_EINVAL, "%s: not a %s, it would be replaced; choose another name", path, kind->name);
    return 0;
}

int base_file_is_same(const char *a, const char *b)
{
    char target_a[PATH_ROOM], target_b[PATH_ROOM], folder[PATH_ROOM + 4];
    struct stat at_a, at_b;
    if (follow(a, target_a, NULL) != 0 || follow(b, target_b, NULL) != 0)
        return 0;
    int has_a = stat(target_a, &at_a) == 0, has_b = stat(target_b, &at_b) == 0;
    if (!has_a && !has_b && strcmp(base_file_name(target_a), base_file_name(target_b)) == 0) { /* then by their folders */
        folder_of(target_a, folder);
        has_a = stat(folder, &at_a) == 0;
        folder_of(target_b, folder);
        has_b = stat(folder, &at_b) == 0;
    }
    return has_a && has_b && at_a.st_dev == at_b.st_dev && at_a.st_ino == at_b.st_ino;
}

int base_file_is_inside(const char *path, const char *folder)
{
    char at[2 * PATH_ROOM], target[PATH_ROOM];
    struct stat outer, here, below = {0};
    if (follow(path, target, NULL) != 0 || stat(folder, &outer) != 0)
        return 0;
    folder_of(target, at);
    while (strlen(at) < PATH_ROOM && stat(at, &here) == 0 && (here.st_dev != below.st_dev || here.st_ino != below.st_ino)) {
        if (here.st_dev == outer.st_dev && here.st_ino == outer.st_ino)
            return 1;
        below = here; /* only the root is its own parent */
        strcat(at, "/..");
    }
    return 0;
}

int base_make_folder(const char *path, int *made, struct base_err *err)
{
    const int is_new = mkdir(path, 0777) == 0;
    if (made)
        *made = is_new;
    return is_new || errno == EEXIST ? 0 : base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
}

int base_file_join(char *path, const char *dir, const char *name, struct base_err *err)
{
    int n = snprintf(path, 4096, "%s/%s", dir, name);
    return n > 0 && n < 4096 ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
}

/* Makes the temporary beside the file and locks it; one that somebody swept away in between is made again under the next
 * name. A long name is cut at the front: the temporary's fits where it does. */
static int create_tmp(struct base_file_out *out, int *fd, struct base_err *err)
{
    const char *name = base_file_name(out->path);
    const size_t length = strlen(name);
    struct stat st;
    for (int n = 0; n < TRIES_MAX; n++) {
        int used = snprintf(out->tmp_path, sizeof out->tmp_path, "%.*s%s%ld-%d.%s", (int)(name - out->path), out->path,
                            TMP_PREFIX, (long)getpid(), n, length > NAME_KEPT ? name + length - NAME_KEPT : name);
        if (used < 0 || (size_t)used >= sizeof out->tmp_path)
            return too_long(out->path, err);
        *fd = open(out->tmp_path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (*fd < 0 && errno != EEXIST)
            break;
        if (*fd < 0)
            continue;
        int taken = flock(*fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
        if (!taken && fstat(*fd, &st) == 0 && st.st_nlink > 0)
            return 0;
        close(*fd);
    }
    return base_fail(err, BASE_EIO, "%s: cannot write there: %s", out->path, strerror(errno));
}

/* A file that is replaced keeps its permissions, as one that is written over; where that cannot be, it is written. */
static void keep_mode(const char *target, int fd, mode_t besides)
{
    const int saved = errno;
    struct stat st;
    if (stat(target, &st) == 0 && S_ISREG(st.st_mode))
        (void)!fchmod(fd, (st.st_mode & (S_IRWXU | S_IRWXG | S_IRWXO)) | besides);
    errno = saved;
}

int base_file_begin(struct base_file_out *out, const char *path, struct base_err *err)
{
    memset(out, 0, sizeof *out);
    int fd = -1, rc = check_output(path, out->path, err);
    if (!rc)
        rc = create_tmp(out, &fd, err);
    if (rc)
        return rc;
    keep_mode(out->path, fd, S_IRUSR | S_IWUSR); /* sweep opens it */
    out->file = fdopen(fd, "wb");
    if (!out->file) {
        close(fd);
        unlink(out->tmp_path);
        return base_fail_nomem(err, path);
    }
    return 0;
}

/* Why a write failed whose errno is long gone: one more byte meets the same end. */
static int find_reason(const struct base_file_out *out)
{
    errno = 0;
    return write(fileno(out->file), "", 1) < 0 ? errno : EIO;
}

/* Where a folder cannot be synced, the file is in place all the same. */
static void sync_folder(const char *path)
{
    char folder[PATH_ROOM + 4];
    folder_of(path, folder);
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        (void)!fsync(fd);
        close(fd);
    }
}

int base_file_commit(struct base_file_out *out, struct base_err *err)
{
    int bad = ferror(out->file) != 0;
    errno = bad ? find_reason(out) : 0;
    bad |= fflush(out->file) != 0;
    keep_mode(out->path, fileno(out->file), 0);
    if (!bad) /* EINVAL: a file system without fsync */
        bad = fsync(fileno(out->file)) != 0 && errno != EINVAL;
    int saved = errno;
    bad |= fclose(out->file) != 0;
    out->file = NULL;
    char target[PATH_ROOM];
    int rc = bad ? base_fail(err, BASE_EIO, "%s: write failed: %s", out->path, strerror(saved != 0 ? saved : EIO))
                 : follow(out->path, target, err);
    if (!rc && rename(out->tmp_path, target) != 0)
        rc = base_fail(err, BASE_EIO, "%s: %s", out->path, strerror(errno));
    if (rc)
        unlink(out->tmp_path);
    else if (out->durable)
        sync_folder(out->path);
    return rc;
}

int base_file_write_line(const char *path, const char *text, struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fprintf(out.file, "%s\n", text);
    return base_file_commit(&out, err);
}

void base_file_abort(struct base_file_out *out)
{
    if (!out->file)
        return;
    fclose(out->file);
    out->file = NULL;
    unlink(out->tmp_path);
}

static int refuse_lock(const char *dir, int fd, struct base_err *err)
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
            rc = refuse_lock(dir, fd, err);
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
