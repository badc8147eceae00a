#include "shade/light_env.h"

#include <math.h>
#include <string.h>

#include "shade/light_portal.h"
#include "shade/warp.h"

/* The importance table has at most this many columns: it only steers sampling, and its reads miss the cache when it is
 * large. A smaller one is taken while the variance that it adds stays small (see squared_weight). */
enum { TABLE_MAX = 1024, TABLE_MIN = 128 };
/* E[w²]/E[w]² of the weights that a table may leave within its cells. */
#define TABLE_SQUARED_WEIGHT 1.3

/* Square → sphere, area preserving (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"). */
static pt_vec3 square_to_sphere(float s, float t)
{
    float u = 2.0f * s - 1.0f, v = 2.0f * t - 1.0f, up = fabsf(u), vp = fabsf(v);
    float signed_distance = 1.0f - (up + vp), d = fabsf(signed_distance), r = 1.0f - d;
    float phi = (r == 0.0f ? 1.0f : (vp - up) / r + 1.0f) * (PT_PI / 4.0f);
    float z = copysignf(1.0f - r * r, signed_distance), scale = r * sqrtf(fmaxf(0.0f, 2.0f - r * r));
    return v3(copysignf(cosf(phi), u) * scale, copysignf(sinf(phi), v) * scale, z);
}

static void sphere_to_square(pt_vec3 w, float *s, float *t)
{
    float x = fabsf(w.x), y = fabsf(w.y), z = fabsf(w.z), r = sqrtf(fmaxf(0.0f, 1.0f - z));
    float a = fmaxf(x, y), b = fminf(x, y);
    float phi = a == 0.0f ? 0.0f : atanf(b / a) * (2.0f / PT_PI);
    if (x < y)
        phi = 1.0f - phi;
    float v = phi * r, u = r - v;
    if (w.z < 0.0f) {
        float swap = u;
        u = 1.0f - v;
        v = 1.0f - swap;
    }
    *s = 0.5f * (copysignf(u, w.x) + 1.0f);
    *t = 0.5f * (copysignf(v, w.y) + 1.0f);
}

static void direction_to_map(const struct pt_light *light, pt_vec3 w, float *s, float *t, float *sin_theta)
{
    pt_vec3 l = v3_norm(pt_mat34_vector(&light->from_render, w));
    if (light->mapping == PT_ENV_EQUAL_AREA) {
        sphere_to_square(l, s, t);
        *sin_theta = 1.0f;
        return;
    }
    float phi = atan2f(l.y, l.x);
    *s = (phi < 0.0f ? phi + 2.0f * PT_PI : phi) * (0.5f * PT_INV_PI);
    *t = acosf(fminf(1.0f, fmaxf(-1.0f, l.z))) * PT_INV_PI;
    *sin_theta = sqrtf(l.x * l.x + l.y * l.y);
}

