/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of index fields: Mitsuba's .vol (3, float32), NumPy .npy of three dimensions,
 * both [z][y][x] samples at the corners of cells; text is read in profile_file.c. */
#include "base/file.h"
#include "base/little.h"
#include "base/number.h"
#include "bend_rays.h"
#include <stdio.h>
#include <string.h>

#define FILE_BYTES_MAX ((size_t)1 << 34)
#define HEADER_MAX     65536

/* A grid through samples of `bytes` each; [z][y][x], or in Fortran order [x][y][z]. */
static enum imp_status grid_make(imp_context *ctx, const char *path,
                                 const struct imp_field_grid *like,
                                 const uint64_t size[3], const unsigned char *d,
                                 int bytes, bool fortran, imp_field **out)
{
    enum imp_status st = IMP_OK;
    struct imp_field_grid g = *like;
    imp_field *f = NULL;
    const size_t n = (size_t)(size[0] * size[1] * size[2]);
    double *samples = imp__alloc(ctx, n, sizeof *samples);
    if (!samples) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: no memory", path));
    for (int k = 0; k < 3; k++) g.cells[k] = (int)size[k] - 1;
    const size_t nx = size[0], ny = size[1], nz = size[2];
    for (size_t i = 0; i < n; i++, d += bytes) {
        /* Fortran: z runs fastest in the file */
        const size_t at =
            fortran ? i / (nz * ny) + nx * (i / nz % ny + ny * (i % nz)) : i;
        samples[at] = bytes == 8 ? imp__little_double(d) : imp__little_float(d);
    }
    st = imp_field_grid_create(ctx, &g, 1, &f);
    if (st == IMP_OK) st = imp_field_set_samples(f, samples);
    if (st != IMP_OK) {
        st = imp__error_prefix(ctx, st == IMP_E_ARG ? IMP_E_SCENE : st, "%s", path);
        goto out;
    }
    *out = f;
    f = NULL;
out:
    imp__release(ctx, samples);
    imp_field_destroy(f);
    return st;
}

/* Sizes from a file, before they become memory. */
static enum imp_status size_check(imp_context *ctx, const char *path,
                                  const int64_t given[3], size_t bytes, size_t left,
                                  uint64_t size[3])
{
    for (int k = 0; k < 3; k++) {
        if (given[k] < 2 || given[k] > 8193)
            return imp__error(ctx, IMP_E_SCENE,
                              "%s: %lld samples along %c: 2 to 8193 are read", path,
                              (long long)given[k], "xyz"[k]);
        size[k] = (uint64_t)given[k];
    }
    const uint64_t n = size[0] * size[1] * size[2];
    if (n > left / bytes)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: cut off: %llu x %llu x %llu samples are %llu bytes, and "
                          "%zu are there",
                          path, (unsigned long long)size[0], (unsigned long long)size[1],
                          (unsigned long long)size[2], (unsigned long long)(n * bytes),
                          left);
    return IMP_OK;
}

static enum imp_status vol_read(imp_context *ctx, const char *path,
                                const struct imp_field_grid *like,
                                const struct imp_bytes *b, imp_field **out)
{
    const unsigned char *d = b->data;
    struct imp_field_grid g = *like;
    if (b->size < 48 || d[3] != 3 || imp__little_u32(d + 4) != 1)
        return imp__error(ctx, IMP_E_SCENE, "%s: not a grid volume of version 3, float32",
                          path);
    const int64_t given[3] = {imp__little_i32(d + 8), imp__little_i32(d + 12),
                              imp__little_i32(d + 16)};
    uint64_t size[3];
    if (imp__little_i32(d + 20) != 1)
        return imp__error(ctx, IMP_E_SCENE, "%s: %d channels: an index has one", path,
                          imp__little_i32(d + 20));
    const enum imp_status st = size_check(ctx, path, given, 4, b->size - 48, size);
    if (st != IMP_OK) return st;
    for (int k = 0; k < 3; k++) {
        g.lo[k] = imp__little_float(d + 24 + 4 * k);
        g.hi[k] = imp__little_float(d + 36 + 4 * k);
    }
    return grid_make(ctx, path, &g, size, d + 48, 4, false, out);
}

