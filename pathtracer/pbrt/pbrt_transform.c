/* The directives that change or name the current transformation matrix. */
#include <math.h>
#include <string.h>

#include "base/options.h"
#include "pbrt/pbrt_parser.h"

/* A transform may flatten what comes (Scale 0 hides things in animations): who needs its inverse sees to that. */
static int concat(struct parser *p, struct pt_xform t)
{
    for (int i = 0; i < 2; i++) {
        if ((p->state.active >> i & 1) == 0)
            continue;
        struct pt_xform next = p->directive->replaces ? t : pt_xform_mul(p->state.ctm[i], t);
        for (int k = 0; k < 12; k++)
            if (!isfinite(next.m[k / 4][k % 4]))
                return pt_parser_fail(p, "the transform is out of range (expected finite numbers)");
        p->state.ctm[i] = next;
    }
    return 0;
}

static int do_identity(struct parser *p) { return concat(p, pt_xform_identity()); }

static int do_translate(struct parser *p)
{
    return concat(p, pt_xform_translate(p->numbers[0], p->numbers[1], p->numbers[2]));
}

static int do_scale(struct parser *p) { return concat(p, pt_xform_scale(p->numbers[0], p->numbers[1], p->numbers[2])); }

static int do_rotate(struct parser *p)
{
    const double *v = p->numbers;
    if (v[1] == 0 && v[2] == 0 && v[3] == 0)
        return pt_parser_fail(p, "Rotate about the axis 0 0 0 (expected a direction)");
    return concat(p, pt_xform_rotate(v[0], v[1], v[2], v[3]));
}

static int do_look_at(struct parser *p)
{
    struct pt_xform t;
    if (!pt_xform_look_at(p->numbers, p->numbers + 3, p->numbers + 6, &t))
        return pt_parser_fail(p, "LookAt is degenerate (expected eye and target apart, up not along the view)");
    return concat(p, t);
}

static int do_transform(struct parser *p)
{
    struct pt_xform t;
    if (!pt_xform_from16(p->numbers, &t))
        return pt_parser_fail(p, "%s is not affine (expected 0 0 0 1 as every fourth number)", p->directive->name);
    return concat(p, t);
}

int pt_parser_save_system(struct parser *p, const char *name, const struct pt_xform ctm[2])
{
    int32_t id = pt_list_add(p->b, &p->systems, (const struct pt_xform(*)[2])ctm);
    if (id < 0 || pt_names_set(&p->system_names, name, id) != 0)
        return pt_diag_nomem(&p->b->diag, "coordinate systems");
    return 0;
}

static int do_coordinate_system(struct parser *p) { return pt_parser_save_system(p, p->name, p->state.ctm); }

static int do_coord_sys_transform(struct parser *p)
{
    const int32_t id = pt_names_get(&p->system_names, p->name);
    if (id < 0) { /* pbrt says so and goes on */
        pt_parser_warn(p, "unknown coordinate system \"%s\": the transform stays", p->name);
        return p->b->diag.rc;
    }
    const struct pt_xform(*systems)[2] = p->systems.items;
    /* Of both times, whatever ActiveTransform says: so pbrt does. */
    memcpy(p->state.ctm, systems[id], sizeof p->state.ctm);
    return 0;
}

static int do_active_transform(struct parser *p)
{
    struct pt_token t = pt_lexer_next(&p->lexer);
    /* by the bits of pt_state.active, from 1 on */
    static const char *const words[] = {"StartTime", "EndTime", "All", NULL};
    const int word = base_word_index(words, t.text, t.length);
    if (word < 0)
        return pt_diag_fail(&p->b->diag, pt_lexer_fault(&p->lexer, &t), "ActiveTransform needs StartTime, EndTime or All");
    p->state.active = (unsigned)word + 1;
    return 0;
}

static int do_transform_times(struct parser *p)
{
    if (p->in_world || !(p->numbers[1] >= p->numbers[0]))
        return pt_parser_fail(p, "TransformTimes must come before WorldBegin, start before end");
    memcpy(p->b->transform_times, p->numbers, sizeof p->b->transform_times);
    return 0;
}

const struct directive pt_transform_directives[] = {
    {"Transform", do_transform, .numbers = 16, .replaces = 1},
    {"ConcatTransform", do_transform, .numbers = 16},
    {"Translate", do_translate, .numbers = 3},
    {"Rotate", do_rotate, .numbers = 4},
    {"Scale", do_scale, .numbers = 3},
    {"Identity", do_identity, .replaces = 1},
    {"LookAt", do_look_at, .numbers = 9},
    {"CoordinateSystem", do_coordinate_system, .text = "name"},
    {"CoordSysTransform", do_coord_sys_transform, .text = "name"},
    {.name = "ActiveTransform", .run = do_active_transform},
    {"TransformTimes", do_transform_times, .numbers = 2},
    {0},
};
