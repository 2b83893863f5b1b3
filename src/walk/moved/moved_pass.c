/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a walk that do not scatter (moved_sweep.h): masks, panes and mirrors. */
#include "moved_mirror.h"
#include "moved_sky.h"
#include "moved_sweep.h"

/* What skies beyond vertex k change by with their suns: none that is glued to one is seen so. */
static void skies_sent_bar(struct imp__sweep *s, int k, const struct imp_vertex *v,
                           imp_v3 w)
{
    for (const struct imp_vertex *y = v->next; y; y = y->next)
        if (!imp__is_zero(y->e))
            imp__sky_sent_bar(s->moves, y->d.met.emitter, w, s->piece[k].on * y->e,
                              v->carried, s->theta_bar);
}

/* What lies beyond vertex k, which does not scatter: what it is to a shift of the ray, which is added to
 * vertex k, and, returned, to its direction. */
static imp_v3 beyond_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    const struct imp_scene *scene = s->tracer->scene;
    struct imp__link_point *x = &s->at[k], *next = x + 1;
    const imp_v3 w = imp__link_direction(x, next);
    if (next->sky) { /* the recorded direction is rounded */
        const imp_v3 in = imp__normalize(x->x.p - imp__sweep_from(s, k));
        imp_v3 out = in;
        if (imp__is_mirrored(v)) imp__bend(x->x.n, in, imp__vertex_ratio(v), &out);
        if (imp_unlikely(s->moves->skies)) skies_sent_bar(s, k, v, out);
        return imp__skies_slope(scene, out, s->piece[k].on, v->carried);
    }
    next->along += imp__sweep_reach_bar(s, k + 1, s->piece[k].step);
    const bool glued = s->through && !x->turns && !imp__is_mirrored(v);
    if (imp_unlikely(!glued && imp__sweep_emitted(v->next)))
        next->wo_bar += imp__sweep_table_bar(
            s, scene->emitters[v->next->d.met.emitter], &next->x, -w,
            imp__sum_used(s->piece[k].on * v->next->e, scene->lanes), v->next->carried);
    const imp_v3 shift = imp__slide_bar(next, w, NULL);
    x->moved_bar += shift;
    imp__link_velocity_bar(s->moves, next, s->theta_bar);
    return shift * imp__length(next->x.p - x->x.p) - next->wo_bar;
}

void imp__pass_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    struct imp__link_point *x = &s->at[k];
    const struct imp__pieces *piece = &s->piece[k];
    if (imp__passes_by_angle(v->bsdf) || imp__is_textured(v->bsdf))
        imp__lobe_bar(s->tracer->scene, v, s->walk->time, imp__sweep_from(s, k),
                      piece->step + piece->met, x);
    if (k < s->front) return; /* the camera's ray leads there */
    if (x->turns) x->wo_bar -= beyond_bar(s, k, v);
    else if (!x[1].sky || s->moves->skies) beyond_bar(s, k, v);
}

void imp__mirror_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    imp__lobe_bar(s->tracer->scene, v, s->walk->time, imp__sweep_from(s, k),
                  s->piece[k].step, &s->at[k]);
    imp__bend_turn_bar(imp__sweep_from(s, k), beyond_bar(s, k, v), imp__vertex_ratio(v),
                       &s->at[k]);
}
