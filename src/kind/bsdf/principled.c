/* SPDX-License-Identifier: Apache-2.0
 *
 * principled: the Disney material (Burley 2012, 2015; docs/scene-format.md 5.4), a sum of
 *
 *   facets     Fp D G/(4 |cos_o|)                                     reflection
 *   glass      sqrt(base) (1 - metallic) spec_trans
 *              (1 - F) D G |wo.m| |wi.m|/(|cos_o| (wo.m + e wi.m)^2)  transmission
 *   clearcoat  0.25 clearcoat Schlick(0.04) D1(h) G cos_i
 *   diffuse    (1 - metallic)(1 - spec_trans) base/pi (Burley's lobe) cos_i
 *   sheen      sheen (1 - metallic) W(cos_d) (1, or the tint of base) cos_i
 *
 * The last three are in front only. In front
 *
 *   Fp = (1 - metallic)(1 - spec_tint) F + metallic Schlick(base)
 *      + (1 - metallic) spec_tint Schlick(R0 tint),  R0 = ((e - 1)/(e + 1))^2
 *
 * and behind Fp = (1 - metallic) spec_trans F. Where spec_trans is not written, or the
 * number 0, nothing is transmitted; where something is, the index has no derivative
 * (imp__ggx_glass_jumps). The clearcoat has no 1/(4 cos cos), as in the format.
 *
 * Where derivatives are taken, all lobes keep a part of the draws, since the derivative
 * with respect to a weight does not vanish with it. */
#include "principled.h"
#include "blending.h"
#include "burley.h"
#include "fresnel.h"
#include "lambert.h"

static bool is_number(int j) { return j >= ROUGHNESS && j != ETA; }
void imp__principled_cut(const imp_spec *in, imp_spec x[N_INPUTS])
{
    for (int j = 0; j < N_INPUTS; j++)
        x[j] = is_number(j) ? imp__spec(imp_clamp(in[j][0], 0, 1)) : in[j];
}

/* ---- Directions and facets ------------------------------------------------------- */

/* 2/(1 - q) - 1 with q^2 = 0.08 specular, not below what glass must have. F begins with (eta -
 * 1)^2, hence with specular: far below any effect, the root keeps a slope. */
static double eta_of(const struct imp__principled_self *p, const imp_spec *in,
                     double *slope)
{
    *slope = 1;
    if (p->by_eta) return in[ETA][0];
    const double least = p->transmits ? 1e-3 : 1e-14;
    const double q = sqrt(0.08 * imp_max(in[SPECULAR][0], least));
    *slope = 2 / ((1 - q) * (1 - q)) * 0.04 / q;
    return 2 / (1 - q) - 1;
}

struct imp__principled_look imp__principled_look(const struct imp_bsdf *b,
                                                 const imp_spec *in,
                                                 const struct imp_dirs *d)
{
    const struct imp__principled_self *p = b->self;
    struct imp__principled_look l = {
        .p = p, .wo = d->wo, .wi = d->wi, .back = d->wo[2] < 0};
    l.e = eta_of(p, in, &l.de);
    if (l.back) {
        l.wo[2] = -l.wo[2];
        l.wi[2] = -l.wi[2];
        l.e = 1 / l.e;
    }
    l.reflects = l.wi[2] > 0;
    l.metallic = in[METALLIC][0];
    l.trans = p->transmits ? in[TRANS][0] : 0;
    l.facets = imp__burley_facets(in[ROUGHNESS][0], in[ANISOTROPIC][0]);
    l.facets.f.wanted = imp__principled_wanted(d->derivative);
    return l;
}
bool imp__principled_half(struct imp__principled_look *l)
{
    if (!(l->wo[2] > 0) || l->wi[2] == 0) return false;
    if ((l->back || !l->reflects) && !l->p->transmits) return false;
    const imp_v3 h = l->wo + l->wi * (l->reflects ? 1 : l->e);
    l->n = copysign(imp__length(h), h[2]);
    l->m = h * (1 / l->n);
    l->om = imp_min(imp__dot(l->wo, l->m), 1.0);
    l->im = imp__dot(l->wi, l->m);
    return fabs(l->n) > 0 && l->om > 0 && (l->im > 0) == l->reflects && l->im != 0;
}

