#include "data/manifest.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <zlib.h>

#include "base/files.h"

enum { MAX_TEXT = 1 << 26, MAX_BLOCKS = 1 << 20, MAX_SPP = 1 << 30 };

void ggn_manifest_release(struct ggn_manifest *m)
{
    free(m->levels);
    free(m->blocks);
    *m = (struct ggn_manifest){0};
}

static void get_text(const cJSON *o, const char *name, char out[GGN_MANIFEST_NAME])
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    if (cJSON_IsString(v))
        snprintf(out, GGN_MANIFEST_NAME, "%s", v->valuestring);
}

/* A whole number in [lo, hi]. */
static int get_number(const cJSON *o, const char *name, double lo, double hi, double *out)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    if (!cJSON_IsNumber(v) || !(v->valuedouble >= lo && v->valuedouble <= hi) || floor(v->valuedouble) != v->valuedouble)
        return 0;
    *out = v->valuedouble;
    return 1;
}

static int get_levels(const char *path, const cJSON *root, struct ggn_manifest *m, struct base_err *err)
{
    const cJSON *levels = cJSON_GetObjectItemCaseSensitive(root, "levels"), *v;
    int n = cJSON_GetArraySize(levels);
    if (!cJSON_IsArray(levels) || n < 1 || n > GGN_SEQ_MAX_RECORDS)
        return base_fail(err, BASE_EINVAL, "%s: no list of levels", path);
    m->levels = malloc((size_t)n * sizeof *m->levels);
    if (!m->levels)
        return base_fail_nomem(err, path);
    cJSON_ArrayForEach(v, levels) {
        if (!cJSON_IsNumber(v) || !(v->valuedouble >= 1 && v->valuedouble <= MAX_SPP) ||
            (m->n_levels > 0 && v->valuedouble <= m->levels[m->n_levels - 1]))
            return base_fail(err, BASE_EINVAL, "%s: level %u does not rise", path, m->n_levels);
        m->levels[m->n_levels++] = (uint32_t)v->valuedouble;
    }
    return 0;
}

static int get_block(const cJSON *o, const struct ggn_manifest *m, struct ggn_manifest_block *b)
{
    const cJSON *file = cJSON_GetObjectItemCaseSensitive(o, "file"), *crc = cJSON_GetObjectItemCaseSensitive(o, "crc32");
    double id, x0, y0, x1, y1, bytes;
    unsigned value;
    char after;
    if (!get_number(o, "id", 0, UINT32_MAX, &id) || !get_number(o, "x0", 0, m->width - 1.0, &x0) ||
        !get_number(o, "y0", 0, m->height - 1.0, &y0) || !get_number(o, "x1", x0 + 1, m->width, &x1) ||
        !get_number(o, "y1", y0 + 1, m->height, &y1) || !get_number(o, "bytes", 1, 1 << 30, &bytes) || !cJSON_IsString(file) ||
        strlen(file->valuestring) >= sizeof b->file || strchr(file->valuestring, '/') || file->valuestring[0] == '.' ||
        file->valuestring[0] == '\0' || !cJSON_IsString(crc) || sscanf(crc->valuestring, "%8x%c", &value, &after) != 1)
        return 0;
    *b = (struct ggn_manifest_block){.id = (uint32_t)id, .x0 = (uint32_t)x0, .y0 = (uint32_t)y0, .x1 = (uint32_t)x1,
                                     .y1 = (uint32_t)y1, .bytes = (uint64_t)bytes, .crc32 = value};
    strcpy(b->file, file->valuestring);
    return 1;
}

