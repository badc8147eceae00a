/* --explain: the effects of a scene and the kernel chosen. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "app/actions.h"
#include "render/render.h"
#include "support/approve.h"
#include "support/heard.h"
#include "support/pt_text_scene.h"

/* --explain, but for the times. */
static char *explain_it(struct approve_case *c)
{
    struct pt_scene_defaults found;
    struct pt_scene *s = text_scene(c->text, &found, NULL);
    const struct pt_render_config config = {.width = found.width, .height = found.height, .integrator = found.integrator};
    s->stats.bytes = 12345678;
    listen_to(stdout);
    pt_action_explain(s, &config, "t.pbrt");
    char *text = strdup(heard_on(stdout)), *time = strstr(text, "time: "), *end = time ? strchr(time, '\n') : NULL;
    double us, ratio;
    assert_non_null(end);
    assert_int_equal(
        sscanf(time, "time: %lf us per path and thread; the general kernel takes %lf times as long for the same image", &us,
               &ratio),
        2);
    assert_true(us > 0 && ratio > 0);
    memmove(time + 6, end, strlen(end) + 1);
    pt_scene_destroy(s);
    return text;
}

static void explanations(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_explain.txt", explain_it);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(explanations)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
