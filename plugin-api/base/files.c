#include "base/files.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int base_file_read(const char *path, size_t max_size, char **data, size_t *size, struct base_err *err)
{
    struct stat st;
    char *buffer = NULL;
    int rc = 0;
    FILE *f = fopen(path, "rb");
    if (!f)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    if (fstat(fileno(f), &st) != 0 || !S_ISREG(st.st_mode)) {
        rc = base_fail(err, BASE_EINVAL, "%s: not a regular file", path);
        goto out;
    }
    if ((unsigned long long)st.st_size > max_size) {
        rc = base_fail(err, BASE_EINVAL, "%s: %lld bytes, more than the %zu this kind of file may have", path,
                     (long long)st.st_size, max_size);
        goto out;
    }
    size_t n = (size_t)st.st_size;
    buffer = malloc(n + 1);
    if (!buffer) {
        rc = base_fail_nomem(err, path);
        goto out;
    }
    if (fread(buffer, 1, n, f) != n) {
        rc = base_fail(err, BASE_EIO, "%s: read error", path);
        goto out;
    }
    buffer[n] = '\0';
    *data = buffer;
    *size = n;
    buffer = NULL;
out:
    free(buffer);
    fclose(f);
    return rc;
}

int base_file_tmp_name(const char *path, char *tmp_path, size_t room, struct base_err *err)
{
    const char *slash = strrchr(path, '/');
    const char *base = slash ? slash + 1 : path;
    int n = snprintf(tmp_path, room, "%.*s.tmp%ld.%s", (int)(base - path), path, (long)getpid(), base);
    if (n < 0 || (size_t)n >= room)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", path);
    return 0;
}

int base_file_rename(const char *tmp_path, const char *path, struct base_err *err)
{
    if (rename(tmp_path, path) != 0) {
        int rc = base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
        unlink(tmp_path);
        return rc;
    }
    return 0;
}

int base_file_join(char *path, const char *dir, const char *name, struct base_err *err)
{
    int n = snprintf(path, 4096, "%s/%s", dir, name);
    return n > 0 && n < 4096 ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
}

int base_file_begin(struct base_file_out *out, const char *path, struct base_err *err)
{
    memset(out, 0, sizeof *out);
    if (strlen(path) >= sizeof out->path)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", path);
    strcpy(out->path, path);
    int rc = base_file_tmp_name(path, out->tmp_path, sizeof out->tmp_path, err);
    if (rc)
        return rc;
    out->file = fopen(out->tmp_path, "wb");
    if (!out->file)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    return 0;
}

int base_file_commit(struct base_file_out *out, struct base_err *err)
{
    int bad = ferror(out->file) != 0;
    errno = 0;
    bad |= fflush(out->file) != 0;
    bad |= fsync(fileno(out->file)) != 0 && errno != EINVAL; /* EINVAL: a file system without fsync */
    int saved = errno;
    bad |= fclose(out->file) != 0;
    out->file = NULL;
    if (bad) {
        unlink(out->tmp_path);
        return base_fail(err, BASE_EIO, "%s: write failed: %s", out->path, strerror(saved != 0 ? saved : EIO));
    }
    return base_file_rename(out->tmp_path, out->path, err);
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
