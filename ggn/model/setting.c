#include "model/setting.h"

#include <math.h>
#include <stdio.h>

size_t ggn_setting_difference(const struct ggn_setting *learned, const struct ggn_setting *here, char *text, size_t room)
{
    static const char *const transfers[] = {"sRGB", "a gamma", "linear codes"};
    size_t used = 0;

    text[0] = '\0';
    if (here->width != learned->width || here->height != learned->height)
        used = (size_t)snprintf(text, room, "blocks of %dx%d pixels instead of %dx%d", here->width, here->height,
                                learned->width, learned->height);
    if (here->transfer != learned->transfer && used < room)
        used += (size_t)snprintf(text + used, room - used, "%s%s instead of %s", used ? ", " : "", transfers[here->transfer],
                                 transfers[learned->transfer]);
    return used < room ? used : room - 1;
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
