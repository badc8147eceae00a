/* The manifest of a block sequence: what is written is read back, its text word for word, limits, every refusal. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "base/colour.h"
#include "base/files.h"
#include "sequence/manifest.h"
#include "support/base_made_block.h"

static void expect_unread(const struct seq_manifest *m, const char *words)
{
    struct seq_block b;
    struct base_err err = {0};
    char line[256];
    snprintf(line, sizeof line, "%s: %s", made_path, words);
    assert_int_equal(seq_manifest_read_block(made_dir, m, 0, &b, &err), BASE_EINVAL);
    assert_string_equal(err.text, line);
}

static void manifest(void **state)
{
    (void)state;
    uint32_t levels[] = {20, 40, 80, 160};
    struct seq_manifest_block entry = {
        .id = 9, .x0 = 400, .y0 = 200, .x1 = 400 + MADE_W, .y1 = 200 + MADE_H, .file = "block-00009.lseq"};
    struct seq_manifest m = {.scene = "a \"scene\"",
                             .width = 800,
                             .height = 600,
                             .block = 200,
                             .reference_spp = 4096,
                             .reference_independent = 1,
                             .n_levels = 3,
                             .levels = levels,
                             .n_blocks = 1,
                             .blocks = &entry},
                        back;
    struct seq_builder w;
    struct seq_block b;
    struct base_err err = {0};
    struct stat st;
    made_build(&w);
    assert_int_equal(seq_builder_write(&w, made_path, &entry.crc32, &err), 0);
    seq_builder_release(&w);
    stat(made_path, &st);
    entry.bytes = (uint64_t)st.st_size;
    assert_int_equal(seq_manifest_write(made_dir, &m, &err), 0);
    if (seq_manifest_read(made_dir, &back, &err) != 0 || seq_manifest_read_block(made_dir, &back, 0, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_string_equal(back.scene, m.scene);
    assert_int_equal(back.n_levels, 3);
    assert_int_equal(back.blocks[0].crc32, entry.crc32);
    seq_block_release(&b);

    back.blocks[0].crc32 ^= 1;
    expect_unread(&back, "not the file that the manifest lists (size or CRC)");
    back.blocks[0].crc32 ^= 1;
    back.blocks[0].bytes++;
    expect_unread(&back, "not the file that the manifest lists (size or CRC)");
    back.blocks[0].bytes--;
    uint32_t *const places[] = {&back.blocks[0].x1, &back.blocks[0].y1, &back.blocks[0].x0, &back.blocks[0].y0,
                                &back.blocks[0].id};
    for (int i = 0; i < 5; i++) {
        ++*places[i];
        back.blocks[0].x1 += i == 2; /* the same size, elsewhere */
        back.blocks[0].y1 += i == 3;
        expect_unread(&back, "block 9 is 37x21 at 400,200, the manifest says otherwise");
        --*places[i];
        back.blocks[0].x1 -= i == 2;
        back.blocks[0].y1 -= i == 3;
    }
    seq_manifest_release(&back);
    m.n_levels = 4; /* a level that the block does not have */
    seq_manifest_write(made_dir, &m, &err);
    seq_manifest_read(made_dir, &back, &err);
    expect_unread(&back, "the level at 160 spp is missing");
    seq_manifest_release(&back);
}

static void expect_text(const char *name, const char *expected)
{
    char path[64], *text;
    size_t size;
    struct base_err err = {0};
    snprintf(path, sizeof path, "%s/%s", made_dir, name);
    assert_int_equal(base_file_read(path, 1 << 16, &text, &size, &err), 0);
    assert_string_equal(text, expected);
    free(text);
}

/* The manifest word for word: what is always there, and what is there only if it says something. */
/* Member by member: what lies between them is anything. */
static int same_block(const struct seq_manifest_block *a, const struct seq_manifest_block *b)
{
    return a->id == b->id && a->x0 == b->x0 && a->y0 == b->y0 && a->x1 == b->x1 && a->y1 == b->y1 &&
           strcmp(a->file, b->file) == 0 && a->bytes == b->bytes && a->crc32 == b->crc32 && a->seconds == b->seconds &&
           a->dropped == b->dropped;
}

