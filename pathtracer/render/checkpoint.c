#include "render/checkpoint.h"

#include <zlib.h>

#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "render/host_state.h"

/*
 * magic[8], settings bytes, settings; film bytes, film arrays; blocks, block records; totals; dropped samples; criterion
 * bytes, criterion; crc32 of all before. Counts are u64, records are the structs below, made without padding.
 */
const struct base_file_kind pt_checkpoint_kind = {"checkpoint", {'L', 'U', 'L', 'L', 'C', 'K', 'P', '1'}};
enum { MAX_CRITERION_BYTES = 1 << 30 };

struct block_record {
    uint64_t spp, next_spp, asked_spp, rays, dropped;
    double p_noisy, error, predicted_spp, thread_s;
    int32_t reason;
    uint32_t checks, stop_votes, asked;
};

/* --- saving --------------------------------------------------------------------------------------------------------- */

struct sink {
    FILE *file;
    uint32_t crc;
};

/* Write errors stay in the FILE and are found by base_file_commit. */
static void put(struct sink *s, const void *data, size_t size)
{
    const unsigned char *p = data;
    for (size_t done = 0; done < size;) {
        size_t n = size - done < (1u << 30) ? size - done : (1u << 30);
        s->crc = (uint32_t)crc32(s->crc, p + done, (uInt)n);
        done += n;
    }
    if (size > 0)
        fwrite(data, 1, size, s->file);
}

static void put_count(struct sink *s, uint64_t n)
{
    put(s, &n, sizeof n);
}

static void put_blocks(struct sink *s, const struct pt_blocks *blocks)
{
    put_count(s, blocks->count);
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct pt_block *b = &blocks->list[i];
        struct block_record record = {b->spp,           b->next_spp, b->asked_spp, b->rays,   b->dropped,    b->p_noisy,
                                      b->error,
                                      b->predicted_spp, b->thread_s, b->reason,    b->checks, b->stop_votes, b->asked};
        put(s, &record, sizeof record);
    }
}

int pt_checkpoint_save(const char *path, const struct pt_render *r, const char *settings, struct base_err *err)
{
    unsigned char *state = NULL;
    size_t state_size = 0;
    struct base_file_out out;
    int rc = r->criterion ? pt_criterion_save(r->criterion, &state, &state_size, err) : 0;
    if (rc)
        return rc;
    rc = base_file_begin(&out, path, err);
    if (rc) {
        free(state);
        return rc;
    }
    struct sink s = {.file = out.file, .crc = (uint32_t)crc32(0, NULL, 0)};
    put(&s, pt_checkpoint_kind.magic, sizeof pt_checkpoint_kind.magic);
    put_count(&s, strlen(settings));
    put(&s, settings, strlen(settings));
    put_count(&s, r->film.bytes);
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&r->film, arrays);
    for (int i = 0; i < n; i++)
        put(&s, arrays[i].data, arrays[i].bytes);
    put_blocks(&s, &r->blocks);
    put(&s, &r->totals, sizeof r->totals);
    put_count(&s, r->dropped_count);
    put(&s, r->dropped, sizeof r->dropped);
    put_count(&s, state_size);
    put(&s, state, state_size);
    fwrite(&s.crc, 1, sizeof s.crc, out.file);
    free(state);
    return base_file_commit(&out, err);
}

/* --- loading -------------------------------------------------------------------------------------------------------- */

struct source {
    const char *path;
    const unsigned char *data;
    size_t at, size;
};

static int take(struct source *s, void *data, size_t size, struct base_err *err)
{
    if (size > s->size - s->at)
        return base_fail(err, BASE_EINVAL, "%s: the checkpoint is too short", s->path);
    memcpy(data, s->data + s->at, size);
    s->at += size;
    return 0;
}

static int expect_count(struct source *s, uint64_t n, const char *what, struct base_err *err)
{
    uint64_t found = 0;
    int rc = take(s, &found, sizeof found, err);
    if (!rc && found != n)
        rc = base_fail(err, BASE_EINVAL, "%s: the checkpoint has another number of %s", s->path, what);
    return rc;
}

/* Names the first line of key=value that differs. */
static int refuse_settings(const struct source *s, const char *theirs, size_t n, const char *ours, struct base_err *err)
{
    const char *a = theirs, *end = theirs + n, *b = ours;
    while (a < end && *b != '\0') {
        int la = (int)strcspn(a, "\n"), lb = (int)strcspn(b, "\n");
        if (la != lb || memcmp(a, b, (size_t)la) != 0)
            return base_fail(err, BASE_EINVAL, "%s: made with %.*s, but this render has %.*s", s->path, la, a, lb, b);
        a += la + (a[la] == '\n');
        b += lb + (b[lb] == '\n');
    }
    return base_fail(err, BASE_EINVAL, "%s: made with other settings", s->path);
}

