#include "support/pt_dump.h"

#include <math.h>

#include "shade/bsdf.h"

/* Of more than so many items only some are written out. */
enum { WHOLE = 16 };

static void number(FILE *out, const char *name, double v)
{
    if (v != 0)
        fprintf(out, " %s=%.7g", name, v);
}

static void numbers(FILE *out, const char *name, const float *v, int n)
{
    fprintf(out, " %s=", name);
    for (int i = 0; i < n; i++)
        fprintf(out, i > 0 ? ",%.7g" : "%.7g", (double)v[i]);
}

static void vector(FILE *out, const char *name, pt_vec3 v)
{
    if (v3_is_black(v))
        return;
    if (v.x == v.y && v.y == v.z)
        number(out, name, (double)v.x);
    else
        numbers(out, name, &v.x, 3);
}

static void input(FILE *out, const char *name, struct pt_input in)
{
    if (in.texture)
        fprintf(out, " %s=#%d", name, (int)in.texture - 1);
    vector(out, in.texture ? "and" : name, in.value);
}

static void matrix(FILE *out, const char *name, const struct pt_mat34 *t)
{
    fprintf(out, "\n    %s", name);
    for (int i = 0; i < 12; i++)
        fprintf(out, "%s%.7g", i % 4 == 0 ? "  " : " ", (double)t->m[i]);
}

void pt_dump_header(FILE *out, const struct pt_scene *scene, const struct pt_scene_defaults *d)
{
    const struct pt_integrator *i = &d->integrator;
    const struct pt_camera *c = &scene->camera;
    fprintf(out, "film %dx%d crop %d %d %d %d spp %d file \"%s\" scale %.7g\n", d->width, d->height, d->crop[0], d->crop[1],
            d->crop[2], d->crop[3], d->spp, d->film_path, (double)scene->radiance_scale);
    fprintf(out, "filter %s %.7g %.7g sigma %.7g\n", pt_filter_words[i->filter], (double)i->filter_x, (double)i->filter_y,
            (double)i->filter_sigma);
    fprintf(out, "integrator %s %s depth %d rr %d clamp %.7g seed %u aux %d lights %s\n", pt_strategy_words[i->strategy],
            pt_sampler_words[i->sampler], i->max_depth, i->rr_depth, (double)i->max_component, i->seed, i->want_aux,
            pt_light_selection_words[scene->light_selection]);
    fprintf(out, "camera %s %dx%d", c->kind == PT_CAMERA_PERSPECTIVE ? "perspective" : "orthographic", c->width, c->height);
    number(out, "fov", (double)c->fov_deg);
    numbers(out, "screen", c->screen, 4);
    number(out, "lens", (double)c->lens_radius);
    number(out, "focus", (double)c->focal_distance);
    number(out, "medium", c->medium);
    const float plane[4] = {c->x0, c->dx, c->y0, c->dy};
    numbers(out, "plane", plane, 4);
    matrix(out, "at", &c->to_render[0]);
    if (c->animated)
        matrix(out, "to", &c->to_render[1]);
    fprintf(out, "\n");
}

/* --- images, textures, materials -------------------------------------------------------------------------------------- */

static double pixel(const struct pt_image_map *m, size_t i)
{
    return m->type == PT_PIXEL_FLOAT ? (double)((const float *)m->pixels)[i] : (double)((const uint8_t *)m->pixels)[i];
}

static void dump_images(FILE *out, const struct pt_scene *s)
{
    static const char *const types[] = {"srgb", "linear", "float"};
    for (int32_t k = 0; k < s->image_count; k++) {
        const struct pt_image_map *m = &s->images[k];
        fprintf(out, "image %d %dx%dx%d %s gamma %.7g:", k, m->width, m->height, m->channels, types[m->type],
                (double)m->gamma);
        for (size_t i = 0; i < (size_t)(m->width * m->height * m->channels); i++)
            fprintf(out, " %.7g", pixel(m, i));
        fprintf(out, "\n");
    }
}

static void dump_textures(FILE *out, const struct pt_scene *s)
{
    static const char *const kinds[] = {"constant", "image", "scale", "mix", "checkerboard", "bilerp"};
    static const char *const names[] = {"a", "b", "c", "d"};
    for (int32_t k = 0; k < s->texture_count; k++) {
        const struct pt_texture *t = &s->textures[k];
        fprintf(out, "texture %d %s", k, kinds[t->kind]);
        number(out, "image", t->image);
        number(out, "wrap", t->wrap);
        number(out, "invert", t->invert);
        number(out, "channel", t->channel);
        const float maps[5] = {t->scale, t->su, t->sv, t->du, t->dv};
        numbers(out, "map", maps, 5);
        for (int i = 0; i < 4; i++)
            input(out, names[i], t->in[i]);
        fprintf(out, "\n");
    }
}

