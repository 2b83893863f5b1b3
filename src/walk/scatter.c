/* SPDX-License-Identifier: Apache-2.0
 *
 * Whether a walk goes on, and where: absorption, the draw of the BSDF (mixed with the
 * guide's), roulette. */
#include "step.h"

bool imp__absorb(struct imp_step *s, struct imp_vertex *v)
{
    const double a = v->bsdf->absorb;
    if (!(a > 0)) return false;
    if (imp__u01(s->walk->key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < a) {
        s->walk->absorbed = true;
        v->e_weight = v->g_weight = 1 / a;
        return true;
    }
    v->e_weight = v->g_weight = 0;
    return false;
}

/* As ops->sample, with the density of the mixture. */
static bool mixture_sample(struct imp_step *s, struct imp_vertex *v,
                           const struct imp_frame *frame, const double u[3],
                           struct imp_bsdf_sample *out)
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_guide *g = s->tracer->guide;
    const double share = s->place.share;
    imp_v3 w;
    if (u[0] < share) {
        w = g->draw(g, &s->place, &u[1]);
        v->dirs.wi = imp__to_local(frame, w);
    } else {
        const double rest[3] = {fmin((u[0] - share) / (1 - share), 0x1.fffffffffffffp-1),
                                u[1], u[2]};
        if (!b->ops->sample(b, v->in, rest, &v->dirs, out)) return false;
        w = imp__to_world(frame, v->dirs.wi);
    }
    const double bsdf = b->ops->pdf(b, v->in, &v->dirs);
    if (!(bsdf > 0)) return false; /* structurally zero */
    b->ops->eval(b, v->in, &v->dirs, &out->f);
    out->pdf = imp__mixture_pdf(s, bsdf, w);
    out->eta = 1;
    return true;
}

/* beta *= f/p, where a lane's first factor that is zero but has a derivative is left out:
 * the walk goes on, because what arrives from beyond is that derivative. A second one
 * ends the lane (gradients.md 9.2). False: all lanes have ended. */
static bool throughput_add(struct imp_step *s, const struct imp_bsdf *b, imp_spec factor)
{
    const struct imp_active *active = s->tracer->active;
    if (imp_likely(factor[0] != 0 && factor[1] != 0 && factor[2] != 0)) {
        s->beta *= factor;
        return !imp__is_zero(s->beta);
    }
    const bool differentiable = active && b->index >= 0 && active->bsdf[b->index];
    const double stand_in = fmax(imp__max3(factor), 0.5);
    for (int c = 0; c < 3; c++) {
        if (factor[c] != 0) continue;
        if (differentiable && s->zeros[c]++ == 0) factor[c] = stand_in;
    }
    s->beta *= factor;
    return !imp__is_zero(s->beta);
}

/* By what is expected to come (adjoint-driven roulette, Vorba and Krivanek 2016): what
 * the rest of this walk should add, over the walk's own expected radiance. Direct light
 * is no part of the rest, a light sample has it already; so the first vertex may be the
 * last, which is what saves time where most light comes directly. */
static double guided_survival(const struct imp_step *s, double q)
{
    if (!s->known) return s->depth + 1 < s->tracer->integrator->rr_depth ? 1 : q;
    const double rest = imp__max3(s->before) * s->beyond;
    return imp_clamp(s->tracer->guide->roulette * rest / s->reference, 0.2, 1.0);
}

/* Survival probability. Zero factors that still have a derivative are left out of beta,
 * so roulette sees the walk as if they were not there (gradients.md 9.1, 9.2). */
static bool roulette(struct imp_step *s, struct imp_vertex *v)
{
    const struct imp_integrator *integrator = s->tracer->integrator;
    if (integrator->kind == IMP_INTEGRATOR_STAM) { /* `absorb` has drawn already */
        v->survive = 1 - v->bsdf->absorb;
        return true;
    }
    if (s->depth + 1 < integrator->rr_depth && !(s->reference > 0)) return true;
    double q = fmin(imp__max3(s->beta) * s->eta * s->eta, 0.95);
    if (imp_unlikely(s->reference > 0)) q = guided_survival(s, q);
    v->survive = q;
    return imp__u01(s->walk->key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < q;
}

bool imp__scatter(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *at,
                  const struct imp_frame *frame)
{
    const struct imp_key key = s->walk->key;
    const struct imp_bsdf *b = v->bsdf;
    const double u[3] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LOBE)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_V))};
    struct imp_bsdf_sample sample;
    v->dirs.lobe = IMP_SMOOTH;
    const bool drawn = imp_unlikely(s->known) && imp__mixes(s, b)
                           ? mixture_sample(s, v, frame, u, &sample)
                           : b->ops->sample(b, v->in, u, &v->dirs, &sample);
    if (!drawn || !(sample.pdf > 0)) return false;
    v->pdf = sample.pdf;

    s->before = s->beta;
    if (!throughput_add(s, b, sample.f * (1 / sample.pdf))) return false;
    s->eta *= sample.eta;
    if (!roulette(s, v)) return false;
    s->beta *= imp__spec(1 / v->survive);
    v->inv_ps = 1 / (sample.pdf * v->survive);
    v->w = sample.f * v->inv_ps;

    if (imp_unlikely(s->tracer->guide != NULL)) {
        s->left_known = s->known;
        s->left = s->place;
    }
    s->d = imp__to_world(frame, v->dirs.wi);
    s->o = imp__offset(at->p, at->ng, s->d);
    s->from = at->p;
    s->t_min = 0;
    s->t_max = INFINITY;
    s->pdf = v->dirs.lobe == IMP_SMOOTH ? sample.pdf : 0;
    if (imp_unlikely(s->bend != NULL)) {
        imp__bend_leave(s->tracer, s->bend, v, at, s->d);
        if (s->bend->medium) s->pdf = 0; /* no light sample could have been taken */
    }
    return true;
}
