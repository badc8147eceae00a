#include "data/thresholds.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"
#include "base/list.h"
#include "base/options.h"
#include "base/text.h"
#include "picture/read.h"
#include "sequence/simulate.h"
#include "sight/view_name.h"

enum { MAX_TEXT = 1 << 26, MAX_VIEWS = 1 << 20, SHOWN = 40 }; /* SHOWN: bytes of a value in a message */

void ggn_thresholds_release(struct ggn_thresholds *t)
{
    for (int i = 0; i < t->n; i++)
        free(t->views[i].spp);
    free(t->views);
    *t = (struct ggn_thresholds){0};
}

const struct ggn_view *ggn_thresholds_of(const struct ggn_thresholds *t, const char *view)
{
    const struct ggn_view *same = NULL;
    for (int i = t->n - 1; i >= 0; i--) {
        if (strcmp(t->views[i].name, view) == 0)
            return &t->views[i];
        if (ggn_view_is(t->views[i].name, view))
            same = &t->views[i];
    }
    return same;
}

/* Appends a view with room for n blocks, all unknown. NULL: out of memory. */
static struct ggn_view *add_view(struct ggn_thresholds *t, const char *name, int n)
{
    if ((t->n & (t->n - 1)) == 0) {
        size_t room = t->n == 0 ? 1 : 2 * (size_t)t->n;
        struct ggn_view *views = realloc(t->views, room * sizeof *views);
        if (!views)
            return NULL;
        t->views = views;
    }
    struct ggn_view *v = &t->views[t->n];
    *v = (struct ggn_view){.n = n, .spp = malloc((size_t)n * sizeof *v->spp)};
    if (!v->spp)
        return NULL;
    snprintf(v->name, sizeof v->name, "%s", name);
    for (int i = 0; i < n; i++)
        v->spp[i] = (double)NAN;
    t->n++;
    return v;
}

