/* SPDX-License-Identifier: Apache-2.0
 *
 * What a guide tells a walk on its way (scene/guide.h). */
#include "step.h"

void imp_guide_destroy(imp_guide *guide)
{
    if (guide) guide->destroy(guide);
}

void imp__guided_arrive(struct imp_step *s, const struct imp_hit *hit,
                        const struct imp_surface *at)
{
    struct imp_guided *g = &s->guided;
    g->here = g->guide->find(g->guide, hit, at, s->d, &g->at);
    if (g->here && g->guide->expected) {
        const double all = g->guide->expected(g->guide, &g->at, -s->d, &g->rest);
        if (s->depth == 0) g->reference = all;
    }
}

/* Adjoint-driven roulette (Vorba and Krivanek 2016): what the rest of this walk should
 * add, over the walk's own expected radiance. Direct light is no part of the rest, a
 * light sample has it already; so the first vertex may be the last, which is what saves
 * time where most light comes directly. */
double imp__guided_survival(const struct imp_step *s, double q)
{
    const struct imp_guided *g = &s->guided;
    if (!g->here) return s->depth + 1 < s->tracer->integrator->rr_depth ? 1 : q;
    const double rest = imp__max3(g->before) * g->rest;
    return imp_clamp(g->guide->roulette * rest / g->reference, 0.2, 1.0);
}
