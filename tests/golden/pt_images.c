/*
 * Every picture that the path tracer can make, small: all of scenes/ and the scenes of golden/images/, which were written
 * for this, against the values in golden/pt_images.txt. A few samples a pixel with fixed numbers, so that all is repeated
 * to rounding, and any constant, sign or condition between the scene file and the pixel moves something.
 *
 * This proves sameness and nothing else. The recorded values were made by the program itself; that they are right is the
 * work of stat/ and unit/. Who means to change a picture records anew,
 *     RECORD=1 build/tests/golden/pt_images
 * and says in the commit which scenes changed and why that is right.
 *
 * First of a scene comes what was made of it, then the vertices that one path in each pixel meets, then a line for each
 * plane, row by row: colour, albedo, normal, depth (0 where there is none) and rays, all as means over a pixel's samples.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "geom/accel.h"
#include "integ/integrator.h"
#include "pbrt/load.h"
#include "sample/rng.h"
#include "support/pt_scenes.h"

enum { WIDTH = 11, HEIGHT = 7, PIXELS = WIDTH * HEIGHT, SPP = 32 };
static const char file_name[] = "tests/golden/pt_images.txt";

#define PLANES(X) \
    X(radiance.x) \
    X(radiance.y) \
    X(radiance.z) X(albedo.x) X(albedo.y) X(albedo.z) X(normal_world.x) X(normal_world.y) X(normal_world.z) X(depth) X(rays)
#define PLANE_NAME(member) #member,
static const char *const plane_names[] = {PLANES(PLANE_NAME)};
enum { PLANE_COUNT = sizeof plane_names / sizeof *plane_names };

struct picture {
    double plane[PLANE_COUNT][PIXELS];
    char made[200];             /* what was made of the scene, in words and whole numbers */
    uint64_t met[PT_MET_COUNT]; /* vertices of one path in each pixel, by what they are */
};

/*
 * How near is the same says the first line of the record: a value may be off by a share of itself and of the plane's mean (five digits
 * are recorded). Where the processor and the libraries round as they did for the record, no pixel may be off. Elsewhere rounding sends a
 * path here and there another way, which shows in its pixel: of Embree's code for SSE4.2, AVX and AVX2 against AVX-512,
 * 1.4 % of the pixels at most, and 23 % of one scene. The exceptions below have many places that lie just on an edge or a
 * portal, bumps that a last digit of uv tips, or random numbers that depend on the last digits of directions: their planes
 * must keep their means.
 */
static struct {
    double value, off_in_all, off_in_one, mean; /* the last three in percent */
} tolerance;
#define TOLERANCE_LINE \
    "# tolerance %lg of a value; pixels off where rounding differs: %lg %% in all, %lg %% of a scene; else means within " \
    "%lg %%"
static int off_in_all, pixels_in_all, strict; /* … this machine rounds as that of the record */
static const char *const fickle[] = {"coated", "rock-garden", "window", "golden/walked-coats"};

/* How a scene is asked for, where not as it is: "name@way" in the file. */
static const struct way {
    const char *scene, *name;
    int sampler, strategy, selection; /* -1: as the file has it */
    struct pt_view view;
} ways[] = {
    {"scenes/cornell-box.pbrt", "bsdf-only", PT_SAMPLER_INDEPENDENT, PT_STRATEGY_BSDF_ONLY, -1, {0}},
    {"scenes/many-lights.pbrt", "power", -1, -1, PT_LIGHT_SELECTION_POWER, {0}},
    {"scenes/sky-image.pbrt", "view", PT_SAMPLER_INDEPENDENT, -1, -1, {1, {1, 2, 5, 0, 1, 0, 0.1, 1, 0}, 50}},
};
enum { WAYS = sizeof ways / sizeof *ways };

