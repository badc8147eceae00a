#include "pbrt/ply.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/options.h"
#include "pbrt/lexer.h"

enum ply_type { T_NONE, T_I8, T_U8, T_I16, T_U16, T_I32, T_U32, T_F32, T_F64 };
static const uint8_t type_bytes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
static const char *const type_names[] = {"none", "char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
static const char *const sized_names[] = {"none",  "int8",   "uint8",   "int16",  "uint16",
                                          "int32", "uint32", "float32", "float64"};

/* What a property means to us. */
enum role { R_SKIP, R_X, R_Y, R_Z, R_NX, R_NY, R_NZ, R_U, R_V, R_INDICES, R_CORNER_UVS };

enum { MAX_PROPERTIES = 512, MAX_ELEMENTS = 16, MAX_CORNERS = 1 << 16 };

struct property {
    enum ply_type type, count_type; /* count_type: T_NONE unless a list */
    enum role role;
};
struct element {
    char name[32];
    uint64_t count;
    int property_count;
    struct property properties[MAX_PROPERTIES];
};

struct reader {
    const char *name;
    const char *at, *end;
    struct base_err *err;
    int ascii, swap;
    char newline; /* of the header: '\n', also after '\r'; '\r' alone */
    int element_count;
    struct element elements[MAX_ELEMENTS];
    struct pt_ply *ply;
    int has_vertices;
    uint64_t vertex_total; /* that the header promises: faces may come first */
    size_t index_room;
    int has[R_CORNER_UVS + 1];
    float *column[R_V + 1]; /* where the first vertex's value of a role goes, NULL: nowhere */
};

/* By the end of the first line, because behind a binary header either character may be data. */
static char newline_of(const char *at, const char *end)
{
    while (at < end && *at != '\n' && *at != '\r')
        at++;
    return at + 1 < end && at[0] == '\r' && at[1] != '\n' ? '\r' : '\n';
}

/* Next line of the header without its end; 0 at the end of the file. */
static int next_line(struct reader *r, char *line, size_t room)
{
    size_t n = 0;
    if (r->at >= r->end)
        return 0;
    while (r->at < r->end && *r->at != r->newline) {
        if (n + 1 < room)
            line[n++] = *r->at;
        r->at++;
    }
    if (r->at < r->end)
        r->at++;
    while (n > 0 && (line[n - 1] == '\r' || line[n - 1] == ' '))
        n--;
    line[n] = '\0';
    return 1;
}

/* Splits in place; returns the number of words. */
static int split(char *line, char *words[], int max)
{
    int n = 0;
    for (char *save = NULL, *w = strtok_r(line, " \t", &save); w && n < max; w = strtok_r(NULL, " \t", &save))
        words[n++] = w;
    return n;
}

static enum ply_type type_of(const char *name)
{
    enum ply_type type = T_F64;
    while (type > T_NONE && strcmp(type_names[type], name) != 0 && strcmp(sized_names[type], name) != 0)
        type--;
    return type;
}

static enum role role_of(const struct element *e, const char *name, int is_list)
{
    static const struct vertex_role {
        const char *name;
        enum role role;
    } roles[] = {{"x", R_X},         {"y", R_Y},         {"z", R_Z},         {"nx", R_NX},      {"ny", R_NY},
                 {"nz", R_NZ},       {"u", R_U},         {"v", R_V},         {"s", R_U},        {"t", R_V},
                 {"texture_u", R_U}, {"texture_v", R_V}, {"texture_s", R_U}, {"texture_t", R_V}};
    if (strcmp(e->name, "face") == 0 && is_list && (strcmp(name, "texcoord") == 0 || strcmp(name, "texcoords") == 0))
        return R_CORNER_UVS;
    if (strcmp(e->name, "face") == 0 && is_list)
        return strcmp(name, "vertex_indices") == 0 || strcmp(name, "vertex_index") == 0 ? R_INDICES : R_SKIP;
    const struct vertex_role *known = strcmp(e->name, "vertex") == 0 && !is_list ? pt_row(roles, name) : NULL;
    return known ? known->role : R_SKIP;
}

static int read_property(struct reader *r, struct element *e, char *words[], int n)
{
    int is_list = n == 5 && strcmp(words[1], "list") == 0;
    if (!e || (n != 3 && !is_list))
        return base_fail(r->err, BASE_EINVAL, "%s: malformed PLY property", r->name);
    if (e->property_count == MAX_PROPERTIES)
        return base_fail(r->err, BASE_EINVAL, "%s: more than %d PLY properties", r->name, MAX_PROPERTIES);
    struct property p = {.type = type_of(words[is_list ? 3 : 1]), .count_type = is_list ? type_of(words[2]) : T_NONE};
    if (p.type == T_NONE || (is_list && (p.count_type == T_NONE || p.count_type >= T_F32)))
        return base_fail(r->err, BASE_EINVAL, "%s: unknown PLY type \"%.20s\"", r->name, words[is_list ? 3 : 1]);
    p.role = role_of(e, words[n - 1], is_list);
    if (p.role == R_INDICES && p.type >= T_F32)
        return base_fail(r->err, BASE_EINVAL, "%s: PLY indices of type \"%.20s\" (expected integers)", r->name, words[3]);
    if (p.role != R_SKIP && r->has[p.role]++)
        return base_fail(r->err, BASE_EINVAL, "%s: PLY property \"%.20s\" occurs twice", r->name, words[n - 1]);
    e->properties[e->property_count++] = p;
    return 0;
}

static int read_element(struct reader *r, char *words[], int n)
{
    double count = -1;
    if (n != 3 || !pt_number_parse(words[2], strlen(words[2]), &count) || count < 0 || count != floor(count))
        return base_fail(r->err, BASE_EINVAL, "%s: malformed PLY element", r->name);
    if (count > 4294967295.0 || r->element_count == MAX_ELEMENTS)
        return base_fail(r->err, BASE_EINVAL, "%s: PLY element count %.20s is too large", r->name, words[2]);
    struct element *e = &r->elements[r->element_count++];
    strncpy(e->name, words[1], sizeof e->name - 1);
    e->count = (uint64_t)count;
    if (strcmp(e->name, "vertex") != 0)
        return 0;
    if (r->has_vertices++)
        return base_fail(r->err, BASE_EINVAL, "%s: PLY element \"vertex\" occurs twice", r->name);
    r->vertex_total = e->count;
    return 0;
}

/* All elements and properties are listed, in the order of the data: what means nothing here has to be passed over, too. */
static int read_header(struct reader *r)
{
    char line[512], *words[6];
    struct element *e = NULL;
    int has_format = 0;
    const uint16_t probe = 1;
    const int is_big = *(const uint8_t *)&probe == 0;
    static const char *const formats[] = {"binary_little_endian", "binary_big_endian", "ascii", NULL};
    r->newline = newline_of(r->at, r->end);
    if (!next_line(r, line, sizeof line) || strcmp(line, "ply") != 0)
        return base_fail(r->err, BASE_EINVAL, "%s: not a PLY file", r->name);
    while (next_line(r, line, sizeof line)) {
        int n = split(line, words, 6), rc = 0;
        if (n == 0 || strcmp(words[0], "comment") == 0 || strcmp(words[0], "obj_info") == 0)
            continue;
        if (strcmp(words[0], "end_header") == 0)
            return has_format ? 0 : base_fail(r->err, BASE_EINVAL, "%s: PLY header without a format", r->name);
        if (strcmp(words[0], "format") == 0 && n >= 2) {
            const int format = base_word_index(formats, words[1], strlen(words[1]));
            has_format = 1;
            r->ascii = format == 2;
            r->swap = format != is_big;
            if (format < 0)
                rc = base_fail(r->err, BASE_EINVAL, "%s: unknown PLY format \"%.30s\"", r->name, words[1]);
        } else if (strcmp(words[0], "element") == 0) {
            rc = read_element(r, words, n);
            e = r->element_count > 0 ? &r->elements[r->element_count - 1] : NULL;
        } else if (strcmp(words[0], "property") == 0) {
            rc = read_property(r, e, words, n);
        } else {
            rc = base_fail(r->err, BASE_EINVAL, "%s: unknown PLY header line \"%.30s\"", r->name, words[0]);
        }
        if (rc)
            return rc;
    }
    return base_fail(r->err, BASE_EINVAL, "%s: truncated PLY header", r->name);
}

static int truncated(struct reader *r) { return base_fail(r->err, BASE_EINVAL, "%s: truncated PLY file", r->name); }

/* What exporters write for a number that is none, those of Microsoft's C library 1.#IND, 1.#QNAN or 1.#INF; where one is
 * needed, its reader refuses it. */
static int is_no_number(const char *text, size_t n)
{
    size_t sign = n > 0 && (text[0] == '-' || text[0] == '+');
    return n >= sign + 3 && (strncasecmp(text + sign, "nan", 3) == 0 || strncasecmp(text + sign, "inf", 3) == 0 ||
                             strncmp(text + sign, "1.#", 3) == 0);
}

static int ascii_value(struct reader *r, double *out)
{
    while (r->at < r->end && (*r->at == ' ' || *r->at == '\n' || *r->at == '\t' || *r->at == '\r'))
        r->at++;
    const char *start = r->at;
    while (r->at < r->end && *r->at != ' ' && *r->at != '\n' && *r->at != '\t' && *r->at != '\r')
        r->at++;
    if (start == r->at)
        return truncated(r);
    size_t n = (size_t)(r->at - start);
    if (pt_number_parse(start, n, out))
        return 0;
    if (!is_no_number(start, n))
        return base_fail(r->err, BASE_EINVAL, "%s: \"%.*s\" in PLY data (expected a finite number)", r->name,
                         n < 30 ? (int)n : 30, start);
    *out = NAN;
    return 0;
}

/* By a copy: values of a file are not aligned, and may be of the other byte order. */
static double decode(const char *at, enum ply_type type, int swap)
{
    unsigned char b[8];
    int n = type_bytes[type];
    for (int i = 0; i < n; i++)
        b[i] = (unsigned char)at[swap ? n - 1 - i : i];
    union {
        int8_t i8;
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        int32_t i32;
        uint32_t u32;
        float f32;
        double f64;
    } v;
    memcpy(&v, b, (size_t)n);
    switch (type) {
    case T_I8: return v.i8;
    case T_U8: return v.u8;
    case T_I16: return v.i16;
    case T_U16: return v.u16;
    case T_I32: return v.i32;
    case T_U32: return v.u32;
    case T_F32: return (double)v.f32;
    default: return v.f64;
    }
}

static int read_value(struct reader *r, enum ply_type type, double *out)
{
    if (r->ascii)
        return ascii_value(r, out);
    if ((size_t)(r->end - r->at) < type_bytes[type])
        return truncated(r);
    *out = decode(r->at, type, r->swap);
    r->at += type_bytes[type];
    return 0;
}

static int store_vertex_value(struct reader *r, uint64_t i, enum role role, float v)
{
    const int is_uv = role >= R_U;
    if (role <= R_Z && !isfinite(v))
        return base_fail(r->err, BASE_EINVAL, "%s: vertex %llu is not finite", r->name, (unsigned long long)i);
    if (r->column[role])
        r->column[role][i * (is_uv ? 2 : 3)] = is_uv && !isfinite(v) ? 0.0f : v;
    return 0;
}

static int add_triangle(struct reader *r, uint32_t a, uint32_t b, uint32_t c)
{
    struct pt_ply *p = r->ply;
    if (p->triangle_count == UINT32_MAX / 3)
        return base_fail(r->err, BASE_EINVAL, "%s: too many triangles", r->name);
    if (!pt_grow((void **)&p->indices, &r->index_room, p->triangle_count, 3 * sizeof *p->indices))
        return base_fail_nomem(r->err, r->name);
    uint32_t *t = p->indices + 3 * (size_t)p->triangle_count++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
    return 0;
}

static int read_list(struct reader *r, const struct property *p)
{
    double count, value;
    uint32_t first = 0, previous = 0;
    int rc = read_value(r, p->count_type, &count);
    if (rc)
        return rc;
    if (count < 0 || count > MAX_CORNERS || count != floor(count))
        return base_fail(r->err, BASE_EINVAL, "%s: PLY list of %g values", r->name, count);
    for (int k = 0; k < (int)count; k++) {
        rc = read_value(r, p->type, &value);
        if (rc)
            return rc;
        if (p->role != R_INDICES)
            continue;
        if (!(value >= 0 && value < (double)r->vertex_total) || value != floor(value))
            return base_fail(r->err, BASE_EINVAL, "%s: vertex index %.0f out of range (expected 0 to %lld)", r->name, value,
                             (long long)r->vertex_total - 1);
        uint32_t index = (uint32_t)value;
        if (k == 0)
            first = index;
        else if (k >= 2 && (rc = add_triangle(r, first, previous, index)) != 0)
            return rc;
        previous = index;
    }
    return 0;
}

/* Fewest bytes that one item of the element can take: what the file holds bounds what is allocated. */
static size_t least_bytes(const struct reader *r, const struct element *e)
{
    size_t n = 0;
    for (int i = 0; i < e->property_count; i++) {
        const struct property *p = &e->properties[i];
        n += r->ascii ? 2 : type_bytes[p->count_type != T_NONE ? p->count_type : p->type];
    }
    return n;
}

static int begin_vertices(struct reader *r, const struct element *e)
{
    struct pt_ply *p = r->ply;
    const struct {
        int role, size;
        float **array;
    } kinds[] = {{R_X, 3, &p->positions}, {R_NX, 3, &p->normals}, {R_U, 2, &p->uvs}};
    if (!r->has[R_X] || !r->has[R_Y] || !r->has[R_Z])
        return base_fail(r->err, BASE_EINVAL, "%s: PLY vertices without x, y and z", r->name);
    if (e->count > INT32_MAX)
        return base_fail(r->err, BASE_EINVAL, "%s: %llu vertices are too many", r->name, (unsigned long long)e->count);
    for (int i = 0; i < 3; i++) {
        const int role = kinds[i].role, size = kinds[i].size;
        if (!r->has[role] || !r->has[role + 1] || !r->has[role + size - 1])
            continue;
        float *array = *kinds[i].array = calloc(e->count > 0 ? (size_t)e->count : 1, (size_t)size * sizeof *array);
        if (!array)
            return base_fail_nomem(r->err, r->name);
        for (int k = 0; k < size; k++)
            r->column[role + k] = array + k;
    }
    p->vertex_count = (uint32_t)e->count;
    return 0;
}

static int read_items(struct reader *r, const struct element *e)
{
    int is_vertex = strcmp(e->name, "vertex") == 0, rc = 0;
    size_t least = least_bytes(r, e), left = (size_t)(r->end - r->at);
    if (e->count > 0 && (least == 0 || e->count > (left + 1) / least))
        return least == 0 ? 0 : truncated(r);
    if (is_vertex && (rc = begin_vertices(r, e)) != 0)
        return rc;
    for (uint64_t i = 0; i < e->count; i++)
        for (int k = 0; k < e->property_count; k++) {
            const struct property *p = &e->properties[k];
            double v;
            if (p->count_type != T_NONE)
                rc = read_list(r, p);
            else if ((rc = read_value(r, p->type, &v)) == 0 && is_vertex && p->role != R_SKIP)
                rc = store_vertex_value(r, i, p->role, (float)v);
            if (rc)
                return rc;
        }
    return 0;
}

int pt_ply_parse(const char *name, const char *bytes, size_t size, struct pt_ply *out, struct base_err *err)
{
    struct pt_ply ply = {0};
    struct reader *r = calloc(1, sizeof *r);
    if (!r)
        return base_fail_nomem(err, name);
    *r = (struct reader){.name = name, .at = bytes, .end = bytes + size, .err = err, .ply = &ply};
    int rc = read_header(r);
    for (int i = 0; i < r->element_count && !rc; i++)
        rc = read_items(r, &r->elements[i]);
    if (!rc && !ply.positions)
        rc = base_fail(err, BASE_EINVAL, "%s: PLY file without vertices", name);
    if (!rc && !r->has[R_INDICES])
        rc = base_fail(err, BASE_EINVAL, "%s: PLY file without faces", name);
    ply.corner_uvs = r->has[R_CORNER_UVS];
    free(r);
    if (rc) {
        pt_ply_release(&ply);
        return rc;
    }
    *out = ply;
    return 0;
}

void pt_ply_release(struct pt_ply *ply)
{
    free(ply->positions);
    free(ply->normals);
    free(ply->uvs);
    free(ply->indices);
    *ply = (struct pt_ply){0};
}
