#include "plugin/translate.h"

int32_t gp_fail_from(struct lull_error *err, const char *what, const struct base_err *from)
{
    int32_t code = from->code == BASE_ENOMEM ? LULL_E_MEMORY : LULL_E_IO;

    return lull_kit_fail(err, code, "%s: %.400s", what, from->text);
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
