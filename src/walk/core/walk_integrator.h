/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrators of radiance along walks: path, direct, stam and photons are settings of one
 * engine.
 * Another one is a table here and a line in film/film_integrator.c. */
#ifndef IMP_WALK_INTEGRATOR_H
#define IMP_WALK_INTEGRATOR_H

#include "scene/scene.h"

enum imp_stam_alpha { IMP_ALPHA_DETACHED, IMP_ALPHA_ATTACHED, IMP_ALPHA_PAPER };

enum imp_transmittance { IMP_RATIO_TRACKING, IMP_RESIDUAL_TRACKING, IMP_DELTA_TRACKING };

/* What ends a walk before max_depth. */
enum imp_ending {
    IMP_ENDS_BY_ROULETTE,   /* Russian roulette on the throughput, from rr_depth on */
    IMP_ENDS_BY_ABSORPTION, /* of the material (stam.c): emission counts there alone */
    IMP_ENDS_BY_ALBEDO /* survival min(1, H h) at every vertex, with H the directional
                               albedo or, of a kind that has none, the weight of the
                               direction drawn (photons) */
};

/* Do media scatter, so that surfaces of type null are no vertices? */
enum imp_crossing { IMP_CROSSES_NOTHING, IMP_CROSSES_WHAT_IS_THERE, IMP_CROSSES_MEDIA };

/* What walks are made by. */
struct imp_walk_integrator {
    int max_depth; /* segments; -1: unlimited */
    int rr_depth;  /* Russian roulette from this vertex on, the first is 1 */
    bool hide_emitters;
    bool lights;      /* vertices are connected to lights */
    int light_choice; /* as written */
    bool light_tree;  /* lights are chosen by the scene's tree, not by their weights */
    bool only_points; /* of lights, those that no direction meets: the others are met */
    bool directions;  /* walks go on behind the first vertex; false: lights alone */
    bool guided;      /* a guide's densities are made for these walks */
    enum imp_crossing media;
    enum imp_transmittance transmittance; /* on the way to light samples (tracking.h) */
    enum imp_ending ends_by;
    double h;       /* of IMP_ENDS_BY_ALBEDO */
    bool first_hit; /* alpha is 1 where the first ray meets a surface, and hide_emitters
                        hides lights from that ray alone (docs/scene-format.md 11) */
    enum imp_stam_alpha alpha_gradient;
    /* Densities of directions (direction.c). */
    struct imp_mixing *mixing; /* weights */
    const struct imp_mixing
        *mixes;       /* the same, where some vertex may draw from more than its
                                       kernel; else NULL */
    int split;        /* so many vertices of a walk draw from each density */
    bool from_lights; /* walks begin at the lights (light_walk.h) */
    bool both;        /* ... and as many at the sensor, joined with them (both.h) */
    struct imp_walk_integrator *other_end; /* the same numbers from the other end; NULL:
                                              there is none */
};

/* A kind: its table, and the settings of its name (walk_kinds.c). */
struct imp_walk_kind {
    struct imp_integrator_ops ops;    /* first */
    struct imp_walk_integrator start; /* before anything is read */
    const char *read_as; /* the kind whose picture it makes; NULL: it is none of Mitsuba's
                            other estimators */
    int depth;           /* default of max_depth */
    bool unconnected;    /* no vertex is connected to a light; walks from lights are */
    /* Properties without effect here. */
    bool reads_spectral_mis, reads_edges, reads_depths;
};
extern const struct imp_walk_kind imp__integrator_path, imp__integrator_direct,
    imp__integrator_stam, imp__integrator_photons, imp__integrator_volpath,
    imp__integrator_volpathmis, imp__integrator_prbvolpath, imp__integrator_prb,
    imp__integrator_prb_basic, imp__integrator_prb_projective,
    imp__integrator_direct_projective, imp__integrator_ptracer, imp__integrator_bdpt;

/* NULL: not one of walks. */
static inline const struct imp_walk_integrator *
imp__walk_integrator_of(const struct imp_integrator *i)
{
    return i && i->ops->flags & IMP_INTEGRATOR_WALKS ? i->self : NULL;
}
/* The radiance integrator of a scene: itself, or the first in moment or aov; NULL: none
 * (depth alone). */
const struct imp_walk_integrator *imp__walk_integrator(const struct imp_scene *scene);
/* The settings of walks from the end `from`: `of` for IMP_FROM_SCENE, NULL where `of`
 * has no such end. */
const struct imp_walk_integrator *imp__walks_from(const struct imp_walk_integrator *of,
                                                  enum imp_from from);
/* The settings of walks that read `sensor`: those of a grid of illuminances choose among several lights
 * by the tree, if nobody said how (docs/decisions.md, rooms). *own holds them where they are
 * not `of`. */
const struct imp_walk_integrator *imp__walks_read(const struct imp_scene *scene,
                                                  const struct imp_sensor *sensor,
                                                  const struct imp_walk_integrator *of,
                                                  struct imp_walk_integrator *own);
/* Hash of the settings, for files made with walks (scene/fingerprint.h); NULL has one. */
uint64_t imp__walk_integrator_hash(const struct imp_walk_integrator *integrator);

#endif
