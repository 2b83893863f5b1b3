/* SPDX-License-Identifier: Apache-2.0
 *
 * principledthin: the Disney material of a thin sheet (Burley 2015;
 * docs/scene-format.md 5.4), the same from both sides: z is reversed where wo is below.
 * With h the half-vector of wo and wi, wi's z taken as positive, and dt = diff_trans/2
 *
 *   reflection    spec_trans Fp D G/(4 cos_o),
 *                 Fp = (1 - spec_tint) F + spec_tint Schlick(R0 tint)
 *               + (1 - spec_trans)(1 - dt) base/pi (Burley's lobe) cos_i
 *               + (1 - spec_trans)(1 - dt) sheen W(cos_d) (1, or the tint of base) cos_i
 *   transmission  spec_trans base (1 - F) D' G'/(4 cos_o)
 *               + (1 - spec_trans) dt base/pi |cos_i|
 *
 * D', G' have the roughness times 0.65 eta - 0.35, and the first transmission is there only
 * where wi is behind the facet h. Nothing is bent. Not reciprocal, by that condition. */
#include "blending.h"
#include "burley.h"
#include "by_directions.h"
#include "fresnel.h"
#include "math/warp.h"

enum {
    BASE,
    LUM,
    ROUGHNESS,
    ANISOTROPIC,
    TRANS,
    ETA,
    SPEC_TINT,
    SHEEN,
    SHEEN_TINT,
    FLATNESS,
    DIFF_TRANS,
    N_INPUTS
};

