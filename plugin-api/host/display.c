/*
 * The live view. The renderer leaves copies of what has changed; a thread of its own sends them to a viewer as fast as that
 * takes them. Between the two stands one picture and a mark per block, so that a slow viewer gets the newest state of a
 * block instead of a queue of old ones, and memory is bounded.
 */
#include <errno.h>
#include <math.h>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <lull/criterion_kit.h>

#include "base/clock.h"
#include "base/options.h"
#include "host/frame.h"
#include "host/viewer.h"

/* Between two copies there is so much time, and more where a copy would take more than that share of it. */
static const double EVERY_S = 0.25, COPY_SHARE = 0.02;
/* Who does not answer is asked again after RETRY_S. Who takes no byte for so long is left, at the end sooner, and
 * FAREWELL_S after the end in any case. */
static const double CONNECT_S = 0.5, RETRY_S = 1.0, LAST_PATIENCE_S = 1.0, FAREWELL_S = 2.0, STEP_S = 0.05;
double viewer_patience_s = 5.0;

enum { TILE_PIXELS = 1 << 15 };

struct lull_host_display {
    const struct lull_host_blocks *blocks; /* borrows; the thread reads what never changes of it */
    struct addrinfo *address;              /* owns */
    size_t width;                          /* of the pixels that the blocks cover */
    double next_s;                         /* wall time of the next copy */
    pthread_t thread;
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t changed;
    float *rgb;                   /* owns; [height][width][3] */
    struct lull_host_block *seen; /* owns; [blocks], as they were copied; next_spp 0: never */
    uint8_t *is_new;              /* owns; [blocks] the viewer has not got */
    uint32_t new_count;
    int marks_are_new, over;
    double over_s;               /* wall time of the end */
    int socket;                  /* that the thread sends through; -1: no viewer */
    struct viewer_packet packet; /* of the thread */
};

/* A connection to somebody who may be slow, hostile or gone. */

/* Cuts "HOST", "HOST:PORT" or "[IPv6]:PORT" into host and port, which stays where none is named; an IPv6 address without
 * brackets has none. 0: that is no address. */
static int split(const char *text, char host[256], char port[8])
{
    const char *from = text, *end = strrchr(text, ':'), *named = NULL;
    if (text[0] == '[') {
        from = text + 1;
        end = strchr(text, ']');
        if (!end || (end[1] != '\0' && end[1] != ':'))
            return 0;
        named = end[1] == ':' ? end + 2 : NULL;
    } else if (end && strchr(text, ':') == end)
        named = end + 1;
    else
        end = text + strlen(text);
    int64_t number;
    if (end == from || end - from >= 256 || (named && !base_parse_integer(named, 1, 65535, &number)))
        return 0;
    snprintf(host, 256, "%.*s", (int)(end - from), from);
    if (named)
        snprintf(port, 8, "%d", (int)number);
    return 1;
}

/* May wait for a name server. *out is freed with freeaddrinfo. */
static int32_t find_address(const char *text, struct addrinfo **out, struct lull_error *err)
{
    char host[256], port[8] = "14158";
    const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
    if (!split(text, host, port))
        return lull_error_set(err, LULL_E_INVALID, "%.200s: expected HOST or HOST:PORT, the port from 1 to 65535", text);
    int code = getaddrinfo(host, port, &hints, out);
    if (code != 0)
        return lull_error_set(err, LULL_E_INVALID, "%.200s: no such host (%s)", text, gai_strerror(code));
    return LULL_OK;
}

/* Until the socket can be written to; 0: not within wait_s. */
static int wait_for(int socket, double wait_s)
{
    struct pollfd p = {.fd = socket, .events = POLLOUT};
    return poll(&p, 1, (int)(wait_s * 1e3)) == 1;
}

/* A socket that never blocks and that no child inherits; -1: nobody answered in time. */
static int connect_to(const struct addrinfo *to)
{
    for (; to; to = to->ai_next) {
        int fd = socket(to->ai_family, to->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, to->ai_protocol), failed = 0;
        socklen_t size = sizeof failed;
        if (fd < 0)
            continue;
        if (connect(fd, to->ai_addr, to->ai_addrlen) == 0)
            return fd;
        if (errno == EINPROGRESS && wait_for(fd, CONNECT_S) && getsockopt(fd, SOL_SOCKET, SO_ERROR, &failed, &size) == 0 &&
            failed == 0)
            return fd;
        close(fd);
    }
    return -1;
}

static int has_changed(const struct lull_host_block *b, const struct lull_host_block *seen)
{
    return seen->next_spp == 0 || b->spp != seen->spp || b->reason != seen->reason || b->asked_spp != seen->asked_spp;
}

