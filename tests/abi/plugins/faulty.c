/*
 * A criterion with history and lull.state/1 that is correct unless its parameter `fault` says otherwise: then it breaks one
 * rule of the contract, for the tests of lull-check. The faults are listed in tests/cli/lull_check_faults.sh.
 *
 * Rule: mean luminance of the block and a halo of one pixel at each check; stops when the last three means are close.
 */
#include <lull/criterion_kit.h>

#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

enum fault {
    NONE,
    LEAK,
    FILE_LEAK,
    WIDE_WRITE,
    FP_CONTROL,
    THREAD,
    BATCH_INDEX,
    REPEAT,
    NO_RESTART,
    GLOBAL_STATE,
    TIGHT_STRIDES,
    ONLY_F32,
    GLOBAL_SPP,
    KEEPS_POINTER,
    DIVIDES_BY_ZERO,
    PRINTS,
    EXITS,
    CRASHES_AT_1X1,
    ANY_KEY,
    ANY_VALUE,
    LOAD_SHORT,
    LOAD_DIRTY,
    ALLOCATES,
    RACE,
    NEXT_IN_PAST,
    READS_BEYOND,
    NO_PLANE_CHECK,
    TOUCHES_INSTANCE,
    UNCHECKED_MALLOC,
    STOPS_AT_0,
    HANGS,
    TWO_FRAMES,
    ANY_ID,
    RANDOM,
    SHORT_STRUCT,
    ANONYMOUS_KEY,
    SAVE_IGNORES,
    READS_LATER_FIELD,
    SHORT_DECISIONS,
    ANY_SCALE,
    FIRST_BLOCK_ONLY,
    MUTE,
    POSITIVE,
    FALSE_ALARM,
    DROPS_WHEN_REFUSED,
    TRUSTS_RECTANGLE,
    SHORT_KEYS_ONLY,
    SPINS,
    SAVES_NOTHING,
    SHORT_WRITER,
    FRAME_LEAK,
    RARE_LEAK,
    GROWING_LIST,
    LAZY_CACHE,
    FAULT_COUNT
};

enum { THRESHOLD, FIRST_SPP, FAULT, PARAM_COUNT };
enum { KEPT = 3 };

static const struct lull_param params[PARAM_COUNT] = {
    [THRESHOLD] = LULL_KIT_FLOAT("threshold", "0.01", 0, 1, "largest relative change of the mean"),
    [FIRST_SPP] = LULL_KIT_INT("first-spp", "4", 2, 1e6, "samples before the first check"),
    [FAULT] = LULL_KIT_INT("fault", "0", 0, FAULT_COUNT - 1, "the rule to break, 0 for none"),
};

/* What a block answered, by spp: the last KEPT checks. */
struct history {
    uint64_t spp[KEPT];
    double mean[KEPT];
    uint64_t count; /* checks so far */
};

struct lull_instance {
    struct lull_kit kit;
    struct history *history; /* owns, [kit.block_count] */
    uint32_t history_count;
    double most_pixels;            /* of a block of the frame */
    const struct lull_rect *rects; /* KEEPS_POINTER */
};

static struct history global_history[1024];
static double shared_scratch[2];

static enum fault fault_of(const struct lull_instance *in) { return in ? (enum fault)(int)in->kit.value[FAULT] : NONE; }

/* --- pixels ---------------------------------------------------------------------------------------------------------- */

static const struct lull_block *owner(const struct lull_view *view, int32_t x, int32_t y)
{
    for (uint32_t i = 0; i < view->all_count; i++) {
        const void *at = (const char *)view->all + (size_t)i * view->all_stride;
        const struct lull_block *b = at;
        if (x >= b->x0 && x < b->x1 && y >= b->y0 && y < b->y1)
            return b;
    }
    return NULL;
}

