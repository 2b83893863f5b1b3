/* SPDX-License-Identifier: Apache-2.0
 *
 * gridvolume: values of a .vol file over a box. Cell (i, j, k) has its centre at ((i +
 * .5)/nx, ...) of the unit cube. The value is linear in the cells: eval, scatter and
 * tangent go through `footprint`. */
#include "base/required.h"
#include "box.h"
#include "color/rgb.h"
#include "kind/texture/input.h"
#include "kind/texture/lifted_texels.h"
#include <math.h>
#include <string.h>

enum wrap { WRAP_CLAMP, WRAP_REPEAT, WRAP_MIRROR };
enum filter { FILTER_TRILINEAR, FILTER_NEAREST };

struct gridvolume {
    int n[3], channels; /* 1 or 3 */
    enum wrap wrap;
    enum filter filter;
    struct imp_mat4 to_unit;
    struct imp_mat4 box;                /* the unit cube to where to_world finds it */
    struct imp_mat4 rest, rest_to_unit; /* to_world, and to_unit, as the file has them */
    float *data;                        /* [n[2]][n[1]][n[0]][channels] */
    bool spectral;                      /* three channels, and walks carry wavelengths */
    struct imp__lifted_texels lifted;   /* ... of the cells */
};

static enum imp_status box_read(const struct imp_build *b, const struct imp_grid_data *g,
                                struct gridvolume *v)
{
    enum imp_status st = IMP_OK;
    bool use_box;
    v->box = imp__mat4_identity();
    IMP_TRY(imp__box_read(b, &v->to_unit));
    imp__mat4_inverse(&v->to_unit, &v->rest);
    IMP_TRY(imp_build_bool(b, "use_grid_bbox", false, &use_box));
    if (use_box) { /* to_world is applied to the file's box */
        struct imp_mat4 from_box;
        for (int a = 0; a < 3; a++) {
            v->box.m[5 * a] = g->box[3 + a] - g->box[a];
            v->box.m[4 * a + 3] = g->box[a];
        }
        if (!imp__mat4_inverse(&v->box, &from_box))
            IMP_TRY(imp_build_error(b, "use_grid_bbox", IMP_E_SCENE,
                                    "the box of its file is flat"));
        v->to_unit = imp__mat4_multiply(&from_box, &v->to_unit);
    }
    v->rest_to_unit = v->to_unit;
out:
    return st;
}

static void changed(const struct imp_texture *tex)
{
    struct gridvolume *v = tex->self;
    const bool bounded = tex->asked && tex->asked->role == IMP_REFLECTANCE;
    if (!v->spectral) return;
    imp__lifted_texels_update(&v->lifted,
                              bounded ? IMP__LIFT_REFLECTANCE : IMP__LIFT_ANY_SIZE);
}

