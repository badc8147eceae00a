/* The live view: its packets are those of the viewer's own client, and no viewer holds or changes the renderer. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "host/frame.h"
#include "host/viewer.h"

/* --- packets ------------------------------------------------------------------------------------------------------------- */

/* The recorded ones are made by tests/unit/api_host_display/record.py. */
static void expect_packet(const struct viewer_packet *p, const char *file)
{
    char path[128], *data;
    size_t size;
    snprintf(path, sizeof path, "tests/unit/api_host_display/%s.bin", file);
    assert_int_equal(base_file_read(path, 1 << 20, &data, &size, NULL), 0);
    assert_int_equal(p->size, size);
    for (size_t i = 0; i < size; i++)
        if (p->at[i] != (uint8_t)data[i])
            fail_msg("%s: byte %zu of %zu is %02x, not %02x", file, i, size, p->at[i], (uint8_t)data[i]);
    free(data);
}

static void packets_are_those_of_the_viewers_client(void **state)
{
    (void)state;
    enum { STRIDE = 5 };
    struct viewer_packet p;
    float rgb[2 * STRIDE * 3];
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < STRIDE; x++) {
            float *to = rgb + 3 * (y * STRIDE + x);
            to[0] = (float)x + 0.25f;
            to[1] = (float)y - 0.5f;
            to[2] = (float)(1e-3 * (x + y));
        }
    assert_int_equal(viewer_init(&p, "a scene.pbrt", 6, 2), 0);
    viewer_create(&p, 96, 48);
    expect_packet(&p, "create");
    viewer_update(&p, &(struct viewer_tile){64, 5, 3, 2, rgb, STRIDE, 48.0f, 0.125f, 3.5f});
    expect_packet(&p, "update");
    const struct lull_host_block blocks[2] = {
        {.x0 = 100, .y0 = 50, .x1 = 164, .y1 = 98, .spp = 7},
        {.x0 = 164, .y0 = 50, .x1 = 196, .y1 = 82, .spp = 1903, .reason = LULL_REASON_CRITERION}};
    viewer_mark(&p, blocks, 2, 100, 50);
    expect_packet(&p, "marks");
    viewer_release(&p);
}

/* The most that a packet may need: every block with ten figures of the most lines, and more blocks than are drawn. */
static void drawings_keep_to_their_memory(void **state)
{
    (void)state;
    struct viewer_packet p;
    struct lull_host_block *blocks = calloc(VIEWER_MARKED_BLOCKS + 1, sizeof *blocks);
    assert_non_null(blocks);
    for (uint32_t i = 0; i <= VIEWER_MARKED_BLOCKS; i++)
        blocks[i] = (struct lull_host_block){.x1 = 4000, .y1 = 4000, .spp = 2088888888u, .reason = LULL_REASON_TIME};
    assert_int_equal(viewer_init(&p, "n", 1, VIEWER_MARKED_BLOCKS + 1), 0);
    viewer_mark(&p, blocks, VIEWER_MARKED_BLOCKS, 0, 0);
    assert_true(p.size > VIEWER_MARKED_BLOCKS * 500);
    viewer_mark(&p, blocks, VIEWER_MARKED_BLOCKS + 1, 0, 0);
    assert_true(p.size < 200);
    viewer_release(&p);
    free(blocks);
}

/* --- a frame of 2 x 2 blocks, and somebody who listens -------------------------------------------------------------------- */

enum { SIDE = 512 };

static const struct timespec moment = {.tv_nsec = 50000000};

static float *color;
static struct lull_plane plane;
static struct lull_host_view view;
static struct lull_host_frame *frame;
static struct lull_host_block *list;
static struct lull_error fault;
static char address[32];

