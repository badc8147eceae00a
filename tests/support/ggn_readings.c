#include "ggn_readings.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/files.h"
#include "data/labels.h"
#include "data/thresholds.h"
#include "model/model.h"

static double ended(double start_s, int rc, const struct base_err *err)
{
    double s = base_clock_thread_s() - start_s;
    if (rc)
        fprintf(stderr, "%s\n", err->text);
    return rc ? -1 : s;
}

/* --- models ------------------------------------------------------------------------------------------------------------------ */

/* The published form with `items` channels: the weights grow with the square. */
static char *model(size_t items, size_t *size)
{
    struct ggn_hyper hyper = ggn_hyper_default(GGN_PRESET_PAPER);
    char path[64], *bytes = NULL;
    hyper.k_r = hyper.k_m = hyper.k_d = (int)items;
    struct ggn_model *m = ggn_model_create(&hyper, NULL);
    snprintf(path, sizeof path, "/tmp/ggn_readings_%ld", (long)getpid());
    if (m && ggn_model_save(m, path, GGN_F32, NULL) == 0 && base_file_read(path, (size_t)1 << 31, &bytes, size, NULL) != 0)
        bytes = NULL;
    unlink(path);
    ggn_model_destroy(m);
    return bytes;
}

static double read_model(char *bytes, size_t size, size_t items)
{
    struct ggn_model *m = NULL;
    struct ggn_container c;
    struct base_err err = {0};
    double start_s = base_clock_thread_s();
    int rc = ggn_container_parse(&c, "model", bytes, size, &err);
    if (!rc)
        rc = ggn_model_parse(&c, "model", &m, &err);
    double s = ended(start_s, rc, &err);
    (void)items;
    ggn_container_release(&c);
    ggn_model_destroy(m);
    return s;
}

/* --- labels and thresholds --------------------------------------------------------------------------------------------------- */

static char *labels(size_t items, size_t *size)
{
    char *text = NULL;
    FILE *f = open_memstream(&text, size);
    if (!f)
        return NULL;
    fputs("{\"format\":\"lull-labels\",\"version\":1,\"source\":\"human\",\"cap\":4096,\"spread\":0.5,\"blocks\":[", f);
    for (size_t i = 0; i < items; i++)
        fprintf(f, "%s{\"id\":%zu,\"threshold\":%zu}", i ? "," : "", i, 16 + i % 1000);
    fputs("]}\n", f);
    return fclose(f) == 0 ? text : NULL;
}

static double read_labels(char *text, size_t size, size_t items)
{
    struct ggn_labels l;
    struct base_err err = {0};
    double start_s = base_clock_thread_s();
    int rc = ggn_labels_parse("labels.json", text, size, &l, &err);
    double s = ended(start_s, rc || l.n != items, &err);
    if (!rc)
        ggn_labels_release(&l);
    free(text);
    return s;
}

/* Views of 16 blocks. */
static char *table(size_t items, size_t *size)
{
    char *text = NULL;
    FILE *f = open_memstream(&text, size);
    if (!f)
        return NULL;
    for (size_t i = 0; i < items; i++)
        fprintf(f, "view-%zu;16;32;48;64;80;96;112;128;144;160;176;192;208;224;240;256;\n", i);
    return fclose(f) == 0 ? text : NULL;
}

static double read_table(char *text, size_t size, size_t items)
{
    struct ggn_thresholds t;
    struct base_err err = {0};
    double start_s = base_clock_thread_s();
    int rc = ggn_thresholds_parse_csv("table.csv", text, size, &t, &err);
    double s = ended(start_s, rc || (size_t)t.n != items, &err);
    if (!rc)
        ggn_thresholds_release(&t);
    free(text);
    return s;
}

const struct base_reading ggn_readings[GGN_READINGS] = {
    {"model", 2, 256, model, read_model},
    {"labels", 2000, 0, labels, read_labels},
    {"thresholds", 1000, 0, table, read_table},
};
