/*
 * A criterion whose table, requirements and answers are set from outside, and which writes down what it is asked.
 *
 * LULL_PUPPET is a list of NAME=NUMBER, joined by commas (dials, below): one wrong number at a time finds where a check
 * begins to mind. LULL_WITNESS names a file: each instance appends a line when it is destroyed, and so does a failed create:
 * lives, calls, frames that were begun, questions, answers, frames left open, and a sum of all that it was given: every
 * field, and every pixel of every plane as it is stored. The sum does not depend on the order of calls.
 */
#include <lull/criterion_kit.h>

#include <stdatomic.h>
#include <time.h>

enum { ALL_PLANES = (1 << LULL_PLANE_COUNT) - 1, WORKERS_MOST = 64 };

static struct {
    double caps, level, minor, entries, far_entry, new_entry, names, claims;                  /* of the table */
    double flags, required, used, width, height, halo, first, bytes, unset, size;             /* requirements */
    double action, answer_flags, next, p, predicted, error, stop, drift, drift_p, from, late; /* answers */
    double key, value, code, message, touch;                                                  /* refusals */
} dial;

static const struct {
    const char *name;
    double *to, preset;
} dials[] = {
    {"caps", &dial.caps, 3},
    {"level", &dial.level, 2},
    {"minor", &dial.minor, 0},
    {"entries", &dial.entries, 1},
    {"far", &dial.far_entry, 0},
    {"new", &dial.new_entry, 0},
    {"names", &dial.names, 1},
    {"claims", &dial.claims, 0},
    {"flags", &dial.flags, 1},
    {"required", &dial.required, 1},
    {"used", &dial.used, ALL_PLANES},
    {"width", &dial.width, 0},
    {"height", &dial.height, 0},
    {"halo", &dial.halo, 0},
    {"first", &dial.first, 4},
    {"bytes", &dial.bytes, 100},
    {"unset", &dial.unset, 0},
    {"size", &dial.size, 0},
    {"action", &dial.action, -1},
    {"answer-flags", &dial.answer_flags, 0},
    {"next", &dial.next, 10},
    {"p", &dial.p, 0.5},
    {"predicted", &dial.predicted, 100},
    {"error", &dial.error, 1},
    {"stop", &dial.stop, 16},
    {"drift", &dial.drift, 0},
    {"drift-p", &dial.drift_p, 0},
    {"from", &dial.from, 0},
    {"late", &dial.late, 0},
    {"key", &dial.key, LULL_E_KEY},
    {"value", &dial.value, LULL_E_VALUE},
    {"code", &dial.code, 0},
    {"message", &dial.message, 1},
    {"touch", &dial.touch, 0},
};

static int witnessed;

static void set_dials(void)
{
    const char *text = getenv("LULL_PUPPET");
    witnessed = getenv("LULL_WITNESS") != NULL;
    for (size_t i = 0; i < sizeof dials / sizeof *dials; i++)
        *dials[i].to = dials[i].preset;
    while (text && *text) {
        size_t length = strcspn(text, "=");
        int known = 0;
        for (size_t i = 0; i < sizeof dials / sizeof *dials; i++)
            if (strlen(dials[i].name) == length && memcmp(dials[i].name, text, length) == 0)
                *dials[i].to = strtod(text + length + 1, NULL), known = 1;
        if (!known)
            abort();
        text += strcspn(text, ",");
        text += *text == ',';
    }
}

struct lull_instance {
    struct lull_kit kit;
    atomic_uint calls, begun, asked, answered;
    atomic_ullong sum;
    atomic_flag busy[WORKERS_MOST];
    unsigned session;
};

/* --- what it was given ---------------------------------------------------------------------------------------------------
 */

/* FNV-1a, finished so that sums of such numbers are worth something. */
static uint64_t hash(uint64_t h, const void *data, size_t size)
{
    for (size_t i = 0; i < size; i++)
        h = (h ^ ((const unsigned char *)data)[i]) * UINT64_C(0x100000001b3);
    h ^= h >> 32;
    return h * UINT64_C(0x9e3779b97f4a7c15);
}

