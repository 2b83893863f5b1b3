/* SPDX-License-Identifier: Apache-2.0
 *
 * Value, draw, density, emission and derivatives of a nested material in a turned frame, with the
 * shadowing g of Estevez, Lecocq and Stein (2019). */
#include "turned.h"
#include "math/vec.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Why n' has no derivative, in words that live as long as the scene; *why stays NULL where it
 * has one. */
static enum imp_status reason(const struct imp_build *b, const struct imp__turning *self,
                              const struct imp_bsdf *c, const char **why)
{
    const struct imp_bsdf *without = imp__bsdf_without_directions_d(c);
    char text[512];
    if (!self->clamp)
        snprintf(
            text, sizeof text,
            "where a normal is turned away from the viewer the value jumps, and the jump "
            "moves with the normal; set clamp_invalid_normals, which makes it "
            "continuous");
    else if (c->flags & (IMP_BSDF_DELTA | IMP_BSDF_EMIT))
        snprintf(text, sizeof text, "the nested material '%s' (%s) %s", c->name,
                 c->ops->name,
                 c->flags & IMP_BSDF_DELTA
                     ? "has ideal lobes, whose directions turn with the normal"
                     : "emits light by a turned direction");
    else if (without)
        snprintf(text, sizeof text,
                 "material '%s' (%s) has no derivative with respect to directions",
                 without->name, without->ops->name);
    else return IMP_OK;
    const size_t size = strlen(text) + 1;
    char *kept = imp_build_alloc(b, size, 1);
    if (!kept) return imp_build_error(b, NULL, IMP_E_NOMEM, "no memory");
    memcpy(kept, text, size);
    *why = kept;
    return IMP_OK;
}

enum imp_status imp__turning_build(const struct imp_build *b, struct imp__turning *self,
                                   bool coded, struct imp_bsdf *bsdf)
{
    enum imp_status st = IMP_OK;
    const struct imp_bsdf *c = bsdf->child[0];
    self->coded = coded;
    bsdf->flags =
        (c->flags & ~(unsigned)(IMP_BSDF_NULL | IMP_BSDF_LINEAR)) | IMP_BSDF_TURNED;
    bsdf->absorb = c->absorb;
    bsdf->n_lobes = c->n_lobes;
    const bool asked = imp_build_has(b, "flip_invalid_normals");
    IMP_TRY(imp_build_bool(b, "clamp_invalid_normals", false, &self->clamp));
    IMP_TRY(imp_build_bool(b, "flip_invalid_normals", !self->clamp, &self->flip));
    IMP_TRY(imp_build_bool(b, "use_shadowing_function", true, &self->shadow));
    if (asked && self->flip && self->clamp)
        IMP_TRY(imp_build_error(b, "flip_invalid_normals", IMP_E_SCENE,
                                "a normal is either flipped or clamped; leave out "
                                "clamp_invalid_normals"));
    /* Without the shadowing wi that passes the surface's own plane may be seen by n'. */
    if (!self->clamp || !self->shadow) bsdf->flags |= IMP_BSDF_STEPS;
    IMP_TRY(reason(b, self, c, &bsdf->why));
    self->moves = !bsdf->why;
    bsdf->fixed = self->moves ? 0 : (UINT64_C(1) << IMP_TURNED_OWN) - 1;
out:
    return st;
}

struct turned {
    imp_v3 s, t, n;
    /* What they were made of. */
    imp_v3 unit;    /* n' before it was flipped or clamped */
    double length;  /* of what it was made of; 0: that has no direction, and n' is z */
    double clamped; /* length of the clamped n'; 0: it was not clamped */
    double lift;    /* the clamped n' is unit + lift wo */
    double across;  /* length of x across n; 0: s is y */
};