static double pixel(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, int32_t x,
                    int32_t y)
{
    struct lull_plane color = *lull_kit_plane(view, LULL_PLANE_COLOR);
    if (fault_of(in) == TIGHT_STRIDES) {
        color.stride_c = 4, color.stride_x = 12;
        color.stride_y = 12 * ((int64_t)view->x1 - view->x0);
    }
    if (fault_of(in) == ONLY_F32)
        color.type = LULL_TYPE_F32;
    if (fault_of(in) == GLOBAL_SPP && view->all)
        b = view->all;
    double rgb[1][3];
    lull_kit_read(view, &color, b, x, y, 1, 3, rgb);
    return in->kit.exposure * lull_kit_luminance(&in->kit, rgb[0]);
}

static double mean_of(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block, int *bad)
{
    int32_t halo = view->all ? 1 : 0;
    double sum = 0, count = 0;
    for (int32_t y = block->y0 - halo; y < block->y1 + halo; y++)
        for (int32_t x = block->x0 - halo; x < block->x1 + halo; x++) {
            int inside = x >= view->x0 && y >= view->y0 && x < view->x1 && y < view->y1;
            if (!inside && fault_of(in) != READS_BEYOND)
                continue;
            const struct lull_block *b = inside && view->all ? owner(view, x, y) : block;
            if (!b)
                continue;
            double v = pixel(in, view, b, x, y);
            if (isfinite(v)) {
                sum += v;
                count++;
            } else if (b->spp > 0) {
                *bad = 1;
            }
        }
    return count > 0 ? sum / count : 0;
}

/* --- judging ----------------------------------------------------------------------------------------------------------- */

/* Faults whose place is before the judgement. */
static void misbehave(const struct lull_instance *in, const struct lull_block *block)
{
    switch (fault_of(in)) {
#if defined(__SSE__)
    case FP_CONTROL: _mm_setcsr(_mm_getcsr() | 0x8040); break;
#endif
    case PRINTS:
        puts("hello");
        fflush(stdout);
        break;
    case CRASHES_AT_1X1:
        if (block->x1 - block->x0 == 1 && block->y1 - block->y0 == 1)
            abort();
        break;
    case ALLOCATES: {
        void *volatile memory = malloc(64); /* volatile: compilers leave out a malloc that is freed at once */
        free(memory);
        break;
    }
    case HANGS:
        for (;;)
            pause();
    case RACE: shared_scratch[0] += 1; break;
    default: break;
    }
}

static double change(const struct history *h)
{
    double low = h->mean[0], high = h->mean[0];
    for (int i = 1; i < KEPT; i++) {
        low = fmin(low, h->mean[i]);
        high = fmax(high, h->mean[i]);
    }
    return (high - low) / (fabs(high) + fabs(low) + 1e-9);
}

static struct history *history_of(const struct lull_instance *in, uint32_t id)
{
    return fault_of(in) == GLOBAL_STATE ? &global_history[id % 1024] : &in->history[id];
}

static void remember(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                     struct lull_decision *d)
{
    struct history *h = history_of(in, block->id);
    int bad = 0;
    uint64_t last = h->count > 0 ? h->spp[(h->count - 1) % KEPT] : UINT64_MAX;
    double mean = mean_of(in, view, block, &bad);
    if (fault_of(in) == KEEPS_POINTER)
        mean += in->rects[block->id].x0;
    if (block->spp != last || fault_of(in) == REPEAT) { /* the same question leaves no trace */
        h->spp[h->count % KEPT] = block->spp;
        h->mean[h->count % KEPT] = mean;
        h->count++;
    }
    d->flags |= bad ? LULL_DECISION_BAD_INPUT : 0;
}

/* 0, when the host likes, beyond what can be counted. */
static uint64_t later(uint64_t spp) { return spp < UINT64_MAX / 2 ? spp + spp / 2 + 2 : 0; }

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *d, uint32_t worker)
{
    (void)worker;
    misbehave(in, block);
    if (fault_of(in) == TRUSTS_RECTANGLE && lull_kit_pixels(block) > in->most_pixels)
        abort(); /* it would write beyond what it made for the frame's blocks */
    d->flags = 0;
    d->action = LULL_CONTINUE;
    if (fault_of(in) == STOPS_AT_0 && block->spp == 0)
        d->action = LULL_STOP;
    if (fault_of(in) == DIVIDES_BY_ZERO)
        d->error = 1 / (double)block->spp;
    remember(in, view, block, d);
    if (fault_of(in) == EXITS && (d->flags & LULL_DECISION_BAD_INPUT))
        exit(3);
    const struct history *h = history_of(in, block->id);
    if (h->count < KEPT || block->spp < in->kit.need.first_spp) {
        d->flags |= LULL_DECISION_TOO_EARLY;
        d->next_spp = later(block->spp);
        return;
    }
    d->error = change(h);
    if (fault_of(in) == RANDOM) {
        static unsigned calls;
        d->error += 1e-6 * calls++;
    }
    d->action = d->error <= in->kit.value[THRESHOLD] ? LULL_STOP : LULL_CONTINUE;
    d->next_spp = fault_of(in) == NEXT_IN_PAST ? block->spp : later(block->spp);
}