static uint64_t hash_number(uint64_t h, double number) { return hash(h, &number, sizeof number); }

static uint64_t hash_block(uint64_t h, const struct lull_block *b)
{
    h = hash(h, &b->id, 2 * sizeof(uint32_t) + 4 * sizeof(int32_t) + 2 * sizeof(uint64_t));
    return hash_number(h, isnan(b->thread_s) ? -1 : b->thread_s);
}

static uint64_t hash_plane(uint64_t h, const struct lull_view *v, unsigned plane)
{
    const struct lull_plane *p = lull_kit_plane(v, plane);
    if (!p)
        return hash_number(h, plane);
    const int64_t size = p->type == LULL_TYPE_F64 ? 8 : p->type == LULL_TYPE_F16 ? 2 : 4;
    h = hash(h, &p->stride_x, sizeof *p - offsetof(struct lull_plane, stride_x));
    for (int32_t y = v->y0; y < v->y1; y++)
        for (int32_t x = v->x0; x < v->x1; x++)
            for (uint32_t c = 0; c < lull_kit_channels(plane); c++)
                h = hash(h, lull_kit_address(v, p, x, y) + c * p->stride_c, (size_t)size);
    return h;
}

static uint64_t hash_view(uint64_t h, const struct lull_view *v)
{
    h = hash(h, v, 6 * sizeof(uint32_t));
    h = hash(h, &v->plane_count, 2 * sizeof(uint32_t));
    h = hash_number(h, isnan(v->elapsed_s) ? -1 : v->elapsed_s);
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        h = hash_plane(h, v, p);
    h = hash(h, &v->all_count, 2 * sizeof(uint32_t));
    for (uint32_t i = 0; v->all && v->all_stride >= sizeof *v->all && i < v->all_count; i++)
        h = hash_block(h, lull_kit_at(v->all, v->all_stride, i));
    return h;
}

static uint64_t hash_frame(uint64_t h, const struct lull_frame *f)
{
    const size_t numbers = offsetof(struct lull_frame, planes);
    h = hash(h, f, 4 * sizeof(uint32_t));
    h = hash(h, &f->block_count, 2 * sizeof(uint32_t));
    h = hash(h, (const char *)f + numbers, sizeof *f - numbers);
    for (uint32_t i = 0; i < f->block_count; i++)
        h = hash(h, lull_kit_rect(f, i), sizeof(struct lull_rect));
    return h;
}

static uint64_t hash_host(uint64_t h, const struct lull_host *host)
{
    if (!host)
        return hash_number(h, 7);
    h = hash(h, host, 2 * sizeof(uint32_t));
    h = hash(h, &host->max_workers, 2 * sizeof(uint32_t));
    h = hash_number(h, (host->log != NULL) + 2 * (host->parallel_for != NULL) + 4 * (host->cancelled != NULL) +
                           8 * (host->get_extension != NULL));
    return host->name ? hash(h, host->name, strlen(host->name)) : h;
}

static void witness(const char *format, ...)
{
    const char *path = getenv("LULL_WITNESS");
    char line[300];
    va_list args;
    FILE *f = path ? fopen(path, "a") : NULL;
    if (!f)
        return;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    setvbuf(f, NULL, _IONBF, 0); /* whole lines, whoever else writes */
    fputs(line, f);
    fclose(f);
}

/* A call, its status and what it was given. */
static void note(struct lull_instance *in, const char *call, int32_t status, uint64_t given)
{
    uint64_t h = hash(hash(given, call, strlen(call)), &status, sizeof status);
    if (!in) {
        witness("0 1 0 0 0 0 %u\n", (uint32_t)(h >> 32));
        return;
    }
    atomic_fetch_add(&in->calls, 1);
    atomic_fetch_add(&in->sum, h);
}

