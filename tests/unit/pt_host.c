/* The path tracer as a host: its film as planes, its threads and words, masks from files, criteria by name. */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "picture/png.h"
#include "base/version.h"
#include "host/frame.h"
#include "render/host.h"
#include "support/api_folders.h"
#include "support/approve.h"
#include "support/pt_fake.h"
#include "support/pt_captured.h"

/* --- the film ----------------------------------------------------------------------------------------------------------- */

static void check_plane(const struct lull_plane *p, const void *data, int channels, int bytes, int type, int normaliser)
{
    if (!data) {
        assert_true(!p->data && p->channels == 0 && p->scale == 0);
        return;
    }
    assert_true(p->data == data && p->stride_x == channels * bytes && p->stride_y == 12 * channels * bytes &&
                p->stride_c == bytes);
    assert_true(p->scale == 1 && p->type == type && p->normaliser == normaliser && p->channels == (uint32_t)channels &&
                p->flags == 0);
}

static void the_film_is_shown(void **state)
{
    (void)state;
    struct pt_film film;
    struct base_err err = {0};
    static const uint32_t planes[2] = {PT_FILM_ALL, PT_FILM_COLOR | PT_FILM_NORMAL};
    for (int k = 0; k < 2; k++) {
        struct pt_host_view show;
        assert_int_equal(pt_film_init(&film, 8, 0, 20, 14, planes[k], &err), 0);
        const struct lull_host_view *v = &show.view;
        pt_host_show(&film, &show);
        assert_true(v->struct_size == sizeof *v && v->plane_count == LULL_PLANE_COUNT && v->planes == show.planes);
        assert_true(v->x0 == 8 && v->y0 == 0 && v->x1 == 20 && v->y1 == 14);
        check_plane(&v->planes[LULL_PLANE_COLOR], film.color, 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
        check_plane(&v->planes[LULL_PLANE_HALF], film.half, 3, 8, LULL_TYPE_F64, LULL_NORM_HALF_SPP);
        check_plane(&v->planes[LULL_PLANE_MOMENT2], film.moment2, 1, 8, LULL_TYPE_F64, LULL_NORM_SPP);
        check_plane(&v->planes[LULL_PLANE_ALBEDO], film.albedo, 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
        check_plane(&v->planes[LULL_PLANE_NORMAL], film.normal, 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
        check_plane(&v->planes[LULL_PLANE_DEPTH], film.depth, 1, 8, LULL_TYPE_F64, LULL_NORM_ONE);
        check_plane(&v->planes[LULL_PLANE_SPP], NULL, 1, 4, 0, 0);
        check_plane(&v->planes[LULL_PLANE_WEIGHT], NULL, 1, 4, 0, 0);
        check_plane(v->dropped, film.dropped, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
        assert_int_equal(v->dropped_half != NULL, k == 0);
        uint32_t mask = 0;
        for (int i = 0; i < LULL_PLANE_COUNT; i++)
            mask |= v->planes[i].data ? LULL_PLANE_BIT(i) : 0;
        assert_int_equal(pt_host_planes_of(planes[k]), mask);
        pt_film_release(&film);
    }
    static const struct {
        uint32_t abi, film;
    } map[] = {{LULL_PLANE_COLOR, 0},
               {LULL_PLANE_WEIGHT, 0},
               {LULL_PLANE_SPP, 0},
               {LULL_PLANE_HALF, PT_FILM_HALF},
               {LULL_PLANE_MOMENT2, PT_FILM_MOMENT2},
               {LULL_PLANE_ALBEDO, PT_FILM_ALBEDO},
               {LULL_PLANE_NORMAL, PT_FILM_NORMAL},
               {LULL_PLANE_DEPTH, PT_FILM_DEPTH}};
    for (size_t k = 0; k < sizeof map / sizeof map[0]; k++) {
        struct lull_requirements needs = {.planes_used = LULL_PLANE_BIT(map[k].abi)};
        assert_int_equal(pt_host_film_planes(&needs), PT_FILM_COLOR | map[k].film);
    }
}

/* --- a frame ------------------------------------------------------------------------------------------------------------- */

static struct lull_frame opened;

static int32_t open_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    opened = *frame;
    return pt_fake_criterion()->begin_frame(in, frame, err);
}

/* What the criterion is told of a render, and who wants other blocks. */
static void a_render_opens_its_frame(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct lull_criterion table = *pt_fake_criterion();
    struct lull_host_criterion *criterion;
    struct pt_render *render = NULL;
    table.begin_frame = open_frame;
    assert_int_equal(pt_criterion_create(&table, NULL, 0, NULL, NULL, &criterion, &err), 0);
    for (int k = 0; k < 4; k++) {
        struct pt_render_config config = pt_fake_config();
        config.time_budget_s = k == 1 ? 5 : 0;
        config.max_check_overhead = k == 2 ? 0.5 : 0;
        config.integrator.sampler = k == 3 ? PT_SAMPLER_INDEPENDENT : PT_SAMPLER_SOBOL;
        config.integrator.max_component = k == 3 ? 6.0f : INFINITY;
        assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, NULL, criterion, &render, &err), 0);
        assert_int_equal(opened.flags & ~LULL_FRAME_RESTART, k == 0   ? LULL_FRAME_DETERMINISTIC
                                                             : k == 3 ? LULL_FRAME_DETERMINISTIC | LULL_FRAME_INDEPENDENT
                                                                      : 0);
        assert_true(opened.width == 60 && opened.height == 44 && opened.spp_min == 8 && opened.spp_max == 256 &&
                    opened.seed == 7);
        assert_true(opened.sample_clamp == (k == 3 ? 6 : 0) && opened.time_budget_s == (k == 1 ? 5 : 0) &&
                    opened.transfer == LULL_TRANSFER_SRGB);
        assert_int_equal(opened.planes & ~LULL_HOST_COUNTS,
                         pt_host_planes_of(pt_host_film_planes(lull_host_needs(criterion))));
        pt_render_destroy(render);
    }
    struct pt_render_config config = pt_fake_config();
    criterion->needs.flags = 0;
    criterion->needs.block_width = criterion->needs.block_height = 17;
    assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, NULL, criterion, &render, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion fake judges blocks of 17x17 pixels only: use --block 17x17");
    lull_host_close(criterion);
}

static int32_t fail_to_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                                uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                                uint32_t count, struct lull_error *err)
{
    (void)in, (void)view, (void)blocks, (void)block_stride, (void)decisions, (void)decision_stride, (void)count;
    strcpy(err->message, "no such luck");
    return err->code = LULL_E_INTERNAL;
}

