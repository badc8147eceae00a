#include "baselines/baseline.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/json.h"
#include "base/options.h"
#include "baselines/blas.h"
#include "baselines/features.h"
#include "baselines/lstm.h"
#include "model/stopper.h"
#include "model/window.h"

const char *const ggn_baseline_names[GGN_BASELINES + 1] = {"svd-entropy", "attributes", "noise-mask", NULL};
const char *const ggn_baseline_titles[GGN_BASELINES] = {"SVD-entropy + LSTM", "26 attributes + SVM", "noise mask + SVM"};

enum { SIDE_MAX = 4096, SUPPORT_MAX = 1 << 20 };

int ggn_baseline_init(struct ggn_baseline *b, enum ggn_baseline_kind kind, int width, int height, int window,
                      struct base_err *err)
{
    const int least = kind == GGN_SVD_ENTROPY ? GGN_SUB_BLOCK : GGN_MASK_GRID;
    if (width < least || height < least || width > SIDE_MAX || height > SIDE_MAX)
        return base_fail(err, BASE_EINVAL, "%s: blocks of %dx%d pixels; it takes %d to %d", ggn_baseline_names[kind], width,
                         height, least, SIDE_MAX);
    if (window < 1 || window > GGN_WINDOW_MAX)
        return base_fail(err, BASE_EINVAL, "%s: windows of %d images; it takes 1 to %d", ggn_baseline_names[kind], window,
                         GGN_WINDOW_MAX);
    *b = (struct ggn_baseline){
        .kind = kind, .width = width, .height = height, .window = window, .policy = ggn_policy_default()};
    b->features = kind == GGN_SVD_ENTROPY      ? ggn_svd_entropy_count(width, height)
                  : kind == GGN_ATTRIBUTES_SVM ? GGN_ATTRIBUTES
                                               : GGN_MASK_FEATURES;
    b->window = kind == GGN_SVD_ENTROPY ? window : 1;
    return 0;
}

void ggn_baseline_release(struct ggn_baseline *b)
{
    free(b->lstm);
    ggn_svm_release(&b->svm);
    *b = (struct ggn_baseline){0};
}

/* The tensors, in order; `values` is where they are or go. */
struct part {
    const char *name;
    int is_weight, rank, dim[2];
    float *values;
};

static int parts_of(const struct ggn_baseline *b, struct part parts[4])
{
    const struct ggn_svm *s = &b->svm;
    if (b->kind == GGN_SVD_ENTROPY) {
        parts[0] = (struct part){"lstm", 1, 1, {(int)ggn_lstm_parameters(b->features), 1}, b->lstm};
        return 1;
    }
    parts[0] = (struct part){"mean", 0, 1, {s->features, 1}, s->mean};
    parts[1] = (struct part){"scale", 0, 1, {s->features, 1}, s->scale};
    parts[2] = (struct part){"coefficient", 0, 1, {s->n_support, 1}, s->coefficient};
    parts[3] = (struct part){"support", 1, 2, {s->n_support, s->features}, s->support};
    return 4;
}

static char *print(const struct ggn_baseline *b, const cJSON *provenance)
{
    cJSON *root = cJSON_CreateObject();
    int failed = !root;
    base_json_text(root, "kind", "baseline", &failed);
    base_json_text(root, "method", ggn_baseline_names[b->kind], &failed);
    base_json_number(root, "width", b->width, &failed);
    base_json_number(root, "height", b->height, &failed);
    base_json_number(root, "window", b->window, &failed);
    base_json_number(root, "first", b->first, &failed);
    if (b->kind != GGN_SVD_ENTROPY) {
        base_json_number(root, "support", b->svm.n_support, &failed);
        base_json_number(root, "gamma", b->svm.gamma, &failed);
        base_json_number(root, "rho", b->svm.rho, &failed);
    }
    ggn_policy_print(base_json_object(root, "policy", &failed), &b->policy, &failed);
    base_json_item(root, "provenance", cJSON_Duplicate(provenance, 1), &failed);
    char *text = failed ? NULL : cJSON_Print(root);
    cJSON_Delete(root);
    return text;
}

int ggn_baseline_save(const struct ggn_baseline *b, const char *path, enum ggn_type type, const cJSON *provenance,
                      struct base_err *err)
{
    struct ggn_container c = {0};
    struct part parts[4];
    int n = parts_of(b, parts), rc = 0;
    for (int i = 0; i < n && !rc; i++)
        rc = ggn_container_add(&c, parts[i].name, parts[i].is_weight ? type : GGN_F32, parts[i].rank, parts[i].dim,
                               parts[i].values, err);
    if (!rc && !(c.json = print(b, provenance)))
        rc = base_fail_nomem(err, "baseline");
    if (!rc)
        rc = ggn_container_write(&c, path, err);
    ggn_container_release(&c);
    return rc;
}

