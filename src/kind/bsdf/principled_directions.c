/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of the principled material that transmits nothing with respect to directions, lobe
 * by lobe as in principled.c. On reflection om = wo.m has the derivative m/2 by either direction. */
#include "by_directions.h"
#include "fresnel.h"
#include "principled.h"
#include <string.h>

static void add_om(struct imp__by_directions *t, imp_spec by_om, imp_v3 m)
{
    imp__by_directions_add(t, by_om, m * 0.5, m * 0.5);
}

/* 0.25 clearcoat D1(m) G(wo) G(wi) cos_i (0.04 + 0.96 W), with D1 of the form c/q. */
static void coat_turns(const struct imp__principled_look *l, const imp_spec *in, double W,
                       double W_om, struct imp__by_directions *t)
{
    const struct imp__microfacet quarter = {IMP_GGX, true, 0.25, 0.25, 0};
    const double alpha = 0.1 - 0.099 * in[GLOSS][0], A = alpha * alpha, z = l->m[2];
    const double q = 1 + (A - 1) * z * z, D = (A - 1) / (IMP_PI * log(A) * q);
    imp_v3 dGo, dGi;
    const double Go = imp__microfacet_g1_turned(&quarter, &l->wo, &dGo),
                 Gi = imp__microfacet_g1_turned(&quarter, &l->wi, &dGi);
    const double k = 0.25 * in[CLEARCOAT][0], F = 0.04 + 0.96 * W, cos_i = l->wi[2];
    const double by_z = D * -2 * (A - 1) * z / q;
    const imp_v3 by_sum = (imp__v3(0, 0, by_z) - l->m * (z * by_z)) * (1 / l->n);
    imp__by_directions_add(t, imp__spec(k * F * cos_i),
                           by_sum * (Go * Gi) + dGo * (D * Gi),
                           by_sum * (Go * Gi) + dGi * (D * Go));
    t->wi[2] += k * F * D * Go * Gi;
    add_om(t, imp__spec(k * D * Go * Gi * cos_i * 0.96 * W_om), l->m);
}

static void front_turns(const struct imp__principled_look *l, const imp_spec *in,
                        struct imp__by_directions *t)
{
    const double m = l->metallic, cos_o = l->wo[2], cos_i = l->wi[2];
    double W_om, F_c, F_e, gloss_om;
    const double W = imp__schlick_beside(l->om, l->e, &W_om),
                 F = imp__fresnel_dielectric_d(l->om, l->e, &F_c, &F_e);
    const double r = (l->e - 1) / (l->e + 1), R0 = r * r, st = in[SPEC_TINT][0];
    const imp_spec one = imp__spec(1), base = in[BASE];
    imp_spec T_base, T_lum;
    const imp_spec tint = imp__burley_tint(&base, in[LUM][0], &T_base, &T_lum);
    const imp_spec metal = base + (one - base) * W,
                   dyed = tint * R0 + (one - tint * R0) * W;
    const imp_spec Fp = metal * m + dyed * ((1 - m) * st) + (1 - m) * (1 - st) * F;
    const imp_spec Fp_om =
        ((one - base) * m + (one - tint * R0) * ((1 - m) * st)) * W_om +
        (1 - m) * (1 - st) * F_c;

    const struct imp__facet_turns x = imp__microfacet_turns(&l->facets.f, &l->wo, &l->wi);
    const double c = 1 / (4 * cos_o);
    imp__by_directions_add(t, Fp * c, x.by_wo, x.by_wi);
    add_om(t, Fp_om * (x.DG * c), l->m);
    t->wo[2] -= Fp * (x.DG * c / cos_o);

    const struct imp_burley_1 burley =
        imp__burley_1(cos_o, cos_i, l->om, in[ROUGHNESS][0], in[FLATNESS][0]);
    const struct imp__burley_turns by =
        imp__burley_turns(cos_o, cos_i, l->om, in[ROUGHNESS][0], in[FLATNESS][0]);
    const imp_spec diffuse = base * (IMP_INV_PI * (1 - m));
    t->wo[2] += diffuse * (cos_i * by.by_o);
    t->wi[2] += diffuse * (burley.value + cos_i * by.by_i);
    add_om(t, diffuse * (cos_i * by.by_d), l->m);

    const imp_spec dye = one + (tint - one) * in[SHEEN_TINT][0],
                   sheen = dye * (in[SHEEN][0] * (1 - m));
    t->wi[2] += sheen * imp__schlick(l->om, &gloss_om);
    add_om(t, sheen * (cos_i * gloss_om), l->m);
    coat_turns(l, in, W, W_om, t);
}

void imp__principled_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                                  const struct imp_dirs *d, imp_spec d_wo[3],
                                  imp_spec d_wi[3])
{
    imp_spec x[N_INPUTS];
    struct imp__by_directions t = {{{0}, {0}, {0}}, {{0}, {0}, {0}}};
    imp__principled_cut(in, x);
    struct imp__principled_look l = imp__principled_look(b, x, d);
    if (imp__principled_half(&l)) front_turns(&l, x, &t);
    memcpy(d_wo, t.wo, sizeof t.wo);
    memcpy(d_wi, t.wi, sizeof t.wi);
}