/* A criterion that fails is said so once, and every block gets its samples. */
static void failures_are_told_once(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_threads *pool = base_threads_create(1, &err);
    struct lull_criterion table = *pt_fake_criterion();
    struct lull_host_criterion *criterion;
    struct pt_render *render = NULL;
    struct captured messages;
    const struct pt_render_hooks hooks = {.log = &messages.log};
    enum pt_render_outcome outcome;
    struct pt_render_config config = pt_fake_config();
    capture_begin(&messages);
    table.evaluate = fail_to_evaluate;
    config.spp_max = 20;
    assert_int_equal(pt_criterion_create(&table, NULL, 0, NULL, NULL, &criterion, &err), 0);
    assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, pool, criterion, &render, &err), 0);
    assert_int_equal(pt_render_run(render, &hooks, &outcome, &err), 0);
    assert_string_equal(messages.text, "criterion fake: no such luck\n");
    capture_end(&messages);
    assert_true(render->totals->failed_checks > 1);
    for (uint32_t i = 0; i < render->blocks->count; i++)
        assert_true(render->blocks->list[i].spp == 20 && render->blocks->list[i].reason == LULL_REASON_SPP_MAX);
    pt_render_destroy(render);
    lull_host_close(criterion);
    base_threads_destroy(pool);
}

/* --- what a criterion is offered ----------------------------------------------------------------------------------------- */

static void count_task(void *arg, uint64_t task, uint32_t worker)
{
    assert_true(worker < 3);
    ((int *)arg)[task]++;
}

