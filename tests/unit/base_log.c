/* The lines of a log. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/log.h"
#include "support/heard.h"

static void lines_of_a_log(void **state)
{
    (void)state;
    listen_to(stderr);
    struct base_log log, silent = {0};
    base_log_init(&log, stderr, "lull-render", 0);
    base_log_say(&log, "a %s", "line");
    base_log_note(&log, "a %s", "note");
    log.quiet = 1;
    base_log_note(&log, "a quiet note");
    base_log_say(&log, "a word");
    base_log_say(&silent, "from somebody else");
    base_log_say(NULL, "from nobody");
    base_log_note(NULL, "from nobody");
    assert_string_equal(heard_on(stderr), "lull-render: a line\nlull-render: a note\nlull-render: a word\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(lines_of_a_log)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
