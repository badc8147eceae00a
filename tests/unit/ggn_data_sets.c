/* Data sets: their views, and the split by scene. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <cjson/cJSON.h>

#include "support/ggn_folder.h"
#include "support/ggn_transcript.h"
#include "data/dataset.h"
#include "data/series.h"

static void add_view(const char *name, const char *scene)
{
    char dir[256];
    uint32_t level = 20;
    struct seq_manifest m = {
        .width = 8, .height = 8, .block = 8, .n_levels = 1, .levels = &level, .reference_independent = 1};
    snprintf(m.scene, sizeof m.scene, "%s", scene);
    snprintf(dir, sizeof dir, "%s/%s", root, name);
    mkdir(dir, 0777);
    assert_int_equal(seq_manifest_write(dir, &m, NULL), 0);
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
    put_file("split.json", "{\"train\": [\"a\"], \"test\": [\"b\", \"unknown\"]}");
    if (ggn_dataset_open(root, &d, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(d.n, 4);
    assert_string_equal(d.views[0].name, "a-view0");
    assert_true(d.views[0].split == GGN_SPLIT_TRAIN && d.views[1].split == GGN_SPLIT_TRAIN &&
                d.views[2].split == GGN_SPLIT_TEST && d.views[3].split == GGN_SPLIT_NONE);
    ggn_dataset_release(&d);
    put_file("split.json", "{\"train\": [\"a\"], \"test\": [\"a\"]}");
    assert_int_equal(ggn_dataset_open(root, &d, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "in train and in test"));
    put_file("split.json", "nonsense");
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
        assert_int_equal(d.views[i].split, d.views[i].name[0] == 'x'   ? GGN_SPLIT_TRAIN
                                           : d.views[i].name[0] == 'y' ? GGN_SPLIT_TEST
                                                                       : GGN_SPLIT_NONE);
    ggn_dataset_release(&d);
    add_view("test/x-view1", "x");
    assert_int_equal(ggn_dataset_open(root, &d, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "scene 'x' is in"));
}

static void print_dataset(FILE *f, const char *name)
{
    struct ggn_dataset d;
    struct base_err err = {0};
    char path[256];
    snprintf(path, sizeof path, "%s%s", root, name);
    if (ggn_dataset_open(path, &d, &err)) {
        fprintf(f, "%s: %s\n", name, err.text);
        return;
    }
    fprintf(f, "%s: labels %s:", name, ggn_dataset_label_source(&d));
    for (int i = 0; i < d.n; i++)
        fprintf(f, " %s (%s, %s, %s, %u tiles)", d.views[i].name, d.views[i].manifest.scene,
                ggn_split_names[d.views[i].split], d.views[i].has_labels ? d.views[i].labels.source : "-",
                ggn_dataset_tiles(&d.views[i]));
    fputc('\n', f);
    ggn_dataset_release(&d);
}

static void datasets_are_told_word_by_word(void **state)
{
    static const char *const splits[] = {"{\"train\": [\"a\"], \"people\": [\"b\", \"unknown\"]}",
                                         "{\"train\": [\"a\"], \"test\": [\"a\"]}",
                                         "{\"train\": [7]}",
                                         "{\"train\": \"a\"}",
                                         "{\"train\": [\"a-view0\"]}",
                                         "{\"val\": [\"a\"]}",
                                         "{\"validation\": [\"c\", \"c\"]}",
                                         "[]",
                                         "",
                                         "{}",
                                         "{\"none\": [\"a\"], \"test\": [\"c\", \"a\", \"b\"]}"};
    struct ggn_label entry = {0, 5, 0};
    struct ggn_labels l = {.source = "observer", .cap = 10, .spread = 1, .n = 1, .labels = &entry};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    char path[300];
    (void)state;
    snprintf(path, sizeof path, "rm -rf %s/*", root);
    assert_int_equal(system(path), 0);
    print_dataset(f, "");
    print_dataset(f, "/none");
    add_view("b-view0", "b");
    add_view("a-view1", "a");
    add_view("a-view0", "a");
    add_view("c", "c");
    add_view(".hidden", "c");
    put_file("note", "");
    print_dataset(f, "");
    print_dataset(f, "/c");
    for (size_t i = 0; i < sizeof splits / sizeof splits[0]; i++) {
        put_file("split.json", splits[i]);
        print_dataset(f, "");
    }
    for (int i = 0; i < 3; i++) {
        static const char *const views[] = {"a-view0", "c", "b-view0"};
        snprintf(path, sizeof path, "%s/%s", root, views[i]);
        snprintf(l.source, sizeof l.source, "%s", i == 1 ? "human" : "observer");
        assert_int_equal(ggn_labels_write(path, &l, 1, NULL), 0);
        print_dataset(f, "");
        if (i == 0)
            print_dataset(f, "/c");
    }
    put_file("c/labels.json", "{}");
    print_dataset(f, "");
    snprintf(path, sizeof path, "rm -r %s/c %s/split.json; mkdir %s/train %s/people %s/none", root, root, root, root, root);
    assert_int_equal(system(path), 0);
    add_view("train/a-view2", "a2");
    add_view("people/b-view1", "b1");
    add_view("none/x", "x");
    print_dataset(f, "");
    add_view("people/a-view3", "a2");
    print_dataset(f, "");
    put_file("people/b-view1/manifest.json", "{}");
    print_dataset(f, "/people/b-view1");
    transcript_hide(&t, root, "ROOT");
    transcript_end(&t, "data-sets");
}

/* Without a split every fifth scene is held out, or the second of two. */
static void scenes_are_held_out(void **state)
{
    struct transcript t;
    FILE *f = transcript_begin(&t);
    char command[500], dir[128];
    (void)state;
    snprintf(dir, sizeof dir, "%s/scenes", root);
    assert_int_equal(mkdir(dir, 0777), 0);
    for (int n = 1; n <= 13; n++) {
        struct ggn_series_set set;
        const struct ggn_series_set_options o = {.dir = dir, .split.validation = n == 4 ? "s2" : NULL};
        snprintf(command, sizeof command,
                 "cp -r tests/data/recorded/test/three %s/s%02d && sed -i 's/\"scene\":.*/\"scene\": \"s%d\",/' "
                 "%s/s%02d/manifest.json",
                 dir, n, n - n / 6, dir, n);
        assert_int_equal(system(command), 0);
        assert_int_equal(ggn_series_set_load(&set, &o, NULL), 0);
        fprintf(f, "%d scenes:", set.data.n_scenes);
        for (int i = 0; i < set.data.n; i++)
            fprintf(f, " %s %s", set.data.views[i].manifest.scene, ggn_split_names[set.data.views[i].split]);
        fputs("; of chains:", f);
        for (int i = 0; i < set.n; i++)
            fprintf(f, " %d", set.series[i].scene);
        fputc('\n', f);
        ggn_series_set_release(&set);
    }
    transcript_end(&t, "data-scenes");
}

