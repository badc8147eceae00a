#include "sequence/recording.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>

#include "base/files.h"
#include "base/json.h"
#include "base/list.h"
#include "sequence/manifest_json.h"

enum { MAX_BLOCKS = 1 << 20, MAX_FILES = 1 << 20, MAX_SPP = INT32_MAX };

/* Names of planes, by number from SEQ_PLANE_COLOR on; of parts. */
static const char *const plane_names[] = {"color",  "weight",   "spp",           "moment2",       "half",
                                          "albedo", "normal",   "depth",         "dropped",       "dropped_half",
                                          "rest",   "denoised", "denoised_half", "denoised_rest", NULL};
static const char *const part_names[] = {"looks", "beyond", "reference", "added", NULL};

static int index_of(const char *const *words, const cJSON *v)
{
    int i = 0;
    while (words[i] && cJSON_IsString(v) && strcmp(words[i], v->valuestring) != 0)
        i++;
    return cJSON_IsString(v) && words[i] ? i : -1;
}

/* Bits 1 << (first + index) of an array of words; 0: it is none, or has others. */
static int get_mask(const cJSON *root, const char *name, const char *const *words, uint32_t *mask)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(root, name), *v;
    *mask = 0;
    cJSON_ArrayForEach (v, list) {
        const int i = index_of(words, v);
        if (i < 0)
            return 0;
        *mask |= 1u << i;
    }
    return cJSON_IsArray(list);
}

static int get_frame(const cJSON *o, struct seq_recording_frame *f)
{
    const cJSON *matrix = cJSON_GetObjectItemCaseSensitive(o, "rgb_to_xyz"), *v;
    int n = 0;
    cJSON_ArrayForEach (v, matrix) {
        if (!cJSON_IsNumber(v) || n == 9)
            return 0;
        f->rgb_to_xyz[n++] = v->valuedouble;
    }
    return n == 9 && seq_json_get_u32(o, "flags", 0, UINT32_MAX, &f->flags) &&
           seq_json_get_text(o, "transfer", f->transfer, sizeof f->transfer) &&
           base_json_get(o, "gamma", 0, HUGE_VAL, &f->gamma) && base_json_get(o, "exposure", 0, HUGE_VAL, &f->exposure) &&
           f->exposure > 0 && base_json_get(o, "sample_clamp", 0, HUGE_VAL, &f->sample_clamp) &&
           base_json_get(o, "max_seam", 0, HUGE_VAL, &f->max_seam) &&
           base_json_get_whole(o, "spp_min", 1, MAX_SPP, &f->spp_min) &&
           base_json_get_whole(o, "spp_max", (double)f->spp_min, MAX_SPP, &f->spp_max);
}

