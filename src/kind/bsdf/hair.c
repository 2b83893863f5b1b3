/* SPDX-License-Identifier: Apache-2.0
 *
 * hair: fibres (Chiang et al. 2016; hair_lobes.h), for curves and whatever else has its
 * second texture coordinate along the fibre,
 *
 *     f cos(theta_i) = sum_p M_p A_p(F, T) N_p,   T = exp(-sigma l),
 *
 * sigma per radius, and l the length of a passage in radii:
 *
 *     sigma = scale sigma_a + eumelanin E + pheomelanin P,
 *
 * E and P the absorption of a unit of each pigment (d'Eon et al. 2011). One of the two is
 * written. Where light enters is seen by the direction of sight, and it leaves there too:
 * the model is not reciprocal. Lobes are drawn by A_p, in rgb by its luminance; without
 * absorption every direction weighs 1. */
#include "hair_lobes.h"
#include "presets.h"

enum {
    LONGITUDINAL,
    AZIMUTHAL,
    TILT,
    ETA,
    SIGMA_A,
    SCALE,
    EUMELANIN,
    PHEOMELANIN,
    OF_EUMELANIN,
    OF_PHEOMELANIN,
    N_INPUTS
};

#define ROUGHNESS_MIN 0.02
#define ROUGHNESS(key)                                                                   \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE, .flags = IMP_INPUT_SCALAR,                 \
        .fallback = 0.3, .lo = ROUGHNESS_MIN, .hi = 1, .unit = "1"                       \
    }
#define AMOUNT(key)                                                                      \
    {                                                                                    \
        .name = key, .role = IMP_UNBOUNDED,                                              \
        .flags = IMP_INPUT_SCALAR | IMP_INPUT_OPTIONAL, .fallback = 0, .unit = "1"       \
    }
#define PIGMENT(key)                                                                     \
    {                                                                                    \
        .name = key, .role = IMP_UNBOUNDED,                                              \
        .flags = IMP_INPUT_FIXED | IMP_INPUT_LINEAR | IMP_INPUT_OPTIONAL, .fallback = 0, \
        .unit = "1/radius"                                                               \
    }
static const struct imp_input_desc inputs[] = {
    ROUGHNESS("longitudinal_roughness"),
    ROUGHNESS("azimuthal_roughness"),
    {.name = "scale_tilt",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR,
     .fallback = 2,
     .lo = -45,
     .hi = 45,
     .unit = "degree"},
    IMP_IOR_INPUT(1.55 / 1.000277, 0.1, 10),
    {.name = "sigma_a",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_OPTIONAL,
     .fallback = 0,
     .unit = "1/radius"},
    {.name = "scale",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_OPTIONAL,
     .fallback = 1,
     .unit = "1"},
    AMOUNT("eumelanin"),
    AMOUNT("pheomelanin"),
    PIGMENT("eumelanin_sigma_a"),
    PIGMENT("pheomelanin_sigma_a"),
    {0}};

struct hair {
    double weight[4]; /* of the lanes, where a lobe is chosen */
    int lanes;
};

static enum imp_status prepare(const struct imp_build *b)
{
    static const struct {
        const char *amount, *colour;
        double number, sigma[3];
    } pigments[] = {{"eumelanin", "eumelanin_sigma_a", 1.3, {0.419, 0.697, 1.37}},
                    {"pheomelanin", "pheomelanin_sigma_a", 0.2, {0.187, 0.4, 1.05}}};
    const bool sigma = imp_build_has(b, "sigma_a");
    enum imp_status st = imp__ior_prepare(b, "amber", false);
    if (st == IMP_OK && !sigma && imp_build_has(b, "scale"))
        st = imp_build_error(b, "scale", IMP_E_SCENE,
                             "scale needs a sigma_a, which it multiplies");
    for (int k = 0; k < 2 && st == IMP_OK; k++) {
        const char *const other = imp_build_has(b, pigments[k].amount)
                                      ? pigments[k].amount
                                      : pigments[k].colour;
        if (sigma && imp_build_has(b, other))
            IMP_TRY(imp_build_error(b, other, IMP_E_SCENE,
                                    "has a sigma_a and %s: it can be one of the two",
                                    other));
        if (!sigma && !imp_build_has(b, pigments[k].amount))
            IMP_TRY(imp_build_set(b, pigments[k].amount, 1, &pigments[k].number));
        if (!sigma && !imp_build_has(b, pigments[k].colour))
            IMP_TRY(imp_build_set(b, pigments[k].colour, 3, pigments[k].sigma));
    }
out:
    return st;
}

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    static const double luminance[] = {0.212671, 0.715160, 0.072169};
    struct hair *hair = self;
    const enum imp_color_mode mode = imp_build_color_mode(build);
    hair->lanes = mode == IMP_RGB ? 3 : mode == IMP_MONO ? 1 : 4;
    for (int c = 0; c < hair->lanes; c++)
        hair->weight[c] = mode == IMP_RGB ? luminance[c] : 1.0 / hair->lanes;
    b->flags = IMP_BSDF_SMOOTH | IMP_BSDF_TRANSMIT | IMP_BSDF_TURNED;
    return IMP_OK;
}

