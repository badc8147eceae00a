/* Files, the inputs of a result, folders that one process writes to, JSON, small floats, what is said of processes: each function in
 * closed cases, each refusal word for word. */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"
#include "base/paths.h"
#include "base/json.h"
#include "picture/png.h"
#include "base/threads.h"
#include "support/foreign.h"

static char dir[] = "/tmp/base_files.XXXXXX";

static int setup(void **state)
{
    (void)state;
    return mkdtemp(dir) && chdir(dir) == 0 ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", dir);
    return chdir("/") == 0 ? system(command) : -1;
}

static void put(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    assert_true(f && fputs(text, f) >= 0 && fclose(f) == 0);
}

/* The text of a small file; static. */
static const char *get(const char *path)
{
    static char text[4096];
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    return text;
}

static void says(int rc, int code, const struct base_err *err, const char *format, ...)
{
    char line[5000];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof err->text, format, args);
    va_end(args);
    assert_int_equal(rc, code);
    assert_int_equal(err->code, code);
    char *told = foreign_as_recorded(err->text);
    assert_string_equal(told, line);
    free(told);
}

/* --- reading ------------------------------------------------------------------------------------------------------------- */

static void whole_files(void **state)
{
    (void)state;
    struct base_err err = {0};
    char *data = NULL;
    size_t size = 9;
    FILE *f;
    put("five", "ab\ncd");
    assert_int_equal(base_file_read("five", 5, &data, &size, &err), 0);
    assert_true(size == 5 && memcmp(data, "ab\ncd", 6) == 0);
    free(data);
    data = NULL;
    says(base_file_read("five", 4, &data, &size, &err), BASE_EINVAL, &err,
         "five: 5 bytes, more than the 4 this kind of file may have");
    put("none", "");
    assert_int_equal(base_file_read("none", 0, &data, &size, &err), 0);
    assert_true(size == 0 && data[0] == '\0');
    free(data);
    mkdir("folder", 0777);
    mkfifo("fifo", 0666);
    says(base_file_read("folder", 9, &data, &size, &err), BASE_EINVAL, &err, "folder: not a regular file");
    says(base_file_open("fifo", &f, &err), BASE_EINVAL, &err, "fifo: not a regular file");
    says(base_file_check_input("missing", &err), BASE_EIO, &err, "missing: No such file or directory");
    assert_int_equal(base_file_check_input("five", &err), 0);
    assert_int_equal(base_file_open("five", &f, &err), 0);
    assert_true(fgetc(f) == 'a' && fcntl(fileno(f), F_GETFD) & FD_CLOEXEC);
    fclose(f);
}

/* --- outputs ------------------------------------------------------------------------------------------------------------- */

static void what_cannot_be_written(void **state)
{
    (void)state;
    struct base_err err = {0};
    char name[5000], path[4096];
    assert_int_equal(base_file_check_output(NULL, &err), 0);
    assert_int_equal(base_file_check_output("new", &err), 0);
    assert_int_equal(base_file_check_output("five", &err), 0);
    assert_int_equal(base_file_check_output("folder/new", &err), 0);
    says(base_file_check_output("folder/", &err), BASE_EINVAL, &err, "folder/: not the name of a file");
    says(base_file_check_output("folder", &err), BASE_EINVAL, &err, "folder: cannot write there: it is a folder");
    says(base_file_check_output("fifo", &err), BASE_EINVAL, &err,
         "fifo: cannot write there: it is no regular file and would be replaced");
    says(base_file_check_output("missing/new", &err), BASE_EIO, &err,
         "missing/new: cannot write there: No such file or directory");
    says(base_file_check_output("five/new", &err), BASE_EIO, &err, "five/new: cannot write there: Not a directory");
    assert_int_equal(symlink("loop", "loop"), 0);
    says(base_file_check_output("loop", &err), BASE_EINVAL, &err, "loop: Too many levels of symbolic links");
    memset(name, 'n', sizeof name);
    name[255] = '\0';
    assert_int_equal(base_file_check_output(name, &err), 0);
    name[255] = 'n';
    name[256] = '\0';
    says(base_file_check_output(name, &err), BASE_EINVAL, &err, "%.64s...: the path is too long", name);
    name[256] = 'n';
    name[4096] = '\0';
    says(base_file_check_output(name, &err), BASE_EINVAL, &err, "%.64s...: the path is too long", name);
    name[4090] = '\0';
    assert_int_equal(base_file_join(path, "abc", name + 4090 - 4091 + 1, &err), 0); /* 3 + 1 + 4090 */
    says(base_file_join(path, "abcde", name, &err), BASE_EINVAL, &err, "abcde...: the path is too long");
    assert_int_equal(base_file_join(path, "a/b", "c", &err), 0);
    assert_string_equal(path, "a/b/c");
    for (int i = 0; i < 2; i++) /* one that is there is as good */
        assert_int_equal(base_make_folder("folder/made", NULL, &err), 0);
    assert_int_equal(rmdir("folder/made"), 0);
    says(base_make_folder("folder/none/made", NULL, &err), BASE_EIO, &err, "folder/none/made: No such file or directory");
}

