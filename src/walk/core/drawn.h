/* SPDX-License-Identifier: Apache-2.0
 *
 * What is drawn at a vertex before any of it is weighed: a point of a light, and a direction
 * in which the walk may go on. Both are chains of roots and quotients; drawn one behind the
 * other they are under way together. Inline, since little is done at each vertex besides. */
#ifndef IMP_WALK_DRAWN_H
#define IMP_WALK_DRAWN_H

#include "step.h"

struct imp_light_point {
    int light;
    double pmf; /* of the light, or of the triangle that there.pdf is that of */
    struct imp_light_sample there;
};
/* Where there are several lights, or a guide covers the place (light.c); u: what draws the
 * point. */
bool imp__light_point_of(const struct imp_step *s, const struct imp_bsdf *b,
                         const struct imp_surface *at, double u[2],
                         struct imp_light_point *out);
/* A light and a point of it, for a vertex of material b. False: none. */
static inline bool imp__light_point(const struct imp_step *s, const struct imp_bsdf *b,
                                    const struct imp_surface *at,
                                    struct imp_light_point *out)
{
    const struct imp_scene *scene = s->scene;
    if (scene->n_emitters == 0) return false;
    double u[2] = {imp__step_number(s, IMP_DIM_LIGHT_U),
                   imp__step_number(s, IMP_DIM_LIGHT_V)};
    if (scene->n_emitters > 1 || s->light_tree || s->guided.here)
        return imp__light_point_of(s, b, at, u, out);
    /* Nothing to choose. */
    const struct imp_emitter *e = scene->emitters[0];
    out->there.located.prim = -1;
    out->light = 0;
    out->pmf = scene->light_cdf[0];
    return out->pmf > 0 && e->ops->sample(e, &at->p, u, &out->there) &&
           out->there.pdf > 0;
}

struct imp_direction {
    int by; /* which member of the mixture drew it (enum imp_density) */
    struct imp_dirs dirs;
};
/* One in which the walk may go on from v. False: it ends. */
static inline bool imp__direction_begin(const struct imp_step *s,
                                        const struct imp_vertex *v,
                                        const struct imp_frame *frame,
                                        struct imp_direction *out)
{
    const double u[3] = {imp__step_number(s, IMP_DIM_LOBE),
                         imp__step_number(s, IMP_DIM_DIR_U),
                         imp__step_number(s, IMP_DIM_DIR_V)};
    out->dirs.wo = s->wo_drawn;
    out->dirs.lobe = IMP_SMOOTH;
    out->dirs.derivative = imp__derivative_wanted(s, v->bsdf);
    return imp__direction_draw(s, v->bsdf, frame, u, &out->dirs, &out->by);
}

#endif
