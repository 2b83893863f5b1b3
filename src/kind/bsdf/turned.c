/* SPDX-License-Identifier: Apache-2.0
 *
 * Value, draw, density, emission and derivatives of a nested material in a turned frame, with the
 * shadowing g of Estevez, Lecocq and Stein (2019). */
#include "turned.h"
#include "math/vec.h"
#include <math.h>

enum imp_status imp__turning_build(const struct imp_build *b, struct imp__turning *self,
                                   imp__turned_normal *normal, struct imp_bsdf *bsdf)
{
    enum imp_status st = IMP_OK;
    const struct imp_bsdf *c = bsdf->child[0];
    self->normal = normal;
    bsdf->flags =
        (c->flags & ~(unsigned)(IMP_BSDF_NULL | IMP_BSDF_LINEAR)) | IMP_BSDF_TURNED;
    bsdf->absorb = c->absorb;
    bsdf->n_lobes = c->n_lobes;
    IMP_TRY(imp_build_bool(b, "flip_invalid_normals", true, &self->flip));
    IMP_TRY(imp_build_bool(b, "use_shadowing_function", true, &self->shadow));
out:
    return st;
}

struct turned {
    imp_v3 s, t, n;
};

/* The frame for light that leaves along wo: s is x, made orthogonal to n. */
static struct turned frame_of(const struct imp_bsdf *b, const imp_spec *in, imp_v3 wo)
{
    const struct imp__turning *turning = b->self;
    const imp_v3 n = turning->normal(in);
    struct turned f;
    const double length = imp__length(n);
    f.n = length > 0 && length < INFINITY ? n * (1 / length) : imp__v3(0, 0, 1);
    if (turning->flip && wo[2] * imp__dot(wo, f.n) <= 0)
        f.n = imp__v3(-f.n[0], -f.n[1], f.n[2]);
    f.s = imp__v3(1, 0, 0) - f.n * f.n[0];
    const double l = imp__length(f.s);
    f.s = l > 1e-9 ? f.s * (1 / l) : imp__v3(0, 1, 0); /* n is along x */
    f.t = imp__cross(f.n, f.s);
    return f;
}
static imp_v3 into(const struct turned *f, imp_v3 w)
{
    return imp__v3(imp__dot(w, f->s), imp__dot(w, f->t), imp__dot(w, f->n));
}
static imp_v3 out_of(const struct turned *f, imp_v3 w)
{
    return f->s * w[0] + f->t * w[1] + f->n * w[2];
}

/* The directions in the nested material's frame; false: wi is on different sides of n and n'. */
static bool nested(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   struct turned *f, struct imp_dirs *e)
{
    *f = frame_of(b, in, d->wo);
    *e = *d;
    e->derivative = imp_wanted_of_child(d->derivative, b->child_in[0]);
    e->wo = into(f, d->wo);
    e->wi = into(f, d->wi);
    return d->wi[2] * e->wi[2] > 0;
}

static double shadowing(const struct imp__turning *turning, imp_v3 n, imp_v3 wi)
{
    if (!turning->shadow) return 1;
    const double n2 = n[2] * n[2], w2 = wi[2] * wi[2];
    const double A = n2 > 0 ? imp_clamp((1 - n2) / n2 / 8, 0.0, 1.0) : 1;
    return w2 > 0 ? 2 / (1 + sqrt(1 + A * imp_max(1 - w2, 0.0) / w2)) : 0;
}

bool imp__turned_sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                        struct imp_dirs *d)
{
    const struct imp_bsdf *c = b->child[0];
    const struct turned f = frame_of(b, in, d->wo);
    struct imp_dirs e = *d;
    e.derivative = imp_wanted_of_child(d->derivative, b->child_in[0]);
    e.wo = into(&f, d->wo);
    if (!c->ops->sample(c, in + b->child_in[0], u, &e)) return false;
    d->wi = out_of(&f, e.wi);
    d->lobe = e.lobe;
    return d->wi[2] * e.wi[2] > 0;
}
void imp__turned_eval(const struct imp_bsdf *b, const imp_spec *in,
                      const struct imp_dirs *d, imp_spec *f)
{
    const struct imp_bsdf *c = b->child[0];
    struct turned frame;
    struct imp_dirs e;
    *f = imp__spec(0);
    if (!nested(b, in, d, &frame, &e)) return;
    c->ops->eval(c, in + b->child_in[0], &e, f);
    *f *= shadowing(b->self, frame.n, d->wi);
}
double imp__turned_pdf(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d)
{
    const struct imp_bsdf *c = b->child[0];
    struct turned frame;
    struct imp_dirs e;
    if (!nested(b, in, d, &frame, &e)) return 0;
    return c->ops->pdf(c, in + b->child_in[0], &e);
}
double imp__turned_index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                               const struct imp_dirs *d)
{
    const struct imp_bsdf *c = b->child[0];
    struct turned frame;
    struct imp_dirs e;
    if (!c->ops->index_ratio) return 1;
    nested(b, in, d, &frame, &e);
    return c->ops->index_ratio(c, in + b->child_in[0], &e);
}
void imp__turned_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *df)
{
    const struct imp_bsdf *c = b->child[0];
    const int first = b->child_in[0];
    struct turned frame;
    struct imp_dirs e;
    for (int j = 0; j < b->n_in; j++) df[j] = imp__spec(0);
    if (!nested(b, in, d, &frame, &e)) return;
    const double g = shadowing(b->self, frame.n, d->wi);
    c->ops->eval_d(c, in + first, &e, df + first);
    for (int j = 0; j < c->n_in; j++) df[first + j] *= g;
}
void imp__turned_emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                      imp_spec *e)
{
    const struct imp_bsdf *c = b->child[0];
    const struct turned f = frame_of(b, in, *wo);
    const imp_v3 w = into(&f, *wo);
    *e = imp__spec(0);
    if (c->flags & IMP_BSDF_EMIT) c->ops->emit(c, in + b->child_in[0], &w, e);
}
void imp__turned_emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                        imp_spec *de)
{
    const struct imp_bsdf *c = b->child[0];
    const struct turned f = frame_of(b, in, *wo);
    const imp_v3 w = into(&f, *wo);
    for (int j = 0; j < b->n_in; j++) de[j] = imp__spec(0);
    if (c->flags & IMP_BSDF_EMIT)
        c->ops->emit_d(c, in + b->child_in[0], &w, de + b->child_in[0]);
}
void imp__turned_albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                        imp_spec *albedo)
{
    imp__bsdf_albedo(b->child[0], in + b->child_in[0], wo, albedo);
}
