#include "pbrt/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "geom/accel.h"
#include "integ/contact.h"
#include "shade/camera.h"
#include "shade/light_build.h"
#include "shade/material.h"
#include "shade/medium.h"

void pt_builder_init(struct pt_builder *b, struct pt_scene *scene, struct pt_scene_defaults *defaults,
                     const struct pt_load_options *options, const struct pt_source *source, struct base_err *err)
{
    *b = (struct pt_builder){.scene = scene, .defaults = defaults, .options = options, .source = source};
    b->diag = (struct pt_diag){.err = err, .strict = options->strict, .log = options->log};
    b->camera_medium = b->open_object = b->default_material = -1;
    b->transform_times[1] = b->shutter[1] = 1;
    b->camera_ctm[0] = b->camera_ctm[1] = pt_xform_identity();
}

void pt_builder_release(struct pt_builder *b)
{
    struct pt_list *lists[] = {&b->images,   &b->textures,     &b->materials,     &b->material_infos, &b->meshes,
                               &b->quadrics, &b->world_shapes, &b->object_shapes, &b->objects,        &b->instances,
                               &b->lights,   &b->media,        &b->medium_infos,  &b->name_undo,      &b->object_infos};
    struct pt_names *names[] = {&b->float_textures, &b->colour_textures, &b->named_materials,
                                &b->media_names,    &b->object_names,    &b->image_names};
    struct pt_material_info *infos = b->material_infos.items;
    for (size_t i = 0; i < b->material_infos.count; i++)
        pt_params_release(&infos[i].params);
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++)
        free(lists[i]->items);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        pt_names_release(names[i]);
    for (int i = 0; i < PT_HEADER_COUNT; i++)
        pt_params_release(&b->header[i]);
    pt_diag_release(&b->diag);
}

int32_t pt_list_add_bytes(struct pt_builder *b, struct pt_list *list, const void *item, size_t size)
{
    if (list->count >= INT32_MAX || !pt_grow(&list->items, &list->room, list->count, size)) {
        pt_diag_nomem(&b->diag, "the scene");
        return -1;
    }
    list->size = size;
    memcpy((char *)list->items + list->count * size, item, size);
    return (int32_t)list->count++;
}

void pt_builder_path(struct pt_builder *b, const char *name, char *path, size_t room)
{
    snprintf(path, room, "%s%s", name[0] == '/' ? "" : b->directory, name);
}

int pt_builder_name(struct pt_builder *b, struct pt_names *names, const char *name, int32_t value)
{
    if (b->name_scopes > 0) {
        struct pt_name_undo undo = {names, pt_arena_strdup(&b->scene->arena, name), pt_names_get(names, name)};
        if (!undo.name)
            return pt_diag_nomem(&b->diag, "names");
        if (pt_list_add(b, &b->name_undo, &undo) < 0)
            return b->diag.rc;
    }
    return pt_names_set(names, name, value) == 0 ? 0 : pt_diag_nomem(&b->diag, "names");
}

void pt_builder_forget_names(struct pt_builder *b, size_t count)
{
    const struct pt_name_undo *undo = b->name_undo.items;
    for (; b->name_undo.count > count; b->name_undo.count--) {
        const struct pt_name_undo *last = &undo[b->name_undo.count - 1];
        pt_names_set(last->names, last->name, last->value); /* it is there: nothing can fail */
    }
}

void pt_builder_effect(struct pt_builder *b, pt_effects bits, struct pt_loc loc)
{
    for (int i = 0; i < PT_FX_COUNT; i++) {
        struct pt_effect_reason *r = &b->scene->effect_reasons[i];
        if ((bits >> i & 1u) == 0 || r->line > 0)
            continue;
        r->line = loc.line;
        snprintf(r->file, sizeof r->file, "%s", loc.file ? loc.file : "");
    }
    b->scene->effects |= bits;
}

int pt_builder_at_shutter(const struct pt_builder *b, const struct pt_xform ctm[2], struct pt_xform out[2])
{
    double t0 = b->transform_times[0], length = b->transform_times[1] - t0;
    for (int i = 0; i < 2; i++) {
        double s = length > 0 ? (b->shutter[i] - t0) / length : 0;
        s = fmin(fmax(s, 0), 1);
        if (pt_xform_equal(&ctm[0], &ctm[1]) || s <= 0)
            out[i] = ctm[0];
        else if (s >= 1)
            out[i] = ctm[1];
        else
            out[i] = pt_xform_interpolate(&ctm[0], &ctm[1], s);
    }
    return !pt_xform_equal(&out[0], &out[1]);
}