static void outputs_appear_when_they_are_whole(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_file_out a, b, zero = {0};
    char name[300], expected[400];
    struct stat st;
    put("out", "old");
    assert_int_equal(base_file_begin(&a, "out", &err), 0);
    assert_int_equal(base_file_begin(&b, "./out", &err), 0); /* two at once */
    assert_string_equal(a.path, "out");
    snprintf(expected, sizeof expected, ".tmp-lull%ld-0.out", (long)getpid());
    assert_string_equal(a.tmp_path, expected);
    snprintf(expected, sizeof expected, "./.tmp-lull%ld-1.out", (long)getpid());
    assert_string_equal(b.tmp_path, expected);
    assert_true(stat(a.tmp_path, &st) == 0 && fcntl(fileno(a.file), F_GETFD) & FD_CLOEXEC);
    fprintf(a.file, "new");
    assert_string_equal(get("out"), "old");
    assert_int_equal(base_file_commit(&a, &err), 0);
    assert_true(!a.file && stat(a.tmp_path, &st) != 0);
    assert_string_equal(get("out"), "new");
    base_file_abort(&a);
    base_file_abort(&b);
    base_file_abort(&b);
    base_file_abort(&zero);
    assert_int_equal(stat(b.tmp_path, &st), -1);
    assert_string_equal(get("out"), "new");

    assert_true(symlink("folder/there", "link") == 0 && symlink("../link", "folder/back") == 0);
    assert_int_equal(base_file_write_line("folder/back", "one line", &err), 0); /* to where no file was yet */
    assert_string_equal(get("folder/there"), "one line\n");
    assert_true(lstat("link", &st) == 0 && S_ISLNK(st.st_mode) && lstat("folder/back", &st) == 0 && S_ISLNK(st.st_mode));
    snprintf(name, sizeof name, "%s/folder/there", dir);
    assert_true(unlink("link") == 0 && symlink(name, "link") == 0); /* an absolute one */
    assert_int_equal(base_file_begin(&a, "folder/back", &err), 0);
    assert_string_equal(a.path, name);
    base_file_abort(&a);

    memset(name, 'n', 240);
    strcpy(name + 240, ".exr");
    assert_int_equal(base_file_begin(&a, name, &err), 0);
    snprintf(expected, sizeof expected, ".tmp-lull%ld-0.%s", (long)getpid(), name + 244 - 180);
    assert_string_equal(a.tmp_path, expected);
    base_file_abort(&a);
    assert_int_equal(base_file_begin(&a, "missing/x", &err), BASE_EIO);
    assert_null(a.file);
}

static mode_t mode_of(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 ? st.st_mode & 07777 : 0;
}