/* Without a split of the data, those of the models that are evaluated: the side nearest to training counts, and a scene that
 * none has met is one to test on. */
static void models_bring_their_split(void **state)
{
    static const char *const told[] = {"{\"train\": [\"s1\", \"elsewhere\"], \"validation\": [\"s2\"], \"test\": [\"s4\"]}",
                                       "{\"train\": [\"s2\"], \"validation\": [\"s3\"], \"people\": [\"s5\"]}"};
    static const enum ggn_split first[] = {GGN_SPLIT_TRAIN, GGN_SPLIT_VALIDATION, GGN_SPLIT_TEST, GGN_SPLIT_TEST,
                                           GGN_SPLIT_TEST},
                                both[] = {GGN_SPLIT_TRAIN, GGN_SPLIT_TRAIN, GGN_SPLIT_VALIDATION, GGN_SPLIT_TEST,
                                          GGN_SPLIT_TEST},
                                listed[] = {GGN_SPLIT_TEST, GGN_SPLIT_TRAIN, GGN_SPLIT_VALIDATION, GGN_SPLIT_TEST,
                                            GGN_SPLIT_VALIDATION};
    cJSON *learned[] = {cJSON_Parse(told[0]), cJSON_Parse(told[1])};
    struct ggn_dataset_view views[5];
    (void)state;
    for (int how = 0; how < 4; how++) {
        const struct ggn_split_options o = {how == 2 ? "s5" : NULL, how == 2 ? "s1" : NULL, (const cJSON *const *)learned,
                                            how ? 2 : 1};
        struct ggn_dataset d = {.n = 5, .views = views};
        enum ggn_split_source source;
        for (int i = 0; i < 5; i++) {
            views[i] = (struct ggn_dataset_view){.split = how == 3 && i == 0 ? GGN_SPLIT_PEOPLE : GGN_SPLIT_NONE};
            snprintf(views[i].manifest.scene, sizeof views[i].manifest.scene, "s%d", i + 1);
        }
        assert_int_equal(ggn_split_choose(&d, &o, &source, NULL), 0);
        assert_int_equal(source, how == 3 ? GGN_SPLIT_BY_DATA : GGN_SPLIT_BY_MODELS);
        for (int i = 0; i < 5; i++) {
            const enum ggn_split own = i ? GGN_SPLIT_NONE : GGN_SPLIT_PEOPLE; /* how 3: the data's split is all there is */
            assert_int_equal(views[i].split, how == 0 ? first[i] : how == 1 ? both[i] : how == 2 ? listed[i] : own);
        }
    }
    for (int i = 0; i < 2; i++)
        cJSON_Delete(learned[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(splits), cmocka_unit_test(split_folders),
                                       cmocka_unit_test(datasets_are_told_word_by_word),
                                       cmocka_unit_test(scenes_are_held_out), cmocka_unit_test(models_bring_their_split)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
