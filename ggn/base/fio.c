#include "base/fio.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int ggn_fio_read(const char *path, size_t max_size, char **data, size_t *size, struct ggn_err *err)
{
    struct stat st;
    char *buffer = NULL;
    int rc = GGN_OK;
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return ggn_fail(err, GGN_EIO, "%s: %s", path, strerror(errno));
    if (fstat(fileno(f), &st) != 0 || !S_ISREG(st.st_mode)) {
        rc = ggn_fail(err, GGN_EINVAL, "%s: not a regular file", path);
        goto out;
    }
    if ((unsigned long long)st.st_size > max_size) {
        rc = ggn_fail(err, GGN_EINVAL, "%s: %lld bytes, more than the %zu this kind of file may have", path,
                     (long long)st.st_size, max_size);
        goto out;
    }
    size_t n = (size_t)st.st_size;
    buffer = malloc(n + 1);
    if (buffer == NULL) {
        rc = ggn_fail_nomem(err, path);
        goto out;
    }
    if (fread(buffer, 1, n, f) != n) {
        rc = ggn_fail(err, GGN_EIO, "%s: read error", path);
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

int ggn_fio_tmp_name(const char *path, char *tmp_path, size_t room, struct ggn_err *err)
{
    const char *slash = strrchr(path, '/');
    const char *base = slash != NULL ? slash + 1 : path;
    int n = snprintf(tmp_path, room, "%.*s.tmp%ld.%s", (int)(base - path), path, (long)getpid(), base);
    if (n < 0 || (size_t)n >= room)
        return ggn_fail(err, GGN_EINVAL, "%.64s...: the path is too long", path);
    return GGN_OK;
}

int ggn_fio_rename(const char *tmp_path, const char *path, struct ggn_err *err)
{
    if (rename(tmp_path, path) != 0) {
        int rc = ggn_fail(err, GGN_EIO, "%s: %s", path, strerror(errno));
        unlink(tmp_path);
        return rc;
    }
    return GGN_OK;
}

int ggn_fio_join(char *path, const char *dir, const char *name, struct ggn_err *err)
{
    int n = snprintf(path, 4096, "%s/%s", dir, name);
    return n > 0 && n < 4096 ? GGN_OK : ggn_fail(err, GGN_EINVAL, "%.64s...: the path is too long", dir);
}

int ggn_fio_begin(struct ggn_fio_out *out, const char *path, struct ggn_err *err)
{
    memset(out, 0, sizeof *out);
    if (strlen(path) >= sizeof out->path)
        return ggn_fail(err, GGN_EINVAL, "%.64s...: the path is too long", path);
    strcpy(out->path, path);
    int rc = ggn_fio_tmp_name(path, out->tmp_path, sizeof out->tmp_path, err);
    if (rc != GGN_OK)
        return rc;
    out->file = fopen(out->tmp_path, "wb");
    if (out->file == NULL)
        return ggn_fail(err, GGN_EIO, "%s: %s", path, strerror(errno));
    return GGN_OK;
}

int ggn_fio_commit(struct ggn_fio_out *out, struct ggn_err *err)
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
        return ggn_fail(err, GGN_EIO, "%s: write failed: %s", out->path, strerror(saved != 0 ? saved : EIO));
    }
    return ggn_fio_rename(out->tmp_path, out->path, err);
}

int ggn_fio_write_line(const char *path, const char *text, struct ggn_err *err)
{
    struct ggn_fio_out out;
    int rc = ggn_fio_begin(&out, path, err);
    if (rc != GGN_OK)
        return rc;
    fprintf(out.file, "%s\n", text);
    return ggn_fio_commit(&out, err);
}

void ggn_fio_abort(struct ggn_fio_out *out)
{
    if (out->file == NULL)
        return;
    fclose(out->file);
    out->file = NULL;
    unlink(out->tmp_path);
}
