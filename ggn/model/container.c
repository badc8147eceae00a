#include "model/container.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"

const struct base_file_kind ggn_container_kind = {"model file", {'L', 'U', 'L', 'L', 'G', 'G', 'N', '\n'}};

enum { HEADER = 64, ENTRY = 88, ALIGN = 64, AT_CHECKSUM = 48, MAX_JSON = 1 << 20 };
static const uint64_t MAX_FILE = (uint64_t)4 << 30;

const char *const ggn_type_names[GGN_TYPES + 1] = {"f32", "f16", "bf16", NULL};
static const unsigned type_size[GGN_TYPES] = {4, 2, 2};

/* FNV-1a, 64 bit (Fowler, Noll, Vo), with the checksum's own bytes as zero. */
static uint64_t checksum(const unsigned char *p, size_t size)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++) {
        unsigned char byte = i >= AT_CHECKSUM && i < AT_CHECKSUM + 8 ? 0 : p[i];
        h = (h ^ byte) * 0x100000001b3u;
    }
    return h;
}

void ggn_container_release(struct ggn_container *c)
{
    free(c->entry);
    free(c->json);
    free(c->data);
    memset(c, 0, sizeof *c);
}

int ggn_container_add(struct ggn_container *c, const char *name, enum ggn_type type, int rank, const int *dim,
                      const float *values, struct base_err *err)
{
    struct ggn_entry *grown = realloc(c->entry, ((size_t)c->n_entries + 1) * sizeof *grown);
    if (!grown)
        return base_fail_nomem(err, "tensor table");
    c->entry = grown;
    struct ggn_entry *e = &grown[c->n_entries++];
    *e = (struct ggn_entry){.type = type, .rank = rank, .count = 1, .write = values};
    snprintf(e->name, sizeof e->name, "%s", name);
    for (int i = 0; i < 4; i++) {
        e->dim[i] = i < rank ? (uint32_t)dim[i] : 1;
        e->count *= e->dim[i];
    }
    return 0;
}

static void encode(unsigned char *p, const struct ggn_entry *e)
{
    for (size_t i = 0; i < e->count; i++) {
        if (e->type == GGN_F32) {
            base_put_u32(p + 4 * i, base_f32_bits(e->write[i]));
        } else {
            uint16_t v = e->type == GGN_F16 ? base_f32_to_f16(e->write[i]) : base_f32_to_bf16(e->write[i]);
            p[2 * i] = (unsigned char)v;
            p[2 * i + 1] = (unsigned char)(v >> 8);
        }
    }
}

static size_t aligned(size_t n) { return (n + ALIGN - 1) / ALIGN * ALIGN; }

/* The whole file in memory; NULL without memory. */
static unsigned char *assemble(struct ggn_container *c, size_t *size)
{
    size_t json_at = HEADER + (size_t)c->n_entries * ENTRY, json_size = strlen(c->json), at = aligned(json_at + json_size);
    for (int i = 0; i < c->n_entries; i++) {
        struct ggn_entry *e = &c->entry[i];
        e->offset = at;
        e->size = e->count * type_size[e->type];
        at = aligned(at + e->size);
    }
    unsigned char *file = calloc(1, at);
    if (!file)
        return NULL;
    memcpy(file, ggn_container_kind.magic, sizeof ggn_container_kind.magic);
    base_put_u32(file + 8, GGN_CONTAINER_VERSION);
    base_put_u32(file + 12, (uint32_t)c->n_entries);
    base_put_u64(file + 16, at);
    base_put_u64(file + 24, json_at);
    base_put_u64(file + 32, json_size);
    base_put_u64(file + 40, HEADER);
    memcpy(file + json_at, c->json, json_size);
    for (int i = 0; i < c->n_entries; i++) {
        const struct ggn_entry *e = &c->entry[i];
        unsigned char *p = file + HEADER + (size_t)i * ENTRY;
        memcpy(p, e->name, sizeof e->name);
        base_put_u32(p + 48, (uint32_t)e->type);
        base_put_u32(p + 52, (uint32_t)e->rank);
        for (int d = 0; d < 4; d++)
            base_put_u32(p + 56 + 4 * d, e->dim[d]);
        base_put_u64(p + 72, e->offset);
        base_put_u64(p + 80, e->size);
        encode(file + e->offset, e);
    }
    base_put_u64(file + AT_CHECKSUM, checksum(file, at));
    *size = at;
    return file;
}