static void manifests_word_for_word(void **state)
{
    (void)state;
    uint32_t levels[] = {20, 40};
    struct base_err err = {0};
    struct seq_manifest_block list[2] = {
        {.id = 3, .x0 = 16, .y0 = 0, .x1 = 32, .y1 = 16, .file = "block-00003.lseq", .bytes = 1234, .crc32 = 0xabc},
        {.id = 4,
         .x0 = 32,
         .y0 = 1,
         .x1 = 40,
         .y1 = 9,
         .file = "f",
         .bytes = 5,
         .crc32 = 0xfedcba98u,
         .seconds = 1.5,
         .dropped = 17}};
    struct seq_manifest m = {.scene = "s",
                             .source = "a/s.pbrt",
                             .camera = "view0",
                             .renderer = "r",
                             .width = 64,
                             .height = 48,
                             .block = 16,
                             .seed = 1,
                             .reference_seed = 2,
                             .reference_spp = 9,
                             .reference_independent = 1,
                             .n_levels = 2,
                             .levels = levels},
                        back;
    assert_int_equal(seq_manifest_write(made_dir, &m, &err), 0);
    expect_text(
        "manifest.json",
        "{\n\t\"format\":\t\"lull-sequence\",\n\t\"version\":\t1,\n\t\"scene\":\t\"s\",\n\t\"source\":\t\"a/s.pbrt\",\n"
        "\t\"camera\":\t\"view0\",\n\t\"renderer\":\t\"r\",\n\t\"width\":\t64,\n\t\"height\":\t48,\n\t\"block\":\t16,\n"
        "\t\"seed\":\t1,\n\t\"reference_seed\":\t2,\n\t\"reference_spp\":\t9,\n\t\"levels\":\t[20, "
        "40],\n\t\"blocks\":\t[]\n}\n");
    m.source_crc32 = 0x12;
    m.inputs_crc32 = 0x345;
    m.has_look_at = 1;
    for (int i = 0; i < 9; i++)
        m.look_at[i] = i + 0.5;
    m.fov_deg = 33.25;
    m.reference_independent = 0;
    m.seed = UINT64_C(1) << 60; /* of another program */
    m.reference_seed = UINT64_MAX;
    m.n_blocks = 2;
    m.blocks = list;
    assert_int_equal(seq_manifest_write(made_dir, &m, &err), 0);
    expect_text(
        "manifest.json",
        "{\n\t\"format\":\t\"lull-sequence\",\n\t\"version\":\t1,\n\t\"scene\":\t\"s\",\n\t\"source\":\t\"a/s.pbrt\",\n"
        "\t\"source_crc32\":\t\"00000012\",\n\t\"inputs_crc32\":\t\"00000345\",\n\t\"camera\":\t\"view0\",\n"
        "\t\"look_at\":\t[0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, "
        "8.5],\n\t\"fov\":\t33.25,\n\t\"renderer\":\t\"r\",\n\t\"width\":\t64,\n"
        "\t\"height\":\t48,\n\t\"block\":\t16,\n\t\"seed\":\t1.152921504606847e+18,\n\t\"reference_seed\":\t1."
        "8446744073709552e+19,\n\t\"reference_spp\":\t9,\n"
        "\t\"reference_independent\":\tfalse,\n\t\"levels\":\t[20, "
        "40],\n\t\"blocks\":\t[{\n\t\t\t\"id\":\t3,\n\t\t\t\"x0\":\t16,\n\t\t\t\"y0\":\t0,\n"
        "\t\t\t\"x1\":\t32,\n\t\t\t\"y1\":\t16,\n\t\t\t\"file\":\t\"block-00003.lseq\",\n\t\t\t\"bytes\":\t1234,"
        "\n\t\t\t\"crc32\":\t\"00000abc\"\n"
        "\t\t}, "
        "{\n\t\t\t\"id\":\t4,\n\t\t\t\"x0\":\t32,\n\t\t\t\"y0\":\t1,\n\t\t\t\"x1\":\t40,\n\t\t\t\"y1\":\t9,\n\t\t\t\"file\":"
        "\t\"f\",\n"
        "\t\t\t\"bytes\":\t5,\n\t\t\t\"crc32\":\t\"fedcba98\",\n\t\t\t\"seconds\":\t1.5,\n\t\t\t\"dropped\":\t17\n\t\t}]\n}"
        "\n");
    assert_int_equal(seq_manifest_read(made_dir, &back, &err), 0);
    assert_string_equal(back.source, "a/s.pbrt");
    assert_true(back.seed == m.seed && back.reference_seed == m.reference_seed);
    assert_true(back.n_blocks == 2 && same_block(&back.blocks[0], &list[0]) && same_block(&back.blocks[1], &list[1]));
    seq_manifest_release(&back);
    assert_true(back.n_blocks == 0 && !back.blocks && !back.levels);
}

