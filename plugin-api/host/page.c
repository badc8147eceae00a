/* The report as a page: page.html, which is compiled in, with the report and the pictures in its places. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/json.h"
#include "host/frame.h"
#include "picture/png.h"

/* Bytes of JSON up to which the checks of each block are kept. */
enum { HISTORY_LIMIT = 1900000 };

__asm__(".section .rodata\n"
        ".global lull_host_page_html\n"
        ".hidden lull_host_page_html\n"
        "lull_host_page_html:\n"
        ".incbin \"plugin-api/host/page.html\"\n"
        ".byte 0\n"
        ".previous\n");
extern const char lull_host_page_html[] __attribute__((visibility("hidden")));

/* The size of the pictures that belong to a report; 0: it is none. */
static int find_size(const cJSON *report, double size[2])
{
    const cJSON *crop = cJSON_GetObjectItemCaseSensitive(report, "crop");
    if (!cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(report, "blocks")) ||
        !base_json_get(report, "width", -HUGE_VAL, HUGE_VAL, &size[0]) ||
        !base_json_get(report, "height", -HUGE_VAL, HUGE_VAL, &size[1]))
        return 0;
    for (int i = 0; i < 2 && cJSON_GetArraySize(crop) == 4; i++)
        size[i] = cJSON_GetNumberValue(cJSON_GetArrayItem(crop, 2 + i)) - cJSON_GetNumberValue(cJSON_GetArrayItem(crop, i));
    return 1;
}

/* Whether there can be a picture of this size. */
static int is_size(const double size[2])
{
    static const double MOST = INT32_MAX;
    return size[0] >= 1 && size[0] <= MOST && size[1] >= 1 && size[1] <= MOST && size[0] == floor(size[0]) &&
           size[1] == floor(size[1]);
}

/* Report and quote as text that may stand in a script element; the caller frees *data with cJSON_free. */
static int32_t make_data(const char *report, const char *quote, uint32_t layer_count, const double size[2], char **data,
                         struct lull_error *err)
{
    double wanted[2] = {0.0, 0.0};
    int failed = 0;
    cJSON *root = cJSON_CreateObject(), *r = cJSON_Parse(report), *q = quote ? cJSON_Parse(quote) : cJSON_CreateNull();
    int32_t code = LULL_OK;
    if (!find_size(r, wanted))
        code = lull_error_set(err, LULL_E_INVALID, "no report (expected what lull-render --report writes)");
    else if (!is_size(wanted))
        code =
            lull_error_set(err, LULL_E_INVALID, "a report of %gx%g pixels: no picture has this size", wanted[0], wanted[1]);
    else if (quote && !cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(q, "rows")))
        code = lull_error_set(err, LULL_E_INVALID, "no quote (expected what lull-render --quote --json prints)");
    else if (layer_count > 0 && (size[0] != wanted[0] || size[1] != wanted[1]))
        code = lull_error_set(err, LULL_E_INVALID, "the picture has %.0fx%.0f pixels, the report is of %.0fx%.0f", size[0],
                              size[1], wanted[0], wanted[1]);
    base_json_item(root, "report", r, &failed);
    base_json_item(root, "quote", q, &failed);
    char *text = failed || code != LULL_OK ? NULL : cJSON_PrintUnformatted(root);
    if (text && strlen(text) > HISTORY_LIMIT && cJSON_HasObjectItem(r, "history")) {
        cJSON_free(text);
        cJSON_DeleteItemFromObject(r, "history");
        text = cJSON_PrintUnformatted(root);
    }
    cJSON_Delete(root);
    *data = text;
    return text || code != LULL_OK ? code : lull_host_no_memory(err, "the page");
}

static void put_base64(FILE *file, const uint8_t *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t n = size - i < 3 ? size - i : 3;
        const uint32_t v = (uint32_t)bytes[i] << 16 | (n > 1 ? (uint32_t)bytes[i + 1] << 8 : 0) | (n > 2 ? bytes[i + 2] : 0);
        for (unsigned k = 0; k < 4; k++)
            putc(k <= n ? digits[v >> (18 - 6 * k) & 63] : '=', file);
    }
}

/* Text of an attribute. */
static void put_escaped(FILE *file, const char *text)
{
    for (; *text; text++)
        if (strchr("&<>\"'", *text))
            fprintf(file, "&#%d;", *text);
        else
            putc(*text, file);
}

static int32_t put_layer(FILE *file, const struct lull_host_layer *layer, uint32_t width, uint32_t height,
                         struct lull_error *err)
{
    struct base_err why = {0};
    uint8_t *bytes;
    size_t size;
    if (pic_png_bytes((int32_t)width, (int32_t)height, layer->rgb, &bytes, &size, &why))
        return lull_host_translate(&why, err);
    fputs("<img alt=\"\" data-layer=\"", file);
    put_escaped(file, layer->name);
    fputs("\" src=\"data:image/png;base64,", file);
    put_base64(file, bytes, size);
    fputs("\">\n", file);
    free(bytes);
    return LULL_OK;
}

/* '<' stands in strings only: written so, no text ends the element that it is in. */
static void put_data(FILE *file, const char *json)
{
    for (; *json; json++)
        if (*json == '<')
            fputs("\\u003c", file);
        else
            putc(*json, file);
}

static int32_t put_page(FILE *file, const char *data, const struct lull_host_layer *layers, uint32_t layer_count,
                        uint32_t width, uint32_t height, struct lull_error *err)
{
    static const char pictures_here[] = "<!-- pictures -->", data_here[] = "/* data */";
    const char *pictures = strstr(lull_host_page_html, pictures_here), *text = strstr(lull_host_page_html, data_here);
    int32_t code = LULL_OK;
    fwrite(lull_host_page_html, 1, (size_t)(pictures - lull_host_page_html), file);
    for (uint32_t i = 0; i < layer_count && code == LULL_OK; i++)
        code = put_layer(file, &layers[i], width, height, err);
    pictures += strlen(pictures_here);
    fwrite(pictures, 1, (size_t)(text - pictures), file);
    put_data(file, data);
    fputs(text + strlen(data_here), file);
    return code;
}

int32_t lull_host_page(const char *report, const char *quote, const struct lull_host_layer *layers, uint32_t layer_count,
                       uint32_t width, uint32_t height, const char *path, struct lull_error *err)
{
    struct base_err e = {0};
    struct base_file_out out;
    const double size[2] = {width, height};
    char *data = NULL;
    int32_t code =
        lull_host_given(err, "report", report, "path", path, "layers", layer_count > 0 ? layers : (const void *)path, NULL);
    for (uint32_t i = 0; i < layer_count && code == LULL_OK; i++)
        code = lull_host_given(err, "the name of a layer", layers[i].name, "rgb of a layer", layers[i].rgb, NULL);
    if (code == LULL_OK)
        code = make_data(report, quote, layer_count, size, &data, err);
    if (code != LULL_OK)
        return code;
    if (base_file_begin(&out, path, &e) != 0)
        code = lull_host_translate(&e, err);
    else {
        code = put_page(out.file, data, layers, layer_count, width, height, err);
        if (code != LULL_OK)
            base_file_abort(&out);
        else if (base_file_commit(&out, &e) != 0)
            code = lull_host_translate(&e, err);
    }
    cJSON_free(data);
    return code;
}