/* The frame for light that leaves along wo: s is x, made orthogonal to n. */
static struct turned frame_of(const struct imp_bsdf *b, const imp_spec *in, imp_v3 wo)
{
    const struct imp__turning *turning = b->self;
    const double scale = turning->coded ? 2 : 1, off = turning->coded ? 1 : 0;
    const imp_v3 n =
        imp__v3(scale * in[IMP_TURNED_X][0] - off, scale * in[IMP_TURNED_Y][0] - off,
                scale * in[IMP_TURNED_Z][0] - off);
    struct turned f = {.length = imp__length(n)};
    if (!(f.length > 0 && f.length < INFINITY)) f.length = 0;
    f.unit = f.length > 0 ? n * (1 / f.length) : imp__v3(0, 0, 1);
    f.n = f.unit;
    if (turning->flip && wo[2] * imp__dot(wo, f.n) <= 0)
        f.n = imp__v3(-f.n[0], -f.n[1], f.n[2]);
    const double side = wo[2] < 0 ? -1 : 1, c = imp__dot(wo, f.unit);
    if (turning->clamp && side * c < IMP_TURNED_LEAST) {
        f.lift = side * IMP_TURNED_LEAST - c;
        f.n = f.unit + wo * f.lift;
        f.clamped = imp__length(f.n);
        f.n *= 1 / f.clamped;
    }
    f.s = imp__v3(1, 0, 0) - f.n * f.n[0];
    const double l = imp__length(f.s);
    f.across = l > 1e-9 ? l : 0;
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

/* g, and its derivatives with respect to the z of the unit n' and of wi. */
static double shadowing_d(const struct imp__turning *turning, imp_v3 n, imp_v3 wi,
                          double *d_n, double *d_wi)
{
    *d_n = *d_wi = 0;
    if (!turning->shadow) return 1;
    const double n2 = n[2] * n[2], w2 = wi[2] * wi[2];
    const double tan2 = n2 > 0 ? (1 - n2) / n2 : INFINITY;
    const double A = n2 > 0 ? imp_clamp(tan2 / 8, 0.0, 1.0) : 1;
    if (!(w2 > 0)) return 0;
    const double rest = imp_max(1 - w2, 0.0), T = rest / w2, r = sqrt(1 + A * rest / w2);
    const double g = 2 / (1 + r), by_r = -2 / ((1 + r) * (1 + r) * 2 * r);
    if (tan2 < 8 && tan2 > 0) *d_n = by_r * T * (-2 / (8 * n2 * n[2]));
    if (T > 0) *d_wi = by_r * A * (-2 / (w2 * wi[2]));
    return g;
}
static double shadowing(const struct imp__turning *turning, imp_v3 n, imp_v3 wi)
{
    double d_n, d_wi;
    return shadowing_d(turning, n, wi, &d_n, &d_wi);
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
/* ---- Derivatives ----------------------------------------------------------------- */

/* A derivative by a vector: three numbers in each lane. */
struct by_vector {
    imp_spec k[3];
};
static imp_spec along(const struct by_vector *v, imp_v3 w)
{
    return v->k[0] * w[0] + v->k[1] * w[1] + v->k[2] * w[2];
}
static void add_to(struct by_vector *v, imp_v3 w, imp_spec x)
{
    for (int k = 0; k < 3; k++) v->k[k] += x * w[k];
}
/* The derivative by a unit vector becomes that by the vector of this length that it was made of. */
static void by_length(struct by_vector *v, imp_v3 unit, double length)
{
    add_to(v, unit, -along(v, unit));
    for (int k = 0; k < 3; k++) v->k[k] *= 1 / length;
}

/* The value's derivatives with respect to n' (unit) and to the directions in the frame of the
 * surface, n' staying. Where n' turns by dn, with a = s.dn and b = t.dn, the frame turns, and the
 * directions in it by
 *
 *     dw' = a (-w'_2, 0, w'_0) + b (0, -w'_2, w'_1) + r (w'_1, -w'_0, 0),   r = -b n_x/|x across n|
 *
 * False: the value is 0 around. */
struct turns {
    struct turned frame;
    struct by_vector n, wo, wi;
};
static bool turns_of(const struct imp_bsdf *b, const imp_spec *in,
                     const struct imp_dirs *d, struct turns *x)
{
    const struct imp_bsdf *c = b->child[0];
    struct imp_dirs e;
    struct by_vector g[2];
    imp_spec f, by_a = {0}, by_b = {0}, by_r = {0};
    double g_n, g_wi;
    if (!nested(b, in, d, &x->frame, &e)) return false;
    const struct turned *t = &x->frame;
    c->ops->eval(c, in + b->child_in[0], &e, &f);
    c->ops->eval_directions_d(c, in + b->child_in[0], &e, g[0].k, g[1].k);
    const double shadow = shadowing_d(b->self, t->n, d->wi, &g_n, &g_wi);
    const imp_v3 w[2] = {e.wo, e.wi};
    struct by_vector *const out[2] = {&x->wo, &x->wi};
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 3; k++) g[i].k[k] *= shadow;
        by_a += g[i].k[2] * w[i][0] - g[i].k[0] * w[i][2];
        by_b += g[i].k[2] * w[i][1] - g[i].k[1] * w[i][2];
        by_r += g[i].k[0] * w[i][1] - g[i].k[1] * w[i][0];
        *out[i] = (struct by_vector){{{0}, {0}, {0}}};
        add_to(out[i], t->s, g[i].k[0]);
        add_to(out[i], t->t, g[i].k[1]);
        add_to(out[i], t->n, g[i].k[2]);
    }
    if (t->across > 0) by_b -= by_r * (t->n[0] / t->across);
    x->n = (struct by_vector){{{0}, {0}, {0}}};
    add_to(&x->n, t->s, by_a);
    add_to(&x->n, t->t, by_b);
    x->n.k[2] += f * g_n;
    x->wi.k[2] += f * g_wi;
    return true;
}

