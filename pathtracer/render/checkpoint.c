#include "render/checkpoint.h"

#include <zlib.h>

#include <stdlib.h>
#include <string.h>

/*
 * magic[8], identity bytes, identity; film bytes, film arrays; the state of the frame (lull_host_save); crc32 of all before.
 * Counts are u64.
 */
const struct base_file_kind pt_checkpoint_kind = {"checkpoint", {'L', 'U', 'L', 'L', 'C', 'K', 'P', '1'}};
/* The frame: blocks, totals, the criterion. */
enum { MAX_STATE_BYTES = 1 << 30 };

struct sink {
    FILE *file;
    uint32_t crc;
};

/* Write errors stay in the FILE and are found by base_file_commit. */
static void put(struct sink *s, const void *data, size_t size)
{
    if (size == 0) /* there may be no data then: zlib would begin anew */
        return;
    s->crc = (uint32_t)crc32_z(s->crc, data, size);
    fwrite(data, 1, size, s->file);
}

static void put_count(struct sink *s, uint64_t n) { put(s, &n, sizeof n); }

static int32_t put_state(const struct lull_writer *writer, const void *data, uint64_t size)
{
    put(writer->context, data, (size_t)size);
    return LULL_OK;
}

int pt_checkpoint_save(const char *path, const struct pt_render *r, const struct base_identity *identity,
                       struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    out.durable = 1;
    struct sink s = {.file = out.file, .crc = (uint32_t)crc32(0, NULL, 0)};
    put(&s, pt_checkpoint_kind.magic, sizeof pt_checkpoint_kind.magic);
    put_count(&s, identity->size);
    put(&s, identity->text, identity->size);
    put_count(&s, r->film.bytes);
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&r->film, 0, r->film.pixels, arrays);
    for (int i = 0; i < n; i++)
        put(&s, arrays[i].data, arrays[i].bytes);
    struct lull_writer writer = {.struct_size = sizeof writer, .context = &s, .write = put_state};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = lull_host_save(r->frame, &writer, &e);
    if (code != LULL_OK) {
        base_file_abort(&out);
        return pt_host_result(code, &e, err);
    }
    fwrite(&s.crc, 1, sizeof s.crc, out.file);
    return base_file_commit(&out, err);
}

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

/* others: what differs of what may, bits 1 << role */
static int take_identity(struct source *s, const struct base_identity *present, unsigned *others, struct base_err *err)
{
    static const struct base_identity_words words = {": made with", ": made without", "this render"};
    uint64_t n = 0;
    int rc = take(s, &n, sizeof n, err);
    if (!rc && n > s->size - s->at)
        rc = base_fail(err, BASE_EINVAL, "%s: the checkpoint is too short", s->path);
    if (!rc)
        rc = base_identity_compare(present, (const char *)s->data + s->at, (size_t)n, s->path, &words, others, err);
    if (!rc)
        s->at += (size_t)n;
    return rc;
}

static int take_film(struct source *s, const struct pt_film *film, struct base_err *err)
{
    uint64_t bytes = 0;
    int rc = take(s, &bytes, sizeof bytes, err);
    if (!rc && bytes != film->bytes)
        rc = base_fail(err, BASE_EINVAL, "%s: the checkpoint has another number of bytes of pixels", s->path);
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(film, 0, film->pixels, arrays);
    for (int i = 0; i < n && !rc; i++)
        rc = take(s, arrays[i].data, arrays[i].bytes, err);
    return rc;
}

/* Other parameters of the criterion may not understand its history: it begins anew. */
static int take_state(struct source *s, struct lull_host_frame *frame, unsigned others, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = (others >> PT_ROLE_RULE & 1 ? lull_host_load_blocks : lull_host_load)(frame, s->data + s->at,
                                                                                         s->size - s->at, s->path, &e);
    return pt_host_result(code, &e, err);
}

int pt_checkpoint_load(const char *path, struct pt_render *r, const struct base_identity *identity, struct base_err *err)
{
    char *data = NULL;
    size_t size = 0;
    int rc = base_file_read(path, r->film.bytes + (size_t)MAX_STATE_BYTES, &data, &size, err);
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
    const uint64_t first_spp = r->blocks->list[0].next_spp;
    unsigned others = 0;
    rc = take_identity(&s, identity, &others, err);
    if (!rc)
        rc = take_film(&s, &r->film, err);
    if (!rc)
        rc = take_state(&s, r->frame, others, err);
    if (!rc)
        pt_render_go_on(r, others, first_spp);
out:
    free(data);
    return rc;
}