/* What follows 'key': in the header's dictionary; NULL: not there. */
static const char *npy_entry(const char *header, const char *key)
{
    const char *s = strstr(header, key);
    if (!s) return NULL;
    s += strlen(key);
    s += strspn(s, " ");
    if (*s++ != ':') return NULL;
    return s + strspn(s, " ");
}

static enum imp_status npy_read(imp_context *ctx, const char *path,
                                const struct imp_field_grid *like,
                                const struct imp_bytes *b, imp_field **out)
{
    const unsigned char *d = b->data;
    char header[HEADER_MAX + 1];
    if (b->size < 12)
        return imp__error(ctx, IMP_E_SCENE, "%s: cut off in the NPY header", path);
    const size_t start = d[6] == 1 ? 10 : 12;
    const size_t length = d[6] == 1 ? (size_t)(d[8] | d[9] << 8) : imp__little_u32(d + 8);
    if (d[6] < 1 || d[6] > 3)
        return imp__error(ctx, IMP_E_SCENE, "%s: NPY version %d: 1 to 3 are read", path,
                          d[6]);
    if (length > HEADER_MAX || length > b->size - start)
        return imp__error(ctx, IMP_E_SCENE, "%s: cut off in the NPY header", path);
    memcpy(header, d + start, length);
    header[length] = 0;
    const char *type = npy_entry(header, "'descr'"),
               *order = npy_entry(header, "'fortran_order'"),
               *shape = npy_entry(header, "'shape'");
    if (!type || !order || !shape || *shape != '(')
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: malformed NPY header: no 'descr', 'fortran_order' or "
                          "'shape'",
                          path);
    const bool fortran = !strncmp(order, "True", 4);
    const int bytes = !strncmp(type, "'<f4'", 5) ? 4 : !strncmp(type, "'<f8'", 5) ? 8 : 0;
    if (!bytes)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: samples of type %.*s: '<f4' and '<f8' are read", path,
                          (int)imp_min(strcspn(type, ",}"), (size_t)40), type);
    int64_t zyx[4] = {0};
    int dims = 0;
    for (const char *s = shape + 1; dims < 4; dims++) {
        s += strspn(s, " ,");
        if (*s == ')' || !imp__integer(&s, s + strlen(s), &zyx[dims])) break;
    }
    if (dims != 3)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: an array of shape %.*s: must be (Z, Y, X)", path,
                          (int)imp_min(strcspn(shape, ")") + 1, (size_t)80), shape);
    const int64_t given[3] = {zyx[2], zyx[1], zyx[0]};
    uint64_t size[3];
    const enum imp_status st =
        size_check(ctx, path, given, (size_t)bytes, b->size - start - length, size);
    if (st != IMP_OK) return st;
    return grid_make(ctx, path, like, size, d + start + length, bytes, fortran, out);
}

static bool has_suffix(const char *path, const char *suffix)
{
    const size_t n = strlen(path), m = strlen(suffix);
    return n > m && !strcmp(path + n - m, suffix);
}

enum imp_status imp_field_read(imp_context *ctx, const char *path,
                               const struct imp_field_grid *grid, imp_field **out)
{
    struct imp_field_grid like = IMP_FIELD_GRID_INIT;
    struct imp_bytes b = {0};
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    IMP_OPTIONS(ctx, like, grid, "grid");
    IMP_FINITE_ALL(ctx, like.lo, 3, "grid->lo");
    IMP_FINITE_ALL(ctx, like.hi, 3, "grid->hi");
    IMP_FINITE(ctx, like.gladstone_dale, "grid->gladstone_dale");
    IMP_FLOAT_MODE;
    if (!grid || !(like.hi[0] > like.lo[0]))
        for (int k = 0; k < 3; k++) like.lo[k] = -1, like.hi[k] = 1;
    IMP_TRY(imp__file_read(ctx, path, FILE_BYTES_MAX, &b));
    if (b.size >= 6 && memcmp(b.data, "\x93NUMPY", 6) == 0)
        IMP_TRY(npy_read(ctx, path, &like, &b, out));
    else if (b.size >= 3 && memcmp(b.data, "VOL", 3) == 0)
        IMP_TRY(vol_read(ctx, path, &like, &b, out));
    else if (has_suffix(path, ".npy"))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: not an NPY file: it does not begin with \\x93NUMPY",
                           path));
    else if (has_suffix(path, ".vol"))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: not a grid volume: it does not begin with VOL", path));
    else IMP_TRY(imp__profile_read(ctx, path, &b, out));
