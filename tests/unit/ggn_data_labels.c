/* Labels, soft and censored, thresholds, the split of a data set by scene, its series and windows. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <cjson/cJSON.h>

#include "support/ggn_near.h"

#include "data/series.h"
#include "data/dataset.h"
#include "data/thresholds.h"
#include "data/windows.h"
#include "support/ggn_transcript.h"

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
    struct seq_manifest m = {
        .width = 8, .height = 8, .block = 8, .n_levels = 1, .levels = &level, .reference_independent = 1};
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
    assert_true(d.views[0].split == GGN_SPLIT_TRAIN && d.views[1].split == GGN_SPLIT_TRAIN &&
                d.views[2].split == GGN_SPLIT_TEST && d.views[3].split == GGN_SPLIT_NONE);
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
        assert_int_equal(d.views[i].split, d.views[i].name[0] == 'x'   ? GGN_SPLIT_TRAIN
                                           : d.views[i].name[0] == 'y' ? GGN_SPLIT_TEST
                                                                       : GGN_SPLIT_NONE);
    ggn_dataset_release(&d);
    add_view("test/x-view1", "x");
    assert_int_equal(ggn_dataset_open(root, &d, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "scene 'x' is in"));
}

/* --- transcripts: every value and every line --- */

static void put_file(const char *name, const char *contents)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", root, name);
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs(contents, f);
    fclose(f);
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

static void print_thresholds(FILE *f, int rc, struct ggn_thresholds *t, const struct base_err *err)
{
    if (rc) {
        fprintf(f, "%s\n", err->text);
        return;
    }
    for (int i = 0; i < t->n; i++) {
        fprintf(f, "%.140s (%d, %d across):", t->views[i].name, t->views[i].n, t->views[i].columns);
        for (int b = 0; b < t->views[i].n && b < 8; b++)
            fprintf(f, " %g", t->views[i].spp[b]);
        fputs("; ", f);
    }
    const struct ggn_view *part = ggn_thresholds_of(t, "p"), *found = ggn_thresholds_find(t, "b");
    fprintf(f, "of p: %s, find b: %s\n", part ? part->name : "-", found ? found->name : "-");
    ggn_thresholds_release(t);
}

static void print_table(FILE *f, const char *name, const char *contents)
{
    struct ggn_thresholds t = {0};
    struct base_err err = {0};
    char path[256];
    put_file(name, contents);
    snprintf(path, sizeof path, "%s/%s", root, name);
    fprintf(f, "%s %.70s: ", name, contents);
    int rc = ggn_thresholds_read(path, 8, &t, &err);
    print_thresholds(f, rc, &t, &err);
}

static void thresholds_are_told_word_by_word(void **state)
{
    static const char *const tables[] = {"",
                                         "\n# a\n",
                                         "a",
                                         ";1",
                                         "a;",
                                         "a;;",
                                         "a;1",
                                         "a;1;",
                                         "a;1;2",
                                         "a;1;;2",
                                         "a;1;2;;",
                                         "a;x",
                                         "a;1x",
                                         "a;1 ;2",
                                         "a; 1;2",
                                         "a;0",
                                         "a;-1",
                                         "a;1e12",
                                         "a;999999999999",
                                         "a;nan",
                                         "a;inf",
                                         "a;1\nb;2;3;\r\n",
                                         "a;1\n\nb",
                                         "a;1\nb;2;\na;3;",
                                         "p;1\np_part6;2",
                                         "p_part6;2\nb;1",
                                         "#a;1\nb;1"};
    static const char *const reports[] = {"",
                                          "{}",
                                          "{\"blocks\":[]}",
                                          "{\"blocks\":{}}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":5}]}",
                                          "{\"scene\":7,\"blocks\":[{\"id\":1,\"spp\":5,\"y0\":0}]}",
                                          ("{\"scene\":\"b\",\"blocks\":[{\"id\":3,\"spp\":5,\"threshold\":6,\"y0\":1},{"
                                           "\"id\":0,\"spp\":2,\"y0\":0},{\"id\":1,\"spp\":3,\"y0\":0}]}"),
                                          "{\"blocks\":[{\"id\":-1,\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":\"0\",\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":65535,\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":65536,\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":0}]}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":0}]}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":1e12}]}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":999999999999}]}",
                                          "{\"blocks\":[{\"id\":0,\"threshold\":\"1\",\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":7,\"spp\":-5}]}"};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++)
        print_table(f, "t.csv", tables[i]);
    print_table(f, "t", "a;1");
    print_table(f, "t.json.csv", "a;1");
    for (size_t i = 0; i < sizeof reports / sizeof reports[0]; i++)
        print_table(f, "r.json", reports[i]);
    for (int length = GGN_VIEW_NAME - 1; length <= GGN_VIEW_NAME; length++) {
        char line[256];
        snprintf(line, sizeof line, "%0*d;1", length, 0);
        print_table(f, "long.csv", line);
    }
    for (int n = GGN_VIEW_BLOCKS; n <= GGN_VIEW_BLOCKS + 1; n++) {
        char *line = malloc(2 * (size_t)n + 8);
        strcpy(line, "a");
        for (int i = 0; i < n; i++)
            strcpy(line + 1 + 2 * i, ";7");
        print_table(f, "wide.csv", line);
        free(line);
    }
    transcript_hide(&t, root, "ROOT");
    transcript_end(&t, "data-thresholds");
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
        write_split(splits[i]);
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
        fprintf(f, "%d scenes:", set.n_scenes);
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
        struct ggn_dataset d = {5, views};
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