static double coat_alpha(const imp_spec *in) { return 0.1 - 0.099 * in[GLOSS][0]; }
static double coat_d(double alpha, double z, double *d_log)
{
    return imp__clearcoat_d_1(alpha, log(alpha * alpha), z, d_log);
}

/* ---- Value and derivatives ------------------------------------------------------- */

static void front_add(const struct imp__principled_look *l, const imp_spec *in,
                      imp_spec *f, imp_spec *df)
{
    const double m = l->metallic, t = l->trans, cos_i = l->wi[2];
    double F_c, F_e, dlog_coat;
    const double W = imp__schlick_at_1(l->e, l->om),
                 F = imp__fresnel_dielectric_d(l->om, l->e, &F_c, &F_e);
    const double r = (l->e - 1) / (l->e + 1), R0 = r * r;
    const double dR0 = 4 * r / ((l->e + 1) * (l->e + 1));
    const double st = in[SPEC_TINT][0], sheen = in[SHEEN][0], s_tint = in[SHEEN_TINT][0];
    const imp_spec one = imp__spec(1), base = in[BASE];
    imp_spec T_base, T_lum;
    const imp_spec tint = imp__burley_tint(&base, in[LUM][0], &T_base, &T_lum);
    const imp_spec metal = base + (one - base) * W,
                   dyed = tint * R0 + (one - tint * R0) * W;
    const imp_spec Fp = metal * m + dyed * ((1 - m) * st) + (1 - m) * (1 - st) * F;

    const struct imp__burley_lobe lobe =
        imp__burley_lobe(&l->facets, &l->m, &l->wo, &l->wi);
    const double c = 1 / (4 * l->wo[2]);
    const struct imp_burley_1 burley =
        imp__burley_1(l->wo[2], cos_i, l->om, in[ROUGHNESS][0], in[FLATNESS][0]);
    const double lambert = cos_i * IMP_INV_PI, brdf = (1 - m) * (1 - t);
    const struct imp__microfacet quarter = {IMP_GGX, true, 0.25, 0.25, 0};
    const double coat = 0.25 * coat_d(coat_alpha(in), l->m[2], &dlog_coat) *
                        imp__microfacet_g1(&quarter, &l->wo, NULL) *
                        imp__microfacet_g1(&quarter, &l->wi, NULL) * cos_i;
    const double coat_F = 0.04 + 0.96 * W, cc = in[CLEARCOAT][0];
    const double gloss = imp__schlick_1(l->om) * cos_i;
    const imp_spec dye = one + (tint - one) * s_tint;

    *f += Fp * (lobe.DG * c) + base * (burley.value * lambert * brdf) +
          dye * (sheen * (1 - m) * gloss) + cc * coat * coat_F;
    if (!df) return;

    const imp_spec Fp_tint = imp__spec((1 - m) * st * R0 * (1 - W) * lobe.DG * c) +
                             sheen * (1 - m) * gloss * s_tint;
    df[BASE] +=
        m * (1 - W) * lobe.DG * c + burley.value * lambert * brdf + Fp_tint * T_base;
    df[LUM] += Fp_tint * T_lum;
    df[ROUGHNESS] +=
        Fp * (lobe.d_roughness * c) + base * (burley.d_roughness * lambert * brdf);
    df[ANISOTROPIC] += Fp * (lobe.d_anisotropic * c);
    df[METALLIC] += (metal - dyed * st - (1 - st) * F) * (lobe.DG * c) -
                    base * (burley.value * lambert * (1 - t)) - dye * (sheen * gloss);
    df[SPEC_TINT] += (dyed - F) * ((1 - m) * lobe.DG * c);
    df[SHEEN] += dye * ((1 - m) * gloss);
    df[SHEEN_TINT] += (tint - one) * (sheen * (1 - m) * gloss);
    df[FLATNESS] += base * (burley.d_flatness * lambert * brdf);
    df[CLEARCOAT] += imp__spec(coat * coat_F);
    df[GLOSS] += imp__spec(cc * coat * coat_F * dlog_coat);
    if (l->p->transmits) {
        df[TRANS] -= base * (burley.value * lambert * (1 - m));
        return;
    }
    const double W_e = imp__schlick_by_index_1(l->e, l->om);
    const imp_spec d_e =
        ((one - base) * (m * W_e) +
         ((one - tint * R0) * W_e + tint * ((1 - W) * dR0)) * ((1 - m) * st) +
         (1 - m) * (1 - st) * F_e) *
            (lobe.DG * c) +
        cc * coat * 0.96 * W_e;
    df[l->p->by_eta ? ETA : SPECULAR] += d_e * l->de;
}

