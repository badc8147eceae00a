/* What the manifests of both versions have in common. Private to sequence/. */
#ifndef SEQUENCE_MANIFEST_JSON_H
#define SEQUENCE_MANIFEST_JSON_H

#include <cjson/cJSON.h>

#include "sequence/manifest.h"

/* Whether it is there and has room; else it is cut. */
int seq_json_get_text(const cJSON *o, const char *name, char *out, size_t room);
int seq_json_get_u32(const cJSON *o, const char *name, double lo, double hi, uint32_t *out);
/* Eight hex digits. */
int seq_json_get_crc(const cJSON *o, const char *name, uint32_t *crc);
void seq_json_put_crc(cJSON *to, const char *name, uint32_t crc, int *failed);

/* Reads DIR/manifest.json; path: its name. The caller frees *text. */
int seq_json_read(const char *dir, char path[4096], char **text, size_t *size, struct base_err *err);
/* All but blocks and what is in files. Another version is refused by name. */
int seq_json_get_head(const char *path, const cJSON *root, unsigned version, struct seq_manifest *m, struct base_err *err);
void seq_json_put_head(cJSON *root, int version, const struct seq_manifest *m, int *failed);

#endif
