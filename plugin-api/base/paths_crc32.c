#include "base/paths.h" /* apart from paths.c: not everybody who names inputs links zlib */

#include <stdio.h>
#include <stdlib.h>
#include <zlib.h>

#include "base/files.h"

int base_inputs_crc32(const struct base_inputs *inputs, uint32_t *crc, struct base_err *err)
{
    static const size_t piece = 1 << 16;
    unsigned char *bytes = malloc(piece);
    int rc = bytes ? 0 : base_fail_nomem(err, "checksum");
    *crc = 0;
    for (size_t i = 0; i < inputs->count && !rc; i++) {
        FILE *f = NULL;
        rc = base_file_open(inputs->paths[i], &f, err);
        if (rc)
            break;
        for (size_t n; (n = fread(bytes, 1, piece, f)) > 0;)
            *crc = (uint32_t)crc32_z(*crc, bytes, n);
        if (ferror(f))
            rc = base_fail(err, BASE_EIO, "%s: read error", inputs->paths[i]);
        fclose(f);
    }
    free(bytes);
    return rc;
}
