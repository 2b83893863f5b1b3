/* SPDX-License-Identifier: Apache-2.0
 *
 * principled in lanes, where something is transmitted: the lobes in front, and glass_add of
 * principled.c, whose letters these are. */
#include "clear_lanes.h"
#include "principled_front.h"

static bool covers(const struct imp_bsdf *b)
{
    return ((const struct imp__principled_self *)b->self)->transmits;
}

/* specular: the number. */
static struct imp__clear_side side_of(const struct imp_bsdf *b,
                                      const struct imp_wide_color *in, imp_wide specular,
                                      const imp_wide3 *wo, const imp_wide3 *wi)
{
    return imp__clear_side(imp__index_of(b->self, in, specular), wo, wi);
}

IMP_EITHER_WAY imp_wide_truth sample_as(const bool coated, const struct imp_bsdf *b,
                                        uint64_t derivative,
                                        const struct imp_wide_color *in,
                                        const imp_wide3 *wo, const imp_wide u[3],
                                        imp_wide3 *wi, imp_wide_lobe *lobe)
{
    (void)lobe;
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const struct imp__clear_side s = side_of(b, in, imp__cut_of(in, SPECULAR), wo, wo);
    const struct imp__lobe_chances q =
        imp__lobe_chances(coated, true, in, derivative, s.wo.z, s.e, s.back);
    const imp_wide_truth above = s.wo.z > zero, lambert = u[0] < q.diffuse,
                         coat = coated ? ~lambert & (u[0] < q.diffuse + q.coat)
                                       : (imp_wide_truth){0},
                         up = lambert | coat | (u[0] < q.diffuse + q.coat + q.facets);
    const struct imp__facets f =
        imp__facets_of(in, above & ~(lambert | coat), derivative);
    imp_wide3 m = imp__facets_normals(&f, &s.wo, &u[1]), diffuse;
    if (coated) imp__coats_normals(in, &u[1], coat, &m);
    imp_wide cos_t, eta_t;
    const imp_wide c = imp__wide3_inner(s.wo, m),
                   F = IMP_WIDE_OF(imp__dielectric)(imp__wide_lesser(c, one), s.e, &cos_t,
                                                    &eta_t);
    const imp_wide3 mirrored = imp__wide3_minus(imp__wide3_times(m, 2 * c), s.wo),
                    refracted = imp__wide3_minus(imp__wide3_times(m, c / s.e - cos_t),
                                                 imp__wide3_times(s.wo, 1 / s.e));
    imp__lambert_samples(u, &s.wo, &diffuse);
    *wi = imp__wide3_choose(lambert, diffuse,
                            imp__wide3_unit(imp__wide3_choose(up, mirrored, refracted)));
    const imp_wide_truth passes = up | (F != one),
                         kept = (up & (wi->z > zero)) | (~up & (wi->z < zero));
    wi->z = imp__wide_choose(s.back, -wi->z, wi->z);
    return above & (lambert | ((c > zero) & passes)) & kept;
}

/* imp__principled_half. */
struct half {
    struct imp__principled_sides l;
    struct imp__clear_half f;
    imp_wide_truth there, front;
};
static inline struct half half_of(const struct imp__clear_side *s, imp_wide_lobe lobe)
{
    struct half x = {.there = imp__is_smooth(lobe) & imp__clear_half(s, &x.f),
                     .front = s->reflects & ~s->back};
    x.l = (struct imp__principled_sides){s->wo, s->wi, x.f.m, s->e, x.f.vm, x.f.om};
    return x;
}
/* share of glass_add. */
static inline imp_wide share_of(const struct imp__clear_side *s, const struct half *x,
                                const struct imp__front *f)
{
    return imp__wide_choose(s->reflects, f->F * f->c,
                            (1 - f->F) *
                                (x->l.om * -x->f.im / (s->wo.z * x->f.n * x->f.n)));
}
static inline imp_wide color_of(const struct imp__clear_side *s, imp_wide base)
{
    return imp__wide_choose(s->reflects, imp__wide(1), imp__wide_root(base));
}