static int set_up(void **state)
{
    (void)state;
    color = calloc(SIDE * SIDE, 3 * sizeof *color);
    plane = (struct lull_plane){.data = color,
                                .stride_x = 12,
                                .stride_y = 12 * SIDE,
                                .stride_c = 4,
                                .scale = 1,
                                .type = LULL_TYPE_F32,
                                .normaliser = LULL_NORM_SPP,
                                .channels = 3};
    view = (struct lull_host_view){.struct_size = sizeof view, .plane_count = 1, .x1 = SIDE, .y1 = SIDE, .planes = &plane};
    const struct lull_host_config config = {.struct_size = sizeof config,
                                            .flags = LULL_HOST_UNIFORM,
                                            .width = SIDE,
                                            .height = SIDE,
                                            .block_width = SIDE / 2,
                                            .block_height = SIDE / 2,
                                            .planes = LULL_PLANE_BIT(LULL_PLANE_COLOR),
                                            .spp_min = 1000000,
                                            .spp_max = 1000000};
    fault = (struct lull_error){.struct_size = sizeof fault};
    assert_int_equal(lull_host_begin(&config, NULL, &frame, &fault), LULL_OK);
    list = lull_host_blocks_of(frame)->list;
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    lull_host_end(frame);
    free(color);
    return 0;
}

static int listen_somewhere(int room)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof to;
    int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &room, sizeof room), 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&to, size), 0);
    assert_int_equal(listen(fd, 4), 0);
    assert_int_equal(getsockname(fd, (struct sockaddr *)&to, &size), 0);
    snprintf(address, sizeof address, "127.0.0.1:%d", ntohs(to.sin_port));
    return fd;
}

/* All pixels and samples are those of this round. */
static void sample(uint64_t spp, float value)
{
    for (int i = 0; i < 4; i++)
        list[i].spp = spp;
    for (int i = 0; i < 3 * SIDE * SIDE; i++)
        color[i] = value * (float)spp;
}

/* Takes bytes until the end of the connection, as many as there may be. */
struct reader {
    int fd;
    uint8_t *data;
    size_t size;
};

static void *read_all(void *data)
{
    enum { ROOM = 1 << 28 };
    struct reader *r = data;
    r->data = malloc(ROOM);
    for (ptrdiff_t n = 1; n > 0 && r->data; r->size += n > 0 ? (size_t)n : 0)
        n = recv(r->fd, r->data + r->size, ROOM - r->size, 0);
    return NULL;
}

static uint32_t u32_at(const uint8_t *p) { return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24; }

/* The last tile of the stream that begins at x, y: its first pixel's red and samples. */
static int last_tile(const struct reader *r, int x, int y, float values[2])
{
    const size_t head = 4 + 1 + 1 + 2 + 4 + 6 + 9 + 13 + 11, pixels = head + 16 + 6 * 16;
    int found = 0;
    for (size_t at = 0; at + 5 <= r->size; at += u32_at(r->data + at)) {
        const uint8_t *p = r->data + at;
        assert_true(u32_at(p) >= 5 && at + u32_at(p) <= r->size); /* whole packets only */
        if (p[4] != 6 || u32_at(p + head) != (uint32_t)x || u32_at(p + head + 4) != (uint32_t)y)
            continue;
        memcpy(&values[0], p + pixels, 4);
        memcpy(&values[1], p + pixels + 12, 4);
        found++;
    }
    return found;
}

static void a_viewer_gets_the_last_picture(void **state)
{
    (void)state;
    struct lull_host_display *display;
    struct reader r = {0};
    pthread_t thread;
    float values[2];
    int server = listen_somewhere(1 << 20);
    assert_int_equal(lull_host_display_open(frame, address, "n", &display, &fault), LULL_OK);
    r.fd = accept(server, NULL, NULL);
    pthread_create(&thread, NULL, read_all, &r);
    sample(3, 0.5f);
    assert_int_equal(lull_host_display_update(display, &view, &fault), LULL_OK);
    sample(48, 2.0f);
    assert_int_equal(lull_host_display_close(display, &view), 1);
    pthread_join(thread, NULL);
    assert_true(last_tile(&r, 0, 0, values) >= 1);
    assert_true(values[0] == 2.0f && values[1] == 48.0f);
    assert_true(last_tile(&r, SIDE / 2, SIDE / 2, values) >= 1);
    assert_true(values[0] == 2.0f && values[1] == 48.0f);
    close(r.fd);
    close(server);
    free(r.data);
}

