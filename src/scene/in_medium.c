/* SPDX-License-Identifier: Apache-2.0
 *
 * A collision in a medium as a BSDF without a cosine: phase function times albedo, and emission
 * (1 - albedo) times the emitted radiance; with and without an albedo. */
#include "in_medium.h"
#include "base/compiler.h"
#include "majorants.h"
#include "math/vec.h"

static const struct imp_medium *medium_of(const struct imp_bsdf *b) { return b->self; }

static const struct imp_input_desc *phase_input(const struct imp_phase *p, int j)
{
    for (int k = p->n_child - 1; k >= 0; k--)
        if (j >= p->child_in[k]) return phase_input(p->child[k], j - p->child_in[k]);
    return &p->ops->inputs[j];
}
const struct imp_input_desc *imp__in_medium_input(const struct imp_bsdf *b, int j)
{
    const struct imp_medium *m = medium_of(b);
    return j < m->n_own ? &m->ops->inputs[j] : phase_input(m->phase, j - m->n_own);
}

/* a/b, 0 where b is: nothing collides there. */
static imp_spec over(imp_spec a, imp_spec b)
{
    imp_spec q;
    for (int c = 0; c < 4; c++) q[c] = b[c] > 0 ? a[c] / b[c] : 0;
    return q;
}
static imp_spec albedo_of(const struct imp_coefficients *c)
{
    return over(c->scattering, c->extinction);
}
/* ... or what it would be if anything did, where that is one number: it is no factor of the
 * derivative with respect to an extinction of 0, but what is scattered there is. */
static imp_spec albedo_near(const struct imp_medium *m, const imp_spec *in,
                            const struct imp_coefficients *c)
{
    imp_spec albedo = albedo_of(c);
    struct imp_coefficients dc[IMP_INPUTS_MAX];
    bool all = true;
    for (int k = 0; m->majorants && k < m->majorants->channels; k++)
        all &= c->extinction[k] > 0;
    if (imp_likely(all)) return albedo;
    m->ops->eval_d(m, in, dc);
    for (int j = 0; j < m->n_own; j++)
        for (int k = 0; k < 4; k++)
            if (!(c->extinction[k] > 0) && dc[j].extinction[k] > 0)
                albedo[k] = dc[j].scattering[k] / dc[j].extinction[k];
    return albedo;
}
bool imp__in_medium_has_albedo(const struct imp_medium *m)
{
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c, dc[IMP_INPUTS_MAX];
    for (int j = 0; j < m->n_own; j++) in[j] = imp__spec(0.5 + 0.125 * j);
    m->ops->eval(m, in, &c);
    m->ops->eval_d(m, in, dc);
    for (int j = 0; j < m->n_own; j++) {
        if (dc[j].extinction[0] == 0) continue;
        const double apart =
            dc[j].scattering[0] * c.extinction[0] - dc[j].extinction[0] * c.scattering[0];
        if (fabs(apart) > 1e-9 * c.extinction[0] * fabs(dc[j].extinction[0]))
            return false;
    }
    return true;
}
/* albedo = scattering/extinction */
static imp_spec albedo_d(const struct imp_coefficients *c,
                         const struct imp_coefficients *dc)
{
    return over(dc->scattering - albedo_of(c) * dc->extinction, c->extinction);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const struct imp_medium *m = medium_of(b);
    d->lobe = IMP_SMOOTH;
    m->phase->ops->sample(m->phase, in + m->n_own, u, d);
    return true;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    const struct imp_medium *m = medium_of(b);
    return m->phase->ops->pdf(m->phase, in + m->n_own, d);
}

