/* SPDX-License-Identifier: Apache-2.0
 *
 * Guides: approximate knowledge of the light in a scene (from src/elements) for sampling:
 * probabilities of lights at a point, densities of indirect light, expected radiance. Only
 * sampling uses them, and densities are constants to derivatives (detached), so a bad
 * guide costs variance, never bias. */
#ifndef IMP_SCENE_GUIDE_H
#define IMP_SCENE_GUIDE_H

#include "scene.h"

struct imp_guide_place { /* a point that the guide knows */
    const struct imp_frame *frame;
    const void *cell;
    double share; /* fraction of continuations that the guide draws, < 1; 0: none */
};

struct imp_guide {
    imp_context *ctx;
    /* Look up the surface point at a hit of a ray along d; false: unknown to the guide. */
    bool (*find)(const struct imp_guide *g, const struct imp_hit *hit,
                 const struct imp_surface *at, imp_v3 d, struct imp_guide_place *place);
    /* Choose a light by u in [0, 1); its probability, > 0 for all that scene->light_cdf
     * may choose. */
    int (*light)(const struct imp_guide *g, const struct imp_guide_place *p, double u);
    double (*light_pmf)(const struct imp_guide *g, const struct imp_guide_place *p,
                        int light);
    /* A direction towards indirect light, world; its density per steradian, also of
     * directions that it did not draw. */
    imp_v3 (*draw)(const struct imp_guide *g, const struct imp_guide_place *p,
                   const double u[2]);
    double (*pdf)(const struct imp_guide *g, const struct imp_guide_place *p, imp_v3 w);
    /* Reflected radiance that is expected to leave towards w, as one number, and in
     * *beyond the part of it that a continuation brings: light that has been reflected
     * before. NULL: roulette goes by throughput. */
    double (*expected)(const struct imp_guide *g, const struct imp_guide_place *p,
                       imp_v3 w, double *beyond);
    double roulette; /* survival = this * expected rest of the walk / expected walk */
    void (*destroy)(struct imp_guide *g);
};

#endif