/* --- series, windows and what training sees of them --- */

/* Two sums of codes, one with weights by place: a code elsewhere changes it. */
static void print_codes(FILE *f, const char *what, const uint8_t *codes, size_t n)
{
    double sum = 0, placed = 0, weights = 0;
    for (size_t i = 0; codes && i < n; i++) {
        sum += codes[i];
        placed += codes[i] * (double)(i % 97);
        weights += (double)(i % 97);
    }
    if (codes)
        fprintf(f, " %s %.2f %.2f", what, sum / (double)n, placed / weights);
}

static void print_series(FILE *f, const struct ggn_series_set *set)
{
    const size_t values = ggn_series_set_values(set);
    fprintf(f, "%d chains of %d scenes, %dx%d, first %g, ratio %.9g, step %g; %d %d to train\n", set->n, set->n_scenes,
            set->width, set->height, set->first_spp, set->ratio, set->step_spp,
            ggn_series_set_count(set, GGN_SPLIT_TRAIN, 0), ggn_series_set_count(set, GGN_SPLIT_TRAIN, 1));
    for (int i = 0; i < set->n; i++) {
        const struct ggn_level_series *c = &set->series[i];
        fprintf(f, "%d: view %d scene %d %s block %u%s%s, label %d %g %d %g;", i, c->view, c->scene,
                ggn_split_names[c->split], c->block, c->synthetic ? " synthetic" : "", c->simulated ? " simulated" : "",
                c->has_label, c->label.threshold, c->label.censored, c->spread);
        print_codes(f, "reference", c->reference, values);
        fputc('\n', f);
        for (int k = 0; k < c->n_levels; k += 1 + (i % 3)) {
            fprintf(f, "  %g:", c->spp[k]);
            print_codes(f, "noisy", c->noisy + values * (size_t)k, values);
            if (set->noise_maps && c->has_noise_map[k])
                print_codes(f, "picture", c->noise_map + values / 3 * (size_t)k, values / 3);
            fputc('\n', f);
        }
    }
}

static void chains_are_as_they_were(void **state)
{
    static const struct ggn_series_set_options options[] = {
        {.dir = "tests/data/recorded", .with_test = 1, .noise_maps = 1, .measures = 1},
        {.dir = "tests/data/recorded", .ratio = 2, .mean_for_reference = 1},
        {.dir = "tests/data/recorded", .split = {.validation = "one", .test = "two,three"}, .with_test = 1},
        {.dir = "tests/data/recorded", .split = {.validation = "one,two", .test = "three"}},
        {.dir = "tests/data/recorded", .split = {.validation = "two,one", .test = "three,one"}},
        {.dir = "tests/data/recorded", .split = {.test = "one-view0"}},
        {.dir = "tests/data/recorded", .split.validation = "one,none"},
        {.dir = "tests/data/train-demo", .split.validation = "scene1", .noise_maps = 1, .measures = 1, .ratio = 3},
        {.dir = "tests/data/recorded/train/one-view1"}};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        struct ggn_series_set set;
        struct base_err err = {0};
        fprintf(f, "> options %zu\n", i);
        if (ggn_series_set_load(&set, &options[i], &err)) {
            fprintf(f, "%s\n", err.text);
            continue;
        }
        print_series(f, &set);
        ggn_series_set_release(&set);
    }
    for (int how = 0; how < 4; how++) {
        struct ggn_series_set set;
        const struct ggn_series_set_options o = {
            .dir = "tests/data/recorded", .with_test = 1, .noise_maps = how != 1, .measures = 1};
        assert_int_equal(ggn_series_set_load(&set, &o, NULL), 0);
        fprintf(f, "> %s\n",
                how == 0   ? "synthetic"
                : how == 1 ? "extended"
                : how == 2 ? "simulated, 1.9"
                           : "synthetic, linear");
        set.ratio = how == 3 ? 0 : set.ratio;
        if (how == 0 || how == 3)
            assert_int_equal(ggn_series_set_add_synthetic(&set, 2, 5, NULL), 0);
        else if (how == 1)
            assert_int_equal(ggn_series_set_extend(&set, 6, NULL), 0);
        else
            assert_int_equal(ggn_series_set_simulate(&set, 1.9, 7, NULL), 0);
        print_series(f, &set);
        ggn_series_set_release(&set);
    }
    transcript_end(&t, "data-chains");
}

