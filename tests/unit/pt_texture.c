/* Texture lookups: wrapping, decoding, filtering, combinations. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "scene/scene.h"
#include "shade/texture.h"
#include "support/pt_text_scene.h"

static int near(float a, float b) { return fabsf(a - b) < 1e-5f; }
static int near3(pt_vec3 a, float x, float y, float z) { return near(a.x, x) && near(a.y, y) && near(a.z, z); }

/* 2×2: red, green over blue, white */
static const uint8_t corners[2 * 2 * 3] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255};
static const float ramp[4] = {0.0f, 1.0f, 2.0f, 3.0f};
static const uint8_t half_alpha[4] = {188, 188, 188, 51};

static struct pt_image_map images[] = {
    {.width = 2, .height = 2, .channels = 3, .type = PT_PIXEL_U8_SRGB, .gamma = 1.0f, .pixels = corners},
    {.width = 4, .height = 1, .channels = 1, .type = PT_PIXEL_FLOAT, .gamma = 1.0f, .pixels = ramp},
    {.width = 1, .height = 1, .channels = 4, .type = PT_PIXEL_U8_SRGB, .gamma = 1.0f, .pixels = half_alpha},
    {.width = 1, .height = 1, .channels = 4, .type = PT_PIXEL_U8_LINEAR, .gamma = 2.0f, .pixels = half_alpha},
};

static void texels_wrap(void **state)
{
    (void)state;
    const struct pt_image_map *r = &images[1];
    assert_true(pt_image_texel(r, PT_WRAP_REPEAT, 0, -1, 0).x == 3.0f);
    assert_true(pt_image_texel(r, PT_WRAP_REPEAT, 0, 9, -5).x == 1.0f);
    assert_true(pt_image_texel(r, PT_WRAP_CLAMP, 0, -7, 3).x == 0.0f);
    assert_true(pt_image_texel(r, PT_WRAP_CLAMP, 0, 7, 0).x == 3.0f);
    assert_true(pt_image_texel(r, PT_WRAP_BLACK, 0, 4, 0).x == 0.0f);
    assert_true(pt_image_texel(r, PT_WRAP_BLACK, 0, 3, 0).x == 3.0f);
    assert_true(pt_image_texel(r, PT_WRAP_BLACK, 0, 3, 1).x == 0.0f);
}

static void bytes_are_linearised(void **state)
{
    (void)state;
    /* sRGB 188 is the code of about one half */
    pt_vec3 srgb = pt_image_texel(&images[2], PT_WRAP_REPEAT, 0, 0, 0),
            lin = pt_image_texel(&images[3], PT_WRAP_REPEAT, 0, 0, 0);
    assert_true(fabsf(srgb.x - 0.5029f) < 1e-4f);
    assert_true(near(lin.x, (188.0f / 255.0f) * (188.0f / 255.0f)));
    /* alpha is never encoded */
    assert_true(near(pt_image_texel(&images[2], PT_WRAP_REPEAT, 3, 0, 0).x, 0.2f));
    assert_true(pt_image_texel(&images[0], PT_WRAP_REPEAT, 3, 0, 0).x == 1.0f);
    assert_true(near(pt_image_texel(&images[0], PT_WRAP_REPEAT, -1, 0, 0).y, 1.0f / 3.0f));
}

static void bilinear_interpolates_between_centres(void **state)
{
    (void)state;
    const struct pt_image_map *r = &images[1];
    assert_true(near(pt_image_bilinear(r, PT_WRAP_CLAMP, 0, 0.375f, 0.5f).x, 1.0f));
    assert_true(near(pt_image_bilinear(r, PT_WRAP_CLAMP, 0, 0.5f, 0.5f).x, 1.5f));
    assert_true(near(pt_image_bilinear(r, PT_WRAP_CLAMP, 0, 0.0f, 0.5f).x, 0.0f));
    assert_true(near(pt_image_bilinear(r, PT_WRAP_REPEAT, 0, 0.0f, 0.5f).x, 1.5f)); /* between 3 and 0 */
    assert_true(near3(pt_image_bilinear(&images[0], PT_WRAP_CLAMP, 0, 0.5f, 0.5f), 0.5f, 0.5f, 0.5f));
    const float odd[] = {NAN, INFINITY, -INFINITY, 1e30f, -3e9f};
    for (int i = 0; i < 5; i++)
        assert_true(v3_is_finite(pt_image_bilinear(r, PT_WRAP_REPEAT, 0, odd[i], odd[i])));
}

