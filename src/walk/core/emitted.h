/* SPDX-License-Identifier: Apache-2.0
 *
 * What an emitter sends at the scene's present parameters. */
#ifndef IMP_WALK_EMITTED_H
#define IMP_WALK_EMITTED_H

#include "decision.h"
#include "math/course.h"
#include "scene/scene.h"
#include "shaped.h"

/* The weight of light from an emitter that varies in time: a decision, since no parameter
 * moves its course. */
static inline double imp__emitter_timed(const struct imp_emitter *e, double time,
                                        double weight)
{
    if (imp_likely(e->course == NULL)) return weight;
    const imp_decided timed = (imp_decided)(weight * imp__course_at(e->course, time));
    return timed;
}

/* Where the emitter's inputs are looked up. */
static inline void imp__emitter_place(const struct imp_emitter *e,
                                      const struct imp_emission *x,
                                      struct imp_texcoord *at)
{
    if (imp_unlikely(e->ops->place != NULL)) e->ops->place(e, x, at->uv);
}
/* Is its radiance a constant, the same in all directions of its front or from all around? */
static inline bool imp__emitter_even(const struct imp_emitter *e,
                                     const struct imp_carried *carried)
{
    return (e->ops->flags & IMP_EMITTER_UNIFORM) && e->input[0]->plain && !carried;
}
/* ... of such a one. */
static inline imp_spec imp__even_radiance(const struct imp_emitter *e, double cos_light)
{
    return cos_light > 0 ? e->input[0]->value : imp__spec(0);
}
/* Radiance of an emitter at x, point p of it, at the scene's present parameters. */
static inline imp_spec imp__emitter_radiance(const struct imp_scene *scene, int emitter,
                                             const struct imp_emission *x, imp_v3 p,
                                             const struct imp_carried *carried)
{
    const struct imp_emitter *e = scene->emitters[emitter];
    if (imp_likely(imp__emitter_even(e, carried)))
        return imp__even_radiance(e, x->cos_light);
    struct imp_texcoord at = {
        .uv = {x->uv[0], x->uv[1]}, .p = p, .carried = carried, .shape = e->shape};
    imp_spec in[IMP_INPUTS_MAX], le;
    imp__emitter_place(e, x, &at);
    imp__inputs_eval(e->input, e->n_in, &at, in);
    imp__light_eval(e, carried, in, x, &le);
    return le;
}

#endif