static void add_sample(const struct pt_path_result *r, struct picture *out, int pixel)
{
    struct pt_path_result kept = *r;
    if (!isfinite(kept.depth))
        kept.depth = 0.0f;
    if (!v3_is_finite(kept.radiance)) /* the film leaves such samples out */
        kept.radiance = v3_splat(0.0f);
    int i = 0;
#define ADD(member) out->plane[i++][pixel] += (double)kept.member / SPP;
    PLANES(ADD)
#undef ADD
}

static void print_scene(const struct pt_scene *s, const char *kernel, char *out, size_t room)
{
    snprintf(out, room, "%s %x shapes %d %d %d %d triangles %lld placed %d %d lights %d %d %d %d images %d %d %d %d", kernel,
             s->effects, s->shape_count, s->world_shape_count, s->mesh_count, s->quadric_count, s->stats.triangles,
             s->object_count, s->instance_count, s->emitter_count, s->env_light_count,
             s->light_tree ? s->light_tree->node_count : 0, s->light_tree ? s->light_tree->far_count : 0, s->image_count,
             s->texture_count, s->material_count, s->medium_count);
}

static void draw(const char *path, const struct way *way, struct picture *out)
{
    struct pt_scene *scene = NULL;
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    struct pt_load_options options = {.width = WIDTH, .height = HEIGHT};
    if (way) {
        options.view = way->view;
        options.light_selection = way->selection >= 0 ? way->selection : 0;
    }
    if (pt_scene_load(path, &options, &scene, &defaults, &err) != 0)
        fail_msg("%s", err.text);
    struct pt_integrator settings = defaults.integrator;
    settings.want_aux = 1;
    if (way && way->sampler >= 0)
        settings.sampler = way->sampler;
    if (way && way->strategy >= 0)
        settings.strategy = way->strategy;
    const char *kernel_name;
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, &kernel_name);
    memset(out, 0, sizeof *out);
    print_scene(scene, kernel_name, out->made, sizeof out->made);
    for (uint32_t i = 0; i < PIXELS; i++)
        pt_kernel_trace(scene, &settings, i % WIDTH, i / WIDTH, 0, NULL, out->met);
    for (int y = 0; y < HEIGHT; y++)
        for (uint32_t sample = 0; sample < SPP; sample++) {
            struct pt_path_result row[WIDTH];
            kernel(scene, &settings, 0, (uint32_t)y, WIDTH, sample, row);
            for (int x = 0; x < WIDTH; x++)
                add_sample(&row[x], out, y * WIDTH + x);
        }
    pt_scene_destroy(scene);
}

/* --- the file --------------------------------------------------------------------------------------------------------- */

enum { ROOM = 192, NAME_ROOM = 64, LINE_ROOM = 16 * (PIXELS + 8) };
struct record {
    char name[NAME_ROOM];
    int planes, looked_at;
    struct picture picture;
};
static struct record records[ROOM];
static int record_count;

static struct record *find_record(const char *name, int make)
{
    for (int i = 0; i < record_count; i++)
        if (strcmp(records[i].name, name) == 0)
            return &records[i];
    if (!make || record_count == ROOM || strlen(name) >= NAME_ROOM)
        return NULL;
    strcpy(records[record_count].name, name);
    return &records[record_count++];
}

static uint64_t add_bits(uint64_t hash, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return pt_hash64(hash ^ bits) + 0x9e3779b97f4a7c15u;
}

/* The processor's own approximate 1/x and 1/sqrt(x), which Embree starts from: Intel's and AMD's differ. */
static uint64_t add_approximations(uint64_t hash)
{
#ifdef __SSE__
    for (float x = 0.51f; x < 4.0f; x *= 1.013f)
        hash =
            add_bits(add_bits(hash, _mm_cvtss_f32(_mm_rcp_ss(_mm_set_ss(x)))), _mm_cvtss_f32(_mm_rsqrt_ss(_mm_set_ss(x))));
#endif
    return hash;
}

/* How this machine rounds where our own code does not say it: a number from the last bits of Embree's hits, of what it starts
 * from and of the C library's functions. */