#define CONST(v) \
    { \
        .value = { v, v, v } \
    }

static void kinds_of_texture(void **state)
{
    (void)state;
    struct pt_texture textures[] = {
        {.kind = PT_TEXTURE_IMAGE, .image = 0, .wrap = PT_WRAP_CLAMP, .scale = 1, .su = 1, .sv = 1},
        {.kind = PT_TEXTURE_IMAGE, .image = 0, .wrap = PT_WRAP_CLAMP, .scale = 0.5f, .invert = 1, .su = 1, .sv = 1},
        {.kind = PT_TEXTURE_SCALE, .su = 1, .sv = 1, .in = {{.texture = 1}, CONST(0.5f)}},
        {.kind = PT_TEXTURE_MIX, .su = 1, .sv = 1, .in = {CONST(0.0f), CONST(8.0f), CONST(0.25f)}},
        {.kind = PT_TEXTURE_CHECKERBOARD, .su = 4, .sv = 2, .du = 0.5f, .in = {CONST(1.0f), CONST(2.0f)}},
        {.kind = PT_TEXTURE_BILERP, .su = 1, .sv = 1, .in = {CONST(0.0f), CONST(1.0f), CONST(2.0f), CONST(3.0f)}},
        {.kind = PT_TEXTURE_CONSTANT, .in = {CONST(0.7f)}},
    };
    struct pt_scene scene = {.images = images, .textures = textures, .image_count = 4, .texture_count = 7};
    /* v runs upwards: the upper left texel is at (0, 1) */
    assert_true(near3(pt_texture_eval(&scene, 1, 0.0f, 1.0f), 1, 0, 0));
    assert_true(near3(pt_texture_eval(&scene, 1, 1.0f, 0.0f), 1, 1, 1));
    assert_true(near3(pt_texture_eval(&scene, 1, 0.0f, 0.0f), 0, 0, 1));
    assert_true(near3(pt_texture_eval(&scene, 2, 0.0f, 1.0f), 0.5f, 1, 1)); /* scaled, then inverted, as pbrt-v4 does */
    assert_true(near3(pt_texture_eval(&scene, 3, 0.0f, 1.0f), 0.5f, 0, 0));
    assert_true(near(pt_texture_eval(&scene, 4, 0.3f, 0.3f).x, 2.0f));
    assert_true(near(pt_texture_eval(&scene, 5, 0.0f, 0.0f).x, 1.0f));
    assert_true(near(pt_texture_eval(&scene, 5, 0.2f, 0.0f).x, 2.0f));
    assert_true(near(pt_texture_eval(&scene, 5, 0.2f, 0.6f).x, 1.0f));
    assert_true(near(pt_texture_eval(&scene, 5, -0.2f, 0.0f).x, 2.0f));
    assert_true(near(pt_texture_eval(&scene, 6, 0.5f, 0.25f).x, 1.25f));
    assert_true(near(pt_texture_eval(&scene, 7, 0.5f, 0.25f).x, 0.7f));
}

/* The filter "point" of pbrt-v4 blends nothing. */
static void nearest_texels(void **state)
{
    (void)state;
    struct pt_texture textures[] = {
        {.kind = PT_TEXTURE_IMAGE, .wrap = PT_WRAP_REPEAT, .is_nearest = 1, .scale = 1, .su = 1, .sv = 1},
        {.kind = PT_TEXTURE_IMAGE, .wrap = PT_WRAP_BLACK, .is_nearest = 1, .scale = 2, .su = 1, .sv = 1}};
    struct pt_scene scene = {.images = images, .textures = textures, .image_count = 1, .texture_count = 2};
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < 2; x++)
            for (float in = 0.01f; in < 1.0f; in += 0.245f) {
                float u = 0.5f * ((float)x + in), v = 1.0f - 0.5f * ((float)y + in);
                pt_vec3 want = pt_image_texel(&images[0], PT_WRAP_CLAMP, 0, x, y);
                assert_true(near3(pt_texture_eval(&scene, 1, u - 3.0f, v + 5.0f), want.x, want.y, want.z));
                assert_true(near3(pt_texture_eval(&scene, 2, u, v), 2 * want.x, 2 * want.y, 2 * want.z));
                assert_true(v3_is_black(pt_texture_eval(&scene, 2, u + 1.0f, v)));
            }
    const float odd[] = {NAN, INFINITY, -INFINITY, 1e30f, -3e9f};
    for (int i = 0; i < 5; i++)
        assert_true(v3_is_finite(pt_texture_eval(&scene, 1, odd[i], odd[i])));
}