static int get_blocks(const char *path, const cJSON *root, struct ggn_manifest *m, struct base_err *err)
{
    const cJSON *blocks = cJSON_GetObjectItemCaseSensitive(root, "blocks"), *v;
    int n = cJSON_GetArraySize(blocks);
    if (!cJSON_IsArray(blocks) || n > MAX_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: no list of blocks", path);
    m->blocks = malloc((n > 0 ? (size_t)n : 1) * sizeof *m->blocks);
    if (!m->blocks)
        return base_fail_nomem(err, path);
    cJSON_ArrayForEach(v, blocks) {
        if (!get_block(v, m, &m->blocks[m->n_blocks]))
            return base_fail(err, BASE_EINVAL, "%s: entry %u of blocks is not usable", path, m->n_blocks);
        for (uint32_t i = 0; i < m->n_blocks; i++)
            if (m->blocks[i].id == m->blocks[m->n_blocks].id)
                return base_fail(err, BASE_EINVAL, "%s: block %u is listed twice", path, m->blocks[i].id);
        m->n_blocks++;
    }
    return 0;
}

int ggn_manifest_parse(const char *path, const char *text, size_t size, struct ggn_manifest *out, struct base_err *err)
{
    struct ggn_manifest m = {.reference_independent = 1};
    cJSON *root = cJSON_ParseWithLength(text, size);
    double version, width = 0, height = 0, block = 0, spp = 0, seed = 0, reference_seed = 0;
    const cJSON *format = cJSON_GetObjectItemCaseSensitive(root, "format");
    int rc = 0;
    if (!cJSON_IsString(format) || strcmp(format->valuestring, "lull-sequence") != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: not the manifest of a sequence", path);
    else if (!get_number(root, "version", 1, 1, &version))
        rc = base_fail(err, BASE_EINVAL, "%s: this version of the format is not known", path);
    else if (!get_number(root, "width", 1, 1 << 20, &width) || !get_number(root, "height", 1, 1 << 20, &height) ||
             !get_number(root, "block", 1, GGN_SEQ_MAX_SIDE, &block))
        rc = base_fail(err, BASE_EINVAL, "%s: width, height or block is missing or out of range", path);
    if (rc)
        goto out;
    get_number(root, "reference_spp", 0, MAX_SPP, &spp);
    get_number(root, "seed", 0, 9007199254740992.0, &seed);
    get_number(root, "reference_seed", 0, 9007199254740992.0, &reference_seed);
    m.width = (uint32_t)width;
    m.height = (uint32_t)height;
    m.block = (uint32_t)block;
    m.reference_spp = (uint32_t)spp;
    m.seed = (uint64_t)seed;
    m.reference_seed = (uint64_t)reference_seed;
    if (cJSON_IsFalse(cJSON_GetObjectItemCaseSensitive(root, "reference_independent")))
        m.reference_independent = 0;
    get_text(root, "scene", m.scene);
    get_text(root, "source", m.source);
    get_text(root, "camera", m.camera);
    get_text(root, "renderer", m.renderer);
    if (m.scene[0] == '\0')
        rc = base_fail(err, BASE_EINVAL, "%s: the scene has no name", path);
    if (!rc)
        rc = get_levels(path, root, &m, err);
    if (!rc)
        rc = get_blocks(path, root, &m, err);
out:
    cJSON_Delete(root);
    if (rc)
        ggn_manifest_release(&m);
    else
        *out = m;
    return rc;
}

int ggn_manifest_read(const char *dir, struct ggn_manifest *m, struct base_err *err)
{
    char path[4096], *text;
    size_t size;
    int rc = base_file_join(path, dir, "manifest.json", err);
    if (!rc)
        rc = base_file_read(path, MAX_TEXT, &text, &size, err);
    if (rc)
        return rc;
    rc = ggn_manifest_parse(path, text, size, m, err);
    free(text);
    return rc;
}

/* cJSON says by NULL that a member could not be added; *ok gathers it. */
static void add_text(cJSON *o, const char *name, const char *text, int *ok)
{
    *ok &= cJSON_AddStringToObject(o, name, text) != NULL;
}

static void add_number(cJSON *o, const char *name, double v, int *ok)
{
    *ok &= cJSON_AddNumberToObject(o, name, v) != NULL;
}

static cJSON *block_json(const struct ggn_manifest_block *b, int *ok)
{
    char crc[16];
    cJSON *o = cJSON_CreateObject();
    snprintf(crc, sizeof crc, "%08x", b->crc32);
    add_number(o, "id", b->id, ok);
    add_number(o, "x0", b->x0, ok);
    add_number(o, "y0", b->y0, ok);
    add_number(o, "x1", b->x1, ok);
    add_number(o, "y1", b->y1, ok);
    add_text(o, "file", b->file, ok);
    add_number(o, "bytes", (double)b->bytes, ok);
    add_text(o, "crc32", crc, ok);
    return o;
}

/* Adds item to the array; frees it when that fails. */
static void append(cJSON *array, cJSON *item, int *ok)
{
    if (item && cJSON_AddItemToArray(array, item))
        return;
    cJSON_Delete(item);
    *ok = 0;
}

static cJSON *to_json(const struct ggn_manifest *m, int *ok)
{
    cJSON *root = cJSON_CreateObject();
    add_text(root, "format", "lull-sequence", ok);
    add_number(root, "version", 1, ok);
    add_text(root, "scene", m->scene, ok);
    add_text(root, "source", m->source, ok);
    add_text(root, "camera", m->camera, ok);
    add_text(root, "renderer", m->renderer, ok);
    add_number(root, "width", m->width, ok);
    add_number(root, "height", m->height, ok);
    add_number(root, "block", m->block, ok);
    add_number(root, "seed", (double)m->seed, ok);
    add_number(root, "reference_seed", (double)m->reference_seed, ok);
    add_number(root, "reference_spp", m->reference_spp, ok);
    *ok &= cJSON_AddBoolToObject(root, "reference_independent", m->reference_independent) != NULL;
    cJSON *levels = cJSON_AddArrayToObject(root, "levels");
    for (uint32_t i = 0; i < m->n_levels; i++)
        append(levels, cJSON_CreateNumber(m->levels[i]), ok);
    cJSON *blocks = cJSON_AddArrayToObject(root, "blocks");
    for (uint32_t i = 0; i < m->n_blocks; i++)
        append(blocks, block_json(&m->blocks[i], ok), ok);
    *ok &= levels != NULL && blocks != NULL;
    return root;
}

int ggn_manifest_write(const char *dir, const struct ggn_manifest *m, struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, dir, "manifest.json", err);
    if (rc)
        return rc;
    int ok = 1;
    cJSON *root = to_json(m, &ok);
    char *text = ok ? cJSON_Print(root) : NULL;
    cJSON_Delete(root);
    if (!text)
        return base_fail_nomem(err, path);
    rc = base_file_write_line(path, text, err);
    cJSON_free(text);
    return rc;
}

int ggn_manifest_read_block(const char *dir, const struct ggn_manifest *m, uint32_t index, struct ggn_seq_block *block, struct base_err *err)
{
    const struct ggn_manifest_block *e = &m->blocks[index];
    struct ggn_seq_block b;
    char path[4096];
    int rc = base_file_join(path, dir, e->file, err);
    if (!rc)
        rc = ggn_seq_block_read(path, &b, err);
    if (rc)
        return rc;
    if (b.size != e->bytes || (uint32_t)crc32_z(0, b.bytes, b.size) != e->crc32)
        rc = base_fail(err, BASE_EINVAL, "%s: not the file that the manifest lists (size or CRC)", path);
    else if (b.id != e->id || b.x0 != (int32_t)e->x0 || b.y0 != (int32_t)e->y0 || b.width != e->x1 - e->x0 || b.height != e->y1 - e->y0)
        rc = base_fail(err, BASE_EINVAL, "%s: block %u is %ux%u at %d,%d, the manifest says otherwise", path, b.id, b.width, b.height, b.x0, b.y0);
    else if (m->reference_spp > 0 && !b.reference)
        rc = base_fail(err, BASE_EINVAL, "%s: the reference is missing", path);
    for (uint32_t i = 0; i < m->n_levels && !rc; i++)
        if (!ggn_seq_level(&b, m->levels[i]))
            rc = base_fail(err, BASE_EINVAL, "%s: the level at %u spp is missing", path, m->levels[i]);
    if (rc) {
        ggn_seq_block_release(&b);
        return rc;
    }
    *block = b;
    return 0;
}