#define OPTIONAL(key) IMP_BURLEY_NUMBER(key, IMP_INPUT_OPTIONAL, 0)
static const struct imp_input_desc inputs[] = {
    IMP_BURLEY_COLOR("base_color"),
    {.name = "base_color", .flags = IMP_INPUT_LUMINANCE, .fallback = 0.5, .hi = 1},
    IMP_BURLEY_NUMBER("roughness", 0, 0.5),
    OPTIONAL("anisotropic"),
    OPTIONAL("spec_trans"),
    {.name = "eta",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR,
     .fallback = 1.5,
     .lo = 0.6, /* 0.65 eta - 0.35 is positive */
     .hi = 4,
     .unit = "1"},
    OPTIONAL("spec_tint"),
    OPTIONAL("sheen"),
    OPTIONAL("sheen_tint"),
    OPTIONAL("flatness"),
    {.name = "diff_trans",
     .role = IMP_REFLECTANCE,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_OPTIONAL,
     .hi = 2,
     .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    /* How Mitsuba shares out its draws: they change no mean. */
    static const char *const rates[] = {
        "specular_reflectance_sampling_rate", "specular_transmittance_sampling_rate",
        "diffuse_reflectance_sampling_rate", "diffuse_transmittance_sampling_rate"};
    enum imp_status st = IMP_OK;
    double rate;
    (void)self;
    for (size_t k = 0; k < imp_count(rates); k++)
        IMP_TRY(imp_build_float(b, rates[k], 1, &rate));
    /* Transmission by facets ends where wi passes the plane of its own. */
    bsdf->flags = IMP_BSDF_SMOOTH | IMP_BSDF_TRANSMIT |
                  (imp_build_has(b, "spec_trans") ? IMP_BSDF_STEPS : 0);
out:
    return st;
}

/* Textures may leave the bounds: there they are cut, and constant. */
static double cut_at(int j, double v)
{
    if (j == ETA) return imp_clamp(v, 0.6, 4);
    return imp_clamp(v, 0, j == DIFF_TRANS ? 2 : 1);
}
static void inputs_cut(const imp_spec *in, imp_spec x[N_INPUTS])
{
    x[BASE] = in[BASE];
    x[LUM] = in[LUM];
    for (int j = ROUGHNESS; j < N_INPUTS; j++) x[j] = imp__spec(cut_at(j, in[j][0]));
}

/* Both directions above, and whether they were on one side. */
struct sheet {
    imp_v3 wo, wi, h;
    double c; /* wo.h */
    bool reflects;
    struct imp__burley_facets facets; /* of the side that wi is on */
    double spread;                    /* what its roughness is multiplied by */
};
static bool sheet_of(const imp_spec *x, const struct imp_dirs *d, struct sheet *s)
{
    *s = (struct sheet){.wo = d->wo, .wi = d->wi, .reflects = d->wi[2] * d->wo[2] > 0};
    s->wo[2] = fabs(s->wo[2]);
    s->wi[2] = fabs(s->wi[2]);
    s->h = imp__normalize(s->wo + s->wi);
    s->c = imp_min(imp__dot(s->wo, s->h), 1.0);
    s->spread = s->reflects ? 1 : 0.65 * x[ETA][0] - 0.35;
    s->facets = imp__burley_facets(x[ROUGHNESS][0] * s->spread, x[ANISOTROPIC][0]);
    s->facets.f.wanted = imp__burley_wanted(d->derivative & IMP_INPUT_BIT(ROUGHNESS),
                                            d->derivative & IMP_INPUT_BIT(ANISOTROPIC));
    return d->lobe == IMP_SMOOTH && s->wo[2] > 0 && s->wi[2] > 0 && s->c > 0;
}

static void reflect_add(const struct sheet *s, const imp_spec *x, imp_spec *f,
                        imp_spec *df)
{
    double F_c, F_e, slope, W_e = 0;
    const double eta = x[ETA][0], t = x[TRANS][0], dt = 0.5 * x[DIFF_TRANS][0];
    const double st = x[SPEC_TINT][0], sheen = x[SHEEN][0], s_tint = x[SHEEN_TINT][0];
    const double F = imp__fresnel_dielectric_d(s->c, eta, &F_c, &F_e);
    const double r = (eta - 1) / (eta + 1), R0 = r * r;
    const double dR0 = 4 * r / ((eta + 1) * (eta + 1));
    double W = imp__schlick(s->c, &slope);
    const double gloss = W * s->wi[2];
    if (!(eta > 1)) { /* at the angle on the side of the lower index */
        const double s2 = 1 - s->c * s->c, ct2 = 1 - s2 / (eta * eta);
        const double ct = sqrt(imp_max(ct2, 0));
        W = imp__schlick(ct, &slope);
        if (ct > 0) W_e = slope * s2 / (eta * eta * eta * ct);
    }
    const imp_spec one = imp__spec(1), base = x[BASE];
    imp_spec T_base, T_lum;
    const imp_spec tint = imp__burley_tint(&base, x[LUM][0], &T_base, &T_lum);
    const imp_spec dyed = tint * R0 + (one - tint * R0) * W;
    const imp_spec Fp = dyed * st + (1 - st) * F;
    const struct imp__burley_lobe lobe =
        imp__burley_lobe(&s->facets, &s->h, &s->wo, &s->wi);
    const double c = 1 / (4 * s->wo[2]), rest = (1 - t) * (1 - dt);
    const struct imp_burley_1 burley =
        imp__burley_1(s->wo[2], s->wi[2], s->c, x[ROUGHNESS][0], x[FLATNESS][0]);
    const double lambert = s->wi[2] * IMP_INV_PI;
    const imp_spec dye = one + (tint - one) * s_tint;
    const imp_spec matt = base * (burley.value * lambert) + dye * (sheen * gloss);

    *f += Fp * (t * lobe.DG * c) + matt * rest;
    if (!df) return;
    const imp_spec by_tint =
        imp__spec(t * st * R0 * (1 - W) * lobe.DG * c + rest * sheen * gloss * s_tint);
    df[BASE] += by_tint * T_base + burley.value * lambert * rest;
    df[LUM] += by_tint * T_lum;
    df[ROUGHNESS] +=
        Fp * (t * lobe.d_roughness * c) + base * (burley.d_roughness * lambert * rest);
    df[ANISOTROPIC] += Fp * (t * lobe.d_anisotropic * c);
    df[TRANS] += Fp * (lobe.DG * c) - matt * (1 - dt);
    df[ETA] +=
        (((one - tint * R0) * W_e + tint * ((1 - W) * dR0)) * st + (1 - st) * F_e) *
        (t * lobe.DG * c);
    df[SPEC_TINT] += (dyed - F) * (t * lobe.DG * c);
    df[SHEEN] += dye * (gloss * rest);
    df[SHEEN_TINT] += (tint - one) * (sheen * gloss * rest);
    df[FLATNESS] += base * (burley.d_flatness * lambert * rest);
    df[DIFF_TRANS] -= matt * (0.5 * (1 - t));
}

/* As the format has it, light passes facets only where wi itself is behind them. */
static bool is_behind(const struct sheet *s)
{
    return imp__dot(s->wi, s->h) < 2 * s->wi[2] * s->h[2];
}

static void transmit_add(const struct sheet *s, const imp_spec *x, imp_spec *f,
                         imp_spec *df)
{
    double F_c, F_e;
    const double t = x[TRANS][0], dt = 0.5 * x[DIFF_TRANS][0];
    const double F = imp__fresnel_dielectric_d(s->c, x[ETA][0], &F_c, &F_e);
    const struct imp__burley_lobe lobe =
        imp__burley_lobe(&s->facets, &s->h, &s->wo, &s->wi);
    const double c = 1 / (4 * s->wo[2]), lambert = s->wi[2] * IMP_INV_PI;
    const double clear = (1 - F) * lobe.DG * c, matt = dt * lambert;
    const bool there = is_behind(s);
    const double behind = there ? t : 0;
    const imp_spec base = x[BASE];

    *f += base * (behind * clear + (1 - t) * matt);
    if (!df) return;
    df[BASE] += imp__spec(behind * clear + (1 - t) * matt);
    df[ROUGHNESS] += base * (behind * (1 - F) * c * lobe.d_roughness * s->spread);
    df[ANISOTROPIC] += base * (behind * (1 - F) * c * lobe.d_anisotropic);
    df[TRANS] += base * ((there ? clear : 0) - matt);
    df[ETA] +=
        base * (behind * c *
                ((1 - F) * lobe.d_roughness * x[ROUGHNESS][0] * 0.65 - F_e * lobe.DG));
    df[DIFF_TRANS] += base * (0.5 * (1 - t) * lambert);
}

static void lobes_add(const imp_spec *in, const struct imp_dirs *d, imp_spec *f,
                      imp_spec *df)
{
    imp_spec x[N_INPUTS];
    struct sheet s;
    inputs_cut(in, x);
    if (!sheet_of(x, d, &s)) return;
    if (s.reflects) reflect_add(&s, x, f, df);
    else transmit_add(&s, x, f, df);
    for (int j = ROUGHNESS; df && j < N_INPUTS; j++)
        if (x[j][0] != in[j][0]) df[j] = imp__spec(0);
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = imp__spec(0);
    lobes_add(in, d, f, NULL);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    imp_spec f = imp__spec(0);
    (void)b;
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    lobes_add(in, d, &f, df);
}

/* ---- Directions ---------------------------------------------------------------- */

/* By c: 1 + wo.wi = 2 c^2. */
static void turns_add_c(struct imp__by_directions *t, const struct sheet *s,
                        imp_spec by_c)
{
    imp__by_directions_add(t, by_c, s->h * 0.5, s->h * 0.5);
}
/* F D G/(4 cos_o), F of the slope F_c. */
static void facets_turn(const struct sheet *s, imp_spec F, imp_spec F_c,
                        struct imp__by_directions *t)
{
    const struct imp__facet_turns x = imp__microfacet_turns(&s->facets.f, &s->wo, &s->wi);
    const double by = 1 / (4 * s->wo[2]);
    imp__by_directions_add(t, F * by, x.by_wo, x.by_wi);
    turns_add_c(t, s, F_c * (x.DG * by));
    t->wo[2] -= F * (x.DG * by / s->wo[2]);
}

static void reflect_turn(const struct sheet *s, const imp_spec *x,
                         struct imp__by_directions *t)
{
    double F_c, F_e, W_c, gloss_c;
    const double eta = x[ETA][0], st = x[SPEC_TINT][0], cos_i = s->wi[2];
    const double F = imp__fresnel_dielectric_d(s->c, eta, &F_c, &F_e);
    const double r = (eta - 1) / (eta + 1), R0 = r * r;
    const double W = imp__schlick_beside(s->c, eta, &W_c),
                 gloss = imp__schlick(s->c, &gloss_c);
    const imp_spec one = imp__spec(1), base = x[BASE];
    imp_spec T_base, T_lum;
    const imp_spec tint = imp__burley_tint(&base, x[LUM][0], &T_base, &T_lum);
    const imp_spec dyed = tint * R0 + (one - tint * R0) * W;
    facets_turn(s, (dyed * st + (1 - st) * F) * x[TRANS][0],
                ((one - tint * R0) * (W_c * st) + (1 - st) * F_c) * x[TRANS][0], t);

    const double rest = (1 - x[TRANS][0]) * (1 - 0.5 * x[DIFF_TRANS][0]);
    const double rough = x[ROUGHNESS][0], flat = x[FLATNESS][0];
    const struct imp_burley_1 lobe = imp__burley_1(s->wo[2], cos_i, s->c, rough, flat);
    const struct imp__burley_turns by =
        imp__burley_turns(s->wo[2], cos_i, s->c, rough, flat);
    const imp_spec matt = base * (rest * IMP_INV_PI),
                   sheen = (one + (tint - one) * x[SHEEN_TINT][0]) * (rest * x[SHEEN][0]);
    t->wo[2] += matt * (cos_i * by.by_o);
    t->wi[2] += matt * (lobe.value + cos_i * by.by_i) + sheen * gloss;
    turns_add_c(t, s, matt * (cos_i * by.by_d) + sheen * (cos_i * gloss_c));
}

static void transmit_turn(const struct sheet *s, const imp_spec *x,
                          struct imp__by_directions *t)
{
    double F_c, F_e;
    const double F = imp__fresnel_dielectric_d(s->c, x[ETA][0], &F_c, &F_e);
    const imp_spec clear = x[BASE] * x[TRANS][0];
    if (is_behind(s)) facets_turn(s, clear * (1 - F), clear * -F_c, t);
    t->wi[2] += x[BASE] * ((1 - x[TRANS][0]) * 0.5 * x[DIFF_TRANS][0] * IMP_INV_PI);
}

static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    imp_spec x[N_INPUTS];
    struct imp__by_directions t = {{{0}, {0}, {0}}, {{0}, {0}, {0}}};
    struct sheet s;
    (void)b;
    inputs_cut(in, x);
    if (sheet_of(x, d, &s)) {
        if (s.reflects) reflect_turn(&s, x, &t);
        else transmit_turn(&s, x, &t);
    }
    for (int k = 0; k < 3; k++) {
        d_wo[k] = t.wo[k] * (k == 2 && d->wo[2] < 0 ? -1. : 1.);
        d_wi[k] = t.wi[k] * (k == 2 && d->wi[2] < 0 ? -1. : 1.);
    }
}