/* Room for the weights, not before the file is known to be as large. */
static int make_room(struct ggn_baseline *b, const cJSON *root, const struct ggn_container *c, struct base_err *err)
{
    struct ggn_svm numbers = {0};
    int support = 0, rc;
    if (b->kind == GGN_SVD_ENTROPY) {
        size_t n = ggn_lstm_parameters(b->features);
        b->lstm = 2 * n <= c->size ? malloc(n * sizeof *b->lstm) : NULL;
        return b->lstm           ? 0
               : 2 * n > c->size ? base_fail(err, BASE_EINVAL, "the file is too small for a network of this size")
                                 : base_fail_nomem(err, "baseline");
    }
    rc = base_json_need_int(root, "support", 1, SUPPORT_MAX, &support, err);
    if (!rc)
        rc = base_json_need(root, "gamma", 1e-12, 1e12, &numbers.gamma, err);
    if (!rc)
        rc = base_json_need(root, "rho", -1e12, 1e12, &numbers.rho, err);
    if (!rc && 2 * (size_t)support * (size_t)b->features > c->size)
        rc = base_fail(err, BASE_EINVAL, "the file is too small for %d vectors", support);
    if (!rc)
        rc = ggn_svm_init(&b->svm, b->features, support, err);
    if (rc)
        return rc;
    b->svm.gamma = numbers.gamma;
    b->svm.rho = numbers.rho;
    return 0;
}

/* b: zeroed; the caller releases it after a failure. */
static int parse(struct ggn_baseline *b, const cJSON *root, const struct ggn_container *c, enum ggn_baseline_kind kind,
                 struct base_err *err)
{
    const cJSON *type = cJSON_GetObjectItemCaseSensitive(root, "kind");
    const cJSON *method = cJSON_GetObjectItemCaseSensitive(root, "method");
    struct part parts[4];
    const char *name = cJSON_IsString(method) ? method->valuestring : "";
    const int found = base_word_index(ggn_baseline_names, name, strlen(name));
    int w = 0, h = 0, window = 0;
    if (!cJSON_IsString(type) || strcmp(type->valuestring, "baseline") != 0 || found < 0 ||
        (kind != GGN_BASELINES && kind != (enum ggn_baseline_kind)found))
        return base_fail(err, BASE_EINVAL, "not a baseline%s%s", kind != GGN_BASELINES ? " for " : "",
                         kind != GGN_BASELINES ? ggn_baseline_names[kind] : "");
    int rc = base_json_need_int(root, "width", 1, SIDE_MAX, &w, err);
    if (!rc)
        rc = base_json_need_int(root, "height", 1, SIDE_MAX, &h, err);
    if (!rc)
        rc = base_json_need_int(root, "window", 1, GGN_WINDOW_MAX, &window, err);
    if (!rc)
        rc = ggn_baseline_init(b, (enum ggn_baseline_kind)found, w, h, window, err);
    if (!rc)
        rc = base_json_need_int(root, "first", 0, GGN_SUB_BLOCK - 2, &b->first, err);
    if (!rc)
        rc = ggn_policy_parse(cJSON_GetObjectItemCaseSensitive(root, "policy"), &b->policy, err);
    if (!rc)
        rc = make_room(b, root, c, err);
    for (int i = 0, n = rc ? 0 : parts_of(b, parts); i < n && !rc; i++)
        rc = ggn_container_get(c, parts[i].name, parts[i].rank, parts[i].dim, parts[i].values, err);
    return rc;
}

int ggn_baseline_parse(struct ggn_baseline *b, const struct ggn_container *c, const char *name, enum ggn_baseline_kind kind,
                       struct base_err *err)
{
    struct base_err inner = {0};
    cJSON *root = cJSON_Parse(c->json);
    *b = (struct ggn_baseline){0};
    int rc = root ? parse(b, root, c, kind, &inner) : base_fail(&inner, BASE_EINVAL, "the description is not JSON");
    cJSON_Delete(root);
    if (!rc)
        return 0;
    ggn_baseline_release(b);
    return base_fail(err, rc, "%s: %s", name, inner.text);
}

int ggn_baseline_load(struct ggn_baseline *b, const char *path, enum ggn_baseline_kind kind, struct base_err *err)
{
    struct ggn_container c;
    int rc = ggn_container_read(&c, path, err);
    *b = (struct ggn_baseline){0};
    if (rc)
        return rc;
    rc = ggn_baseline_parse(b, &c, path, kind, err);
    ggn_container_release(&c);
    return rc;
}

