/* SPDX-License-Identifier: Apache-2.0
 *
 * Headers of PLY files, and the layout of the body that they declare. */
#include "base/number.h"
#include "ply_file.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum imp_status IMP_PRINTF(2, 3)
    imp__ply_error(const struct ply *p, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(p->ctx, IMP_E_SCENE, "%s: %s", p->source->name, text);
}

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
        return imp__ply_error(p, "line %lld: '%.40s' is not a count", (long long)p->line,
                              count);
    if (p->n_elements == ELEMENTS_MAX)
        return imp__ply_error(p, "more than %d elements", ELEMENTS_MAX);
    struct ply_element *e = &p->elements[p->n_elements];
    e->n = (size_t)n;
    e->first = p->n_properties;
    snprintf(e->name, sizeof e->name, "%s", name);
    int *known = strcmp(name, "vertex") == 0 ? &p->vertex
                 : strcmp(name, "face") == 0 ? &p->face
                                             : NULL;
    if (known && *known >= 0)
        return imp__ply_error(p, "element '%s' is there twice", name);
    if (known && e->n > IMP_MESH_MAX)
        return imp__ply_error(p, "%zu of element %s: too many", e->n, name);
    if (known) *known = p->n_elements;
    p->n_elements++;
    return IMP_OK;
}

static enum imp_status property_add(struct ply *p, char *const words[5], int n)
{
    const bool list = n == 5 && strcmp(words[1], "list") == 0;
    if (p->n_elements == 0 || (n != 3 && !list))
        return imp__ply_error(p, "line %lld: malformed property", (long long)p->line);
    if (p->n_properties == PROPERTIES_MAX)
        return imp__ply_error(p, "more than %d properties", PROPERTIES_MAX);
    struct ply_element *e = &p->elements[p->n_elements - 1];
    struct ply_property q = {.type = type_of(words[list ? 3 : 1]),
                             .count = PLY_NONE,
                             .use = USE_SKIP,
                             .attribute = -1};
    if (list) q.count = type_of(words[2]);
    if (q.type == PLY_NONE || (list && (q.count == PLY_NONE || q.count >= PLY_F32)))
        return imp__ply_error(p, "line %lld: unknown type", (long long)p->line);
    const char *name = words[list ? 4 : 2];
    snprintf(q.name, sizeof q.name, "%s", name);
    if (p->vertex == p->n_elements - 1 && !list) q.use = use_of(name);
    if (p->face == p->n_elements - 1 && list)
        q.indices =
            strcmp(name, "vertex_index") == 0 || strcmp(name, "vertex_indices") == 0;
    for (int i = e->first; i < p->n_properties; i++)
        if ((q.use != USE_SKIP && p->properties[i].use == q.use) ||
            (q.indices && p->properties[i].indices))
            return imp__ply_error(p, "line %lld: property '%.40s' is there twice",
                                  (long long)p->line, name);
    p->properties[p->n_properties++] = q;
    e->n_properties++;
    return IMP_OK;
}

bool imp__ply_has(const struct ply *p, enum ply_use use)
{
    const struct ply_element *e = &p->elements[p->vertex];
    for (int i = 0; i < e->n_properties; i++)
        if (p->properties[e->first + i].use == use) return true;
    return false;
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
                     : (size_t)imp__ply_bytes(type) +
                           (q->indices ? 3 * (size_t)imp__ply_bytes(q->type) : 0);
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
            return imp__ply_error(
                p, "is cut off: %zu of element '%s' do not fit in the file", e->n,
                e->name);
        left -= e->n * row;
    }
    return IMP_OK;
}

enum imp_status imp__ply_header(struct ply *p)
{
    enum imp_status st = IMP_OK;
    char line[1024], *words[5];
    bool format = false;
    for (int n = 0;;) {
        if (!line_split(p, line, sizeof line, words, &n))
            IMP_TRY(imp__ply_error(p, "the header does not end"));
        if (p->line == 1) {
            if (n != 1 || strcmp(words[0], "ply") != 0)
                IMP_TRY(imp__ply_error(p, "not a PLY file"));
        } else if (n == 3 && strcmp(words[0], "format") == 0) {
            static const char *const names[] = {"ascii", "binary_little_endian",
                                                "binary_big_endian"};
            for (int i = 0; i < 3; i++)
                if (strcmp(words[1], names[i]) == 0) {
                    p->format = (enum ply_format)i;
                    format = true;
                }
            if (!format || strcmp(words[2], "1.0") != 0)
                IMP_TRY(imp__ply_error(p, "unknown format '%.40s %.40s'", words[1],
                                       words[2]));
        } else if (n == 3 && strcmp(words[0], "element") == 0)
            IMP_TRY(element_add(p, words[1], words[2]));
        else if (n >= 1 && strcmp(words[0], "property") == 0)
            IMP_TRY(property_add(p, words, n));
        else if (n == 1 && strcmp(words[0], "end_header") == 0) break;
        else if (n > 0 && strcmp(words[0], "comment") != 0 &&
                 strcmp(words[0], "obj_info") != 0)
            IMP_TRY(imp__ply_error(p, "line %lld: unknown header line '%.40s'",
                                   (long long)p->line, words[0]));
    }
    p->line++; /* of what follows */
    if (!format) IMP_TRY(imp__ply_error(p, "the header names no format"));
    if (p->vertex < 0 || p->elements[p->vertex].n == 0)
        IMP_TRY(imp__ply_error(p, "has no vertices"));
    if (p->face < 0 || p->elements[p->face].n == 0)
        IMP_TRY(imp__ply_error(p, "has no faces"));
    if (!imp__ply_has(p, USE_X) || !imp__ply_has(p, USE_Y) || !imp__ply_has(p, USE_Z))
        IMP_TRY(imp__ply_error(p, "vertices have no x, y, z"));
    bool indices = false;
    const struct ply_element *e = &p->elements[p->face];
    for (int i = 0; i < e->n_properties; i++)
        indices |= p->properties[e->first + i].indices;
    if (!indices)
        IMP_TRY(imp__ply_error(p, "faces have no vertex_index or vertex_indices"));
    IMP_TRY(counts_check(p));
out:
    return st;
}
