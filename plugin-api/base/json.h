/*
 * Building JSON so that running out of memory is noticed: a failed addition sets *failed and is looked at once, at the end.
 * Objects passed in may be NULL (an earlier failure). Numbers of what was read, held to their range. Not thread-safe.
 */
#ifndef BASE_JSON_H
#define BASE_JSON_H

#include <cjson/cJSON.h>
#include <stdint.h>

#include "base/err.h"

/* NaN and infinity have no form in JSON: null says "not known". key NULL: appends to an array. */
void base_json_number(cJSON *to, const char *key, double value, int *failed);
/* text NULL: null. Bytes that are not UTF-8 become '?'. */
void base_json_text(cJSON *to, const char *key, const char *text, int *failed);
void base_json_bool(cJSON *to, const char *key, int value, int *failed);
/* New member or element; borrowed from `to`. */
cJSON *base_json_object(cJSON *to, const char *key, int *failed);
cJSON *base_json_array(cJSON *to, const char *key, int *failed);

/* All of an array. */
void base_json_numbers(cJSON *to, const char *key, const double *values, int count, int *failed);

/* Puts item, which may be NULL (an earlier failure), into `to`, which owns it from here on. */
void base_json_item(cJSON *to, const char *key, cJSON *item, int *failed);

/* Writes root as text, unless failed: atomically, or (path NULL) to standard output. root stays the caller's. */
int base_json_write(const char *path, const cJSON *root, int failed, struct base_err *err);

/* Whether object has a number `key` in [lo, hi]; then *out is it. */
int base_json_get(const cJSON *object, const char *key, double lo, double hi, double *out);
/* And a whole one; lo >= 0, and 2^64 is the largest that *out can be. */
int base_json_get_whole(const cJSON *object, const char *key, double lo, double hi, uint64_t *out);
/* The same of what must be there: BASE_EINVAL says what is wrong with it. */
int base_json_need(const cJSON *object, const char *key, double lo, double hi, double *out, struct base_err *err);
int base_json_need_int(const cJSON *object, const char *key, int lo, int hi, int *out, struct base_err *err);

#endif
