/* SPDX-License-Identifier: Apache-2.0
 *
 * OBJ and PLY: what is read (docs/scene-format.md 13.1, 13.2), the message of every
 * error, files cut off and damaged anywhere, and memory that ends. */
#include "format/mesh_file.h"
#include "imp_fail_alloc.h"
#include "imp_tap.h"
#include "kind/shape/shape.h"
#include "math/rng.h"
#include <stdlib.h>

static imp_context *ctx;

struct loaded {
    struct imp_arena keep, temporary;
    struct imp_mesh_data m;
};

static enum imp_status load(imp_context *c, const void *data, size_t n, const char *name,
                            bool flip, struct loaded *l)
{
    *l = (struct loaded){0};
    imp__arena_init(&l->keep, c);
    imp__arena_init(&l->temporary, c);
    const struct imp_mesh_source s = {.ctx = c,
                                      .keep = &l->keep,
                                      .temporary = &l->temporary,
                                      .name = name,
                                      .flip_v = flip,
                                      .text = {(unsigned char *)data, n, n}};
    return strstr(name, ".obj") ? imp__obj_parse(&s, &l->m) : imp__ply_parse(&s, &l->m);
}
static void unload(struct loaded *l)
{
    imp__arena_free(&l->keep);
    imp__arena_free(&l->temporary);
}

/* ---- OBJ ----------------------------------------------------------------------- */

static void check_obj(void)
{
    static const char text[] =
        "# a quad and a triangle\r\nmtllib x.mtl\no thing\n"
        "v 0 0 0\nv 1 0 0 1.0\nv\t1 1 0\nv 0 1e0 0\n\nvt 0 0\nvt 1 0.25#x\nvt 1 1 0\nvn "
        "0 "
        "0 1\n"
        "usemtl a\ns off\nf 1/1/1 2/2/1 3/3/1 4/1/1 # a quad\n  f 1/1/1 2/3/1 4/1/1  \n";
    struct loaded l;
    enum imp_status st = load(ctx, text, sizeof text - 1, "a.obj", true, &l);
    tap_ok(st == IMP_OK && l.m.n_triangles == 3 && l.m.n_vertices == 5,
           "polygons are fanned, corners shared # %zu triangles %zu vertices %s",
           l.m.n_triangles, l.m.n_vertices, st ? imp_last_error(ctx) : "");
    if (st == IMP_OK) {
        static const uint32_t want[] = {0, 1, 2, 0, 2, 3, 0, 4, 3};
        tap_ok(memcmp(l.m.indices, want, sizeof want) == 0, "their indices");
        tap_ok(l.m.positions[6] == 1 && l.m.positions[7] == 1 && l.m.positions[12] == 1,
               "positions");
        tap_ok(l.m.uvs && l.m.uvs[3] == 0.75f && l.m.uvs[1] == 1, "v is flipped");
        tap_ok(l.m.normals && l.m.normals[14] == 1 && l.m.normals_from_file, "normals");
    }
    unload(&l);
    static const char slashes[] =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt .5 .5\nf 1//1 2//1 3//1";
    st = load(ctx, slashes, sizeof slashes - 1, "b.obj", false, &l);
    tap_ok(st == IMP_OK && l.m.normals && l.m.uvs[0] == 0, "a//n # %s",
           st ? imp_last_error(ctx) : "");
    unload(&l);
    st = load(ctx, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3", 46, "c.obj",
              false, &l);
    tap_ok(st == IMP_OK && !l.m.normals && !l.m.normals_from_file && !l.m.uvs,
           "normals that not all corners have are computed");
    unload(&l);

    static char big[1200];
    memset(big, 'x', sizeof big - 1);
    big[0] = '#';
    const struct {
        const char *text, *message;
    } errors[] = {
        {"", "e.obj: has no faces"},
        {"v 0 0 0\nv 1 0\n", "e.obj:2: vertex needs 3 numbers"},
        {"v 0 0 0x\n", "e.obj:1: vertex needs 3 numbers"},
        {"v 0 0 0\nv 0 nan 0\n", "e.obj:2: vertex 2 is not finite"},
        {"v 0 0 1e39\n", "e.obj:1: vertex 1 is not finite"},
        {"vn 0 inf 0\n", "e.obj:1: normal 1 is not finite"},
        {"vt\n", "e.obj:1: texture coordinate needs 1 numbers"},
        {"v 0 0 0\nf 1 1\n", "e.obj:2: a face needs three corners"},
        {"v 0 0 0\nf 1 1 2\n", "e.obj:2: index 2 of a vertex: there are 1 so far"},
        {"v 0 0 0\nf 1 1 -2\n", "e.obj:2: index -2 of a vertex: there are 1 so far"},
        {"v 0 0 0\nf 1 1 0\n", "e.obj:2: index 0 of a vertex"},
        {"v 0 0 0\nf 1 1 a\n", "e.obj:2: malformed index of a vertex"},
        {"v 0 0 0\nf 1/1 1 1\n",
         "e.obj:2: index 1 of a texture coordinate: there are 0 so far"},
        {"v 0 0 0\nf 1//1 1 1\n", "e.obj:2: index 1 of a normal: there are 0 so far"},
        {"v 0 0 0\nf 1/ 1 1x\n", "e.obj:2: malformed corner of a face"},
        {"v 0 0 0\nf 1 1 99999999999999999999\n", "e.obj:2: malformed index of a vertex"},
        {big, "e.obj:1: line is longer than 1023 bytes"}};
    for (size_t i = 0; i < imp_count(errors); i++) {
        st = load(ctx, errors[i].text, strlen(errors[i].text), "e.obj", false, &l);
        tap_ok(st == IMP_E_SCENE && strcmp(imp_last_error(ctx), errors[i].message) == 0,
               "%s", errors[i].message);
        if (strcmp(imp_last_error(ctx), errors[i].message) != 0)
            printf("# %d %s\n", st, imp_last_error(ctx));
        unload(&l);
    }
}

