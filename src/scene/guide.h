/* SPDX-License-Identifier: Apache-2.0
 *
 * Guides: approximate knowledge of light and importance in a scene (from src/elements)
 * for sampling. Walks from the sensor are guided by radiance: probabilities of lights at
 * a point, densities of indirect light, expected radiance. Light walks are guided by
 * importance: which light sends them, from where and in which direction, and how they go
 * on. Only sampling uses them, and densities are constants to derivatives (detached), so
 * a bad guide costs variance, never bias. */
#ifndef IMP_SCENE_GUIDE_H
#define IMP_SCENE_GUIDE_H

#include "scene.h"

/* What directions are drawn towards: indirect light, by walks from the sensor;
 * importance, by light walks that are connected to the sensor, and by those that have to
 * meet it. */
enum imp_guide_field {
    IMP_GUIDE_LIGHT,
    IMP_GUIDE_CONNECTED,
    IMP_GUIDE_MET,
    IMP_GUIDE_FIELDS
};

struct imp_guide_place { /* a point where the guide has a cell */
    const struct imp_frame *frame;
    const void *cell;
    enum imp_guide_field field;
    double share; /* fraction of continuations that the guide draws, < 1; 0: none */
};

struct imp_guide {
    imp_context *ctx;
    /* Look up the surface point at a hit of a ray along d; false: unknown to the guide. */
    bool (*find)(const struct imp_guide *g, enum imp_guide_field field,
                 const struct imp_hit *hit, const struct imp_surface *at, imp_v3 d,
                 struct imp_guide_place *place);
    /* Choose a light by u in [0, 1); its probability, > 0 for all that scene->light_cdf
     * may choose. */
    int (*light)(const struct imp_guide *g, const struct imp_guide_place *p, double u);
    double (*light_pmf)(const struct imp_guide *g, const struct imp_guide_place *p,
                        int light);
    /* A direction towards the place's field, world; its density per steradian, also of
     * directions that it did not draw. */
    imp_v3 (*draw)(const struct imp_guide *g, const struct imp_guide_place *p,
                   const double u[2]);
    double (*pdf)(const struct imp_guide *g, const struct imp_guide_place *p, imp_v3 w);
    /* Reflected radiance that is expected to leave towards w, as a scalar, and in *beyond
     * the part of it that a continuation brings: light that has been reflected before.
     * NULL: roulette goes by throughput. */
    double (*expected)(const struct imp_guide *g, const struct imp_guide_place *p,
                       imp_v3 w, double *beyond);
    double roulette; /* survival = this * expected rest of the walk / expected walk */

    bool importance; /* is available; all that follows is for light walks */
    /* Cumulative probabilities of the light that sends a walk [scene->n_emitters], each
     * > 0 where that of scene->light_cdf is; NULL: those, and no `emit`. */
    const double *send;
    /* Moves u [4], uniform numbers that imp_emitter_ops.sample_emission of `light` takes,
     * to where importance is. Returns the density of u[2] and u[3], which choose the
     * direction, given u[0] and u[1]; *point: the density of those. Both are > 0. */
    double (*emit)(const struct imp_guide *g, enum imp_guide_field field, int light,
                   double u[4], double *point);
    /* The same density of u[2] and u[3] where they were not drawn. */
    double (*emit_pdf)(const struct imp_guide *g, enum imp_guide_field field, int light,
                       const double u[4]);
    void (*destroy)(struct imp_guide *g);
};

#endif
