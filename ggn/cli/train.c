/* `ggn train`: from a data set to a model file. */
#include <argp.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "cli/commands.h"
#include "train/train.h"

enum { KEY_PRESET = 256, KEY_INIT, KEY_RESUME, KEY_FIELD };

/* Numeric options: where they go and what they may be. */
enum kind { INTEGER, REAL };
struct field {
    const char *name;
    enum kind kind;
    size_t offset;
    double min, max;
    const char *help;
};
#define AT(member) offsetof(struct ggn_train_plan, member)
static const struct field fields[] = {
    {"window", INTEGER, AT(window), 2, 16, "images per window (6)"},
    {"kr", INTEGER, AT(k_r), 3, 128, "width of the denoiser (lull 8, paper 16)"},
    {"km", INTEGER, AT(k_m), 1, 128, "width of the feature map generator (lull 10, paper 20)"},
    {"kd", INTEGER, AT(k_d), 1, 64, "width of the discriminator (lull 32, paper 64)"},
    {"crop", INTEGER, AT(crop), 16, 1024, "side of the denoiser's training crops, pixels (lull 96)"},
    {"batch-denoiser", INTEGER, AT(batch_r), 1, 1024, "crops per denoiser step (16)"},
    {"batch", INTEGER, AT(batch), 1, 1024, "windows per step (lull 16, paper 64)"},
    {"steps-denoiser", INTEGER, AT(steps_r), 0, 1e8, "steps of the denoiser phase (lull 2000)"},
    {"steps", INTEGER, AT(steps), 1, 1e8, "steps of the generator and discriminator phase (lull 2000; paper: by epochs)"},
    {"epochs", INTEGER, AT(epochs), 1, 1e6, "passes over all windows, preset paper only (30)"},
    {"epoch-steps", INTEGER, AT(epoch_steps), 1, 1e8, "steps between validations and checkpoints (lull 100; paper: one pass)"},
    {"patience", INTEGER, AT(patience), 0, 1e6, "end after so many validations without a lower loss, 0 = never (lull 8)"},
    {"lr-denoiser", REAL, AT(lr_r), 1e-9, 1, "learning rate of the denoiser (lull 1e-3, paper 2e-4)"},
    {"lr", REAL, AT(lr), 1e-9, 1, "learning rate of generator and discriminator (lull 1e-3, paper 2e-4)"},
    {"difference", REAL, AT(difference), 0, 1000, "train on gain * (image - newest image), folded away on saving; 0 = off (lull 8)"},
    {"soft-labels", INTEGER, AT(soft_labels), 0, 1, "1: labels between 0 and 1 near the threshold (lull 1)"},
    {"jitter", REAL, AT(jitter), 0, 2, "octaves over which the exposure of a window is varied (lull 0.3)"},
    {"synthetic", INTEGER, AT(synthetic), 0, 63, "synthetic sequences per block, made from its half buffers (lull 1)"},
    {"extend", INTEGER, AT(extend), 0, 1, "1: continue recordings that end near their threshold with samples of the reference (lull 1)"},
    {"ratio", REAL, AT(data.ratio), 0, 10, "thin the recorded levels to at least this ratio, 0 = all (lull 1.1)"},
    {"validation-windows", INTEGER, AT(validation_windows), 1, 1e6, "most windows per validation (400)"},
    {"early-rate", REAL, AT(early_rate), 0, 1, "share of validation blocks that the threshold may stop early (0.02)"},
    {"threads", INTEGER, AT(threads), 0, 1024, "threads, 0 = all processors; the result does not depend on it (0)"},
};
enum { N_FIELDS = sizeof fields / sizeof fields[0] };

struct arguments {
    struct ggn_train_plan plan;
    int preset_given;
};

static int parse_number(const char *text, double *out)
{
    char *end;

    errno = 0;
    *out = strtod(text, &end);
    return end != text && !*end && !errno;
}