/* Corners that come again, with other texture coordinates and normals or the same, against a search
 * through all vertices so far. */
static void check_obj_corners(void)
{
    enum { ROWS = 40, FACES = 3000 };
    static char text[FACES * 64];
    static uint32_t vertex[3 * FACES][3], want[3 * FACES];
    size_t at = 0, n = 0;
    struct loaded l;
    for (int k = 0; k < ROWS; k++)
        at += (size_t)sprintf(text + at, "v %d 0 0\nvt 0 %d\nvn 0 0 %d\n", k, k, k + 1);
    for (int i = 0; i < FACES; i++) {
        at += (size_t)sprintf(text + at, "f");
        for (int c = 0; c < 3; c++) {
            const struct imp_key key = imp__key(9, 0, (uint64_t)(3 * i + c));
            uint32_t k[3];
            for (uint32_t j = 0; j < 3; j++) /* few of each, but many v */
                k[j] = 1 + (uint32_t)(imp__u01(key, j) * (j ? 2 + i % 3 : ROWS));
            at += (size_t)sprintf(text + at, " %u/%u/%u", k[0], k[1], k[2]);
            size_t old = 0;
            while (old < n && memcmp(vertex[old], k, sizeof k) != 0) old++;
            if (old == n) memcpy(vertex[n++], k, sizeof k);
            want[3 * i + c] = (uint32_t)old;
        }
        at += (size_t)sprintf(text + at, "\n");
    }
    const enum imp_status st = load(ctx, text, at, "corners.obj", false, &l);
    tap_ok(st == IMP_OK && l.m.n_vertices == n && l.m.n_triangles == FACES &&
               memcmp(l.m.indices, want, sizeof want) == 0,
           "%zu vertices of %d corners, in the order in which they come # %s", n,
           3 * FACES, st ? imp_last_error(ctx) : "");
    size_t wrong = 0;
    for (size_t i = 0; st == IMP_OK && i < n; i++)
        wrong += l.m.positions[3 * i] != (float)(vertex[i][0] - 1) ||
                 l.m.uvs[2 * i + 1] != (float)(vertex[i][1] - 1) || !l.m.normals;
    tap_ok(wrong == 0, "with their own numbers # %zu have not", wrong);
    unload(&l);
}

/* ---- PLY ----------------------------------------------------------------------- */

enum { ASCII, LITTLE, BIG };

struct text {
    char at[4096];
    size_t n;
};

