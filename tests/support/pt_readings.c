#include "pt_readings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/files.h"
#include "picture/png.h"
#include "picture/read.h"
#include "pbrt/build.h"
#include "pbrt/ply.h"
#include "render/checkpoint.h"
#include "sequence/manifest.h"
#include "support/pt_fake.h"
#include "support/pt_identity.h"
#include "support/pt_memory_source.h"

static const char settings[] = "seed=1\n";

/* --- text -------------------------------------------------------------------------------------------------------------------- */

/* `head`, `item` for each i with every %zu in it that number, `tail`. */
static char *repeat(const char *head, const char *item, const char *tail, size_t items, size_t *size)
{
    char *text = NULL;
    FILE *f = open_memstream(&text, size);
    if (!f)
        return NULL;
    fputs(head, f);
    for (size_t i = 0; i < items; i++)
        for (const char *at = item, *mark; at; at = mark ? mark + 3 : NULL) {
            mark = strstr(at, "%zu");
            fwrite(at, 1, mark ? (size_t)(mark - at) : strlen(at), f);
            if (mark)
                fprintf(f, "%zu", i);
        }
    fputs(tail, f);
    return fclose(f) == 0 ? text : NULL;
}

/* --- scenes ------------------------------------------------------------------------------------------------------------------ */

static double read_scene(char *text, size_t size, size_t items)
{
    static const struct pt_load_options options;
    struct pt_source_single single = {"main", text, size};
    struct pt_source source = pt_source_from_memory(&single);
    struct pt_scene_defaults defaults = {0};
    struct base_err err = {0};
    struct pt_scene *scene = calloc(1, sizeof *scene);
    struct pt_builder *b = calloc(1, sizeof *b);
    double s = -1;
    (void)items;
    if (scene && b) {
        pt_builder_init(b, scene, &defaults, &options, &source, &err);
        double start_s = base_clock_thread_s();
        int rc = pt_pbrt_read(b, "main");
        s = rc ? -1 : base_clock_thread_s() - start_s;
        pt_builder_release(b);
        pt_arena_release(&scene->arena);
    }
    if (s < 0)
        fprintf(stderr, "%s\n", err.text);
    free(b);
    free(scene);
    free(text);
    return s;
}

static char *spheres(size_t items, size_t *size)
{
    return repeat("WorldBegin\n", "AttributeBegin\nTranslate %zu 0 0\nShape \"sphere\" \"float radius\" 2\nAttributeEnd\n",
                  "", items, size);
}

static char *numbers(size_t items, size_t *size)
{
    return repeat("WorldBegin\nShape \"trianglemesh\" \"point3 P\" [", "%zu 0 0 0 %zu 0 0 0 1.25 ",
                  "] \"integer indices\" [ 0 1 2 ]\n", items, size);
}

static char *materials(size_t items, size_t *size)
{
    return repeat("WorldBegin\n",
                  "Texture \"t%zu\" \"spectrum\" \"constant\" \"rgb value\" [ 0.1 0.2 0.3 ]\n"
                  "MakeNamedMaterial \"m%zu\" \"string type\" \"diffuse\" \"texture reflectance\" \"t%zu\"\n"
                  "NamedMaterial \"m%zu\"\nShape \"sphere\"\n",
                  "", items, size);
}

static char *objects(size_t items, size_t *size)
{
    return repeat("WorldBegin\n", "ObjectBegin \"o%zu\"\nShape \"sphere\"\nObjectEnd\nObjectInstance \"o%zu\"\n", "", items,
                  size);
}

static char *spaces(size_t items, size_t *size)
{
    return repeat("WorldBegin\n", "Translate 0 0 1\nCoordinateSystem \"c%zu\"\nCoordSysTransform \"c%zu\"\n", "", items,
                  size);
}

static char *media(size_t items, size_t *size)
{
    return repeat(
        "WorldBegin\n",
        "MakeNamedMedium \"f%zu\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 1 2 3 ]\nMediumInterface \"f%zu\" \"\"\n"
        "Shape \"sphere\"\n",
        "", items, size);
}

