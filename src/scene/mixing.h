/* SPDX-License-Identifier: Apache-2.0
 *
 * From which densities walks draw their directions, and with which weights
 * (walk/core/direction.c). Weights are written for the integrator and for single materials; what
 * directions are aimed at, lights and proxies, is in aimed_directions.h. */
#ifndef IMP_SCENE_MIXING_H
#define IMP_SCENE_MIXING_H

#include "kind/build.h"

enum imp_density {
    IMP_DENSITY_KERNEL,      /* the BSDF's own sampling */
    IMP_DENSITY_EMITTERS,    /* towards lights with a surface, or their proxies */
    IMP_DENSITY_ENVIRONMENT, /* the environment's own sampling */
    IMP_DENSITY_PROXIES,     /* towards proxies of no light */
    IMP_DENSITY_GUIDE,       /* the guide's, where it has a cell */
    IMP_DENSITY_UNIFORM,     /* the hemisphere, or the sphere of what transmits */
    IMP_DENSITIES
};
extern const char *const imp__density_name[IMP_DENSITIES];

/* Weights of a mixture. Those in use add up to 1; the guide's is set only where it
 * was written: else (-1) a guide takes the share that it judges right. */
struct imp_mixing {
    double weight[IMP_DENSITIES];
    const struct imp_node *node; /* where they were written */
};

/* The property `weights` of a node, "kernel=1, emitters=.5": not negative, not all 0, as
 * written. *out NULL: there is none. */
enum imp_status imp__mixing_read(const struct imp_build *build, struct imp_mixing **out);

struct imp_scene;
/* When all objects are there: densities that the scene does not have draw nothing, and the
 * rest adds up to 1. */
enum imp_status imp__mixing_settle(struct imp_scene *scene, struct imp_mixing *mixing);
/* Those of all materials. One without weights has those of what is nested in it. */
enum imp_status imp__mixing_materials(struct imp_scene *scene);
/* Does it draw from more than kernels, and from guides as these see fit? */
bool imp__mixing_mixes(const struct imp_mixing *mixing);
bool imp__mixing_possible(const struct imp_scene *scene, enum imp_density density);

#endif