static void put(struct text *t, int format, const char *type, double value)
{
    if (format == ASCII) {
        t->n += (size_t)sprintf(t->at + t->n, "%.9g ", value);
        return;
    }
    unsigned char b[8];
    size_t n = 4;
    if (strcmp(type, "float") == 0) {
        float x = (float)value;
        memcpy(b, &x, 4);
    } else if (strcmp(type, "double") == 0) {
        memcpy(b, &value, n = 8);
    } else if (strcmp(type, "uchar") == 0) {
        b[0] = (unsigned char)value;
        n = 1;
    } else if (strcmp(type, "short") == 0) {
        int16_t x = (int16_t)value;
        memcpy(b, &x, n = 2);
    } else {
        int32_t x = (int32_t)value;
        memcpy(b, &x, 4);
    }
    for (size_t i = 0; i < n; i++)
        t->at[t->n++] = (char)b[format == LITTLE ? i : n - 1 - i];
}

/* Four vertices and two triangles, with an element and properties that nobody knows. */
static void ply_make(struct text *t, int format, double x1)
{
    static const char *const names[] = {"ascii", "binary_little_endian",
                                        "binary_big_endian"};
    t->n = (size_t)sprintf(
        t->at,
        "ply\nformat %s 1.0\ncomment a comment of words\nelement vertex 4\nproperty "
        "uchar red\n"
        "property double x\nproperty float y\nproperty float z\nproperty float nx\n"
        "property float ny\nproperty float nz\nproperty float s\nproperty float t\n"
        "element extra 2\nproperty list uchar short junk\nproperty short w\n"
        "element face 2\nproperty list uchar int vertex_indices\nproperty float "
        "q\nend_header\n",
        names[format]);
    for (int i = 0; i < 4; i++) {
        put(t, format, "uchar", 7);
        put(t, format, "double", i == 1 ? x1 : i % 2);
        put(t, format, "float", i / 2);
        put(t, format, "float", 0.5);
        for (int k = 0; k < 3; k++) put(t, format, "float", k == 2);
        put(t, format, "float", i * 0.25);
        put(t, format, "float", 0.125);
        if (format == ASCII) t->at[t->n++] = '\n';
    }
    for (int i = 0; i < 2; i++) {
        put(t, format, "uchar", 3 * i);
        for (int k = 0; k < 3 * i; k++) put(t, format, "short", -k);
        put(t, format, "short", 9);
        if (format == ASCII) t->at[t->n++] = '\n';
    }
    for (int i = 0; i < 2; i++) {
        put(t, format, "uchar", 3);
        for (int k = 0; k < 3; k++) put(t, format, "int", i + k);
        put(t, format, "float", 2);
        if (format == ASCII) t->at[t->n++] = '\n';
    }
}

