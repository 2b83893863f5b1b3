/* SPDX-License-Identifier: Apache-2.0
 *
 * stam_m2: Lambert and a Phong-Blinn lobe with an ambient term (Stam 2020, App. B and C,
 * with the errata of docs/estimators.md 3). With m the half-vector, c_m = cos(theta_m) and
 * mo = m.wo
 *
 *   f cos(theta_i) = diffuse cos(theta_i)/pi + specular S,
 *   S = (alpha + 2)/(2 pi) c_m^(alpha + 1) / (4 mo) * V
 *   V = min(1, cos_i/cos_o)   variant "reciprocal" (default): reciprocal, albedo <= 1
 *       1                     "microfacet": Stam's G, neither of the two (E28)
 *       sin(theta_m)          "paper": as printed, a ring without a mirror limit (E10)
 *
 * The lobe's own sampling draws m with p_m = (alpha + 2)/(2 pi) c_m^(alpha + 1), so that
 * p(wi) = p_m/(4 mo) and S/p = V. Half-vectors with mo <= 0 and directions below the
 * horizon are structural zeros; nothing is flipped (E21). */
#include "kind/build.h"
#include "lambert.h"
#include "stam.h"

enum { AMBIENT = IMP_AMBIENT, DIFFUSE, SPECULAR, EXPONENT, N_INPUTS };
enum variant { RECIPROCAL, MICROFACET, PAPER };
enum sampling { MIXTURE, COSINE, PHONG };

struct m2 {
    enum variant variant;
    enum sampling sampling;
};

static const struct imp_input_desc inputs[] = {
    IMP_STAM_AMBIENT,
    {.name = "diffuse", .role = IMP_REFLECTANCE, .fallback = 0.5, .hi = 1, .unit = "1"},
    {.name = "specular", .role = IMP_REFLECTANCE, .fallback = 0.3, .hi = 1, .unit = "1"},
    {.name = "exponent",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR,
     .fallback = 20,
     .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    static const char *const variants[] = {"reciprocal", "microfacet", "paper"};
    static const char *const samplings[] = {"mixture", "cosine", "phong"};
    enum imp_status st = IMP_OK;
    struct m2 *m = self;
    int v, s;
    IMP_TRY(imp_build_choice(build, "variant", variants, 3, RECIPROCAL, &v));
    IMP_TRY(imp_build_choice(build, "sampling", samplings, 3, MIXTURE, &s));
    IMP_TRY(imp__stam_absorb_read(build, &b->absorb));
    m->variant = (enum variant)v;
    m->sampling = (enum sampling)s;
    b->flags = IMP_BSDF_SMOOTH | IMP_BSDF_EMIT | IMP_BSDF_LINEAR;
    /* Only V = min(1, cos_i/cos_o) takes the lobe's weight to 0 at the horizon, behind
     * which its draws are lost; a cosine draw does not move. */
    if (m->variant != RECIPROCAL && m->sampling != COSINE) b->flags |= IMP_BSDF_JUMP;
out:
    return st;
}

/* Quantities shared by the formulas, for two directions on the front. */
struct half {
    imp_v3 m;
    double c_m, mo;
    double p; /* p_m/(4 mo): density of the lobe's own sampling */
    double V;
};

static double sin_m(const struct half *h) { return hypot(h->m[0], h->m[1]); }

static struct half half(const struct m2 *m2, double alpha, const struct imp_dirs *d)
{
    struct half h;
    h.m = imp__normalize(d->wo + d->wi);
    h.c_m = h.m[2];
    h.mo = imp__dot(h.m, d->wo);
    h.p = (alpha + 2) / IMP_2PI * pow(h.c_m, alpha + 1) / (4 * h.mo);
    h.V = m2->variant == RECIPROCAL ? imp_min(d->wi[2] / d->wo[2], 1.0)
          : m2->variant == PAPER    ? sin_m(&h)
                                    : 1;
    return h;
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = imp__spec(0);
    if (!imp__front(d)) return;
    const struct half h = half(b->self, in[EXPONENT][0], d);
    *f = in[DIFFUSE] * imp__lambert(d) + in[SPECULAR] * (h.p * h.V);
}

/* Chance of the cosine draw. */
static double cosine_share(const struct m2 *m2)
{
    return m2->sampling == MIXTURE ? 0.5 : m2->sampling == COSINE ? 1 : 0;
}

static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    const struct m2 *m2 = b->self;
    if (!imp__front(d)) return 0;
    const double q = cosine_share(m2);
    return q * imp__lambert(d) + (1 - q) * half(m2, in[EXPONENT][0], d).p;
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const struct m2 *m2 = b->self;
    if (!(d->wo[2] > 0)) return false;
    if (u[0] < cosine_share(m2)) {
        if (!imp__lambert_sample(&u[1], d)) return false;
    } else {
        const double c = pow(1 - u[1], 1 / (in[EXPONENT][0] + 2)), phi = IMP_2PI * u[2];
        const double r = sqrt(imp_max(1 - c * c, 0.0));
        const imp_v3 m = imp__v3(r * cos(phi), r * sin(phi), c);
        const double mo = imp__dot(m, d->wo);
        if (!(mo > 0)) return false;
        d->wi = m * (2 * mo) - d->wo;
        d->lobe = IMP_SMOOTH;
        if (!(d->wi[2] > 0)) return false;
    }
    return true;
}

