/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives with respect to extinction (docs/media.md 4). Along a segment of length D
 * from vertex k
 *
 *     dL_k = w int_0^D T(s) [d sigma_s(s) S(s) + d(sigma_a Le)(s) - d sigma(s) L(s)] ds
 *
 * with S the light that is scattered into the segment at s for a scattering coefficient
 * of 1, and L what arrives there from beyond. Differentiating the weights of collisions
 * instead divides by sigma: where it is 0 nothing collides and the gain is never seen.
 *
 * The walk's own flight is a probe: it passed s with probability T(s). With s uniform on
 * the length l that it flew in the medium, l times the bracket is an estimate, in which
 * what the walk itself brings from beyond is L and an extra walk from s gives S. One
 * stretch of a walk is chosen, by length times throughput, so that the cost is linear in
 * the walk's length. Deep stretches of uniform media have no probe (tracking.h).
 *
 * A stretch without an end, of a thin medium around the scene, has no uniform s. There s is
 * drawn with a density that falls as light does, from the scene's middle at distance s_0
 * along the ray,
 *
 *     p(s) ~ 1/(h^2 + (s - s_0)^2)        on [0, l], l = infinity where sigma = 0
 *
 * and 1/p takes the place of l (equi-angular, as Kulla and Fajardo 2012 aim at lights). */
#ifndef IMP_WALK_PROBE_H
#define IMP_WALK_PROBE_H

#include "tracking.h"

struct imp_probe {
    const struct imp_medium *medium;
    struct imp_texcoord at; /* the point */
    imp_spec reach;         /* weight of what leaves the point for vertex k */
    imp_spec scattered;     /* S */
    double length;          /* l or 1/p(s), over the probability of having been chosen */
    bool emits;             /* emission there counts */
};

/* The stretch that is chosen so far. */
struct imp_probing {
    double total;            /* weights of all stretches */
    struct imp_step *state;  /* of the walk at the point */
    struct imp_vertex *from; /* vertex k */
    struct imp_probe *probe; /* NULL: none yet */
    double weight;
    uint32_t n;    /* stretches */
    bool followed; /* else nothing of them is kept */
    /* What is scattered at a point of a medium: imp__walk_scattered. */
    imp_spec (*scattered)(struct imp_step *s, const struct imp_bsdf *scatterer, imp_v3 p);
};

/* `scattered` of *p is set by whoever traces the walk. */
void imp__probe_begin(const struct imp_walk *walk, struct imp_probing *p);

/* A value, and the density with which its flight was drawn: the same, unless there is headroom
 * (flight.h). */
struct imp_flown {
    imp_spec value, density;
};
/* The flight has gone from near to far in m, with events [first, track->n) of the track;
 * `before`: the segment's at `near`; open: only a collision could have ended it. */
void imp__probe_offer(struct imp_step *s, const struct imp_medium *m,
                      const struct imp_track *track, int first, struct imp_flown before,
                      double near, double far, bool open);
/* A flight passes an endless medium of extinction 0. Is the derivative infinite, since light
 * comes from infinity, or from all of the medium? */
bool imp__probe_diverges(const struct imp_step *s, const struct imp_medium *m);
/* The walk has ended: follow what was chosen. */
void imp__probe_follow(struct imp_step *s);

/* Derivative of what arrives at vertex v with respect to the inputs of the medium,
 * d [n_own], lane by lane; of inputs that the extinction does not depend on 0. */
void imp__probe_d(const struct imp_tracer *tracer, const struct imp_vertex *v,
                  imp_spec *d);

#endif