static enum imp_status build(const struct imp_build *b, void *self,
                             struct imp_texture *tex)
{
    static const char *const wraps[] = {"clamp", "repeat", "mirror"};
    static const char *const filters[] = {"trilinear", "nearest"};
    enum imp_status st = IMP_OK;
    struct gridvolume *v = self;
    const struct imp_grid_data *g = b->node->grid;
    const char *filename;
    bool raw, accel;
    int wrap, filter;
    double max_value, most = 0;
    float lo = 0;
    IMP_TRY(imp_build_string(b, "filename", NULL, &filename));
    IMP_TRY(imp_build_choice(b, "wrap_mode", wraps, 3, WRAP_CLAMP, &wrap));
    IMP_TRY(imp_build_choice(b, "filter_type", filters, 2, FILTER_TRILINEAR, &filter));
    IMP_TRY(imp_build_bool(b, "raw", false, &raw));    /* colours are linear already */
    IMP_TRY(imp_build_bool(b, "accel", true, &accel)); /* Mitsuba's */
    IMP_TRY(imp_build_float(b, "max_value", 0, &max_value));
    if (!g) IMP_TRY(imp__node_missing(b->ctx, b->node, "filename"));
    IMP_TRY(box_read(b, g, v));
    v->wrap = (enum wrap)wrap;
    v->filter = (enum filter)filter;
    memcpy(v->n, g->n, sizeof v->n);
    const bool grey = g->channels == 3 && b->mode == IMP_MONO;
    v->channels = grey ? 1 : g->channels;
    const size_t cells = (size_t)v->n[0] * (size_t)v->n[1] * (size_t)v->n[2],
                 n = cells * (size_t)v->channels;
    v->data = imp__arena_take(b->arena, n, sizeof *v->data);
    if (!v->data) return imp__error(b->ctx, IMP_E_NOMEM, "gridvolume does not fit");
    for (size_t i = 0; i < n; i++) {
        const float *from = g->value + (grey ? 3 * i : i);
        v->data[i] =
            grey ? (float)imp__luminance(from[0], from[1], from[2]) : g->value[i];
        lo = imp_min(lo, v->data[i]);
        most = imp_max(most, (double)v->data[i]);
    }
    if (imp_build_has(b, "max_value") && !(most <= max_value))
        IMP_TRY(imp_build_error(b, "max_value", IMP_E_SCENE,
                                "max_value = %g is outside [%g, inf]: the grid has the "
                                "lower end",
                                max_value, most));
    v->spectral = v->channels == 3 && (b->mode == IMP_SPECTRAL || b->mode == IMP_SINGLE);
    if (v->spectral) IMP_TRY(imp__lifted_texels_make(b, v->data, cells, &v->lifted));
    v->lifted.whole = true; /* for majorants */
    changed(tex);
    const size_t grid[4] = {(size_t)v->n[2], (size_t)v->n[1], (size_t)v->n[0], 3};
    IMP_TRY(imp_build_texels(b, "data", v->data, v->channels == 1 ? 3 : 4, grid,
                             IMP_PARAM_DIFFERENTIABLE | IMP_PARAM_VOLUME |
                                 (v->channels == 3 ? IMP_PARAM_COLOR : 0u),
                             lo < 0 ? -INFINITY : 0.0, INFINITY, &tex->param));
out:
    return st;
}

/* Without a call where the processor has no instruction for it. */
static inline int floor_of(double x)
{
    const int i = (int)x;
    return i - ((double)i > x);
}
static inline int wrapped(int i, int n, enum wrap wrap)
{
    if (imp_likely(wrap == WRAP_CLAMP)) return imp_clamp(i, 0, n - 1);
    if (wrap == WRAP_REPEAT) return (i % n + n) % n;
    const int k = (i % (2 * n) + 2 * n) % (2 * n);
    return k < n ? k : 2 * n - 1 - k;
}

/* The up to eight cells that a lookup sees, and their weights. */
struct footprint {
    int n;
    size_t cell[8];
    double weight[8];
};

/* Cells next to a place along each axis, and how far it is from the first to the second. */
struct corner {
    size_t at[3][2];
    double w[3];
};

static inline void corner_of(const struct gridvolume *v, imp_v3 p, struct corner *c)
{
    const imp_v3 u = imp__point(&v->to_unit, p);
    const bool linear = v->filter == FILTER_TRILINEAR;
    for (int a = 0; a < 3; a++) {
        const int n = v->n[a];
        /* Far outside any cell will do: an int holds it. */
        const double x = imp_clamp(u[a], -1e5, 1e5) * n;
        const double shifted = imp_clamp(linear ? x - 0.5 : x, -1e9, 1e9);
        const int below = floor_of(shifted);
        c->w[a] = shifted - below;
        c->at[a][0] = (size_t)wrapped(below, n, v->wrap);
        c->at[a][1] = (size_t)wrapped(below + 1, n, v->wrap);
    }
}

/* The eight cells, with products of these weights along the axes. */
static inline void eight(const struct gridvolume *v, const struct corner *c,
                         double weight[3][2], struct footprint *f)
{
    const size_t nx = (size_t)v->n[0], ny = (size_t)v->n[1];
    const double *x = weight[0], *y = weight[1], *z = weight[2];
    f->n = 8;
    for (int k = 0; k < 4; k++) {
        const size_t row = (c->at[2][k >> 1] * ny + c->at[1][k & 1]) * nx;
        f->cell[2 * k] = row + c->at[0][0];
        f->cell[2 * k + 1] = row + c->at[0][1];
        f->weight[2 * k] = x[0] * y[k & 1] * z[k >> 1];
        f->weight[2 * k + 1] = x[1] * y[k & 1] * z[k >> 1];
    }
}

