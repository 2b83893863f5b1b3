/* SPDX-License-Identifier: Apache-2.0
 *
 * PLY 1.0: ascii, binary_little_endian, binary_big_endian. Vertices give x y z, nx ny nz
 * and uv, faces vertex_index or vertex_indices; other numbers are attributes
 * (ply_attributes.c); other lists and elements are skipped. */
#include "base/number.h"
#include "ply_file.h"
#include <math.h>
#include <string.h>

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
    const int n = imp__ply_bytes(type);
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
        return imp__ply_error(p, "line %lld: malformed number in %s %zu",
                              (long long)p->line, e->name, row);
    return imp__ply_error(p, "is cut off in %s %zu", e->name, row);
}

static enum imp_status list_skip(struct ply *p, const struct ply_property *q,
                                 const struct ply_element *e, size_t row, double count)
{
    if (!(count >= 0) || count != floor(count) || count > 0xffffffffu)
        return imp__ply_error(p, "%s %zu: a list of %g items", e->name, row, count);
    if (p->format != PLY_ASCII) {
        const uint64_t bytes = (uint64_t)count * (uint64_t)imp__ply_bytes(q->type);
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
            return imp__ply_error(p, "vertex %zu: %s is not finite", row, names[i]);
    }
    imp__ply_put(p, row, f);
    return IMP_OK;
}

static enum imp_status corners_read(struct ply *p, const struct ply_property *q,
                                    const struct ply_element *e, size_t row, double count)
{
    if (count != 3)
        return imp__ply_error(p, "face %zu has %g corners: only triangles are read", row,
                              count);
    for (int k = 0; k < 3; k++) {
        double i;
        if (!number_read(p, q->type, &i)) return row_error(p, e, row);
        if (!(i >= 0) || i >= (double)p->elements[p->vertex].n || i != floor(i))
            return imp__ply_error(p, "face %zu names vertex %g; there are %zu", row, i,
                                  p->elements[p->vertex].n);
        p->indices[3 * row + (size_t)k] = (uint32_t)i;
    }
    return IMP_OK;
}

static enum imp_status element_read(struct ply *p, int index)
{
    enum imp_status st = IMP_OK;
    const struct ply_element *e = &p->elements[index];
    if (e->n_properties == 0 || imp__ply_copy(p, index)) return IMP_OK;
    for (size_t row = 0; row < e->n; row++) {
        double value[USES + 2] = {0};
        for (int i = 0; i < e->n_properties; i++) {
            const struct ply_property *q = &p->properties[e->first + i];
            double x;
            if (!number_read(p, q->count == PLY_NONE ? q->type : q->count, &x))
                IMP_TRY(row_error(p, e, row));
            if (q->count == PLY_NONE) value[q->use] = x;
            if (q->attribute >= 0) IMP_TRY(imp__ply_attribute_store(p, q, row, x));
            if (q->count == PLY_NONE) continue;
            if (q->indices) IMP_TRY(corners_read(p, q, e, row, x));
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
    const bool normals = imp__ply_has(p, USE_NX) && imp__ply_has(p, USE_NY) &&
                         imp__ply_has(p, USE_NZ),
               uvs = imp__ply_has(p, USE_U) && imp__ply_has(p, USE_V);
    IMP_TRY(imp__mesh_arrays(p->source, p->elements[p->vertex].n, p->elements[p->face].n,
                             &p->positions, normals ? &p->normals : NULL,
                             uvs ? &p->uvs : NULL, &p->indices, out));
    IMP_TRY(imp__ply_attributes(p));
    for (int i = 0; i < p->n_elements; i++) IMP_TRY(element_read(p, i));
    if (p->format == PLY_ASCII)
        while (p->at < p->end && strchr(" \t\r\n", *p->at) && *p->at) p->at++;
    if (p->at != p->end)
        IMP_TRY(imp__ply_error(p, "%lld bytes after the last element",
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
    IMP_TRY(imp__ply_header(p));
    IMP_TRY(body_read(p, &mesh));
    IMP_TRY(imp__ply_attributes_keep(p, &mesh));
    *out = mesh;
out:
    imp__release(source->ctx, p);
    return st;
}