static uint64_t rounding_here(void)
{
    enum { RAYS = 16, ROUNDS = 256 };
    struct pt_scene scene;
    struct pt_rng rng = pt_rng_make(1);
    uint64_t hash = add_approximations(1);
    test_scene_begin(&scene);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
    for (int i = 0; i < 64; i++) {
        float u[9];
        for (int k = 0; k < 9; k++)
            u[k] = pt_rng_float(&rng) - 0.5f;
        test_add_quad(&scene, grey, v3(3.0f * u[0], 3.0f * u[1], 5.0f + u[2]), v3(u[3], u[4], u[5]), v3(u[6], u[7], u[8]));
    }
    test_scene_finish(&scene);
    for (int round = 0; round < ROUNDS; round++) {
        struct pt_ray rays[RAYS];
        const struct pt_ray *list[RAYS];
        struct pt_hit hits[RAYS], *met[RAYS];
        for (int i = 0; i < RAYS; i++) {
            float x = pt_rng_float(&rng) - 0.5f, y = pt_rng_float(&rng) - 0.5f;
            rays[i] = (struct pt_ray){v3_splat(0.0f), v3(x, y, 1.3f), 0.0f, INFINITY, 0.0f};
            list[i] = &rays[i];
            met[i] = &hits[i];
        }
        pt_accel_intersect_many(&scene, list, RAYS, round % 2, met);
        for (int i = 0; i < RAYS; i++) {
            float x = pt_rng_float(&rng);
            const float of[] = {expf(-x), logf(x),  log1pf(-x),      sinf(x), cosf(x),      tanf(x),
                                acosf(x), atanf(x), atan2f(x, 0.3f), erff(x), powf(x, 1.7f)};
            for (size_t k = 0; k < sizeof of / sizeof *of; k++)
                hash = add_bits(hash, of[k]);
            hash = hits[i].shape < 0 ? hash : add_bits(add_bits(add_bits(hash, hits[i].t), hits[i].u), hits[i].v);
        }
    }
    test_scene_end(&scene);
    return hash;
}

/* What is before the planes of a scene. */
static int read_head(struct record *r, const char *what, char *rest)
{
    if (strcmp(what, "made") == 0)
        return snprintf(r->picture.made, sizeof r->picture.made, "%.*s", (int)strcspn(rest, "\n"), rest) > 0;
    int n = 0;
    for (; n < PT_MET_COUNT && *rest != '\n'; n++)
        r->picture.met[n] = strtoull(rest, &rest, 10);
    /* the last is the medium's: models newer than the record are met nowhere */
    const uint64_t medium = n > 0 ? r->picture.met[n - 1] : 0;
    for (int i = n - 1; i >= 0 && i < PT_MET_COUNT; i++)
        r->picture.met[i] = i == PT_MET_MEDIUM ? medium : 0;
    return *rest == '\n';
}

/* A line is a scene, a plane and its values, or the one value that all of them have. */
static int read_line(char *line)
{
    char *name = strtok(line, " "), *plane = strtok(NULL, " \n"), *number;
    int n = 0;
    if (name && plane && strcmp(name, "rounding") == 0) {
        strict = strtoull(plane, NULL, 16) == rounding_here();
        return 1;
    }
    if (name && plane && (strcmp(plane, "made") == 0 || strcmp(plane, "met") == 0)) {
        struct record *of = find_record(name, 1);
        return of && read_head(of, plane, plane + strlen(plane) + 1);
    }
    struct record *r = name && plane ? find_record(name, 1) : NULL;
    if (!r || r->planes == PLANE_COUNT || strcmp(plane, plane_names[r->planes]) != 0)
        return 0;
    double *out = r->picture.plane[r->planes++];
    while ((number = strtok(NULL, " \n")) != NULL && n < PIXELS)
        out[n++] = strtod(number, NULL);
    for (int i = 1; n == 1 && i < PIXELS; i++)
        out[i] = out[0];
    return !number && (n == 1 || n == PIXELS);
}