static void set_field(struct ggn_train_plan *plan, const struct field *f, const char *text, struct argp_state *state)
{
    double v;

    if (!parse_number(text, &v) || !(v >= f->min && v <= f->max) || (f->kind == INTEGER && v != (double)(long)v))
        argp_error(state, "--%s: '%s' is not %s in %g..%g", f->name, text, f->kind == INTEGER ? "an integer" : "a number", f->min, f->max);
    if (f->kind == INTEGER)
        *(int *)(void *)((char *)plan + f->offset) = (int)v;
    else
        *(double *)(void *)((char *)plan + f->offset) = v;
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct ggn_train_plan *plan = &((struct arguments *)state->input)->plan;
    double v;

    switch (key) {
    case 'd':
        plan->data.dir = arg;
        return 0;
    case 'o':
        plan->out = arg;
        return 0;
    case KEY_PRESET:
        return 0; /* read before everything else, because it sets the defaults */
    case KEY_INIT:
        plan->init = arg;
        return 0;
    case KEY_RESUME:
        plan->resume = 1;
        return 0;
    case 'V':
        plan->data.validation = arg;
        return 0;
    case 'T':
        plan->data.test = arg;
        return 0;
    case 'q':
        plan->progress = NULL;
        return 0;
    case 's':
        if (!parse_number(arg, &v) || !(v >= 0 && v <= 4294967295.0) || v != (double)(uint32_t)v)
            argp_error(state, "--seed: '%s' is not an integer in 0..4294967295", arg);
        plan->seed = (uint32_t)v;
        return 0;
    case ARGP_KEY_END:
        if (!plan->data.dir || !plan->out)
            argp_error(state, "--data and --out are needed");
        return 0;
    default:
        if (key >= KEY_FIELD && key < KEY_FIELD + N_FIELDS) {
            set_field(plan, &fields[key - KEY_FIELD], arg, state);
            return 0;
        }
        return ARGP_ERR_UNKNOWN;
    }
}

/* The preset decides the defaults that other options override, wherever it stands. Returns 0 for an unknown one. */
static int find_preset(int argc, char **argv, enum ggn_preset *preset)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--"); i++) {
        const char *value = !strncmp(argv[i], "--preset=", 9)          ? argv[i] + 9
                            : !strcmp(argv[i], "--preset") && argv[i + 1] ? argv[i + 1]
                                                                         : NULL;
        if (value && strcmp(value, "lull") && strcmp(value, "paper"))
            return 0;
        if (value)
            *preset = strcmp(value, "paper") ? GGN_PRESET_LULL : GGN_PRESET_PAPER;
    }
    return 1;
}

static const struct argp_option fixed_options[] = {
    {"data", 'd', "DIR", 0, "data set: a folder of recorded, labelled sequences (needed)", 0},
    {"out", 'o', "FILE", 0, "model file; FILE.ckpt, .csv, .png and .card.json lie beside it (needed)", 0},
    {"preset", KEY_PRESET, "NAME", 0, "lull (default) or paper: networks, procedure and defaults", 0},
    {"init", KEY_INIT, "FILE", 0, "start from this model", 0},
    {"resume", KEY_RESUME, NULL, 0, "continue from FILE.ckpt if it is there", 0},
    {"validation", 'V', "SCENE,...", 0, "validation scenes, over the data set's split.json", 0},
    {"test", 'T', "SCENE,...", 0, "test scenes, over the data set's split.json; they are not even read", 0},
    {"seed", 's', "N", 0, "seed of everything random (1)", 0},
    {"quiet", 'q', NULL, 0, "no progress on standard error", 0},
};
enum { N_FIXED = sizeof fixed_options / sizeof fixed_options[0] };

int ggn_cmd_train(int argc, char **argv)
{
    struct argp_option options[N_FIXED + N_FIELDS + 1] = {{0}};
    const struct argp argp = {.options = options, .parser = parse,
                              .doc = "Trains a stopping criterion on a data set of block sequences.\vThe same data, options and "
                                     "seed give the same model bytes, also after an interruption and --resume."};
    struct arguments a = {0};
    enum ggn_preset preset = GGN_PRESET_LULL;
    struct base_err err = {0};

    memcpy(options, fixed_options, sizeof fixed_options);
    for (int i = 0; i < N_FIELDS; i++)
        options[N_FIXED + i] = (struct argp_option){.name = fields[i].name, .key = KEY_FIELD + i, .arg = "N", .doc = fields[i].help, .group = 1};
    if (!find_preset(argc, argv, &preset)) {
        base_fail(&err, BASE_EINVAL, "--preset is lull or paper");
        return ggn_cmd_fail(argv[0], &err);
    }
    a.plan = ggn_train_plan_default(preset);
    a.plan.progress = stderr;
    a.plan.interrupted = &ggn_cmd_interrupted;
    argp_parse(&argp, argc, argv, 0, NULL, &a);
    ggn_cmd_catch_interrupt();
    int rc = ggn_train(&a.plan, &err);
    if (rc == GGN_TRAIN_INTERRUPTED) {
        fprintf(stderr, "%s: interrupted; --resume continues from the last validation\n", argv[0]);
        return GGN_EXIT_INTERRUPTED;
    }
    return rc ? ggn_cmd_fail(argv[0], &err) : GGN_EXIT_OK;
}