static void check_ply(void)
{
    struct text t;
    struct loaded l;
    for (int format = ASCII; format <= BIG; format++) {
        ply_make(&t, format, 1);
        enum imp_status st = load(ctx, t.at, t.n, "a.ply", format == BIG, &l);
        tap_ok(st == IMP_OK && l.m.n_vertices == 4 && l.m.n_triangles == 2 &&
                   l.m.positions[9] == 1 && l.m.positions[10] == 1 &&
                   l.m.positions[11] == 0.5f && l.m.normals[5] == 1 &&
                   l.m.uvs[6] == 0.75f &&
                   l.m.uvs[7] == (format == BIG ? 0.875f : 0.125f) && l.m.indices[5] == 3,
               "PLY format %d # %s", format, st ? imp_last_error(ctx) : "");
        unload(&l);
        ply_make(&t, format, NAN);
        st = load(ctx, t.at, t.n, "a.ply", false, &l);
        tap_ok(st == IMP_E_SCENE &&
                   strcmp(imp_last_error(ctx), "a.ply: vertex 1: x is not finite") == 0,
               "NaN in a vertex # %s", imp_last_error(ctx));
        unload(&l);
    }
#define HEAD                                                                             \
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"      \
    "property float z\nelement face 1\nproperty list uchar int "                         \
    "vertex_index\nend_header\n"
#define POINTS "0 0 0\n1 0 0\n0 1 0\n"
    static const struct {
        const char *text, *message;
    } errors[] = {
        {"plx\n", "e.ply: not a PLY file"},
        {"ply\nformat ascii 1.0\n", "e.ply: the header does not end"},
        {"ply\nformat xml 1.0\nend_header\n", "e.ply: unknown format 'xml 1.0'"},
        {"ply\nformat ascii 1.0\nend_header\n", "e.ply: has no vertices"},
        {"ply\nelement vertex 3\nend_header\n", "e.ply: the header names no format"},
        {"ply\nformat ascii 1.0\nelement vertex -3\n",
         "e.ply: line 3: '-3' is not a count"},
        {"ply\nformat ascii 1.0\nelement vertex 99999999999\n",
         "e.ply: 99999999999 of element vertex: too many"},
        {"ply\nformat ascii 1.0\nelement vertex 3\nelement vertex 3\n",
         "e.ply: element 'vertex' is there twice"},
        {"ply\nformat ascii 1.0\nproperty float x\n",
         "e.ply: line 3: malformed property"},
        {"ply\nformat ascii 1.0\nelement vertex 3\nproperty quad x\n",
         "e.ply: line 4: unknown type"},
        {"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float x\n",
         "e.ply: line 5: property 'x' is there twice"},
        {"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement face 1\n"
         "property list uchar int vertex_index\nend_header\n",
         "e.ply: vertices have no x, y, z"},
        {"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
         "property float z\nelement face 1\nend_header\n",
         "e.ply: faces have no vertex_index or vertex_indices"},
        {"ply\nformat ascii 1.0\nhello\n", "e.ply: line 3: unknown header line 'hello'"},
        {HEAD, "e.ply: is cut off: 3 of element 'vertex' do not fit in the file"},
        {HEAD POINTS "3 0 1 3\n", "e.ply: face 0 names vertex 3; there are 3"},
        {HEAD POINTS "3 0 1 -1\n", "e.ply: face 0 names vertex -1; there are 3"},
        {HEAD POINTS "4 0 1 2 0\n",
         "e.ply: face 0 has 4 corners: only triangles are read"},
        {HEAD POINTS "2 0 1 2\n", "e.ply: face 0 has 2 corners: only triangles are read"},
        {HEAD POINTS "3 0 1 2\n7\n", "e.ply: 2 bytes after the last element"},
        {HEAD "0 0 0\n1 0 0\n0 1 z\n3 0 1 2\n",
         "e.ply: line 12: malformed number in vertex 2"},
        {"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty "
         "float x\n"
         "property float y\nproperty float z\nelement face 1\nproperty list uchar int "
         "vertex_index\n"
         "end_header\n0000",
         "e.ply: is cut off: 1000000000 of element 'vertex' do not fit in the file"}};
    for (size_t i = 0; i < imp_count(errors); i++) {
        const enum imp_status st =
            load(ctx, errors[i].text, strlen(errors[i].text), "e.ply", false, &l);
        tap_ok(st == IMP_E_SCENE && strcmp(imp_last_error(ctx), errors[i].message) == 0,
               "%s", errors[i].message);
        if (strcmp(imp_last_error(ctx), errors[i].message) != 0)
            printf("# %d %s\n", st, imp_last_error(ctx));
        unload(&l);
    }
}

/* Rows that are copied and rows that are read number by number, which differ by their order of
 * bytes alone: a grid of 300 x 300 vertices with normals and uv, or `bare`, a number of bad
 * value in one of its rows if `bad` is not 0. */
enum { GRID = 300, GRID_FACES = 2 * (GRID - 1) * (GRID - 1) };
static void grid_put(unsigned char **to, bool big, const void *number)
{
    const unsigned char *from = number;
    for (int i = 0; i < 4; i++) (*to)[i] = from[big ? 3 - i : i];
    *to += 4;
}
static size_t grid_make(unsigned char *text, bool big, bool bare, int bad)
{
    unsigned char *to = text;
    to += sprintf((char *)to,
                  "ply\nformat binary_%s_endian 1.0\nelement vertex %d\n"
                  "%sproperty float x\nproperty float y\nproperty float z\n%s"
                  "element face %d\nproperty list %s uint vertex_indices\nend_header\n",
                  big ? "big" : "little", GRID * GRID,
                  bare ? "" : "property float nx\nproperty float ny\nproperty float nz\n",
                  bare ? "" : "property float u\nproperty float v\n", GRID_FACES,
                  bare ? "uint" : "uchar");
    for (int k = 0; k < GRID * GRID; k++)
        for (int i = bare ? 3 : 0; i < (bare ? 6 : 8); i++) {
            const float wrong = bare ? -INFINITY : NAN;
            const float f = bad == 1 && k == 70000 && i == 4 ? wrong : .1f * i + k;
            grid_put(&to, big, &f);
        }
    for (uint32_t k = 0; k < GRID_FACES; k++) {
        const uint32_t corners = bad == 2 && k == 150000 ? 4 : 3;
        if (bare) grid_put(&to, big, &corners);
        else *to++ = (unsigned char)corners;
        for (uint32_t i = 0; i < 3; i++) {
            const uint32_t index =
                bad == 3 && k == 160000 ? GRID * GRID : (k + 7 * i) % (GRID * GRID);
            grid_put(&to, big, &index);
        }
    }
    return (size_t)(to - text);
}

