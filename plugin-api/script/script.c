/*
 * Criteria that are Python files. Each becomes a table as every criterion has one; an instance of it is a python3 of its own
 * (base/process.h) that runs plugin-api/python/lull/script.py, to which a block's planes are written as estimates. Whatever
 * happens there is an error of the call. In a host that is Python, that very script answers in the host's process instead
 * (lull_script_answer_here).
 *
 * A table lives for ever, but for one whose file has changed and of which no instance is left: it becomes that of the file
 * as it is now. create is all that a table has no argument for: each has one of its own, of SCRIPTS in a process.
 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "script/script.h"

#include <lull/criterion_kit.h>

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>

#include "base/process.h"

enum {
    SCRIPTS = 64,
    TEXT = 1 << 16,
    SHOWN_MAX = 1 << 30
}; /* bytes: of text, and of a block's planes, which are all taken */
enum { OPEN, CHECK, CLOSE };
static const double OPEN_LIMIT_S = 60, GRACE_S = 5; /* the script's own alarm, which knows the line, comes first */

__asm__(".section .rodata\n"
        ".global lull_script_py\n"
        ".hidden lull_script_py\n"
        "lull_script_py:\n"
        ".incbin \"plugin-api/python/lull/script.py\"\n"
        ".byte 0\n"
        ".previous\n");
extern char lull_script_py[] __attribute__((visibility("hidden")));

/* The class Request of script.py. Behind it lies text (OPEN), or planes (CHECK): [height][width][channels] double of each
 * that there is, in the order of LULL_PLANE_. */
struct request {
    int32_t kind, code; /* code: LULL_E_, the answer */
    uint32_t instance;  /* OPEN's answer, not 0; of the process that answers */
    uint32_t planes;    /* CHECK: of which there are estimates; OPEN's answer: those required */
    struct lull_block block;
    double elapsed_s;
    struct lull_frame frame;
    /* CHECK's answer. */
    uint64_t next_spp;
    double error, predicted_spp;
    uint32_t stop;
    /* OPEN's answer. Besides, behind it, each with its NUL: id, version, name, description, and the name and default of each
     * parameter. */
    uint32_t planes_used, param_count;
    int32_t param_type[LULL_KIT_PARAM_MAX];
    uint32_t unused;
    uint64_t first_spp;
    double limit_s;
    char message[sizeof((struct lull_error *)0)->message];
};

/* One file as it was when it was found. */
struct script {
    struct lull_criterion table;
    struct lull_kit_rule rule;
    struct lull_param params[LULL_KIT_PARAM_MAX];
    struct script *older; /* owns, as somebody may still know its table: what the file was before */
    char *path;           /* owns; absolute */
    uint64_t first_spp;
    double limit_s; /* seconds for a check */
    uint32_t used;  /* instances */
    int has_spare;
    struct base_process spare; /* owns; what it was found by, for the first instance: a python3 takes its time to start */
    char words[TEXT];          /* what the table points to */
};

struct lull_instance {
    struct lull_kit kit;
    struct script *script;      /* borrows */
    lull_script_answer_fn here; /* NULL: the child answers */
    struct base_process child;
    struct lull_frame frame; /* the open one, without its blocks */
    uint32_t number;         /* where it is answered; 0: not there */
    uint32_t value_count;    /* in `opening` */
    char opening[TEXT];      /* what OPEN is told: the path and each parameter's value, each with its NUL */
};

static struct script *scripts[SCRIPTS]; /* owns; guarded, as the counts in there */
static pthread_mutex_t guard = PTHREAD_MUTEX_INITIALIZER;
static _Atomic(lull_script_answer_fn) answer_here;

void lull_script_answer_here(lull_script_answer_fn answer) { atomic_store(&answer_here, answer); }

/* --- asking ---------------------------------------------------------------------------------------------------------- */

static int cancelled(void *data)
{
    const struct lull_host *host = data;
    return host && host->cancelled && host->cancelled(host);
}

