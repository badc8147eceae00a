/* Recorded frames: what is written is read back to the bit, every kind of damage is noticed, and what is said is word for word. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <zlib.h>

#include "base/bytes.h"
#include "base/files.h"
#include "sequence/recording.h"

enum { W = 7, H = 5, P = W * H, AT = SEQ_FILE_HEADER, STATS = AT + SEQ_LOOK_HEADER, PLANE = STATS + 2 * SEQ_STAT_BYTES };
static char folder[] = "/tmp/base_recording.XXXXXX";

static int setup(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int teardown(void **state)
{
    char command[64];
    (void)state;
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

/* Any bits but those of no number in [0, 2^24): float keeps them all. */
static float value(enum seq_plane_number plane, size_t i)
{
    const uint32_t bits = 0x3e000000u + 7919u * (uint32_t)i + 104729u * (uint32_t)plane;
    return i == 3 ? -0.0f : i == 4 ? 1e-40f : i == 5 ? HUGE_VALF : base_f32_of_bits(bits);
}

static void fill(void *data, enum seq_plane_number plane, float *out)
{
    const struct seq_record *r = data;
    for (size_t i = 0; i < seq_plane_channels((uint32_t)plane) * (size_t)r->width * r->height; i++)
        out[i] = value(plane, i + r->block);
}

static const uint32_t planes = 1u << SEQ_PLANE_HALF | 1u << SEQ_PLANE_REST | 1u << SEQ_PLANE_MOMENT2;

/* Two blocks, the second a question without planes. */
static void build(struct seq_builder *w)
{
    static const struct seq_stat stats[2] = {{"error", 1.25}, {"action", 1}};
    struct seq_record r = {
        .kind = SEQ_LEVEL, .spp = 20, .half_spp = 10, .block = 2, .x0 = 3, .y0 = 1, .width = W, .height = H};
    assert_int_equal(seq_look_open(w, 20, 10, 4, 77, NULL), 0);
    r.n_stats = 2;
    assert_int_equal(seq_look_add(w, &r, stats, planes, fill, &r, NULL), 0);
    r.block = 5, r.x0 = 10, r.width = 10, r.kind = SEQ_BEYOND, r.n_stats = 0;
    assert_int_equal(seq_look_add(w, &r, NULL, 0, fill, &r, NULL), 0);
}

/* The bytes of the file; caller frees. */
static uint8_t *file(size_t *size, uint32_t *crc)
{
    struct seq_builder w;
    char path[64], *text;
    snprintf(path, sizeof path, "%s/look.lseq", folder);
    build(&w);
    assert_int_equal(seq_builder_write(&w, path, crc, NULL), 0);
    seq_builder_release(&w);
    assert_int_equal(base_file_read(path, 1 << 20, &text, size, NULL), 0);
    return (uint8_t *)text;
}

static void round_trip(void **state)
{
    struct seq_look l;
    size_t size;
    uint32_t crc;
    float out[3 * P];
    (void)state;
    uint8_t *bytes = file(&size, &crc);
    assert_int_equal(crc, crc32(0, bytes, (uInt)size));
    assert_int_equal(seq_look_parse("l", bytes, size, &l, NULL), 0);
    assert_true(l.width == 20 && l.height == 10 && l.number == 4 && l.seed == 77 && l.count == 2);
    const struct seq_record *r = &l.records[0];
    assert_true(r->kind == SEQ_LEVEL && r->spp == 20 && r->half_spp == 10 && r->block == 2 && r->n_planes == 3);
    assert_true(r->x0 == 3 && r->y0 == 1 && r->width == W && r->height == H && seq_stat(r, "error") == 1.25);
    for (uint32_t p = SEQ_PLANE_COLOR; p < SEQ_PLANES_END; p++) {
        assert_int_equal(seq_shown(r, (enum seq_plane_number)p, out, NULL), planes >> p & 1 ? 0 : BASE_EINVAL);
        for (size_t i = 0; (planes >> p & 1) && i < seq_plane_channels(p) * P; i++)
            assert_int_equal(base_f32_bits(out[i]), base_f32_bits(value((enum seq_plane_number)p, i + 2)));
    }
    assert_int_equal(seq_shown(r, SEQ_PLANE_DISPLAY, out, NULL), BASE_EINVAL);
    assert_true(l.records[1].kind == SEQ_BEYOND && l.records[1].n_planes == 0 && isnan(seq_stat(&l.records[1], "error")));
    seq_look_release(&l);
}

