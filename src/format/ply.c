/* SPDX-License-Identifier: Apache-2.0
 *
 * PLY 1.0: ascii, binary_little_endian, binary_big_endian. Of vertices x y z, nx ny nz
 * and uv are read, of faces vertex_index or vertex_indices; other properties are skipped.
 */
#include "base/number.h"
#include "mesh_file.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define ELEMENTS_MAX   64
#define PROPERTIES_MAX 256

enum ply_format { PLY_ASCII, PLY_LITTLE, PLY_BIG };
enum ply_type {
    PLY_I8,
    PLY_U8,
    PLY_I16,
    PLY_U16,
    PLY_I32,
    PLY_U32,
    PLY_F32,
    PLY_F64,
    PLY_NONE
};
static const int type_bytes[] = {1, 1, 2, 2, 4, 4, 4, 8};

/* Meaning of a vertex property; SKIP: ignored. */
enum ply_use {
    USE_X,
    USE_Y,
    USE_Z,
    USE_NX,
    USE_NY,
    USE_NZ,
    USE_U,
    USE_V,
    USES,
    USE_SKIP
};

struct ply_property {
    enum ply_type type, count; /* count NONE: a scalar */
    enum ply_use use;
    bool indices;
};
struct ply_element {
    char name[32];
    size_t n;
    int first, n_properties; /* in ply.properties */
};

struct ply {
    const struct imp_mesh_source *source;
    imp_context *ctx;
    const unsigned char *at, *end;
    int64_t line; /* of the header, and of ascii bodies */
    enum ply_format format;
    struct ply_element elements[ELEMENTS_MAX];
    struct ply_property properties[PROPERTIES_MAX];
    int n_elements, n_properties, vertex, face;
    float *positions, *normals, *uvs;
    uint32_t *indices;
};

static enum imp_status IMP_PRINTF(2, 3)
    ply_error(const struct ply *p, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(p->ctx, IMP_E_SCENE, "%s: %s", p->source->name, text);
}

/* ---- Header -------------------------------------------------------------------- */

