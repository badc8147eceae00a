/* Scene text: any bytes either load into a description or give one line; nothing outside memory is opened. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "pbrt/build.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct input {
    const uint8_t *data;
    size_t size;
};

/* What included names hold, by their end, so that the fuzzer gets past the reading. */
static const struct {
    const char *end, *text;
} others[] = {
    {".ply",
     "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
     "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
    {".spd", "400 0.5 # comment\n700 1.5\n"},
    {".pbrt", "Shape \"sphere\" \"float radius\" 2\n"},
};

static int ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n >= m && strcmp(text + n - m, end) == 0;
}

static int read_memory(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    const struct input *in = data;
    const void *from = NULL;
    if (strcmp(path, "main") == 0) {
        from = in->data;
        *size = in->size;
    }
    for (size_t i = 0; i < sizeof others / sizeof others[0] && !from; i++)
        if (ends_with(path, others[i].end)) {
            from = others[i].text;
            *size = strlen(others[i].text);
        }
    if (!from && strcmp(path, "main") != 0)
        return base_fail(err, BASE_EIO, "%s: no such file", path);
    *bytes = malloc(*size + 1);
    if (!*bytes)
        return base_fail_nomem(err, path);
    if (*size > 0)
        memcpy(*bytes, from, *size);
    (*bytes)[*size] = '\0';
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct pt_load_options options;
    struct input in = {data, size};
    struct pt_source source = {read_memory, NULL, &in, 0};
    struct pt_scene_defaults defaults = {0};
    struct base_err err = {0};
    struct pt_scene *scene = calloc(1, sizeof *scene);
    struct pt_builder *b = calloc(1, sizeof *b);
    if (!scene || !b)
        abort();
    pt_builder_init(b, scene, &defaults, &options, &source, &err);
    int rc = pt_pbrt_read(b, "main");
    if ((rc != 0) != (err.text[0] != '\0') || strchr(err.text, '\n'))
        abort();
    pt_builder_release(b);
    pt_arena_release(&scene->arena);
    free(b);
    free(scene);
    return 0;
}