/* The lowest bytes of all values come first: what FORMAT.md calls shuffled. */
static void plane_as_it_lies(void **state)
{
    size_t size;
    uint32_t crc;
    uint8_t raw[4 * P];
    (void)state;
    uint8_t *bytes = file(&size, &crc);
    uLongf n = sizeof raw;
    assert_int_equal(base_get_u32(bytes + PLANE), SEQ_PLANE_MOMENT2);
    assert_int_equal(base_get_u32(bytes + PLANE + 4), SEQ_FILTER_SHUFFLE);
    assert_int_equal(uncompress(raw, &n, bytes + PLANE + 16, base_get_u32(bytes + PLANE + 12)), Z_OK);
    assert_int_equal(n, sizeof raw);
    for (size_t i = 0; i < P; i++)
        for (size_t k = 0; k < 4; k++)
            assert_int_equal(raw[k * P + i], base_f32_bits(value(SEQ_PLANE_MOMENT2, i + 2)) >> 8 * k & 255);
    free(bytes);
}

static void reseal(uint8_t *bytes, size_t size)
{
    base_put_u32(bytes + 60, (uint32_t)crc32(0, bytes, 60));
    for (size_t at = AT; at + SEQ_LOOK_HEADER <= size;) {
        const size_t payload = base_get_u32(bytes + at + 20);
        if (payload <= size - at - SEQ_LOOK_HEADER)
            base_put_u32(bytes + at + 24, (uint32_t)crc32_z(0, bytes + at + SEQ_LOOK_HEADER, payload));
        base_put_u32(bytes + at + 60, (uint32_t)crc32(0, bytes + at, 60));
        at += SEQ_LOOK_HEADER + payload;
    }
}

static void expect(const uint8_t *bytes, size_t size, const char *words)
{
    struct seq_look l;
    struct base_err err = {0};
    char line[160];
    uint8_t *copy = malloc(size);
    memcpy(copy, bytes, size);
    snprintf(line, sizeof line, "l: %s", words ? words : "");
    const int rc = seq_look_parse("l", copy, size, &l, &err);
    if (rc != (words ? BASE_EINVAL : 0) || (words && strcmp(err.text, line) != 0))
        fail_msg("%d \"%s\", expected \"%s\"", rc, err.text, line);
    if (rc)
        free(copy);
    else
        seq_look_release(&l);
}