/* Reflection from inside, and transmission either way. */
static void glass_add(const struct imp__principled_look *l, const imp_spec *in,
                      imp_spec *f, imp_spec *df)
{
    double F_c, F_e;
    const double m = l->metallic, t = l->trans;
    const double F = imp__fresnel_dielectric_d(l->om, l->e, &F_c, &F_e);
    const struct imp__burley_lobe lobe =
        imp__burley_lobe(&l->facets, &l->m, &l->wo, &l->wi);
    const double c =
        l->reflects ? 1 / (4 * l->wo[2]) : l->om * -l->im / (l->wo[2] * l->n * l->n);
    const double share = (l->reflects ? F : 1 - F) * c, both = (1 - m) * t;
    imp_spec color = imp__spec(1), d_color = imp__spec(0);
    for (int k = 0; k < 4 && !l->reflects; k++) {
        color[k] = sqrt(in[BASE][k]);
        d_color[k] = color[k] > 0 ? 0.5 / color[k] : 0; /* infinite at 0: left out */
    }
    *f += color * (both * share * lobe.DG);
    if (!df) return;

    df[BASE] += d_color * (both * share * lobe.DG);
    df[ROUGHNESS] += color * (both * share * lobe.d_roughness);
    df[ANISOTROPIC] += color * (both * share * lobe.d_anisotropic);
    df[METALLIC] -= color * (t * share * lobe.DG);
    df[TRANS] += color * ((1 - m) * share * lobe.DG);
}

static void lobes_add(const struct imp_bsdf *b, const imp_spec *in,
                      const struct imp_dirs *d, imp_spec *f, imp_spec *df)
{
    imp_spec x[N_INPUTS];
    imp__principled_cut(in, x);
    struct imp__principled_look l = imp__principled_look(b, x, d);
    if (d->lobe != IMP_SMOOTH || !imp__principled_half(&l)) return;
    if (l.reflects && !l.back) front_add(&l, x, f, df);
    else glass_add(&l, x, f, df);
    for (int j = 0; df && j < N_INPUTS; j++)
        if (is_number(j) && x[j][0] != in[j][0]) df[j] = imp__spec(0);
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = imp__spec(0);
    lobes_add(b, in, d, f, NULL);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    imp_spec f = imp__spec(0);
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    lobes_add(b, in, d, &f, df);
}

/* ---- Sampling -------------------------------------------------------------------- */

struct chances {
    double facets, glass, diffuse, coat;
};
static struct chances chances_of(const struct imp__principled_look *l, const imp_spec *in,
                                 uint64_t derivative)
{
    double cos_t, eta_t;
    const double m = l->metallic, t = l->trans;
    const double F = imp__fresnel_dielectric(l->wo[2], l->e, &cos_t, &eta_t);
    const double sheen = in[SHEEN][0], coat = 0.25 * in[CLEARCOAT][0];
    struct chances q = {
        imp_max(m + (1 - m) * F, imp__lobe_least(derivative, IMP_OF_FACETS)), 0, 0, 0};
    if (l->p->transmits && (derivative || t > 0))
        q.glass =
            imp_max((1 - m) * t * (1 - F), imp__lobe_least(derivative, IMP_OF_GLASS));
    if (!l->back) {
        const double diffuse = (1 - m) * imp_max(1 - t, sheen);
        q.diffuse = derivative
                        ? imp_max(diffuse, imp__lobe_least(derivative, IMP_OF_DIFFUSE))
                        : diffuse;
        if (l->p->coated && (derivative || coat > 0)) q.coat = imp_max(coat, 0.03);
    }
    const double all = 1 / (q.facets + q.glass + q.diffuse + q.coat);
    return (struct chances){q.facets * all, q.glass * all, q.diffuse * all, q.coat * all};
}

