/* Numbers in text, always in the C locale. Thread-safe. */
#ifndef PT_PBRT_NUMBER_H
#define PT_PBRT_NUMBER_H

#include <stddef.h>

/* Parses all of text[0, n) as a decimal number ("-1", "+.5", "3.", "1e-008"); correctly rounded. Returns 1, or 0 when it is
 * no number or not finite. */
int pt_number_parse(const char *text, size_t n, double *out);

#endif
