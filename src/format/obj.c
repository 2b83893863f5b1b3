/* SPDX-License-Identifier: Apache-2.0
 *
 * Wavefront OBJ: v, vt, vn and f, whose negative indices count from the last row so far;
 * polygons are fanned from their first corner. A vertex is a distinct (v, vt, vn). What
 * objects, materials and their files are called goes to who asks for it (obj_parts.c);
 * all other lines are ignored. */
#include "base/arguments.h"
#include "base/number.h"
#include "obj_parts.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define LINE_MAX_BYTES 1023

struct column { /* v, vt or vn as read */
    float *at;
    size_t n, capacity; /* of numbers */
    size_t rows;
    int width;
};

struct corner {
    uint32_t v, t, n;
}; /* 1-based; 0: none */

struct obj {
    const struct imp_mesh_source *source;
    imp_context *ctx;
    int64_t line;
    size_t at;           /* of the text, where the line begins */
    size_t faces_at;     /* ... where that of the first face does */
    const char *end;     /* of the text: behind a line is what no number has */
    const char *comment; /* the first '#' at or behind the line, or the end */
    struct column v, t, n;
    struct corner *vertices;
    size_t n_vertices, cap_vertices;
    uint32_t *indices;
    size_t n_indices, cap_indices;
    uint32_t *alone; /* vertex + 1 by v, of the first corner that has it; 0: none */
    size_t n_alone, cap_alone;
    uint32_t *table; /* vertex + 1 of the others by hash of their corner; 0: free */
    size_t cap_table, n_table;
    bool missing_normal;
    struct imp__obj_names *names; /* NULL: nobody asks */
};

static enum imp_status no_memory(const struct obj *o)
{
    return imp__error(o->ctx, IMP_E_NOMEM, "%s: no memory for the mesh", o->source->name);
}

static enum imp_status IMP_PRINTF(2, 3)
    line_error(const struct obj *o, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(o->ctx, IMP_E_SCENE, "%s:%lld: %s", o->source->name,
                      (long long)o->line, text);
}

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

static const char *skip(const char *s, const char *end)
{
    while (s < end && blank(*s)) s++;
    return s;
}

/* Room for n elements of an array that holds `used`: for twice as many, or of many as many as the whole
 * text has if it goes on as from `since` on, so that large files are not copied. A number, or a corner with
 * its triangle, takes two bytes of the text at least. What is not used is not written, and takes no
 * memory. NULL: there is none, and the array stays. */
static void *room_for(struct obj *o, void *array, size_t *capacity, size_t used, size_t n,
                      size_t size, size_t since)
{
    enum { MANY = 4096 };
    if (n <= *capacity) return array;
    const double part =
        (double)(o->at - since + 1) / (double)(o->source->text.size - since);
    size_t wanted = 2 * n + MANY;
    const size_t most = n + 2 * (o->source->text.size - o->at);
    if (n > MANY)
        wanted = imp_max(wanted, (size_t)imp_min((double)n / part, (double)most));
    void *p = imp__alloc_raw(o->ctx, wanted, size);
    if (!p) return NULL;
    if (used > 0) memcpy(p, array, used * size);
    imp__release(o->ctx, array);
    *capacity = wanted;
    return p;
}

/* Up to `width` numbers; those that may be missing are 0. More than that are ignored. */
static enum imp_status row_read(struct obj *o, struct column *c, const char *what,
                                int needed, const char *s, const char *end)
{
    float *grown =
        room_for(o, c->at, &c->capacity, c->n, c->n + (size_t)c->width, sizeof *grown, 0);
    if (!grown) return no_memory(o);
    c->at = grown;
    for (int i = 0; i < c->width; i++) {
        double x = 0;
        s = skip(s, end);
        if (s < end || i < needed)
            if (!imp__number(&s, o->end, &x) || (s < end && !blank(*s)))
                return line_error(o, "%s needs %d numbers", what, needed);
        const float value = (float)x;
        if (!isfinite(value))
            return line_error(o, "%s %zu is not finite", what, c->rows + 1);
        c->at[c->n + (size_t)i] = value;
    }
    c->n += (size_t)c->width;
    if (++c->rows > IMP_MESH_MAX) return line_error(o, "mesh is too large");
    return IMP_OK;
}

static enum imp_status index_read(struct obj *o, const struct column *c, const char *what,
                                  const char **s, uint32_t *out)
{
    const size_t n = c->rows;
    int64_t i;
    if (!imp__integer(s, o->end, &i))
        return line_error(o, "malformed index of a %s", what);
    if (i == 0) return line_error(o, "index 0 of a %s", what);
    if (i < 0 && i >= -(int64_t)n) i += (int64_t)n + 1;
    if (i < 1 || (uint64_t)i > n)
        return line_error(o, "index %lld of a %s: there are %zu so far", (long long)i,
                          what, n);
    *out = (uint32_t)i;
    return IMP_OK;
}