/* d ln S/d alpha = 1/(alpha + 2) + ln c_m for all three variants. */
static double score(double alpha, const struct half *h)
{
    return 1 / (alpha + 2) + log(h->c_m);
}

static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    if (!imp__front(d)) return;
    const double alpha = in[EXPONENT][0];
    const struct half h = half(b->self, alpha, d);
    df[DIFFUSE] = imp__spec(imp__lambert(d));
    df[SPECULAR] = imp__spec(h.p * h.V);
    df[EXPONENT] = in[SPECULAR] * (h.p * h.V * score(alpha, &h));
}

/* The exponent moves what the lobe draws (docs/estimators.md 4): at fixed u
 *   d c_m = -c_m ln c_m/(alpha + 2),   d m = e_theta d theta_m,
 *   d wi = 2 ((dm.wo) m + mo dm)
 * and everything in f/p is carried along. The cosine draw does not move, its weight
 * does. */
static bool sample_d(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                     const struct imp_dirs *d, int j, imp_spec *dweight, imp_v3 *dwi)
{
    const struct m2 *m2 = b->self;
    if (j != EXPONENT || !imp__front(d)) return false;
    const double alpha = in[EXPONENT][0], q = cosine_share(m2);
    const struct half h = half(m2, alpha, d);
    const double sine = sin_m(&h);
    double dc = 0, dmo = 0;
    *dwi = imp__v3(0, 0, 0);
    if (!(u[0] < q)) {
        dc = -h.c_m * log(h.c_m) / (alpha + 2);
        if (sine > 0) {
            /* d theta = -dc/sin; e_theta = (cos phi c_m, sin phi c_m, -sin_m) */
            const double t = -dc / sine;
            const imp_v3 dm =
                imp__v3(h.m[0] / sine * h.c_m * t, h.m[1] / sine * h.c_m * t, dc);
            dmo = imp__dot(dm, d->wo);
            *dwi = (h.m * dmo + dm * h.mo) * 2.0;
        }
    }
    const double dci = (*dwi)[2];
    const double dlog_p = score(alpha, &h) + (alpha + 1) * dc / h.c_m - dmo / h.mo;
    double dV = 0;
    if (m2->variant == PAPER && sine > 0) dV = -h.c_m * dc / sine;
    if (m2->variant == RECIPROCAL && d->wi[2] < d->wo[2]) dV = dci / d->wo[2];

    const double p = q * imp__lambert(d) + (1 - q) * h.p;
    const double dp = q * dci * IMP_INV_PI + (1 - q) * h.p * dlog_p;
    const imp_spec f = in[DIFFUSE] * imp__lambert(d) + in[SPECULAR] * (h.p * h.V);
    const imp_spec df =
        in[DIFFUSE] * (dci * IMP_INV_PI) + in[SPECULAR] * (h.p * (dlog_p * h.V + dV));
    *dweight = (df - f * (dp / p)) / p;
    return p > 0;
}

const struct imp_bsdf_ops imp__stam_m2 = {.size = sizeof(struct imp_bsdf_ops),
                                          .name = "stam_m2",
                                          .object_size = sizeof(struct m2),
                                          .inputs = inputs,
                                          .build = build,
                                          .sample = sample,
                                          .eval = eval,
                                          .pdf = pdf,
                                          .eval_d = eval_d,
                                          .emit = imp__stam_emit,
                                          .emit_d = imp__stam_emit_d,
                                          .sample_d = sample_d};