static void print_windows(FILE *f, const struct ggn_series_set *set, const struct ggn_window_options *o)
{
    struct ggn_windows w;
    assert_int_equal(ggn_windows_create(&w, set, o, NULL), 0);
    fprintf(f, "%s, %d images%s%s%s: %d windows\n", ggn_split_names[o->split], o->length, o->soft ? ", soft" : "",
            o->synthetic ? ", synthetic" : "", o->label_first ? ", first" : "", w.n);
    for (int i = 0; i < w.n; i++)
        fprintf(f, " %d.%d:%d %.4f %.4f%s", w.list[i].series, w.list[i].last, w.list[i].noisy, w.list[i].label,
                w.list[i].octave, i % 6 == 5 || i + 1 == w.n ? "\n" : "");
    for (int i = 0; i <= set->n; i++)
        fprintf(f, "%s%d", i ? " " : "first: ", w.first[i]);
    fputs("\ndrawn:", f);
    for (int i = 0; i < 40 && w.n; i++)
        fprintf(f, " %d", ggn_windows_draw(&w, (uint64_t)(i / 8) << (i % 2 ? 33 : 0), i % 8, 3));
    fputc('\n', f);
    ggn_windows_release(&w);
}

/* Planes by their mean and their mean weighted by place. */
static void print_planes(FILE *f, const char *what, const float *v, size_t n)
{
    double sum = 0, placed = 0;
    for (size_t i = 0; i < n; i++) {
        sum += (double)v[i];
        placed += (double)v[i] * sin((double)i);
    }
    fprintf(f, " %s %.4f %.3f", what, sum / (double)n, placed);
}

static void windows_are_as_they_were(void **state)
{
    enum { SIDE = 16, P = SIDE * SIDE };
    static float planes[3 * 4 * P], other[3 * P];
    static uint16_t denoised[64 * 3 * P];
    const struct ggn_series_set_options o = {.dir = "tests/data/recorded", .noise_maps = 1, .measures = 1};
    struct ggn_series_set set;
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    assert_int_equal(ggn_series_set_load(&set, &o, NULL), 0);
    assert_int_equal(ggn_series_set_add_synthetic(&set, 1, 5, NULL), 0);
    for (int i = 0; i < 8; i++)
        print_windows(f, &set,
                      &(struct ggn_window_options){.split = i & 1 ? GGN_SPLIT_VALIDATION : GGN_SPLIT_TRAIN,
                                                   .length = i < 6 ? 4 : 9,
                                                   .soft = i & 2,
                                                   .synthetic = i & 4,
                                                   .label_first = i == 5});
    for (int i = 0; i < 12; i++) {
        struct ggn_augment a = ggn_augment_draw(
            (uint64_t)i << (i % 3 * 16), i % 4, 9,
            &(struct ggn_augment_options){.flips = i < 9, .square = i < 7, .jitter = i < 11 ? 0.6 : 0, .noise_map = 0.5});
        fprintf(f, "augment %d%d%d %d %.5f %.5f %.5f\n", a.flip_x, a.flip_y, a.transpose, a.blind, (double)a.gain[0],
                (double)a.gain[1], (double)a.gain[2]);
    }
    struct ggn_level_series *c = &set.series[2];
    for (size_t i = 0; i < (size_t)c->n_levels * 3 * P; i++)
        denoised[i] = (uint16_t)(c->noisy[i] * 250u + i % 257u);
    c->denoised = denoised;
    for (int i = 0; i < 16; i++) {
        struct ggn_augment a = {.flip_x = i & 1,
                                .flip_y = i >> 1 & 1,
                                .transpose = i >> 2 & 1,
                                .gain = {i < 8 ? 1 : 1.3f, 1, i < 8 ? 1 : 0.8f},
                                .blind = i == 15};
        fprintf(f, "planes %d:", i);
        ggn_window_planes(c, 5, 4, SIDE, SIDE, 0, &a, i < 4 ? 0 : 8, planes);
        print_planes(f, "noisy", planes, 12 * P);
        ggn_window_planes(c, 5, 4, SIDE, SIDE, 1, &a, i < 4 ? 8 : 0, planes);
        print_planes(f, "denoised", planes, 12 * P);
        if (ggn_noise_map_plane(c, 5, SIDE, SIDE, &a, planes))
            print_planes(f, "picture", planes, P);
        ggn_crop_planes(c, 3, SIDE, SIDE, 2, 3, 10, i >> 2 & 1 ? 10 : 7, &a, planes, other);
        print_planes(f, "crop", planes, 3 * 70);
        print_planes(f, "of reference", other, 3 * 70);
        fputc('\n', f);
    }
    c->denoised = NULL;
    ggn_series_set_release(&set);
    transcript_end(&t, "data-windows");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(probabilities),
                                       cmocka_unit_test(round_trip),
                                       cmocka_unit_test(a_view_is_listed_once),
                                       cmocka_unit_test(splits),
                                       cmocka_unit_test(split_folders),
                                       cmocka_unit_test(labels_are_told_word_by_word),
                                       cmocka_unit_test(thresholds_are_told_word_by_word),
                                       cmocka_unit_test(datasets_are_told_word_by_word),
                                       cmocka_unit_test(chains_are_as_they_were),
                                       cmocka_unit_test(scenes_are_held_out),
                                       cmocka_unit_test(models_bring_their_split),
                                       cmocka_unit_test(windows_are_as_they_were)};
    return cmocka_run_group_tests_name("data_labels", tests, setup, teardown);
}