static void pure_eval(const struct imp_bsdf *b, const imp_spec *in,
                      const struct imp_dirs *d, imp_spec *f)
{
    const struct imp_medium *m = medium_of(b);
    m->phase->ops->eval(m->phase, in + m->n_own, d, f);
}
static void pure_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *df)
{
    const struct imp_medium *m = medium_of(b);
    for (int j = 0; j < m->n_own; j++) df[j] = (imp_spec){0};
    m->phase->ops->eval_d(m->phase, in + m->n_own, d, df + m->n_own);
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    const struct imp_medium *m = medium_of(b);
    struct imp_coefficients c;
    m->ops->eval(m, in, &c);
    pure_eval(b, in, d, f);
    *f *= albedo_near(m, in, &c);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    const struct imp_medium *m = medium_of(b);
    struct imp_coefficients c, dc[IMP_INPUTS_MAX];
    imp_spec p;
    m->ops->eval(m, in, &c);
    m->ops->eval_d(m, in, dc);
    pure_eval(b, in, d, &p);
    pure_eval_d(b, in, d, df);
    for (int j = 0; j < m->n_own; j++) df[j] = albedo_d(&c, &dc[j]) * p;
    const imp_spec albedo = albedo_near(m, in, &c);
    for (int j = m->n_own; j < m->n_in; j++) df[j] *= albedo;
}

/* A phase function p depends on the cosine c = -wo.wi alone: p' by differences of c, and
 * dp/dwo = -p' wi, dp/dwi = -p' wo. */
#define TURN 1e-6
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    const double c = imp_clamp(imp_phase_cos(d), TURN - 1, 1 - TURN);
    imp_spec f[2];
    for (int k = 0; k < 2; k++) {
        const double at = c + (k ? TURN : -TURN);
        const struct imp_dirs turned = {
            {0, 0, -1, 0}, {sqrt(imp_max(1 - at * at, 0.0)), 0, at, 0}, IMP_SMOOTH, 0};
        eval(b, in, &turned, &f[k]);
    }
    const imp_spec slope = (f[1] - f[0]) * (1 / (2 * TURN));
    for (int k = 0; k < 3; k++) {
        d_wo[k] = -slope * d->wi[k];
        d_wi[k] = -slope * d->wo[k];
    }
}

/* What is absorbed at a collision is emitted there (1 - albedo times the emission). */
static void emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e)
{
    const struct imp_medium *m = medium_of(b);
    struct imp_coefficients c;
    (void)wo;
    m->ops->eval(m, in, &c);
    *e = (1 - albedo_of(&c)) * c.emission;
}
static void emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de)
{
    const struct imp_medium *m = medium_of(b);
    struct imp_coefficients c, dc[IMP_INPUTS_MAX];
    (void)wo;
    m->ops->eval(m, in, &c);
    m->ops->eval_d(m, in, dc);
    for (int j = 0; j < m->n_in; j++) de[j] = (imp_spec){0};
    for (int j = 0; j < m->n_own; j++)
        de[j] = (1 - albedo_of(&c)) * dc[j].emission - albedo_d(&c, &dc[j]) * c.emission;
}

static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *a)
{
    const struct imp_medium *m = medium_of(b);
    struct imp_coefficients c;
    (void)wo;
    m->ops->eval(m, in, &c);
    *a = albedo_of(&c);
}
static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *H)
{
    albedo(b, in, wo, H);
    return true;
}

const struct imp_bsdf_ops imp__in_medium = {.size = sizeof(struct imp_bsdf_ops),
                                            .name = "medium",
                                            .sample = sample,
                                            .eval = eval,
                                            .pdf = pdf,
                                            .eval_d = eval_d,
                                            .emit = emit,
                                            .emit_d = emit_d,
                                            .albedo = albedo,
                                            .directional_albedo = directional_albedo,
                                            .eval_directions_d = eval_directions_d};
const struct imp_bsdf_ops imp__in_pure_medium = {.size = sizeof(struct imp_bsdf_ops),
                                                 .name = "medium of albedo 1",
                                                 .sample = sample,
                                                 .eval = pure_eval,
                                                 .pdf = pdf,
                                                 .eval_d = pure_eval_d};
