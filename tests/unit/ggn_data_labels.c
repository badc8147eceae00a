/* Labels, soft and censored, and the split of a data set by scene. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"

#include "data/dataset.h"
#include "data/thresholds.h"

static char root[] = "/tmp/ggn_labels.XXXXXX";

static int setup(void **state)
{
    (void)state;
    return !mkdtemp(root) ? -1 : 0;
}

static int teardown(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", root);
    return system(command);
}

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
    struct ggn_labels l = {.source = "observer", .detail = "tau \"x\"", .cap = 10000, .spread = 0.3, .n = 2, .labels = entries}, back;
    struct base_err err = {0};
    assert_int_equal(ggn_labels_write(root, &l, &err), 0);
    if (ggn_labels_read(root, &back, &err) != 0)
        fail_msg("%s", err.text);
    assert_string_equal(back.source, "observer");
    assert_string_equal(back.detail, l.detail);
    assert_near(ggn_labels_find(&back, 3)->threshold, 120.5, 0);
    assert_int_equal(ggn_labels_find(&back, 7)->censored, 1);
    assert_null(ggn_labels_find(&back, 4));
    ggn_labels_release(&back);
    static const char *const bad[] = {
        "", "{}", "{\"format\":\"lull-labels\",\"source\":\"people\",\"cap\":1,\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":1}]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":1}]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"cap\":1,\"spread\":1,\"blocks\":[]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"cap\":1,\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":-1}]}",
        "{\"format\":\"lull-labels\",\"source\":\"human\",\"cap\":1,\"spread\":1,\"blocks\":[{\"id\":0,\"threshold\":1},{\"id\":0,\"threshold\":1}]}",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        if (ggn_labels_parse("l.json", bad[i], strlen(bad[i]), &back, &err) != BASE_EINVAL)
            fail_msg("%s was accepted", bad[i]);
}

static void a_view_is_listed_once(void **state)
{
    char once[] = "a;1;\n# a;2;\nb;2;3;\n", twice[] = "a;1;\nb;2;\na;3;\n";
    struct ggn_thresholds t;
    struct base_err err = {0};
    (void)state;
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", once, &t, &err), 0);
    assert_int_equal(t.n, 2);
    ggn_thresholds_release(&t);
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", twice, &t, &err), BASE_EINVAL);
    assert_string_equal(err.text, "t.csv: view 'a' appears twice");
}

static void add_view(const char *name, const char *scene)
{
    char dir[256];
    uint32_t level = 20;
    struct seq_manifest m = {.width = 8, .height = 8, .block = 8, .n_levels = 1, .levels = &level, .reference_independent = 1};
    snprintf(m.scene, sizeof m.scene, "%s", scene);
    snprintf(dir, sizeof dir, "%s/%s", root, name);
    mkdir(dir, 0777);
    assert_int_equal(seq_manifest_write(dir, &m, NULL), 0);
}

static void write_split(const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/split.json", root);
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}

static void splits(void **state)
{
    (void)state;
    struct ggn_dataset d;
    struct base_err err = {0};
    add_view("b-view0", "b");
    add_view("a-view1", "a");
    add_view("a-view0", "a");
    add_view("c", "c");
    write_split("{\"train\": [\"a\"], \"test\": [\"b\", \"unknown\"]}");
    if (ggn_dataset_open(root, &d, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(d.n, 4);
    assert_string_equal(d.views[0].name, "a-view0");
    assert_true(d.views[0].split == GGN_SPLIT_TRAIN && d.views[1].split == GGN_SPLIT_TRAIN && d.views[2].split == GGN_SPLIT_TEST &&
                d.views[3].split == GGN_SPLIT_NONE);
    ggn_dataset_release(&d);
    write_split("{\"train\": [\"a\"], \"test\": [\"a\"]}");
    assert_int_equal(ggn_dataset_open(root, &d, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "in train and in test"));
    write_split("nonsense");
    assert_int_equal(ggn_dataset_open(root, &d, &err), BASE_EINVAL);
    assert_int_equal(ggn_dataset_open("/tmp/does/not/exist", &d, &err), BASE_EIO);
}

static void split_folders(void **state)
{
    (void)state;
    struct ggn_dataset d;
    struct base_err err = {0};
    char command[300];
    snprintf(command, sizeof command, "rm -r %s/*", root);
    assert_int_equal(system(command), 0);
    snprintf(command, sizeof command, "mkdir %s/train %s/test", root, root);
    assert_int_equal(system(command), 0);
    add_view("train/x", "x");
    add_view("test/y-view0", "y");
    add_view("z", "z");
    if (ggn_dataset_open(root, &d, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(d.n, 3);
    for (int i = 0; i < 3; i++)
        assert_int_equal(d.views[i].split, d.views[i].name[0] == 'x' ? GGN_SPLIT_TRAIN : d.views[i].name[0] == 'y' ? GGN_SPLIT_TEST : GGN_SPLIT_NONE);
    ggn_dataset_release(&d);
    add_view("test/x-view1", "x");
    assert_int_equal(ggn_dataset_open(root, &d, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "scene 'x' is in"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(probabilities), cmocka_unit_test(round_trip), cmocka_unit_test(a_view_is_listed_once), cmocka_unit_test(splits), cmocka_unit_test(split_folders)};
    return cmocka_run_group_tests_name("data_labels", tests, setup, teardown);
}
