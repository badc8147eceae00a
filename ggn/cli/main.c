/* `ggn`: looks the subcommand up and hands over. */
#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/commands.h"

#ifndef GGN_VERSION
#define GGN_VERSION "0.1.0"
#endif

struct command {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
};

#define COMMAND_ENTRY(name, help) {#name, ggn_cmd_##name, help},
static const struct command commands[] = {GGN_COMMANDS(COMMAND_ENTRY)};
#undef COMMAND_ENTRY

enum { N_COMMANDS = sizeof commands / sizeof commands[0] };

volatile sig_atomic_t ggn_cmd_interrupted;

static void on_interrupt(int signum)
{
    ggn_cmd_interrupted = 1;
    (void)signum;
}

void ggn_cmd_catch_interrupt(void)
{
    struct sigaction action = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};

    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

int ggn_cmd_fail(const char *command, const struct base_err *err)
{
    fprintf(stderr, "%s: %s\n", command, err->text);
    return err->code == BASE_EINVAL || err->code == BASE_EIO ? GGN_EXIT_BAD_INPUT : GGN_EXIT_FAILED;
}

/* import_sin3d is typed as import-sin3d. */
static int is_name(const char *typed, const char *name)
{
    while (*name && *typed == (*name == '_' ? '-' : *name))
        typed++, name++;
    return *name == '\0' && *typed == '\0';
}

struct choice {
    const struct command *command;
    int argc;
    char **argv;
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct choice *choice = state->input;

    switch (key) {
    case ARGP_KEY_ARG:
        for (int i = 0; i < N_COMMANDS && !choice->command; i++)
            if (is_name(arg, commands[i].name))
                choice->command = &commands[i];
        if (!choice->command)
            argp_error(state, "unknown command '%s'", arg);
        choice->argc = state->argc - state->next + 1;
        choice->argv = state->argv + state->next - 1;
        state->next = state->argc;
        return 0;
    case ARGP_KEY_NO_ARGS:
        argp_error(state, "a command is needed");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Adds the list of commands to `ggn --help`. */
static char *list_commands(int key, const char *text, void *input)
{
    (void)input;
    if (key != ARGP_KEY_HELP_POST_DOC)
        return (char *)(size_t)text;

    size_t room = 128, used = 0;
    for (int i = 0; i < N_COMMANDS; i++)
        room += strlen(commands[i].help) + 32;
    char *list = malloc(room);
    if (!list)
        return NULL;
    used += (size_t)snprintf(list, room, "Commands:\n");
    for (int i = 0; i < N_COMMANDS; i++) {
        char *name = list + used + 2;
        used += (size_t)snprintf(list + used, room - used, "  %-12s %s\n", commands[i].name, commands[i].help);
        for (; *name != ' '; name++)
            *name = *name == '_' ? '-' : *name;
    }
    snprintf(list + used, room - used, "\n`ggn COMMAND --help` says more.");
    return list;
}

int main(int argc, char **argv)
{
    static const struct argp argp = {
        .parser = parse,
        .args_doc = "COMMAND [OPTION...]",
        .doc = "Learned stopping criterion for path tracing: data, training, evaluation.\v",
        .help_filter = list_commands,
    };
    struct choice choice = {0};
    char name[64];

    argp_program_version = "ggn " GGN_VERSION;
    argp_err_exit_status = GGN_EXIT_BAD_INPUT;
    argp_parse(&argp, argc, argv, ARGP_IN_ORDER, NULL, &choice);

    snprintf(name, sizeof name, "ggn %s", choice.argv[0]);
    choice.argv[0] = name;
    int status = choice.command->run(choice.argc, choice.argv);
    if (fflush(stdout) || ferror(stdout)) {
        fprintf(stderr, "%s: cannot write standard output\n", name);
        return status ? status : GGN_EXIT_FAILED;
    }
    return status;
}