static void copy_pixels(struct lull_host_display *d, const struct lull_view *view, const struct lull_block *block)
{
    const struct lull_host_blocks *blocks = d->blocks;
    struct lull_kit_span s;
    for (lull_kit_span_begin(&s, view, block, LULL_PLANE_BIT(LULL_PLANE_COLOR)); lull_kit_span_next(&s);) {
        float *to = d->rgb + 3 * ((size_t)(s.y - blocks->y0) * d->width + (size_t)(s.x - blocks->x0));
        for (size_t i = 0; i < (size_t)s.count; i++)
            for (size_t c = 0; c < 3; c++)
                to[3 * i + c] = (float)s.value[LULL_PLANE_COLOR][i][c];
    }
}

/* The lock is held. */
static int32_t copy(struct lull_host_display *d, const struct lull_host_view *v, struct lull_error *err)
{
    struct lull_host_shown shown;
    int32_t code = lull_host_show(d->blocks, v, 0, &shown, err);
    if (code != LULL_OK)
        return code;
    if (!shown.planes[LULL_PLANE_COLOR].data)
        code = lull_error_set(err, LULL_E_INVALID, "a live view needs the plane COLOR");
    for (uint32_t i = 0; i < d->blocks->count && code == LULL_OK; i++) {
        const struct lull_host_block *b = &d->blocks->list[i];
        const struct lull_block state = lull_host_state_of(b, i, 0);
        if (!has_changed(b, &d->seen[i]))
            continue;
        d->seen[i] = *b;
        d->marks_are_new = 1;
        if (b->spp > 0) {
            copy_pixels(d, &shown.view, &state);
            d->new_count += !d->is_new[i];
            d->is_new[i] = 1;
        }
    }
    lull_host_hide(&shown);
    pthread_cond_signal(&d->changed);
    return code;
}

int32_t lull_host_display_update(struct lull_host_display *d, const struct lull_host_view *view, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "display", d, "view", view, NULL);
    if (code != LULL_OK)
        return code;
    const double start_s = base_clock_wall_s();
    if (start_s < d->next_s || pthread_mutex_trylock(&d->lock) != 0)
        return LULL_OK;
    code = d->socket >= 0 ? copy(d, view, err) : LULL_OK;
    pthread_mutex_unlock(&d->lock);
    d->next_s = start_s + fmax(EVERY_S, (base_clock_wall_s() - start_s) / COPY_SHARE);
    return code;
}

/* The thread's side; the lock is held wherever nothing else is said. */

/* What a viewer that comes has not seen is all. */
static void forget(struct lull_host_display *d)
{
    if (d->socket >= 0)
        close(d->socket);
    d->socket = -1;
    d->new_count = 0;
    for (uint32_t i = 0; i < d->blocks->count; i++)
        d->new_count += d->is_new[i] = d->seen[i].spp > 0;
    d->marks_are_new = 1;
}

/* Whether to go on with somebody who has taken nothing for so long. */
static int is_patient(struct lull_host_display *d, double idle_s)
{
    pthread_mutex_lock(&d->lock);
    const int over = d->over;
    const double past_s = base_clock_wall_s() - d->over_s;
    pthread_mutex_unlock(&d->lock);
    return over ? fmin(idle_s, past_s) < LAST_PATIENCE_S && past_s < FAREWELL_S : idle_s < viewer_patience_s;
}

/* Without the lock, which is free meanwhile, and without SIGPIPE. */
static void send_packet(struct lull_host_display *d)
{
    size_t sent = 0;
    double taken_s = base_clock_wall_s();
    int gone = 0;
    pthread_mutex_unlock(&d->lock);
    while (sent < d->packet.size && !gone) {
        wait_for(d->socket, STEP_S);
        const ssize_t n = send(d->socket, d->packet.at + sent, d->packet.size - sent, MSG_NOSIGNAL);
        gone = n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR;
        const double now_s = base_clock_wall_s();
        taken_s = n > 0 ? now_s : taken_s;
        sent += n > 0 ? (size_t)n : 0;
        gone |= sent < d->packet.size && !is_patient(d, now_s - taken_s);
    }
    pthread_mutex_lock(&d->lock);
    if (gone)
        forget(d);
}

static void find_viewer(struct lull_host_display *d)
{
    const struct lull_host_blocks *b = d->blocks;
    pthread_mutex_unlock(&d->lock);
    int socket = connect_to(d->address);
    pthread_mutex_lock(&d->lock);
    d->socket = socket;
    if (socket >= 0) {
        viewer_create(&d->packet, b->x1 - b->x0, b->y1 - b->y0);
        send_packet(d);
    }
    if (d->socket < 0 && !d->over) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_sec += (time_t)RETRY_S;
        pthread_cond_timedwait(&d->changed, &d->lock, &until);
    }
}

