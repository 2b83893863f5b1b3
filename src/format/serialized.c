/* SPDX-License-Identifier: Apache-2.0
 *
 * Mitsuba's serialized meshes, versions 3 and 4 (docs/scene-format.md 13.3). A file holds
 * meshes one behind the other, each a header of two 16-bit words and a zlib stream, and
 * ends with their offsets and their number. All is little-endian. */
#include "mesh_file.h"
#include <math.h>
#include <string.h>
#include <zlib.h>

#define MAGIC 0x041c
/* More than a deflate stream can grow: bounds counts by the size of the file. */
#define GROWS 1040.0
/* Bytes that a stream of any size may become: with its tree a mesh takes some times as many. */
#define MESH_ALWAYS 0x1p28

enum { NORMALS = 1, UVS = 2, COLORS = 8, DOUBLES = 0x2000, SINGLES = 0x1000 };

struct serialized {
    const struct imp_mesh_source *source;
    imp_context *ctx;
    z_stream z;
    bool open;
    size_t packed; /* bytes of the stream in the file, at most */
};

static uint64_t little(const unsigned char *p, int n)
{
    uint64_t x = 0;
    for (int i = 0; i < n; i++) x |= (uint64_t)p[i] << (8 * i);
    return x;
}

static enum imp_status cut_off(const struct serialized *s, const char *where)
{
    return imp__error(s->ctx, IMP_E_SCENE, "%s: is cut off or damaged in %s",
                      s->source->name, where);
}

/* The next n bytes of the stream. */
static enum imp_status inflate_read(struct serialized *s, void *out, size_t n,
                                    const char *where)
{
    unsigned char *to = out;
    while (n > 0) {
        const uInt part = n > (1u << 30) ? 1u << 30 : (uInt)n;
        s->z.next_out = to;
        s->z.avail_out = part;
        const int code = inflate(&s->z, Z_SYNC_FLUSH);
        const size_t got = part - s->z.avail_out;
        if (code == Z_MEM_ERROR)
            return imp__error(s->ctx, IMP_E_NOMEM, "%s: no memory", s->source->name);
        if (got == 0 || (code != Z_OK && code != Z_STREAM_END)) return cut_off(s, where);
        to += got;
        n -= got;
    }
    return IMP_OK;
}

static enum imp_status number_read(struct serialized *s, int bytes, const char *where,
                                   uint64_t *out)
{
    unsigned char b[8];
    const enum imp_status st = inflate_read(s, b, (size_t)bytes, where);
    if (st == IMP_OK) *out = little(b, bytes);
    return st;
}

/* n numbers, single or double, to `out`, or past them where it is NULL. */
static enum imp_status floats_read(struct serialized *s, size_t n, bool doubles,
                                   const char *what, float *out)
{
    enum imp_status st = IMP_OK;
    unsigned char block[4096];
    const size_t width = doubles ? 8 : 4, most = sizeof block / width;
    for (size_t k = 0; k < n;) {
        const size_t part = n - k < most ? n - k : most;
        IMP_TRY(inflate_read(s, block, part * width, what));
        for (size_t i = 0; i < part && out; i++) {
            const uint64_t bits = little(block + i * width, (int)width);
            double d;
            float f;
            const uint32_t word = (uint32_t)bits;
            memcpy(&d, &bits, sizeof d);
            memcpy(&f, &word, sizeof f);
            out[k + i] = doubles ? (float)d : f;
            if (!isfinite(out[k + i]))
                IMP_TRY(imp__error(s->ctx, IMP_E_SCENE,
                                   "%s: number %zu of %s is not finite", s->source->name,
                                   k + i, what));
        }
        k += part;
    }
out:
    return st;
}

static enum imp_status indices_read(struct serialized *s, size_t n, size_t n_vertices,
                                    uint32_t *out)
{
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < n; k++) {
        uint64_t i;
        IMP_TRY(number_read(s, 4, "its triangles", &i));
        if (i >= n_vertices)
            IMP_TRY(imp__error(
                s->ctx, IMP_E_SCENE, "%s: triangle %zu names vertex %llu; there are %zu",
                s->source->name, k / 3, (unsigned long long)i, n_vertices));
        out[k] = (uint32_t)i;
    }
out:
    return st;
}

