/* What goes on beside a render: checkpoints and previews now and then. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>

#include <cmocka.h>

#include "app/watch.h"
#include "base/clock.h"
#include "base/interrupt.h"
#include "support/pt_captured.h"
#include "support/pt_seven_blocks.h"

/* A checkpoint that fails is said and tried again after its time; previews come when three times as long has passed, a minute later at
 * most, and take a hundredth of the time. */
static void between_two_slices(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct pt_cli cli = {.checkpoint_every_s = 1000};
    struct pt_shot_frame frame = {.paths = {[PT_CHECKPOINT] = "/missing/c"}};
    struct captured messages;
    struct pt_seven_blocks seven;
    pt_seven_blocks_init(&seven);
    struct pt_render *render = &seven.render;
    struct pt_open open = {.cli = &cli, .frame = &frame, .log = &messages.log, .render = render};
    struct pt_watch w;
    double before_s = base_clock_wall_s();
    capture_begin(&messages);
    messages.log.quiet = 1;
    assert_int_equal(pt_watch_init(&w, &open, NULL, &err), 0);
    assert_true(w.checkpoint_at_s >= before_s + 1000 && w.checkpoint_at_s <= base_clock_wall_s() + 1000);
    const struct pt_render_hooks hooks = w.hooks;
    base_interrupted = 0;
    w.checkpoint_at_s = before_s + 1e6;
    hooks.slice(hooks.data, render, &err); /* too early */
    w.checkpoint_at_s = before_s;
    base_interrupted = 1;
    assert_true(*hooks.interrupted);
    hooks.slice(hooks.data, render, &err); /* too late */
    assert_true(w.checkpoint_at_s == before_s);
    base_interrupted = 0;
    assert_false(*hooks.interrupted);
    render->criterion = NULL;
    assert_int_equal(hooks.slice(hooks.data, render, &err), 0);
    double after_s = base_clock_wall_s();
    assert_true(w.checkpoint_at_s >= before_s + 1000 && w.checkpoint_at_s <= after_s + 1000);
    assert_string_equal(messages.text,
                        "no checkpoint, the render goes on: /missing/c: cannot write there: No such file or directory\n");
    capture_end(&messages);
    assert_int_equal(hooks.suspend(hooks.data, render, &err), BASE_EIO);
    frame.paths[PT_CHECKPOINT] = NULL;
    assert_int_equal(hooks.suspend(hooks.data, render, &err), 0);
    static const double waits[2][2] = {{15, 45}, {100, 60}};
    const struct pt_output_info info = {0};
    frame.paths[PT_PREVIEW] = "/missing/p.png";
    w.info = &info;
    render->config.crop[2] = render->config.crop[3] = 1;
    for (int i = 0; i < 2; i++) {
        before_s = base_clock_wall_s();
        open.start_s = before_s - waits[i][0];
        w.files_at_s = before_s + 1e6;
        hooks.slice(hooks.data, render, &err);
        assert_true(w.files_at_s == before_s + 1e6);
        w.files_at_s = 0;
        hooks.slice(hooks.data, render, &err);
        after_s = base_clock_wall_s();
        assert_true(w.files_at_s >= before_s + waits[i][1]);
        assert_true(w.files_at_s <= after_s + fmax(waits[i][1] + 4 * (after_s - before_s), 100 * (after_s - before_s)));
    }
    cli.live = 1; /* each second, at most a twentieth of the time */
    w.files_at_s = 0;
    before_s = base_clock_wall_s();
    hooks.slice(hooks.data, render, &err);
    after_s = base_clock_wall_s();
    assert_true(w.files_at_s >= before_s + 1 && w.files_at_s <= after_s + fmax(1, 20 * (after_s - before_s)));
    pt_seven_blocks_release(&seven);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(between_two_slices)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