static char *lights(size_t items, size_t *size)
{
    return repeat("WorldBegin\n", "LightSource \"point\" \"point3 from\" [ %zu 1 2 ] \"rgb I\" [ 1 2 3 ]\n", "", items,
                  size);
}

/* --- meshes ------------------------------------------------------------------------------------------------------------------ */

static double read_ply(char *bytes, size_t size, size_t items)
{
    struct pt_ply ply;
    struct base_err err = {0};
    double start_s = base_clock_thread_s(), s;
    int rc = pt_ply_parse("f.ply", bytes, size, &ply, &err);
    s = base_clock_thread_s() - start_s;
    (void)items;
    if (rc)
        fprintf(stderr, "%s\n", err.text);
    else
        pt_ply_release(&ply);
    free(bytes);
    return rc ? -1 : s;
}

static int ply_header(char *to, size_t room, const char *format, size_t vertices, size_t faces)
{
    return snprintf(
        to, room,
        "ply\nformat %s 1.0\nelement vertex %zu\nproperty float x\nproperty float y\nproperty float z\nelement face %zu\n"
        "property list %s int vertex_indices\nend_header\n",
        format, vertices, faces, faces == 1 ? "int" : "uchar");
}

/* As many triangles as vertices. */
static char *ply_ascii(size_t items, size_t *size)
{
    char head[512], *text = NULL;
    FILE *f = open_memstream(&text, size);
    if (!f)
        return NULL;
    ply_header(head, sizeof head, "ascii", items, items);
    fputs(head, f);
    for (size_t i = 0; i < items; i++)
        fprintf(f, "%zu 0.5 -1.25\n", i);
    for (size_t i = 0; i < items; i++)
        fprintf(f, "3 %zu 0 1\n", i);
    return fclose(f) == 0 ? text : NULL;
}

static char *ply_binary_of(size_t vertices, size_t faces, size_t *size)
{
    const size_t corners = faces == 1 ? vertices : 3, count_bytes = faces == 1 ? 4 : 1;
    char *bytes = calloc(1, 512 + 12 * vertices + faces * (count_bytes + 4 * corners));
    size_t at = 0;
    if (!bytes)
        return NULL;
    at += (size_t)ply_header(bytes, 512, "binary_little_endian", vertices, faces) + 12 * vertices;
    for (size_t i = 0; i < faces; i++) {
        for (size_t k = 0; k < count_bytes; k++)
            bytes[at++] = (char)(corners >> 8 * k);
        for (size_t c = 0; c < corners; c++)
            for (size_t k = 0; k < 4; k++)
                bytes[at++] = (char)((i + c) % vertices >> 8 * k);
    }
    *size = at;
    return bytes;
}

static char *ply_binary(size_t items, size_t *size) { return ply_binary_of(items, items, size); }
static char *ply_polygon(size_t items, size_t *size) { return ply_binary_of(items, 1, size); }

/* --- textures ---------------------------------------------------------------------------------------------------------------- */

/* Rows of 64 pixels. */
static double read_image(const char *name, char *bytes, size_t size)
{
    struct pic_image image = {0};
    struct base_err err = {0};
    double start_s = base_clock_thread_s(), s;
    int rc = pic_read_memory(name, bytes, size, &image, &err);
    s = base_clock_thread_s() - start_s;
    if (rc)
        fprintf(stderr, "%s\n", err.text);
    pic_release(&image);
    free(bytes);
    return rc ? -1 : s;
}

static double read_tga(char *bytes, size_t size, size_t items) { return (void)items, read_image("t.tga", bytes, size); }
static double read_png(char *bytes, size_t size, size_t items) { return (void)items, read_image("t.png", bytes, size); }

