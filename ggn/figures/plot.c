#include "figures/plot.h"

#include <errno.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/files.h"

extern char **environ;

void ggn_plot_quote(FILE *script, const char *text)
{
    putc('\'', script);
    for (; *text != '\0'; text++) {
        if (*text == '\'')
            putc('\'', script);
        if (*text != '\n')
            putc(*text, script);
    }
    putc('\'', script);
}

void ggn_plot_palette(FILE *script, enum pic_colour_map map)
{
    fputs("set palette defined (", script);
    for (int i = 0; i <= 8; i++) {
        uint8_t rgb[3];
        pic_colour(map, i / 8.0, rgb);
        fprintf(script, "%s%d '#%02x%02x%02x'", i > 0 ? "," : "", i, rgb[0], rgb[1], rgb[2]);
    }
    fputs(")\n", script);
}

int ggn_plot_begin(struct ggn_plot *plot, const char *path, int width, int height, struct base_err *err)
{
    if (strlen(path) >= sizeof plot->path)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", path);
    strcpy(plot->path, path);
    int rc = base_file_tmp_name(path, plot->tmp_picture, sizeof plot->tmp_picture, err);
    if (rc)
        return rc;
    snprintf(plot->tmp_script, sizeof plot->tmp_script, "%s.gp", plot->tmp_picture);
    plot->script = fopen(plot->tmp_script, "w");
    if (!plot->script)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    fprintf(
        plot->script,
        "set encoding utf8\nset terminal pngcairo size %d,%d noenhanced font 'sans,11' background '#ffffff'\nset output ",
        width, height);
    ggn_plot_quote(plot->script, plot->tmp_picture);
    fputs("\nset border lc '#444444'\nset grid lc '#dddddd'\nset key noenhanced\nset datafile missing 'nan'\n",
          plot->script);
    return 0;
}

/* All of what a descriptor has to say, which is closed; its first line that says something is kept. */
static void read_complaint(int fd, char *line, size_t room)
{
    char text[512];
    FILE *from = fdopen(fd, "r");
    line[0] = '\0';
    while (from && fgets(text, sizeof text, from))
        if (line[0] == '\0' && text[strspn(text, " \n")] != '\0')
            snprintf(line, room, ": %.*s", (int)strcspn(text, "\n"), text);
    if (from)
        fclose(from);
    else
        close(fd);
}

/* Its standard error is a pipe, so that a failure is one line of ours. */
static int start_gnuplot(struct ggn_plot *plot, pid_t *pid, int *said)
{
    char *argv[] = {(char[]){"gnuplot"}, plot->tmp_script, NULL};
    posix_spawn_file_actions_t actions;
    int ends[2];
    if (pipe(ends) != 0)
        return errno;
    int bad = posix_spawn_file_actions_init(&actions);
    if (!bad) {
        bad = posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO) ||
                      posix_spawn_file_actions_addclose(&actions, ends[0]) ||
                      posix_spawn_file_actions_addclose(&actions, ends[1])
                  ? ENOMEM
                  : posix_spawnp(pid, argv[0], &actions, NULL, argv, environ);
        posix_spawn_file_actions_destroy(&actions);
    }
    close(ends[1]);
    if (bad)
        close(ends[0]);
    *said = ends[0];
    return bad;
}

static int run_gnuplot(struct ggn_plot *plot, struct base_err *err)
{
    char complaint[256];
    pid_t pid;
    int status, said = -1;
    int bad = start_gnuplot(plot, &pid, &said);
    if (bad != 0)
        return base_fail(err, BASE_EIO, "%s: gnuplot cannot be started: %s", plot->path, strerror(bad));
    read_complaint(said, complaint, sizeof complaint);
    while (waitpid(pid, &status, 0) < 0)
        if (errno != EINTR)
            return base_fail(err, BASE_EIO, "%s: gnuplot was lost: %s", plot->path, strerror(errno));
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        return base_fail(err, BASE_EIO, "%s: gnuplot failed%s", plot->path, complaint);
    return base_file_rename(plot->tmp_picture, plot->path, err);
}

int ggn_plot_end(struct ggn_plot *plot, int run, struct base_err *err)
{
    int rc = 0, bad = ferror(plot->script) != 0;
    bad |= fclose(plot->script) != 0;
    plot->script = NULL;
    if (run && bad)
        rc = base_fail(err, BASE_EIO, "%s: write failed", plot->path);
    else if (run)
        rc = run_gnuplot(plot, err);
    if (!run || rc)
        unlink(plot->tmp_picture);
    unlink(plot->tmp_script);
    return rc;
}