static inline void footprint(const struct gridvolume *v, imp_v3 p, struct footprint *f)
{
    struct corner c;
    corner_of(v, p, &c);
    if (v->filter != FILTER_TRILINEAR) {
        f->n = 1;
        f->cell[0] =
            (c.at[2][0] * (size_t)v->n[1] + c.at[1][0]) * (size_t)v->n[0] + c.at[0][0];
        f->weight[0] = 1;
        return;
    }
    double weight[3][2] = {
        {1 - c.w[0], c.w[0]}, {1 - c.w[1], c.w[1]}, {1 - c.w[2], c.w[2]}};
    eight(v, &c, weight, f);
}

static bool by_wavelength(const struct gridvolume *v, const struct imp_texcoord *at,
                          bool scalar)
{
    return imp_unlikely(at->carried != NULL) && v->spectral && !scalar;
}

/* The sum over these cells. */
static inline void sum_of(const struct gridvolume *v, const struct footprint *f,
                          const struct imp_texcoord *at, bool scalar, imp_spec *value)
{
    if (by_wavelength(v, at, scalar)) {
        const struct imp__texel_sum seen = {f->n, f->cell, f->weight};
        imp__lifted_texels_eval(&v->lifted, &seen, at->carried, value);
        return;
    }
    if (v->channels == 1) {
        double sum = 0;
        for (int k = 0; k < f->n; k++) sum += f->weight[k] * v->data[f->cell[k]];
        *value = imp__spec(sum);
        return;
    }
    imp_spec sum = {0};
    for (int k = 0; k < f->n; k++) {
        const float *c = v->data + 3 * f->cell[k];
        sum += (imp_spec){c[0], c[1], c[2], 0} * f->weight[k];
    }
    *value = scalar ? imp__spec(imp__luminance(sum[0], sum[1], sum[2])) : sum;
}

static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    const struct gridvolume *v = t->self;
    struct footprint f;
    footprint(v, at->p, &f);
    sum_of(v, &f, at, scalar, value);
}

/* Along the axes of the cells, then of the world. */
static bool gradient(const struct imp_texture *t, const struct imp_texcoord *at,
                     bool scalar, imp_spec d_p[3])
{
    const struct gridvolume *v = t->self;
    struct corner c;
    if (v->filter != FILTER_TRILINEAR) return false;
    corner_of(v, at->p, &c);
    for (int i = 0; i < 3; i++) d_p[i] = (imp_spec){0};
    for (int a = 0; a < 3; a++) {
        struct footprint f;
        imp_spec slope;
        double weight[3][2];
        for (int i = 0; i < 3; i++) {
            weight[i][0] = i == a ? -v->n[a] : 1 - c.w[i];
            weight[i][1] = i == a ? v->n[a] : c.w[i];
        }
        eight(v, &c, weight, &f);
        sum_of(v, &f, at, scalar, &slope);
        for (int i = 0; i < 3; i++) d_p[i] += slope * v->to_unit.m[4 * a + i];
    }
    return true;
}

/* Set to where the file has it, it is there to the last bit. */
static void place(const struct imp_texture *t, double to_world[12], bool set)
{
    struct gridvolume *v = t->self;
    const size_t rows = 12 * sizeof *to_world;
    if (!set) {
        const struct imp_mat4 unboxed = imp__mat4_multiply(&v->box, &v->to_unit);
        struct imp_mat4 world;
        imp__mat4_inverse(&unboxed, &world);
        const bool unmoved = memcmp(&v->to_unit, &v->rest_to_unit, sizeof world) == 0;
        memcpy(to_world, unmoved ? v->rest.m : world.m, rows);
        return;
    }
    const struct imp_mat4 to = imp__mat4_of_rows(to_world),
                          world = imp__mat4_multiply(&to, &v->box);
    if (memcmp(to.m, v->rest.m, rows) == 0) v->to_unit = v->rest_to_unit;
    else imp__mat4_inverse(&world, &v->to_unit);
}

static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    const struct gridvolume *v = t->self;
    struct footprint f;
    footprint(v, at->p, &f);
    if (by_wavelength(v, at, scalar)) {
        const struct imp__texel_sum seen = {f.n, f.cell, f.weight};
        imp__lifted_texels_scatter(&v->lifted, &seen, at->carried, t->param, bar, sink);
        return;
    }
    for (int k = 0; k < f.n; k++) {
        const imp_spec part = *bar * f.weight[k];
        if (v->channels == 1) sink->add(sink, t->param, f.cell[k], 1, &part);
        else if (scalar) imp__luminance_scatter(sink, t->param, 3 * f.cell[k], part);
        else sink->add(sink, t->param, 3 * f.cell[k], 3, &part);
    }
}

