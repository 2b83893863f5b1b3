/* SPDX-License-Identifier: Apache-2.0
 *
 * What a guide does for light walks (scene/guide.h): it takes part in the choice
 * of the light, of the point and direction that it sends, and of directions on the way, in
 * mixtures whose densities hold the unguided ones. For walks from the sensor see step.h. */
#ifndef IMP_WALK_GUIDED_H
#define IMP_WALK_GUIDED_H

#include "step.h"

/* Walks that are not connected have to meet the sensor. */
static inline enum imp_guide_field imp__guided_field(const struct imp_step *s)
{
    return s->tracer->integrator->lights ? IMP_GUIDE_CONNECTED : IMP_GUIDE_MET;
}

/* Numbers of a point and a direction of `light` (imp_guide.emit). */
double imp__guided_emit(const struct imp_step *s, int light, double u[4], double *point);
/* Density that they get for direction d, world, from the point with shading normal n that
 * `point` was made into, over the light's own. Of a light that is a surface. */
double imp__guided_emit_pdf(const struct imp_step *s, int light, const double point[2],
                            imp_v3 n, imp_v3 d);

/* Look up vertex v: sets s->guided.here if directions are drawn by the guide there. */
void imp__guided_light_arrive(struct imp_step *s, const struct imp_vertex *v,
                              const struct imp_hit *hit, const struct imp_surface *at);
/* Draws dirs->wo with the guide's share; false: the kernel draws it, from u as it is now. */
bool imp__guided_light_draw(const struct imp_step *s, const struct imp_frame *frame,
                            double u[3], struct imp_dirs *dirs);
/* Density of direction d, world, for which the kernel has `kernel`. */
double imp__guided_light_pdf(const struct imp_step *s, double kernel, imp_v3 d);

#endif
