/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of lights for vertices in lanes. */
#ifndef IMP_WALK_BUNDLE_LANES_LIGHT_H
#define IMP_WALK_BUNDLE_LANES_LIGHT_H

#include "depth.h"
#include "kind/kind_lanes.h"

/* Points of lights, and what they send. */
struct imp_lanes_light {
    struct imp_wide_light at;
    imp_wide pmf;
    struct imp_wide_color radiance;
    imp_wide_truth far, delta; /* infinitely far; met by no direction */
    int32_t light[IMP_WIDE_LANES];
};

/* Weights of light samples: the power heuristic with exponent 2, over the density a. */
static inline imp_wide imp__wide_power_over(imp_wide a, imp_wide b)
{
    const imp_wide a2 = a * a, b2 = b * b;
    return imp__wide_choose(a2 > imp__wide(0), a / (a2 + b2), imp__wide(0));
}

struct imp_lanes_vertices;
/* What imp__light_point (core/drawn.h) draws for vertices with the numbers u; at.drawn: there is a
 * light, which shows its front; at.recorded is given. `which` chooses the light; where walks have
 * points it is u[0], of which the part that is left draws the point. */
void imp__lanes_light_draw(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                           const imp_wide u[2], imp_wide which,
                           struct imp_lanes_light *out);

/* The same where lights are chosen by the scene's tree: light comes from before n alone, or, with n
 * NULL, from everywhere. */
void imp__lanes_tree_draw(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                          const imp_wide3 *n, const imp_wide u[2], imp_wide which,
                          struct imp_lanes_light *out);

/* Can the sky be met in lanes? It is one emitter, with a form in lanes, chosen by its weight, and seen
 * by the camera. */
bool imp__lanes_sky_fits(const struct imp_tracer *tracer);
/* What the rays order[n] meet, which leave the scene: the values go to the vertices before. */
void imp__lanes_sky_meet(struct imp_depth *d, const int32_t *order, int n,
                         double *const beyond[4]);

#endif