IMP_EITHER_WAY imp_wide pdf_eval_as(const bool coated, const struct imp_bsdf *b,
                                    uint64_t derivative, const struct imp_wide_color *in,
                                    const imp_wide3 *wo, const imp_wide3 *wi,
                                    const imp_wide_lobe *lobe, int colors,
                                    struct imp_wide_color *f)
{
    const struct imp__clear_side s = side_of(b, in, imp__cut_of(in, SPECULAR), wo, wi);
    const struct half x = half_of(&s, *lobe);
    const struct imp__front y =
        imp__front_of(coated, true, in, &x.l, x.there, derivative);
    const struct imp__lobe_chances q =
        imp__lobe_chances(coated, true, in, derivative, s.wo.z, s.e, s.back);
    const imp_wide glass = (1 - y.m) * y.t * share_of(&s, &x, &y) * y.DG;
    for (int k = 0; k < colors; k++) {
        const imp_wide base = in[BASE].c[k];
        f->c[k] = imp__wide_choose(x.front, imp__front_value(coated, &y, base),
                                   color_of(&s, base) * glass);
    }
    const imp_wide om = x.l.om, p = imp__facets_normals_pdf(&y.facets, &s.wo, &x.l.m,
                                                            x.l.vm, y.D, y.Go);
    imp_wide sum = q.facets * p / (4 * om) + q.diffuse * s.wi.z * IMP_INV_PI;
    if (coated)
        sum = imp__wide_choose(q.coat > imp__wide(0),
                               sum + q.coat * y.coat_D * x.l.m.z / (4 * om), sum);
    sum = imp__wide_choose(s.reflects, sum,
                           q.glass * p * s.e * s.e * -x.f.im / (x.f.n * x.f.n));
    return imp__wide_choose(x.there, sum, imp__wide(0));
}

IMP_EITHER_WAY bool eval_d_as(const bool coated, const struct imp_bsdf *b,
                              const struct imp_wide_color *in, const imp_wide3 *wo,
                              const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                              struct imp_wide_color *d)
{
    const imp_wide zero = imp__wide(0);
    const struct imp__clear_side s = side_of(b, in, imp__cut_of(in, SPECULAR), wo, wi);
    const struct half x = half_of(&s, *lobe);
    const struct imp__front y = imp__front_of(coated, true, in, &x.l, x.there, 0);
    const imp_wide share = share_of(&s, &x, &y), m = y.m, t = y.t, both = (1 - m) * t;
    imp_wide d_DG[2];
    imp_wide_truth counts[N_INPUTS];
    imp__facets_turn(in, &y, &x.l, d_DG);
    for (int j = 0; j < N_INPUTS; j++) counts[j] = imp__counts(in, j, x.there);
    for (int k = 0; k < colors; k++) {
        const imp_wide base = in[BASE].c[k], color = color_of(&s, base),
                       slope = imp__wide_choose(~s.reflects & (color > zero), 0.5 / color,
                                                zero);
        const struct imp__dyes dyes = imp__dyes_of(&y, base);
        imp_wide own[N_INPUTS], glass[N_INPUTS];
        imp__front_d(coated, &y, d_DG, &dyes, own);
        for (int j = 0; j < N_INPUTS; j++) glass[j] = zero;
        glass[BASE] = slope * (both * share * y.DG);
        glass[ROUGHNESS] = color * (both * share * d_DG[0]);
        glass[ANISOTROPIC] = color * (both * share * d_DG[1]);
        glass[METALLIC] = zero - color * (t * share * y.DG);
        glass[TRANS] = color * ((1 - m) * share * y.DG);
        for (int j = 0; j < N_INPUTS; j++)
            d[j].c[k] = imp__wide_choose(
                counts[j], imp__wide_choose(x.front, own[j], glass[j]), zero);
    }
    return true;
}
IMP_KERNEL_BY(imp__is_coated)

/* By the number as it is written: index_ratio does not cut it. */
static imp_wide index_ratio_lanes(const struct imp_bsdf *b,
                                  const struct imp_wide_color *in, const imp_wide3 *wo,
                                  const imp_wide3 *wi, const imp_wide_lobe *lobe)
{
    const struct imp__clear_side s = side_of(b, in, in[SPECULAR].c[0], wo, wi);
    (void)lobe;
    return imp__wide_choose(s.reflects, imp__wide(1), s.e);
}

const struct imp_bsdf_lanes imp__principled_clear_lanes = {.covers = covers,
                                                           .sample = sample_lanes,
                                                           .pdf_eval = pdf_eval_lanes,
                                                           .eval_d = eval_d_lanes,
                                                           .index_ratio =
                                                               index_ratio_lanes};