/* A block in as many tiles as it takes. One that changes on the way is new again. */
static void send_block(struct lull_host_display *d, uint32_t i)
{
    const struct lull_host_blocks *blocks = d->blocks;
    const struct lull_host_block *b = &d->seen[i];
    const int32_t width = b->x1 - b->x0, rows = width < TILE_PIXELS ? TILE_PIXELS / width : 1;
    d->is_new[i] = 0;
    d->new_count--;
    for (int32_t y = b->y0; y < b->y1 && d->socket >= 0; y += rows) {
        const int32_t x = b->x0 - blocks->x0, row = y - blocks->y0;
        const struct viewer_tile tile = {.x = x,
                                         .y = row,
                                         .width = width,
                                         .height = b->y1 - y < rows ? b->y1 - y : rows,
                                         .rgb = d->rgb + 3 * ((size_t)row * d->width + (size_t)x),
                                         .stride = d->width,
                                         .spp = (float)b->spp,
                                         .p_noisy = (float)b->p_noisy,
                                         .error = (float)b->error};
        viewer_update(&d->packet, &tile);
        send_packet(d);
    }
}

static void *serve(void *data)
{
    struct lull_host_display *d = data;
    uint32_t next = 0;
    int tried = 0;
    pthread_mutex_lock(&d->lock);
    while (!(d->over && tried && (d->socket < 0 || (d->new_count == 0 && !d->marks_are_new)))) {
        tried = 1;
        if (d->socket < 0)
            find_viewer(d);
        else if (d->new_count > 0) {
            while (!d->is_new[next % d->blocks->count])
                next++;
            send_block(d, next++ % d->blocks->count);
        } else if (d->marks_are_new) {
            d->marks_are_new = 0;
            viewer_mark(&d->packet, d->seen, d->blocks->count, d->blocks->x0, d->blocks->y0);
            send_packet(d);
        } else
            pthread_cond_wait(&d->changed, &d->lock);
    }
    pthread_mutex_unlock(&d->lock);
    return NULL;
}

static void destroy(struct lull_host_display *d)
{
    if (d->socket >= 0)
        close(d->socket);
    if (d->address)
        freeaddrinfo(d->address);
    viewer_release(&d->packet);
    pthread_cond_destroy(&d->changed);
    pthread_mutex_destroy(&d->lock);
    free(d->rgb);
    free(d->seen);
    free(d->is_new);
    free(d);
}

static int32_t allocate(struct lull_host_display *d, const char *name, struct lull_error *err)
{
    const struct lull_host_blocks *b = d->blocks;
    size_t widest = TILE_PIXELS;
    for (uint32_t i = 0; i < b->count; i++)
        widest = b->list[i].x1 - b->list[i].x0 > (int32_t)widest ? (size_t)(b->list[i].x1 - b->list[i].x0) : widest;
    d->width = (size_t)(b->x1 - b->x0);
    d->rgb = calloc(d->width * (size_t)(b->y1 - b->y0), 3 * sizeof *d->rgb);
    d->seen = calloc(b->count, sizeof *d->seen);
    d->is_new = calloc(b->count, sizeof *d->is_new);
    if (!d->rgb || !d->seen || !d->is_new || viewer_init(&d->packet, name, widest, b->count) != 0)
        return lull_host_no_memory(err, "the live view");
    for (uint32_t i = 0; i < b->count; i++) {
        d->seen[i] = b->list[i];
        d->seen[i].next_spp = 0;
    }
    d->marks_are_new = 1;
    return LULL_OK;
}

/* The thread takes no signal: they are the renderer's. */
static int32_t begin_thread(struct lull_host_display *d, struct lull_error *err)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int failed = pthread_create(&d->thread, NULL, serve, d);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return failed ? lull_error_set(err, LULL_E_MEMORY, "no thread for the live view") : LULL_OK;
}

int32_t lull_host_display_open(const struct lull_host_frame *frame, const char *address, const char *name,
                               struct lull_host_display **out, struct lull_error *err)
{
    pthread_condattr_t monotonic;
    int32_t code = lull_host_given(err, "frame", frame, "address", address, "name", name, "out", out, NULL);
    if (code != LULL_OK)
        return code;
    struct lull_host_display *d = calloc(1, sizeof *d);
    if (!d)
        return lull_host_no_memory(err, "the live view");
    d->socket = -1;
    d->blocks = &frame->blocks;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&d->lock, NULL);
    pthread_cond_init(&d->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    code = find_address(address, &d->address, err);
    if (code == LULL_OK)
        code = allocate(d, name, err);
    if (code == LULL_OK)
        code = begin_thread(d, err);
    if (code == LULL_OK)
        *out = d;
    else
        destroy(d);
    return code;
}

int32_t lull_host_display_close(struct lull_host_display *d, const struct lull_host_view *view)
{
    if (!d)
        return 0;
    pthread_mutex_lock(&d->lock);
    if (view)
        copy(d, view, NULL);
    d->over = 1;
    d->over_s = base_clock_wall_s();
    pthread_cond_signal(&d->changed);
    pthread_mutex_unlock(&d->lock);
    pthread_join(d->thread, NULL);
    const int32_t complete = d->socket >= 0;
    destroy(d);
    return complete;
}
