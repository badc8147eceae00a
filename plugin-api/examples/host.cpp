/*
 * The smallest host: a renderer of a noisy gradient that stops each block when the criterion says so.
 *
 *     c++ -std=c++11 host.cpp -llull-host -o host && ./host observer stops.png
 *
 * The renderer keeps a film of sums and takes samples; blocks, checks, limits and files are the library's.
 */
#include <lull/host.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace
{

const int width = 320, height = 180;

/* Sums over the samples of each pixel, and over those of half A: every second group of eight. */
struct Film {
    std::vector<float> color = std::vector<float>(width * height * 3), half = color;
};

bool in_half(uint64_t sample) { return sample / 8 % 2 == 0; }

/* One sample: a gradient whose right part is noisy. */
void sample(Film &film, int x, int y, uint64_t n)
{
    std::minstd_rand random(static_cast<unsigned>(static_cast<uint64_t>(x + y * width) * 9973 + n * 7 + 1));
    random.discard(3);
    const float u = std::uniform_real_distribution<float>(-1, 1)(random), noise = x > width / 2 ? 0.3f * u : 0.03f * u;
    for (int c = 0; c < 3; c++) {
        const float value = 0.3f + 0.4f * static_cast<float>(y) / height + noise;
        const size_t i = static_cast<size_t>(3 * (x + y * width) + c);
        film.color[i] += value;
        film.half[i] += in_half(n) ? value : 0;
    }
}

/* Up to its next check. */
void render(Film &film, lull_host_block &b)
{
    for (; b.spp < b.next_spp; b.spp++) {
        for (int y = b.y0; y < b.y1; y++)
            for (int x = b.x0; x < b.x1; x++)
                sample(film, x, y, b.spp);
        b.half_spp += in_half(b.spp);
    }
}

lull_plane plane(const std::vector<float> &sums, int32_t normaliser)
{
    lull_plane p = lull_plane();
    p.data = sums.data();
    p.stride_c = sizeof(float);
    p.stride_x = 3 * p.stride_c;
    p.stride_y = width * p.stride_x;
    p.scale = 1;
    p.type = LULL_TYPE_F32;
    p.normaliser = normaliser; /* sums: the library divides by the samples of each block */
    p.channels = 3;
    return p;
}

int fail(const lull_error &err)
{
    std::fprintf(stderr, "host: %s\n", err.message);
    return 2;
}

} // namespace

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "observer", *map = argc > 2 ? argv[2] : "stops.png";
    lull_error err = {sizeof err, 0, ""};
    lull_host_criterion *criterion;
    lull_host_frame *frame;
    if (lull_host_open(nullptr, name, nullptr, 0, &criterion, &err) != LULL_OK)
        return fail(err);

    lull_host_config config = lull_host_config();
    config.struct_size = sizeof config;
    config.width = width;
    config.height = height;
    config.block_width = config.block_height = 60;
    config.planes = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF);
    config.spp_min = 16;
    config.spp_max = 4096;
    config.check_step = 16; /* where both halves have as many samples */
    if (lull_host_begin(&config, criterion, &frame, &err) != LULL_OK)
        return fail(err);

    Film film;
    const lull_plane planes[LULL_PLANE_COUNT] = {plane(film.color, LULL_NORM_SPP),     {}, {}, {},
                                                 plane(film.half, LULL_NORM_HALF_SPP), {}, {}, {}};
    const lull_host_view view = {sizeof view, LULL_PLANE_COUNT, 0, 0, width, height, planes, nullptr, nullptr};
    const lull_host_blocks &blocks = *lull_host_blocks_of(frame);
    while (lull_host_active(&blocks) > 0) {
        for (uint32_t i = 0; i < blocks.count; i++)
            if (blocks.list[i].reason == LULL_REASON_NONE)
                render(film, blocks.list[i]);
        if (lull_host_check(frame, &view, &err) != LULL_OK)
            fail(err); /* the blocks go on */
    }
    for (uint32_t i = 0; i < blocks.count; i++)
        std::printf("%s%llu", i ? " " : "", static_cast<unsigned long long>(blocks.list[i].spp));
    std::printf("\n");
    int status = lull_host_stop_map(&blocks, map, name, &err) == LULL_OK ? 0 : fail(err);
    lull_host_end(frame);
    lull_host_close(criterion);
    return status;
}
