/* SPDX-License-Identifier: Apache-2.0
 *
 * Circles across which a sky jumps, over curved mirrors and through glass (boundary.h). A ray turns there by
 * where it meets them, so that it passes the circle when they move, or what it comes from does. To the camera
 * it is a root with that direction (boundary_bent.c); to what is lit so lines come in from directions of the
 * circle, of area dA across them,
 *
 *     dI = int dl dA f W(x) [L(-m) - L(+m)] m.(w' at a fixed direction from x),
 *
 * since area times solid angle stays along each line. */
#include "bent_chain.h"
#include "kind/cleared.h"
#include "walk/core/step.h"

void imp__draw_sky_bent(struct imp__edge_draw *d)
{
    const int max = d->b->tracer->integrator->max_depth;
    const imp_v3 w = imp__sky_circle_draw(d), m = imp__cross(d->along, w);
    struct imp__sight s;
    struct imp__bent_found found;
    struct imp__line line;
    if (!imp__bent_reach_far(d, w, &s, &found)) return;
    const struct imp_surface *at = &s.mirrors.first->at;
    const imp_v3 o = imp__offset(at->p, at->ng, w);
    if (!imp__edge_line(d, o, w, INFINITY, &line) ||
        (max >= 0 && s.bounces + line.bounces >= max))
        return;
    const imp_spec jump = s.T * line.T * imp__sky_jump(d, w, m);
    if (imp__is_zero_used(jump, d->waves)) return;
    s.chance /= imp__bent_draws(d, &found);
    struct imp__flux *f = imp__jump_add(
        d, &s.to, jump * (s.to.weight * d->inv_pdf / s.chance), 2 + s.mirrors.n);
    if (!f) return;
    const struct imp__seen seen =
        imp__mirrors_seen_far(&s.mirrors, s.to.p, -m, f->end, &f->n_ends);
    imp__seen_camera(d, &seen, f);
}

void imp__draw_sky_scatter(struct imp__edge_draw *d)
{
    const imp_v3 w = imp__sky_circle_draw(d), m = imp__cross(d->along, w);
    const double u[2] = {imp__u01(d->key, IMP_EDGE_DIR_U),
                         imp__u01(d->key, IMP_EDGE_DIR_V)};
    struct imp_hit hit;
    struct imp_surface at;
    struct imp__line line;
    double spread;
    const imp_v3 o = imp__bent_line(d, w, u, &spread);
    const imp_spec jump = imp__sky_jump(d, w, m);
    if (imp__is_zero_used(jump, d->waves) ||
        !imp__edge_follow(d, o, -w, 0, 0, &hit, &at, &line) || line.mirrors.n == 0)
        return;
    struct imp__edge_light light = {.w = line.w, .behind = 1 + line.bounces};
    light.light = line.T * jump * (line.times * d->inv_pdf * spread);
    struct imp__flux_end *end =
        imp__arena_take(d->arena, (size_t)line.mirrors.n, sizeof *end);
    if (!end) {
        d->no_memory = true;
        return;
    }
    light.mirror_end = end;
    light.slide =
        imp__mirrors_seen_far(&line.mirrors, at.p, -m, end, &light.n_mirror_ends).bar;
    imp__edge_reach(d, &hit, &at, &light);
}