/* What was private stays so, also while it is written; what a group may write it may go on to. */
static void permissions_of_the_old_file_stay(void **state)
{
    (void)state;
    static const mode_t modes[] = {0600, 0664, 0444, 0640};
    struct base_err err = {0};
    struct base_file_out out;
    const mode_t mask = umask(022);
    for (size_t i = 0; i < sizeof modes / sizeof modes[0]; i++) {
        put("kept", "old");
        assert_int_equal(chmod("kept", modes[i]), 0);
        assert_int_equal(base_file_begin(&out, "kept", &err), 0);
        assert_int_equal(mode_of(out.tmp_path), modes[i] | 0600);
        fprintf(out.file, "new");
        assert_int_equal(base_file_commit(&out, &err), 0);
        assert_string_equal(get("kept"), "new");
        assert_int_equal(mode_of("kept"), modes[i]);
        assert_int_equal(unlink("kept"), 0);
    }
    assert_int_equal(base_file_write_line("kept", "new", &err), 0); /* of a new one the umask decides */
    assert_int_equal(mode_of("kept"), 0644);
    umask(mask);
    unlink("kept");
}

static void a_failed_write_keeps_the_old_file(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_file_out out;
    struct rlimit before, little;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    little = before;
    little.rlim_cur = 4;
    signal(SIGXFSZ, SIG_IGN);
    put("out", "old");
    assert_int_equal(base_file_begin(&out, "out", &err), 0);
    setrlimit(RLIMIT_FSIZE, &little);
    fprintf(out.file, "more than that");
    int rc = base_file_commit(&out, &err);
    setrlimit(RLIMIT_FSIZE, &before);
    says(rc, BASE_EIO, &err, "out: write failed: File too large");
    static char big[100000]; /* fails before commit, which must still know why */
    assert_int_equal(base_file_begin(&out, "out", &err), 0);
    setrlimit(RLIMIT_FSIZE, &little);
    assert_true(fwrite(big, 1, sizeof big, out.file) < sizeof big);
    errno = 0;
    rc = base_file_commit(&out, &err);
    setrlimit(RLIMIT_FSIZE, &before);
    says(rc, BASE_EIO, &err, "out: write failed: File too large");
    assert_string_equal(get("out"), "old");
    assert_int_equal(access(out.tmp_path, F_OK), -1);
}

static void leftovers_of_the_dead_are_swept(void **state)
{
    (void)state;
    struct base_err err = {0};
    char own[64];
    snprintf(own, sizeof own, "folder/.tmp-lull%ld-7.x", (long)getpid());
    const char *const kept[] = {own,
                                "folder/.tmp-lullx",
                                "folder/.tmp-lull-5-x",
                                "folder/.tmp-lull999999999x",
                                "folder/tmp-lull999999999-0.x",
                                "folder/.tmp-lull999999999-1.locked"};
    static const char *const swept[] = {"folder/.tmp-lull999999999-0.x", "folder/.tmp-lull999999998-3."};
    for (size_t i = 0; i < 6; i++)
        put(kept[i], "");
    for (size_t i = 0; i < 2; i++)
        put(swept[i], "");
    int fd = open(kept[5], O_RDWR); /* as by a process elsewhere */
    assert_int_equal(flock(fd, LOCK_EX), 0);
    assert_int_equal(base_file_check_output("folder/x", &err), 0);
    for (size_t i = 0; i < 6; i++)
        assert_int_equal(access(kept[i], F_OK), 0);
    for (size_t i = 0; i < 2; i++)
        assert_int_equal(access(swept[i], F_OK), -1);
    close(fd);
    assert_int_equal(base_file_check_output("folder/x", &err), 0);
    assert_int_equal(access(kept[5], F_OK), -1);
}

