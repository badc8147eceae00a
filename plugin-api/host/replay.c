#include "host/frame.h"

#include <math.h>

#include "base/colour.h"
#include "sequence/simulate.h"

/* MOMENT2 at n samples of the same variance of a sample: s^2 = (m2 - Y^2) n / (n - 1). */
static void simulate_moment(const struct lull_host_simulation *s, const double y_of[3])
{
    const double from = (double)s->spp, to = (double)s->to_spp;
    const double scale = from > 1 ? from / (from - 1) * (to - 1) / to : 1.0;
    for (uint64_t i = 0; i < s->pixels; i++) {
        const double *c = s->color + 3 * i, y = y_of[0] * c[0] + y_of[1] * c[1] + y_of[2] * c[2];
        s->moment2[i] = y * y + scale * (s->moment2[i] - y * y);
    }
}

/* HALF at halves of to_spp: the difference D = (A - B) / 2 has the noise of to_spp samples, A - M is 2 (n - h) / n of it. */
static void simulate_half(const struct lull_host_simulation *s)
{
    const double n = (double)s->spp, h = (double)s->half_spp, to = (double)s->to_spp, to_h = (double)(s->to_spp / 2);
    const double scale =
        seq_noise_scale(n, to) * seq_half_scale(n, h) / seq_half_scale(to, to_h) * ((to - to_h) / to) / ((n - h) / n);
    for (uint64_t i = 0; i < 3 * s->pixels; i++)
        s->half[i] = s->color[i] + scale * (s->half[i] - s->color[i]);
}

int32_t lull_host_simulate(const struct lull_host_simulation *s, struct lull_error *err)
{
    static const double srgb[9] = BASE_RGB_TO_XYZ;
    const int32_t code = lull_host_given(err, "simulation", s, NULL);
    if (code != LULL_OK)
        return code;
    if (s->struct_size < sizeof *s)
        return lull_error_set(err, LULL_E_VERSION, "struct_size %u: expected at least %zu", s->struct_size, sizeof *s);
    if (!s->color)
        return lull_error_set(err, LULL_E_INVALID, "color is NULL");
    if (s->spp < 1 || s->to_spp <= s->spp || s->to_spp > LULL_HOST_MOST_SPP)
        return lull_error_set(err, LULL_E_INVALID, "from %llu to %llu samples: expected more of them, at most 2^31 - 1",
                              (unsigned long long)s->spp, (unsigned long long)s->to_spp);
    if (s->half && (s->half_spp < 1 || s->half_spp >= s->spp))
        return lull_error_set(err, LULL_E_INVALID, "half_spp %llu: expected some of the %llu samples",
                              (unsigned long long)s->half_spp, (unsigned long long)s->spp);
    double sum = 0;
    for (int i = 3; i < 6; i++)
        sum += fabs(s->rgb_to_xyz[i]);
    if (!isfinite(sum))
        return lull_error_set(err, LULL_E_INVALID, "rgb_to_xyz: a number is not finite");
    if (s->moment2)
        simulate_moment(s, (sum > 0 ? s->rgb_to_xyz : srgb) + 3);
    if (s->half)
        simulate_half(s);
    return LULL_OK;
}