/* All that does not depend on wi. */
struct fibre {
    struct imp__hair_shape shape;
    struct imp__hair_sight sight;
    imp_spec sigma, T;
    struct imp__hair_parts parts;
    double chance[IMP_HAIR_LOBES];
};

static void fibre_find(const struct imp_bsdf *b, const imp_spec *in, imp_v3 wo,
                       struct fibre *f)
{
    const struct hair *hair = b->self;
    double sum = 0;
    imp__hair_shape(imp_max(in[LONGITUDINAL][0], ROUGHNESS_MIN),
                    imp_max(in[AZIMUTHAL][0], ROUGHNESS_MIN), in[TILT][0], &f->shape);
    imp__hair_sight(wo, in[ETA][0], &f->sight);
    f->sigma = in[SCALE] * in[SIGMA_A] + in[EUMELANIN] * in[OF_EUMELANIN] +
               in[PHEOMELANIN] * in[OF_PHEOMELANIN];
    for (int c = 0; c < 4; c++) f->T[c] = exp(-f->sigma[c] * f->sight.length);
    imp__hair_parts(f->sight.F, f->T, &f->parts);
    for (int p = 0; p < IMP_HAIR_LOBES; p++) {
        f->chance[p] = 0;
        for (int c = 0; c < hair->lanes; c++)
            f->chance[p] += hair->weight[c] * f->parts.A[p][c];
        sum += f->chance[p];
    }
    if (sum > 0)
        for (int p = 0; p < IMP_HAIR_LOBES; p++) f->chance[p] /= sum;
    else f->chance[0] = 1; /* all is absorbed */
}

static double pdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *value)
{
    struct fibre f;
    double density = 0;
    const struct imp__hair_exit exit = imp__hair_exit(d->wi);
    fibre_find(b, in, d->wo, &f);
    *value = imp__spec(0);
    for (int p = 0; p < IMP_HAIR_LOBES; p++) {
        const double lobe = imp__hair_lobe(&f.shape, &f.sight, p, &exit, NULL);
        density += f.chance[p] * lobe;
        *value += f.parts.A[p] * lobe;
    }
    return density;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    pdf_eval(b, in, d, f);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    imp_spec unused;
    return pdf_eval(b, in, d, &unused);
}

/* u[0] chooses the lobe, and what is left of it is the azimuth's number. */
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    struct fibre f;
    double rest = u[0];
    int p = 0;
    fibre_find(b, in, d->wo, &f);
    while (p < IMP_HAIR_LOBES - 1 && rest >= f.chance[p]) rest -= f.chance[p++];
    while (p > 0 && !(f.chance[p] > 0)) rest = f.chance[--p]; /* rounding */
    const double left = imp_clamp(rest / f.chance[p], 0, 1 - 0x1p-53);
    d->wi = imp__hair_draw(&f.shape, &f.sight, p, (double[3]){left, u[1], u[2]});
    d->lobe = IMP_SMOOTH;
    return true;
}

static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    struct fibre f;
    imp_spec by_sigma = imp__spec(0);
    fibre_find(b, in, d->wo, &f);
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    const struct imp__hair_sight *o = &f.sight;
    const struct imp__hair_exit exit = imp__hair_exit(d->wi);
    for (int p = 0; p < IMP_HAIR_LOBES; p++) {
        double by[4];
        const imp_spec A = f.parts.A[p], by_T = f.parts.dT[p] * f.T;
        const double lobe = imp__hair_lobe(&f.shape, o, p, &exit, by);
        df[LONGITUDINAL] += A * by[0];
        df[AZIMUTHAL] += A * by[1];
        df[TILT] += A * by[2];
        df[ETA] +=
            A * by[3] + (f.parts.dF[p] * o->dF - by_T * f.sigma * o->dlength) * lobe;
        by_sigma -= by_T * (o->length * lobe);
    }
    if (in[LONGITUDINAL][0] < ROUGHNESS_MIN) df[LONGITUDINAL] = imp__spec(0);
    if (in[AZIMUTHAL][0] < ROUGHNESS_MIN) df[AZIMUTHAL] = imp__spec(0);
    df[SIGMA_A] = by_sigma * in[SCALE];
    df[SCALE] = by_sigma * in[SIGMA_A];
    df[EUMELANIN] = by_sigma * in[OF_EUMELANIN];
    df[PHEOMELANIN] = by_sigma * in[OF_PHEOMELANIN];
}

/* The lobes' integrals are 1. */
static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *albedo)
{
    struct fibre f;
    fibre_find(b, in, *wo, &f);
    *albedo = imp__spec(0);
    for (int p = 0; p < IMP_HAIR_LOBES; p++) *albedo += f.parts.A[p];
    return true;
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    directional_albedo(b, in, wo, rho);
}

const struct imp_bsdf_ops imp__hair = {.size = sizeof(struct imp_bsdf_ops),
                                       .name = "hair",
                                       .object_size = sizeof(struct hair),
                                       .inputs = inputs,
                                       .prepare = prepare,
                                       .build = build,
                                       .sample = sample,
                                       .eval = eval,
                                       .pdf = pdf,
                                       .eval_d = eval_d,
                                       .albedo = albedo,
                                       .directional_albedo = directional_albedo,
                                       .pdf_eval = pdf_eval};
