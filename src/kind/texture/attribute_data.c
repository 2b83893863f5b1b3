/* SPDX-License-Identifier: Apache-2.0
 *
 * attribute: numbers of the vertices of a mesh, interpolated over its triangles, or of its
 * triangles. The reader of the mesh makes one for each of its attributes; no file writes
 * it. Numbers of three channels are a colour if the name contains color; else they are read as
 * a vector in mode rgb, and as its luminance in the others, as in Mitsuba. */
#include "color/rgb.h"
#include "input.h"
#include "kind/shape/shape.h"
#include "lifted_texels.h"
#include "math/vec.h"
#include <string.h>

struct attribute {
    size_t n;
    int channels; /* 1 or 3 */
    bool face, spectral;
    float *data; /* [n][channels], and one number more */
    struct imp__lifted_texels lifted;
};

static void changed(const struct imp_texture *t)
{
    struct attribute *a = t->self;
    if (a->spectral && a->channels == 3)
        imp__lifted_texels_update(&a->lifted, IMP__LIFT_BY_SIZE);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    enum imp_status st = IMP_OK;
    struct attribute *a = self;
    const struct imp_attribute_data *from = b->node->attribute;
    if (!from)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "no numbers were given to it: a mesh file brings them"));
    const bool wave = b->mode == IMP_SPECTRAL || b->mode == IMP_SINGLE;
    const bool grey =
        from->channels == 3 && (b->mode == IMP_MONO || (wave && !from->color));
    a->n = from->n;
    a->face = from->face;
    a->channels = grey ? 1 : from->channels;
    a->spectral = wave;
    const size_t count = a->n * (size_t)a->channels;
    a->data = imp_build_alloc(b, count + 1, sizeof *a->data);
    if (!a->data) IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory"));
    bool negative = false;
    for (size_t k = 0; k < count; k++) {
        const float *p = from->values + (grey ? 3 * k : k);
        a->data[k] = grey ? (float)imp__luminance(p[0], p[1], p[2]) : *p;
        negative |= a->data[k] < 0;
    }
    if (a->spectral && a->channels == 3)
        IMP_TRY(imp__lifted_texels_make(b, a->data, a->n, &a->lifted));
    changed(t);
    const size_t dims[2] = {a->n, (size_t)a->channels};
    IMP_TRY(imp_build_texels(b, "", a->data, 2, dims,
                             IMP_PARAM_DIFFERENTIABLE | IMP_PARAM_LIST |
                                 (from->color ? (unsigned)IMP_PARAM_COLOR : 0),
                             negative ? -INFINITY : 0.0, INFINITY, &t->param));
out:
    return st;
}

/* The numbers that a point sees, and their weights. */
struct seen {
    int n;
    size_t row[3];
    double weight[3];
};
static void see(const struct attribute *a, const struct imp_texcoord *at, struct seen *f)
{
    f->n = 0;
    if (!at->surface) return; /* not at a triangle of the mesh */
    const struct imp_triangles *t = &at->shape->triangles;
    f->n = a->face ? 1 : 3;
    f->row[0] = (size_t)at->prim;
    f->weight[0] = 1;
    if (a->face) return;
    imp__triangle_weights(at->shape, at->prim, &at->surface->p, f->weight);
    for (int k = 0; k < 3; k++) f->row[k] = t->indices[3 * (size_t)at->prim + (size_t)k];
}

static bool by_wavelength(const struct attribute *a, const struct imp_texcoord *at,
                          bool scalar)
{
    return at->carried != NULL && a->spectral && a->channels == 3 && !scalar;
}

static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    const struct attribute *a = t->self;
    struct seen f;
    imp_spec sum = imp__spec(0);
    see(a, at, &f);
    if (by_wavelength(a, at, scalar)) {
        const struct imp__texel_sum seen = {f.n, f.row, f.weight};
        imp__lifted_texels_eval(&a->lifted, &seen, at->carried, value);
        return;
    }
    for (int k = 0; k < f.n; k++) {
        const float *p = a->data + (size_t)a->channels * f.row[k];
        sum += (a->channels == 1 ? imp__spec(p[0]) : (imp_spec){p[0], p[1], p[2], 0}) *
               f.weight[k];
    }
    *value = scalar && a->channels == 3
                 ? imp__spec(imp__luminance(sum[0], sum[1], sum[2]))
                 : sum;
}

static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    const struct attribute *a = t->self;
    struct seen f;
    if (t->param < 0) return;
    see(a, at, &f);
    if (by_wavelength(a, at, scalar)) {
        const struct imp__texel_sum seen = {f.n, f.row, f.weight};
        imp__lifted_texels_scatter(&a->lifted, &seen, at->carried, t->param, bar, sink);
        return;
    }
    for (int k = 0; k < f.n; k++) {
        const imp_spec part = *bar * f.weight[k];
        if (a->channels == 1) sink->add(sink, t->param, f.row[k], 1, &part);
        else if (scalar) imp__luminance_scatter(sink, t->param, 3 * f.row[k], part);
        else sink->add(sink, t->param, 3 * f.row[k], 3, &part);
    }
}

static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    const struct attribute *a = t->self;
    struct seen f;
    imp_spec sum = imp__spec(0);
    see(a, at, &f);
    if (by_wavelength(a, at, scalar)) {
        const struct imp__texel_sum seen = {f.n, f.row, f.weight};
        imp__lifted_texels_tangent(&a->lifted, &seen, at->carried, t->param, dot, x_dot,
                                   value_dot);
        return;
    }
    for (int k = 0; k < f.n && t->param >= 0; k++)
        for (int c = 0; c < 3; c++) {
            const size_t e = a->channels == 1 ? f.row[k] : 3 * f.row[k] + (size_t)c;
            sum[c] += dot(x_dot, t->param, e) * f.weight[k];
        }
    *value_dot = scalar && a->channels == 3
                     ? imp__spec(imp__luminance(sum[0], sum[1], sum[2]))
                 : a->channels == 1 ? imp__spec(sum[0])
                                    : sum;
}

static const struct imp_input_desc inputs[] = {{0}};

const struct imp_texture_ops imp__attribute_data = {
    .size = sizeof(struct imp_texture_ops),
    .name = "attribute",
    .object_size = sizeof(struct attribute),
    .inputs = inputs,
    .build = build,
    .eval = eval,
    .scatter = scatter,
    .tangent = tangent,
    .changed = changed};