/* --- answers
 * --------------------------------------------------------------------------------------------------------------- */

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    (void)view;
    if (worker >= lull_kit_workers(&in->kit) || worker >= WORKERS_MOST || atomic_flag_test_and_set(&in->busy[worker]))
        witness("worker %u is none or busy\n", worker); /* no line of numbers: seen */
    if (witnessed && in->kit.host && in->kit.host->parallel_for)
        nanosleep(&(struct timespec){.tv_nsec = 50000}, NULL); /* so that a second call with this worker meets it */
    atomic_fetch_add(&in->answered, 1);
    double n = (double)b->spp, end = fmax(dial.stop, dial.first);
    d->action = dial.action >= 0 && n >= dial.from ? (int32_t)dial.action : n >= end && n > 0 ? LULL_STOP : LULL_CONTINUE;
    d->flags = n >= dial.from ? (uint32_t)dial.answer_flags : 0;
    d->next_spp = (uint64_t)(n + dial.next);
    d->p_noisy = dial.p + dial.drift_p * in->session;
    d->predicted_spp = dial.predicted;
    d->error = dial.error * (1 + dial.drift * in->session);
    if (worker < WORKERS_MOST)
        atomic_flag_clear(&in->busy[worker]);
}

static const struct lull_kit_rule rule = {.judge = judge};

static const struct lull_param params[] = {
    LULL_KIT_INT("int", "3", -5, 1000, "an integer"),
    LULL_KIT_FLOAT("float", "0.5", -1, 1e30, "a number"),
    LULL_KIT_BOOL("bool", "0", "yes or no"),
    LULL_KIT_CHOICE("choice", "one", "one|two|three", "one of three"),
    LULL_KIT_FILE("file", NULL, "a file"),
};
enum { PARAM_COUNT = sizeof params / sizeof *params };

/* --- functions of the table
 * ------------------------------------------------------------------------------------------------ */

static struct lull_criterion criterion, another;

/* What a host offers is taken. */
static void use(const struct lull_host *host)
{
    if (host && host->log)
        host->log(host, LULL_LOG_DEBUG, "one line");
    if (host && host->get_extension && host->get_extension(host, "tests.nothing/1"))
        witness("an extension that nobody has\n");
}

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    static atomic_uint sessions;
    struct lull_instance *in = NULL;
    int32_t status = lull_kit_create(&rule, &criterion, sizeof *in, host, pairs, pair_count, pair_stride, NULL,
                                     instance ? &in : NULL, err);
    uint64_t given = pair_count * UINT64_C(31) + pair_stride;
    for (uint32_t i = 0; i < pair_count && (status == LULL_OK || status == LULL_E_KEY || status == LULL_E_VALUE); i++) {
        const struct lull_pair *pair = lull_kit_at(pairs, pair_stride, i);
        given = pair->key ? hash(given, pair->key, strlen(pair->key)) : given;
        given = pair->value ? hash(given, pair->value, strlen(pair->value)) : given;
    }
    if (status != LULL_OK) {
        note(NULL, "create", status, given);
        status = status == LULL_E_KEY ? (int32_t)dial.key : status == LULL_E_VALUE ? (int32_t)dial.value : status;
        if (err && err->struct_size >= sizeof *err && dial.message == 0)
            err->message[0] = '\0';
        if (err && err->struct_size >= sizeof *err)
            err->code += (int32_t)dial.code;
        if (dial.touch != 0 && instance)
            *instance = NULL;
        return status;
    }
    in->session = atomic_fetch_add(&sessions, 1);
    in->kit.need = (struct lull_requirements){.flags = (uint32_t)dial.flags,
                                              .planes_required = (uint32_t)dial.required,
                                              .planes_used = (uint32_t)dial.used,
                                              .block_width = (uint32_t)dial.width,
                                              .block_height = (uint32_t)dial.height,
                                              .halo = (uint32_t)dial.halo,
                                              .first_spp = (uint64_t)dial.first,
                                              .bytes_per_block = (uint64_t)dial.bytes};
    note(in, "create", status, hash_host(given, host));
    use(host);
    *instance = in;
    return LULL_OK;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *req, struct lull_error *err)
{
    static uint32_t calls;
    uint32_t hint = req && req->struct_size >= sizeof *req ? req->checks_hint : 0;
    int32_t status = lull_kit_requirements(in, req, err);
    if (status == LULL_OK) {
        req->checks_hint = dial.unset == 1 ? hint : dial.unset == 2 ? calls++ : 0;
        req->struct_size += (uint32_t)dial.size;
    }
    return status;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    int32_t status = lull_kit_begin_frame(in, frame, err);
    note(in, "begin_frame", status, status == LULL_OK ? hash_frame(1, frame) : 1);
    if (status == LULL_OK)
        atomic_fetch_add(&in->begun, 1);
    return status;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    struct lull_kit_batch batch = {in, view, blocks, decisions, block_stride, decision_stride, count};
    uint64_t given = count;
    if (witnessed && lull_kit_batch_check(&batch, NULL) == LULL_OK) {
        given = hash_view(given + block_stride * UINT64_C(1000) + decision_stride * UINT64_C(1000000), view);
        for (uint32_t i = 0; i < count; i++) {
            const struct lull_decision *d = (const void *)((const char *)decisions + (size_t)i * decision_stride);
            given = hash_block(given, lull_kit_at(blocks, block_stride, i));
            given = hash(given, d, offsetof(struct lull_decision, p_noisy));
            given = hash_number(given, isnan(d->p_noisy) + 2 * isnan(d->predicted_spp) + 4 * isnan(d->error));
        }
    }
    int32_t status = lull_kit_evaluate(in, view, blocks, block_stride, decisions, decision_stride, count, err);
    note(in, "evaluate", status, given);
    if (status == LULL_OK)
        atomic_fetch_add(&in->asked, 1);
    return status;
}