static void check_copied(int threads, bool bare)
{
    static const char *const messages[] = {
        "", "g.ply: vertex 70000: y is not finite",
        "g.ply: face 150000 has 4 corners: only triangles are read",
        "g.ply: face 160000 names vertex 90000; there are 90000"};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    unsigned char *text = malloc(1024 + 32 * GRID * GRID + 16 * GRID_FACES);
    imp_context *c;
    o.threads = threads;
    if (!text || imp_context_create(&o, &c) != IMP_OK) abort();
    for (int bad = 0; bad < 4; bad++) {
        struct loaded l[2];
        bool right = true;
        for (int big = 0; big < 2; big++) {
            const enum imp_status st =
                load(c, text, grid_make(text, big, bare, bad), "g.ply", true, &l[big]);
            right &=
                bad ? st == IMP_E_SCENE && strcmp(imp_last_error(c), messages[bad]) == 0
                    : st == IMP_OK;
        }
        if (right && !bad) {
            const struct imp_mesh_data *a = &l[0].m, *b = &l[1].m;
            const size_t n = GRID * GRID * sizeof(float);
            right = a->positions[3 * 70000 + 1] == .1f * 4 + 70000 && bare == !a->uvs &&
                    bare == !a->normals &&
                    (bare || a->uvs[2 * 70000 + 1] == 1 - (.1f * 7 + 70000)) &&
                    a->indices[3 * 150000 + 2] == 150014 % (GRID * GRID) &&
                    !memcmp(a->positions, b->positions, 3 * n) &&
                    (bare || !memcmp(a->normals, b->normals, 3 * n)) &&
                    (bare || !memcmp(a->uvs, b->uvs, 2 * n)) &&
                    !memcmp(a->indices, b->indices, GRID_FACES * 3 * sizeof *a->indices);
        }
        tap_ok(right, "%d threads copy what is read by numbers, too%s # %s", threads,
               bare ? ", bare" : "", messages[bad]);
        unload(&l[0]), unload(&l[1]);
    }
    imp_context_destroy(c);
    free(text);
}

/* ---- Normals ------------------------------------------------------------------- */

/* Of a bumpy grid whose every vertex stands in the list twice: triangles name one or the
 * other, and the normals of both are those of the function. */