/* Whether every finite value stays finite in the type that it is stored in. */
static int fits(const struct ggn_container *c, struct base_err *err)
{
    static const float most[GGN_TYPES] = {FLT_MAX, 65504.0f, 3.3895314e38f};
    for (int i = 0; i < c->n_entries; i++)
        for (size_t k = 0; k < c->entry[i].count; k++)
            if (fabsf(c->entry[i].write[k]) > most[c->entry[i].type] && isfinite(c->entry[i].write[k]))
                return base_fail(err, BASE_EINVAL, "tensor '%s' has a value of %g, too large for %s", c->entry[i].name,
                                 (double)c->entry[i].write[k], ggn_type_names[c->entry[i].type]);
    return 0;
}

int ggn_container_write(struct ggn_container *c, const char *path, struct base_err *err)
{
    struct base_file_out out = {0};
    size_t size;
    int rc = fits(c, err);
    if (rc)
        return rc;
    unsigned char *file = assemble(c, &size);

    if (!file)
        return base_fail_nomem(err, "model file");
    rc = base_file_begin(&out, path, err);
    if (!rc) {
        out.durable = 1; /* hours of training, also as a checkpoint */
        fwrite(file, 1, size, out.file);
        rc = base_file_commit(&out, err);
    }
    free(file);
    return rc;
}