static void inside_or_not(void **state)
{
    (void)state;
    mkdir("folder/deep", 0777);
    static const struct {
        const char *path, *folder;
        int inside;
    } cases[] = {{"folder/x", "folder", 1},
                 {"folder/deep/x", "folder", 1},
                 {"x", "folder", 0},
                 {"folder/../x", "folder", 0},
                 {"folder/deep/../x", "folder", 1},
                 {"x", ".", 1},
                 {"folder/x", "folder/deep", 0},
                 {"x", "/", 1},
                 {"x", "missing", 0},
                 {"missing/x", ".", 0},
                 {"folder/back", "folder", 1},
                 {"loop", ".", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        if (base_file_is_inside(cases[i].path, cases[i].folder) != cases[i].inside)
            fail_msg("%s in %s", cases[i].path, cases[i].folder);
}

/* Two names, what they are of, and what was there before. */
static void one_file_or_two(void **state)
{
    (void)state;
    struct base_err err = {0};
    char here[200];
    assert_true(mkdir("place", 0777) == 0 && symlink("place", "way") == 0 && symlink("../later", "place/link") == 0);
    put("place/there", "x");
    assert_true(link("place/there", "twin") == 0 && symlink("place/there", "soft") == 0);
    snprintf(here, sizeof here, "%s/new", dir);
    static const char *const same[][2] = {{"new", "new"},        {"new", "./new"},        {"place/new", "way/new"},
                                          {"way/../new", "new"}, {"place/there", "twin"}, {"soft", "way/there"},
                                          {"soft", "twin"},      {"place/link", "later"}, {"way/link", "./later"}};
    static const char *const other[][2] = {{"new", "place/new"},     {"new", "New"},   {"place/there", "place/new"},
                                           {"place/there", "there"}, {"loop", "loop"}, {"missing/a", "missing/a"}};
    for (size_t i = 0; i < sizeof same / sizeof same[0]; i++)
        if (!base_file_is_same(same[i][0], same[i][1]) || !base_file_is_same(same[i][1], same[i][0]))
            fail_msg("%s is %s", same[i][0], same[i][1]);
    for (size_t i = 0; i < sizeof other / sizeof other[0]; i++)
        if (base_file_is_same(other[i][0], other[i][1]) || base_file_is_same(other[i][1], other[i][0]))
            fail_msg("%s is not %s", other[i][0], other[i][1]);
    assert_true(base_file_is_same("new", here));

    struct base_outputs out = {0};
    assert_int_equal(base_outputs_add(&out, "preview", NULL, &err), 0);
    assert_true(base_outputs_add(&out, "preview", "way/new", &err) == 0 && base_outputs_add(&out, "map", "new", &err) == 0);
    says(base_outputs_add(&out, "report", "place/new", &err), BASE_EINVAL, &err,
         "--report place/new: the same file as --preview way/new, one of the two would be lost");
    says(base_outputs_add(&out, "report", "missing/x", &err), BASE_EIO, &err,
         "missing/x: cannot write there: No such file or directory");
    assert_int_equal(out.count, 2);

    struct base_inputs in = BASE_INPUTS_EMPTY;
    assert_true(base_inputs_add(&in, "twin", &err) == 0 && base_outputs_protect(&out, &in, &err) == 0);
    assert_int_equal(base_outputs_add(&out, "checkpoint", "soft", &err), 0);
    says(base_outputs_protect(&out, &in, &err), BASE_EINVAL, &err, "soft: this is an input (twin), it would be overwritten");
    assert_int_equal(base_outputs_protect_folder("place", &in, &err), 0);
    base_inputs_release(&in);
    struct base_inputs data = BASE_INPUTS_EMPTY; /* a folder of them */
    assert_int_equal(base_inputs_add(&data, "place", &err), 0);
    says(base_outputs_protect(&out, &data, &err), BASE_EINVAL, &err, "way/new: this is inside its data, place");
    mkdir("place/deep", 0777);
    static const char *const in_place[] = {"place",      "way/",        "place/deep",       "way/deep//",
                                           "place/none", "place/none/", "./place/deep/more"};
    for (size_t i = 0; i < sizeof in_place / sizeof in_place[0]; i++)
        if (base_outputs_protect_folder(in_place[i], &data, &err) != BASE_EINVAL && i < 6)
            fail_msg("%s is in place", in_place[i]);
    assert_int_equal(base_outputs_protect_folder(".", &data, &err), 0);
    assert_int_equal(base_outputs_protect_folder("elsewhere", &data, &err), 0);
    base_inputs_release(&data);

    static const struct base_file_kind kind = {"diary", {'D', 'I', 'A', 'R', 'Y', '-', '-', '1'}};
    put("diary", "DIARY--1 and more");
    put("short", "DIARY--");
    put("nothing", "");
    assert_true(base_file_check_kind(NULL, &kind, &err) == 0 && base_file_check_kind("none", &kind, &err) == 0);
    assert_true(base_file_check_kind("diary", &kind, &err) == 0 && base_file_check_kind("nothing", &kind, &err) == 0);
    says(base_file_check_kind("short", &kind, &err), BASE_EINVAL, &err,
         "short: not a diary, it would be replaced; choose another name");
    says(base_file_check_kind("soft", &kind, &err), BASE_EINVAL, &err,
         "soft: not a diary, it would be replaced; choose another name");
}

/* --- inputs -------------------------------------------------------------------------------------------------------------- */

static void inputs_are_a_set(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_inputs in = BASE_INPUTS_EMPTY;
    char name[16];
    uint32_t crc = 1;
    assert_int_equal(base_inputs_crc32(&in, &crc, &err), 0);
    assert_int_equal(crc, 0);
    for (int i = 0; i < 80; i++) { /* twice each, in disorder */
        snprintf(name, sizeof name, "f%02d", i * 7 % 40);
        assert_int_equal(base_inputs_add(&in, name, &err), 0);
    }
    assert_true(in.count == 40 && in.room >= 40);
    for (int i = 0; i < 40; i++) {
        snprintf(name, sizeof name, "f%02d", i);
        assert_string_equal(in.paths[i], name);
    }
    says(base_inputs_crc32(&in, &crc, &err), BASE_EIO, &err, "f00: No such file or directory");
    base_inputs_release(&in);
    assert_true(in.count == 0 && in.room == 0 && !in.paths);

    static char big[150000];
    for (size_t i = 0; i + 1 < sizeof big; i++)
        big[i] = (char)('a' + i % 23);
    put("b", big);
    put("a", "first");
    assert_true(base_inputs_add(&in, "b", &err) == 0 && base_inputs_add(&in, "a", &err) == 0);
    uint32_t expected =
        (uint32_t)crc32(crc32(0, (const unsigned char *)"first", 5), (const unsigned char *)big, sizeof big - 1);
    assert_int_equal(base_inputs_crc32(&in, &crc, &err), 0);
    assert_int_equal(crc, expected);
    assert_int_equal(base_inputs_protect(&in, NULL, &err), 0);
    assert_int_equal(base_inputs_protect(&in, "missing", &err), 0);
    assert_int_equal(base_inputs_protect(&in, "five", &err), 0);
    assert_int_equal(link("a", "hard"), 0);
    says(base_inputs_protect(&in, "hard", &err), BASE_EINVAL, &err, "hard: this is an input (a), it would be overwritten");
    says(base_inputs_protect(&in, "./b", &err), BASE_EINVAL, &err, "./b: this is an input (b), it would be overwritten");
    base_inputs_release(&in);
}

/* --- locks --------------------------------------------------------------------------------------------------------------- */

static void one_process_holds_a_folder(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_lock lock, zero = {0};
    int ready[2], done[2];
    char byte;
    base_lock_release(&zero);
    assert_int_equal(base_lock_folder(&lock, "folder", &err), 0);
    assert_true(lock.fd > 0 && access("folder/.lock", F_OK) == 0 && fcntl(lock.fd, F_GETFD) & FD_CLOEXEC);
    assert_string_equal(lock.path, "folder/.lock");
    base_lock_release(&lock);
    base_lock_release(&lock);
    assert_true(lock.fd == 0 && access("folder/.lock", F_OK) == -1);
    says(base_lock_folder(&lock, "missing", &err), BASE_EIO, &err, "missing/.lock: No such file or directory");
    assert_int_equal(lock.fd, 0);
    assert_true(pipe(ready) == 0 && pipe(done) == 0);
    pid_t child = fork();
    if (child == 0) {
        byte = base_lock_folder(&lock, "folder", &err) == 0 ? 'y' : 'n';
        if (write(ready[1], &byte, 1) == 1 && read(done[0], &byte, 1) == 1)
            base_lock_release(&lock);
        _exit(0);
    }
    assert_true(read(ready[0], &byte, 1) == 1 && byte == 'y');
    says(base_lock_folder(&lock, "folder", &err), BASE_EINVAL, &err, "folder: process %ld is writing there", (long)child);
    assert_true(lock.fd == 0 && write(done[1], "x", 1) == 1 && waitpid(child, NULL, 0) == child);
    assert_int_equal(base_lock_folder(&lock, "folder", &err), 0);
    base_lock_release(&lock);
    assert_int_equal(symlink("x", "folder/.lock"), 0);
    says(base_lock_folder(&lock, "folder", &err), BASE_EIO, &err, "folder/.lock: Too many levels of symbolic links");
    unlink("folder/.lock");
    for (int i = 0; i < 2; i++) {
        close(ready[i]);
        close(done[i]);
    }
}

/* --- JSON ---------------------------------------------------------------------------------------------------------------- */

static void json(void **state)
{
    (void)state;
    struct base_err err = {0};
    int failed = 0;
    cJSON *root = cJSON_CreateObject(), *list;
    base_json_number(root, "a", 0.25, &failed);
    base_json_number(root, "n", (double)NAN, &failed);
    base_json_text(root, "t", "l\xe4t \"q\"", &failed);
    base_json_text(root, "no", NULL, &failed);
    base_json_bool(root, "y", 5, &failed);
    list = base_json_array(root, "l", &failed);
    base_json_number(list, NULL, -INFINITY, &failed);
    base_json_number(base_json_object(list, NULL, &failed), "x", 3, &failed);
    base_json_item(root, "i", cJSON_CreateNumber(7), &failed);
    assert_int_equal(failed, 0);
    assert_int_equal(base_json_write("j", root, 0, &err), 0);
    assert_string_equal(
        get("j"), "{\n\t\"a\":\t0.25,\n\t\"n\":\tnull,\n\t\"t\":\t\"l?t \\\"q\\\"\",\n\t\"no\":\tnull,\n\t\"y\":\ttrue,\n"
                  "\t\"l\":\t[null, {\n\t\t\t\"x\":\t3\n\t\t}],\n\t\"i\":\t7\n}\n");
    says(base_json_write("j", root, 1, &err), BASE_ENOMEM, &err, "out of memory (j)");
    assert_null(base_json_object(NULL, "x", &failed)); /* into what could not be made */
    assert_int_equal(failed, 1);
    failed = 0;
    base_json_item(root, "x", NULL, &failed);
    assert_int_equal(failed, 1);
    cJSON_Delete(root);
}

/* --- numbers and pictures ------------------------------------------------------------------------------------------------ */

static void small_floats(void **state)
{
    (void)state;
    static const struct {
        float x;
        uint16_t bits;
    } cases[] = {{0, 0},
                 {-0.0f, 0x8000},
                 {1, 0x3f80},
                 {-2.5f, 0xc020},
                 {1.00390625f, 0x3f80},
                 {1.01171875f, 0x3f82},
                 {1.0039064f, 0x3f81},
                 {INFINITY, 0x7f80},
                 {-INFINITY, 0xff80},
                 {3.4028235e38f, 0x7f80},
                 {3.38e38f, 0x7f7e}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_int_equal(base_f32_to_bf16(cases[i].x), cases[i].bits);
    assert_true(base_bf16_to_f32(0x4049) == 3.140625f && isnan(base_bf16_to_f32(base_f32_to_bf16(NAN))));
    assert_true(base_f16_to_f32(0x7c00) == INFINITY && base_f16_to_f32(0xfc00) == -INFINITY &&
                isnan(base_f16_to_f32(0x7c01)));
    assert_true(base_f16_to_f32(0x8001) == -0x1p-24f && base_f16_to_f32(0x0400) == 0x1p-14f &&
                signbit(base_f16_to_f32(0x8000)));
    assert_true(base_f64_to_f16((double)NAN) == 0x7e00 && base_f64_to_f16(-(double)INFINITY) == 0xfc00 &&
                base_f64_to_f16(0x1p-25) == 0);
    assert_true(base_f64_to_f16(0x1.8p-24) == 2 && base_f64_to_f16(0x1.ff8p-15) == 0x3ff &&
                base_f64_to_f16(0x1.ffcp-15) == 0x400);
    assert_true(base_f32_to_f16(1.0f) == 0x3c00 && base_f64_to_f16(65519.99) == 0x7bff && base_f64_to_f16(-65520) == 0xfc00);
    static const uint8_t bytes[9] = {1, 2, 3, 0x84, 5, 6, 7, 0x88, 9};
    uint8_t out[8];
    assert_true(base_get_u32(bytes) == 0x84030201u && base_get_u64(bytes) == 0x8807060584030201u);
    base_put_u32(out, 0x84030201u);
    assert_memory_equal(out, bytes, 4);
    base_put_u64(out, 0x8807060584030201u);
    assert_memory_equal(out, bytes, 8);
    assert_true(base_luminance(1, 0, 0) == 0.2126729 && base_luminance(0, 1, 0) == 0.7151522 &&
                base_luminance(0, 0, 1) == 0.0721750);
    assert_true(fabs(base_srgb_oetf(0.0031308) - 0.04045) < 1e-5 && fabs(base_srgb_oetf(0.5) - 0.7353570) < 1e-6 &&
                fabs(base_srgb_oetf(0.001) - 0.01292) < 1e-15);
    assert_true(fabs(base_srgb_eotf(0.5) - 0.2140411) < 1e-6 && fabs(base_srgb_eotf(0.01292) - 0.001) < 1e-15 &&
                base_srgb_eotf(1) == 1);
}

static void pictures(void **state)
{
    (void)state;
    struct base_err err = {0};
    static const uint8_t pixels[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    static const char colour[5] = {0, 0, 4, 2, 6}; /* PNG's colour types */
    for (int channels = 1; channels <= 4; channels++) {
        char *bytes;
        size_t size;
        assert_int_equal(pic_write_png("p.png", 2, 1, channels, pixels, &err), 0);
        assert_int_equal(base_file_read("p.png", 1 << 16, &bytes, &size, &err), 0);
        assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\2\0\0\0\1\x08", 25);
        assert_int_equal(bytes[25], colour[channels]);
        free(bytes);
    }
    static const int bad[][3] = {{0, 1, 1}, {1, 0, 1}, {1, 1, 0}, {1, 1, 5}, {INT32_MAX, 1, 1}, {INT32_MAX / 3, 1, 4}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        says(pic_write_png("q.png", bad[i][0], bad[i][1], bad[i][2], pixels, &err), BASE_EINVAL, &err,
             "q.png: cannot write %dx%d pixels of %d channels as PNG", bad[i][0], bad[i][1], bad[i][2]);
    assert_int_equal(access("q.png", F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_files),
        cmocka_unit_test(what_cannot_be_written),
        cmocka_unit_test(outputs_appear_when_they_are_whole),
        cmocka_unit_test(permissions_of_the_old_file_stay),
        cmocka_unit_test(a_failed_write_keeps_the_old_file),
        cmocka_unit_test(leftovers_of_the_dead_are_swept),
        cmocka_unit_test(inside_or_not),
        cmocka_unit_test(inputs_are_a_set),
        cmocka_unit_test(one_process_holds_a_folder),
        cmocka_unit_test(json),
        cmocka_unit_test(small_floats),
        cmocka_unit_test(pictures),
        cmocka_unit_test(one_file_or_two),
    };
    return cmocka_run_group_tests_name("files", tests, setup, teardown);
}