/* One that takes nothing, one that is not there, one that leaves. Each round of samples is new, so that far more must be sent
 * than any buffer holds. Who takes nothing would be waited for without end: an update that waits never returns, and no clock
 * is asked. */
static void no_viewer_holds_the_renderer(void **state)
{
    const double usual_s = viewer_patience_s;
    (void)state;
    viewer_patience_s = 1e9;
    for (int kind = 0; kind < 3; kind++) {
        struct lull_host_display *display;
        int server = listen_somewhere(1 << 12), client = -1;
        if (kind == 1)
            close(server);
        assert_int_equal(lull_host_display_open(frame, address, "n", &display, &fault), LULL_OK);
        if (kind != 1)
            client = accept(server, NULL, NULL);
        if (kind == 2)
            close(client);
        for (uint64_t n = 1; n <= 12; n++) {
            sample(n, 1.0f);
            assert_int_equal(lull_host_display_update(display, &view, &fault), LULL_OK);
            nanosleep(&moment, NULL);
        }
        assert_int_equal(lull_host_display_close(display, &view), 0);
        if (kind == 0)
            close(client);
        if (kind != 1)
            close(server);
    }
    viewer_patience_s = usual_s;
}

/* Who comes, leaves and comes again gets all, also what has not changed since. */
static void a_viewer_that_returns_gets_all(void **state)
{
    (void)state;
    static uint8_t first[1 << 16];
    struct lull_host_display *display;
    struct reader r = {0};
    pthread_t thread;
    float values[2];
    int server = listen_somewhere(1 << 20);
    assert_int_equal(lull_host_display_open(frame, address, "n", &display, &fault), LULL_OK);
    int client = accept(server, NULL, NULL);
    sample(5, 0.25f);
    for (ptrdiff_t got = 0; got < (ptrdiff_t)SIDE * SIDE * 24;) { /* all four blocks */
        ptrdiff_t n = recv(client, first, sizeof first, MSG_DONTWAIT);
        got += n > 0 ? n : 0;
        if (n <= 0)
            nanosleep(&moment, NULL);
        lull_host_display_update(display, &view, NULL);
    }
    close(client);
    struct pollfd comes_again = {.fd = server, .events = POLLIN};
    while (poll(&comes_again, 1, 50) == 0) { /* it notices as it sends */
        list[0].spp++;
        lull_host_display_update(display, &view, NULL);
    }
    r.fd = accept(server, NULL, NULL);
    pthread_create(&thread, NULL, read_all, &r);
    assert_int_equal(lull_host_display_close(display, NULL), 1);
    pthread_join(thread, NULL);
    assert_int_equal(r.data[4], 4);
    assert_true(last_tile(&r, SIDE / 2, SIDE / 2, values) >= 1);
    assert_true(values[0] == 0.25f && values[1] == 5.0f);
    close(r.fd);
    close(server);
    free(r.data);
}

static void what_makes_no_sense_is_refused(void **state)
{
    (void)state;
    static const char *const bad[] = {"",    ":14158", "h:",     "h:0",  "h:65536",
                                      "h:x", "[::1",   "[::1]x", "[]:1", "no.such.host.invalid:1"};
    struct lull_host_display *display = NULL;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(lull_host_display_open(frame, bad[i], "n", &display, &fault), LULL_E_INVALID);
        assert_int_equal(strncmp(fault.message, bad[i], strlen(bad[i])), 0);
    }
    assert_null(display);
    assert_int_equal(lull_host_display_close(NULL, &view), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(packets_are_those_of_the_viewers_client),
        cmocka_unit_test(drawings_keep_to_their_memory),
        cmocka_unit_test_setup_teardown(a_viewer_gets_the_last_picture, set_up, tear_down),
        cmocka_unit_test_setup_teardown(no_viewer_holds_the_renderer, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_viewer_that_returns_gets_all, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_makes_no_sense_is_refused, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
