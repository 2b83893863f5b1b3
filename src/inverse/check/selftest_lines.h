/* SPDX-License-Identifier: Apache-2.0
 *
 * Lines that meet one shape by its own functions: whatever else the scene holds, and whatever box
 * the scene looks for it in.
 *
 * Lines are drawn through a box around the shape's own, which is larger so that what lies outside
 * of that is met, too: a direction w uniformly, and a place uniformly in the shadow of the box
 * along w, whose area is a(w). The expected number of crossings of a piece of surface dA is then
 *
 *     E[a(w) N] = Int dw/(4 pi) |cos(w, n)| dA = dA/2
 *
 * so that 2 a(w) N estimates its area (Crofton's formula). */
#ifndef IMP_INVERSE_SELFTEST_LINES_H
#define IMP_INVERSE_SELFTEST_LINES_H

#include "math/rng.h"
#include "scene/scene.h"

struct imp__probe {
    const struct imp_scene *scene;
    const struct imp_shape *s;
    bool stands; /* rays of the scene meet it: in no group, and no grid of a meter */
    imp_v3 centre, half; /* of the larger box */
    double reach;        /* its half diagonal */
    double scale;        /* of coordinates, whose rounding is relative to it */
};

struct imp__chord {
    imp_v3 o, d;
    double shadow; /* a(w) */
    double length; /* behind it there is nothing of the shape */
};

#define IMP_CROSSINGS_MAX 64

/* False: its box is empty or not finite, or it cannot be looked at alone (curves of a group, which
 * are met by the scene's tree only). */
bool imp__probe_set(struct imp__probe *p, const struct imp_scene *scene,
                    const struct imp_shape *s, bool stands);
struct imp__chord imp__probe_line(const struct imp__probe *p, struct imp_key key);
/* All hits with 0 < t < length, by t, at most IMP_CROSSINGS_MAX; curves are met from outside
 * alone. */
int imp__probe_crossings(const struct imp__probe *p, const struct imp__chord *line,
                         struct imp_hit *hit);
/* The crossing nearest to t, within `slack` of it. False: there is none. *rank: how many are
 * before it. */
bool imp__probe_hit(const struct imp__probe *p, const struct imp__chord *line, double t,
                    double slack, struct imp_hit *hit, int *rank);
/* The surface there. */
static inline void imp__probe_surface(const struct imp__probe *p,
                                      const struct imp_hit *hit,
                                      const struct imp__chord *line,
                                      struct imp_surface *out)
{
    *out = (struct imp_surface){.located = {.prim = -1}};
    p->s->ops->surface(p->s, hit, &line->o, &line->d, out);
}
/* How many lines cost as much as a self-test may. */
double imp__probe_most(const struct imp__probe *p);

#endif