static void services(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_threads *threads = base_threads_create(3, &err);
    struct captured messages;
    capture_begin(&messages);
    struct lull_host_criterion *few = NULL, *busy = NULL;
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, NULL, &messages.log, &few, &err), 0);
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, threads, NULL, &busy, &err), 0);
    const struct lull_host *alone = &few->host, *many = &busy->host;
    assert_true(alone->max_workers == 1 && many->max_workers == 3);
    assert_string_equal(alone->name, "lull-render " BASE_VERSION);
    alone->log(alone, LULL_LOG_DEBUG, "psst");
    assert_string_equal(messages.text, "");
    for (int i = 0; i < 2; i++)
        alone->log(alone, LULL_LOG_INFO, "mind the gap"); /* told once */
    assert_string_equal(messages.text, "criterion fake: mind the gap\n");
    many->log(many, LULL_LOG_ERROR, "nobody hears it");
    capture_end(&messages);
    for (int k = 0; k < 2; k++) {
        int done[20] = {0};
        const struct lull_host *host = k ? many : alone;
        assert_int_equal(host->parallel_for(host, 19, count_task, done), LULL_OK);
        for (int i = 0; i < 20; i++)
            assert_int_equal(done[i], i < 19);
    }
    lull_host_close(few);
    lull_host_close(busy);
    base_threads_destroy(threads);
    const struct lull_error no_room = {.message = "out of memory (x)"};
    assert_int_equal(pt_host_result(LULL_E_MEMORY, &no_room, &err), BASE_ENOMEM);
    assert_string_equal(err.text, "out of memory (x)");
    assert_int_equal(pt_host_result(LULL_E_IO, &no_room, &err), BASE_EINVAL);
}

/* --- masks -------------------------------------------------------------------------------------------------------------- */

/* Grey is the mean of the colours as they are stored, alpha is none of them; what is no number, or beyond 0 to 1, is cut. */
static void masks_are_read(void **state)
{
    (void)state;
    struct base_err err = {0};
    char path[64], line[200];
    struct lull_plane mask;
    const float *grey;
    static const uint8_t pixels[24] = {0, 30, 255, 51, 102, 102, 255, 255, 255, 1,  2,  3,
                                       4, 5,  6,   7,  8,   9,   10,  11,  12,  13, 14, 15};
    snprintf(path, sizeof path, "/tmp/pt_host_%ld.png", (long)getpid());
    for (int channels = 1; channels <= 4; channels++) {
        assert_int_equal(pic_write_png(path, 3, 2, channels, pixels, &err), 0);
        assert_int_equal(pt_mask_read(path, 3, 2, &mask, &err), 0);
        grey = mask.data;
        assert_true(mask.stride_x == 4 && mask.stride_y == 12);
        for (int i = 0; i < 6; i++) {
            const uint8_t *p = pixels + channels * i;
            double expected = channels < 3 ? p[0] / 255.0 : (p[0] + p[1] + p[2]) / 765.0;
            assert_true(fabs((double)grey[i] - expected) < 1e-6);
        }
        pt_mask_release(&mask);
        assert_true(!mask.data && mask.stride_y == 0);
    }
    for (int k = 0; k < 2; k++) {
        assert_int_equal(pt_mask_read(path, 3 + k, 3 - k, &mask, &err), BASE_EINVAL);
        snprintf(line, sizeof line, "--mask %s: it has 3x2 pixels, the image %dx%d", path, 3 + k, 3 - k);
        assert_string_equal(err.text, line);
    }
    unlink(path);
    assert_int_equal(pt_mask_read(path, 3, 2, &mask, &err), BASE_EINVAL); /* an input: not BASE_EIO */
    snprintf(line, sizeof line, "%s: %s", path, strerror(ENOENT));
    assert_string_equal(err.text, line);
    snprintf(path, sizeof path, "/tmp/pt_host_%ld.pfm", (long)getpid());
    static const float values[4] = {-0.5f, 0.25f, 7.0f, NAN};
    FILE *f = fopen(path, "wb");
    assert_true(f && fputs("Pf\n4 1\n-1.0\n", f) >= 0 && fwrite(values, 4, 4, f) == 4 && fclose(f) == 0);
    assert_int_equal(pt_mask_read(path, 4, 1, &mask, &err), 0);
    grey = mask.data;
    assert_true(grey[0] == 0 && grey[1] == 0.25f && grey[2] == 1 && grey[3] == 0);
    assert_true(mask.stride_x == 4 && mask.stride_y == 16 && mask.scale == 1 && mask.type == LULL_TYPE_F32 &&
                mask.channels == 1);
    pt_mask_release(&mask);
    unlink(path);
}

