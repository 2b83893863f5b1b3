/* SPDX-License-Identifier: Apache-2.0
 *
 * Whether a walk goes on, and where: the draw of a direction, and roulette. */
#include "step.h"

/* beta *= f/p, where a lane's first factor that is zero but has a derivative is left out:
 * the walk goes on, because what arrives from beyond is that derivative. A second one
 * ends the lane (docs/estimators.md 9.2). False: all lanes have ended. */
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

/* Survival probability in v->d.survive; false: the walk ends. Zero factors that still
 * have a derivative are left out of beta, so roulette sees the walk as if they were not
 * there (docs/estimators.md 9.1, 9.2). */
static bool roulette(struct imp_step *s, struct imp_vertex *v)
{
    const struct imp_integrator *integrator = s->tracer->integrator;
    const bool guided = imp_unlikely(s->guided.reference > 0);
    if (integrator->kind == IMP_INTEGRATOR_STAM) { /* `absorb` has drawn already */
        v->d.survive = (imp_decided)(1 - v->bsdf->absorb);
        return true;
    }
    if (s->depth + 1 < integrator->rr_depth && !guided) return true;
    double q = fmin(imp__max3(s->beta) * s->eta * s->eta, 0.95);
    if (guided) q = imp__guided_survival(s, q);
    v->d.survive = (imp_decided)q;
    return imp__u01(s->walk->key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < v->d.survive;
}

bool imp__scatter(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *at,
                  const struct imp_frame *frame)
{
    const struct imp_key key = s->walk->key;
    const double u[3] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LOBE)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_V))};
    const struct imp_bsdf *b = v->bsdf;
    struct imp_dirs dirs = {.wo = imp__decided_v3(v->d.wo), .lobe = IMP_SMOOTH};

    /* The direction, its density and its value. */
    if (!imp__direction_draw(s, v, frame, u, &dirs)) return false;
    for (int k = 0; k < 3; k++) v->d.wi[k] = (imp_decided)dirs.wi[k];
    v->d.lobe = (int8_t)dirs.lobe;
    const imp_v3 w = imp__to_world(frame, dirs.wi);
    dirs = imp__vertex_dirs(v);
    const double kernel = b->ops->pdf(b, v->in, &dirs);
    if (!(kernel > 0)) return false; /* structurally zero */
    v->d.pdf = (imp_decided)imp__direction_pdf(s, b, kernel, w);
    if (!(v->d.pdf > 0)) return false;
    imp_spec f;
    b->ops->eval(b, v->in, &dirs, &f);

    /* Does the walk go on? */
    if (imp_unlikely(s->guided.guide != NULL)) s->guided.before = s->beta;
    if (!throughput_add(s, b, f * (1 / (double)v->d.pdf))) return false;
    if (b->ops->index_ratio) s->eta *= b->ops->index_ratio(b, v->in, &dirs);
    if (!roulette(s, v)) return false;
    s->beta *= imp__spec(1 / (double)v->d.survive);
    imp__step_weigh(v, f);

    /* The next ray. */
    imp__guided_leave(&s->guided);
    s->d = w;
    s->o = imp__offset(at->p, at->ng, s->d);
    s->from = at->p;
    s->t_min = 0;
    s->t_max = INFINITY;
    if (imp_unlikely(s->segment->leave != NULL)) s->segment->leave(s, v, at);
    /* Where no connection could have been made, MIS has nothing to weigh. */
    s->pdf = dirs.lobe == IMP_SMOOTH && s->segment->connects ? v->d.pdf : 0;
    return true;
}