static void check_made(struct pt_builder *b, const struct pt_list *list, const char *what, const char *maker)
{
    for (size_t i = 0; i < list->count; i++) {
        const struct pt_wanted *wanted = (const void *)((const char *)list->items + i * list->size);
        if (wanted->name)
            pt_diag_fail(&b->diag, wanted->loc, "unknown %s \"%s\" (expected one made by %s)", what, wanted->name, maker);
    }
}

int pt_builder_check(struct pt_builder *b)
{
    check_made(b, &b->material_infos, "material", "MakeNamedMaterial");
    check_made(b, &b->object_infos, "object", "ObjectBegin");
    check_made(b, &b->medium_infos, "medium", "MakeNamedMedium");
    if (b->diag.rc)
        return b->diag.rc;
    pt_build_drop_instances(b);
    pt_build_check_grids(b);
    return b->diag.rc;
}

struct pt_xform pt_builder_to_render(const struct pt_builder *b, struct pt_xform world)
{
    for (int i = 0; i < 3; i++)
        world.m[i][3] -= b->origin[i];
    return world;
}

/* Array of a list in the arena; leaves NULL for empty lists. */
static void *move(struct pt_builder *b, struct pt_list *list, int32_t *count)
{
    *count = (int32_t)list->count;
    void *kept = pt_arena_alloc(&b->scene->arena, list->count, list->size);
    if (kept)
        memcpy(kept, list->items, list->count * list->size);
    else if (list->count > 0)
        pt_diag_nomem(&b->diag, "the scene");
    free(list->items);
    *list = (struct pt_list){0};
    return kept;
}

/* The shapes of objects go behind those of the world. */
static void join_shapes(struct pt_builder *b)
{
    const struct pt_shape *shapes = b->object_shapes.items;
    struct pt_object *objects = b->objects.items;
    b->scene->world_shape_count = (int32_t)b->world_shapes.count;
    for (size_t i = 0; i < b->objects.count; i++)
        objects[i].first_shape += b->scene->world_shape_count;
    for (size_t i = 0; i < b->object_shapes.count && !b->diag.rc; i++)
        pt_list_add(b, &b->world_shapes, &shapes[i]);
}

static void add_medium_effects(struct pt_builder *b, int32_t id)
{
    if (id < 0)
        return;
    const struct pt_medium *m = &b->scene->media[id];
    struct pt_loc loc = ((struct pt_medium_info *)b->medium_infos.items)[id].defined;
    if (!v3_is_black(m->sigma_a) || !v3_is_black(m->emission))
        pt_builder_effect(b, PT_FX_ABSORPTION, loc);
    if (!v3_is_black(m->sigma_s))
        pt_builder_effect(b, PT_FX_SCATTERING, loc);
    if (m->kind == PT_MEDIUM_GRID)
        pt_builder_effect(b, PT_FX_GRID_MEDIUM, loc);
}

/* What the shapes in use ask for: materials and media nobody uses ask for nothing. */
static void add_shape_effects(struct pt_builder *b)
{
    const struct pt_scene *scene = b->scene;
    struct pt_material_info *infos = b->material_infos.items;
    for (int32_t i = 0; i < scene->shape_count; i++) {
        const struct pt_shape *s = &scene->shapes[i];
        struct pt_material_info *info = &infos[s->material];
        if (!info->used)
            pt_builder_effect(b, pt_material_effects(scene, s->material), info->loc);
        info->used = 1;
        if (s->medium_in != s->medium_out) {
            add_medium_effects(b, s->medium_in);
            add_medium_effects(b, s->medium_out);
        }
    }
    add_medium_effects(b, scene->camera.medium);
}

static void add_stats(struct pt_scene *scene)
{
    struct pt_scene_stats *stats = &scene->stats;
    for (int32_t i = 0; i < scene->mesh_count; i++)
        stats->triangles += scene->meshes[i].triangle_count;
    stats->bytes = (long long)scene->arena.bytes + pt_accel_bytes(scene);
}

/* Moves the arrays into the scene's arena and derives everything: effects, camera, acceleration structure, lights. *start:
 * where the camera's rays should begin. */