static char *tga(size_t items, size_t *size)
{
    char *bytes = calloc(1, 18 + 192 * items);
    if (!bytes)
        return NULL;
    *size = 18 + 192 * items;
    bytes[2] = 2, bytes[12] = 64, bytes[14] = (char)(items & 255), bytes[15] = (char)(items >> 8), bytes[16] = 24;
    for (uint32_t i = 18, v = 1; i < *size; i++) { /* what no codec shortens */
        v = v * 1664525u + 1013904223u;
        bytes[i] = (char)(v >> 24);
    }
    return bytes;
}

/* What was written to a file, which is removed. */
static char *taken(const char *path, int rc, size_t *size)
{
    char *bytes = NULL;
    if (rc == 0 && base_file_read(path, (size_t)1 << 31, &bytes, size, NULL) != 0)
        bytes = NULL;
    unlink(path);
    return bytes;
}

static const char *scratch(void)
{
    static char path[64];
    snprintf(path, sizeof path, "/tmp/pt_readings_%ld", (long)getpid());
    return path;
}

static char *png(size_t items, size_t *size)
{
    char *pixels = tga(items, size), *bytes = NULL;
    if (pixels)
        bytes = taken(scratch(), pic_write_png(scratch(), 64, (int32_t)items, 3, (uint8_t *)pixels + 18, NULL), size);
    free(pixels);
    return bytes;
}

/* --- checkpoints ------------------------------------------------------------------------------------------------------------- */

/* A render of 64 pixels by `items`, in blocks of 16 × 16. */
static struct pt_render *render_of(size_t items, struct base_threads *threads)
{
    struct pt_render_config config = {.width = 64,
                                      .height = (int32_t)items,
                                      .crop = {0, 0, 64, (int32_t)items},
                                      .block_width = 16,
                                      .block_height = 16,
                                      .spp_min = 4,
                                      .spp_max = 4,
                                      .uniform = 1,
                                      .planes = PT_FILM_HALF};
    struct pt_render *r = NULL;
    return threads && pt_render_create(&config, NULL, pt_fake_noise, threads, NULL, &r, NULL) == 0 ? r : NULL;
}

static char *checkpoint(size_t items, size_t *size)
{
    struct base_threads *threads = base_threads_create(1, NULL);
    struct pt_render *r = render_of(items, threads);
    char *bytes = r ? taken(scratch(), pt_checkpoint_save(scratch(), r, PT_IDENTITY(settings), NULL), size) : NULL;
    pt_render_destroy(r);
    base_threads_destroy(threads);
    return bytes;
}

static double read_checkpoint(char *bytes, size_t size, size_t items)
{
    struct base_threads *threads = base_threads_create(1, NULL);
    struct pt_render *r = render_of(items, threads);
    FILE *f = fopen(scratch(), "wb");
    struct base_err err = {0};
    double s = -1;
    if (r && f && fwrite(bytes, 1, size, f) == size && fflush(f) == 0) {
        double start_s = base_clock_thread_s();
        int rc = pt_checkpoint_load(scratch(), r, PT_IDENTITY(settings), &err);
        s = rc ? -1 : base_clock_thread_s() - start_s;
    }
    if (s < 0)
        fprintf(stderr, "%s\n", err.text);
    if (f)
        fclose(f);
    unlink(scratch());
    pt_render_destroy(r);
    base_threads_destroy(threads);
    free(bytes);
    return s;
}

/* --- sequences --------------------------------------------------------------------------------------------------------------- */

enum { SIDE = 16, PIXELS = SIDE * SIDE };

/* A block of 16 × 16 pixels at `items` levels. */
static char *levels(size_t items, size_t *size)
{
    struct seq_builder w = {0};
    static double mean[3 * PIXELS], half[3 * PIXELS];
    int rc = seq_builder_init(&w, SIDE, SIDE, 0, 0, 0, 1, NULL);
    for (uint32_t i = 0; i < items && !rc; i++) {
        struct seq_frame frame = {.spp = i + 1, .half_spp = (i + 1) / 2, .mean = mean, .half = half};
        for (uint32_t k = 0; k < 3 * PIXELS; k++) {
            mean[k] = 0.5 + 1e-3 * (double)((i * 7919 + k * 31337) % 251);
            half[k] = 1e-4 * (double)((i * 31337 + k * 7919) % 241);
        }
        rc = seq_builder_add(&w, &frame, NULL);
    }
    char *bytes = taken(scratch(), rc ? rc : seq_builder_write(&w, scratch(), &(uint32_t){0}, NULL), size);
    seq_builder_release(&w);
    return bytes;
}

