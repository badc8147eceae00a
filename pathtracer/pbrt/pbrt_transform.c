/* The directives that change or name the current transformation matrix. */
#include <math.h>
#include <string.h>

#include "pbrt/pbrt_parser.h"

/* A transform may flatten what comes (Scale 0 hides things in animations): who needs its inverse sees to that. */
static int concat(struct parser *p, const struct pt_xform *t, int replace)
{
    for (int i = 0; i < 2; i++) {
        if ((p->state.active >> i & 1) == 0)
            continue;
        struct pt_xform next = replace ? *t : pt_xform_mul(&p->state.ctm[i], t);
        for (int k = 0; k < 12; k++)
            if (!isfinite(next.m[k / 4][k % 4]))
                return pt_diag_fail(&p->b->diag, p->loc, "the transform is out of range (expected finite numbers)");
        p->state.ctm[i] = next;
    }
    return 0;
}

static int do_identity(struct parser *p)
{
    struct pt_xform t = pt_xform_identity();
    return concat(p, &t, 1);
}

static int do_translate(struct parser *p)
{
    double v[3] = {0};
    int rc = pt_parser_read_numbers(p, "Translate", v, 3);
    struct pt_xform t = pt_xform_translate(v[0], v[1], v[2]);
    return rc ? rc : concat(p, &t, 0);
}

static int do_scale(struct parser *p)
{
    double v[3] = {0};
    int rc = pt_parser_read_numbers(p, "Scale", v, 3);
    struct pt_xform t = pt_xform_scale(v[0], v[1], v[2]);
    return rc ? rc : concat(p, &t, 0);
}

static int do_rotate(struct parser *p)
{
    double v[4] = {0};
    int rc = pt_parser_read_numbers(p, "Rotate", v, 4);
    if (rc)
        return rc;
    if (v[1] == 0 && v[2] == 0 && v[3] == 0)
        return pt_diag_fail(&p->b->diag, p->loc, "Rotate about the axis 0 0 0 (expected a direction)");
    struct pt_xform t = pt_xform_rotate(v[0], v[1], v[2], v[3]);
    return concat(p, &t, 0);
}

static int do_look_at(struct parser *p)
{
    double v[9] = {0};
    struct pt_xform t;
    int rc = pt_parser_read_numbers(p, "LookAt", v, 9);
    if (rc)
        return rc;
    if (!pt_xform_look_at(v, v + 3, v + 6, &t))
        return pt_diag_fail(&p->b->diag, p->loc,
                            "LookAt is degenerate (expected eye and target apart, up not along the view)");
    return concat(p, &t, 0);
}

static int do_matrix(struct parser *p, const char *name, int replace)
{
    double v[16] = {0};
    struct pt_xform t;
    int rc = pt_parser_read_numbers(p, name, v, 16);
    if (rc)
        return rc;
    if (!pt_xform_from16(v, &t))
        return pt_diag_fail(&p->b->diag, p->loc, "%s is not affine (expected 0 0 0 1 as every fourth number)", name);
    return concat(p, &t, replace);
}

static int do_transform(struct parser *p) { return do_matrix(p, "Transform", 1); }

static int do_concat_transform(struct parser *p) { return do_matrix(p, "ConcatTransform", 0); }

int pt_parser_save_system(struct parser *p, const char *name, const struct pt_xform ctm[2])
{
    int32_t id = pt_list_add(p->b, &p->systems, ctm);
    if (id < 0 || pt_names_set(&p->system_names, name, id) != 0)
        return pt_diag_nomem(&p->b->diag, "coordinate systems");
    return 0;
}

static int do_coordinate_system(struct parser *p)
{
    char name[NAME_MAX_BYTES];
    int rc = pt_parser_read_string(p, "name", name, sizeof name);
    return rc ? rc : pt_parser_save_system(p, name, p->state.ctm);
}

static int do_coord_sys_transform(struct parser *p)
{
    char name[NAME_MAX_BYTES];
    int rc = pt_parser_read_string(p, "name", name, sizeof name);
    if (rc)
        return rc;
    int32_t id = pt_names_get(&p->system_names, name);
    if (id < 0) { /* pbrt says so and goes on */
        pt_diag_warn(&p->b->diag, p->loc, "unknown coordinate system \"%s\": the transform stays", name);
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
    if (t.length == 9 && memcmp(t.text, "StartTime", 9) == 0)
        p->state.active = 1;
    else if (t.length == 7 && memcmp(t.text, "EndTime", 7) == 0)
        p->state.active = 2;
    else if (t.length == 3 && memcmp(t.text, "All", 3) == 0)
        p->state.active = 3;
    else
        return pt_diag_fail(&p->b->diag, pt_lexer_fault(&p->lexer, &t), "ActiveTransform needs StartTime, EndTime or All");
    return 0;
}

static int do_transform_times(struct parser *p)
{
    double v[2] = {0, 1};
    int rc = pt_parser_read_numbers(p, "TransformTimes", v, 2);
    if (rc)
        return rc;
    if (p->in_world || !(v[1] >= v[0]))
        return pt_diag_fail(&p->b->diag, p->loc, "TransformTimes must come before WorldBegin, start before end");
    p->b->transform_times[0] = v[0];
    p->b->transform_times[1] = v[1];
    return 0;
}

const struct directive pt_transform_directives[] = {
    {.name = "Transform", .run = do_transform},
    {.name = "ConcatTransform", .run = do_concat_transform},
    {.name = "Translate", .run = do_translate},
    {.name = "Rotate", .run = do_rotate},
    {.name = "Scale", .run = do_scale},
    {.name = "Identity", .run = do_identity},
    {.name = "LookAt", .run = do_look_at},
    {.name = "CoordinateSystem", .run = do_coordinate_system},
    {.name = "CoordSysTransform", .run = do_coord_sys_transform},
    {.name = "ActiveTransform", .run = do_active_transform},
    {.name = "TransformTimes", .run = do_transform_times},
    {0},
};
