/* The other things ggn reads from people: threshold tables, labels, rawls images. The first byte chooses. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "data/labels.h"
#include "data/import.h"
#include "data/thresholds.h"
#include "picture/read.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void try_csv(char *text, size_t size)
{
    struct ggn_thresholds t;
    struct base_err err = {0};
    if (ggn_thresholds_parse_csv("fuzz", text, size, &t, &err) == 0)
        ggn_thresholds_release(&t);
    else if (err.text[0] == '\0')
        abort();
}

static void try_labels(const char *text, size_t size)
{
    struct ggn_labels l;
    struct base_err err = {0};
    if (ggn_labels_parse("fuzz", text, size, &l, &err) == 0) {
        for (uint32_t i = 0; i < l.n; i++)
            ggn_label_p_noisy(&l.labels[i], 100.0, l.spread);
        ggn_labels_release(&l);
    } else if (err.text[0] == '\0') {
        abort();
    }
}

static void try_rawls(const char *bytes, size_t size)
{
    struct pic_image image;
    struct base_err err = {0};
    if (ggn_rawls_parse("fuzz", bytes, size, &image, &err) == 0)
        pic_release(&image);
    else if (err.text[0] == '\0')
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    /* A copy of its own, so that the sanitizer sees any step beyond the end. */
    char *text = malloc(size + 1);
    if (!text)
        return 0;
    memcpy(text, data, size);
    text[size] = '\0';
    if (size > 0 && text[0] == '{')
        try_labels(text, size);
    else if (size > 0 && text[0] == 'I')
        try_rawls(text, size);
    else
        try_csv(text, size);
    free(text);
    return 0;
}