/* By n' before it was clamped, and what wo moves of the clamped one: n' is made of unit + lift wo
 * with lift = const - wo.unit. */
static void through_clamp(struct turns *x, imp_v3 wo)
{
    const struct turned *t = &x->frame;
    if (!(t->clamped > 0)) return;
    by_length(&x->n, t->n, t->clamped);
    const imp_spec by_lift = along(&x->n, wo);
    for (int k = 0; k < 3; k++) x->wo.k[k] += x->n.k[k] * t->lift;
    add_to(&x->wo, t->unit, -by_lift);
    add_to(&x->n, wo, -by_lift);
}

void imp__turned_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *df)
{
    const struct imp_bsdf *c = b->child[0];
    const struct imp__turning *turning = b->self;
    const int first = b->child_in[0];
    struct turned frame;
    struct imp_dirs e;
    struct turns x;
    for (int j = 0; j < b->n_in; j++) df[j] = imp__spec(0);
    if (!nested(b, in, d, &frame, &e)) return;
    const double g = shadowing(turning, frame.n, d->wi);
    c->ops->eval_d(c, in + first, &e, df + first);
    for (int j = 0; j < c->n_in; j++) df[first + j] *= g;
    if (!turning->moves || !(frame.length > 0) || d->lobe != IMP_SMOOTH) return;
    if (!turns_of(b, in, d, &x)) return;
    through_clamp(&x, d->wo);
    by_length(&x.n, frame.unit, frame.length);
    for (int k = 0; k < 3; k++)
        df[IMP_TURNED_X + k] = x.n.k[k] * (turning->coded ? 2.0 : 1.0);
}
void imp__turned_eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                                   const struct imp_dirs *d, imp_spec d_wo[3],
                                   imp_spec d_wi[3])
{
    struct turns x;
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (!turns_of(b, in, d, &x)) return;
    through_clamp(&x, d->wo);
    memcpy(d_wo, x.wo.k, sizeof x.wo.k);
    memcpy(d_wi, x.wi.k, sizeof x.wi.k);
}

/* ---- Emission -------------------------------------------------------------------- */

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
