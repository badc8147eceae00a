#include "sequence/manifest.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <zlib.h>

#include "base/files.h"
#include "base/json.h"
#include "base/list.h"
#include "sequence/manifest_json.h"

enum { MAX_TEXT = 1 << 26, MAX_BLOCKS = 1 << 20, MAX_SPP = INT32_MAX };

void seq_manifest_release(struct seq_manifest *m)
{
    free(m->levels);
    free(m->blocks);
    *m = (struct seq_manifest){0};
}

int seq_json_get_text(const cJSON *o, const char *name, char *out, size_t room)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    return cJSON_IsString(v) && snprintf(out, room, "%s", v->valuestring) < (int)room;
}

int seq_json_get_u32(const cJSON *o, const char *name, double lo, double hi, uint32_t *out)
{
    uint64_t value;
    if (!base_json_get_whole(o, name, lo, hi, &value))
        return 0;
    *out = (uint32_t)value;
    return 1;
}

int seq_json_get_crc(const cJSON *o, const char *name, uint32_t *crc)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    unsigned value;
    char after;
    if (!cJSON_IsString(v) || sscanf(v->valuestring, "%8x%c", &value, &after) != 1)
        return 0;
    *crc = value;
    return 1;
}

/* fewest: how many there are at least */
static int get_levels(const char *path, const cJSON *root, int fewest, struct seq_manifest *m, struct base_err *err)
{
    const cJSON *levels = cJSON_GetObjectItemCaseSensitive(root, "levels"), *v;
    int n = cJSON_GetArraySize(levels);
    if (!cJSON_IsArray(levels) || n < fewest || n > SEQ_MAX_RECORDS)
        return base_fail(err, BASE_EINVAL, "%s: no list of levels", path);
    m->levels = malloc((n > 0 ? (size_t)n : 1) * sizeof *m->levels);
    if (!m->levels)
        return base_fail_nomem(err, path);
    cJSON_ArrayForEach (v, levels) {
        if (!cJSON_IsNumber(v) || !(v->valuedouble >= 1 && v->valuedouble <= MAX_SPP) ||
            (m->n_levels > 0 && v->valuedouble <= m->levels[m->n_levels - 1]))
            return base_fail(err, BASE_EINVAL, "%s: level %u does not rise", path, m->n_levels);
        m->levels[m->n_levels++] = (uint32_t)v->valuedouble;
    }
    return 0;
}

static int get_block(const cJSON *o, const struct seq_manifest *m, struct seq_manifest_block *b)
{
    *b = (struct seq_manifest_block){0};
    base_json_get(o, "seconds", -HUGE_VAL, HUGE_VAL, &b->seconds);
    return seq_json_get_u32(o, "id", 0, UINT32_MAX, &b->id) && seq_json_get_u32(o, "x0", 0, m->width - 1.0, &b->x0) &&
           seq_json_get_u32(o, "y0", 0, m->height - 1.0, &b->y0) && seq_json_get_u32(o, "x1", b->x0 + 1, m->width, &b->x1) &&
           seq_json_get_u32(o, "y1", b->y0 + 1, m->height, &b->y1) &&
           base_json_get_whole(o, "bytes", 1, 1 << 30, &b->bytes) &&
           (!cJSON_HasObjectItem(o, "dropped") || base_json_get_whole(o, "dropped", 0, 1e15, &b->dropped)) &&
           seq_json_get_crc(o, "crc32", &b->crc32) && seq_json_get_text(o, "file", b->file, sizeof b->file) &&
           b->file[0] != '\0' && b->file[0] != '.' && !strchr(b->file, '/');
}