/* One number of a good file is another one, and the checksums fit: what is said of it, word for word. */
static void limits_of_looks(void **state)
{
    size_t size;
    uint32_t crc;
    (void)state;
    uint8_t *bytes = file(&size, &crc);
    const size_t second = AT + SEQ_LOOK_HEADER + base_get_u32(bytes + AT + 20);
    const struct {
        size_t at;
        uint32_t value;
        const char *words;
    } cases[] = {
        {0, 0, "not a block sequence"},
        {8, 1, "a block alone (version 1 of the format), expected a look at a whole frame"},
        {8, 3, "version 3 of the format is not known"},
        {12, 65, "version 2 of the format is not known"},
        {16, 0, "a picture of 0x10 pixels with 2 images"},
        {16, 32769, "a picture of 32769x10 pixels with 2 images"},
        {16, 19, "header of image 1 makes no sense"}, /* beyond the picture */
        {20, 5, "header of image 0 makes no sense"},
        {36, 0, "a picture of 20x10 pixels with 0 images"},
        {36, 1048577, "a picture of 20x10 pixels with 1048577 images"},
        {36, 99, "truncated: room for fewer than 99 images"},
        {36, 1, "bytes after the last image"},
        {AT, 0, "header of image 0 makes no sense"},
        {AT, 4, "header of image 0 makes no sense"},
        {AT, 2, NULL},
        {AT + 4, 0, "header of image 0 makes no sense"},
        {AT + 8, 21, "header of image 0 makes no sense"},
        {AT + 12, 65, "header of image 0 makes no sense"},
        {AT + 16, 17, "header of image 0 makes no sense"},
        {AT + 16, 2, "20 spp: bytes after the last plane"},
        {AT + 16, 4, "20 spp: plane 3 is cut short"},
        {AT + 20, 0xffffff, "truncated: 0 of 2 images"},
        {AT + 28, 5, "blocks do not rise: 5 after 5"},
        {AT + 28, 6, "blocks do not rise: 5 after 6"},
        {AT + 32, 10, "header of image 0 makes no sense"},
        {AT + 32, 0xffffffffu, "header of image 0 makes no sense"},
        {AT + 40, 21, "header of image 0 makes no sense"},
        {AT + 44, 1, "header of image 0 makes no sense"},
        {AT + 44, 7, "20 spp: plane 0 has the wrong size, filter or number"},
        {second + 4, 1, "header of image 1 makes no sense"}, /* half_spp is 10 */
        {STATS + SEQ_NAME + 4, 0x7ff00000, "20 spp: statistic 0 is not usable"},
        {PLANE, 99, NULL}, /* a plane that nobody knows yet */
        {PLANE, SEQ_PLANE_HALF, "20 spp: plane 0 has the wrong size, filter or number"},
        {PLANE + 4, SEQ_FILTER_AVERAGE, "20 spp: plane 0 has the wrong size, filter or number"},
        {PLANE + 8, 4 * P + 1, "20 spp: plane 0 has the wrong size, filter or number"},
        {PLANE + 12, 0xffffff, "20 spp: plane 0 is cut short"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const uint32_t kept = base_get_u32(bytes + cases[i].at);
        base_put_u32(bytes + cases[i].at, cases[i].value);
        reseal(bytes, size);
        expect(bytes, size, cases[i].words);
        base_put_u32(bytes + cases[i].at, kept);
        if (cases[i].at == AT + 20)
            base_put_u32(bytes + AT + 24, (uint32_t)crc32_z(0, bytes + STATS, kept));
    }
    reseal(bytes, size);
    expect(bytes, size, NULL);
    for (size_t i = 0; i < size; i++) { /* any bit */
        struct seq_look l;
        uint8_t *copy = malloc(size);
        memcpy(copy, bytes, size);
        copy[i] ^= (uint8_t)(1 << i % 8);
        assert_int_equal(seq_look_parse("l", copy, size, &l, NULL), BASE_EINVAL);
        assert_int_equal(seq_look_parse("l", copy, i, &l, NULL), BASE_EINVAL);
        free(copy);
    }
    free(bytes);
}

static void builder_limits(void **state)
{
    struct seq_builder w;
    struct base_err err = {0};
    (void)state;
    assert_int_equal(seq_look_open(&w, 0, 10, 1, 0, &err), BASE_EINVAL);
    assert_string_equal(err.text, "a picture of 0x10 pixels");
    assert_int_equal(seq_look_open(&w, 32769, 10, 1, 0, &err), BASE_EINVAL);
    assert_int_equal(seq_look_open(&w, 32768, 1, 1, 0, &err), 0);
    seq_builder_release(&w);
}

/* --- the manifest --------------------------------------------------------------------------------------------------- */

static const char good[] =
    "{\"format\":\"lull-sequence\",\"version\":2,\"scene\":\"s\",\"width\":20,\"height\":10,\"seed\":77,\"levels\":[],"
    "\"planes\":[\"color\",\"half\"],\"frame\":{\"flags\":1538,\"transfer\":\"srgb\",\"gamma\":0,\"exposure\":1,"
    "\"sample_clamp\":0,\"rgb_to_xyz\":[1,2,3,4,5,6,7,8,9],\"max_seam\":0,\"spp_min\":16,\"spp_max\":100},"
    "\"criterion\":{\"spec\":\"observer\",\"id\":\"observer\",\"version\":\"1.1\",\"parameters\":{\"visible\":\"0.35\"}},"
    "\"blocks\":[[0,0,10,10],[10,0,20,10]],\"finished\":[\"looks\"],\"files\":[{\"file\":\"a\",\"part\":\"looks\","
    "\"bytes\":7,\"crc32\":\"0000000f\"},{\"file\":\"b\",\"part\":\"added\",\"layer\":\"x\",\"bytes\":7,\"crc32\":\"1\"}]}";

static void limits_of_manifests(void **state)
{
    (void)state;
    static const char frame[] = "frame is missing or has a number out of range", entry[] = "entry 0 of files is not usable",
                      judge[] = "the criterion is not usable", block[] = "block 1 is no rectangle of the picture";
    static const struct {
        const char *from, *to, *words;
    } cases[] = {
        {"\"version\":2", "\"version\":2", NULL},
        {"\"version\":2", "\"version\":1",
         "blocks alone (version 1 of the format), expected looks at a whole frame (version 2)"},
        {"\"version\":2", "\"version\":3", "this version of the format is not known"},
        {"\"levels\":[]", "\"levels\":[1,1]", "level 1 does not rise"},
        {"\"levels\":[]", "\"levels\":7", "no list of levels"},
        {"\"color\",\"half\"", "\"half\"", "no list of planes, color among them"},
        {"\"color\",\"half\"", "\"color\",\"hull\"", "no list of planes, color among them"},
        {"\"color\",\"half\"", "\"color\",7", "no list of planes, color among them"},
        {"[\"looks\"]", "[\"look\"]", "what is finished is no list of parts"},
        {"[\"looks\"]", "[\"looks\",\"beyond\",\"reference\"]", NULL},
        {"\"frame\"", "\"from\"", frame},
        {"\"exposure\":1", "\"exposure\":0", frame},
        {"\"exposure\":1", "\"exposure\":-1", frame},
        {"[1,2,3,4,5,6,7,8,9]", "[1,2,3,4,5,6,7,8]", frame},
        {"[1,2,3,4,5,6,7,8,9]", "[1,2,3,4,5,6,7,8,9,10]", frame},
        {"[1,2,3,4,5,6,7,8,9]", "[1,2,3,4,5,6,7,8,\"9\"]", frame},
        {"\"spp_min\":16", "\"spp_min\":101", frame},
        {"\"spp_max\":100", "\"spp_max\":1e10", frame},
        {"\"flags\":1538", "\"flags\":-1", frame},
        {"\"id\":\"observer\"", "\"id\":\"\"", judge},
        {"\"visible\":\"0.35\"", "\"visible\":0.35", judge},
        {"\"visible\":\"0.35\"", "\"visible\":\"0.35\\n\"", judge},
        {"\"visible\":\"0.35\"", "\"vis=ible\":\"0.35\"", judge},
        {"\"visible\":\"0.35\"", "", NULL},
        {"[10,0,20,10]", "[10,0,21,10]", block},
        {"[10,0,20,10]", "[20,0,20,10]", block},
        {"[10,0,20,10]", "[10,0,20]", block},
        {"[10,0,20,10]", "[10,0,20,10,1]", block},
        {"[10,0,20,10]", "7", block},
        {"[10,0,20,10]", "[-1,0,20,10]", block},
        {"[[0,0,10,10],[10,0,20,10]]", "[]", "no list of blocks"},
        {"\"file\":\"a\"", "\"file\":\"\"", entry},
        {"\"file\":\"a\"", "\"file\":\"../a\"", entry},
        {"\"file\":\"a\"", "\"file\":\".a\"", entry},
        {"\"file\":\"a\"", "\"file\":\"b\"", "file b is listed twice"},
        {"\"part\":\"looks\"", "\"part\":\"other\"", entry},
        {"\"bytes\":7,\"crc32\":\"0", "\"bytes\":0,\"crc32\":\"0", entry},
        {"\"crc32\":\"0000000f\"", "\"crc32\":\"g\"", entry},
        {"\"layer\":\"x\",", "", "entry 1 of files is not usable"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        static struct seq_recording m;
        char text[2048], line[160];
        struct base_err err = {0};
        const char *at = strstr(good, cases[i].from);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, cases[i].to, at + strlen(cases[i].from));
        snprintf(line, sizeof line, "m.json: %s", cases[i].words ? cases[i].words : "");
        const int rc = seq_recording_parse("m.json", text, strlen(text), &m, &err);
        if (rc != (cases[i].words ? BASE_EINVAL : 0) || (rc && strcmp(err.text, line) != 0))
            fail_msg("%s: %d \"%s\", expected \"%s\"", cases[i].to, rc, err.text, line);
        if (!rc)
            seq_recording_release(&m);
    }
    for (size_t n = 0; n < strlen(good); n++) { /* cut short */
        static struct seq_recording m;
        assert_int_equal(seq_recording_parse("m.json", good, n, &m, NULL), BASE_EINVAL);
    }
}

/* Written and read, a manifest has the same identity; a file that it lists is held against it. */
static void manifest_round_trip(void **state)
{
    static struct seq_recording m, again;
    struct base_identity one = {0}, other = {0};
    struct base_err err = {0};
    struct seq_look l;
    size_t size;
    uint32_t crc;
    (void)state;
    assert_int_equal(seq_recording_parse("m.json", good, strlen(good), &m, &err), 0);
    m.of.blocks = realloc(m.of.blocks, 6 * sizeof *m.of.blocks);
    for (uint32_t i = 0; i < 6; i++)
        m.of.blocks[i] =
            (struct seq_manifest_block){.id = i, .x0 = i == 5 ? 10 : 3, .y0 = 1, .x1 = i == 5 ? 20 : 10, .y1 = 6};
    m.of.n_blocks = 6;
    free(file(&size, &crc));
    strcpy(m.files[0].name, "look.lseq");
    m.files[0].bytes = size;
    m.files[0].crc32 = crc;
    assert_int_equal(seq_recording_write(folder, &m, &err), 0);
    assert_int_equal(seq_recording_read(folder, &again, &err), 0);
    seq_recording_identity(&m, &one);
    seq_recording_identity(&again, &other);
    assert_string_equal(one.text, other.text);
    assert_string_equal(again.parameters, "visible=0.35\n");
    assert_true(again.n_files == 2 && again.files[1].part == SEQ_PART_ADDED && strcmp(again.files[1].layer, "x") == 0);
    assert_true(again.finished == 1u << SEQ_PART_LOOKS && again.planes == (1u << SEQ_PLANE_COLOR | 1u << SEQ_PLANE_HALF));
    if (seq_recording_read_look(folder, &again, 0, &l, &err) != 0)
        fail_msg("%s", err.text);
    seq_look_release(&l);
    again.files[0].crc32++;
    assert_int_equal(seq_recording_read_look(folder, &again, 0, &l, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "not the file that the manifest lists (size or CRC)"));
    again.files[0].crc32--;
    again.of.blocks[2].x0--;
    assert_int_equal(seq_recording_read_look(folder, &again, 0, &l, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "block 2 is 7x5 at 3,1, the manifest says otherwise"));
    again.of.n_blocks = 2;
    assert_int_equal(seq_recording_read_look(folder, &again, 0, &l, &err), BASE_EINVAL);
    again.of.width++;
    assert_int_equal(seq_recording_read_look(folder, &again, 0, &l, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "a picture of 20x10, the manifest says otherwise"));
    base_identity_release(&one);
    base_identity_release(&other);
    seq_recording_release(&m);
    seq_recording_release(&again);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_trip),     cmocka_unit_test(plane_as_it_lies),    cmocka_unit_test(limits_of_looks),
        cmocka_unit_test(builder_limits), cmocka_unit_test(limits_of_manifests), cmocka_unit_test(manifest_round_trip),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