static void end_frame(struct lull_instance *in)
{
    note(in, "end_frame", in->kit.block_count > 0, 5);
    lull_kit_end_frame(in);
}

static void destroy(struct lull_instance *in)
{
    if (in)
        witness("1 %u %u %u %u %d %u\n", atomic_load(&in->calls), atomic_load(&in->begun), atomic_load(&in->asked),
                atomic_load(&in->answered), in->kit.block_count > 0, (uint32_t)(atomic_load(&in->sum) >> 32));
    free(in);
}

static const void *get_extension(const char *id)
{
    return dial.claims != 0 && strcmp(id, LULL_EXT_STATE) != 0 ? &rule : NULL;
}

static void set_table(void)
{
    criterion = (struct lull_criterion){.struct_size = sizeof criterion,
                                        .api_minor = (uint32_t)dial.minor,
                                        .id = "puppet",
                                        .name = dial.names == 2 ? "" : "For the tests of lull-check",
                                        .version = dial.names == 3 ? "" : "1",
                                        .description = dial.names == 4 ? "" : "Answers what it is told to.",
                                        .params = params,
                                        .param_count = PARAM_COUNT,
                                        .param_stride = sizeof *params,
                                        .thread_level = (int32_t)dial.level,
                                        .capabilities = (uint32_t)dial.caps,
                                        .create = create,
                                        .requirements = requirements,
                                        .begin_frame = begin_frame,
                                        .evaluate = evaluate,
                                        .end_frame = end_frame,
                                        .destroy = destroy,
                                        .get_extension = get_extension};
    another = criterion;
}

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    static int calls;
    if (calls == 0) {
        set_dials();
        set_table();
    }
    if (dial.new_entry != 0 && calls++ > dial.new_entry)
        return index == 0 ? calls % 2 ? &criterion : &another : NULL;
    calls++;
    if (dial.far_entry != 0 && (double)index == dial.far_entry)
        return &criterion;
    return index == 0 && dial.entries > 0 ? &criterion : NULL;
}
