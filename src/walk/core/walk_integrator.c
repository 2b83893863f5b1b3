/* SPDX-License-Identifier: Apache-2.0
 *
 * The integrator whose walks a scene is rendered with, its hash, and the end that walks begin
 * at. */
#include "walk_integrator.h"
#include "math/hash.h"

const struct imp_walk_integrator *imp__walk_integrator(const struct imp_scene *scene)
{
    const struct imp_integrator *top = scene->integrator;
    const struct imp_walk_integrator *walk = imp__walk_integrator_of(top);
    for (int k = 0; !walk && top && k < top->n_inner; k++)
        walk = imp__walk_integrator_of(&top->inner[k]);
    return walk;
}

uint64_t imp__walk_integrator_hash(const struct imp_walk_integrator *i)
{
    if (!i) return 0;
    const bool photons = i->ends_by == IMP_ENDS_BY_ALBEDO;
    const bool absorbs = i->ends_by == IMP_ENDS_BY_ABSORPTION;
    const int number[] = {i->max_depth,
                          i->rr_depth,
                          i->hide_emitters,
                          i->lights,
                          i->directions,
                          i->guided,
                          absorbs,
                          i->first_hit,
                          (int)i->alpha_gradient,
                          i->media != IMP_CROSSES_NOTHING};
    uint64_t h = imp__hash(0, number, sizeof number);
    if (i->light_tree) h = imp__hash(h, &i->light_tree, sizeof i->light_tree);
    if (i->transmittance) h = imp__hash(h, &i->transmittance, sizeof i->transmittance);
    if (i->from_lights) h = imp__hash(h, &i->rr_depth, sizeof i->rr_depth);
    if (i->both) h = imp__hash(h, &i->both, sizeof i->both);
    if (!i->mixes && !photons) return h;
    const double other[] = {photons ? i->h : 0, i->split};
    h = imp__hash(h, other, sizeof other);
    return imp__hash(h, i->mixing->weight, sizeof i->mixing->weight);
}

const struct imp_walk_integrator *imp__walks_from(const struct imp_walk_integrator *of,
                                                  enum imp_from from)
{
    if (of && of->both && from != IMP_FROM_SCENE) of = of->other_end; /* from one */
    if (from == IMP_FROM_SCENE || !of || (from == IMP_FROM_LIGHTS) == of->from_lights)
        return of;
    return of->other_end;
}
