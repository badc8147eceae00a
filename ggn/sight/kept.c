#include "sight/kept.h"

#include <math.h>
#include <string.h>

#include "sight/visibility.h"

enum { TILE = 25, STRATA = 7 };

static const double GAUSSIAN = 15.0; /* sixth moment of a normal distribution over the cube of its second */

/* A block on its way to both errors. */
struct judging {
    const struct ggn_kept *kept;
    double *texture;   /* [patches] */
    double *rows;      /* scratch of sight/visibility.h */
    float *edges;      /* [P]: L* of the denoised picture */
    float *apart;      /* [P]: the halves' difference as it is seen */
    float *crossed;    /* [P]: mean square of the error as it is seen; may be below zero */
    float *difference; /* [P]: one term of it */
    float *blurred;    /* [P]: as it is seen */
};

size_t ggn_kept_scratch(int width, int height)
{
    const size_t pixels = (size_t)width * (size_t)height, floats_in_double = sizeof(double) / sizeof(float);
    return ggn_visible_patches(width, height) + ggn_visibility_scratch(width) + 5 * pixels / floats_in_double + 1;
}

static struct judging begin(const struct ggn_kept *kept, double *scratch)
{
    const size_t pixels = (size_t)kept->width * (size_t)kept->height;
    struct judging j = {.kept = kept, .texture = scratch};
    j.rows = j.texture + ggn_visible_patches(kept->width, kept->height);
    float *next = (float *)(j.rows + ggn_visibility_scratch(kept->width));
    float **const maps[] = {&j.edges, &j.apart, &j.crossed, &j.difference, &j.blurred};
    for (size_t i = 0; i < sizeof maps / sizeof maps[0]; i++, next += pixels)
        *maps[i] = next;
    for (size_t i = 0; i < pixels; i++)
        j.edges[i] = 0.5f * (kept->lightness[0][i] + kept->lightness[1][i]);
    ggn_visible_texture(kept->lightness[0], kept->lightness[1], kept->width, kept->height, j.rows, j.texture);
    return j;
}

/* Mean square of the error of what is kept of all samples: the estimate's formula of differences in luminance times the
 * slope of L*, blurred as the eye does. */
static void cross(const struct judging *j)
{
    const struct ggn_kept *k = j->kept;
    const struct {
        const float *first, *second;
        float weight;
    } terms[] = {{k->crossed[0], k->noisy[1], 0.5f},
                 {k->crossed[1], k->noisy[0], 0.5f},
                 {k->noisy[0], k->noisy[1], -0.5f},
                 {k->crossed[0], k->crossed[1], -0.25f}};
    const size_t pixels = (size_t)k->width * (size_t)k->height;
    memset(j->crossed, 0, pixels * sizeof *j->crossed);
    for (size_t t = 0; t < sizeof terms / sizeof terms[0]; t++) {
        for (size_t i = 0; i < pixels; i++)
            j->difference[i] = k->slope[i] * (terms[t].first[i] - terms[t].second[i]);
        ggn_visible_noise(j->difference, k->width, k->height, j->texture, j->rows, j->blurred);
        for (size_t i = 0; i < pixels; i++)
            j->crossed[i] += terms[t].weight * j->blurred[i] * j->blurred[i];
    }
}

/* Over some pixels, of visible errors in units of what texture hides: how many, sums of the crossed square, of its square,
 * of the second and sixth power of the halves' difference. */
struct sums {
    double n, q, qq, second, sixth;
};

static void add(struct sums *s, const struct judging *j, size_t i)
{
    const double q = (double)j->crossed[i], h = (double)j->apart[i] * (double)j->apart[i];
    s->n += 1.0;
    s->q += q;
    s->qq += q * q;
    s->second += h;
    s->sixth += h * h * h;
}

/* Of the mean crossed square. Blurred pixels are not independent: about a third of them are. */
static double standard_error(const struct sums *s)
{
    const double mean = s->q / s->n;
    return s->n > 3.0 ? sqrt(3.0 * fmax(0.0, s->qq / s->n - mean * mean) / s->n) : fabs(mean);
}

