#include "pt_text_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pbrt/load.h"
#include "support/pt_captured.h"
#include "support/pt_memory_source.h"

static int load(const char *text, int strict, int *warnings, struct pt_scene **scene, struct pt_scene_defaults *defaults,
                struct base_err *err)
{
    struct captured messages;
    struct pt_source_single single = {"t.pbrt", text, strlen(text)};
    struct pt_source source = pt_source_from_memory(&single);
    struct pt_load_options options = {.strict = strict, .log = &messages.log};
    capture_begin(&messages);
    int rc = pt_scene_load_source("t.pbrt", &source, &options, scene, defaults, err);
    if (warnings)
        *warnings += captured_lines(&messages);
    capture_end(&messages);
    return rc;
}

struct pt_scene *text_scene(const char *text, struct pt_scene_defaults *defaults, int *warnings)
{
    struct pt_scene *scene = NULL;
    struct pt_scene_defaults found;
    struct base_err err = {0};
    if (load(text, 0, warnings, &scene, &found, &err) != 0)
        fail_msg("%s", err.text);
    if (defaults)
        *defaults = found;
    return scene;
}

int text_scene_error(const char *text, int strict, struct base_err *err)
{
    struct pt_scene *scene = NULL;
    struct pt_scene_defaults found;
    *err = (struct base_err){0};
    int rc = load(text, strict, NULL, &scene, &found, err);
    if (!rc)
        pt_scene_destroy(scene);
    else
        assert_null(strchr(err->text, '\n'));
    return rc;
}

struct pt_scene *world_scene(const char *body)
{
    static const char head[] =
        "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 Camera \"perspective\"\nWorldBegin\n";
    char *text = malloc(sizeof head + strlen(body));
    assert_non_null(text);
    strcpy(text, head);
    strcat(text, body);
    struct pt_scene *scene = text_scene(text, NULL, NULL);
    free(text);
    return scene;
}
