/* SPDX-License-Identifier: Apache-2.0
 *
 * roughconductor: mirrors of complex index as small facets (Walter et al. 2007). With h
 * the half-vector and c = wo.h = wi.h
 *
 *   f cos(theta_i) = tint F(c) D(h) G1(wi) G1(wo) / (4 cos(theta_o)),   front only
 *
 * Light that meets a second facet is lost, as in the format. Drawing a normal and
 * mirroring wo in it gives p(wi) = p(h)/(4 c). */
#include "fresnel.h"
#include "lambert.h"
#include "microfacet.h"
#include "presets.h"

enum { ETA, K, TINT, ALPHA, ALPHA_U, ALPHA_V, N_INPUTS };

struct rough {
    enum imp__distribution type;
    bool visible, anisotropic;
};

#define ROUGHNESS(key)                                                                   \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE,                                            \
        .flags = IMP_INPUT_SCALAR | IMP_INPUT_OPTIONAL, .fallback = 0.1,                 \
        .lo = IMP_ALPHA_MIN, .hi = INFINITY, .unit = "1"                                 \
    }
static const struct imp_input_desc inputs[] = {IMP_ETA_INPUT,
                                               IMP_K_INPUT,
                                               IMP_TINT_INPUT("specular_reflectance"),
                                               ROUGHNESS("alpha"),
                                               ROUGHNESS("alpha_u"),
                                               ROUGHNESS("alpha_v"),
                                               {0}};

/* One of alpha and (alpha_u, alpha_v) is there, so that it can be a parameter, and
 * numbers are not below the smallest roughness. */
static enum imp_status prepare(const struct imp_build *b)
{
    static const char *const names[] = {"alpha", "alpha_u", "alpha_v"};
    enum imp_status st = IMP_OK;
    struct imp_node *node = b->node;

    IMP_TRY(imp__conductor_prepare(b));
    const bool iso = imp_build_has(b, "alpha"), u = imp_build_has(b, "alpha_u"),
               v = imp_build_has(b, "alpha_v");
    if (u != v || (iso && u))
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "give either 'alpha', or both 'alpha_u' and 'alpha_v'"));
    if (!iso && !u) IMP_TRY(imp_build_set(b, "alpha", 1, &(double){0.1}));
    for (int i = 0; i < 3; i++) {
        struct imp_prop *p = imp__node_prop(node, names[i]);
        if (!p) continue;
        if (p->type == IMP_PROP_FLOAT && p->number[0] >= 0)
            p->number[0] = imp_max(p->number[0], IMP_ALPHA_MIN);
        if (p->type == IMP_PROP_INTEGER && p->integer == 0) {
            p->type = IMP_PROP_FLOAT;
            p->number[0] = IMP_ALPHA_MIN;
        }
    }
out:
    return st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    static const char *const types[] = {"beckmann", "ggx"};
    enum imp_status st = IMP_OK;
    struct rough *r = self;
    int type;
    IMP_TRY(imp_build_choice(b, "distribution", types, 2, IMP_BECKMANN, &type));
    IMP_TRY(imp_build_bool(b, "sample_visible", true, &r->visible));
    r->type = (enum imp__distribution)type;
    r->anisotropic = imp_build_has(b, "alpha_u");
    bsdf->flags = IMP_BSDF_SMOOTH;
out:
    return st;
}

/* Textures may hold less than the smallest roughness: then it is that, and constant. */
static struct imp__microfacet distribution(const struct imp_bsdf *b, const imp_spec *in)
{
    const struct rough *r = b->self;
    const double au = in[r->anisotropic ? ALPHA_U : ALPHA][0],
                 av = in[r->anisotropic ? ALPHA_V : ALPHA][0];
    return (struct imp__microfacet){r->type, r->visible, fmax(au, IMP_ALPHA_MIN),
                                    fmax(av, IMP_ALPHA_MIN)};
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = imp__spec(0);
    if (!imp__front(d)) return;
    const struct imp__microfacet m = distribution(b, in);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double D = imp__microfacet_d(&m, &h, NULL);
    const double G =
        imp__microfacet_g1(&m, &d->wi, NULL) * imp__microfacet_g1(&m, &d->wo, NULL);
    imp__fresnel_conductor(fmin(1, imp__dot(d->wo, h)), &in[ETA], &in[K], f);
    *f *= in[TINT] * (D * G / (4 * d->wo[2]));
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    if (!imp__front(d)) return 0;
    const struct imp__microfacet m = distribution(b, in);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    return imp__microfacet_pdf(&m, &d->wo, &h) / (4 * imp__dot(d->wo, h));
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    if (!(d->wo[2] > 0)) return false;
    const struct imp__microfacet m = distribution(b, in);
    const imp_v3 h = imp__microfacet_sample(&m, &d->wo, &u[1]);
    const double c = imp__dot(d->wo, h);
    if (!(c > 0)) return false;
    d->wi = imp__normalize(h * (2 * c) - d->wo);
    d->lobe = IMP_SMOOTH;
    if (!(d->wi[2] > 0)) return false; /* the facet sends it into the surface */
    return true;
}

/* ln f = ln tint + ln F + ln D + ln G1(wi) + ln G1(wo), one term an input. */
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    const struct rough *r = b->self;
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    if (!imp__front(d)) return;
    const struct imp__microfacet m = distribution(b, in);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    double dlog_D[2], dGi[2], dGo[2];
    imp_spec F, F_eta, F_k;
    const double D = imp__microfacet_d(&m, &h, dlog_D);
    const double Gi = imp__microfacet_g1(&m, &d->wi, dGi),
                 Go = imp__microfacet_g1(&m, &d->wo, dGo);
    imp__fresnel_conductor_d(fmin(1, imp__dot(d->wo, h)), &in[ETA], &in[K], &F, &F_eta,
                             &F_k);

    const double c = D / (4 * d->wo[2]);
    df[TINT] = F * (c * Gi * Go);
    df[ETA] = in[TINT] * F_eta * (c * Gi * Go);
    df[K] = in[TINT] * F_k * (c * Gi * Go);
    for (int j = 0; j < 2; j++) {
        const int input = r->anisotropic ? ALPHA_U + j : ALPHA;
        if (in[input][0] < IMP_ALPHA_MIN) continue;
        df[input] +=
            in[TINT] * F * (c * (dlog_D[j] * Gi * Go + dGi[j] * Go + Gi * dGo[j]));
    }
}

const struct imp_bsdf_ops imp__roughconductor = {.size = sizeof(struct imp_bsdf_ops),
                                                 .name = "roughconductor",
                                                 .object_size = sizeof(struct rough),
                                                 .inputs = inputs,
                                                 .prepare = prepare,
                                                 .build = build,
                                                 .sample = sample,
                                                 .eval = eval,
                                                 .pdf = pdf,
                                                 .eval_d = eval_d};