/* Whatever reads coordinates reads them at (su u + du, sv v + dv), as the file says them. */
static void scale_and_offset(void **state)
{
    (void)state;
    struct pt_scene *s =
        world_scene("Texture \"plane\" \"spectrum\" \"bilerp\" \"rgb v00\" [0 0 0] \"rgb v01\" [1 1 1] \"rgb v10\" [2 2 2] "
                    "\"rgb v11\" [3 3 3]\n"
                    "  \"float uscale\" 0.5 \"float vscale\" 0.25 \"float udelta\" 0.125 \"float vdelta\" 0.375\n"
                    "Material \"diffuse\" \"texture reflectance\" \"plane\" Shape \"sphere\"\n");
    assert_int_equal(s->texture_count, 1);
    const struct pt_texture *t = &s->textures[0];
    assert_true(t->su == 0.5f && t->sv == 0.25f && t->du == 0.125f && t->dv == 0.375f);
    static const float at[][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5f, 0.75f}};
    for (int i = 0; i < 4; i++) { /* 2 s + w on the plane through its corners */
        float plane = 2.0f * (0.5f * at[i][0] + 0.125f) + (0.25f * at[i][1] + 0.375f);
        assert_true(near(pt_texture_eval(s, 1, at[i][0], at[i][1]).y, plane));
    }
    pt_scene_destroy(s);
    /* an image: texel (1, 0) of the lower row, from the centre of the upper left one and there by du and dv alone */
    struct pt_texture moved = {
        .kind = PT_TEXTURE_IMAGE, .wrap = PT_WRAP_REPEAT, .scale = 1, .su = 1, .sv = 1, .du = 0.5f, .dv = -0.5f};
    struct pt_scene scene = {.images = images, .textures = &moved, .image_count = 1, .texture_count = 1};
    assert_true(near3(pt_texture_eval(&scene, 1, 0.25f, 0.75f), 1, 1, 1)); /* white */
    moved.du = 0;
    assert_true(near3(pt_texture_eval(&scene, 1, 0.25f, 0.75f), 0, 0, 1)); /* blue, below */
    moved.dv = 0;
    assert_true(near3(pt_texture_eval(&scene, 1, 0.25f, 0.75f), 1, 0, 0));
    /* a checkerboard of half a square upwards */
    struct pt_texture board = {
        .kind = PT_TEXTURE_CHECKERBOARD, .su = 1, .sv = 1, .dv = 0.5f, .in = {CONST(1.0f), CONST(2.0f)}};
    scene.textures = &board;
    assert_true(near(pt_texture_eval(&scene, 1, 0.5f, 0.4f).x, 1) && near(pt_texture_eval(&scene, 1, 0.5f, 0.6f).x, 2));
}

static void constants_never_enter_texture_code(void **state)
{
    (void)state;
    struct pt_input in = CONST(0.3f), textured = {.texture = 1};
    struct pt_texture t = {.kind = PT_TEXTURE_CONSTANT, .in = {CONST(0.9f)}};
    struct pt_scene scene = {.textures = &t, .texture_count = 1};
    unsigned long long before = pt_texture_lookups;
    assert_true(pt_input_float(PT_FX_ALL, &scene, &in, 0, 0) == 0.3f);
    assert_true(pt_input_rgb(PT_FX_ALL, &scene, &in, 0, 0).y == 0.3f);
    assert_true(pt_texture_lookups == before);
    assert_true(pt_input_float(0, &scene, &textured, 0, 0) == 0.0f); /* compiled out without the effect */
    assert_true(pt_texture_lookups == before);
    assert_true(pt_input_float(PT_FX_TEXTURE, &scene, &textured, 0, 0) == 0.9f);
    assert_true(pt_texture_lookups == before + 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_wrap),
        cmocka_unit_test(bytes_are_linearised),
        cmocka_unit_test(bilinear_interpolates_between_centres),
        cmocka_unit_test(kinds_of_texture),
        cmocka_unit_test(nearest_texels),
        cmocka_unit_test(scale_and_offset),
        cmocka_unit_test(constants_never_enter_texture_code),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
