/* SPDX-License-Identifier: Apache-2.0
 *
 * Whether a walk from the sensor goes on, and where: densities of directions by kernels and
 * mixtures, and roulette. */
#include "scatter_with.h"

bool imp__throughput_part(struct imp_step *s, const struct imp_bsdf *b, imp_spec factor)
{
    const bool four = s->at.carried != NULL;
    const bool differentiable = imp__wants_derivative(s, b);
    const double stand_in = imp_max(imp__max_used(factor, four), 0.5);
    for (int c = 0; c < 3 + four; c++) {
        if (factor[c] != 0) continue;
        if (differentiable && (s->zeros[c]++ == 0 || s->tracer->elsewhere))
            factor[c] = stand_in;
    }
    s->beta *= factor;
    return !imp__is_zero_used(s->beta, four);
}

/* Survival of adjoint photons: min(1, H h) in the brightest lane, H the directional albedo, or the
 * weight of the step where the kind does not know it (Morley et al. 2006, section 3). A lane
 * that is zero but has a derivative counts as one half. */
static double photon_survival(const struct imp_step *s, const struct imp_bsdf *b,
                              imp_spec factor)
{
    const struct imp_active *active = s->tracer->active;
    const bool four = s->at.carried != NULL;
    imp_spec H;
    if (!b->ops->directional_albedo || !b->ops->directional_albedo(b, s->in, &s->wo, &H))
        H = factor;
    double brightest = imp__max_used(H, four);
    if (active && b->index >= 0 && active->bsdf[b->index])
        for (int c = 0; c < 3 + four; c++)
            if (H[c] == 0) brightest = imp_max(brightest, 0.5);
    return imp_min(brightest * s->tracer->integrator->h, 1);
}

/* Survival probability, as decided; false: the walk ends. Zero factors that still
 * have a derivative are left out of beta, so roulette sees the walk as if they were not
 * there (docs/estimators.md 9.1, 9.2). factor: weight of the step, without survival. */
static inline bool roulette(struct imp_step *s, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs, imp_spec factor, double *survive)
{
    if (b->ops->index_ratio)
        s->eta *= imp_likely(!b->shaped)
                      ? b->ops->index_ratio(b, s->in, dirs)
                      : imp__shaped_index_ratio(b, s->at.carried, s->in, dirs);
    const struct imp_walk_integrator *integrator = s->tracer->integrator;
    const bool guided = imp_unlikely(s->guided.reference > 0);
    double q;
    switch (integrator->ends_by) {
    case IMP_ENDS_BY_ABSORPTION: /* `absorb` has drawn already */
        *survive = imp__decide1(1 - b->absorb);
        return true;
    case IMP_ENDS_BY_ALBEDO: q = photon_survival(s, b, factor); break;
    case IMP_ENDS_BY_ROULETTE:
    default:
        if (imp__bounces(s) + 1 < integrator->rr_depth && !guided) return true;
        q = imp_min(imp__max_used(s->beta, s->at.carried) * s->eta * s->eta, 0.95);
        if (guided) q = imp__guided_survival(s, q);
    }
    q = imp_max(q, s->tracer->survival);
    *survive = imp__decide1(q);
    return imp__step_number(s, IMP_DIM_SURVIVE) < *survive;
}

/* At a vertex with a mixture: what the densities other than the BSDF's have, `all` being
 * the whole and k the BSDF's. */
static void mixed_parts(const struct imp_step *s, double all, double k, int by, int lobe,
                        struct imp_drawn *p)
{
    const struct imp_mixed *m = &s->mixed;
    const bool alone = m->only >= 0;
    if (!alone || lobe != IMP_SMOOTH) p->share = alone ? 1 : m->share[IMP_DENSITY_KERNEL];
    else p->share = by == IMP_DENSITY_KERNEL ? all / k : 0;
    if (lobe == IMP_SMOOTH) p->rest = imp_max(all - p->share * k, 0.0);
}

/* f: the value. Where a vertex splits, the members' MIS weights are those of the lane that
 * drew, which add up to 1 for every lane. */
static inline struct imp_drawn density(struct imp_step *s, const struct imp_vertex *v,
                                       const struct imp_surface *at,
                                       const struct imp_dirs *dirs, imp_v3 w, int by,
                                       imp_spec *f)
{
    (void)at;
    const struct imp_bsdf *b = v->bsdf;
    struct imp_drawn d = {.share = 1};
    if (imp_likely(!b->shaped)) {
        const double k = imp__bsdf_pdf_eval(b, s->in, dirs, f);
        if (!(k > 0)) return d;
        d.pdf = imp__direction_pdf(s, k, w, by, dirs->lobe, &d.competing);
        if (imp_unlikely(s->mixed.here)) mixed_parts(s, d.pdf, k, by, dirs->lobe, &d);
        return d;
    }
    imp_spec p;
    imp__shaped_pdf(b, s->at.carried, s->in, dirs, &p);
    imp__shaped_eval(b, s->at.carried, s->in, dirs, f);
    if (!(imp__max_used(p, true) > 0)) return d;
    const int drew = imp__lane_mis_drew(s);
    const double k = p[drew];
    if (s->mixed.here && s->mixed.splits) {
        d.pdf = imp__direction_pdf(s, k, w, by, dirs->lobe, &d.competing);
        if (d.pdf > 0) mixed_parts(s, d.pdf, k, by, dirs->lobe, &d);
        return d;
    }
    for (int j = 0; j < s->at.carried->n; j++)
        p[j] = imp__direction_pdf(s, p[j], w, by, dirs->lobe, &d.competing);
    if (!(p[drew] > 0)) return d;
    if (s->mixed.here) mixed_parts(s, p[drew], k, by, dirs->lobe, &d);
    d.pdf = d.competing = 1 / imp__lane_mis_decide(s, p);
    return d;
}

static inline bool bounces(const struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    return max_depth < 0 || imp__bounces(s) + 1 < max_depth;
}

static inline void left(struct imp_step *s, const struct imp_vertex *v,
                        const struct imp_surface *at, const struct imp_dirs *dirs,
                        bool straight, const struct imp_drawn *p, double pdf)
{
    imp__guided_leave(&s->guided);
    if (imp_unlikely(straight)) return;
    if (imp_unlikely(s->light_tree != NULL)) s->left = imp__light_place(s, v->bsdf, at);
    const double competing = imp_likely(!s->mixed.splits) ? pdf : p->competing;
    s->pdf = dirs->lobe == IMP_SMOOTH && s->segment->connects ? competing : 0;
}

static const struct imp_scatter_ops kernel = {
    .bounces = bounces, .density = density, .survives = roulette, .left = left};

bool imp__scatter_along(struct imp_step *s, struct imp_vertex *v,
                        const struct imp_surface *at, const struct imp_frame *frame,
                        struct imp_direction *direction)
{
    return imp__scatter_with(&kernel, s, v, at, frame, direction);
}

bool imp__scatter(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *at,
                  const struct imp_frame *frame)
{
    struct imp_direction direction;
    return imp__direction_begin(s, v, frame, &direction) &&
           imp__scatter_along(s, v, at, frame, &direction);
}
