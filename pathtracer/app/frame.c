#include "frame.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "sample/rng.h"

enum { NAME_ROOM = 4096 };

/* Where the number's place begins in a text and how long it is; 0: there is none; -1: something else has a '%'. */
static int find_place(const char *text, size_t *begin, int *digits)
{
    const char *percent = strchr(text, '%'), *at = percent + 1;
    if (!percent)
        return 0;
    *begin = (size_t)(percent - text);
    *digits = 1;
    if (at[0] == '0' && at[1] >= '1' && at[1] <= '9') {
        *digits = at[1] - '0';
        at += 2;
    }
    return *at == 'd' && !strchr(at, '%') ? (int)(at + 1 - percent) : -1;
}

/* The same in a path: in the file's own name, else in its folders, whose other '%' are nothing but that. */
static int find_place_in_path(const char *path, size_t *begin, int *digits)
{
    const char *name = base_file_name(path);
    int length = find_place(name, begin, digits);
    if (length > 0)
        *begin += (size_t)(name - path);
    if (length == 0 && (length = find_place(path, begin, digits)) < 0)
        length = 0;
    return length;
}

int pt_frame_has_number(const char *path)
{
    size_t begin;
    int digits;
    return find_place_in_path(path, &begin, &digits) != 0;
}

int pt_frame_name(const char *pattern, int number, char *out, size_t room, struct base_err *err)
{
    size_t begin = 0;
    int digits = 1, length = find_place_in_path(pattern, &begin, &digits);
    if (length < 0)
        return base_fail(err, BASE_EINVAL, "%s: expected one %%d or %%04d in the place of the frame's number", pattern);
    if (length == 0)
        begin = strlen(pattern);
    int n = length ? snprintf(out, room, "%.*s%0*d%s", (int)begin, pattern, digits, number, pattern + begin + length)
                   : snprintf(out, room, "%s", pattern);
    return (size_t)n < room ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", pattern);
}

/* The frame's names of all files. */
static int name_files(struct pt_shot_frame *f, const struct pt_cli *cli, struct base_err *err)
{
    char *name = f->names;
    int rc = 0;
    for (int i = 0; i < PT_PATHS && !rc; i++, name += NAME_ROOM)
        if (cli->paths[i]) {
            rc = pt_frame_name(cli->paths[i], f->number, name, NAME_ROOM, err);
            f->paths[i] = name;
        }
    for (int i = 0; i < cli->outputs.count && !rc; i++, name += NAME_ROOM) {
        rc = pt_frame_name(cli->outputs.list[i].path, f->number, name, NAME_ROOM, err);
        if (!rc)
            rc = base_outputs_add(&f->outputs, cli->outputs.list[i].option, name, err);
    }
    return rc;
}

/* Of an image that has none: the scene's, in the current folder. */
static int name_image(struct pt_shot_frame *f, const char *scene, struct base_err *err)
{
    const char *name = base_file_name(scene), *dot = strrchr(name, '.');
    int n = dot ? (int)(dot - name) : (int)strlen(name);
    if (n > 1024 - 8)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", scene);
    f->names = malloc((size_t)n + sizeof ".exr");
    if (!f->names)
        return base_fail_nomem(err, "names");
    sprintf(f->names, "%.*s.exr", n, name);
    f->paths[PT_OUTPUT] = f->names;
    return 0;
}

uint32_t pt_frame_seed(uint32_t seed, int number)
{
    return pt_hash32((uint32_t)number + pt_hash32(seed + 0x9e3779b9u)); /* both hashes are bijections */
}

int pt_frame_alone(struct pt_shot_frame *f, const struct pt_cli *cli, struct base_err *err)
{
    *f = (struct pt_shot_frame){.number = -1,
                                .resume = cli->resume,
                                .seed = cli->render.integrator.seed,
                                .view = cli->load.view,
                                .outputs = cli->outputs};
    memcpy(f->paths, cli->paths, sizeof f->paths);
    return cli->action == PT_CLI_RENDER && !pt_cli_writes_image(cli) ? name_image(f, cli->paths[PT_SCENE], err) : 0;
}

int pt_frame_init(struct pt_shot_frame *f, const struct pt_cli *cli, int number, const struct pt_view *view,
                  struct base_err *err)
{
    const uint32_t seed = cli->render.integrator.seed;
    *f = (struct pt_shot_frame){.number = number,
                                .seed = cli->shot.same_seed ? seed : pt_frame_seed(seed, number),
                                .view = view ? *view : cli->load.view,
                                .names = calloc((size_t)(PT_PATHS + cli->outputs.count), NAME_ROOM)};
    if (!f->names)
        return base_fail_nomem(err, "names");
    if (!(f->view.fov_deg > 0))
        f->view.fov_deg = cli->load.view.fov_deg;
    return name_files(f, cli, err);
}

void pt_frame_release(struct pt_shot_frame *f) { free(f->names); }