static int check_header(const unsigned char *p, size_t size, const char *name, struct base_err *err)
{
    if (size < HEADER || memcmp(p, ggn_container_kind.magic, sizeof ggn_container_kind.magic) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a .ggn file", name);
    if (base_get_u32(p + 8) != GGN_CONTAINER_VERSION)
        return base_fail(err, BASE_EINVAL, "%s: .ggn version %u; this program reads version %d", name, base_get_u32(p + 8),
                         GGN_CONTAINER_VERSION);
    if (base_get_u64(p + 16) != size)
        return base_fail(err, BASE_EINVAL, "%s: %s: the header says %llu bytes, the file has %zu", name,
                         base_get_u64(p + 16) > size ? "truncated" : "too long", (unsigned long long)base_get_u64(p + 16),
                         size);
    if (base_get_u64(p + AT_CHECKSUM) != checksum(p, size))
        return base_fail(err, BASE_EINVAL, "%s: damaged (checksum does not match)", name);
    uint64_t json_at = base_get_u64(p + 24), json_size = base_get_u64(p + 32), table = base_get_u64(p + 40),
             entries = base_get_u32(p + 12);
    if (json_at > size || json_size > size - json_at || json_size > MAX_JSON)
        return base_fail(err, BASE_EINVAL, "%s: the description lies outside of the file", name);
    if (entries > GGN_CONTAINER_TENSORS || table > size || entries * ENTRY > size - table)
        return base_fail(err, BASE_EINVAL, "%s: the tensor table lies outside of the file", name);
    return 0;
}

static int read_entry(struct ggn_entry *e, const unsigned char *p, size_t size, const char *name, struct base_err *err)
{
    uint32_t type = base_get_u32(p + 48), rank = base_get_u32(p + 52);
    uint64_t count = 1;
    memcpy(e->name, p, sizeof e->name);
    e->name[sizeof e->name - 1] = 0;
    for (char *s = e->name; *s; s++) /* names go into messages and listings */
        if ((unsigned char)*s < 0x20 || (unsigned char)*s > 0x7e)
            *s = '?';
    if (type >= GGN_TYPES || rank < 1 || rank > 4)
        return base_fail(err, BASE_EINVAL, "%s: tensor '%s' has an unknown type or rank", name, e->name);
    for (int d = 0; d < 4; d++) {
        e->dim[d] = base_get_u32(p + 56 + 4 * d);
        if (e->dim[d] < 1 || (d >= (int)rank && e->dim[d] != 1) || count > MAX_FILE / e->dim[d])
            return base_fail(err, BASE_EINVAL, "%s: tensor '%s' has an impossible shape", name, e->name);
        count *= e->dim[d];
    }
    e->type = (enum ggn_type)type;
    e->rank = (int)rank;
    e->count = (size_t)count;
    e->offset = base_get_u64(p + 72);
    e->size = base_get_u64(p + 80);
    if (e->size != count * type_size[type] || e->offset % ALIGN || e->offset > size || e->size > size - e->offset)
        return base_fail(err, BASE_EINVAL, "%s: tensor '%s' lies outside of the file", name, e->name);
    return 0;
}

static int parse(struct ggn_container *c, const char *name, struct base_err *err)
{
    const unsigned char *p = (const unsigned char *)c->data;
    int rc = check_header(p, c->size, name, err);
    if (rc)
        return rc;
    size_t json_size = (size_t)base_get_u64(p + 32);
    c->n_entries = (int)base_get_u32(p + 12);
    c->entry = calloc((size_t)c->n_entries + 1, sizeof *c->entry);
    c->json = malloc(json_size + 1);
    if (!c->entry || !c->json)
        return base_fail_nomem(err, "model file");
    memcpy(c->json, p + base_get_u64(p + 24), json_size);
    c->json[json_size] = 0;
    for (int i = 0; i < c->n_entries && !rc; i++)
        rc = read_entry(&c->entry[i], p + base_get_u64(p + 40) + (size_t)i * ENTRY, c->size, name, err);
    return rc;
}

int ggn_container_parse(struct ggn_container *c, const char *name, char *data, size_t size, struct base_err *err)
{
    *c = (struct ggn_container){.data = data, .size = size};
    int rc = parse(c, name, err);
    if (rc)
        ggn_container_release(c);
    return rc;
}

int ggn_container_read(struct ggn_container *c, const char *path, struct base_err *err)
{
    *c = (struct ggn_container){0};
    int rc = base_file_read(path, (size_t)MAX_FILE, &c->data, &c->size, err);
    return rc ? rc : ggn_container_parse(c, path, c->data, c->size, err);
}

int ggn_container_get(const struct ggn_container *c, const char *name, int rank, const int *dim, float *out,
                      struct base_err *err)
{
    const struct ggn_entry *e = NULL;
    for (int i = 0; i < c->n_entries && !e; i++)
        if (!strcmp(c->entry[i].name, name))
            e = &c->entry[i];
    if (!e)
        return base_fail(err, BASE_EINVAL, "tensor '%s' is missing", name);
    for (int d = 0; d < 4; d++)
        if (e->rank != rank || e->dim[d] != (d < rank ? (uint32_t)dim[d] : 1))
            return base_fail(err, BASE_EINVAL, "tensor '%s' does not have the shape that the network asks for", name);
    const unsigned char *p = (const unsigned char *)c->data + e->offset;
    for (size_t i = 0; i < e->count; i++) {
        uint16_t half = (uint16_t)(p[i * type_size[e->type]] | p[i * type_size[e->type] + 1] << 8);
        out[i] = e->type == GGN_F32   ? base_f32_of_bits(base_get_u32(p + 4 * i))
                 : e->type == GGN_F16 ? base_f16_to_f32(half)
                                      : base_bf16_to_f32(half);
        if (!isfinite(out[i]))
            return base_fail(err, BASE_EINVAL, "tensor '%s' holds a value that is not finite", name);
    }
    return 0;
}
