/* SPDX-License-Identifier: Apache-2.0
 *
 * What walks are made with, and which walks of a pixel belong to one set. */
#ifndef IMP_TRACER_H
#define IMP_TRACER_H

#include "scene/guide.h"
#include "walk_integrator.h"
#include "walk_parts.h"

struct imp_store;

/* Where walks come from that are not traced: the first member of struct imp_store. */
struct imp_walk_source {
    /* As imp__walk_trace. */
    void (*walk)(const struct imp_tracer *tracer, struct imp_arena *arena, int x, int y,
                 int64_t sample, struct imp_walk *walk);
    int set; /* walks of a pixel that depend on each other; 0: as those of a picture */
};

/* What walks are made with; read-only, shared by all workers. */
struct imp_tracer {
    const struct imp_scene *scene;
    const struct imp_walk_integrator *integrator;
    const struct imp_sensor *sensor;
    /* NULL: value only. Else walks go on through factors that are zero but have a
     * derivative (docs/estimators.md 9.2). */
    const struct imp_active *active;
    uint64_t seed;
    const struct imp_guide *guide; /* imp__guide_of; NULL: none */
    bool value_only;               /* a walk's L is wanted, and no record of it */
    bool swept_only; /* ... or what a sweep takes of the record (bundle/swept.h) */
    /* How walks draw the wavelengths they carry; NULL: they carry the scene's colours. */
    const struct imp_wavelengths *wavelengths;
    /* The walks of a pixel: each whole `period` is cut into sets of about `set`
     * (imp__set_at), among which wavelengths are stratified; set 0 or 1: each walk is drawn
     * on its own. Sets are independent of each other, walks of a set are not. */
    int set;
    bool stratified; /* walks of a set of points have stratified wavelengths */
    int64_t period;  /* 0: endless */
    /* NULL: a pixel's walks are independent. Else those with the numbers 64 s to 64 s + 63
     * are set s of points, of which any prefix may be used. */
    const struct imp_point_table *points;
    bool whole; /* as few such sets as hold a pixel's walks (IMP_POINTS_WHOLE) */
    const struct imp_mixing *mixing; /* densities in place of the integrator's and the
                                        materials'; NULL: those */
    bool collisions_fixed; /* the derivative of a frozen walk is wanted, whose collisions
                              stay where they are, also of extinctions: no probes */
    const struct imp_photograph *photograph; /* that is compared with; NULL: none */
    int together; /* points of a grid that share what their walks meet first, where these are
                     bundled (bundle/reuse.h); 0: none do */
    const uint8_t
        *more; /* [pixels] their walks beside the film's (bundle/near_walls.h) */
    int split; /* continuations of the first vertex, each with its share; 0: one. Scenes
                  with media have one */
    double
        survival; /* least probability with which roulette lets a walk go on; 0: none */
    double
        headroom; /* collisions are drawn under bounds so much higher (flight.h); 0 or 1:
                        as they are */
    imp_spec baseline;            /* by lanes: subtracted from the light that arrives, in
                          derivatives of flights (baseline.h) */
    const struct imp_store *kept; /* walks that are evaluated in place of tracing
                                    (store.h); NULL: they are traced */
    bool elsewhere;               /* walks are evaluated at other parameter values, too
                       (imp__walk_elsewhere): factors that are zero, but have a
                       derivative, end no walk, however many there are */
};

static inline const struct imp_walk_source *imp__walk_source(const struct imp_tracer *t)
{
    return (const struct imp_walk_source *)t->kept;
}

/* The guide that walks of this integrator follow: its densities are made for paths and for
 * light walks, in scenes that finite elements know. */
static inline const struct imp_guide *imp__guide_of(const struct imp_scene *scene,
                                                    const struct imp_walk_integrator *i,
                                                    const struct imp_guide *guide)
{
    return (i->guided || (i->from_lights && !i->both)) && scene->n_bodies == 0 &&
                   scene->n_media == 0 && !scene->priorities
               ? guide
               : NULL;
}
/* The points of a run through a sensor: independent, or Sobol's, which have the smaller errors
 * where neither the run nor the sampler names a kind (docs/decisions.md). */
static inline enum imp_points imp__points_of(const struct imp_sensor *sensor,
                                             const struct imp_run *run)
{
    const enum imp_points asked =
        run->points != IMP_POINTS_SCENE ? run->points : sensor->points;
    return asked == IMP_POINTS_INDEPENDENT ? asked : IMP_POINTS_SOBOL;
}

/* ---- Sets of walks ---------------------------------------------------------------- */

/* Random numbers and wavelengths as a run wants them, n walks of a pixel being one
 * whole. */
void imp__tracer_numbers(struct imp_tracer *tracer, const struct imp_run *run, int64_t n);

/* Walks of a pixel that a picture's errors take together, since they depend on each other,
 * about; n in all, 0: not known. Sets are independent of each other: their spread is the
 * error. Those of points are four, at least: more would be smaller, and gain less. */
int imp__tracer_set(const struct imp_tracer *tracer, int64_t n);

/* The set that a walk belongs to: its first walk, and how many it has. A whole is cut into
 * period/set sets, whose sizes differ by one at most; without end, all have `set`. */
static inline void imp__set_at(int set, int64_t period, int64_t sample, int64_t *first,
                               int64_t *n)
{
    if (period <= 0) {
        *first = sample - sample % set;
        *n = set;
        return;
    }
    const int64_t at = sample % period, sets = imp_max(period / set, (int64_t)1);
    const int64_t k = ((at + 1) * sets - 1) / period;
    *first = sample - at + k * period / sets;
    *n = (k + 1) * period / sets - k * period / sets;
}

/* Are the walks of a picture traced in sets of points? Then they have the numbers of
 * imp__set_number. Recorded ones are asked for in the order in which they were traced. */
static inline bool imp__tracer_sets(const struct imp_tracer *tracer)
{
    return tracer->points && !tracer->kept;
}
/* Number of walk k of a pixel, whose sets are sets of points. */
static inline int64_t imp__set_number(int set, int64_t period, int64_t k)
{
    if (period <= 0) return k / set * IMP_SET_POINTS + k % set;
    const int64_t sets = imp_max(period / set, (int64_t)1), at = k % period;
    const int64_t s = ((at + 1) * sets - 1) / period;
    return (k / period * sets + s) * IMP_SET_POINTS + at - s * period / sets;
}

#endif
