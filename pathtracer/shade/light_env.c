#include "shade/light_env.h"

#include <math.h>
#include <string.h>

#include "base/pi.h"
#include "shade/warp.h"

/* The importance table has at most this many columns: it only steers sampling, and its reads miss the cache when it is
 * large. A smaller one is taken while the variance that it adds stays small (see squared_weight); where the largest adds too
 * much, pixels are chosen within its cells. */
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

/* Solid angle in light space per solid angle in render space around the direction w: |det M| / |M w|³. */
static float stretch(const struct pt_light *light, pt_vec3 w)
{
    if (!light->is_stretched)
        return 1.0f;
    float len = v3_len(pt_mat34_vector(&light->from_render, w));
    return 1.0f / (len * len * len);
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

static double row_weight(const struct pt_light *light, int32_t y, int32_t height)
{
    return light->mapping == PT_ENV_EQUAL_AREA ? 1.0 : sin(((double)y + 0.5) / (double)height * BASE_PI);
}

static double luminance_of(const float *px)
{
    float l = v3_luminance(v3(px[0], px[1], px[2]));
    return l > 0.0f && isfinite(l) ? (double)l : 0.0;
}

static const struct pt_image_map *map_of(const struct pt_scene *scene, const struct pt_light *light)
{
    return &scene->images[light->image];
}

static const float *pixel(const struct pt_image_map *map, int32_t x, int32_t y)
{
    return (const float *)map->pixels + 3 * ((size_t)y * (size_t)map->width + (size_t)x);
}

/* The pixels that cell `i` of a table spans along an axis of n. */
struct span {
    int32_t first, count;
};
static struct span span_of(int32_t i, int32_t pixels_per_cell, int32_t n)
{
    int32_t first = i * pixels_per_cell, left = n - first;
    return (struct span){first, left < pixels_per_cell ? left : pixels_per_cell};
}

static float along(const float *cdf, int32_t i, int32_t pixels_per_cell, int32_t n)
{
    return (cdf[i + 1] - cdf[i]) * ((float)n / (float)span_of(i, pixels_per_cell, n).count);
}

/* Density over the square with which pixel (x, y) is sampled, the same all over it. */
static float pixel_pdf(const struct pt_scene *scene, const struct pt_light *light, int32_t x, int32_t y)
{
    const struct pt_env_distribution *d = &scene->env_distributions[light - scene->lights];
    const struct pt_image_map *map = map_of(scene, light);
    if (d->per_importance > 0.0)
        return (float)(luminance_of(pixel(map, x, y)) * row_weight(light, y, map->height) * d->per_importance);
    int32_t cx = x / d->cell_width, cy = y / d->cell_height;
    const float *columns = d->columns + (size_t)cy * (size_t)(d->width + 1);
    return along(columns, cx, d->cell_width, map->width) * along(d->rows, cy, d->cell_height, map->height);
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

pt_vec3 pt_light_env_image_eval(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w)
{
    const struct pt_image_map *map = map_of(scene, light);
    float s, t, sin_theta;
    direction_to_map(light, w, &s, &t, &sin_theta);
    const float *px = pixel(map, cell(s, map->width), cell(t, map->height));
    return v3_mul(light->emission, v3(px[0], px[1], px[2]));
}

/* Density of w by the image's importance; *px (may be NULL) gets the pixel that it is in. */
static float image_pdf(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w, const float **px)
{
    const struct pt_image_map *map = map_of(scene, light);
    float s, t, sin_theta;
    direction_to_map(light, w, &s, &t, &sin_theta);
    int32_t x = cell(s, map->width), y = cell(t, map->height);
    if (px)
        *px = pixel(map, x, y);
    return to_solid(light, pixel_pdf(scene, light, x, y), sin_theta) * stretch(light, w);
}

static double sum_of_row(const struct pt_image_map *map, struct span columns, int32_t y)
{
    double sum = 0.0;
    for (int32_t i = 0; i < columns.count; i++)
        sum += luminance_of(pixel(map, columns.first + i, y));
    return sum;
}

/* The place within a cell → a pixel of it, chosen by importance, and the place within that. */
static void pick_pixel(const struct pt_light *light, const struct pt_image_map *map, struct span columns, struct span rows,
                       float *in_x, float *in_y, int32_t *x, int32_t *y)
{
    double total = 0.0, part = 0.0, sum = 0.0;
    for (int32_t i = 0; i < rows.count; i++)
        total += sum_of_row(map, columns, rows.first + i) * row_weight(light, rows.first + i, map->height);
    double at = (double)*in_y * total;
    for (*y = rows.first;; ++*y, part += sum) {
        sum = sum_of_row(map, columns, *y) * row_weight(light, *y, map->height);
        if (part + sum > at || *y + 1 == rows.first + rows.count)
            break;
    }
    *in_y = sum > 0.0 ? fminf((float)((at - part) / sum), 0x1.fffffep-1f) : 0.5f;
    at = (double)*in_x * sum_of_row(map, columns, *y);
    part = 0.0;
    for (*x = columns.first;; ++*x, part += sum) {
        sum = luminance_of(pixel(map, *x, *y));
        if (part + sum > at || *x + 1 == columns.first + columns.count)
            break;
    }
    *in_x = sum > 0.0 ? fminf((float)((at - part) / sum), 0x1.fffffep-1f) : 0.5f;
}

/* A direction by the image's importance, with the pixel that it is in; 0 when there is none. */
static float image_sample(const struct pt_scene *scene, const struct pt_light *light, float u0, float u1, pt_vec3 *w,
                          const float **px)
{
    const struct pt_env_distribution *d = &scene->env_distributions[light - scene->lights];
    const struct pt_image_map *map = map_of(scene, light);
    float in_x, in_y, sin_theta = 1.0f;
    int32_t cy = invert_cdf(d->rows, d->row_guide, d->height, u1, &in_y);
    const float *columns = d->columns + (size_t)cy * (size_t)(d->width + 1);
    int32_t cx = invert_cdf(columns, d->column_guide + (size_t)cy * (size_t)d->width, d->width, u0, &in_x);
    struct span across = span_of(cx, d->cell_width, map->width), down = span_of(cy, d->cell_height, map->height);
    int32_t x, y;
    if (d->per_importance > 0.0) {
        pick_pixel(light, map, across, down, &in_x, &in_y, &x, &y);
        across = (struct span){x, 1};
        down = (struct span){y, 1};
    } else {
        x = across.first + cell(in_x, across.count);
        y = down.first + cell(in_y, down.count);
    }
    float s = ((float)across.first + in_x * (float)across.count) / (float)map->width;
    float t = ((float)down.first + in_y * (float)down.count) / (float)map->height;
    pt_vec3 l;
    if (light->mapping == PT_ENV_EQUAL_AREA) {
        l = square_to_sphere(s, t);
    } else {
        float cos_theta, sin_phi, cos_phi;
        pt_sincos_turn(0.5f * t, &sin_theta, &cos_theta);
        pt_sincos_turn(s, &sin_phi, &cos_phi);
        l = v3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
    }
    /* the transpose of a rotation (perhaps mirrored) is its inverse */
    *w = v3_norm(light->is_stretched ? pt_mat34_vector(&light->to_render, l) : pt_mat34_normal(&light->from_render, l));
    *px = pixel(map, x, y);
    return to_solid(light, pixel_pdf(scene, light, x, y), sin_theta) * stretch(light, *w);
}

/* Portals are parallelograms through which light comes in, such as windows. They guide sampling only: light that takes
 * another way counts as well, it is only met less often. A point is chosen evenly on the parallelogram, so the density of a
 * direction is distance² / (area · |cos|) where it passes through, and 0 elsewhere. */

/* Density per solid angle, at p, of a point x on the portal; w: unit, from p to x. INFINITY in the portal's own plane. */
static float pt_portal_density(const struct pt_light *light, pt_vec3 p, pt_vec3 x, pt_vec3 w)
{
    pt_vec3 d = v3_sub(x, p), n = v3_cross(light->portal_u, light->portal_v);
    return v3_dot(d, d) / fabsf(v3_dot(w, n)); /* |n| is the area */
}

/* Density with which pt_portal_sample chooses w (unit) at p. */
static float pt_portal_pdf(const struct pt_light *light, pt_vec3 p, pt_vec3 w)
{
    pt_vec3 n = v3_cross(light->portal_u, light->portal_v);
    float t = v3_dot(v3_sub(light->portal, p), n) / v3_dot(w, n);
    if (!(t > 0.0f && t < INFINITY))
        return 0.0f;
    pt_vec3 x = v3_madd(p, t, w), at = v3_sub(x, light->portal);
    float area2 = v3_dot(n, n), u = v3_dot(v3_cross(at, light->portal_v), n) / area2,
          v = v3_dot(v3_cross(light->portal_u, at), n) / area2;
    return u >= 0.0f && u <= 1.0f && v >= 0.0f && v <= 1.0f ? pt_portal_density(light, p, x, w) : 0.0f;
}

/* A direction from p through the portal, by numbers in [0, 1), and its density; 0 when there is none. */
static float pt_portal_sample(const struct pt_light *light, pt_vec3 p, float u0, float u1, pt_vec3 *w)
{
    pt_vec3 x = v3_madd(v3_madd(light->portal, u0, light->portal_u), u1, light->portal_v);
    *w = v3_norm(v3_sub(x, p));
    float pdf = pt_portal_density(light, p, x, *w);
    return pdf > 0.0f && pdf < INFINITY ? pdf : 0.0f;
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
    float through = light->has_portal ? pt_portal_pdf(light, p, w) : 0.0f;
    return mixed(light, through, light->kind == PT_LIGHT_ENV_IMAGE ? image_pdf(scene, light, w, NULL) : 0.0f);
}

int pt_light_env_sample(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 p, float u0, float u1,
                        struct pt_light_sample *out)
{
    const int constant = light->kind == PT_LIGHT_ENV_CONSTANT;
    float through = 0.0f, by_image = 0.0f;
    if (light->has_portal && (constant || u0 < 0.5f)) {
        through = pt_portal_sample(light, p, constant ? u0 : 2.0f * u0, u1, &out->wi);
        if (!(through > 0.0f))
            return 0;
        if (!constant)
            by_image = image_pdf(scene, light, out->wi, &out->pixel);
    } else {
        by_image = image_sample(scene, light, light->has_portal ? 2.0f * u0 - 1.0f : u0, u1, &out->wi, &out->pixel);
        if (light->has_portal)
            through = pt_portal_pdf(light, p, out->wi);
    }
    float pdf = mixed(light, through, by_image);
    out->inv_pdf_solid = 1.0f / pdf;
    return pdf > 0.0f;
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

/* The size of a table of at most `most` cells along an axis of n pixels: a cell is of whole pixels, each in one cell. */
static int32_t cells_along(int32_t n, int32_t most, int32_t *pixels_per_cell)
{
    *pixels_per_cell = (n + most - 1) / most;
    return (n + *pixels_per_cell - 1) / *pixels_per_cell;
}

/* Sums of importance over the cells of the table. */
static void sum_cells(const struct pt_light *light, const struct pt_image_map *map, const struct pt_env_distribution *d,
                      double *cells)
{
    const float *px = map->pixels;
    memset(cells, 0, (size_t)d->width * (size_t)d->height * sizeof *cells);
    for (int32_t y = 0; y < map->height; y++) {
        double weight = row_weight(light, y, map->height);
        double *row = cells + (size_t)(y / d->cell_height) * (size_t)d->width;
        for (int32_t x = 0; x < map->width; x++, px += 3)
            row[x / d->cell_width] += weight * luminance_of(px);
    }
}

/* E[(l/p)²] / E[l/p]² over samples of density p, uniform within each cell. */
static double squared_weight(const struct pt_light *light, const struct pt_image_map *map,
                             const struct pt_env_distribution *d, const double *cells)
{
    const float *px = map->pixels;
    double total = 0.0, second = 0.0;
    for (int32_t y = 0; y < map->height; y++) {
        double weight = row_weight(light, y, map->height);
        const double *row = cells + (size_t)(y / d->cell_height) * (size_t)d->width;
        int32_t tall = span_of(y / d->cell_height, d->cell_height, map->height).count;
        for (int32_t x = 0; x < map->width; x++, px += 3) {
            double l = weight * luminance_of(px);
            int32_t cx = x / d->cell_width, pixels = tall * span_of(cx, d->cell_width, map->width).count;
            total += l;
            second += l > 0.0 ? l * l / row[cx] * pixels : 0.0;
        }
    }
    return total > 0.0 ? second / total : 1.0;
}

/* Chooses the table's size and fills cells[height][width]; 1 if within a cell all pixels may be as likely. */
static int choose_table(const struct pt_light *light, const struct pt_image_map *map, struct pt_env_distribution *d,
                        double *cells)
{
    for (int32_t size = TABLE_MIN; size <= TABLE_MAX; size *= 2) {
        d->width = cells_along(map->width, size, &d->cell_width);
        d->height = cells_along(map->height, size, &d->cell_height);
        sum_cells(light, map, d, cells);
        if (squared_weight(light, map, d, cells) <= TABLE_SQUARED_WEIGHT)
            return 1;
    }
    return 0;
}

int pt_light_env_build(struct pt_scene *scene, const struct pt_light *light, struct pt_env_distribution *out)
{
    const struct pt_image_map *map = map_of(scene, light);
    struct pt_env_distribution d = {0};
    struct pt_arena scratch = {0};
    double *cells = pt_arena_alloc(&scratch, (size_t)TABLE_MAX * TABLE_MAX, sizeof *cells);
    double *sums = pt_arena_alloc(&scratch, TABLE_MAX, sizeof *sums);
    const int even = !cells || choose_table(light, map, &d, cells);
    size_t w = (size_t)d.width, h = (size_t)d.height;
    float *rows = pt_arena_alloc(&scene->arena, h + 1, sizeof *rows);
    float *columns = pt_arena_alloc(&scene->arena, w * h + h, sizeof *columns);
    uint16_t *row_guide = pt_arena_alloc(&scene->arena, h, sizeof *row_guide);
    uint16_t *column_guide = pt_arena_alloc(&scene->arena, w * h, sizeof *column_guide);
    int ok = cells && sums && rows && columns && row_guide && column_guide;
    if (ok) {
        for (size_t y = 0; y < h; y++)
            sums[y] = accumulate(cells + y * w, d.width, columns + y * (w + 1), column_guide + y * w);
        double total = accumulate(sums, d.height, rows, row_guide);
        d.per_importance = even ? 0.0 : (double)map->width * (double)map->height / total;
        d.rows = rows;
        d.columns = columns;
        d.row_guide = row_guide;
        d.column_guide = column_guide;
        *out = d;
    }
    pt_arena_release(&scratch);
    return ok;
}
