#include "data/agree.h"

#include <zlib.h>

#include "base/identity.h"
#include "base/inputs.h"
#include "base/version.h"
#include "base/isa.h"

uint32_t ggn_series_set_crc(const struct ggn_series_set *set)
{
    const size_t values = ggn_series_set_values(set);
    uLong crc = crc32(0, NULL, 0);

    for (int i = 0; i < set->n; i++) {
        const struct ggn_level_series *c = &set->series[i];
        const double what[] = {c->split, c->block, c->n_levels, c->has_label ? c->label.threshold : -1};
        crc = crc32_z(crc, (const Bytef *)what, sizeof what);
        if (c->n_levels > 0)
            crc = crc32_z(crc, c->noisy, (size_t)c->n_levels * values);
        if (c->reference)
            crc = crc32_z(crc, c->reference, values);
        for (int k = 0; c->noise_map && k < c->n_levels; k++) {
            crc = crc32_z(crc, &c->has_noise_map[k], 1);
            if (c->has_noise_map[k]) /* otherwise nobody has written it */
                crc = crc32_z(crc, c->noise_map + (size_t)k * (values / 3), values / 3);
        }
    }
    return (uint32_t)crc;
}

static int files_crc(const char *const *files, int n, uint32_t *crc, struct base_err *err)
{
    struct base_inputs list = BASE_INPUTS_EMPTY;
    int rc = 0;

    for (int i = 0; i < n && !rc; i++)
        rc = base_inputs_add(&list, files[i], err);
    if (!rc)
        rc = base_inputs_crc32(&list, crc, err);
    base_inputs_release(&list);
    return rc;
}

int ggn_agree(struct job *job, const struct ggn_series_set *set, const char *const *files, int n_files, int threads,
              struct base_err *err)
{
    struct base_identity all = {0};
    uint32_t files_are = 0;

    if (!job)
        return 0;
    int rc = files_crc(files, n_files, &files_are, err);
    if (rc)
        return rc;
    base_identity_add(&all, "version", "%s", BASE_VERSION);
    base_identity_add(&all, "instructions", "%s (LULL_ISA)", base_isa_name(base_isa_best()));
    base_identity_add(&all, "data-crc", "%08x", ggn_series_set_crc(set));
    base_identity_add(&all, "files-crc", "%08x", files_are);
    rc = base_identity_check(&all, err);
    if (!rc)
        rc = job_handshake(job, all.text, threads, err);
    base_identity_release(&all);
    return rc;
}