static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    const struct gridvolume *v = t->self;
    struct footprint f;
    imp_spec sum = {0};
    footprint(v, at->p, &f);
    if (by_wavelength(v, at, scalar)) {
        const struct imp__texel_sum seen = {f.n, f.cell, f.weight};
        imp__lifted_texels_tangent(&v->lifted, &seen, at->carried, t->param, dot, x_dot,
                                   value_dot);
        return;
    }
    for (int k = 0; k < f.n; k++)
        if (v->channels == 1)
            sum += imp__spec(f.weight[k] * dot(x_dot, t->param, f.cell[k]));
        else
            for (size_t c = 0; c < 3; c++)
                sum[c] += f.weight[k] * dot(x_dot, t->param, 3 * f.cell[k] + c);
    *value_dot = scalar && v->channels == 3
                     ? imp__spec(imp__luminance(sum[0], sum[1], sum[2]))
                     : sum;
}

/* The largest of the cells that lookups in the box can see. */
static void bound(const struct imp_texture *t, const imp_v3 *lo, const imp_v3 *hi,
                  bool scalar, imp_spec *most)
{
    const struct gridvolume *v = t->self;
    imp_v3 a = {INFINITY, INFINITY, INFINITY, 0}, b = -a;
    int from[3], to[3];
    for (int k = 0; k < 8; k++) {
        const imp_v3 corner = {(k & 1 ? *hi : *lo)[0], (k & 2 ? *hi : *lo)[1],
                               (k & 4 ? *hi : *lo)[2], 0};
        const imp_v3 u = imp__point(&v->to_unit, corner);
        for (int d = 0; d < 3; d++)
            a[d] = imp_min(u[d], a[d]), b[d] = imp_max(u[d], b[d]);
    }
    for (int d = 0; d < 3; d++) {
        const double rim = 0.5001; /* of a trilinear lookup; more than rounding */
        from[d] = (int)floor(imp_clamp(a[d], -1.0, 2.0) * v->n[d] - rim);
        to[d] = (int)floor(imp_clamp(b[d], -1.0, 2.0) * v->n[d] + rim);
        if ((a[d] < 0 || b[d] > 1) && v->wrap != WRAP_CLAMP)
            from[d] = 0, to[d] = v->n[d] - 1;
        from[d] = imp_clamp(from[d], 0, v->n[d] - 1);
        to[d] = imp_clamp(to[d], 0, v->n[d] - 1);
    }
    imp_spec max = imp__spec(-INFINITY);
    for (int z = from[2]; z <= to[2]; z++)
        for (int y = from[1]; y <= to[1]; y++)
            for (int x = from[0]; x <= to[0]; x++) {
                const size_t cell =
                    ((size_t)z * (size_t)v->n[1] + (size_t)y) * (size_t)v->n[0] +
                    (size_t)x;
                if (v->spectral && !scalar) {
                    const double top = imp__lifted_texels_most(&v->lifted, cell);
                    for (int c = 0; c < 4; c++) max[c] = imp_max(top, max[c]);
                }
                for (int c = 0; c < 4 && !(v->spectral && !scalar); c++)
                    max[c] = imp_max(
                        v->data[cell * (size_t)v->channels + (size_t)(c % v->channels)],
                        max[c]);
            }
    *most = scalar ? imp__spec(imp__max3(max)) : max;
}

static void extent(const struct imp_texture *t, double to_unit[12], int cells[3])
{
    const struct gridvolume *v = t->self;
    memcpy(to_unit, v->to_unit.m, 12 * sizeof *to_unit);
    for (int a = 0; a < 3; a++) cells[a] = (v->n[a] + 3) / 4;
}

const struct imp_texture_ops imp__gridvolume = {.size = sizeof(struct imp_texture_ops),
                                                .name = "gridvolume",
                                                .object_size = sizeof(struct gridvolume),
                                                .build = build,
                                                .eval = eval,
                                                .scatter = scatter,
                                                .tangent = tangent,
                                                .bound = bound,
                                                .extent = extent,
                                                .changed = changed,
                                                .place = place,
                                                .gradient = gradient};