static double cube(double v) { return v > 0.0 ? v * v * v : 0.0; }

/* Sum of sixth powers of errors that are Gaussian, so many standard errors below what was found. */
static double sixth_of(const struct sums *s, double less)
{
    return GAUSSIAN * s->n * cube(fabs(s->q / s->n) - less * standard_error(s));
}

static int least(int a, int b) { return a < b ? a : b; }

/* Strength of the edge at a pixel of the denoised picture, in octaves of L*: 0 for less than one. */
static int edge(const struct judging *j, int x, int y)
{
    const int width = j->kept->width, height = j->kept->height;
    const float *row = j->edges + (size_t)y * (size_t)width;
    const int left = x > 0 ? x - 1 : 0, right = least(x + 1, width - 1);
    const float *above = y > 0 ? row - width : row, *below = y + 1 < height ? row + width : row;
    double step = fabs((double)(row[right] - row[left])) + fabs((double)(below[x] - above[x]));
    int octave = 0;
    for (; step >= 1.0 && octave + 1 < STRATA; step *= 0.5)
        octave++;
    return octave;
}

/* Mean of sixth powers of the error over a patch. */
static double sixth_moment(const struct judging *j, const int patch[4])
{
    struct sums whole = {0}, strata[STRATA] = {{0}};
    double tiles = 0.0, edges = 0.0;
    for (int top = patch[1]; top < patch[3]; top += TILE)
        for (int left = patch[0]; left < patch[2]; left += TILE) {
            struct sums tile = {0};
            for (int y = top; y < least(top + TILE, patch[3]); y++)
                for (int x = left; x < least(left + TILE, patch[2]); x++) {
                    const size_t i = (size_t)y * (size_t)j->kept->width + (size_t)x;
                    add(&whole, j, i);
                    add(&tile, j, i);
                    add(&strata[edge(j, x, y)], j, i);
                }
            tiles += sixth_of(&tile, 2.0);
        }
    for (int k = 0; k < STRATA; k++)
        edges += strata[k].n > 0.0 ? sixth_of(&strata[k], 1.0) : 0.0;
    const double halves = whole.second / whole.n, shape = halves > 0.0 ? whole.sixth / whole.n / cube(halves) : 0.0;
    const double mean = whole.q / whole.n, doubt = standard_error(&whole);
    const double square = fmax(fmax(mean + 0.5 * doubt, -mean - doubt), halves);
    return fmax(fmax(GAUSSIAN, shape) * cube(square), fmax(tiles, edges) / whole.n);
}

static double crossed_error(const struct judging *j)
{
    const size_t patches = ggn_visible_patches(j->kept->width, j->kept->height);
    double sum = 0.0;
    for (size_t k = 0; k < patches; k++) {
        int patch[4];
        ggn_visible_patch(j->kept->width, j->kept->height, k, j->texture, patch);
        sum += cbrt(sixth_moment(j, patch)); /* the square of what is seen */
    }
    return sqrt(sum / (double)patches);
}

/* The halves' difference is noise; what else the crossed error has is bias. Both add in squares. */
static void set_viewed(struct ggn_kept_errors *e, double gain, double still)
{
    const double bias_squared = fmax(0.0, e->crossed * e->crossed - e->halves * e->halves) * still * still;
    e->halves *= gain;
    e->crossed = sqrt(bias_squared + e->halves * e->halves);
}

struct ggn_kept_errors ggn_kept_judge(const struct ggn_kept *kept, const struct ggn_viewing *viewing, double *scratch)
{
    const struct judging j = begin(kept, scratch);
    struct ggn_kept_errors e;
    cross(&j);
    e.halves = ggn_visible_noise(kept->apart, kept->width, kept->height, j.texture, j.rows, j.apart);
    e.crossed = crossed_error(&j);
    if (viewing) {
        double still, gain = ggn_viewing_gain(viewing, j.apart, kept->width, kept->height, &still);
        set_viewed(&e, gain, still);
    }
    return e;
}