static int32_t cell(float x, int32_t n)
{
    int32_t i = (int32_t)(x * (float)n);
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

/* Density over the square → density per solid angle. */
static float to_solid(const struct pt_light *light, float pdf_square, float sin_theta)
{
    if (light->mapping == PT_ENV_EQUAL_AREA)
        return pdf_square * (0.25f * PT_INV_PI);
    return sin_theta > 0.0f ? pdf_square / (2.0f * PT_PI * PT_PI * sin_theta) : 0.0f;
}

/* Density of a place of the map. */
static float map_pdf(const struct pt_scene *scene, const struct pt_light *light, float s, float t, float sin_theta)
{
    const struct pt_env_distribution *d = &scene->env_distributions[light - scene->lights];
    int32_t y = cell(t, d->height), x = cell(s, d->width);
    const float *columns = d->columns + (size_t)y * (size_t)(d->width + 1);
    float pdf = (columns[x + 1] - columns[x]) * (float)d->width * ((d->rows[y + 1] - d->rows[y]) * (float)d->height);
    return to_solid(light, pdf, sin_theta);
}

/* Largest i < n with cdf[i] <= u; *inside: position between cdf[i] and cdf[i + 1]. */
static int32_t invert_cdf(const float *cdf, const uint16_t *guide, int32_t n, float u, float *inside)
{
    int32_t i = guide[cell(u, n)];
    while (i + 1 < n && cdf[i + 1] <= u)
        i++;
    float width = cdf[i + 1] - cdf[i];
    *inside = width > 0.0f ? fminf((u - cdf[i]) / width, 0x1.fffffep-1f) : 0.5f;
    return i;
}

static const float *pixel_at(const struct pt_scene *scene, const struct pt_light *light, float s, float t)
{
    const struct pt_image_map *map = &scene->images[light->image];
    return (const float *)map->pixels +
           3 * ((size_t)cell(t, map->height) * (size_t)map->width + (size_t)cell(s, map->width));
}

pt_vec3 pt_light_env_image_eval(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w)
{
    float s, t, sin_theta;
    direction_to_map(light, w, &s, &t, &sin_theta);
    const float *px = pixel_at(scene, light, s, t);
    return v3_mul(light->emission, v3(px[0], px[1], px[2]));
}

/* A direction by the image's importance; 0 when there is none. */
static float image_sample(const struct pt_scene *scene, const struct pt_light *light, float u0, float u1, pt_vec3 *w,
                          const float **pixel)
{
    const struct pt_env_distribution *d = &scene->env_distributions[light - scene->lights];
    float in_x, in_y, sin_theta = 1.0f;
    int32_t y = invert_cdf(d->rows, d->row_guide, d->height, u1, &in_y);
    const float *columns = d->columns + (size_t)y * (size_t)(d->width + 1);
    int32_t x = invert_cdf(columns, d->column_guide + (size_t)y * (size_t)d->width, d->width, u0, &in_x);
    float s = ((float)x + in_x) / (float)d->width, t = ((float)y + in_y) / (float)d->height;
    pt_vec3 l;
    if (light->mapping == PT_ENV_EQUAL_AREA) {
        l = square_to_sphere(s, t);
    } else {
        float cos_theta, sin_phi, cos_phi;
        pt_sincos_turn(0.5f * t, &sin_theta, &cos_theta);
        pt_sincos_turn(s, &sin_phi, &cos_phi);
        l = v3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
    }
    float pdf = (columns[x + 1] - columns[x]) * (float)d->width * ((d->rows[y + 1] - d->rows[y]) * (float)d->height);
    /* from_render is a rotation (perhaps mirrored): its transpose is its inverse */
    *w = v3_norm(pt_mat34_normal(&light->from_render, l));
    *pixel = pixel_at(scene, light, s, t);
    return to_solid(light, pdf, sin_theta);
}

/* One density of two ways: through the portal, and by the image's importance. */
static float mixed(const struct pt_light *light, float through, float by_image)
{
    if (light->kind == PT_LIGHT_ENV_CONSTANT)
        return through;
    return light->has_portal ? 0.5f * (through + by_image) : by_image;
}

float pt_light_env_density(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 p, pt_vec3 w)
{
    float s, t, sin_theta, through = light->has_portal ? pt_portal_pdf(light, p, w) : 0.0f, by_image = 0.0f;
    if (light->kind == PT_LIGHT_ENV_IMAGE) {
        direction_to_map(light, w, &s, &t, &sin_theta);
        by_image = map_pdf(scene, light, s, t, sin_theta);
    }
    return mixed(light, through, by_image);
}

int pt_light_env_sample(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 p, float u0, float u1,
                        struct pt_light_sample *out)
{
    const int constant = light->kind == PT_LIGHT_ENV_CONSTANT;
    float s, t, sin_theta, through = 0.0f, by_image = 0.0f;
    out->pixel = NULL;
    if (light->has_portal && (constant || u0 < 0.5f)) {
        through = pt_portal_sample(light, p, constant ? u0 : 2.0f * u0, u1, &out->wi);
        if (!(through > 0.0f))
            return 0;
        if (!constant) {
            direction_to_map(light, out->wi, &s, &t, &sin_theta);
            out->pixel = pixel_at(scene, light, s, t);
            by_image = map_pdf(scene, light, s, t, sin_theta);
        }
    } else {
        by_image = image_sample(scene, light, light->has_portal ? 2.0f * u0 - 1.0f : u0, u1, &out->wi, &out->pixel);
        if (light->has_portal)
            through = pt_portal_pdf(light, p, out->wi);
    }
    float pdf = mixed(light, through, by_image);
    out->inv_pdf_solid = 1.0f / pdf;
    out->radiance = light->emission;
    out->delta = 0;
    out->finite = 0;
    return pdf > 0.0f;
}

static double row_weight(const struct pt_light *light, int32_t y, int32_t height)
{
    return light->mapping == PT_ENV_EQUAL_AREA ? 1.0 : sin(((double)y + 0.5) / (double)height * 3.14159265358979323846);
}

static double luminance_of(const float *px)
{
    float l = v3_luminance(v3(px[0], px[1], px[2]));
    return l > 0.0f && isfinite(l) ? (double)l : 0.0;
}

float pt_light_env_mean(const struct pt_scene *scene, const struct pt_light *light)
{
    float scale = v3_luminance(light->emission);
    if (light->kind == PT_LIGHT_ENV_CONSTANT)
        return scale;
    const struct pt_image_map *map = &scene->images[light->image];
    const float *px = map->pixels;
    double sum = 0.0, weights = 0.0;
    for (int32_t y = 0; y < map->height; y++) {
        double weight = row_weight(light, y, map->height);
        weights += weight * map->width;
        for (int32_t x = 0; x < map->width; x++, px += 3)
            sum += weight * luminance_of(px);
    }
    return scale * (float)(sum / weights);
}

/* weights[n] → cdf[n + 1] and its guide[n]; returns the sum. All zero: uniform. */
static double accumulate(const double *weights, int32_t n, float *cdf, uint16_t *guide)
{
    double sum = 0.0, part = 0.0;
    for (int32_t i = 0; i < n; i++)
        sum += weights[i];
    cdf[0] = 0.0f;
    for (int32_t i = 0; i < n; i++) {
        part += weights[i];
        cdf[i + 1] = (float)(sum > 0.0 ? part / sum : (double)(i + 1) / n);
    }
    cdf[n] = 1.0f;
    /* the first u that cell() sends to k is within a rounding of k/n: start one cell early */
    for (int32_t k = 0, i = 0; k < n; k++) {
        while (i + 1 < n && (double)cdf[i + 1] <= (double)k / n)
            i++;
        guide[k] = (uint16_t)(i > 0 ? i - 1 : 0);
    }
    return sum;
}

/* Sums of importance over the cells of a w × h table. */
static void sum_cells(const struct pt_light *light, const struct pt_image_map *map, int32_t w, int32_t h, double *cells)
{
    const float *px = map->pixels;
    memset(cells, 0, (size_t)w * (size_t)h * sizeof *cells);
    for (int32_t y = 0; y < map->height; y++) {
        double weight = row_weight(light, y, map->height);
        double *row = cells + (size_t)((int64_t)y * h / map->height) * (size_t)w;
        for (int32_t x = 0; x < map->width; x++, px += 3)
            row[(int64_t)x * w / map->width] += weight * luminance_of(px);
    }
}

/* E[(l/p)²] / E[l/p]² over samples of density p, uniform within each cell. */
static double squared_weight(const struct pt_light *light, const struct pt_image_map *map, int32_t w, int32_t h,
                             const double *cells)
{
    const float *px = map->pixels;
    double pixels_per_cell = (double)map->width / w * ((double)map->height / h), total = 0.0, second = 0.0;
    for (int32_t y = 0; y < map->height; y++) {
        double weight = row_weight(light, y, map->height);
        const double *row = cells + (size_t)((int64_t)y * h / map->height) * (size_t)w;
        for (int32_t x = 0; x < map->width; x++, px += 3) {
            double l = weight * luminance_of(px);
            total += l;
            second += l > 0.0 ? l * l / row[(int64_t)x * w / map->width] : 0.0;
        }
    }
    return total > 0.0 ? second * pixels_per_cell / total : 1.0;
}

int pt_light_env_build(struct pt_scene *scene, const struct pt_light *light, struct pt_env_distribution *out)
{
    const struct pt_image_map *map = &scene->images[light->image];
    struct pt_arena scratch = {0};
    double *cells = pt_arena_alloc(&scratch, (size_t)TABLE_MAX * TABLE_MAX, sizeof *cells);
    double *sums = pt_arena_alloc(&scratch, TABLE_MAX, sizeof *sums);
    int32_t w = 0, h = 0;
    for (int32_t size = TABLE_MIN; cells && size <= TABLE_MAX; size *= 2) {
        w = map->width < size ? map->width : size;
        h = map->height < size ? map->height : size;
        sum_cells(light, map, w, h, cells);
        if (squared_weight(light, map, w, h, cells) <= TABLE_SQUARED_WEIGHT)
            break;
    }
    size_t n = (size_t)w * (size_t)h;
    float *rows = pt_arena_alloc(&scene->arena, (size_t)h + 1, sizeof *rows);
    float *columns = pt_arena_alloc(&scene->arena, n + (size_t)h, sizeof *columns);
    uint16_t *row_guide = pt_arena_alloc(&scene->arena, (size_t)h, sizeof *row_guide);
    uint16_t *column_guide = pt_arena_alloc(&scene->arena, n, sizeof *column_guide);
    int ok = cells && sums && rows && columns && row_guide && column_guide;
    if (ok) {
        for (size_t y = 0; y < (size_t)h; y++)
            sums[y] = accumulate(cells + y * (size_t)w, w, columns + y * (size_t)(w + 1), column_guide + y * (size_t)w);
        accumulate(sums, h, rows, row_guide);
        *out = (struct pt_env_distribution){w, h, rows, columns, row_guide, column_guide};
    }
    pt_arena_release(&scratch);
    return ok;
}