static enum ply_type type_of(const char *word)
{
    static const char *const names[2][8] = {
        {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"},
        {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"}};
    for (int i = 0; i < 16; i++)
        if (strcmp(names[i / 8][i % 8], word) == 0) return (enum ply_type)(i % 8);
    return PLY_NONE;
}

static enum ply_use use_of(const char *name)
{
    static const struct {
        const char *name;
        enum ply_use use;
    } uses[] = {{"x", USE_X},   {"y", USE_Y},         {"z", USE_Z},
                {"nx", USE_NX}, {"ny", USE_NY},       {"nz", USE_NZ},
                {"u", USE_U},   {"v", USE_V},         {"s", USE_U},
                {"t", USE_V},   {"texture_u", USE_U}, {"texture_v", USE_V}};
    for (size_t i = 0; i < imp_count(uses); i++)
        if (strcmp(uses[i].name, name) == 0) return uses[i].use;
    return USE_SKIP;
}

/* Words of the next header line; false at the end of the file. */
static bool line_split(struct ply *p, char *line, size_t size, char *words[5], int *n)
{
    const unsigned char *stop = memchr(p->at, '\n', (size_t)(p->end - p->at));
    if (!stop || (size_t)(stop - p->at) >= size) return false;
    const size_t length = (size_t)(stop - p->at);
    memcpy(line, p->at, length);
    line[length] = 0;
    p->at = stop + 1;
    p->line++;
    *n = 0;
    for (char *s = line; *(s += strspn(s, " \t\r"));) {
        const size_t word = strcspn(s, " \t\r");
        if (*n < 5) words[(*n)++] = s;
        const bool last = s[word] == 0;
        s[word] = 0;
        if (last) break;
        s += word + 1;
    }
    return true;
}

static enum imp_status element_add(struct ply *p, const char *name, const char *count)
{
    const char *s = count, *end = s + strlen(s);
    int64_t n;
    if (!imp__integer(&s, end, &n) || s != end || n < 0)
        return ply_error(p, "line %lld: '%.40s' is not a count", (long long)p->line,
                         count);
    if (p->n_elements == ELEMENTS_MAX)
        return ply_error(p, "more than %d elements", ELEMENTS_MAX);
    struct ply_element *e = &p->elements[p->n_elements];
    e->n = (size_t)n;
    e->first = p->n_properties;
    snprintf(e->name, sizeof e->name, "%s", name);
    int *known = strcmp(name, "vertex") == 0 ? &p->vertex
                 : strcmp(name, "face") == 0 ? &p->face
                                             : NULL;
    if (known && *known >= 0) return ply_error(p, "element '%s' is there twice", name);
    if (known && e->n > IMP_MESH_MAX)
        return ply_error(p, "%zu of element %s: too many", e->n, name);
    if (known) *known = p->n_elements;
    p->n_elements++;
    return IMP_OK;
}

static enum imp_status property_add(struct ply *p, char *const words[5], int n)
{
    const bool list = n == 5 && strcmp(words[1], "list") == 0;
    if (p->n_elements == 0 || (n != 3 && !list))
        return ply_error(p, "line %lld: malformed property", (long long)p->line);
    if (p->n_properties == PROPERTIES_MAX)
        return ply_error(p, "more than %d properties", PROPERTIES_MAX);
    struct ply_element *e = &p->elements[p->n_elements - 1];
    struct ply_property q = {
        .type = type_of(words[list ? 3 : 1]), .count = PLY_NONE, .use = USE_SKIP};
    if (list) q.count = type_of(words[2]);
    if (q.type == PLY_NONE || (list && (q.count == PLY_NONE || q.count >= PLY_F32)))
        return ply_error(p, "line %lld: unknown type", (long long)p->line);
    const char *name = words[list ? 4 : 2];
    if (p->vertex == p->n_elements - 1 && !list) q.use = use_of(name);
    if (p->face == p->n_elements - 1 && list)
        q.indices =
            strcmp(name, "vertex_index") == 0 || strcmp(name, "vertex_indices") == 0;
    for (int i = e->first; i < p->n_properties; i++)
        if ((q.use != USE_SKIP && p->properties[i].use == q.use) ||
            (q.indices && p->properties[i].indices))
            return ply_error(p, "line %lld: property '%.40s' is there twice",
                             (long long)p->line, name);
    p->properties[p->n_properties++] = q;
    e->n_properties++;
    return IMP_OK;
}

static bool has_use(const struct ply *p, enum ply_use use)
{
    const struct ply_element *e = &p->elements[p->vertex];
    for (int i = 0; i < e->n_properties; i++)
        if (p->properties[e->first + i].use == use) return true;
    return false;
}

static enum imp_status header_read(struct ply *p)
{
    enum imp_status st = IMP_OK;
    char line[1024], *words[5];
    bool format = false;
    for (int n = 0;;) {
        if (!line_split(p, line, sizeof line, words, &n))
            IMP_TRY(ply_error(p, "the header does not end"));
        if (p->line == 1) {
            if (n != 1 || strcmp(words[0], "ply") != 0)
                IMP_TRY(ply_error(p, "not a PLY file"));
        } else if (n == 3 && strcmp(words[0], "format") == 0) {
            static const char *const names[] = {"ascii", "binary_little_endian",
                                                "binary_big_endian"};
            for (int i = 0; i < 3; i++)
                if (strcmp(words[1], names[i]) == 0) {
                    p->format = (enum ply_format)i;
                    format = true;
                }
            if (!format || strcmp(words[2], "1.0") != 0)
                IMP_TRY(ply_error(p, "unknown format '%.40s %.40s'", words[1], words[2]));
        } else if (n == 3 && strcmp(words[0], "element") == 0)
            IMP_TRY(element_add(p, words[1], words[2]));
        else if (n >= 1 && strcmp(words[0], "property") == 0)
            IMP_TRY(property_add(p, words, n));
        else if (n == 1 && strcmp(words[0], "end_header") == 0) break;
        else if (n > 0 && strcmp(words[0], "comment") != 0 &&
                 strcmp(words[0], "obj_info") != 0)
            IMP_TRY(ply_error(p, "line %lld: unknown header line '%.40s'",
                              (long long)p->line, words[0]));
    }
    p->line++; /* of what follows */
    if (!format) IMP_TRY(ply_error(p, "the header names no format"));
    if (p->vertex < 0 || p->elements[p->vertex].n == 0)
        IMP_TRY(ply_error(p, "has no vertices"));
    if (p->face < 0 || p->elements[p->face].n == 0) IMP_TRY(ply_error(p, "has no faces"));
    if (!has_use(p, USE_X) || !has_use(p, USE_Y) || !has_use(p, USE_Z))
        IMP_TRY(ply_error(p, "vertices have no x, y, z"));
    bool indices = false;
    const struct ply_element *e = &p->elements[p->face];
    for (int i = 0; i < e->n_properties; i++)
        indices |= p->properties[e->first + i].indices;
    if (!indices) IMP_TRY(ply_error(p, "faces have no vertex_index or vertex_indices"));
out:
    return st;
}

/* Fewest bytes a row of the element takes: bounds the counts of the header by the size of
 * the file before anything is allocated. */
static size_t row_bytes_min(const struct ply *p, const struct ply_element *e)
{
    size_t bytes = 0;
    for (int i = 0; i < e->n_properties; i++) {
        const struct ply_property *q = &p->properties[e->first + i];
        const enum ply_type type = q->count == PLY_NONE ? q->type : q->count;
        const size_t items = q->indices ? 4 : 1;
        bytes += p->format == PLY_ASCII
                     ? 2 * items
                     : (size_t)type_bytes[type] +
                           (q->indices ? 3 * (size_t)type_bytes[q->type] : 0);
    }
    return bytes;
}

static enum imp_status counts_check(const struct ply *p)
{
    size_t left =
        (size_t)(p->end - p->at) + 1; /* the last blank of ascii may be missing */
    for (int i = 0; i < p->n_elements; i++) {
        const struct ply_element *e = &p->elements[i];
        const size_t row = row_bytes_min(p, e);
        if (row && e->n > left / row)
            return ply_error(p, "is cut off: %zu of element '%s' do not fit in the file",
                             e->n, e->name);
        left -= e->n * row;
    }
    return IMP_OK;
}

/* ---- Body ---------------------------------------------------------------------- */

/* The next number; false at the end of the file, or if it is none. */
static inline bool number_read(struct ply *p, enum ply_type type, double *out)
{
    if (p->format == PLY_ASCII) {
        const char *s = (const char *)p->at, *end = (const char *)p->end;
        for (; s < end && (*s == ' ' || *s == '\n' || *s == '\t' || *s == '\r'); s++)
            p->line += *s == '\n';
        const bool ok = imp__number(&s, end, out);
        p->at = (const unsigned char *)s;
        return ok && (s == end || *s == ' ' || *s == '\n' || *s == '\t' || *s == '\r');
    }
    const int n = type_bytes[type];
    if (p->end - p->at < n) return false;
    uint64_t bits = 0;
    for (int i = 0; i < n; i++)
        bits |= (uint64_t)p->at[p->format == PLY_LITTLE ? i : n - 1 - i] << (8 * i);
    p->at += n;
    switch (type) {
    case PLY_I8: *out = (int8_t)bits; break;
    case PLY_U8: *out = (uint8_t)bits; break;
    case PLY_I16: *out = (int16_t)bits; break;
    case PLY_U16: *out = (uint16_t)bits; break;
    case PLY_I32: *out = (int32_t)bits; break;
    case PLY_U32: *out = (uint32_t)bits; break;
    case PLY_F32: {
        const uint32_t word = (uint32_t)bits;
        float f;
        memcpy(&f, &word, sizeof f);
        *out = f;
        break;
    }
    case PLY_F64: memcpy(out, &bits, sizeof *out); break;
    case PLY_NONE: return false;
    }
    return true;
}

static enum imp_status row_error(const struct ply *p, const struct ply_element *e,
                                 size_t row)
{
    if (p->format == PLY_ASCII && p->at < p->end)
        return ply_error(p, "line %lld: malformed number in %s %zu", (long long)p->line,
                         e->name, row);
    return ply_error(p, "is cut off in %s %zu", e->name, row);
}

static enum imp_status list_skip(struct ply *p, const struct ply_property *q,
                                 const struct ply_element *e, size_t row, double count)
{
    if (!(count >= 0) || count != floor(count) || count > 0xffffffffu)
        return ply_error(p, "%s %zu: a list of %g items", e->name, row, count);
    if (p->format != PLY_ASCII) {
        const uint64_t bytes = (uint64_t)count * (uint64_t)type_bytes[q->type];
        if ((uint64_t)(p->end - p->at) < bytes) return row_error(p, e, row);
        p->at += bytes;
        return IMP_OK;
    }
    for (double skip, k = 0; k < count; k++)
        if (!number_read(p, q->type, &skip)) return row_error(p, e, row);
    return IMP_OK;
}

static enum imp_status vertex_store(struct ply *p, size_t row, const double value[USES])
{
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz", "u", "v"};
    float f[USES];
    for (int i = 0; i < USES; i++) {
        f[i] = (float)value[i];
        if (!isfinite(f[i]))
            return ply_error(p, "vertex %zu: %s is not finite", row, names[i]);
    }
    memcpy(p->positions + 3 * row, f + USE_X, 3 * sizeof *f);
    if (p->normals) memcpy(p->normals + 3 * row, f + USE_NX, 3 * sizeof *f);
    if (p->uvs) {
        p->uvs[2 * row] = f[USE_U];
        p->uvs[2 * row + 1] = p->source->flip_v ? 1 - f[USE_V] : f[USE_V];
    }
    return IMP_OK;
}

static enum imp_status corners_read(struct ply *p, const struct ply_property *q,
                                    const struct ply_element *e, size_t row, double count)
{
    if (count != 3)
        return ply_error(p, "face %zu has %g corners: only triangles are read", row,
                         count);
    for (int k = 0; k < 3; k++) {
        double i;
        if (!number_read(p, q->type, &i)) return row_error(p, e, row);
        if (!(i >= 0) || i >= (double)p->elements[p->vertex].n || i != floor(i))
            return ply_error(p, "face %zu names vertex %g; there are %zu", row, i,
                             p->elements[p->vertex].n);
        p->indices[3 * row + (size_t)k] = (uint32_t)i;
    }
    return IMP_OK;
}

static enum imp_status element_read(struct ply *p, int index)
{
    enum imp_status st = IMP_OK;
    const struct ply_element *e = &p->elements[index];
    if (e->n_properties == 0) return IMP_OK;
    for (size_t row = 0; row < e->n; row++) {
        double value[USES + 2] = {0};
        for (int i = 0; i < e->n_properties; i++) {
            const struct ply_property *q = &p->properties[e->first + i];
            double x;
            if (!number_read(p, q->count == PLY_NONE ? q->type : q->count, &x))
                IMP_TRY(row_error(p, e, row));
            if (q->count == PLY_NONE) value[q->use] = x;
            else if (q->indices) IMP_TRY(corners_read(p, q, e, row, x));
            else IMP_TRY(list_skip(p, q, e, row, x));
        }
        if (index == p->vertex) IMP_TRY(vertex_store(p, row, value));
    }
out:
    return st;
}

static enum imp_status body_read(struct ply *p, struct imp_mesh_data *out)
{
    enum imp_status st = IMP_OK;
    const bool normals = has_use(p, USE_NX) && has_use(p, USE_NY) && has_use(p, USE_NZ),
               uvs = has_use(p, USE_U) && has_use(p, USE_V);
    IMP_TRY(counts_check(p));
    IMP_TRY(imp__mesh_arrays(p->source, p->elements[p->vertex].n, p->elements[p->face].n,
                             &p->positions, normals ? &p->normals : NULL,
                             uvs ? &p->uvs : NULL, &p->indices, out));
    for (int i = 0; i < p->n_elements; i++) IMP_TRY(element_read(p, i));
    if (p->format == PLY_ASCII)
        while (p->at < p->end && strchr(" \t\r\n", *p->at) && *p->at) p->at++;
    if (p->at != p->end)
        IMP_TRY(ply_error(p, "%lld bytes after the last element",
                          (long long)(p->end - p->at)));
out:
    return st;
}

enum imp_status imp__ply_parse(const struct imp_mesh_source *source,
                               struct imp_mesh_data *out)
{
    enum imp_status st = IMP_OK;
    struct imp_mesh_data mesh = {0};
    struct ply *p = imp__alloc(source->ctx, 1, sizeof *p);
    if (!p)
        return imp__error(source->ctx, IMP_E_NOMEM, "%s: out of memory", source->name);
    p->source = source;
    p->ctx = source->ctx;
    p->at = source->text.data;
    p->end = p->at + source->text.size;
    p->vertex = p->face = -1;
    IMP_TRY(header_read(p));
    IMP_TRY(body_read(p, &mesh));
    *out = mesh;
out:
    imp__release(source->ctx, p);
    return st;
}