out:
    imp__bytes_free(ctx, &b);
    return st;
}

/* ---- Writing ------------------------------------------------------------------- */

static void put_u32(unsigned char *d, uint32_t v)
{
    for (int k = 0; k < 4; k++) d[k] = (unsigned char)(v >> (8 * k));
}
static void put_f32(unsigned char *d, double v)
{
    const float f = (float)v;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    put_u32(d, bits);
}

static enum imp_status grid_write(const imp_field *f, const char *path, bool npy)
{
    const struct imp__grid *g = (const struct imp__grid *)f;
    const int m[3] = {g->desc.cells[0] + 1, g->desc.cells[1] + 1, g->desc.cells[2] + 1};
    const size_t n = (size_t)m[0] * m[1] * m[2], head = npy ? 128 : 48,
                 bytes = npy ? 8 : 4, mark = npy ? 0 : 8; /* as format/vol_file.c */
    unsigned char *data = imp__alloc(f->ctx, head + n * bytes + mark, 1), *d;
    if (!data) return imp__error(f->ctx, IMP_E_NOMEM, "%s: no memory", path);
    if (npy) {
        memset(data, ' ', head);
        memcpy(data, "\x93NUMPY\x01\x00\x76\x00", 10);
        const int used =
            snprintf((char *)data + 10, head - 10,
                     "{'descr': '<f8', 'fortran_order': False, 'shape': (%d, %d, "
                     "%d), }",
                     m[2], m[1], m[0]);
        data[10 + used] = ' ';
        memcpy(data + 123, "\t\t\t\t\n", 5); /* as format/image_npy.c */
    } else {
        memcpy(data, "VOL\x03", 4);
        put_u32(data + 4, 1);
        for (int k = 0; k < 3; k++) {
            put_u32(data + 8 + 4 * k, (uint32_t)m[k]);
            put_f32(data + 24 + 4 * k, g->desc.lo[k]);
            put_f32(data + 36 + 4 * k, g->desc.hi[k]);
        }
        put_u32(data + 20, 1);
    }
    d = data + head;
    for (int k = 0; k < m[2]; k++)
        for (int j = 0; j < m[1]; j++)
            for (int i = 0; i < m[0]; i++, d += bytes) {
                const imp_v3 x = g->origin + imp__v3(i / g->inv_h[0], j / g->inv_h[1],
                                                     k / g->inv_h[2]);
                struct imp__jet jet;
                imp__field_eval1(f, &x, 1, &jet);
                if (!npy) {
                    put_f32(d, jet.eta);
                    continue;
                }
                uint64_t bits;
                memcpy(&bits, &jet.eta, sizeof bits);
                for (int q = 0; q < 8; q++) d[q] = (unsigned char)(bits >> (8 * q));
            }
    memcpy(d, "importon", mark);
    const enum imp_status st =
        imp__file_write(f->ctx, path, data, head + n * bytes + mark);
    imp__release(f->ctx, data);
    return st;
}

enum imp_status imp_field_write(const imp_field *f, const char *path)
{
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, path, "path");
    IMP_FLOAT_MODE;
    const bool npy = has_suffix(path, ".npy");
    if (npy || has_suffix(path, ".vol")) {
        const uint32_t *number;
        const struct imp__grid *g = imp__field_nodes(f, &number);
        if (!g)
            return imp__error(f->ctx, IMP_E_ARG, "%s: a %s field is not a grid", path,
                              f->ops->name);
        return grid_write(&g->base, path, npy);
    }
    if (f->ops == &imp__field_radial || f->ops == &imp__field_rz)
        return imp__profile_write(f, path);
    return imp__error(f->ctx, IMP_E_ARG,
                      "%s: grids are written as .vol, .npy, radial and rz "
                      "fields as text",
                      path);
}