static int32_t ask_child(struct lull_instance *in, double limit_s, struct lull_error *err)
{
    char *named = getenv("LULL_PYTHON"), run[] = "-Ec", python[] = "python3";
    char *arguments[] = {named && *named ? named : python, run, lull_script_py, NULL};
    struct base_err e = {0};
    switch (base_process_ask(&in->child, arguments, limit_s + GRACE_S, cancelled, (void *)(uintptr_t)in->kit.host, &e)) {
    case 0: return LULL_OK;
    case BASE_ENOMEM: return lull_kit_fail(err, LULL_E_MEMORY, "%s", e.text);
    case BASE_ECANCELLED: return lull_kit_fail(err, LULL_E_CANCELLED, "%s", e.text);
    case BASE_EIO:
        return lull_kit_fail(err, LULL_E_IO,
                             "%s: %s (a criterion in Python needs a python3 with numpy; LULL_PYTHON names one)",
                             in->script->path, e.text);
    default: return lull_kit_fail(err, LULL_E_INTERNAL, "%s: %s", in->script->path, e.text);
    }
}

static int32_t ask(struct lull_instance *in, int32_t kind, double limit_s, struct lull_error *err)
{
    struct request *r = in->child.memory;
    char message[sizeof r->message];
    int32_t status = LULL_OK;
    r->kind = kind;
    r->code = LULL_E_INTERNAL;
    r->instance = in->number;
    memset(r->message, 0, sizeof r->message);
    if (in->here)
        in->here(r, in->child.bytes);
    else
        status = ask_child(in, limit_s, err);
    if (status != LULL_OK)
        return status;
    memcpy(message, r->message, sizeof message); /* the script may write there at any time */
    message[sizeof message - 1] = '\0';
    status = r->code;
    return status == LULL_OK ? status : lull_kit_fail(err, status < LULL_OK ? status : LULL_E_INTERNAL, "%s", message);
}

/* --- a script's own words -------------------------------------------------------------------------------------------- */

/* The text up to the next NUL; "" past the last one. */
static const char *next_text(const char **at, const char *end)
{
    const char *text = *at, *nul = text < end ? memchr(text, '\0', (size_t)(end - text)) : NULL;
    *at = nul ? nul + 1 : end;
    return nul ? text : "";
}

/* As OPEN takes it; value: of each parameter, NULL: of none. */
static int32_t write_opening(struct lull_instance *in, const char *const *value, struct lull_error *err)
{
    char *to = in->opening;
    const char *from = in->script->path;
    in->value_count = value ? in->script->table.param_count : 0;
    for (uint32_t i = 0; from; i++) {
        const size_t size = strlen(from) + 1;
        if (size >= (size_t)(in->opening + TEXT - to))
            return lull_kit_fail(err, LULL_E_VALUE, "the parameters have more than %d characters in all", TEXT);
        memcpy(to, from, size);
        to += size;
        from = i < in->value_count ? value[i] : NULL;
    }
    return LULL_OK;
}

/* Has the script read wherever it is answered, and copies `size` bytes of what it says of itself. */
static int32_t open_script(struct lull_instance *in, char *words, size_t size, struct lull_error *err)
{
    struct request *r = in->child.memory;
    in->number = 0;
    memcpy(r + 1, in->opening, TEXT);
    r->param_count = in->value_count;
    int32_t status = ask(in, OPEN, OPEN_LIMIT_S, err);
    if (status != LULL_OK)
        return status;
    in->number = r->instance;
    memcpy(words, r + 1, size);
    words[size - 1] = '\0';
    return in->number != 0 ? LULL_OK : lull_kit_fail(err, LULL_E_INTERNAL, "%s: no answer", in->script->path);
}

/* The same when it must be the script that was found. */
static int32_t open_again(struct lull_instance *in, struct lull_error *err)
{
    char words[256]; /* id and version are shorter */
    const char *at = words, *end = words + sizeof words;
    int32_t status = open_script(in, words, sizeof words, err);
    if (status != LULL_OK)
        return status;
    next_text(&at, end);
    if (strcmp(next_text(&at, end), in->script->table.version) == 0)
        return LULL_OK;
    in->number = 0;
    return lull_kit_fail(err, LULL_E_IO, "%s has changed since it was opened", in->script->path);
}