/* --- criteria by name ---------------------------------------------------------------------------------------------------- */

/* The lines on what was skipped: the build's own may have something to say too. */
static void print_skipped(FILE *out, const char *text)
{
    for (size_t n; *text != '\0'; text += n) {
        n = strcspn(text, "\n") + 1;
        if (strncmp(text, "skipped: ", 9) == 0)
            fprintf(out, "%.*s", (int)n, text);
    }
}

/* What is printed of the first two criteria: the build's own follow, if it has some. */
static void print_first_two(FILE *out, const char *text, int count)
{
    int seen = 0, from = 0;
    for (size_t n; *text != '\0'; text += n) {
        n = strcspn(text, "\n") + 1;
        seen += *text != ' ';
        from += strncmp(text, "    from ", 9) == 0;
        if (seen <= 2)
            fprintf(out, "%.*s", (int)n, text);
    }
    assert_true(from == count && seen == count);
}

/* A folder with two criteria and something that is none; its name is CRITERIA in what is said. */
static char *listed(struct approve_case *c)
{
    char folder[] = "/tmp/pt_host_XXXXXX", built[2048], from[2200], path[3][64], *text = NULL, *at;
    static const char *const names[3] = {"fixed.so", "halfbuf.so", "none.so"};
    size_t size;
    struct base_err err = {0};
    struct base_inputs inputs = BASE_INPUTS_EMPTY;
    const struct lull_criterion *found = NULL;
    (void)c;
    assert_true(mkdtemp(folder) && api_folder(built, sizeof built, API_CRITERIA) == 0 &&
                setenv("LULL_PLUGIN_PATH", folder, 1) == 0);
    for (int i = 0; i < 3; i++) {
        snprintf(from, sizeof from, "%s/%s", i < 2 ? built : "/dev/null", i < 2 ? names[i] : "");
        snprintf(path[i], sizeof path[i], "%s/%s", folder, names[i]);
        if (i < 2)
            assert_int_equal(symlink(from, path[i]), 0);
    }
    FILE *out = fopen(path[2], "w");
    assert_true(out && fclose(out) == 0);
    struct captured messages;
    capture_begin(&messages);
    assert_non_null(out = open_memstream(&text, &size));
    int count = pt_criterion_list(out, &messages.log);
    fclose(out);
    char *all = text;
    assert_non_null(out = open_memstream(&text, &size));
    print_first_two(out, all, count);
    free(all);
    assert_int_equal(pt_criterion_find("halfbuf", &inputs, &messages.log, &found, &err), 0);
    fprintf(out, "found %s; an input is %s\n", found->id, inputs.paths[0]);
    int rc = pt_criterion_find("nobody", &inputs, &messages.log, &found, &err);
    fprintf(out, "%d: %s; %zu input\n", rc, err.text, inputs.count);
    print_skipped(out, messages.text);
    capture_end(&messages);
    assert_int_equal(pt_criterion_find("fixed", NULL, NULL, &found, &err), 0);
    assert_string_equal(found->id, "fixed");
    fclose(out);
    base_inputs_release(&inputs);
    while ((at = strstr(text, folder)) != NULL) {
        memcpy(at, "CRITERIA", 8);
        memmove(at + 8, at + strlen(folder), strlen(at + strlen(folder)) + 1);
    }
    for (int i = 0; i < 3; i++)
        unlink(path[i]);
    rmdir(folder);
    unsetenv("LULL_PLUGIN_PATH");
    return text;
}

static void criteria_by_name(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_host.txt", listed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_film_is_shown), cmocka_unit_test(a_render_opens_its_frame),
        cmocka_unit_test(services),          cmocka_unit_test(failures_are_told_once),
        cmocka_unit_test(masks_are_read),    cmocka_unit_test(criteria_by_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