static int read_file(void **state)
{
    static char line[LINE_ROOM];
    FILE *file = fopen(file_name, "r");
    (void)state;
    int ok =
        file && fgets(line, sizeof line, file) &&
        sscanf(line, TOLERANCE_LINE, &tolerance.value, &tolerance.off_in_all, &tolerance.off_in_one, &tolerance.mean) == 4;
    while (ok && fgets(line, sizeof line, file) != NULL)
        ok = line[0] == '#' || read_line(line);
    if (file)
        fclose(file);
    if (!ok)
        print_error("%s: not as this program writes it\n", file_name);
    print_message("this machine rounds %s\n", strict ? "as the one of the record: no pixel may be off" : "in its own way");
    return !ok;
}

/* Five digits, without what says nothing. */
static void write_number(FILE *file, double v)
{
    char text[32], *t = text;
    snprintf(text, sizeof text, "%.5g", v == 0.0 ? 0.0 : v);
    int minus = *t == '-';
    t += minus;
    fprintf(file, " %s%s", minus ? "-" : "", t[0] == '0' && t[1] == '.' ? t + 1 : t);
}

static void write_picture(FILE *file, const char *name, const struct picture *p)
{
    fprintf(file, "%s made %s\n%s met", name, p->made, name);
    for (int i = 0; i < PT_MET_COUNT; i++)
        fprintf(file, " %llu", (unsigned long long)p->met[i]);
    fputc('\n', file);
    for (int c = 0; c < PLANE_COUNT; c++) {
        int n = 1;
        for (int i = 1; i < PIXELS; i++)
            n = p->plane[c][i] != p->plane[c][0] ? PIXELS : n;
        fprintf(file, "%s %s", name, plane_names[c]);
        for (int i = 0; i < n; i++)
            write_number(file, p->plane[c][i]);
        fputc('\n', file);
    }
}

/* --- comparing -------------------------------------------------------------------------------------------------------- */

static int is_off(double got, double want, double mean)
{
    return !(fabs(got - want) <= tolerance.value * (fabs(want) + mean));
}

static double mean_of(const double *plane)
{
    double mean = 0.0;
    for (int i = 0; i < PIXELS; i++)
        mean += fabs(plane[i]) / PIXELS;
    return mean;
}

static int is_fickle(const char *name)
{
    for (size_t i = 0; i < sizeof fickle / sizeof *fickle; i++)
        if (strcmp(fickle[i], name) == 0)
            return 1;
    return 0;
}

/* How many pixels are not as recorded; *plane and *pixel: the first. */
static int count_off(const struct picture *got, const struct picture *want, int *plane, int *pixel)
{
    int off[PIXELS] = {0}, count = 0;
    for (int c = 0; c < PLANE_COUNT; c++) {
        double mean = mean_of(want->plane[c]);
        for (int i = 0; i < PIXELS; i++)
            if (is_off(got->plane[c][i], want->plane[c][i], mean) && !off[i]) {
                off[i] = 1;
                if (count++ == 0) {
                    *plane = c;
                    *pixel = i;
                }
            }
    }
    return count;
}

static void check_head(const char *name, const struct picture *got, const struct picture *want)
{
    if (strcmp(got->made, want->made) != 0)
        fail_msg("%s: made is %s, was %s", name, got->made, want->made);
    for (int i = 0; i < PT_MET_COUNT && strict; i++)
        if (got->met[i] != want->met[i])
            fail_msg("%s: of kind %d %llu vertices are met, were %llu", name, i, (unsigned long long)got->met[i],
                     (unsigned long long)want->met[i]);
}

