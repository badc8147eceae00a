#define _DEFAULT_SOURCE /* getentropy */
#include "study/token.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

int ggn_study_token(char *out, int digits, struct base_err *err)
{
    unsigned char bytes[32];
    if (getentropy(bytes, sizeof bytes) != 0)
        return base_fail(err, BASE_EIO, "no randomness from the system: %s", strerror(errno));
    for (int i = 0; i < digits; i++)
        out[i] = "0123456789abcdef"[bytes[i / 2] >> (i % 2 ? 4 : 0) & 15];
    out[digits] = '\0';
    return 0;
}

int ggn_study_token_equal(const char *a, const char *b)
{
    size_t n = strlen(a);
    unsigned difference = 0;
    if (strlen(b) != n)
        return 0;
    for (size_t i = 0; i < n; i++)
        difference |= (unsigned)(a[i] ^ b[i]);
    return difference == 0;
}