static int get_blocks(const char *path, const cJSON *root, struct seq_manifest *m, struct base_err *err)
{
    const cJSON *blocks = cJSON_GetObjectItemCaseSensitive(root, "blocks"), *v;
    int n = cJSON_GetArraySize(blocks);
    if (!cJSON_IsArray(blocks) || n > MAX_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: no list of blocks", path);
    m->blocks = malloc((n > 0 ? (size_t)n : 1) * sizeof *m->blocks);
    if (!m->blocks)
        return base_fail_nomem(err, path);
    cJSON_ArrayForEach (v, blocks) {
        if (!get_block(v, m, &m->blocks[m->n_blocks]))
            return base_fail(err, BASE_EINVAL, "%s: entry %u of blocks is not usable", path, m->n_blocks);
        m->n_blocks++;
    }
    uint32_t twice;
    int rc = base_unique_numbers(&m->blocks->id, sizeof *m->blocks, m->n_blocks, &twice);
    if (rc > 0)
        return base_fail(err, BASE_EINVAL, "%s: block %u is listed twice", path, twice);
    return rc ? base_fail_nomem(err, path) : 0;
}

/* The camera, where it is not the source's. */
static int get_view(const char *path, const cJSON *root, struct seq_manifest *m, struct base_err *err)
{
    const cJSON *look_at = cJSON_GetObjectItemCaseSensitive(root, "look_at"), *v;
    int n = 0;
    if (look_at && (!cJSON_IsArray(look_at) || cJSON_GetArraySize(look_at) != 9))
        return base_fail(err, BASE_EINVAL, "%s: look_at is not nine numbers", path);
    cJSON_ArrayForEach (v, look_at) {
        if (!cJSON_IsNumber(v))
            return base_fail(err, BASE_EINVAL, "%s: look_at is not nine numbers", path);
        m->look_at[n++] = v->valuedouble;
    }
    m->has_look_at = n > 0;
    base_json_get(root, "fov", -HUGE_VAL, HUGE_VAL, &m->fov_deg);
    return 0;
}

static int get_sizes(const char *path, const cJSON *root, struct seq_manifest *m, struct base_err *err)
{
    if (!seq_json_get_u32(root, "width", 1, 1 << 20, &m->width) || !seq_json_get_u32(root, "height", 1, 1 << 20, &m->height))
        return base_fail(err, BASE_EINVAL, "%s: width, height or block is missing or out of range", path);
    seq_json_get_u32(root, "reference_spp", 0, MAX_SPP, &m->reference_spp);
    base_json_get_whole(root, "seed", 0, 0x1p64, &m->seed); /* seeds of other programs reach 2^64 */
    base_json_get_whole(root, "reference_seed", 0, 0x1p64, &m->reference_seed);
    m->reference_independent = !cJSON_IsFalse(cJSON_GetObjectItemCaseSensitive(root, "reference_independent"));
    return 0;
}

int seq_json_get_head(const char *path, const cJSON *root, unsigned version, struct seq_manifest *m, struct base_err *err)
{
    static const char *const is[] = {"", "blocks alone", "looks at a whole frame"};
    const cJSON *format = cJSON_GetObjectItemCaseSensitive(root, "format");
    uint64_t found;
    if (!cJSON_IsString(format) || strcmp(format->valuestring, "lull-sequence") != 0)
        return base_fail(err, BASE_EINVAL, "%s: not the manifest of a sequence", path);
    if (!base_json_get_whole(root, "version", 1, 2, &found))
        return base_fail(err, BASE_EINVAL, "%s: this version of the format is not known", path);
    if (found != version)
        return base_fail(err, BASE_EINVAL, "%s: %s (version %d of the format), expected %s (version %u)", path, is[found],
                         (int)found, is[version], version);
    seq_json_get_text(root, "scene", m->scene, sizeof m->scene);
    seq_json_get_text(root, "source", m->source, sizeof m->source);
    seq_json_get_text(root, "camera", m->camera, sizeof m->camera);
    seq_json_get_text(root, "renderer", m->renderer, sizeof m->renderer);
    seq_json_get_crc(root, "source_crc32", &m->source_crc32);
    seq_json_get_crc(root, "inputs_crc32", &m->inputs_crc32);
    if (m->scene[0] == '\0')
        return base_fail(err, BASE_EINVAL, "%s: the scene has no name", path);
    int rc = get_sizes(path, root, m, err);
    if (!rc)
        rc = get_view(path, root, m, err);
    return rc ? rc : get_levels(path, root, version == 1, m, err);
}

static int get_all(const char *path, const cJSON *root, struct seq_manifest *m, struct base_err *err)
{
    int rc = seq_json_get_head(path, root, 1, m, err);
    if (!rc && !seq_json_get_u32(root, "block", 1, SEQ_MAX_SIDE, &m->block))
        rc = base_fail(err, BASE_EINVAL, "%s: width, height or block is missing or out of range", path);
    return !rc ? get_blocks(path, root, m, err) : rc;
}

int seq_manifest_parse(const char *path, const char *text, size_t size, struct seq_manifest *out, struct base_err *err)
{
    struct seq_manifest m = {0};
    cJSON *root = cJSON_ParseWithLength(text, size);
    int rc = get_all(path, root, &m, err);
    cJSON_Delete(root);
    if (rc)
        seq_manifest_release(&m);
    else
        *out = m;
    return rc;
}

int seq_json_read(const char *dir, char path[4096], char **text, size_t *size, struct base_err *err)
{
    int rc = base_file_join(path, dir, "manifest.json", err);
    return rc ? rc : base_file_read(path, MAX_TEXT, text, size, err);
}

int seq_manifest_read(const char *dir, struct seq_manifest *m, struct base_err *err)
{
    char path[4096], *text;
    size_t size;
    int rc = seq_json_read(dir, path, &text, &size, err);
    if (rc)
        return rc;
    rc = seq_manifest_parse(path, text, size, m, err);
    free(text);
    return rc;
}

void seq_json_put_crc(cJSON *to, const char *name, uint32_t crc, int *failed)
{
    char text[16];
    snprintf(text, sizeof text, "%08x", crc);
    base_json_text(to, name, text, failed);
}

static void put_block(cJSON *blocks, const struct seq_manifest_block *b, int *failed)
{
    cJSON *o = base_json_object(blocks, NULL, failed);
    base_json_number(o, "id", b->id, failed);
    base_json_number(o, "x0", b->x0, failed);
    base_json_number(o, "y0", b->y0, failed);
    base_json_number(o, "x1", b->x1, failed);
    base_json_number(o, "y1", b->y1, failed);
    base_json_text(o, "file", b->file, failed);
    base_json_number(o, "bytes", (double)b->bytes, failed);
    seq_json_put_crc(o, "crc32", b->crc32, failed);
    if (b->seconds > 0)
        base_json_number(o, "seconds", b->seconds, failed);
    if (b->dropped > 0)
        base_json_number(o, "dropped", (double)b->dropped, failed);
}

void seq_json_put_head(cJSON *root, int version, const struct seq_manifest *m, int *failed)
{
    base_json_text(root, "format", "lull-sequence", failed);
    base_json_number(root, "version", version, failed);
    base_json_text(root, "scene", m->scene, failed);
    base_json_text(root, "source", m->source, failed);
    if (m->source_crc32)
        seq_json_put_crc(root, "source_crc32", m->source_crc32, failed);
    if (m->inputs_crc32)
        seq_json_put_crc(root, "inputs_crc32", m->inputs_crc32, failed);
    base_json_text(root, "camera", m->camera, failed);
    if (m->has_look_at)
        base_json_numbers(root, "look_at", m->look_at, 9, failed);
    if (m->fov_deg > 0)
        base_json_number(root, "fov", m->fov_deg, failed);
    base_json_text(root, "renderer", m->renderer, failed);
    base_json_number(root, "width", m->width, failed);
    base_json_number(root, "height", m->height, failed);
    if (m->block > 0)
        base_json_number(root, "block", m->block, failed);
    base_json_number(root, "seed", (double)m->seed, failed);
    base_json_number(root, "reference_seed", (double)m->reference_seed, failed);
    base_json_number(root, "reference_spp", m->reference_spp, failed);
    if (!m->reference_independent)
        base_json_bool(root, "reference_independent", 0, failed);
    cJSON *levels = base_json_array(root, "levels", failed);
    for (uint32_t i = 0; i < m->n_levels; i++)
        base_json_number(levels, NULL, m->levels[i], failed);
}

static void put_all(cJSON *root, const struct seq_manifest *m, int *failed)
{
    seq_json_put_head(root, 1, m, failed);
    cJSON *blocks = base_json_array(root, "blocks", failed);
    for (uint32_t i = 0; i < m->n_blocks; i++)
        put_block(blocks, &m->blocks[i], failed);
}

int seq_manifest_write(const char *dir, const struct seq_manifest *m, struct base_err *err)
{
    char path[4096];
    int failed = 0, rc = base_file_join(path, dir, "manifest.json", err);
    if (rc)
        return rc;
    cJSON *root = cJSON_CreateObject();
    put_all(root, m, &failed);
    rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    return rc;
}

void seq_manifest_identity(const struct seq_manifest *m, struct base_identity *to)
{
    base_identity_add(to, "scene", "%s", m->scene);
    base_identity_add(to, "source_crc32", "%08x", m->source_crc32);
    base_identity_add(to, "inputs_crc32", "%08x", m->inputs_crc32);
    base_identity_add(to, "camera", "%s", m->camera);
    base_identity_add_reals(to, "look_at", m->look_at, m->has_look_at ? 9 : 0);
    base_identity_add(to, "fov", "%.17g", m->fov_deg);
    base_identity_add(to, "renderer", "%s", m->renderer);
    base_identity_add(to, "width", "%u", m->width);
    base_identity_add(to, "height", "%u", m->height);
    base_identity_add(to, "block", "%u", m->block);
    base_identity_add(to, "seed", "%" PRIu64, m->seed);
    base_identity_add(to, "reference_seed", "%" PRIu64, m->reference_seed);
    base_identity_add(to, "reference_spp", "%u", m->reference_spp);
    base_identity_add(to, "reference_independent", "%d", m->reference_independent);
    for (uint32_t i = 0; i < m->n_levels; i++)
        base_identity_add(to, "level", "%u", m->levels[i]);
}

uint32_t seq_manifest_find(const struct seq_manifest *m, uint32_t id)
{
    uint32_t i = 0;
    while (i < m->n_blocks && m->blocks[i].id != id)
        i++;
    return i;
}

int seq_manifest_read_block(const char *dir, const struct seq_manifest *m, uint32_t index, struct seq_block *block,
                            struct base_err *err)
{
    const struct seq_manifest_block *e = &m->blocks[index];
    struct seq_block b;
    char path[4096];
    int rc = base_file_join(path, dir, e->file, err);
    if (!rc)
        rc = seq_block_read(path, &b, err);
    if (rc)
        return rc;
    if (b.size != e->bytes || (uint32_t)crc32_z(0, b.bytes, b.size) != e->crc32)
        rc = base_fail(err, BASE_EINVAL, "%s: not the file that the manifest lists (size or CRC)", path);
    else if (b.id != e->id || b.x0 != (int32_t)e->x0 || b.y0 != (int32_t)e->y0 || b.width != e->x1 - e->x0 ||
             b.height != e->y1 - e->y0)
        rc = base_fail(err, BASE_EINVAL, "%s: block %u is %ux%u at %d,%d, the manifest says otherwise", path, b.id, b.width,
                       b.height, b.x0, b.y0);
    else if (m->reference_spp > 0 && !b.reference)
        rc = base_fail(err, BASE_EINVAL, "%s: the reference is missing", path);
    for (uint32_t i = 0; i < m->n_levels && !rc; i++)
        if (!seq_level(&b, m->levels[i]))
            rc = base_fail(err, BASE_EINVAL, "%s: the level at %u spp is missing", path, m->levels[i]);
    if (rc) {
        seq_block_release(&b);
        return rc;
    }
    *block = b;
    return 0;
}