static void check_normals(void)
{
    const size_t n = 2 * GRID * GRID;
    float *positions = malloc(3 * n * sizeof *positions), *normals[3];
    uint32_t *indices = malloc(3 * GRID_FACES * sizeof *indices), *to = indices;
    if (!positions || !indices) abort();
    for (uint32_t k = 0; k < n; k++) {
        const uint32_t x = k / 2 % GRID, y = k / 2 / GRID;
        positions[3 * k] = (float)x, positions[3 * k + 1] = (float)y;
        positions[3 * k + 2] = (float)(3 * sin(x * .1) * cos(y * .13));
    }
    for (uint32_t y = 0; y + 1 < GRID; y++)
        for (uint32_t x = 0; x + 1 < GRID; x++) {
            const uint32_t a = 2 * (y * GRID + x), b = a + 2, c = a + 2 * GRID, d = c + 2,
                           twin = (x ^ y) & 1;
            const uint32_t corner[6] = {a, b + twin, d, a + twin, d, c + twin};
            memcpy(to, corner, sizeof corner);
            to += 6;
        }
    for (int t = 0; t < 3; t++) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        imp_context *c;
        o.threads = 2 * t + 1;
        normals[t] = malloc(3 * n * sizeof *normals[t]);
        if (!normals[t] || imp_context_create(&o, &c) != IMP_OK ||
            imp__mesh_normals(c, n, GRID_FACES, positions, indices, normals[t]) != IMP_OK)
            abort();
        imp_context_destroy(c);
    }
    double worst = 0;
    bool twins = true;
    for (size_t k = 0; k < n; k++) {
        const float *p = positions + 3 * k, *q = normals[0] + 3 * k;
        const double x = (double)p[0], y = (double)p[1];
        const imp_v3 right = imp__normalize(imp__v3(-.3 * cos(x * .1) * cos(y * .13),
                                                    .39 * sin(x * .1) * sin(y * .13), 1));
        twins &= memcmp(q, normals[0] + 3 * (k ^ 1), 3 * sizeof *q) == 0;
        if (x == 0 || y == 0 || x == GRID - 1 || y == GRID - 1) continue;
        worst = fmax(worst, 1 - imp__dot(right, imp__v3(q[0], q[1], q[2])));
    }
    tap_ok(worst < 1e-4, "normals of a bumpy grid # cosines 1 - %.3g at worst", worst);
    tap_ok(twins, "vertices at one place have one normal");
    for (int t = 1; t < 3; t++)
        tap_ok(memcmp(normals[0], normals[t], 3 * n * sizeof *normals[t]) == 0,
               "the same bits by %d threads", 2 * t + 1);
    for (int t = 0; t < 3; t++) free(normals[t]);
    free(positions);
    free(indices);
}

/* Soups of up to 41 triangles between the points of a lattice that is 1000 times as wide as high:
 * vertices at one position, slivers, and triangles without area. Beside the sum as it is
 * written, of all corners at each vertex's position. */
static void check_soups(void)
{
    enum { VERTICES = 60, TRIANGLES = 41 };
    double worst = 0;
    int n_equal = 0, n_flat = 0, bad = 0;
    for (size_t n = 1; n <= TRIANGLES; n++) {
        float p[3 * VERTICES + 4] = {0}, out[3 * VERTICES];
        uint32_t index[3 * TRIANGLES];
        const struct imp_key key = imp__key(17, n, 0);
        for (uint32_t k = 0; k < 3 * VERTICES; k++) {
            p[k] = (float)floor(3 * imp__u01(key, k)) * (k % 3 == 2 ? 1e-3f : 1);
            if (p[k] == 0 && k % 2) p[k] = -0.0f;
        }
        for (uint32_t k = 0; k < 3 * n; k++)
            index[k] = (uint32_t)(VERTICES * imp__u01(key, 1000 + k));
        bad += imp__mesh_normals(ctx, VERTICES, n, p, index, out) != IMP_OK;
        for (size_t v = 0; v < VERTICES; v++) {
            imp_v3 sum = {0};
            double most = 0; /* a sum that cancels is known to this */
            for (size_t k = 0; k < 3 * n; k++) {
                const size_t t = k - k % 3;
                const float *a = p + 3 * (size_t)index[k],
                            *b = p + 3 * (size_t)index[t + (k + 1) % 3],
                            *c = p + 3 * (size_t)index[t + (k + 2) % 3], *q = p + 3 * v;
                if (a[0] != q[0] || a[1] != q[1] || a[2] != q[2]) continue;
                const imp_v3 ab = imp__v3((double)b[0] - a[0], (double)b[1] - a[1],
                                          (double)b[2] - a[2]),
                             ac = imp__v3((double)c[0] - a[0], (double)c[1] - a[1],
                                          (double)c[2] - a[2]);
                const imp_v3 up = imp__cross(ab, ac);
                const double angle = atan2(imp__length(up), imp__dot(ab, ac));
                n_equal += (size_t)index[k] != v;
                n_flat += imp__length(up) == 0;
                if (imp__length(up) == 0) continue;
                sum += imp__normalize(up) * angle;
                most += angle;
            }
            const double length = imp__length(sum);
            const imp_v3 want = length > 0 ? sum * (1 / length) : imp__v3(1, 0, 0);
            if (length > 0 && length < 1e-6 * most) continue;
            for (int i = 0; i < 3; i++)
                worst = fmax(worst, fabs(out[3 * v + (size_t)i] - want[i]));
        }
    }
    tap_ok(bad == 0 && worst < 1e-7 && n_equal > 1000 && n_flat > 1000,
           "normals of soups # error %.2g at worst; %d corners of twins, %d without area",
           worst, n_equal, n_flat);
}

