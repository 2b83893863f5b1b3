/* SPDX-License-Identifier: Apache-2.0
 *
 * Whether a walk goes on along a direction that was drawn: its density and value, roulette,
 * and the next ray. One text for kernels and transposed kernels (ends.h). */
#ifndef IMP_WALK_SCATTER_WITH_H
#define IMP_WALK_SCATTER_WITH_H

#include "ends.h"

static inline __attribute__((always_inline)) bool
imp__scatter_with(const struct imp_scatter_ops *ops, struct imp_step *s,
                  struct imp_vertex *v, const struct imp_surface *at,
                  const struct imp_frame *frame, struct imp_direction *direction)
{
    const struct imp_bsdf *b = v->bsdf;
    struct imp_dirs *dirs = &direction->dirs;
    imp_v3 *drawn = ops->transposed ? &dirs->wo : &dirs->wi;
    imp_v3 *known = ops->transposed ? &dirs->wi : &dirs->wo;

    /* Its density and its value. */
    const imp_v3 w = imp__to_world(frame, *drawn);
    *known = s->wo;
    *drawn = imp__decide(*drawn);
    const bool straight = imp_unlikely(b->straight) && s->segment->through &&
                          dirs->lobe >= 0 && dirs->lobe < 64 &&
                          b->straight >> dirs->lobe & 1;
    if (imp_unlikely(!straight && b->straight) && !ops->bounces(s)) return false;
    imp_spec f;
    const struct imp_drawn p = ops->density(s, v, at, dirs, w, direction->by, &f);
    const double pdf = imp__decide1(p.pdf);
    if (!(pdf > 0)) return false; /* structurally zero */

    /* Does the walk go on? */
    double survive = 1;
    if (imp_unlikely(s->guided.guide != NULL)) s->guided.before = s->beta;
    const imp_spec factor = f * (1 / (imp_unlikely(p.unguided > 0) ? p.unguided : pdf));
    if (!imp__throughput_add(s, b, factor)) return false;
    if (!ops->survives(s, b, dirs, factor, &survive)) return false;
    s->beta *= imp__spec(1 / survive);
    imp__step_weigh(v, f, pdf, survive);
    if (s->recorded) {
        imp__store_v3(ops->transposed ? v->d.wo : v->d.wi, *drawn);
        v->d.lobe = (int8_t)dirs->lobe;
        v->d.drawn = (uint8_t)(direction->by & 7);
        v->d.alone = s->mixed.here && s->mixed.only >= 0;
        v->d.pdf = (imp_decided)pdf;
        v->d.share = (imp_decided)p.share;
        v->d.rest = (imp_decided)p.rest;
        v->d.survive = (imp_decided)survive;
        v->d.goes_on = true;
    }

    /* The next ray. */
    s->d = w;
    s->o = imp__offset(at->p, at->ng, s->d);
    s->t_min = 0;
    s->t_max = INFINITY;
    if (imp_unlikely(s->segment->leave != NULL)) s->segment->leave(s, v, at);
    /* Where no connection could have been made, MIS has nothing to weigh: one could have been
     * made where the walk comes from. */
    if (imp_unlikely(straight)) s->straight++;
    else s->from = at->p;
    ops->left(s, v, at, dirs, straight, &p, pdf);
    return true;
}

#endif
