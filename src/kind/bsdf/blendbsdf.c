/* SPDX-License-Identifier: Apache-2.0
 *
 * blendbsdf: two materials mixed, f = (1 - w) f_0 + w f_1. Its derivative with respect to
 * the weight is f_1 - f_0, also where w is 0 or 1 (blending.h). Delta lobe l of material k
 * is lobe 2 l + k here. */
#include "blending.h"
#include "kind/build.h"

enum { WEIGHT };

static const struct imp_input_desc inputs[] = {
    {.name = "weight",
     .role = IMP_REFLECTANCE,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_REQUIRED,
     .fallback = 0.5,
     .hi = 1,
     .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    int lobes = 0;
    (void)self;
    b->flags = 0;
    b->absorb = 0;
    for (int k = 0; k < 2; k++) {
        /* A null material is one lobe of the mixture; the rest is still there. */
        b->flags |= b->child[k]->flags & ~(unsigned)IMP_BSDF_NULL;
        b->absorb = imp_max(b->absorb, b->child[k]->absorb);
        lobes = imp_max(lobes, imp__lobes_of(b->child[k]));
        for (int l = 0; l < 32; l++)
            b->straight |= (b->child[k]->straight >> l & 1) << (2 * l + k);
    }
    b->n_lobes = 2 * lobes;
    return imp__lobes_check(build, b);
}

/* The directions as material k gets them; false: the lobe is the other's. */
static bool asked(int k, const struct imp_dirs *d, struct imp_dirs *e)
{
    *e = *d;
    if (d->lobe == IMP_SMOOTH) return true;
    e->lobe = d->lobe / 2;
    return d->lobe % 2 == k;
}

/* Probability of material 1. What is seen straight through a lobe without a density has no
 * noise but that of the choice: there the least is small. */
static double second_chance(const struct imp_bsdf *b, const imp_spec *in,
                            const struct imp_dirs *d)
{
    return imp__mixing_chance(in[WEIGHT][0], d,
                              b->flags & IMP_BSDF_DELTA ? IMP_MIXING_LEAST
                                                        : IMP_WANTED_LEAST);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const double q = 1 - second_chance(b, in, d);
    const int k = u[0] < q ? 0 : 1;
    const double v[3] = {imp__mixing_rest(u[0], k ? q : 0, k ? 1 : q), u[1], u[2]};
    const struct imp_bsdf *c = b->child[k];
    struct imp_dirs e = {.wo = d->wo,
                         .lobe = IMP_SMOOTH,
                         .derivative =
                             imp_wanted_of_child(d->derivative, b->child_in[k])};
    if (!c->ops->sample(c, in + b->child_in[k], v, &e)) return false;
    d->wi = e.wi;
    d->lobe = e.lobe == IMP_SMOOTH ? IMP_SMOOTH : 2 * e.lobe + k;
    return true;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    const double q = second_chance(b, in, d);
    struct imp_dirs e;
    double sum = 0;
    for (int k = 0; k < 2; k++) {
        const struct imp_bsdf *c = b->child[k];
        if (!asked(k, d, &e)) continue;
        e.derivative = imp_wanted_of_child(d->derivative, b->child_in[k]);
        sum += (k ? q : 1 - q) * c->ops->pdf(c, in + b->child_in[k], &e);
    }
    return sum;
}

/* Values of both materials; 0 where a lobe is the other's. */
static void parts(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                  imp_spec f[2])
{
    struct imp_dirs e;
    for (int k = 0; k < 2; k++) {
        const struct imp_bsdf *c = b->child[k];
        f[k] = imp__spec(0);
        if (asked(k, d, &e)) c->ops->eval(c, in + b->child_in[k], &e, &f[k]);
    }
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    const double w = imp__mixing_weight(in[WEIGHT][0]);
    imp_spec part[2];
    parts(b, in, d, part);
    *f = part[0] * (1 - w) + part[1] * w;
}
/* Where both refract, by different indices, the first that does. */
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    struct imp_dirs e;
    double ratio = 1;
    for (int k = 0; k < 2 && ratio == 1; k++) {
        const struct imp_bsdf *c = b->child[k];
        if (asked(k, d, &e) && c->ops->index_ratio)
            ratio = c->ops->index_ratio(c, in + b->child_in[k], &e);
    }
    return ratio;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    const double raw = in[WEIGHT][0], w = imp__mixing_weight(raw);
    struct imp_dirs e;
    imp_spec part[2];
    for (int j = 0; j < b->n_in; j++) df[j] = imp__spec(0);
    parts(b, in, d, part);
    if (w == raw) df[WEIGHT] = part[1] - part[0];
    for (int k = 0; k < 2; k++) {
        const struct imp_bsdf *c = b->child[k];
        if (!asked(k, d, &e)) continue;
        c->ops->eval_d(c, in + b->child_in[k], &e, df + b->child_in[k]);
        for (int j = 0; j < c->n_in; j++) df[b->child_in[k] + j] *= k ? w : 1 - w;
    }
}
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    const double w = imp__mixing_weight(in[WEIGHT][0]);
    imp_spec second_wo[3], second_wi[3];
    const struct imp_bsdf *const *c = b->child;
    c[0]->ops->eval_directions_d(c[0], in + b->child_in[0], d, d_wo, d_wi);
    c[1]->ops->eval_directions_d(c[1], in + b->child_in[1], d, second_wo, second_wi);
    for (int k = 0; k < 3; k++) {
        d_wo[k] = d_wo[k] * (1 - w) + second_wo[k] * w;
        d_wi[k] = d_wi[k] * (1 - w) + second_wi[k] * w;
    }
}
static void emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e)
{
    const double w = imp__mixing_weight(in[WEIGHT][0]);
    *e = imp__spec(0);
    for (int k = 0; k < 2; k++) {
        const struct imp_bsdf *c = b->child[k];
        imp_spec part;
        if (!(c->flags & IMP_BSDF_EMIT)) continue;
        c->ops->emit(c, in + b->child_in[k], wo, &part);
        *e += part * (k ? w : 1 - w);
    }
}
static void emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de)
{
    const double raw = in[WEIGHT][0], w = imp__mixing_weight(raw);
    for (int j = 0; j < b->n_in; j++) de[j] = imp__spec(0);
    for (int k = 0; k < 2; k++) {
        const struct imp_bsdf *c = b->child[k];
        const int first = b->child_in[k];
        imp_spec part;
        if (!(c->flags & IMP_BSDF_EMIT)) continue;
        c->ops->emit(c, in + first, wo, &part);
        if (w == raw) de[WEIGHT] += part * (k ? 1.0 : -1.0);
        c->ops->emit_d(c, in + first, wo, de + first);
        for (int j = 0; j < c->n_in; j++) de[first + j] *= k ? w : 1 - w;
    }
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    const double w = imp__mixing_weight(in[WEIGHT][0]);
    imp_spec second;
    imp__bsdf_albedo(b->child[0], in + b->child_in[0], wo, rho);
    imp__bsdf_albedo(b->child[1], in + b->child_in[1], wo, &second);
    *rho = *rho * (1 - w) + second * w;
}

const struct imp_bsdf_ops imp__blendbsdf = {.size = sizeof(struct imp_bsdf_ops),
                                            .name = "blendbsdf",
                                            .inputs = inputs,
                                            .min_children = 2,
                                            .max_children = 2,
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