static int get_rectangles(const char *path, const cJSON *root, struct seq_manifest *m, struct base_err *err)
{
    const cJSON *blocks = cJSON_GetObjectItemCaseSensitive(root, "blocks"), *b, *v;
    const int n = cJSON_GetArraySize(blocks);
    if (!cJSON_IsArray(blocks) || n < 1 || n > MAX_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: no list of blocks", path);
    m->blocks = calloc((size_t)n, sizeof *m->blocks);
    if (!m->blocks)
        return base_fail_nomem(err, path);
    cJSON_ArrayForEach (b, blocks) {
        double at[4] = {-1, -1, -1, -1};
        int k = 0;
        cJSON_ArrayForEach (v, b)
            if (k < 4 && cJSON_IsNumber(v))
                at[k++] = v->valuedouble;
        if (k != 4 || cJSON_GetArraySize(b) != 4 || !(at[0] >= 0 && at[0] < at[2] && at[2] <= m->width) ||
            !(at[1] >= 0 && at[1] < at[3] && at[3] <= m->height) || at[2] - at[0] > SEQ_MAX_SIDE ||
            at[3] - at[1] > SEQ_MAX_SIDE)
            return base_fail(err, BASE_EINVAL, "%s: block %u is no rectangle of the picture", path, m->n_blocks);
        m->blocks[m->n_blocks] = (struct seq_manifest_block){
            .id = m->n_blocks, .x0 = (uint32_t)at[0], .y0 = (uint32_t)at[1], .x1 = (uint32_t)at[2], .y1 = (uint32_t)at[3]};
        m->n_blocks++;
    }
    return 0;
}

static int get_files(const char *path, const cJSON *root, struct seq_recording *m, struct base_err *err)
{
    const cJSON *files = cJSON_GetObjectItemCaseSensitive(root, "files"), *v;
    const char *twice;
    if (!cJSON_IsArray(files) || cJSON_GetArraySize(files) > MAX_FILES)
        return base_fail(err, BASE_EINVAL, "%s: no list of files", path);
    cJSON_ArrayForEach (v, files) {
        struct seq_recording_file f = {0};
        const int part = index_of(part_names, cJSON_GetObjectItemCaseSensitive(v, "part"));
        if (part < 0 || !seq_json_get_text(v, "file", f.name, sizeof f.name) || f.name[0] == '\0' || f.name[0] == '.' ||
            strchr(f.name, '/') || !base_json_get_whole(v, "bytes", 1, SEQ_MAX_FILE, &f.bytes) ||
            !seq_json_get_crc(v, "crc32", &f.crc32) ||
            (part == SEQ_PART_ADDED && !seq_json_get_text(v, "layer", f.layer, sizeof f.layer)))
            return base_fail(err, BASE_EINVAL, "%s: entry %u of files is not usable", path, m->n_files);
        f.part = (enum seq_part)part;
        const int rc = seq_recording_add(m, &f, err);
        if (rc)
            return rc;
    }
    const int rc = m->n_files > 0 ? base_unique_texts(m->files->name, sizeof *m->files, m->n_files, &twice) : 0;
    if (rc > 0)
        return base_fail(err, BASE_EINVAL, "%s: file %s is listed twice", path, twice);
    return rc ? base_fail_nomem(err, path) : 0;
}

/* Lines of an object of texts; 0: it is none, or they have no room. */
static int get_parameters(const cJSON *o, char *out, size_t room)
{
    const cJSON *v;
    size_t used = 0;
    cJSON_ArrayForEach (v, o) {
        if (!cJSON_IsString(v) || strchr(v->valuestring, '\n') || strpbrk(v->string, "=\n"))
            return 0;
        const int n = snprintf(out + used, room - used, "%s=%s\n", v->string, v->valuestring);
        if (n >= (int)(room - used))
            return 0;
        used += (size_t)n;
    }
    return cJSON_IsObject(o);
}

static int get_criterion(const char *path, const cJSON *root, struct seq_recording *m, struct base_err *err)
{
    const cJSON *o = cJSON_GetObjectItemCaseSensitive(root, "criterion");
    if (!o || cJSON_IsNull(o))
        return 0;
    if (!seq_json_get_text(o, "spec", m->spec, sizeof m->spec) ||
        !seq_json_get_text(o, "id", m->criterion, sizeof m->criterion) || m->criterion[0] == '\0' ||
        !seq_json_get_text(o, "version", m->version, sizeof m->version) ||
        !get_parameters(cJSON_GetObjectItemCaseSensitive(o, "parameters"), m->parameters, sizeof m->parameters))
        return base_fail(err, BASE_EINVAL, "%s: the criterion is not usable", path);
    return 0;
}

static int get_all(const char *path, const cJSON *root, struct seq_recording *m, struct base_err *err)
{
    int rc = seq_json_get_head(path, root, 2, &m->of, err);
    if (rc)
        return rc;
    if (!get_mask(root, "planes", plane_names, &m->planes) || !(m->planes & 1))
        return base_fail(err, BASE_EINVAL, "%s: no list of planes, color among them", path);
    m->planes <<= SEQ_PLANE_COLOR;
    if (!get_mask(root, "finished", part_names, &m->finished))
        return base_fail(err, BASE_EINVAL, "%s: what is finished is no list of parts", path);
    if (!get_frame(cJSON_GetObjectItemCaseSensitive(root, "frame"), &m->frame))
        return base_fail(err, BASE_EINVAL, "%s: frame is missing or has a number out of range", path);
    rc = get_rectangles(path, root, &m->of, err);
    if (!rc)
        rc = get_criterion(path, root, m, err);
    return rc ? rc : get_files(path, root, m, err);
}

int seq_recording_parse(const char *path, const char *text, size_t size, struct seq_recording *out, struct base_err *err)
{
    struct seq_recording *m = calloc(1, sizeof *m); /* large */
    if (!m)
        return base_fail_nomem(err, path);
    cJSON *root = cJSON_ParseWithLength(text, size);
    int rc = get_all(path, root, m, err);
    cJSON_Delete(root);
    if (rc)
        seq_recording_release(m);
    else
        *out = *m;
    free(m);
    return rc;
}

int seq_recording_read(const char *dir, struct seq_recording *m, struct base_err *err)
{
    char path[4096], *text;
    size_t size;
    int rc = seq_json_read(dir, path, &text, &size, err);
    if (rc)
        return rc;
    rc = seq_recording_parse(path, text, size, m, err);
    free(text);
    return rc;
}

void seq_recording_release(struct seq_recording *m)
{
    seq_manifest_release(&m->of);
    free(m->files);
    *m = (struct seq_recording){0};
}

int seq_recording_add(struct seq_recording *m, const struct seq_recording_file *file, struct base_err *err)
{
    if (m->n_files == m->room) {
        const uint32_t room = 2 * m->room + 16;
        struct seq_recording_file *files = realloc(m->files, room * sizeof *files);
        if (!files)
            return base_fail_nomem(err, "files");
        m->files = files;
        m->room = room;
    }
    m->files[m->n_files++] = *file;
    return 0;
}

static void put_mask(cJSON *root, const char *name, const char *const *words, uint32_t mask, int *failed)
{
    cJSON *list = base_json_array(root, name, failed);
    for (int i = 0; words[i]; i++)
        if (mask >> i & 1)
            base_json_text(list, NULL, words[i], failed);
}

static void put_frame(cJSON *root, const struct seq_recording_frame *f, int *failed)
{
    cJSON *o = base_json_object(root, "frame", failed);
    base_json_number(o, "flags", f->flags, failed);
    base_json_text(o, "transfer", f->transfer, failed);
    base_json_number(o, "gamma", f->gamma, failed);
    base_json_number(o, "exposure", f->exposure, failed);
    base_json_number(o, "sample_clamp", f->sample_clamp, failed);
    base_json_numbers(o, "rgb_to_xyz", f->rgb_to_xyz, 9, failed);
    base_json_number(o, "max_seam", f->max_seam, failed);
    base_json_number(o, "spp_min", (double)f->spp_min, failed);
    base_json_number(o, "spp_max", (double)f->spp_max, failed);
}

static void put_criterion(cJSON *root, const struct seq_recording *m, int *failed)
{
    if (m->criterion[0] == '\0')
        return;
    cJSON *o = base_json_object(root, "criterion", failed);
    base_json_text(o, "spec", m->spec, failed);
    base_json_text(o, "id", m->criterion, failed);
    base_json_text(o, "version", m->version, failed);
    cJSON *parameters = base_json_object(o, "parameters", failed);
    char key[SEQ_TEXT], value[SEQ_TEXT];
    for (const char *line = m->parameters; *line != '\0'; line += strcspn(line, "\n") + 1) {
        const size_t n = strcspn(line, "=");
        snprintf(key, sizeof key, "%.*s", (int)n, line);
        snprintf(value, sizeof value, "%.*s", (int)strcspn(line + n + 1, "\n"), line + n + 1);
        base_json_text(parameters, key, value, failed);
    }
}

static void put_files(cJSON *root, const struct seq_recording *m, int *failed)
{
    cJSON *files = base_json_array(root, "files", failed);
    for (uint32_t i = 0; i < m->n_files; i++) {
        const struct seq_recording_file *f = &m->files[i];
        cJSON *o = base_json_object(files, NULL, failed);
        base_json_text(o, "file", f->name, failed);
        base_json_text(o, "part", part_names[f->part], failed);
        if (f->part == SEQ_PART_ADDED)
            base_json_text(o, "layer", f->layer, failed);
        base_json_number(o, "bytes", (double)f->bytes, failed);
        seq_json_put_crc(o, "crc32", f->crc32, failed);
    }
}

int seq_recording_write(const char *dir, const struct seq_recording *m, struct base_err *err)
{
    char path[4096];
    int failed = 0, rc = base_file_join(path, dir, "manifest.json", err);
    if (rc)
        return rc;
    cJSON *root = cJSON_CreateObject();
    seq_json_put_head(root, 2, &m->of, &failed);
    put_mask(root, "planes", plane_names, m->planes >> SEQ_PLANE_COLOR, &failed);
    put_frame(root, &m->frame, &failed);
    put_criterion(root, m, &failed);
    cJSON *blocks = base_json_array(root, "blocks", &failed);
    for (uint32_t i = 0; i < m->of.n_blocks; i++) {
        const struct seq_manifest_block *b = &m->of.blocks[i];
        base_json_numbers(blocks, NULL, (const double[]){b->x0, b->y0, b->x1, b->y1}, 4, &failed);
    }
    put_mask(root, "finished", part_names, m->finished, &failed);
    put_files(root, m, &failed);
    rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    return rc;
}

void seq_recording_identity(const struct seq_recording *m, struct base_identity *to)
{
    const struct seq_recording_frame *f = &m->frame;
    seq_manifest_identity(&m->of, to);
    base_identity_add(to, "planes", "%x", m->planes);
    base_identity_add(to, "flags", "%x", f->flags);
    base_identity_add(to, "transfer", "%s %.17g", f->transfer, f->gamma);
    base_identity_add(to, "exposure", "%.17g", f->exposure);
    base_identity_add(to, "clamp", "%.17g", f->sample_clamp);
    base_identity_add(to, "max-seam", "%.17g", f->max_seam);
    base_identity_add(to, "spp-min", "%" PRIu64, f->spp_min);
    base_identity_add(to, "spp-max", "%" PRIu64, f->spp_max);
    base_identity_add(to, "criterion", "%s %s", m->criterion, m->version);
    for (const char *line = m->parameters; *line != '\0'; line += strcspn(line, "\n") + 1)
        base_identity_add(to, "param", "%.*s", (int)strcspn(line, "\n"), line);
    for (uint32_t i = 0; i < m->of.n_blocks; i++) {
        const struct seq_manifest_block *b = &m->of.blocks[i];
        base_identity_add(to, "block", "%u,%u,%u,%u", b->x0, b->y0, b->x1, b->y1);
    }
}

int seq_recording_read_look(const char *dir, const struct seq_recording *m, uint32_t index, struct seq_look *look,
                            struct base_err *err)
{
    const struct seq_recording_file *f = &m->files[index];
    struct seq_look l;
    char path[4096];
    int rc = base_file_join(path, dir, f->name, err);
    if (!rc)
        rc = seq_look_read(path, &l, err);
    if (rc)
        return rc;
    if (l.size != f->bytes || (uint32_t)crc32_z(0, l.bytes, l.size) != f->crc32)
        rc = base_fail(err, BASE_EINVAL, "%s: not the file that the manifest lists (size or CRC)", path);
    else if (l.width != m->of.width || l.height != m->of.height)
        rc = base_fail(err, BASE_EINVAL, "%s: a picture of %ux%u, the manifest says otherwise", path, l.width, l.height);
    for (uint32_t i = 0; i < l.count && !rc; i++) {
        const struct seq_record *r = &l.records[i];
        const struct seq_manifest_block *b = r->block < m->of.n_blocks ? &m->of.blocks[r->block] : NULL;
        if (!b || r->x0 != (int32_t)b->x0 || r->y0 != (int32_t)b->y0 || r->width != b->x1 - b->x0 ||
            r->height != b->y1 - b->y0)
            rc = base_fail(err, BASE_EINVAL, "%s: block %u is %ux%u at %d,%d, the manifest says otherwise", path, r->block,
                           r->width, r->height, r->x0, r->y0);
    }
    if (rc)
        seq_look_release(&l);
    else
        *look = l;
    return rc;
}