/* ---- Hostile --------------------------------------------------------------------------
 */

static void check_cut(const char *name, const char *data, size_t size, size_t slack)
{
    int wrong = 0, read = 0;
    struct loaded l;
    for (size_t n = 0; n < size; n++) {
        char *cut = malloc(n ? n : 1); /* exact: overruns are seen */
        memcpy(cut, data, n);
        const enum imp_status st = load(ctx, cut, n, name, false, &l);
        read += st == IMP_OK;
        wrong += st == IMP_OK && n + slack < size;
        wrong += st != IMP_OK && strncmp(imp_last_error(ctx), name, 5) != 0;
        unload(&l);
        free(cut);
    }
    char *damaged = malloc(size);
    for (size_t i = 0; i < size; i++)
        for (int k = 0; k < 4; k++) {
            memcpy(damaged, data, size);
            damaged[i] = (char)(k == 0 ? ~data[i] : k == 1 ? 0xff : k == 2 ? ' ' : '9');
            (void)!load(ctx, damaged, size, name, false, &l);
            unload(&l);
        }
    free(damaged);
    tap_ok(wrong == 0, "%s cut and damaged anywhere # %zu bytes, %d wrong, %d read", name,
           size, wrong, read);
}

static void check_memory(const char *name, const char *data, size_t size)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
    int steps = 0, wrong = 0;
    for (enum imp_status st = IMP_E_NOMEM; st != IMP_OK && steps < 1000; steps++) {
        struct loaded l;
        heap.calls = 0;
        heap.fail_at = steps + 1;
        st = load(fragile, data, size, name, false, &l);
        heap.fail_at = 0;
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        unload(&l);
    }
    imp_context_destroy(fragile);
    tap_ok(steps > 2 && wrong == 0 && heap.live == 0,
           "%s: no memory at the n-th allocation # %d allocations, %d wrong, %ld leaked",
           name, steps, wrong, heap.live);
}

/* A grid of 300 x 300 quads as OBJ: shared vertices must stay shared. */
static void check_large(void)
{
    enum { N = 300 };
    struct imp_bytes b = {0};
    char line[128];
    for (int y = 0; y <= N; y++)
        for (int x = 0; x <= N; x++)
            imp__bytes_add(ctx, &b, line,
                           (size_t)sprintf(line, "v %d.25 %d 0.1234567\n", x, y));
    for (int y = 0; y < N; y++)
        for (int x = 0; x < N; x++) {
            const int a = y * (N + 1) + x + 1;
            imp__bytes_add(
                ctx, &b, line,
                (size_t)sprintf(line, "f %d %d %d %d\n", a, a + 1, a + N + 2, a + N + 1));
        }
    struct loaded l;
    const enum imp_status st = load(ctx, b.data, b.size, "g.obj", false, &l);
    tap_ok(st == IMP_OK && l.m.n_vertices == (N + 1) * (N + 1) &&
               l.m.n_triangles == 2 * N * N && l.m.positions[5] == 0.1234567f,
           "a large grid # %zu vertices", l.m.n_vertices);
    unload(&l);
    imp__bytes_free(ctx, &b);
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 1;
    check_obj();
    check_obj_corners();
    check_ply();
    for (int bare = 0; bare < 2; bare++) {
        check_copied(1, bare);
        check_copied(3, bare);
    }
    check_normals();
    check_soups();
    static const char obj[] =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n";
    check_cut("h.obj", obj, sizeof obj - 1, 6); /* "3" and "3/1" are corners too */
    struct text t;
    for (int format = ASCII; format <= BIG; format++) {
        ply_make(&t, format, 1);
        check_cut("h.ply", t.at, t.n, format == ASCII ? 2 : 0);
    }
    check_memory("m.obj", obj, sizeof obj - 1);
    check_memory("m.ply", t.at, t.n);
    check_large();
    imp_context_destroy(ctx);
    return tap_done();
}