/* `%s` of a good manifest, or of its only block, is changed; NULL: it stays good. */
static void limits_of_manifests(void **state)
{
    (void)state;
    static const char good[] =
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":1048576,\"height\":1048576,\"block\":4096,"
        "\"reference_spp\":2147483647,\"levels\":[1,2147483647],\"blocks\":[{\"id\":4294967295,\"x0\":0,\"y0\":0,\"x1\":1,"
        "\"y1\":1048576,\"file\":\"x\",\"bytes\":1073741824,\"crc32\":\"0000000f\",\"dropped\":0}]}";
    static const struct {
        const char *from, *to, *words;
    } cases[] = {
        {"lull-sequence", "other", "not the manifest of a sequence"},
        {"\"version\":1", "\"version\":2",
         "looks at a whole frame (version 2 of the format), expected blocks alone (version 1)"},
        {"\"version\":1", "\"version\":3", "this version of the format is not known"},
        {"\"scene\":\"s\"", "\"scene\":7", "the scene has no name"},
        {"\"width\":1048576", "\"width\":1048577", "width, height or block is missing or out of range"},
        {"\"width\":1048576", "\"width\":0", "width, height or block is missing or out of range"},
        {"\"width\":1048576", "\"width\":1", NULL},
        {"\"height\":1048576", "\"height\":1048577", "width, height or block is missing or out of range"},
        {"\"height\":1048576", "\"height\":1.5", "width, height or block is missing or out of range"},
        {"\"block\":4096", "\"block\":4097", "width, height or block is missing or out of range"},
        {"\"block\":4096", "\"block\":\"8\"", "width, height or block is missing or out of range"},
        {"[1,2147483647]", "[0,2]", "level 0 does not rise"},
        {"[1,2147483647]", "[1,2147483648]", "level 1 does not rise"},
        {"[1,2147483647]", "[1,1]", "level 1 does not rise"},
        {"[1,2147483647]", "[]", "no list of levels"},
        {"[1,2147483647]", "7", "no list of levels"},
        {"\"blocks\":[", "\"blocks\":7,\"more\":[", "no list of blocks"},
        {"\"id\":4294967295", "\"id\":4294967296", "entry 0 of blocks is not usable"},
        {"\"id\":4294967295", "\"id\":0", NULL},
        {"\"x0\":0,", "\"x0\":1,", "entry 0 of blocks is not usable"},
        {"\"x0\":0,", "\"x0\":-1,", "entry 0 of blocks is not usable"},
        {"\"x1\":1,", "\"x1\":1048576,", NULL},
        {"\"x1\":1,", "\"x1\":1048577,", "entry 0 of blocks is not usable"},
        {"\"y0\":0,", "\"y0\":1048575,", NULL},
        {"\"y0\":0,", "\"y0\":1048576,", "entry 0 of blocks is not usable"},
        {"\"y1\":1048576", "\"y1\":0", "entry 0 of blocks is not usable"},
        {"\"bytes\":1073741824", "\"bytes\":1073741825", "entry 0 of blocks is not usable"},
        {"\"bytes\":1073741824", "\"bytes\":0", "entry 0 of blocks is not usable"},
        {"\"0000000f\"", "\"g\"", "entry 0 of blocks is not usable"},
        {"\"0000000f\"", "\"0000000f0\"", "entry 0 of blocks is not usable"},
        {"\"0000000f\"", "15", "entry 0 of blocks is not usable"},
        {"\"dropped\":0", "\"dropped\":1e15", NULL},
        {"\"dropped\":0", "\"dropped\":-1", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":\"\"", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":\".x\"", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":\"a/x\"", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":4", "entry 0 of blocks is not usable"},
        {"\"version\":1", "\"version\":1,\"look_at\":[1,2,3,4,5,6,7,8]", "look_at is not nine numbers"},
        {"\"version\":1", "\"version\":1,\"look_at\":[1,2,3,4,5,6,7,8,\"9\"]", "look_at is not nine numbers"},
        {"\"version\":1", "\"version\":1,\"look_at\":9", "look_at is not nine numbers"},
        {"\"version\":1", "\"version\":1,\"look_at\":[1,2,3,4,5,6,7,8,9],\"fov\":\"x\"", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[1024], line[128];
        struct seq_manifest m;
        struct base_err err = {0};
        const char *at = strstr(good, cases[i].from);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, cases[i].to, at + strlen(cases[i].from));
        snprintf(line, sizeof line, "m.json: %s", cases[i].words ? cases[i].words : "");
        int rc = seq_manifest_parse("m.json", text, strlen(text), &m, &err);
        if (rc != (cases[i].words ? BASE_EINVAL : 0) || (rc && strcmp(err.text, line) != 0))
            fail_msg("%s: %d \"%s\", expected \"%s\"", cases[i].to, rc, err.text, line);
        if (!rc)
            seq_manifest_release(&m);
    }
}