static int parse_line(const char *path, size_t number, char *line, struct ggn_thresholds *t, struct base_err *err)
{
    char *sep = strchr(line, ';');
    if (!sep || sep == line || sep - line >= GGN_VIEW_NAME)
        return base_fail(err, BASE_EINVAL, "%s:%zu: expected NAME;T0;T1;…", path, number);
    *sep = '\0';
    int n = 0;
    for (const char *p = sep + 1; *p != '\0'; p++)
        n += *p == ';';
    n += sep[1] != '\0' && sep[strlen(sep + 1)] != ';'; /* a last value without its ';' */
    if (n < 1 || n > GGN_VIEW_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s:%zu: %d thresholds", path, number, n);
    struct ggn_view *v = add_view(t, line, n);
    if (!v)
        return base_fail_nomem(err, path);
    char *at = sep + 1;
    for (int i = 0; i < n; i++) {
        char *end;
        double value = strtod(at, &end);
        if (end == at || !(value > 0.0 && value < 1e12) || (*end != ';' && *end != '\0'))
            return base_fail(err, BASE_EINVAL, "%s:%zu: '%.*s' is not a positive number (threshold %d)", path, number,
                             (int)(strcspn(at, ";") < SHOWN ? strcspn(at, ";") : SHOWN), at, i);
        v->spp[i] = value;
        at = end + 1;
    }
    return 0;
}

int ggn_thresholds_parse_csv(const char *path, char *text, size_t size, struct ggn_thresholds *out, struct base_err *err)
{
    struct ggn_thresholds t = {0};
    struct base_lines lines;
    const char *line;
    size_t length;
    base_lines_init(&lines, path, text, size);
    int rc;
    while (!(rc = base_lines_next(&lines, &line, &length, err)) && line) {
        char *own = text + (line - text);
        own[length] = '\0';
        if (length == 0 || own[0] == '#')
            continue;
        rc = t.n < MAX_VIEWS ? parse_line(path, lines.number, own, &t, err)
                             : base_fail(err, BASE_EINVAL, "%s: too many lines", path);
        if (rc)
            break;
    }
    if (!rc && t.n == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: no thresholds in it", path);
    const char *twice;
    int repeated = rc ? 0 : base_unique_texts(t.views->name, sizeof *t.views, (size_t)t.n, &twice);
    if (repeated)
        rc = repeated > 0 ? base_fail(err, BASE_EINVAL, "%s: view '%s' appears twice", path, twice)
                          : base_fail_nomem(err, path);
    for (int i = 0; i < t.n; i++)
        t.views[i].of_study = 1;
    if (rc)
        ggn_thresholds_release(&t);
    else
        *out = t;
    return rc;
}

/* Labels of people are thresholds of their study, unless they were converted (ggn label --human): then they end at the cap
 * of what is simulated. */
static int json_is_of_study(const cJSON *root)
{
    const cJSON *source = cJSON_GetObjectItemCaseSensitive(root, "source");
    double cap;
    return cJSON_IsString(source) && (strcmp(source->valuestring, "people") == 0 ||
                                      (strcmp(source->valuestring, "human") == 0 &&
                                       !(base_json_get(root, "cap", 0, 1e12, &cap) && cap == (double)SEQ_SIMULATED_CAP)));
}

/* Reports name their blocks by id; ids may be any subset of the grid. */
static int list_json(const char *path, const cJSON *root, struct ggn_thresholds *t, struct base_err *err)
{
    const cJSON *blocks = cJSON_GetObjectItemCaseSensitive(root, "blocks"), *block;
    const cJSON *scene = cJSON_GetObjectItemCaseSensitive(root, "scene");
    int last = -1, columns = 0;
    if (!cJSON_IsArray(blocks))
        return base_fail(err, BASE_EINVAL, "%s: not a report: no list of blocks", path);
    cJSON_ArrayForEach (block, blocks) {
        const cJSON *id = cJSON_GetObjectItemCaseSensitive(block, "id");
        const cJSON *y0 = cJSON_GetObjectItemCaseSensitive(block, "y0");
        if (!cJSON_IsNumber(id) || !(id->valuedouble >= 0 && id->valuedouble < GGN_VIEW_BLOCKS) ||
            id->valuedouble != id->valueint)
            return base_fail(err, BASE_EINVAL, "%s: a block without a usable id", path);
        last = id->valueint > last ? id->valueint : last;
        columns += cJSON_IsNumber(y0) && y0->valuedouble == 0.0;
    }
    if (last < 0)
        return base_fail(err, BASE_EINVAL, "%s: no blocks in it", path);
    const char *name = cJSON_IsString(scene) ? scene->valuestring : path, *dot = strrchr(name, '.');
    char of_file[GGN_VIEW_NAME];
    if (dot && strcmp(dot, ".pbrt") == 0) { /* as the stop map of that render calls it */
        base_view_name(name, of_file, sizeof of_file);
        name = of_file;
    }
    struct ggn_view *v = add_view(t, name, last + 1);
    if (!v)
        return base_fail_nomem(err, path);
    v->columns = columns;
    v->unnamed = !cJSON_IsString(scene);
    v->of_study = json_is_of_study(root);
    cJSON_ArrayForEach (block, blocks) {
        const cJSON *id = cJSON_GetObjectItemCaseSensitive(block, "id");
        const cJSON *spp = cJSON_GetObjectItemCaseSensitive(block, "threshold");
        if (!spp)
            spp = cJSON_GetObjectItemCaseSensitive(block, "spp");
        if (!cJSON_IsNumber(spp) || !(spp->valuedouble > 0.0 && spp->valuedouble < 1e12))
            return base_fail(err, BASE_EINVAL, "%s: block %d: spp %g (expected a number above 0, below 1e12)", path,
                             id->valueint, cJSON_IsNumber(spp) ? spp->valuedouble : (double)NAN);
        if (!isnan(v->spp[id->valueint]))
            return base_fail(err, BASE_EINVAL, "%s: block %d appears twice", path, id->valueint);
        v->spp[id->valueint] = spp->valuedouble;
    }
    return 0;
}

/* One value per block: the largest in the block (a block is one value; the largest forgives borders that are filtered).
 * Blocks are those of the whole picture, of which the file may hold a crop, and of the size that the file says. */
static int list_stop_map(const char *path, const struct pic_image *image, const int asked[2], struct ggn_thresholds *t,
                         struct base_err *err)
{
    struct pic_window w;
    struct pic_attribute size = {.name = "lull:block"};
    int block[2] = {asked[0], asked[1]};
    const int found =
        pic_read_header(path, &w, &size, 1, NULL) == 0 && w.x1 - w.x0 == image->width && w.y1 - w.y0 == image->height;
    if (found && size.text[0] && !base_parse_block(size.text, PIC_MAX_SIDE, block))
        return base_fail(err, BASE_EINVAL, "%s: lull:block is '%.40s' (expected the size of its blocks, as 200x200)", path,
                         size.text);
    const int left = found ? w.x0 % block[0] : 0, top = found ? w.y0 % block[1] : 0; /* of the first pixel in its block */
    const long columns = (left + image->width + block[0] - 1L) / block[0],
               rows = (top + image->height + block[1] - 1L) / block[1];
    if (columns * rows > GGN_VIEW_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: %ld blocks of %dx%d pixels", path, columns * rows, block[0], block[1]);
    struct ggn_view *v = add_view(t, base_file_name(path), (int)(columns * rows));
    if (!v)
        return base_fail_nomem(err, path);
    v->columns = (int)columns;
    v->unnamed = 1;
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            double *s = &v->spp[(top + y) / block[1] * columns + (left + x) / block[0]];
            double value = (double)image->f32[(size_t)y * (size_t)image->width + (size_t)x];
            if (!(*s >= value))
                *s = value;
        }
    for (int i = 0; i < v->n; i++)
        if (!(v->spp[i] > 0.0 && v->spp[i] < 1e12))
            return base_fail(err, BASE_EINVAL, "%s: block %d: spp %g (expected a number above 0, below 1e12)", path, i,
                             v->spp[i]);
    return 0;
}

static int read_text(const char *path, int is_json, struct ggn_thresholds *t, struct base_err *err)
{
    char *text;
    size_t size;
    int rc = base_file_read(path, MAX_TEXT, &text, &size, err);
    if (rc)
        return rc;
    if (is_json) {
        cJSON *root = cJSON_ParseWithLength(text, size);
        rc = list_json(path, root, t, err);
        cJSON_Delete(root);
    } else
        rc = ggn_thresholds_parse_csv(path, text, size, t, err);
    free(text);
    return rc;
}

int ggn_thresholds_read(const char *path, const int block[2], struct ggn_thresholds *out, struct base_err *err)
{
    struct ggn_thresholds t = {0};
    struct pic_image image = {0};
    int rc;
    if (base_file_has_ending(path, "exr")) {
        rc = pic_read_channel(path, "lull.spp.V", &image, err);
        if (!rc)
            rc = list_stop_map(path, &image, block, &t, err);
        pic_release(&image);
    } else
        rc = read_text(path, base_file_has_ending(path, "json"), &t, err);
    if (rc)
        ggn_thresholds_release(&t);
    else
        *out = t;
    return rc;
}

int ggn_thresholds_label(const struct ggn_view *row, const struct seq_manifest *m, struct ggn_labels *out,
                         struct base_err *err)
{
    const uint32_t tiles = (m->width + m->block - 1) / m->block * ((m->height + m->block - 1) / m->block);
    struct ggn_labels l = {.source = "human", .cap = m->levels[m->n_levels - 1], .spread = GGN_LABELS_SPREAD};
    if ((uint32_t)row->n != tiles)
        return base_fail(err, BASE_EINVAL, "%u blocks, but %d thresholds for '%s'", tiles, row->n, row->name);
    l.labels = malloc((m->n_blocks ? m->n_blocks : 1) * sizeof *l.labels);
    if (!l.labels)
        return base_fail_nomem(err, "labels");
    for (uint32_t i = 0; i < m->n_blocks; i++) {
        const uint32_t id = m->blocks[i].id;
        const double spp = id < (uint32_t)row->n ? row->spp[id] : (double)NAN;
        if (!(spp > 0)) {
            free(l.labels);
            return base_fail(err, BASE_EINVAL, "block %u has no threshold in '%s'", id, row->name);
        }
        l.labels[l.n++] = (struct ggn_label){id, spp, spp >= l.cap};
    }
    snprintf(l.detail, sizeof l.detail, "thresholds of '%s'", row->name);
    *out = l;
    return 0;
}
