#include "data/agree.h"

#include <stdio.h>
#include <zlib.h>

#include "base/inputs.h"
#include "base/version.h"
#include "base/isa.h"

static unsigned data_crc(const struct ggn_series_set *set)
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
    return (unsigned)crc;
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
    uint32_t files_are = 0;
    char text[512];

    if (!job)
        return 0;
    int rc = files_crc(files, n_files, &files_are, err);
    if (rc)
        return rc;
    snprintf(text, sizeof text, "version=%s\ninstructions=%s (LULL_ISA)\ndata-crc=%08x\nfiles-crc=%08x\n", BASE_VERSION,
             base_isa_name(base_isa_best()), data_crc(set), (unsigned)files_are);
    return job_handshake(job, text, threads, err);
}