static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    imp_spec x[N_INPUTS];
    imp__principled_cut(in, x);
    struct imp__principled_look l = imp__principled_look(b, x, d);
    double d_log;
    if (d->lobe != IMP_SMOOTH || !imp__principled_half(&l)) return 0;
    const struct chances q = chances_of(&l, x, d->derivative);
    const double p = imp__microfacet_pdf(&l.facets.f, &l.wo, &l.m);
    if (!l.reflects) return q.glass * p * l.e * l.e * -l.im / (l.n * l.n);
    double sum = q.facets * p / (4 * l.om) + q.diffuse * l.wi[2] * IMP_INV_PI;
    if (q.coat > 0)
        sum += q.coat * coat_d(coat_alpha(x), l.m[2], &d_log) * l.m[2] / (4 * l.om);
    return sum;
}

static imp_v3 coat_normal(double alpha, const double u[2])
{
    const double A = alpha * alpha, phi = IMP_2PI * u[1];
    const double z2 = (1 - pow(A, 1 - u[0])) / (1 - A), s = sqrt(imp_max(0, 1 - z2));
    return imp__v3(s * cos(phi), s * sin(phi), sqrt(imp_max(z2, 0)));
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    d->wi = imp__v3(0, 0, 1);
    d->lobe = IMP_SMOOTH;
    imp_spec x[N_INPUTS];
    imp__principled_cut(in, x);
    const struct imp__principled_look l = imp__principled_look(b, x, d);
    if (!(l.wo[2] > 0) || (l.back && !l.p->transmits)) return false;
    const struct chances q = chances_of(&l, x, d->derivative);
    imp_v3 wi;
    bool up = true;
    if (u[0] < q.diffuse) {
        wi = imp__cosine_hemisphere(&u[1]);
    } else {
        const bool coat = u[0] < q.diffuse + q.coat;
        const imp_v3 m = coat ? coat_normal(coat_alpha(x), &u[1])
                              : imp__microfacet_sample(&l.facets.f, &l.wo, &u[1]);
        const double c = imp__dot(l.wo, m);
        if (!(c > 0)) return false;
        up = coat || u[0] < q.diffuse + q.coat + q.facets;
        double cos_t, eta_t;
        if (!up && imp__fresnel_dielectric(imp_min(c, 1), l.e, &cos_t, &eta_t) == 1)
            return false;
        wi = imp__normalize(up ? m * (2 * c) - l.wo
                               : m * (c / l.e - cos_t) - l.wo * (1 / l.e));
    }
    if (up ? !(wi[2] > 0) : !(wi[2] < 0)) return false;
    if (l.back) wi[2] = -wi[2];
    d->wi = wi;
    return true;
}

static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    const struct imp__principled_look l = imp__principled_look(b, in, d);
    return l.reflects ? 1 : l.e;
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    (void)b, (void)wo;
    *rho = in[BASE];
}

const struct imp_bsdf_ops imp__principled = {
    .size = sizeof(struct imp_bsdf_ops),
    .name = "principled",
    .object_size = sizeof(struct imp__principled_self),
    .inputs = imp__principled_inputs,
    .prepare = imp__principled_prepare,
    .build = imp__principled_build,
    .sample = sample,
    .eval = eval,
    .pdf = pdf,
    .index_ratio = index_ratio,
    .eval_d = eval_d,
    .albedo = albedo,
    .eval_directions_d = imp__principled_directions_d};