static const struct lull_kit_rule rule = {
    .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    .first_spp = "first-spp",
    .judge = judge,
};

/* --- functions of the table
 * ------------------------------------------------------------------------------------------------ */

static void *sleeper(void *arg)
{
    pause();
    return arg;
}

/* What is kept for ever, by the n-th call: little each time, at times, in a list that doubles; or a table of 60 entries and
 * something large once, late, which is no leak. */
static void keep_for_ever(enum fault fault)
{
    static void *volatile kept; /* volatile: compilers leave out a malloc that nobody uses */
    static void *list;
    static size_t n;
    n++;
    if (fault == FRAME_LEAK || (fault == RARE_LEAK && n % 7 == 0) || (fault == LAZY_CACHE && n <= 60))
        kept = malloc(8);
    if (fault == LAZY_CACHE && n == 97)
        kept = malloc(32800);
    if (fault == GROWING_LIST && (n & (n - 1)) == 0)
        list = realloc(list, 32 * n);
    (void)kept;
}

static void create_faults(struct lull_instance *in)
{
    pthread_t thread;
    if (fault_of(in) == RARE_LEAK || fault_of(in) == GROWING_LIST || fault_of(in) == LAZY_CACHE)
        keep_for_ever(fault_of(in));
    if (fault_of(in) == LEAK)
        in->rects = malloc(40);
    if (fault_of(in) == FILE_LEAK)
        (void)!open("/dev/null", O_RDONLY);
    if (fault_of(in) == THREAD && pthread_create(&thread, NULL, sleeper, NULL) == 0)
        pthread_detach(thread);
}

/* 1 if the pairs choose this fault: for what happens before an instance exists. */
static int chosen(const struct lull_pair *pairs, uint32_t count, enum fault fault)
{
    double number;
    return count > 0 && pairs && pairs->key && strcmp(pairs->key, "fault") == 0 && lull_kit_number(pairs->value, &number) &&
           number == (double)fault;
}

static int has_long_key(const struct lull_pair *pairs, uint32_t count)
{
    for (uint32_t i = 0; i < count && pairs; i++)
        if (pairs[i].key && strlen(pairs[i].key) > 200)
            return 1;
    return 0;
}