/* Compares with what the file says, or writes it there. */
static void check_picture(const char *path, const struct way *way, FILE *out)
{
    static struct picture got;
    char name[256];
    const char *base = strrchr(path, '/') + 1;
    int plane = 0, pixel = 0;
    snprintf(name, sizeof name, "%s%.*s%s%s", strncmp(path, "tests", 5) == 0 ? "golden/" : "", (int)strcspn(base, "."), base,
             way ? "@" : "", way ? way->name : "");
    draw(path, way, &got);
    if (out) {
        write_picture(out, name, &got);
        return;
    }
    struct record *r = find_record(name, 0);
    if (!r || r->planes != PLANE_COUNT)
        fail_msg("%s: %s has no such scene: look at the picture, then record anew", name, file_name);
    r->looked_at = 1;
    check_head(name, &got, &r->picture);
    int off = count_off(&got, &r->picture, &plane, &pixel);
    if (off > 0 && !strict && is_fickle(name)) {
        for (int c = 0; c < PLANE_COUNT; c++) {
            double mean = mean_of(got.plane[c]), was = mean_of(r->picture.plane[c]);
            if (!(fabs(mean - was) <= tolerance.mean / 100 * was))
                fail_msg("%s: the mean of %s is %g, was %g", name, plane_names[c], mean, was);
        }
        return;
    }
    off_in_all += off;
    pixels_in_all += PIXELS;
    if (off > 0)
        print_message("%s: %d of %d pixels are not as recorded, the first %d, %d: %s %.6g, was %.6g\n", name, off, PIXELS,
                      pixel % WIDTH, pixel / WIDTH, plane_names[plane], got.plane[plane][pixel],
                      r->picture.plane[plane][pixel]);
    if (off > (strict ? 0 : tolerance.off_in_one / 100 * PIXELS))
        fail_msg("%s has changed", name);
}

static void check_folder(const char *pattern, FILE *out)
{
    glob_t found;
    assert_int_equal(glob(pattern, 0, NULL, &found), 0);
    for (size_t i = 0; i < found.gl_pathc; i++)
        check_picture(found.gl_pathv[i], NULL, out);
    globfree(&found);
}

static void check_ways(FILE *out)
{
    for (size_t i = 0; i < WAYS; i++)
        check_picture(ways[i].scene, &ways[i], out);
}

static void scenes_keep_their_pictures(void **state)
{
    (void)state;
    check_folder("scenes/*.pbrt", NULL);
}

static void small_scenes_keep_their_pictures(void **state)
{
    (void)state;
    check_folder("tests/golden/images/*.pbrt", NULL);
}

static void options_keep_their_pictures(void **state)
{
    (void)state;
    check_ways(NULL);
}

/* Of all that this test knows, nothing was left out, and little is off by rounding. */
static void all_were_looked_at(void **state)
{
    (void)state;
    for (int i = 0; i < record_count; i++)
        if (!records[i].looked_at)
            fail_msg("%s: %s is no longer drawn", file_name, records[i].name);
    print_message("%d of %d pixels are off\n", off_in_all, pixels_in_all);
    if (off_in_all > tolerance.off_in_all / 100 * pixels_in_all)
        fail_msg("more pixels are off than rounding explains");
}

static int record_anew(void)
{
    FILE *out = read_file(NULL) == 0 ? fopen(file_name, "w") : NULL; /* its tolerance stays */
    if (!out)
        return 1;
    fprintf(out, TOLERANCE_LINE "\n", tolerance.value, tolerance.off_in_all, tolerance.off_in_one, tolerance.mean);
    fprintf(out,
            "# Made by RECORD=1 build/tests/golden/pt_images: %d x %d pixels, %d samples, row by row. See pt_images.c.\n",
            WIDTH, HEIGHT, SPP);
    fprintf(out, "rounding %016llx\n", (unsigned long long)rounding_here());
    check_folder("scenes/*.pbrt", out);
    check_folder("tests/golden/images/*.pbrt", out);
    check_ways(out);
    return fclose(out) != 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_keep_their_pictures),
        cmocka_unit_test(small_scenes_keep_their_pictures),
        cmocka_unit_test(options_keep_their_pictures),
        cmocka_unit_test(all_were_looked_at),
    };
    if (getenv("RECORD"))
        return record_anew();
    return cmocka_run_group_tests(tests, read_file, NULL);
}
