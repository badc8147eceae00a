/* `ggn import DIR`: pictures of rising sample counts into block sequences. */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"
#include "base/interrupt.h"
#include "base/options.h"
#include "cli/commands.h"
#include "data/import.h"

struct options {
    const char *dir, *thresholds, *out;
    struct ggn_import_options how;
};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"output", 'o', "OUT", TO(out), .output = BASE_FOLDER, .needed = 1,
     .help = "data set to write, one folder per view (needed)"},
    {"thresholds", 't', "CSV", TO(thresholds), .input = BASE_FILE,
     .help = "human thresholds, name;t0;…;t15; (written as labels)"},
    {"block", 'b', "PIXELS", TO(how.block), 1, 4096, .help = "side of a block (200)"},
    {"allow-gaps", 'g', NULL, TO(how.allow_gaps), .help = "take evenly spaced levels of which some are missing"},
    {0}};

static void show_progress(void *data, const char *view, int done, int of)
{
    (void)data;
    fprintf(stderr, "\r%s: %d of %d images%s", view, done, of, done == of ? "\n" : "");
}

static int import_one(const struct options *o, const char *dir, struct base_err *err)
{
    char copy[4096], out[4096];
    int labelled = 0;
    snprintf(copy, sizeof copy, "%s", dir);
    for (size_t n = strlen(copy); n > 1 && copy[n - 1] == '/';)
        copy[--n] = '\0';
    int rc = base_file_join(out, o->out, base_file_name(copy), err);
    if (!rc && base_file_is_same(out, copy))
        rc = base_fail(err, BASE_EINVAL, "%s: this is the view itself; --output names another folder", out);
    if (!rc)
        rc = ggn_import_view(copy, out, &o->how, &labelled, err);
    if (!rc)
        printf("%s: %s\n", out, labelled ? "imported with thresholds" : "imported, no thresholds for it");
    return rc;
}

static int is_visible(const struct dirent *e) { return e->d_name[0] != '.'; }

/* Every view folder in the root, in order of name: a look at all, then the work, then what was left out. */
static int import_all(const struct options *o, struct base_err *err)
{
    struct dirent **entries;
    const int is_view = ggn_import_pictures(o->dir) > 1;
    int rc = 0, found = 0, n = scandir(o->dir, &entries, is_visible, alphasort);
    if (n < 0)
        return base_fail(err, BASE_EIO, "%s: %s", o->dir, strerror(errno));
    for (int i = 0; i < (is_view ? n : 3 * n) && !rc && !base_interrupted; i++) {
        char path[4096];
        struct stat st;
        if (base_file_join(path, o->dir, entries[i % n]->d_name, NULL) != 0 || stat(path, &st) != 0 || !S_ISDIR(st.st_mode))
            continue;
        const int pictures = ggn_import_pictures(path);
        if (is_view && pictures > 1)
            rc = base_fail(err, BASE_EINVAL, "%s: pictures of a view, and a folder of them: %s", o->dir, path);
        else if (pictures > 0 && !is_view && i < 2 * n)
            rc = i < n ? ggn_import_check(path, &o->how, err) : import_one(o, path, err);
        else if (pictures == 0 && !is_view && i < n && ggn_import_looks_numbered(path))
            rc = base_fail(err, BASE_EINVAL, "%s: none of its pictures is called NAME_00020.png (.jpg, .exr, .rawls)", path);
        else if (pictures == 0 && found && i >= 2 * n)
            fprintf(stderr, "ggn import: %s: no pictures of a view, left out\n", path);
        found += pictures > 0;
    }
    while (n > 0)
        free(entries[--n]);
    free(entries);
    if (!rc && is_view)
        return import_one(o, o->dir, err);
    if (!rc && !found)
        rc = base_fail(err, BASE_EINVAL, "%s: no NAME_00020.png (.jpg, .exr, .rawls) … in it or in its folders", o->dir);
    return rc;
}

int ggn_cmd_import(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "DIR",
        .args_min = 1,
        .args_max = 1,
        .args = offsetof(struct options, dir),
        .doc = "Reads pictures of rising sample counts (VIEW/NAME_00020.png …, .jpg, .exr or .rawls; DIR is one view or the "
               "folder of all) into block sequences, with the halves of their samples where there are any "
               "(NAME_half_00020.exr …, or the layer half). Running it again continues where it stopped."};
    struct options o = {.how = {.block = 200, .progress = isatty(2) ? show_progress : NULL}};
    struct ggn_thresholds thresholds = {0};
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (rc)
        return rc;
    base_interrupt_catch();
    if (o.thresholds) {
        rc = ggn_thresholds_read(o.thresholds, (int[2]){o.how.block, o.how.block}, &thresholds, err);
        o.how.thresholds = &thresholds;
    }
    int made = 0;
    if (!rc)
        rc = base_make_folder(o.out, &made, err);
    if (!rc)
        rc = import_all(&o, err);
    ggn_thresholds_release(&thresholds);
    if (rc && made)
        rmdir(o.out); /* goes only if nothing was imported */
    return !rc && base_interrupted ? GGN_EXIT_INTERRUPTED : rc;
}