static const char *material_word(int32_t kind)
{
    return kind < PT_BSDF_COUNT ? pt_bsdf_models[kind].file_name : kind == PT_MATERIAL_MIX ? "mix" : "interface";
}

static void dump_materials(FILE *out, const struct pt_scene *s)
{
    for (int32_t id = 0; id < s->material_count; id++) {
        const struct pt_material *m = &s->materials[id];
        fprintf(out, "material %d %s", id, material_word(m->kind));
        number(out, "remap", m->remap_roughness);
        number(out, "by-colour", m->conductor_by_colour);
        number(out, "bump", m->bump);
        number(out, "normal-map", m->normal_map);
        if (m->kind == PT_MATERIAL_MIX)
            fprintf(out, " of=%d,%d", m->mix_a, m->mix_b);
        input(out, "amount", m->mix_amount);
        input(out, "reflectance", m->reflectance);
        input(out, "transmittance", m->transmittance);
        input(out, "roughness", m->roughness_u);
        input(out, "across", m->roughness_v);
        input(out, "base-roughness", m->base_roughness_u);
        input(out, "base-across", m->base_roughness_v);
        input(out, "eta", m->eta_rgb);
        const pt_vec3 k = m->k_rgb.value; /* the root of a difference: three digits are sure */
        if (!v3_is_black(k))
            fprintf(out, " k=%.3g,%.3g,%.3g", (double)k.x, (double)k.y, (double)k.z);
        input(out, "thickness", m->thickness);
        input(out, "g", m->g);
        input(out, "albedo", m->albedo);
        number(out, "index", (double)m->eta);
        number(out, "table", m->coat_table != NULL);
        fprintf(out, "\n");
    }
}

/* --- shapes ----------------------------------------------------------------------------------------------------------- */

static void dump_vertex(FILE *out, uint32_t i, const float v[8])
{
    fprintf(out, "    %u ", i);
    for (int k = 0; k < 8; k++)
        fprintf(out, " %.7g", (double)v[k]);
    fprintf(out, "\n");
}

/* All of a short mesh; of a long one every few vertices and triangles, and sums in which each counts differently. */
static void dump_mesh(FILE *out, int32_t id, const struct pt_mesh *m)
{
    uint32_t step = m->vertex_count > WHOLE ? m->vertex_count / 5 : 1,
             every = m->triangle_count > WHOLE ? m->triangle_count / 5 : 1;
    double sums[8] = {0}, corners = 0;
    fprintf(out, "mesh %d %u %u normals %d uvs %d:", id, m->vertex_count, m->triangle_count, m->has_normals, m->has_uvs);
    for (uint32_t i = 0; i < 3 * m->triangle_count; i++) {
        corners += (double)(i % 11 + 1) * m->indices[i];
        if (i / 3 % every == 0)
            fprintf(out, i % 3 == 0 ? "  %u" : " %u", m->indices[i]);
    }
    fprintf(out, "; %.9g\n", corners);
    for (uint32_t i = 0; i < m->vertex_count; i++) {
        const struct pt_vertex *p = &m->vertices[i];
        const float v[8] = {p->p.x, p->p.y, p->p.z, p->n.x, p->n.y, p->n.z, p->u, p->v};
        for (int k = 0; k < 8; k++)
            sums[k] += (double)v[k] * (i % 13 + 1.0);
        if (i % step == 0)
            dump_vertex(out, i, v);
    }
    if (step == 1)
        return;
    fprintf(out, "    sum");
    for (int k = 0; k < 8; k++)
        fprintf(out, " %.5f", sums[k] / m->vertex_count);
    fprintf(out, "\n");
}

static void dump_quadrics(FILE *out, const struct pt_scene *s)
{
    static const char *const kinds[] = {"sphere", "disk", "cylinder"};
    for (int32_t k = 0; k < s->quadric_count; k++) {
        const struct pt_quadric *q = &s->quadrics[k];
        fprintf(out, "quadric %d %s %.7g hole %.7g z %.7g %.7g phi %.7g", k, kinds[q->kind], (double)q->radius,
                (double)q->inner_radius, (double)q->z_min, (double)q->z_max, (double)q->phi_max);
        matrix(out, "to", &q->to_render);
        matrix(out, "from", &q->from_render);
        fprintf(out, "\n");
    }
}