/* Probabilities of the lobes: facets and diffuse, of either side. Where derivatives are
 * taken, all keep a part, since that with respect to a weight does not vanish with it. */
#define BIT        IMP_INPUT_BIT
#define OF_FACETS  (BIT(ROUGHNESS) | BIT(ANISOTROPIC) | BIT(TRANS))
#define OF_DIFFUSE (BIT(TRANS) | BIT(DIFF_TRANS))
struct chances {
    double facets[2], diffuse[2]; /* reflection, transmission */
};
static struct chances chances_of(const imp_spec *x, const struct imp_dirs *d)
{
    double cos_t, eta_t;
    const double t = x[TRANS][0], dt = 0.5 * x[DIFF_TRANS][0];
    const double F = imp__fresnel_dielectric(fabs(d->wo[2]), x[ETA][0], &cos_t, &eta_t);
    const uint64_t w = d->derivative;
    const double least = w ? 0.1 : 0, some = t > 0 ? 0.02 : 0;
    const double facets = w & OF_FACETS ? IMP_WANTED_PART : imp_max(least, some),
                 diffuse = w & OF_DIFFUSE ? IMP_WANTED_PART : least;
    struct chances q = {
        {imp_max(t * F, facets), imp_max(t * (1 - F), facets)},
        {imp_max((1 - t) * (1 - dt), diffuse), imp_max((1 - t) * dt, diffuse)}};
    const double all = 1 / (q.facets[0] + q.facets[1] + q.diffuse[0] + q.diffuse[1]);
    for (int k = 0; k < 2; k++) {
        q.facets[k] *= all;
        q.diffuse[k] *= all;
    }
    return q;
}

