#include "model/setting.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "base/err.h"

__attribute__((format(printf, 4, 5))) static size_t add(char *text, size_t room, size_t used, const char *format, ...)
{
    va_list args;
    int n = used && used + 2 < room ? snprintf(text + used, room - used, ", ") : 0;

    used += n > 0 ? (size_t)n : 0;
    va_start(args, format);
    n = used < room ? vsnprintf(text + used, room - used, format, args) : 0;
    va_end(args);
    used += n > 0 ? (size_t)n : 0;
    return used < room ? used : room - 1;
}

size_t ggn_setting_difference(const struct ggn_setting *learned, const struct ggn_setting *here, char *text, size_t room)
{
    static const char *const transfers[] = {"sRGB", "a gamma", "linear codes"};
    size_t used = 0;

    text[0] = '\0';
    if (here->width != learned->width || here->height != learned->height)
        used = add(text, room, used, "blocks of %dx%d pixels instead of %dx%d", here->width, here->height, learned->width,
                   learned->height);
    if (here->transfer != learned->transfer)
        used = add(text, room, used, "%s instead of %s", transfers[here->transfer], transfers[learned->transfer]);
    return used;
}

int ggn_setting_levels_differ(const struct ggn_policy *policy, const double *spp, int n, double *asked, double *nearest)
{
    int i = 0, differ = 0;

    while (i < n && spp[i] < policy->first_spp)
        i++;
    while (i + 1 < n) {
        const double next = ggn_policy_next(policy, spp[i]), step = next - spp[i];
        int k = i + 1;
        while (k + 1 < n && fabs(spp[k + 1] - next) <= fabs(spp[k] - next))
            k++;
        if (next < spp[n - 1] && fabs(spp[k] - next) >= fmax(0.5 * step, 1 + 1e-9) && differ++ == 0) {
            *asked = next;
            *nearest = spp[k];
        }
        i = k;
    }
    return differ > 1;
}
