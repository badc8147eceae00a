#include "data/series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "sight/stats.h"
#include "sequence/simulate.h"

enum { MAX_CHAINS = 1 << 16 };

size_t ggn_series_set_values(const struct ggn_series_set *set) { return 3 * (size_t)set->width * (size_t)set->height; }

void ggn_series_set_release(struct ggn_series_set *set)
{
    for (int i = 0; i < set->n; i++) {
        struct ggn_level_series *c = &set->series[i];
        free(c->spp);
        free(c->noisy);
        free(c->denoised);
        if (!c->synthetic)
            free(c->reference);
        free(c->noise_map);
        free(c->has_noise_map);
        free(c->measure);
    }
    free(set->series);
    ggn_meter_release(&set->meter);
    ggn_dataset_release(&set->data);
    *set = (struct ggn_series_set){0};
}

int ggn_series_set_count(const struct ggn_series_set *set, enum ggn_split split, int real_only)
{
    int n = 0;
    for (int i = 0; i < set->n; i++)
        n += set->series[i].split == split && !(real_only && set->series[i].synthetic);
    return n;
}

int ggn_series_set_append(struct ggn_series_set *set, struct base_err *err)
{
    if (set->n == MAX_CHAINS)
        return base_fail(err, BASE_EINVAL, "more than %d blocks", MAX_CHAINS);
    if ((set->n & (set->n - 1)) == 0) {
        struct ggn_level_series *more = realloc(set->series, (set->n ? 2 * (size_t)set->n : 1) * sizeof *more);
        if (!more)
            return base_fail_nomem(err, "blocks");
        set->series = more;
    }
    set->series[set->n++] = (struct ggn_level_series){0};
    return 0;
}

uint32_t ggn_series_set_crc(const struct ggn_series_set *set)
{
    const size_t values = ggn_series_set_values(set);
    uLong crc = crc32(0, NULL, 0);
    for (int i = 0; i < set->n; i++) {
        const struct ggn_level_series *c = &set->series[i];
        const double what[] = {c->split, c->block, c->n_levels, c->has_label ? c->label.threshold : -1};
        crc = crc32_z(crc, (const Bytef *)what, sizeof what);
        if (c->n_levels > 0)
            crc = crc32_z(crc, c->noisy, (size_t)c->n_levels * values);
        if (c->reference)
            crc = crc32_z(crc, c->reference, values);
        for (int k = 0; c->noise_map && k < c->n_levels; k++) {
            crc = crc32_z(crc, &c->has_noise_map[k], 1);
            if (c->has_noise_map[k]) /* otherwise nobody has written it */
                crc = crc32_z(crc, c->noise_map + (size_t)k * (values / 3), values / 3);
        }
    }
    return (uint32_t)crc;
}

int ggn_series_grow(const struct ggn_series_set *set, struct ggn_level_series *c, int levels, struct base_err *err)
{
    const size_t n = (size_t)levels, values = ggn_series_set_values(set);
    uint8_t **const images[] = {&c->noisy, &c->has_noise_map, &c->noise_map};
    const size_t bytes[] = {values, 1, values / 3};
    double *spp = realloc(c->spp, n * sizeof *spp);
    if (!spp)
        return base_fail_nomem(err, "images of the data set");
    c->spp = spp;
    struct ggn_measure *measure = set->meter.memory ? realloc(c->measure, n * sizeof *measure) : NULL;
    if (set->meter.memory && !measure)
        return base_fail_nomem(err, "images of the data set");
    c->measure = measure;
    for (size_t i = 0; i < (set->noise_maps ? 3 : 2); i++) {
        uint8_t *grown = realloc(*images[i], n * bytes[i]);
        if (!grown)
            return base_fail_nomem(err, "images of the data set");
        *images[i] = grown;
    }
    return 0;
}

void ggn_series_measure(const struct ggn_series_set *set, struct ggn_level_series *c, int k, const float *mean,
                        const float *d, double scale, int keep_texture)
{
    const size_t values = ggn_series_set_values(set);
    for (int i = 0; i < 2; i++)
        seq_simulate(mean, d, values, i ? -scale : scale, set->meter.rgb[i]);
    ggn_measure(&set->meter, set->width, set->height, 0.5, keep_texture, &c->measure[k],
                set->noise_maps ? c->noise_map + values / 3 * (size_t)k : NULL);
    c->has_noise_map[k] = set->noise_maps != 0;
}

/* mean: with set->meter scratch, [2][3][P]: mean and D of a level. */
static int fill_levels(const struct ggn_series_set *set, struct ggn_level_series *c, const struct seq_block *b, double ratio,
                       float *mean, struct base_err *err)
{
    const size_t values = ggn_series_set_values(set);
    double wanted = 0;
    int rc = 0;
    for (uint32_t i = 0; !rc && i < b->n_levels; i++) {
        const struct seq_record *r = &b->levels[i];
        if (ratio > 1 && c->n_levels && r->spp < wanted - 0.5)
            continue;
        wanted = 0.999 * ratio * r->spp; /* recorded levels are rounded to whole samples */
        const int k = c->n_levels++;
        c->spp[k] = r->spp;
        c->has_noise_map[k] = 0;
        rc = seq_display_planar(b, r, c->noisy + (size_t)k * values, err);
        if (rc || !set->meter.memory)
            continue;
        c->measure[k] = (struct ggn_measure){.visible = (double)NAN};
        if (!seq_has_halves(r))
            continue;
        rc = seq_halves(b, r, mean, mean + values, err); /* its own: what the criterion sees there */
        if (!rc)
            ggn_series_measure(set, c, k, mean, mean + values, seq_half_scale(r->spp, r->half_spp), 0);
    }
    return rc;
}