struct ggn_baseline_reader {
    const struct ggn_baseline *b;
    struct ggn_lstm *lstm; /* owns; NULL for an SVM */
    float *tile;           /* owns; [3][height][width] display codes */
    uint8_t *codes;        /* owns; the same */
    double *lightness;     /* owns; [height][width], then the features' scratch */
};

void ggn_baseline_reader_destroy(struct ggn_baseline_reader *r)
{
    if (!r)
        return;
    ggn_lstm_destroy(r->lstm);
    free(r->tile);
    free(r->codes);
    free(r->lightness);
    free(r);
}

struct ggn_baseline_reader *ggn_baseline_reader_create(const struct ggn_baseline *b, struct base_err *err)
{
    const size_t pixels = (size_t)b->width * (size_t)b->height;
    if (b->kind == GGN_SVD_ENTROPY && ggn_blas_open(err) != 0)
        return NULL;
    struct ggn_baseline_reader *r = calloc(1, sizeof *r);

    if (!r) {
        base_fail_nomem(err, "baseline");
        return NULL;
    }
    r->b = b;
    r->tile = malloc(3 * pixels * sizeof *r->tile);
    r->codes = malloc(3 * pixels);
    r->lightness = malloc((1 + GGN_FEATURE_SCRATCH) * pixels * sizeof *r->lightness);
    if (b->lstm)
        r->lstm = ggn_lstm_reader(b->features, b->window, b->lstm, err);
    if (r->tile && r->codes && r->lightness && (r->lstm || !b->lstm))
        return r;
    base_fail_nomem(err, "baseline");
    ggn_baseline_reader_destroy(r);
    return NULL;
}

static int tiles(const struct ggn_baseline *b, int width, int height)
{
    return ggn_tile_count(width, b->width) * ggn_tile_count(height, b->height);
}

size_t ggn_baseline_feature_count(const struct ggn_baseline *b, int width, int height)
{
    return (size_t)tiles(b, width, height) * (size_t)b->features;
}

static void extract_tile(struct ggn_baseline_reader *r, const uint8_t *rgb, double *features)
{
    const struct ggn_baseline *b = r->b;
    const size_t pixels = (size_t)b->width * (size_t)b->height;
    double *l = r->lightness;
    ggn_lightness(rgb, pixels, l);
    if (b->kind == GGN_ATTRIBUTES_SVM)
        ggn_attributes(l, b->width, b->height, l + pixels, features);
    else if (b->kind == GGN_MASK_SVM)
        ggn_noise_mask(l, b->width, b->height, l + pixels, features);
    else if (ggn_svd_entropy(l, b->width, b->height, b->first, GGN_SUB_BLOCK, features) != 0)
        for (int i = 0; i < b->features; i++)
            features[i] = (double)NAN;
}

void ggn_baseline_extract(struct ggn_baseline_reader *r, const uint8_t *rgb, int width, int height, double *features)
{
    const struct ggn_baseline *b = r->b;
    const size_t plane = (size_t)b->width * (size_t)b->height, values = 3 * plane;
    const struct ggn_value tile = {.h = b->height, .w = b->width, .row = b->width, .plane = plane};
    const int across = ggn_tile_count(width, b->width), n = tiles(b, width, height);
    if (width == b->width && height == b->height) {
        extract_tile(r, rgb, features);
        return;
    }
    for (int i = 0; i < n; i++, features += b->features) {
        ggn_tile_load_u8(rgb, 3, width, height, ggn_tile_start(width, b->width, i % across),
                         ggn_tile_start(height, b->height, i / across), 1, r->tile, &tile);
        for (size_t k = 0; k < values; k++)
            r->codes[k] = (uint8_t)r->tile[k];
        extract_tile(r, r->codes, features);
    }
}

double ggn_baseline_logit(struct ggn_baseline_reader *r, const double *const *features, int width, int height)
{
    const struct ggn_baseline *b = r->b;
    const double *steps[GGN_WINDOW_MAX];
    double most = -INFINITY;
    for (int i = 0; i < tiles(b, width, height); i++) {
        for (int k = 0; k < b->window; k++)
            steps[k] = features[k] + (size_t)i * (size_t)b->features;
        double logit = b->kind == GGN_SVD_ENTROPY ? ggn_lstm_logit(r->lstm, steps) : ggn_svm_score(&b->svm, steps[0]);
        most = isnan(logit) || isnan(most) ? (double)NAN : fmax(most, logit);
    }
    return most;
}
