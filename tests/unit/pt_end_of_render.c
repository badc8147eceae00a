/* The end of a render: files that cannot be written where they should, the exit status, the last line. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "app/actions.h"
#include "render/output.h"
#include "support/pt_captured.h"
#include "support/pt_seven_blocks.h"

static char *written[3];
static int write_count, fails_until;

static int write_nothing(const char *path, const struct pt_render *r, const struct pt_output_info *info_of,
                         struct base_err *err)
{
    (void)r;
    (void)info_of;
    free(written[write_count]);
    written[write_count] = strdup(path);
    return write_count++ < fails_until ? base_fail(err, BASE_EIO, "%s: no paper", path) : 0;
}

/* What cannot be written where it was asked for is kept elsewhere, and said. */
static void outputs_are_kept(void **state)
{
    (void)state;
    const struct pt_output_info none = {0};
    char line[300], name[100];
    struct base_err err = {0};
    setenv("TMPDIR", "/elsewhere", 1);
    pt_output_or_keep(write_nothing, NULL, NULL, &none, &err);
    assert_int_equal(write_count, 0);
    pt_output_or_keep(write_nothing, "a/b.exr", NULL, &none, &err);
    assert_true(write_count == 1 && err.code == 0);
    for (int k = 1; k < 3; k++) { /* at first only here, then there too */
        write_count = 0;
        fails_until = k;
        err = (struct base_err){0};
        pt_output_or_keep(write_nothing, "a/b.exr", NULL, &none, &err);
        assert_int_equal(write_count, 2);
        snprintf(name, sizeof name, "/elsewhere/lull-%ld-b.exr", (long)getpid());
        assert_string_equal(written[1], name);
        snprintf(line, sizeof line, k == 1 ? "a/b.exr: no paper; kept as %s" : "a/b.exr: no paper", name);
        assert_string_equal(err.text, line);
        assert_int_equal(err.code, BASE_EIO);
    }
    err = (struct base_err){0};
    for (int k = 0; k < 3; k++) { /* each of several files is named: kept, kept, and lost */
        static const char *const paths[] = {"a/b.exr", "c.png", "d.json"};
        write_count = 0;
        fails_until = k < 2 ? 1 : 2;
        pt_output_or_keep(write_nothing, paths[k], NULL, &none, &err);
    }
    snprintf(line, sizeof line,
             "a/b.exr: no paper; kept as /elsewhere/lull-%ld-b.exr; c.png kept as /elsewhere/lull-%ld-c.png; d.json is lost",
             (long)getpid(), (long)getpid());
    assert_string_equal(err.text, line);
    err = (struct base_err){0};
    setenv("TMPDIR", "", 1);
    write_count = 0;
    pt_output_or_keep(write_nothing, "b.exr", NULL, &none, &err);
    snprintf(name, sizeof name, "/tmp/lull-%ld-b.exr", (long)getpid());
    assert_string_equal(written[1], name);
    unsetenv("TMPDIR");
    for (int i = 0; i < 3; i++)
        free(written[i]);
}

static void exit_statuses(void **state)
{
    (void)state;
    assert_int_equal(pt_action_status(PT_RENDER_DONE), 0);
    assert_int_equal(pt_action_status(PT_RENDER_OUT_OF_TIME), 0);
    assert_int_equal(pt_action_status(PT_RENDER_PILOT), 0);
    assert_int_equal(pt_action_status(PT_RENDER_INTERRUPTED), 130);
    assert_int_equal(pt_action_status(PT_RENDER_LOST), 2);
}

static void the_last_line(void **state)
{
    (void)state;
    struct captured messages;
    struct pt_seven_blocks seven;
    pt_seven_blocks_init(&seven);
    for (int i = 0; i < 7; i++)
        seven.list[i].reason = i < 3 ? LULL_REASON_CRITERION : i < 5 ? LULL_REASON_SPP_MAX : LULL_REASON_DROPPED;
    seven.render.totals->paths = 123456789;
    seven.render.totals->dropped = 12;
    lull_host_drop(seven.render.frame, 7, 8, 9);
    capture_begin(&messages);
    messages.log.name = "lull-render";
    pt_action_summary(&seven.render, &messages.log);
    messages.log.quiet = 1;
    pt_action_summary(&seven.render, &messages.log);
    seven.render.totals->dropped = 0;
    pt_action_summary(&seven.render, &messages.log);
    capture_end(&messages);
    assert_string_equal(
        messages.text,
        "lull-render: 22 spp on average, 111.2 s, 2.44 Mpaths/s, criterion 54.6 %; blocks: 3 criterion 2 spp-max 2 dropped\n"
        "lull-render: 12 samples were not finite and were dropped, the first seen at --debug-path 7,8,9\n"
        "lull-render: 12 samples were not finite and were dropped, the first seen at --debug-path 7,8,9\n");
    pt_seven_blocks_release(&seven);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(outputs_are_kept), cmocka_unit_test(exit_statuses),
                                       cmocka_unit_test(the_last_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