static int32_t start(struct lull_instance *in, struct script *s, struct lull_error *err)
{
    struct base_err e = {0};
    in->script = s;
    in->here = atomic_load(&answer_here);
    pthread_mutex_lock(&guard);
    const int has_spare = s->has_spare;
    if (has_spare)
        in->child = s->spare;
    s->has_spare = 0;
    pthread_mutex_unlock(&guard);
    if (has_spare)
        return LULL_OK;
    int rc = base_process_init(&in->child, "python3", &e);
    if (!rc)
        rc = base_process_resize(&in->child, sizeof(struct request) + TEXT, &e);
    return rc ? lull_kit_fail(err, LULL_E_MEMORY, "%s", e.text) : LULL_OK;
}

static void finish(struct lull_instance *in)
{
    if (in->here && in->number != 0)
        ask(in, CLOSE, 0, NULL);
    base_process_release(&in->child);
    free(in);
}

static int32_t create(int slot, const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                      uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err);
#define CREATE(i) \
    static int32_t create_##i(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, \
                              uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err) \
    { \
        return create(i, host, pairs, pair_count, pair_stride, instance, err); \
    }
#define NAME(i) create_##i,
#define EIGHT(X, n) X(n##0) X(n##1) X(n##2) X(n##3) X(n##4) X(n##5) X(n##6) X(n##7)
#define EACH(X) \
    EIGHT(X, 00) EIGHT(X, 01) EIGHT(X, 02) EIGHT(X, 03) EIGHT(X, 04) EIGHT(X, 05) EIGHT(X, 06) EIGHT(X, 07) /* octal */
EACH(CREATE)
static int32_t (*const creates[SCRIPTS])(const struct lull_host *, const struct lull_pair *, uint32_t, uint32_t,
                                         struct lull_instance **, struct lull_error *) = {EACH(NAME)};

static const struct lull_criterion form; /* what all tables have in common, below */

/* Fills the table from what the script has answered. */
static int32_t describe(struct script *s, const struct request *r, struct lull_error *err)
{
    const char *at = s->words, *end = s->words + TEXT;
    const uint32_t known = LULL_PLANE_BIT(LULL_PLANE_COUNT) - 1, count = r->param_count;
    s->table = form;
    s->table.id = next_text(&at, end);
    s->table.version = next_text(&at, end);
    s->table.name = next_text(&at, end);
    s->table.description = next_text(&at, end);
    s->table.params = s->params;
    s->table.param_count = count < LULL_KIT_PARAM_MAX ? count : LULL_KIT_PARAM_MAX;
    for (uint32_t i = 0; i < s->table.param_count; i++) {
        const int32_t type = r->param_type[i];
        const double most = type == LULL_PARAM_INT ? 1e15 : type == LULL_PARAM_FLOAT ? 1e300 : 0;
        const char *name = next_text(&at, end);
        s->params[i] = (struct lull_param){name, "set by the script", next_text(&at, end), NULL, -most, most, type, 0};
    }
    s->rule =
        (struct lull_kit_rule){.planes_required = r->planes & known, .planes_used = (r->planes | r->planes_used) & known};
    s->first_spp = r->first_spp;
    s->limit_s = r->limit_s;
    if (s->first_spp >= 1 && s->limit_s > 0 && s->limit_s < 1e7)
        return LULL_OK;
    return lull_kit_fail(err, LULL_E_INVALID, "%s: it says nonsense of itself", s->path);
}

/* Puts it where its create finds it, and takes it and its process, unless it is there. */
static int32_t keep(struct script **found, struct lull_instance *in, const struct lull_criterion **out,
                    struct lull_error *err)
{
    struct script *s = *found;
    int at = -1;
    for (int i = 0; i < SCRIPTS; i++) {
        struct script *other = scripts[i];
        const int same = other && strcmp(other->path, s->path) == 0;
        if (same && strcmp(other->table.version, s->table.version) == 0) {
            *out = &other->table;
            return LULL_OK;
        }
        if ((same && other->used == 0) || (!other && at < 0))
            at = i;
    }
    if (at < 0)
        return lull_kit_fail(err, LULL_E_UNSUPPORTED, "more than %d criteria in Python in one process", SCRIPTS);
    s->older = scripts[at];
    s->table.create = creates[at];
    scripts[at] = s;
    if (!in->here) {
        s->spare = in->child;
        s->has_spare = 1;
        in->child = (struct base_process)BASE_PROCESS_NONE;
    }
    *out = &s->table;
    *found = NULL;
    return LULL_OK;
}