static void dump_shapes(FILE *out, const struct pt_scene *s)
{
    for (int32_t k = 0; k < s->shape_count; k++) {
        const struct pt_shape *p = &s->shapes[k];
        fprintf(out, "shape %d%s %s %d material %d light %d media %d %d", k, k < s->world_shape_count ? "" : " of object",
                p->kind == PT_SHAPE_MESH ? "mesh" : "quadric", p->data, p->material, p->light, p->medium_in, p->medium_out);
        number(out, "flip", p->flip_normal);
        number(out, "has-alpha", p->has_alpha);
        input(out, "alpha", p->alpha);
        fprintf(out, "\n");
    }
    for (int32_t k = 0; k < s->object_count; k++)
        fprintf(out, "object %d shapes %d + %d\n", k, s->objects[k].first_shape, s->objects[k].shape_count);
    for (int32_t k = 0; k < s->instance_count; k++) {
        const struct pt_instance *p = &s->instances[k];
        fprintf(out, "instance %d of %d moves %d", k, p->object, p->animated);
        matrix(out, "at", &p->to_render[0]);
        matrix(out, "to", &p->to_render[1]);
        fprintf(out, "\n");
    }
}

/* --- lights and media ------------------------------------------------------------------------------------------------- */

static void dump_lights(FILE *out, const struct pt_scene *s)
{
    static const char *const kinds[] = {"area", "constant", "image", "distant", "point", "spot"};
    for (int32_t k = 0; k < s->light_count; k++) {
        const struct pt_light *l = &s->lights[k];
        fprintf(out, "light %d %s shape %d image %d", k, kinds[l->kind], l->shape, l->image);
        number(out, "two-sided", l->two_sided);
        number(out, "mapping", l->mapping);
        vector(out, "emission", l->emission);
        vector(out, "position", l->position);
        vector(out, "direction", l->direction);
        number(out, "cos", l->cos_total);
        number(out, "cos-start", l->cos_start);
        if (l->has_portal) {
            vector(out, "portal", l->portal);
            vector(out, "u", l->portal_u);
            vector(out, "v", l->portal_v);
        }
        number(out, "first", l->first_emitter);
        number(out, "pmf", (double)l->emitter_pmf);
        if (l->kind == PT_LIGHT_ENV_IMAGE)
            matrix(out, "from", &l->from_render);
        fprintf(out, "\n");
    }
    for (int32_t k = 0; k < s->emitter_count && k < WHOLE; k++) {
        const struct pt_emitter *e = &s->emitters[k];
        fprintf(out, "emitter %d light %d part %d pmf %.7g", k, e->light, e->primitive, (double)e->pmf);
        number(out, "area/pmf", (double)e->area_over_pmf);
        vector(out, "n", e->n);
        fprintf(out, "\n");
    }
}

static void dump_media(FILE *out, const struct pt_scene *s)
{
    for (int32_t k = 0; k < s->medium_count; k++) {
        const struct pt_medium *m = &s->media[k];
        fprintf(out, "medium %d %s", k, m->kind == PT_MEDIUM_GRID ? "grid" : "homogeneous");
        number(out, "g", (double)m->g);
        vector(out, "absorbs", m->sigma_a);
        vector(out, "scatters", m->sigma_s);
        vector(out, "emits", m->emission);
        if (m->kind == PT_MEDIUM_GRID) {
            fprintf(out, " %dx%dx%d:", m->nx, m->ny, m->nz);
            for (int32_t i = 0; i < m->nx * m->ny * m->nz; i++)
                fprintf(out, " %.7g", (double)m->density[i]);
            fprintf(out, " most %dx%dx%d %.7g", m->mx, m->my, m->mz, (double)m->majorant[0]);
            matrix(out, "from", &m->from_render);
        }
        fprintf(out, "\n");
    }
}

void pt_dump_world(FILE *out, const struct pt_scene *s)
{
    dump_images(out, s);
    dump_textures(out, s);
    dump_materials(out, s);
    for (int32_t k = 0; k < s->mesh_count; k++)
        dump_mesh(out, k, &s->meshes[k]);
    dump_quadrics(out, s);
    dump_shapes(out, s);
    dump_lights(out, s);
    dump_media(out, s);
    for (int i = 0; i < PT_FX_COUNT; i++) {
        const struct pt_effect_reason *r = &s->effect_reasons[i];
        if ((s->effects >> i & 1) || r->line > 0)
            fprintf(out, "effect %s%s %s:%d\n", pt_effects_name(i), s->effects >> i & 1 ? "" : " off", r->file, r->line);
    }
    if (s->shape_count > 0) {
        fprintf(out, "bounds");
        numbers(out, "from", &s->bounds_min.x, 3);
        numbers(out, "to", &s->bounds_max.x, 3);
        fprintf(out, "\n");
    }
    fprintf(out, "counts %lld triangles %d quadrics %d instances %d lights %d materials %d textures\n", s->stats.triangles,
            s->quadric_count, s->instance_count, s->light_count, s->material_count, s->texture_count);
}
