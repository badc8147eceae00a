#include "agree.h"

#include <zlib.h>

#include "base/version.h"

static int32_t add_to_crc(const struct lull_writer *to, const void *data, uint64_t size)
{
    uint32_t *crc = to->context;
    *crc = (uint32_t)crc32_z(*crc, data, (size_t)size);
    return LULL_OK;
}

int pt_agree_identity(const struct pt_open *o, struct base_identity *to, struct base_err *err)
{
    uint32_t crc = (uint32_t)crc32(0, NULL, 0);
    struct lull_writer adder = {.struct_size = sizeof adder, .context = &crc, .write = add_to_crc};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = o->render && o->criterion ? lull_host_save_history(o->criterion, &adder, &e) : LULL_OK;
    if (code != LULL_OK)
        return pt_host_result(code, &e, err);
    base_identity_add(to, "version", "%s", BASE_VERSION);
    base_identity_append(to, &o->identity);
    base_identity_add(to, "criterion-model-crc", "%08x", (unsigned)crc);
    return base_identity_check(to, err);
}

/* Of this program's own file: two builds may have one version. 0 where the system does not show it. */
static uint32_t program_crc(void)
{
    struct base_inputs own = BASE_INPUTS_EMPTY;
    uint32_t crc = 0;
    if (base_inputs_add(&own, "/proc/self/exe", NULL) != 0 || base_inputs_crc32(&own, &crc, NULL) != 0)
        crc = 0;
    base_inputs_release(&own);
    return crc;
}

int pt_agree_handshake(const struct pt_open *o, struct job *job, struct base_err *err)
{
    struct base_identity all = {0};
    int rc = job ? pt_agree_identity(o, &all, err) : 0;
    if (!rc && job) {
        base_identity_add(&all, "program-crc", "%08x", (unsigned)program_crc());
        rc = base_identity_check(&all, err);
    }
    if (!rc)
        rc = job_handshake(job, all.text, base_threads_count(o->threads), err);
    base_identity_release(&all);
    return rc;
}