/* Parses it and decodes every level. */
static double read_levels(char *bytes, size_t size, size_t items)
{
    struct seq_block b;
    struct base_err err = {0};
    static uint8_t display[3 * PIXELS];
    static float values[3 * PIXELS];
    double start_s = base_clock_thread_s(), s = -1;
    if (seq_block_parse("block", (uint8_t *)bytes, size, &b, &err) != 0) {
        fprintf(stderr, "%s\n", err.text);
        free(bytes);
        return -1;
    }
    for (uint32_t i = 0; i < b.n_levels; i++)
        if (seq_display(&b, &b.levels[i], display, &err) || seq_mean(&b, &b.levels[i], values, &err) ||
            !seq_level(&b, i + 1))
            fprintf(stderr, "%s\n", err.text);
    if (b.n_levels == items)
        s = base_clock_thread_s() - start_s;
    seq_block_release(&b);
    return s;
}

static char *manifest(size_t items, size_t *size)
{
    return repeat("{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"camera\":\"c\",\"renderer\":\"r\","
                  "\"source\":\"s.pbrt\","
                  "\"source_crc32\":\"00000000\",\"width\":16,\"height\":16,\"block\":16,\"seed\":1,\"reference_seed\":2,"
                  "\"reference_spp\":0,\"reference_independent\":false,\"levels\":[1],"
                  "\"blocks\":[{\"id\":1048576,\"file\":\"f\",\"x0\":0,\"y0\":0,\"x1\":16,\"y1\":16,\"bytes\":1,\"crc32\":"
                  "\"00000000\"}",
                  ",{\"id\":%zu,\"file\":\"block-%zu.lseq\",\"x0\":0,\"y0\":0,\"x1\":16,\"y1\":16,\"bytes\":1,"
                  "\"crc32\":\"00000000\"}",
                  "]}\n", items, size);
}

static double read_manifest(char *text, size_t size, size_t items)
{
    struct seq_manifest m;
    struct base_err err = {0};
    double start_s = base_clock_thread_s(), s;
    int rc = seq_manifest_parse("manifest.json", text, size, &m, &err);
    s = base_clock_thread_s() - start_s;
    if (rc)
        fprintf(stderr, "%s\n", err.text);
    else
        rc = m.n_blocks != items + 1;
    if (!rc)
        seq_manifest_release(&m);
    free(text);
    return rc ? -1 : s;
}

const struct base_reading pt_readings[PT_READINGS] = {
    {"pbrt: shapes", 200, 0, spheres, read_scene},
    {"pbrt: one long list", 1000, 0, numbers, read_scene},
    {"pbrt: named materials", 500, 0, materials, read_scene},
    {"pbrt: objects", 1000, 0, objects, read_scene},
    {"pbrt: coordinate systems", 2000, 0, spaces, read_scene},
    {"pbrt: media", 500, 0, media, read_scene},
    {"pbrt: lights", 200, 0, lights, read_scene},
    {"PLY: ascii", 1000, 0, ply_ascii, read_ply},
    {"PLY: binary", 10000, 0, ply_binary, read_ply},
    {"PLY: one polygon", 4000, 65536, ply_polygon, read_ply},
    {"texture: TGA", 256, 32768, tga, read_tga},
    {"texture: PNG", 64, 32768, png, read_png},
    {"checkpoint", 64, 65536, checkpoint, read_checkpoint},
    {"sequence: levels", 16, 4000, levels, read_levels},
    {"sequence: manifest", 4000, 1 << 19, manifest, read_manifest},
};