static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    imp_spec x[N_INPUTS];
    struct sheet s;
    (void)b;
    inputs_cut(in, x);
    if (!sheet_of(x, d, &s)) return 0;
    const struct chances q = chances_of(x, d);
    const int side = !s.reflects;
    return q.facets[side] * imp__microfacet_pdf(&s.facets.f, &s.wo, &s.h) / (4 * s.c) +
           q.diffuse[side] * s.wi[2] * IMP_INV_PI;
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    imp_spec x[N_INPUTS];
    struct sheet s;
    (void)b;
    inputs_cut(in, x);
    d->lobe = IMP_SMOOTH;
    if (d->wo[2] == 0) return false;
    const struct chances q = chances_of(x, d);
    double rest = u[0];
    int lobe = 0; /* reflecting and transmitting facets, then the diffuse ones */
    const double share[4] = {q.facets[0], q.facets[1], q.diffuse[0], q.diffuse[1]};
    while (lobe < 3 && !(rest < share[lobe])) rest -= share[lobe++];
    const double side = d->wo[2] > 0 ? 1 : -1, way = lobe % 2 ? -side : side;
    imp_v3 wi;
    if (lobe >= 2) {
        wi = imp__cosine_hemisphere(&u[1]);
    } else {
        d->wi = imp__v3(-d->wo[0], -d->wo[1], way * fabs(d->wo[2]));
        if (!sheet_of(x, d, &s)) return false; /* for its facets */
        const imp_v3 m = imp__microfacet_sample(&s.facets.f, &s.wo, &u[1]);
        const double c = imp__dot(s.wo, m);
        if (!(c > 0)) return false;
        wi = imp__normalize(m * (2 * c) - s.wo);
    }
    if (!(wi[2] > 0)) return false;
    wi[2] *= way;
    d->wi = wi;
    return true;
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    (void)b, (void)wo;
    *rho = in[BASE];
}

const struct imp_bsdf_ops imp__principledthin = {.size = sizeof(struct imp_bsdf_ops),
                                                 .name = "principledthin",
                                                 .inputs = inputs,
                                                 .build = build,
                                                 .sample = sample,
                                                 .eval = eval,
                                                 .pdf = pdf,
                                                 .eval_d = eval_d,
                                                 .albedo = albedo,
                                                 .eval_directions_d = eval_directions_d};