static const struct lull_criterion criterion;

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    if (!instance)
        return lull_kit_fail(err, LULL_E_INVALID, "create: no place for the instance");
    struct lull_host whole = {.struct_size = sizeof whole};
    const uint32_t readable = pair_stride >= sizeof *pairs ? pair_count : 0;
    if (chosen(pairs, readable, SHORT_STRUCT) && host) {
        whole = *host;
        whole.struct_size = sizeof whole;
        host = &whole;
    }
    struct lull_instance *in = NULL;
    int32_t status = lull_kit_create(&rule, &criterion, sizeof *in, host, pairs, pair_count, pair_stride, NULL, &in, err);
    if ((status == LULL_E_KEY && chosen(pairs, readable, ANY_KEY)) ||
        (status == LULL_E_VALUE && chosen(pairs, readable, ANY_VALUE)))
        status = lull_kit_create(&rule, &criterion, sizeof *in, host, pairs, 1, pair_stride, NULL, &in, NULL);
    if (status == LULL_E_MEMORY && chosen(pairs, readable, UNCHECKED_MALLOC))
        in->history_count = 0;
    if (status != LULL_OK) {
        if (chosen(pairs, readable, TOUCHES_INSTANCE))
            *instance = NULL;
        if (chosen(pairs, readable, SHORT_KEYS_ONLY) && has_long_key(pairs, readable))
            abort(); /* it would print the key into a small array */
        if (chosen(pairs, readable, ANONYMOUS_KEY) && err)
            lull_kit_fail(err, status, "cannot");
        return status;
    }
    if (host == &whole)
        in->kit.host = NULL;
    in->kit.need.halo = 1;
    in->kit.need.bytes_per_block = sizeof(struct history);
    create_faults(in);
    *instance = in;
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    struct lull_frame lenient;
    if (frame && LULL_HAS(struct lull_frame, frame, rgb_to_xyz)) {
        lenient = *frame;
        if (fault_of(in) == TWO_FRAMES)
            lenient.flags |= LULL_FRAME_RESTART;
        if (fault_of(in) == NO_PLANE_CHECK)
            lenient.planes = ~UINT32_C(0);
        frame = &lenient;
    }
    int32_t status = lull_kit_frame_check(in, frame, err);
    if (status != LULL_OK && fault_of(in) == DROPS_WHEN_REFUSED && in->history)
        memset(in->history, 0, in->history_count * sizeof *in->history);
    if (status != LULL_OK)
        return status;
    in->most_pixels = 0;
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        in->most_pixels = fmax(in->most_pixels, ((double)r->x1 - r->x0) * ((double)r->y1 - r->y0));
    }
    struct history *history = calloc(frame->block_count, sizeof *history);
    if (!history)
        return lull_kit_fail(err, LULL_E_MEMORY, "out of memory");
    lull_kit_frame_open(in, frame);
    if (fault_of(in) == NO_RESTART && in->history && in->history_count == frame->block_count)
        memcpy(history, in->history, in->history_count * sizeof *history);
    free(in->history);
    in->history = history;
    in->history_count = frame->block_count;
    if (fault_of(in) == FRAME_LEAK)
        keep_for_ever(FRAME_LEAK);
    if (fault_of(in) == KEEPS_POINTER)
        in->rects = frame->blocks;
    return LULL_OK;
}

/* Faults of those who refuse: the status instead. */
static int32_t misanswer(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                         uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                         int32_t status, struct lull_error *err)
{
    const struct lull_plane *color;
    switch (fault_of(in)) {
    case SHORT_DECISIONS:
        return status == LULL_E_VERSION && decision_stride < sizeof *decisions
                   ? lull_kit_evaluate(in, view, blocks, block_stride, decisions, sizeof *decisions, count, err)
                   : status;
    case ANY_SCALE:
        color = status == LULL_E_PLANE && view->planes && view->plane_stride >= sizeof *color
                    ? lull_kit_plane(view, LULL_PLANE_COLOR)
                    : NULL;
        return color && color->scale == 0 ? LULL_OK : status;
    case FIRST_BLOCK_ONLY:
        return status == LULL_E_INVALID && blocks && decisions && count > 1
                   ? lull_kit_evaluate(in, view, blocks, block_stride, decisions, decision_stride, 1, err)
                   : status;
    case MUTE:
        if (err && err->struct_size == sizeof *err)
            err->message[0] = '\0';
        return status;
    case POSITIVE: return status == LULL_E_PLANE ? 5 : status;
    case SPINS:
        while (status == LULL_E_INVALID && blocks && block_stride >= sizeof *blocks && blocks->x0 > blocks->x1)
            pause(); /* it would go from x0 on until it meets x1 */
        return status;
    default: return status;
    }
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    if (fault_of(in) == ANY_ID && count > 0 && blocks && block_stride >= sizeof *blocks && blocks->id >= in->kit.block_count)
        return LULL_OK;
    int32_t status = lull_kit_evaluate(in, view, blocks, block_stride, decisions, decision_stride, count, err);
    if (status != LULL_OK)
        return misanswer(in, view, blocks, block_stride, decisions, decision_stride, count, status, err);
    if (fault_of(in) == FALSE_ALARM && count > 0)
        lull_kit_fail(err, LULL_E_INTERNAL, "all is well");
    if (fault_of(in) == WIDE_WRITE && count > 0 && decision_stride >= sizeof *decisions + 8)
        memset(decisions + 1, 0, 8);
    if (fault_of(in) == READS_LATER_FIELD)
        return *((const volatile char *)(view + 1)) == 0 ? LULL_OK : LULL_OK;
    if (fault_of(in) == BATCH_INDEX)
        for (uint32_t i = 0; i < count; i++) {
            void *at = (char *)decisions + (size_t)i * decision_stride;
            ((struct lull_decision *)at)->predicted_spp = 100 + (double)i;
        }
    return status;
}