static int finish(struct pt_builder *b, double *start)
{
    struct pt_scene *scene = b->scene;
    struct base_err *err = b->diag.err;
    join_shapes(b);
    scene->images = move(b, &b->images, &scene->image_count);
    scene->textures = move(b, &b->textures, &scene->texture_count);
    scene->materials = move(b, &b->materials, &scene->material_count);
    scene->meshes = move(b, &b->meshes, &scene->mesh_count);
    scene->quadrics = move(b, &b->quadrics, &scene->quadric_count);
    scene->objects = move(b, &b->objects, &scene->object_count);
    scene->instances = move(b, &b->instances, &scene->instance_count);
    scene->lights = move(b, &b->lights, &scene->light_count);
    scene->media = move(b, &b->media, &scene->medium_count);
    scene->shapes = move(b, &b->world_shapes, &scene->shape_count);
    int rc = b->diag.rc;
    if (!rc)
        rc = pt_build_cut_instances(b);
    if (!rc)
        rc = pt_materials_build(scene, err);
    if (!rc)
        rc = pt_media_build(scene, err);
    if (rc)
        return rc;
    /* In this order: effects ask for finished materials and media, lights for the bounds of all shapes. */
    add_shape_effects(b);
    scene->effects |= b->options->forced;
    scene->light_selection = b->options->light_selection;
    pt_camera_init(&scene->camera);
    double start_s = base_clock_wall_s();
    rc = pt_accel_build(scene, err);
    if (!rc)
        *start = pt_build_far_view(b);
    rc = rc ? rc : b->diag.rc;
    const int stays = *start == b->camera_start; /* else all of it goes */
    if (!rc && stays)
        rc = pt_contacts_find(scene, err);
    scene->stats.accel_s = base_clock_wall_s() - start_s;
    if (!rc && stays)
        rc = pt_lights_build(scene, err);
    if (!rc)
        add_stats(scene);
    return rc;
}

void pt_scene_destroy(struct pt_scene *scene)
{
    if (!scene)
        return;
    pt_accel_release(scene);
    pt_arena_release(&scene->arena);
    free(scene);
}

/* With the camera's rays from depth *start on; *start becomes where they should begin. */
static int load_from(double *start, const char *path, const struct pt_source *source, const struct pt_load_options *options,
                     struct pt_scene **out, struct pt_scene_defaults *defaults, struct base_err *err)
{
    struct pt_scene_defaults found = {0};
    struct pt_builder b;
    double start_s = base_clock_wall_s();
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) + 1 : 0;
    if (length >= sizeof b.directory)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", path);
    struct pt_scene *scene = calloc(1, sizeof *scene);
    if (!scene)
        return base_fail_nomem(err, "the scene");
    pt_builder_init(&b, scene, &found, options, source, err);
    b.camera_start = *start;
    b.diag.log = *start > 0 ? NULL : options->log; /* all of it is noted */
    memcpy(b.directory, path, length);
    int rc = pt_pbrt_read(&b, path);
    /* Textures are read while the file is parsed, but their time has a row of its own. */
    scene->stats.parse_s = base_clock_wall_s() - start_s - scene->stats.texture_s;
    start_s = base_clock_wall_s();
    if (!rc)
        rc = finish(&b, start);
    scene->stats.build_s = base_clock_wall_s() - start_s - scene->stats.accel_s;
    if (!rc) {
        *out = scene;
        *defaults = found;
        scene = NULL;
    }
    pt_builder_release(&b);
    pt_scene_destroy(scene);
    return rc;
}

int pt_scene_load_source(const char *path, const struct pt_source *source, const struct pt_load_options *options,
                         struct pt_scene **out, struct pt_scene_defaults *defaults, struct base_err *err)
{
    static const struct pt_load_options no_options;
    struct pt_scene_defaults found;
    struct pt_scene *scene = NULL;
    double start = 0, before;
    int rc, reads = 0;
    do { /* each time nearer to what a camera sees that looks from afar, as far as floats told the time before */
        pt_scene_destroy(scene);
        scene = NULL;
        before = start;
        rc = load_from(&start, path, source, options ? options : &no_options, &scene, &found, err);
    } while (!rc && start != before && ++reads < 4);
    if (!rc) {
        *out = scene;
        *defaults = found;
    }
    return rc;
}

int pt_scene_load(const char *path, const struct pt_load_options *options, struct pt_scene **out,
                  struct pt_scene_defaults *defaults, struct base_err *err)
{
    const struct pt_source files = pt_source_files(options ? options->inputs : NULL);
    return pt_scene_load_source(path, &files, options, out, defaults, err);
}