/* Eight vertices side by side in a file are so in the table, which lies in no cache; eights are
 * scattered, since runs of places that are taken would make searches long. */
static size_t hash(struct corner k)
{
    uint64_t h = (k.v >> 3) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 29) ^ k.t) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 32) ^ k.n) * 0x94d049bb133111ebu;
    return (size_t)((h ^ (h >> 31)) << 3 | (k.v & 7));
}

static uint32_t *slot(const struct obj *o, struct corner k)
{
    for (size_t i = hash(k);; i++) {
        uint32_t *s = &o->table[i & (o->cap_table - 1)];
        if (*s == 0) return s;
        const struct corner *old = &o->vertices[*s - 1];
        if (old->v == k.v && old->t == k.t && old->n == k.n) return s;
    }
}

static enum imp_status table_grow(struct obj *o)
{
    uint32_t *old = o->table;
    const size_t n_old = o->cap_table, wanted = n_old ? 2 * n_old : 1024;
    uint32_t *table = imp__alloc(o->ctx, wanted, sizeof *table);
    if (!table) return no_memory(o);
    o->table = table;
    o->cap_table = wanted;
    for (size_t i = 0; i < n_old; i++)
        if (old[i]) *slot(o, o->vertices[old[i] - 1]) = old[i];
    imp__release(o->ctx, old);
    return IMP_OK;
}

/* Where the number of a corner's vertex is kept: most positions have one corner, which needs no
 * search. */
static enum imp_status place_of(struct obj *o, struct corner k, uint32_t **out)
{
    const size_t known = o->v.rows;
    if (o->n_alone < known) {
        uint32_t *grown =
            room_for(o, o->alone, &o->cap_alone, o->n_alone, known, sizeof *grown, 0);
        if (!grown) return no_memory(o);
        memset(grown + o->n_alone, 0, (known - o->n_alone) * sizeof *grown);
        o->alone = grown;
        o->n_alone = known;
    }
    uint32_t *s = &o->alone[k.v - 1];
    const struct corner *first = *s ? &o->vertices[*s - 1] : &k;
    if (first->t != k.t || first->n != k.n) {
        if (2 * (o->n_table + 1) > o->cap_table) IMP_CHECKED(table_grow(o));
        s = slot(o, k);
        o->n_table += *s == 0;
    }
    *out = s;
    return IMP_OK;
}

static enum imp_status vertex_of(struct obj *o, struct corner k, uint32_t *out)
{
    enum imp_status st = IMP_OK;
    uint32_t *s = NULL;
    IMP_TRY(place_of(o, k, &s));
    if (*s == 0) {
        if (o->n_vertices >= IMP_MESH_MAX) IMP_TRY(line_error(o, "mesh is too large"));
        struct corner *grown = room_for(o, o->vertices, &o->cap_vertices, o->n_vertices,
                                        o->n_vertices + 1, sizeof *grown, o->faces_at);
        if (!grown) IMP_TRY(no_memory(o));
        o->vertices = grown;
        o->vertices[o->n_vertices++] = k;
        *s = (uint32_t)o->n_vertices;
    }
    *out = *s - 1;
out:
    return st;
}

/* a, a/t, a//n, a/t/n */
static enum imp_status corner_read(struct obj *o, const char **s, const char *end,
                                   struct corner *k)
{
    enum imp_status st = IMP_OK;
    *k = (struct corner){0};
    IMP_TRY(index_read(o, &o->v, "vertex", s, &k->v));
    if (*s < end && **s == '/') {
        ++*s;
        if (*s < end && **s != '/' && !blank(**s))
            IMP_TRY(index_read(o, &o->t, "texture coordinate", s, &k->t));
        if (*s < end && **s == '/') {
            ++*s;
            IMP_TRY(index_read(o, &o->n, "normal", s, &k->n));
        }
    }
    if (*s < end && !blank(**s)) IMP_TRY(line_error(o, "malformed corner of a face"));
    o->missing_normal |= k->n == 0;
out:
    return st;
}