static int fill_series(const struct ggn_series_set *set, struct ggn_level_series *c, const struct seq_block *b,
                       const struct ggn_series_set_options *o, struct base_err *err)
{
    const size_t values = ggn_series_set_values(set);
    const struct seq_record *reference = b->reference ? b->reference : seq_full_level(b);
    const int wanted = set->meter.memory != NULL;
    float *mean = wanted ? malloc(2 * values * sizeof *mean) : NULL;
    int rc = wanted && !mean ? base_fail_nomem(err, "noise pictures") : ggn_series_grow(set, c, (int)b->n_levels, err);
    if (!rc)
        rc = fill_levels(set, c, b, o->ratio, mean, err);
    free(mean);
    c->has_reference = b->reference != NULL;
    if (rc || !reference)
        return rc;
    c->reference = malloc(values);
    return c->reference ? seq_display_planar(b, reference, c->reference, err) : base_fail_nomem(err, "a reference");
}

static int load_block(struct ggn_series_set *set, int view, uint32_t index, const struct ggn_series_set_options *o,
                      struct base_err *err)
{
    const struct ggn_dataset_view *v = &set->data.views[view];
    struct seq_block b;
    int rc = seq_manifest_read_block(v->dir, &v->manifest, index, &b, err);
    if (rc)
        return rc;
    if (!set->width) {
        set->width = (int)b.width;
        set->height = (int)b.height;
        struct ggn_meter_room room = {0};
        ggn_meter_make_room(&room, set->width, set->height);
        rc = o->measures ? ggn_meter_init(&set->meter, &room, err) : 0;
    }
    if (!rc && ((int)b.width != set->width || (int)b.height != set->height))
        rc = base_fail(err, BASE_EINVAL, "%s/%s: a block of %ux%u pixels among blocks of %dx%d", v->dir,
                       v->manifest.blocks[index].file, b.width, b.height, set->width, set->height);
    if (!rc)
        rc = ggn_series_set_append(set, err);
    if (!rc) {
        struct ggn_level_series *c = &set->series[set->n - 1];
        const struct ggn_label *label = v->has_labels ? ggn_labels_find(&v->labels, b.id) : NULL;
        c->view = view;
        c->scene = v->scene;
        c->split = v->split;
        c->block = b.id;
        c->has_label = label != NULL;
        if (label)
            c->label = *label;
        c->spread = v->has_labels ? v->labels.spread : 0;
        rc = fill_series(set, c, &b, o, err);
    }
    seq_block_release(&b);
    return rc;
}

/* The spacing of the longest series: equal steps when its first step is its last, else the median ratio of its upper half,
 * where rounding to whole samples matters least. */
static void find_spacing(struct ggn_series_set *set)
{
    const struct ggn_level_series *longest = &set->series[0];
    double ratio[SEQ_MAX_RECORDS];
    size_t n = 0;
    for (int i = 1; i < set->n; i++)
        if (set->series[i].n_levels > longest->n_levels)
            longest = &set->series[i];
    set->first_spp = longest->spp[0];
    if (longest->n_levels < 2)
        return;
    const double *spp = longest->spp;
    int count = longest->n_levels;
    if (count > 2 && spp[1] - spp[0] == spp[count - 1] - spp[count - 2]) {
        set->step_spp = spp[1] - spp[0];
        return;
    }
    for (int i = count / 2 > 0 ? count / 2 : 1; i < count; i++)
        ratio[n++] = spp[i] / spp[i - 1];
    ggn_stats_sort(ratio, n);
    set->ratio = ratio[n / 2];
    struct ggn_policy pace = {0};
    ggn_series_set_pace(set, &pace);
    ggn_policy_set_levels(&pace, spp, count);
    set->n_levels = pace.n_levels;
    memcpy(set->level, pace.level, sizeof pace.level);
}

void ggn_series_set_pace(const struct ggn_series_set *set, struct ggn_policy *p)
{
    p->first_spp = set->first_spp;
    p->ratio = set->ratio > 1.001 ? set->ratio : 0;
    p->step_spp = set->step_spp;
    p->n_levels = set->n_levels;
    memcpy(p->level, set->level, sizeof p->level);
}

int ggn_series_set_load(struct ggn_series_set *set, const struct ggn_series_set_options *o, struct base_err *err)
{
    struct ggn_series_set made = {.noise_maps = o->measures && o->noise_maps, .keep_recorded = o->keep_recorded};
    int rc = ggn_dataset_open(o->dir, &made.data, err), training = 0;
    if (rc)
        return rc;
    rc = ggn_split_choose(&made.data, &o->split, &made.split_source, err);
    for (int i = 0; i < made.data.n; i++)
        training += made.data.views[i].split == GGN_SPLIT_TRAIN;
    if (!rc && !training && !o->with_test)
        rc = base_fail(err, BASE_EINVAL,
                       "%s: no scene is left to train on: all are for validation, for test or not in the split", o->dir);
    for (int i = 0; !rc && i < made.data.n; i++) {
        const struct ggn_dataset_view *v = &made.data.views[i];
        int apart = v->split == GGN_SPLIT_TEST || v->split == GGN_SPLIT_PEOPLE;
        int wanted = v->split == GGN_SPLIT_TRAIN || v->split == GGN_SPLIT_VALIDATION || (apart && o->with_test);
        for (uint32_t k = 0; !rc && wanted && k < v->manifest.n_blocks; k++)
            rc = load_block(&made, i, k, o, err);
    }
    if (!rc && !made.n)
        rc = base_fail(err, BASE_EINVAL, "%s: no blocks to learn from", o->dir);
    if (rc) {
        ggn_series_set_release(&made);
        return rc;
    }
    find_spacing(&made);
    *set = made;
    return 0;
}
