/* SPDX-License-Identifier: Apache-2.0
 *
 * principled in lanes, where nothing is transmitted: facets, clearcoat, diffuse lobe and sheen of
 * principled.c, whose letters these are. */
#include "principled_front.h"

static bool covers(const struct imp_bsdf *b)
{
    return !((const struct imp__principled_self *)b->self)->transmits;
}
static imp_wide index_of(const struct imp_bsdf *b, const struct imp_wide_color *in)
{
    return imp__index_of(b->self, in, imp__cut_of(in, SPECULAR));
}
static inline struct imp__lobe_chances chances_of(const bool coated,
                                                  const struct imp_wide_color *in,
                                                  uint64_t derivative, imp_wide cos_o,
                                                  imp_wide e)
{
    return imp__lobe_chances(coated, false, in, derivative, cos_o, e,
                             (imp_wide_truth){0});
}

IMP_EITHER_WAY imp_wide_truth sample_as(const bool coated, const struct imp_bsdf *b,
                                        uint64_t derivative,
                                        const struct imp_wide_color *in,
                                        const imp_wide3 *wo, const imp_wide u[3],
                                        imp_wide3 *wi, imp_wide_lobe *lobe)
{
    (void)lobe;
    const struct imp__lobe_chances q =
        chances_of(coated, in, derivative, wo->z, index_of(b, in));
    const imp_wide_truth lambert = u[0] < q.diffuse,
                         coat = coated ? ~lambert & (u[0] < q.diffuse + q.coat)
                                       : (imp_wide_truth){0};
    const struct imp__facets f = imp__facets_of(in, ~(lambert | coat), derivative);
    imp_wide3 m = imp__facets_normals(&f, wo, &u[1]);
    if (coated) imp__coats_normals(in, &u[1], coat, &m);
    const imp_wide c = imp__wide3_inner(*wo, m);
    imp__lambert_samples(u, wo, wi);
    *wi = imp__wide3_choose(lambert, *wi, imp__mirrors_in(wo, &m, c));
    return imp__fronts(wo, wi) &
           (lambert |
            ((c > imp__wide(0)) & (coat | (u[0] < q.diffuse + q.coat + q.facets))));
}

static imp_wide_truth look(const struct imp_bsdf *b, const struct imp_wide_color *in,
                           const imp_wide3 *wo, const imp_wide3 *wi,
                           struct imp__principled_sides *l)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    *l = (struct imp__principled_sides){.wo = *wo, .wi = *wi, .e = index_of(b, in)};
    l->m = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    l->vm = imp__wide3_inner(*wo, l->m);
    l->om = imp__wide_lesser(l->vm, one);
    return imp__fronts(wo, wi) & (l->om > zero) & (imp__wide3_inner(*wi, l->m) > zero);
}

IMP_EITHER_WAY imp_wide pdf_eval_as(const bool coated, const struct imp_bsdf *b,
                                    uint64_t derivative, const struct imp_wide_color *in,
                                    const imp_wide3 *wo, const imp_wide3 *wi,
                                    const imp_wide_lobe *lobe, int colors,
                                    struct imp_wide_color *f)
{
    struct imp__principled_sides l;
    (void)lobe;
    const imp_wide_truth there = look(b, in, wo, wi, &l);
    const struct imp__front x =
        imp__front_of(coated, false, in, &l, imp__fronts(wo, wi), derivative);
    const struct imp__lobe_chances q = chances_of(coated, in, derivative, wo->z, x.e);
    for (int k = 0; k < colors; k++)
        f->c[k] = imp__front_value(coated, &x, in[BASE].c[k]);
    imp_wide sum = q.facets *
                       imp__facets_normals_pdf(&x.facets, wo, &l.m, l.vm, x.D, x.Go) /
                       (4 * l.om) +
                   q.diffuse * wi->z * IMP_INV_PI;
    if (coated) sum += q.coat * x.coat_D * l.m.z / (4 * l.om);
    return imp__wide_choose(there, sum, imp__wide(0));
}

/* d eta/d specular (eta_of). */
static imp_wide index_slope(const struct imp__principled_self *p,
                            const struct imp_wide_color *in)
{
    if (p->by_eta) return imp__wide(1);
    const imp_wide q = imp__wide_root(
        0.08 * imp__wide_larger(imp__cut_of(in, SPECULAR), imp__wide(1e-14)));
    return 2 / ((1 - q) * (1 - q)) * 0.04 / q;
}

IMP_EITHER_WAY bool eval_d_as(const bool coated, const struct imp_bsdf *b,
                              const struct imp_wide_color *in, const imp_wide3 *wo,
                              const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                              struct imp_wide_color *d)
{
    (void)lobe;
    const struct imp__principled_self *p = b->self;
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    struct imp__principled_sides l;
    const imp_wide_truth there = look(b, in, wo, wi, &l);
    const struct imp__front x =
        imp__front_of(coated, false, in, &l, imp__fronts(wo, wi), 0);
    imp_wide d_DG[2], F_c, F_e;
    imp__facets_turn(in, &x, &l, d_DG);
    IMP_WIDE_OF(imp__dielectric_d)(l.om, x.e, &F_c, &F_e);
    const imp_wide W = x.W, W_e = IMP_WIDE_OF(imp__schlick_by_index)(x.e, l.om), m = x.m,
                   st = x.st, R0 = x.R0, r = (x.e - 1) / (x.e + 1),
                   dR0 = 4 * r / ((x.e + 1) * (x.e + 1)), de = index_slope(p, in);
    imp_wide_truth counts[N_INPUTS];
    for (int j = 0; j < N_INPUTS; j++) counts[j] = imp__counts(in, j, there);
    for (int k = 0; k < colors; k++) {
        const struct imp__dyes y = imp__dyes_of(&x, in[BASE].c[k]);
        const imp_wide base = y.base, tint = y.tint;
        imp_wide own[N_INPUTS];
        imp_wide d_e =
            ((one - base) * (m * W_e) +
             ((one - tint * R0) * W_e + tint * ((1 - W) * dR0)) * ((1 - m) * st) +
             (1 - m) * (1 - st) * F_e) *
            (x.DG * x.c);
        if (coated) d_e += x.cc * x.coat * 0.96 * W_e;
        imp__front_d(coated, &x, d_DG, &y, own);
        own[TRANS] = zero;
        own[p->by_eta ? ETA : SPECULAR] = d_e * de;
        for (int j = 0; j < N_INPUTS; j++)
            d[j].c[k] = imp__wide_choose(counts[j], own[j], zero);
    }
    return true;
}
IMP_KERNEL_BY(imp__is_coated)

const struct imp_bsdf_lanes imp__principled_lanes = {.covers = covers,
                                                     .sample = sample_lanes,
                                                     .pdf_eval = pdf_eval_lanes,
                                                     .eval_d = eval_d_lanes};