static int32_t find(struct lull_instance *in, struct script *s, struct lull_error *err)
{
    int32_t status = start(in, s, err);
    if (status == LULL_OK)
        status = write_opening(in, NULL, err);
    if (status == LULL_OK)
        status = open_script(in, s->words, TEXT, err);
    return status == LULL_OK ? describe(s, in->child.memory, err) : status;
}

int32_t lull_script_find(const char *path, const struct lull_criterion **out, struct lull_error *err)
{
    struct lull_instance *in = calloc(1, sizeof *in);
    struct script *s = calloc(1, sizeof *s);
    int32_t status = LULL_E_MEMORY;
    if (in && s && (s->path = realpath(path, NULL))) {
        status = find(in, s, err);
        pthread_mutex_lock(&guard);
        status = status == LULL_OK ? keep(&s, in, out, err) : status;
        pthread_mutex_unlock(&guard);
        finish(in);
        in = NULL;
    } else {
        lull_kit_fail(err, status, "%s: no such file, or out of memory", path);
    }
    free(in);
    free(s ? s->path : NULL);
    free(s);
    return status;
}

/* --- the criterion --------------------------------------------------------------------------------------------------- */

static struct script *use(int slot)
{
    pthread_mutex_lock(&guard);
    struct script *s = scripts[slot];
    s->used++;
    pthread_mutex_unlock(&guard);
    return s;
}

static void leave(struct script *s)
{
    pthread_mutex_lock(&guard);
    s->used--;
    pthread_mutex_unlock(&guard);
}

static void destroy(struct lull_instance *in)
{
    if (!in)
        return;
    leave(in->script);
    finish(in);
}

static int32_t create(int slot, const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                      uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err)
{
    const char *value[LULL_KIT_PARAM_MAX];
    struct lull_instance *in = NULL;
    struct script *s = use(slot);
    int32_t status = lull_kit_create(&s->rule, &s->table, sizeof *in, host, pairs, pair_count, pair_stride, value,
                                     instance ? &in : NULL, err);
    if (status != LULL_OK) {
        leave(s);
        return status;
    }
    in->kit.need.first_spp = s->first_spp;
    status = start(in, s, err);
    if (status == LULL_OK)
        status = write_opening(in, value, err);
    if (status == LULL_OK)
        status = open_again(in, err);
    if (status == LULL_OK)
        *instance = in;
    else
        destroy(in);
    return status;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    struct base_err e = {0};
    size_t pixels = 0, bytes = sizeof(struct request);
    int32_t status = lull_kit_frame_check(in, frame, err);
    if (status != LULL_OK)
        return status;
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        const size_t n = (size_t)(r->x1 - r->x0) * (size_t)(r->y1 - r->y0);
        pixels = n > pixels ? n : pixels;
    }
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        if (in->kit.need.planes_used & LULL_PLANE_BIT(p))
            bytes += pixels * lull_kit_channels(p) * sizeof(double);
    if (bytes > SHOWN_MAX)
        return lull_kit_fail(err, LULL_E_UNSUPPORTED, "blocks of %zu pixels are too large for a criterion in Python",
                             pixels);
    if (bytes > in->child.bytes && base_process_resize(&in->child, bytes, &e) != 0)
        return lull_kit_fail(err, LULL_E_MEMORY, "%s", e.text);
    lull_kit_frame_open(in, frame);
    memcpy(&in->frame, frame, sizeof in->frame);
    in->frame.blocks = NULL;
    return LULL_OK;
}