static int take_settings(struct source *s, const char *settings, struct base_err *err)
{
    uint64_t n = 0;
    int rc = take(s, &n, sizeof n, err);
    if (rc)
        return rc;
    if (n > s->size - s->at)
        return base_fail(err, BASE_EINVAL, "%s: the checkpoint is too short", s->path);
    if (n != strlen(settings) || memcmp(s->data + s->at, settings, (size_t)n) != 0) {
        char *copy = strndup((const char *)s->data + s->at, (size_t)n);
        rc = !copy ? base_fail_nomem(err, s->path) : refuse_settings(s, copy, strlen(copy), settings, err);
        free(copy);
        return rc;
    }
    s->at += (size_t)n;
    return 0;
}

static int take_blocks(struct source *s, struct pt_blocks *blocks, uint64_t spp_max, struct base_err *err)
{
    int rc = expect_count(s, blocks->count, "blocks", err);
    for (uint32_t i = 0; i < blocks->count && !rc; i++) {
        struct block_record record = {0};
        struct pt_block *b = &blocks->list[i];
        if ((rc = take(s, &record, sizeof record, err)) != 0)
            break;
        if (record.spp > spp_max || record.next_spp > spp_max || record.reason < 0 || record.reason >= PT_REASON_COUNT)
            return base_fail(err, BASE_EINVAL, "%s: block %u of the checkpoint makes no sense", s->path, b->id);
        b->spp = record.spp;
        b->next_spp = record.next_spp;
        b->asked_spp = record.asked_spp;
        b->rays = record.rays;
        b->dropped = record.dropped;
        b->p_noisy = record.p_noisy;
        b->error = record.error;
        b->predicted_spp = record.predicted_spp;
        b->thread_s = record.thread_s;
        b->reason = record.reason;
        b->checks = record.checks;
        b->stop_votes = record.stop_votes;
        b->asked = record.asked;
    }
    return rc;
}

static int take_film(struct source *s, const struct pt_film *film, struct base_err *err)
{
    int rc = expect_count(s, film->bytes, "bytes of pixels", err);
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(film, arrays);
    for (int i = 0; i < n && !rc; i++)
        rc = take(s, arrays[i].data, arrays[i].bytes, err);
    return rc;
}

static int take_criterion(struct source *s, struct pt_criterion *criterion, struct base_err *err)
{
    uint64_t n = 0;
    int rc = take(s, &n, sizeof n, err);
    if (rc)
        return rc;
    if (n != s->size - s->at || (!criterion && n > 0))
        return base_fail(err, BASE_EINVAL, "%s: the checkpoint has a wrong length", s->path);
    return criterion ? pt_criterion_load(criterion, s->data + s->at, (size_t)n, err) : 0;
}

static int take_all(struct source *s, struct pt_render *r, const char *settings, struct base_err *err)
{
    uint64_t dropped = 0;
    int rc = take_settings(s, settings, err);
    if (!rc)
        rc = take_film(s, &r->film, err);
    if (!rc)
        rc = take_blocks(s, &r->blocks, r->config.spp_max, err);
    if (!rc)
        rc = take(s, &r->totals, sizeof r->totals, err);
    if (!rc)
        rc = take(s, &dropped, sizeof dropped, err);
    if (!rc && dropped > PT_DROPPED_KEPT)
        rc = base_fail(err, BASE_EINVAL, "%s: the checkpoint makes no sense", s->path);
    if (!rc)
        rc = take(s, r->dropped, sizeof r->dropped, err);
    r->dropped_count = (uint32_t)dropped;
    return !rc ? take_criterion(s, r->criterion, err) : rc;
}

int pt_checkpoint_load(const char *path, struct pt_render *r, const char *settings, struct base_err *err)
{
    char *data = NULL;
    size_t size = 0;
    size_t room = r->film.bytes + (size_t)r->blocks.count * sizeof(struct block_record) + (size_t)MAX_CRITERION_BYTES;
    int rc = base_file_read(path, room, &data, &size, err);
    if (rc)
        return rc;
    uint32_t crc = 0;
    const size_t begin = sizeof pt_checkpoint_kind.magic;
    if (size < begin + sizeof crc || memcmp(data, pt_checkpoint_kind.magic, begin) != 0) {
        rc = base_fail(err, BASE_EINVAL, "%s: not a checkpoint", path);
        goto out;
    }
    memcpy(&crc, data + size - sizeof crc, sizeof crc);
    if ((uint32_t)crc32_z(0, (const unsigned char *)data, size - sizeof crc) != crc) {
        rc = base_fail(err, BASE_EINVAL, "%s: the checkpoint is damaged or cut off", path);
        goto out;
    }
    struct source s = {.path = path, .data = (const unsigned char *)data, .at = begin, .size = size - sizeof crc};
    rc = take_all(&s, r, settings, err);
out:
    free(data);
    return rc;
}
