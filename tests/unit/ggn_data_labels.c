/* Labels, soft and censored, and their files. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_folder.h"
#include "support/ggn_near.h"
#include "support/ggn_transcript.h"
#include "data/dataset.h"

static void probabilities(void **state)
{
    (void)state;
    struct ggn_label known = {1, 1000, 0}, capped = {2, 10000, 1};
    assert_int_equal(ggn_label_noisy(&known, 999), 1);
    assert_int_equal(ggn_label_noisy(&known, 1000), 0);
    assert_near(ggn_label_p_noisy(&known, 1000, 0.25), 0.5, 1e-12);
    assert_near(ggn_label_p_noisy(&known, 1000 * exp2(0.25), 0.25), 0.158655254, 1e-8);
    assert_near(ggn_label_p_noisy(&known, 1000 * exp2(-0.25), 0.25), 0.841344746, 1e-8);
    /* At the cap nothing is known; below it, noise is at least as likely as for an exact threshold there. */
    assert_int_equal(ggn_label_noisy(&capped, 10000), -1);
    assert_true(isnan(ggn_label_p_noisy(&capped, 10000, 0.25)));
    assert_int_equal(ggn_label_noisy(&capped, 9999), 1);
    assert_true(ggn_label_p_noisy(&capped, 9999, 0.25) >= 0.75);
}

static void round_trip(void **state)
{
    (void)state;
    struct ggn_label entries[] = {{3, 120.5, 0}, {7, 10000, 1}};
    struct ggn_labels l = {.source = "observer",
                           .detail = "tau \"x\"",
                           .cap = 10000,
                           .spread = 0.3,
                           .n = 2,
                           .labels = entries},
                      back;
    struct base_err err = {0};
    assert_int_equal(ggn_labels_write(root, &l, 0, &err), 0);
    if (ggn_labels_read(root, &back, &err) != 0)
        fail_msg("%s", err.text);
    assert_string_equal(back.source, "observer");
    assert_string_equal(back.detail, l.detail);
    assert_near(ggn_labels_find(&back, 3)->threshold, 120.5, 0);
    assert_int_equal(ggn_labels_find(&back, 7)->censored, 1);
    assert_null(ggn_labels_find(&back, 4));
    ggn_labels_release(&back);
    static const char *const bad[] = {
        "",
        "{}",
        "{\"format\":\"lull-labels\",\"source\":\"people\",\"cap\":1,\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":1}]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":1}]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"cap\":1,\"spread\":1,\"blocks\":[]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"cap\":1,\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":-1}]}",
        ("{\"format\":\"lull-labels\",\"source\":\"human\",\"cap\":1,\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":1},{"
         "\"id\":0,\"threshold\":1}]}"),
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        if (ggn_labels_parse("l.json", bad[i], strlen(bad[i]), &back, &err) != BASE_EINVAL)
            fail_msg("%s was accepted", bad[i]);
}

static void labels_are_told_word_by_word(void **state)
{
    static const char *const cases[][2] = {{"", ""},
                                           {"{", "["},
                                           {"lull-labels", "lull-label"},
                                           {"\"format\":\"lull-labels\"", "\"format\":7"},
                                           {"\"human\"", "\"people\""},
                                           {"\"human\"", "\"observer\""},
                                           {"\"human\"", "7"},
                                           {"\"detail\":\"d\"", "\"detail\":7"},
                                           {"\"cap\":900", "\"cup\":900"},
                                           {"\"cap\":900", "\"cap\":0"},
                                           {"\"cap\":900", "\"cap\":-1"},
                                           {"\"cap\":900", "\"cap\":\"900\""},
                                           {"\"cap\":900", "\"cap\":999999999999"},
                                           {"\"cap\":900", "\"cap\":1e12"},
                                           {"\"spread\":0.5", "\"spread\":null"},
                                           {"\"blocks\":[", "\"blocks\":7,\"x\":["},
                                           {"\"blocks\":[", "\"blocks\":[],\"x\":["},
                                           {"\"blocks\":[", "\"blocks\":[7,"},
                                           {"\"id\":4", "\"id\":-1"},
                                           {"\"id\":4", "\"id\":4294967294"},
                                           {"\"id\":4", "\"id\":4294967295"},
                                           {"\"id\":4", "\"id\":\"4\""},
                                           {"\"id\":4", "\"id\":2"},
                                           {"\"threshold\":77", "\"threshold\":0"},
                                           {"\"threshold\":77", "\"threshold\":999999999999"},
                                           {"\"threshold\":77", "\"threshold\":1e12"},
                                           {"\"threshold\":77", "\"thresh\":1"},
                                           {"\"censored\":true", "\"censored\":1"}};
    static const char whole[] = "{\"format\":\"lull-labels\",\"source\":\"human\",\"detail\":\"d\",\"cap\":900,\"spread\":0."
                                "5,\"blocks\":[{\"id\":2,\"threshold\":50},"
                                "{\"id\":4,\"threshold\":77,\"censored\":true}]}";
    struct transcript t;
    FILE *f = transcript_begin(&t);
    char text[1024];
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct ggn_labels l = {0};
        struct base_err err = {0};
        const char *at = strstr(whole, cases[i][0]);
        int n = snprintf(text, sizeof text, "%.*s%s%s", (int)(at - whole), whole, cases[i][1], at + strlen(cases[i][0]));
        fprintf(f, "%s -> %s: ", cases[i][0], cases[i][1]);
        if (ggn_labels_parse("l.json", text, (size_t)n, &l, &err)) {
            fprintf(f, "%s\n", err.text);
            continue;
        }
        fprintf(f, "%s '%s' %g %g", l.source, l.detail, l.cap, l.spread);
        for (uint32_t k = 0; k < l.n; k++)
            fprintf(f, "; %u %g %d", l.labels[k].id, l.labels[k].threshold, l.labels[k].censored);
        fprintf(f, "; 4 is %s\n", ggn_labels_find(&l, 4) ? "there" : "not there");
        ggn_labels_release(&l);
    }
    for (int censored = 0; censored < 2; censored++)
        for (double spp = 700; spp < 1400; spp *= 1.1) {
            struct ggn_label label = {1, 1000, censored};
            fprintf(f, "%.1f: %d %.6f %.6f\n", spp, ggn_label_noisy(&label, spp), ggn_label_p_noisy(&label, spp, 0.25),
                    ggn_label_p_noisy(&label, spp, 0.5));
        }
    transcript_end(&t, "data-labels");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(probabilities), cmocka_unit_test(round_trip),
                                       cmocka_unit_test(labels_are_told_word_by_word)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