static void end_frame(struct lull_instance *in)
{
    lull_kit_end_frame(in);
    if (fault_of(in) == NO_RESTART)
        return;
    free(in->history);
    in->history = NULL;
}

static void destroy(struct lull_instance *in)
{
    if (in)
        free(in->history);
    free(in);
}

/* --- state ------------------------------------------------------------------------------------------------------------- */

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    if (writer && fault_of(in) != SHORT_WRITER && !LULL_HAS(struct lull_writer, writer, write))
        return lull_kit_fail(err, LULL_E_VERSION, "save: the writer is older than version 1.0");
    if (!in || !writer || !writer->write)
        return lull_kit_fail(err, LULL_E_INVALID, "save: an argument is missing");
    uint32_t count = in->kit.block_count;
    if (count == 0 && fault_of(in) == SAVES_NOTHING)
        return LULL_OK;
    if (count == 0)
        return lull_kit_fail(err, LULL_E_STATE, "save: no frame is open");
    int32_t status = writer->write(writer, &count, sizeof count);
    if (status == LULL_OK)
        status = writer->write(writer, in->history, count * sizeof(struct history));
    if (fault_of(in) == SAVE_IGNORES)
        return LULL_OK;
    return status == LULL_OK ? LULL_OK : lull_kit_fail(err, status, "the history cannot be written");
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    uint32_t count;
    if (reader && !LULL_HAS(struct lull_reader, reader, read))
        return lull_kit_fail(err, LULL_E_VERSION, "load: the reader is older than version 1.0");
    if (!in || !reader || !reader->read)
        return lull_kit_fail(err, LULL_E_INVALID, "load: an argument is missing");
    if (in->kit.block_count == 0)
        return lull_kit_fail(err, LULL_E_STATE, "load: no frame is open");
    struct history *fresh = calloc(in->kit.block_count, sizeof *fresh);
    if (!fresh)
        return lull_kit_fail(err, LULL_E_MEMORY, "out of memory");
    if (fault_of(in) == LOAD_DIRTY)
        memset(in->history, 0, in->kit.block_count * sizeof *fresh);
    int32_t status = reader->read(reader, &count, sizeof count);
    if (status == LULL_OK && count != in->kit.block_count)
        status = LULL_E_IO;
    if (status == LULL_OK)
        status = reader->read(reader, fresh, in->kit.block_count * sizeof *fresh);
    if (status != LULL_OK) {
        free(fresh);
        return fault_of(in) == LOAD_SHORT ? LULL_OK : lull_kit_fail(err, LULL_E_IO, "the state does not fit the frame");
    }
    free(in->history);
    in->history = fresh;
    return LULL_OK;
}

static const struct lull_state state = {.struct_size = sizeof state, .save = save, .load = load};

static const void *get_extension(const char *id) { return strcmp(id, LULL_EXT_STATE) == 0 ? &state : NULL; }

static const struct lull_criterion criterion = {
    .struct_size = sizeof(struct lull_criterion),
    .api_minor = LULL_API_MINOR,
    .id = "faulty",
    .name = "For the tests of lull-check",
    .version = "1",
    .description = "Stops when the last three means of a block are close, or does something wrong.",
    .params = params,
    .param_count = PARAM_COUNT,
    .param_stride = sizeof(struct lull_param),
    .thread_level = LULL_THREADS_FULL,
    .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
    .create = create,
    .requirements = lull_kit_requirements,
    .begin_frame = begin_frame,
    .evaluate = evaluate,
    .end_frame = end_frame,
    .destroy = destroy,
    .get_extension = get_extension,
};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &criterion : NULL; }
