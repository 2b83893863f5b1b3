/* SPDX-License-Identifier: Apache-2.0
 *
 * What a guide tells a walk on its way (scene/guide.h). */
#include "guided.h"
#include "math/warp.h"

void imp_guide_destroy(imp_guide *guide)
{
    if (guide) guide->destroy(guide);
}

void imp__guided_arrive(struct imp_step *s, const struct imp_hit *hit,
                        const struct imp_surface *at)
{
    struct imp_guided *g = &s->guided;
    g->here = g->guide->find(g->guide, IMP_GUIDE_LIGHT, hit, at, s->d, &g->at);
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

/* ---- Light walks -------------------------------------------------------- */

double imp__guided_emit(const struct imp_step *s, int light, double u[4], double *point)
{
    const struct imp_guide *g = s->guided.guide;
    return g->emit(g, imp__guided_field(s), light, u, point);
}

double imp__guided_emit_pdf(const struct imp_step *s, int light, const double point[2],
                            imp_v3 n, imp_v3 d)
{
    const struct imp_guide *g = s->guided.guide;
    const struct imp_frame frame = imp__frame_from_normal(n);
    double u[4] = {point[0], point[1]};
    imp__cosine_hemisphere_inverse(imp__to_local(&frame, d), u + 2);
    return g->emit_pdf(g, imp__guided_field(s), light, u);
}

void imp__guided_light_arrive(struct imp_step *s, const struct imp_vertex *v,
                              const struct imp_hit *hit, const struct imp_surface *at)
{
    const unsigned lobes = v->bsdf->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA |
                                             IMP_BSDF_TRANSMIT | IMP_BSDF_NULL);
    struct imp_guided *g = &s->guided;
    g->here = v->shape && !v->bsdf->shaped && lobes == IMP_BSDF_SMOOTH &&
              g->guide->find(g->guide, imp__guided_field(s), hit, at, s->d, &g->at) &&
              g->at.share > 0;
}

bool imp__guided_light_draw(const struct imp_step *s, const struct imp_frame *frame,
                            double u[3], struct imp_dirs *dirs)
{
    const struct imp_guided *g = &s->guided;
    const double share = g->at.share;
    if (!(u[0] < share)) {
        u[0] = imp_min((u[0] - share) / (1 - share), 0x1.fffffffffffffp-1);
        return false;
    }
    dirs->wo = imp__to_local(frame, g->guide->draw(g->guide, &g->at, u + 1));
    dirs->lobe = IMP_SMOOTH;
    return true;
}

double imp__guided_light_pdf(const struct imp_step *s, double kernel, imp_v3 d)
{
    const struct imp_guided *g = &s->guided;
    return (1 - g->at.share) * kernel + g->at.share * g->guide->pdf(g->guide, &g->at, d);
}