static enum imp_status face_read(struct obj *o, const char *s, const char *end)
{
    enum imp_status st = IMP_OK;
    uint32_t first = 0, last = 0, next;
    int n = 0;
    if (o->n_vertices == 0) o->faces_at = o->at;
    for (s = skip(s, end); s < end; s = skip(s, end), n++) {
        struct corner k;
        IMP_TRY(corner_read(o, &s, end, &k));
        IMP_TRY(vertex_of(o, k, &next));
        if (n >= 2) {
            uint32_t *grown = room_for(o, o->indices, &o->cap_indices, o->n_indices,
                                       o->n_indices + 3, sizeof *grown, o->faces_at);
            if (!grown) IMP_TRY(no_memory(o));
            o->indices = grown;
            o->indices[o->n_indices++] = first;
            o->indices[o->n_indices++] = last;
            o->indices[o->n_indices++] = next;
        }
        if (n == 0) first = next;
        last = next;
    }
    if (n < 3) IMP_TRY(line_error(o, "a face needs three corners"));
    if (o->n_indices / 3 > IMP_MESH_MAX) IMP_TRY(line_error(o, "mesh is too large"));
out:
    return st;
}

static enum imp_status line_read(struct obj *o, const char *s, const char *end)
{
    if (end - s > LINE_MAX_BYTES)
        return line_error(o, "line is longer than %d bytes", LINE_MAX_BYTES);
    if (o->comment < s) {
        o->comment = memchr(s, '#', (size_t)(o->end - s));
        if (!o->comment) o->comment = o->end;
    }
    end = imp_min(end, o->comment);
    s = skip(s, end);
    const char *word = s;
    while (s < end && !blank(*s)) s++;
    const size_t length = (size_t)(s - word);
    if (length == 1 && *word == 'v') return row_read(o, &o->v, "vertex", 3, s, end);
    if (length == 1 && *word == 'f') return face_read(o, s, end);
    if (length == 2 && word[0] == 'v' && word[1] == 't')
        return row_read(o, &o->t, "texture coordinate", 1, s, end);
    if (length == 2 && word[0] == 'v' && word[1] == 'n')
        return row_read(o, &o->n, "normal", 3, s, end);
    if (!o->names) return IMP_OK;
    if (!imp__obj_name(o->names, word, length, s, end, o->n_indices / 3))
        return no_memory(o);
    return IMP_OK;
}

static enum imp_status mesh_finish(struct obj *o, struct imp_mesh_data *out)
{
    enum imp_status st = IMP_OK;
    float *p, *n = NULL, *uv = NULL;
    uint32_t *indices;
    if (o->n_indices == 0)
        IMP_TRY(imp__error(o->ctx, IMP_E_SCENE, "%s: has no faces", o->source->name));
    if (o->n.n && o->missing_normal)
        imp__warn(o->ctx, "%s: some faces have no normals; all are computed",
                  o->source->name);
    const bool normals = o->n.n && !o->missing_normal;
    IMP_TRY(imp__mesh_arrays(o->source, o->n_vertices, o->n_indices / 3, &p,
                             normals ? &n : NULL, o->t.n ? &uv : NULL, &indices, out));
    memcpy(indices, o->indices, o->n_indices * sizeof *indices);
    for (size_t i = 0; i < o->n_vertices; i++) {
        const struct corner k = o->vertices[i];
        memcpy(p + 3 * i, o->v.at + 3 * (size_t)(k.v - 1), 3 * sizeof *p);
        if (n) memcpy(n + 3 * i, o->n.at + 3 * (size_t)(k.n - 1), 3 * sizeof *n);
        if (!uv) continue;
        const float zero[2] = {0, 0},
                    *from = k.t ? o->t.at + 2 * (size_t)(k.t - 1) : zero;
        uv[2 * i] = from[0];
        uv[2 * i + 1] = o->source->flip_v ? 1 - from[1] : from[1];
    }
out:
    return st;
}

enum imp_status imp__obj_parse_names(const struct imp_mesh_source *source,
                                     struct imp__obj_names *names,
                                     struct imp_mesh_data *out)
{
    enum imp_status st = IMP_OK;
    struct obj o = {.source = source,
                    .ctx = source->ctx,
                    .v.width = 3,
                    .t.width = 2,
                    .n.width = 3,
                    .names = names};
    const char *s = (const char *)source->text.data, *end = s + source->text.size;
    o.end = end;
    while (s < end) {
        const char *stop = memchr(s, '\n', (size_t)(end - s));
        if (!stop) stop = end;
        o.line++;
        o.at = (size_t)(s - (const char *)source->text.data);
        IMP_TRY(line_read(&o, s, stop));
        s = stop + 1;
    }
    IMP_TRY(mesh_finish(&o, out));
out:
    imp__release(o.ctx, o.v.at);
    imp__release(o.ctx, o.t.at);
    imp__release(o.ctx, o.n.at);
    imp__release(o.ctx, o.vertices);
    imp__release(o.ctx, o.indices);
    imp__release(o.ctx, o.alone);
    imp__release(o.ctx, o.table);
    return st;
}

enum imp_status imp__obj_parse(const struct imp_mesh_source *source,
                               struct imp_mesh_data *out)
{
    return imp__obj_parse_names(source, NULL, out);
}