/* Writes the block's planes behind the request, and counts pixels. */
static void show(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                 struct lull_kit_tally *tally)
{
    struct request *r = in->child.memory;
    struct lull_kit_span s;
    double *to[LULL_PLANE_COUNT], *next = (double *)(void *)(r + 1);
    lull_kit_span_begin(&s, view, block, in->kit.need.planes_used);
    r->block = *block;
    r->elapsed_s = view->elapsed_s;
    r->frame = in->frame;
    r->planes = s.planes;
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++) {
        to[p] = next;
        next += s.planes & LULL_PLANE_BIT(p) ? lull_kit_channels(p) * (size_t)lull_kit_pixels(block) : 0;
    }
    while (lull_kit_span_next(&s))
        for (int32_t i = 0; i < s.count; i++) {
            int bad = 0;
            for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
                for (uint32_t c = 0; s.planes & LULL_PLANE_BIT(p) && c < lull_kit_channels(p); c++) {
                    *to[p] = s.value[p][i][c];
                    bad |= !isfinite(*to[p]++);
                }
            tally->bad += bad;
            tally->valid += !bad;
        }
}

/* What the script has answered, as far as it can be. */
static int32_t decide(const struct lull_instance *in, const struct lull_block *block, struct lull_decision *decision,
                      struct lull_error *err)
{
    const struct request *r = in->child.memory;
    const uint64_t next_spp = r->next_spp;
    const double error = r->error, predicted_spp = r->predicted_spp;
    const int stop = r->stop != 0;
    if ((!stop && next_spp != 0 && next_spp <= block->spp) || error < 0 || predicted_spp < 0 || isinf(error))
        return lull_kit_fail(err, LULL_E_INTERNAL, "%s: no answer of this script's", in->script->path);
    decision->action = stop ? LULL_STOP : LULL_CONTINUE;
    decision->next_spp = stop ? 0 : next_spp;
    decision->error = error;
    decision->predicted_spp = predicted_spp;
    return LULL_OK;
}

/* A half of the samples that is none of them or all says nothing. */
static int is_early(const struct lull_kit *kit, const struct lull_block *block)
{
    const int halves = (kit->need.planes_required & LULL_PLANE_BIT(LULL_PLANE_HALF)) != 0;
    return block->spp < kit->need.first_spp || (halves && (block->half_spp == 0 || block->half_spp >= block->spp));
}

static int32_t judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                     struct lull_decision *decision, struct lull_error *err)
{
    struct lull_kit_tally tally = {.early = is_early(&in->kit, block)};
    if (!in->here && !base_process_runs(&in->child))
        in->number = 0;
    int32_t status = in->number != 0 || tally.early > 0 ? LULL_OK : open_again(in, err);
    if (status != LULL_OK)
        return status;
    if (tally.early == 0)
        show(in, view, block, &tally);
    if (tally.valid == 0) { /* there is nothing to ask about */
        lull_kit_verdict(&in->kit, block, &tally, (double)NAN, 0, 0, 1.5, decision);
        return LULL_OK;
    }
    decision->flags = tally.bad > 0 ? LULL_DECISION_BAD_INPUT : 0;
    status = ask(in, CHECK, in->script->limit_s, err);
    return status == LULL_OK ? decide(in, block, decision, err) : status;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    const struct lull_kit_batch batch = {in, view, blocks, decisions, block_stride, decision_stride, count};
    int32_t status = lull_kit_batch_check(&batch, err);
    for (uint32_t i = 0; i < count && status == LULL_OK; i++)
        status = judge(in, view, lull_kit_at(blocks, block_stride, i),
                       (struct lull_decision *)(void *)((char *)decisions + (size_t)i * decision_stride), err);
    return status;
}

static const struct lull_criterion form = {.struct_size = sizeof form,
                                           .api_minor = LULL_API_MINOR,
                                           .param_stride = sizeof(struct lull_param),
                                           .thread_level = LULL_THREADS_INSTANCE,
                                           .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
                                           .requirements = lull_kit_requirements,
                                           .begin_frame = begin_frame,
                                           .evaluate = evaluate,
                                           .end_frame = lull_kit_end_frame,
                                           .destroy = destroy,
                                           .get_extension = lull_kit_get_extension};