/* Where mesh `index` begins and ends. */
static enum imp_status mesh_find(const struct serialized *s, int index,
                                 const unsigned char **begin, const unsigned char **end,
                                 int *version)
{
    const char *name = s->source->name;
    const unsigned char *data = s->source->text.data;
    const size_t size = s->source->text.size;
    if (size < 8 || little(data, 2) != MAGIC)
        return imp__error(s->ctx, IMP_E_SCENE, "%s: not a serialized mesh", name);
    *version = (int)little(data + 2, 2);
    if (*version != 3 && *version != 4)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: version %d of serialized meshes; 3 and 4 are read", name,
                          *version);
    const uint64_t n = little(data + size - 4, 4);
    const size_t width = *version == 4 ? 8 : 4;
    if (n < 1 || n > (size - 4) / width)
        return imp__error(s->ctx, IMP_E_SCENE, "%s: %llu meshes in %zu bytes", name,
                          (unsigned long long)n, size);
    if ((uint64_t)index >= n)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: shape_index = %d is outside [0, %llu]", name, index,
                          (unsigned long long)n - 1);
    const unsigned char *table = data + size - 4 - n * width;
    const uint64_t from = little(table + (size_t)index * width, (int)width),
                   last = (uint64_t)(table - data),
                   to = (uint64_t)index + 1 < n
                            ? little(table + ((size_t)index + 1) * width, (int)width)
                            : last;
    if (from >= to || to > last || to - from < 5 || little(data + from, 2) != MAGIC)
        return imp__error(s->ctx, IMP_E_SCENE, "%s: mesh %d is not where it should be",
                          name, index);
    *begin = data + from + 4;
    *end = data + to;
    return IMP_OK;
}

static enum imp_status counts_read(struct serialized *s, int version, uint64_t *flags,
                                   uint64_t *n_vertices, uint64_t *n_triangles)
{
    enum imp_status st = IMP_OK;
    uint64_t letter = 1;
    IMP_TRY(number_read(s, 4, "its header", flags));
    for (int k = 0; version == 4 && letter; k++) {
        if (k > 65536) IMP_TRY(cut_off(s, "its name"));
        IMP_TRY(number_read(s, 1, "its name", &letter));
    }
    IMP_TRY(number_read(s, 8, "its header", n_vertices));
    IMP_TRY(number_read(s, 8, "its header", n_triangles));
    if (*n_vertices < 1 || *n_triangles < 1)
        IMP_TRY(imp__error(s->ctx, IMP_E_SCENE, "%s: has no triangles", s->source->name));
    if (*n_vertices > IMP_MESH_MAX || *n_triangles > IMP_MESH_MAX ||
        12.0 * ((double)*n_vertices + (double)*n_triangles) > GROWS * (double)s->packed)
        IMP_TRY(imp__error(s->ctx, IMP_E_SCENE,
                           "%s: %llu vertices and %llu triangles in %zu bytes",
                           s->source->name, (unsigned long long)*n_vertices,
                           (unsigned long long)*n_triangles, s->packed));
    const double floats = 3 + (*flags & NORMALS ? 3 : 0) + (*flags & UVS ? 2 : 0);
    IMP_TRY(imp__unpacks(s->ctx, s->source->name, (double)s->packed,
                         4 * floats * (double)*n_vertices + 12 * (double)*n_triangles,
                         MESH_ALWAYS));
    if (*flags & SINGLES && *flags & DOUBLES)
        IMP_TRY(imp__error(s->ctx, IMP_E_SCENE, "%s: numbers are single and double",
                           s->source->name));
out:
    return st;
}

enum imp_status imp__serialized_parse(const struct imp_mesh_source *source, int index,
                                      struct imp_mesh_data *out)
{
    enum imp_status st = IMP_OK;
    struct serialized s = {.source = source, .ctx = source->ctx};
    struct imp_mesh_data mesh = {0};
    const unsigned char *begin = NULL, *end = NULL;
    uint64_t flags, n_vertices, n_triangles;
    float *positions, *normals = NULL, *uvs = NULL;
    uint32_t *indices;
    int version = 0;

    IMP_TRY(mesh_find(&s, index, &begin, &end, &version));
    s.packed = (size_t)(end - begin);
    if (s.packed > UINT32_MAX)
        IMP_TRY(imp__error(s.ctx, IMP_E_SCENE, "%s: mesh %d has more than 4 GB",
                           source->name, index));
    s.z.next_in = (Bytef *)begin;
    s.z.avail_in = (uInt)s.packed;
    if (inflateInit(&s.z) != Z_OK)
        IMP_TRY(imp__error(s.ctx, IMP_E_NOMEM, "%s: no memory", source->name));
    s.open = true;
    IMP_TRY(counts_read(&s, version, &flags, &n_vertices, &n_triangles));
    const size_t v = (size_t)n_vertices, t = (size_t)n_triangles;
    const bool doubles = flags & DOUBLES;
    IMP_TRY(imp__mesh_arrays(source, v, t, &positions, flags & NORMALS ? &normals : NULL,
                             flags & UVS ? &uvs : NULL, &indices, &mesh));
    IMP_TRY(floats_read(&s, 3 * v, doubles, "its positions", positions));
    if (normals) IMP_TRY(floats_read(&s, 3 * v, doubles, "its normals", normals));
    if (uvs) IMP_TRY(floats_read(&s, 2 * v, doubles, "its uv", uvs));
    if (flags & COLORS) IMP_TRY(floats_read(&s, 3 * v, doubles, "its colours", NULL));
    for (size_t k = 0; uvs && source->flip_v && k < v; k++)
        uvs[2 * k + 1] = 1 - uvs[2 * k + 1];
    IMP_TRY(indices_read(&s, 3 * t, v, indices));
    *out = mesh;
out:
    if (s.open) inflateEnd(&s.z);
    return st;
}
