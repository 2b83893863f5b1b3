/* SPDX-License-Identifier: Apache-2.0
 *
 * mask: a material with holes. The part `opacity` of what arrives meets the nested
 * material, the rest goes straight on, through one more delta lobe:
 *
 *   f = o f_nested,      coefficient of the hole 1 - o
 *
 * Its value is of first degree in o, from 0 to 1, and its derivative f_nested in one place
 * and -1 in the other. So where derivatives are taken the hole is drawn with a
 * probability that stays away from 0 and 1, at which one of the two would never be seen. */
#include "blending.h"
#include "kind/build.h"

enum { OPACITY };
enum { HOLE }; /* lobe 0; those of the nested material follow */

static const struct imp_input_desc inputs[] = {{.name = "opacity",
                                                .role = IMP_REFLECTANCE,
                                                .flags = IMP_INPUT_SCALAR,
                                                .fallback = 0.5,
                                                .hi = 1,
                                                .unit = "1"},
                                               {0}};

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    (void)self;
    const struct imp_bsdf *c = b->child[0];
    b->flags = (c->flags & ~(unsigned)IMP_BSDF_NULL) | IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT;
    b->absorb = c->absorb;
    b->n_lobes = 1 + imp__lobes_of(c);
    b->straight = 1u << HOLE | c->straight << 1;
    return imp__lobes_check(build, b);
}

/* The nested material, its inputs, and the directions as it gets them. */
static const struct imp_bsdf *nested(const struct imp_bsdf *b, const imp_spec **in,
                                     const struct imp_dirs *d, struct imp_dirs *e)
{
    *in += b->child_in[0];
    *e = *d;
    if (d->lobe != IMP_SMOOTH) e->lobe = d->lobe - 1;
    e->derivative = imp_wanted_of_child(d->derivative, b->child_in[0]);
    return b->child[0];
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    struct imp_dirs e;
    const double q = 1 - imp__mixing_chance(in[OPACITY][0], d, IMP_MIXING_LEAST);
    if (u[0] < q) {
        d->wi = -d->wo;
        d->lobe = HOLE;
        return true;
    }
    const double v[3] = {imp__mixing_rest(u[0], q, 1), u[1], u[2]};
    const struct imp_bsdf *c = nested(b, &in, d, &e);
    e.lobe = IMP_SMOOTH;
    if (!c->ops->sample(c, in, v, &e)) return false;
    d->wi = e.wi;
    d->lobe = e.lobe == IMP_SMOOTH ? IMP_SMOOTH : e.lobe + 1;
    return true;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    struct imp_dirs e;
    const double q = imp__mixing_chance(in[OPACITY][0], d, IMP_MIXING_LEAST);
    if (d->lobe == HOLE) return 1 - q;
    const struct imp_bsdf *c = nested(b, &in, d, &e);
    return q * c->ops->pdf(c, in, &e);
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    struct imp_dirs e;
    const double o = imp__mixing_weight(in[OPACITY][0]);
    *f = imp__spec(1 - o);
    if (d->lobe == HOLE) return;
    const struct imp_bsdf *c = nested(b, &in, d, &e);
    c->ops->eval(c, in, &e, f);
    *f *= o;
}
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    struct imp_dirs e;
    if (d->lobe == HOLE) return 1;
    const struct imp_bsdf *c = nested(b, &in, d, &e);
    return c->ops->index_ratio ? c->ops->index_ratio(c, in, &e) : 1;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    struct imp_dirs e;
    const double raw = in[OPACITY][0], o = imp__mixing_weight(raw);
    const int first = b->child_in[0];
    for (int j = 0; j < b->n_in; j++) df[j] = imp__spec(0);
    df[OPACITY] = imp__spec(-1);
    if (d->lobe != HOLE) {
        const struct imp_bsdf *c = nested(b, &in, d, &e);
        c->ops->eval(c, in, &e, &df[OPACITY]);
        c->ops->eval_d(c, in, &e, df + first);
        for (int j = 0; j < c->n_in; j++) df[first + j] *= o;
    }
    if (o != raw) df[OPACITY] = imp__spec(0); /* cut at 0 or 1 */
}
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    struct imp_dirs e;
    const double o = imp__mixing_weight(in[OPACITY][0]);
    const struct imp_bsdf *c = nested(b, &in, d, &e);
    c->ops->eval_directions_d(c, in, &e, d_wo, d_wi);
    for (int k = 0; k < 3; k++) {
        d_wo[k] *= o;
        d_wi[k] *= o;
    }
}
static void emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e)
{
    const struct imp_bsdf *c = b->child[0];
    *e = imp__spec(0);
    if (c->flags & IMP_BSDF_EMIT) c->ops->emit(c, in + b->child_in[0], wo, e);
    *e *= imp__mixing_weight(in[OPACITY][0]);
}
static void emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de)
{
    const struct imp_bsdf *c = b->child[0];
    const double raw = in[OPACITY][0], o = imp__mixing_weight(raw);
    const int first = b->child_in[0];
    for (int j = 0; j < b->n_in; j++) de[j] = imp__spec(0);
    if (!(c->flags & IMP_BSDF_EMIT)) return;
    if (o == raw) c->ops->emit(c, in + first, wo, &de[OPACITY]);
    c->ops->emit_d(c, in + first, wo, de + first);
    for (int j = 0; j < c->n_in; j++) de[first + j] *= o;
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    imp__bsdf_albedo(b->child[0], in + b->child_in[0], wo, rho);
    *rho *= imp__mixing_weight(in[OPACITY][0]);
}

const struct imp_bsdf_ops imp__mask = {.size = sizeof(struct imp_bsdf_ops),
                                       .name = "mask",
                                       .inputs = inputs,
                                       .min_children = 1,
                                       .max_children = 1,
                                       .build = build,
                                       .sample = sample,
                                       .eval = eval,
                                       .pdf = pdf,
                                       .index_ratio = index_ratio,
                                       .eval_d = eval_d,
                                       .emit = emit,
                                       .emit_d = emit_d,
                                       .albedo = albedo,
                                       .eval_directions_d = eval_directions_d};