static void bad_manifests(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "",
        "{}",
        "[1]",
        "{\"format\":\"lull-sequence\"}",
        "{\"format\":\"lull-sequence\",\"version\":2,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[1],"
        "\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"width\":8,\"height\":8,\"block\":8,\"levels\":[1],\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[],"
        "\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2,2],"
        "\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2],"
        "\"blocks\":"
        "[{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"../x\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2],"
        "\"blocks\":"
        "[{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":9,\"y1\":8,\"file\":\"x\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct seq_manifest m;
        struct base_err err = {0};
        if (seq_manifest_parse("m.json", bad[i], strlen(bad[i]), &m, &err) != BASE_EINVAL || err.text[0] == '\0')
            fail_msg("%s was accepted", bad[i]);
    }
}

static void a_block_is_listed_once(void **state)
{
    (void)state;
    for (int second = 3; second >= 2; second--) {
        struct seq_manifest m;
        struct base_err err = {0};
        char text[512];
        int n = snprintf(
            text, sizeof text,
            "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2]"
            ","
            "\"blocks\":[{\"id\":2,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"x\",\"bytes\":9,\"crc32\":\"00000000\"},"
            "{\"id\":%d,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"y\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
            second);
        assert_int_equal(seq_manifest_parse("m.json", text, (size_t)n, &m, &err), second == 3 ? 0 : BASE_EINVAL);
        if (second == 3)
            seq_manifest_release(&m);
        else
            assert_string_equal(err.text, "m.json: block 2 is listed twice");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(manifest),
        cmocka_unit_test(bad_manifests),
        cmocka_unit_test(a_block_is_listed_once),
        cmocka_unit_test(manifests_word_for_word),
        cmocka_unit_test(limits_of_manifests),
    };
    return cmocka_run_group_tests(tests, made_begin, made_end);
}
