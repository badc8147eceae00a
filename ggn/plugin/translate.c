#include "plugin/translate.h"

#include "base/colour.h"

int32_t gp_fail_from(struct lull_error *err, int32_t otherwise, const char *what, const struct base_err *from)
{
    const int32_t code = from->code == BASE_ENOMEM       ? LULL_E_MEMORY
                         : from->code == BASE_ECANCELLED ? LULL_E_CANCELLED
                                                         : otherwise;
    return lull_kit_fail(err, code, "%s: %.400s", what, from->text);
}

void gp_log(const struct lull_kit *kit, int32_t level, const char *text)
{
    if (kit->host && kit->host->log)
        kit->host->log(kit->host, level, text);
}

void gp_say_once(const struct lull_kit *kit, int32_t level, atomic_flag *said, const char *text)
{
    if (kit->host && kit->host->log && !atomic_flag_test_and_set(said))
        gp_log(kit, level, text);
}

double gp_error_of_same(const struct lull_kit *kit, int has_structure, atomic_flag *warned, const char *text,
                        struct lull_kit_tally *tally)
{
    if (!has_structure)
        return 0;
    gp_say_once(kit, LULL_LOG_WARNING, warned, text);
    tally->early = tally->bad = 1;
    return (double)NAN;
}

int32_t gp_check_block(const struct lull_block *b, const struct lull_rect *r, uint64_t spp_before, struct lull_error *err)
{
    if (b->x0 != r->x0 || b->y0 != r->y0 || b->x1 != r->x1 || b->y1 != r->y1)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u is none of the frame's", b->id);
    if (b->spp < spp_before)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u has fewer samples than before", b->id);
    return LULL_OK;
}

struct ggn_display gp_display_of(const struct lull_kit *kit)
{
    struct ggn_display d = {GGN_TRANSFER_SRGB, kit->gamma, kit->exposure};
    if (kit->transfer == LULL_TRANSFER_LINEAR)
        d.transfer = GGN_TRANSFER_LINEAR;
    else if (kit->transfer == LULL_TRANSFER_GAMMA && isfinite(d.gamma) && d.gamma > 0)
        d.transfer = GGN_TRANSFER_GAMMA;
    return d;
}

float gp_shown(const struct lull_kit *kit, double radiance)
{
    double v = kit->exposure * radiance;
    if (!(v > 0))
        return 0;
    if (v >= 1)
        return 1;
    if (kit->transfer == LULL_TRANSFER_LINEAR)
        v = base_srgb_eotf(v);
    else if (kit->transfer == LULL_TRANSFER_GAMMA && isfinite(kit->gamma) && kit->gamma > 0)
        v = base_srgb_eotf(pow(v, 1 / kit->gamma));
    return (float)v;
}
