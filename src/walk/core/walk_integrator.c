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

#define HASH_VERSION 2 /* raised with what is hashed */

uint64_t imp__walk_integrator_hash(const struct imp_walk_integrator *i)
{
    static const struct imp_mixing none = {.weight = {0}};
    if (!i) return 0;
    const bool photons = i->ends_by == IMP_ENDS_BY_ALBEDO, draws = i->mixes || photons;
    const int number[] = {HASH_VERSION,
                          i->max_depth,
                          i->rr_depth,
                          i->hide_emitters,
                          i->lights,
                          i->directions,
                          i->guided,
                          (int)i->ends_by,
                          i->first_hit,
                          (int)i->alpha_gradient,
                          (int)i->media,
                          i->light_tree,
                          (int)i->transmittance,
                          i->from_lights,
                          i->both,
                          i->mixes != NULL,
                          draws ? i->split : 0};
    const double h = photons ? i->h : 0;
    const struct imp_mixing *mixing = draws && i->mixing ? i->mixing : &none;
    uint64_t hash = imp__hash(0, number, sizeof number);
    hash = imp__hash(hash, &h, sizeof h);
    return imp__hash(hash, mixing->weight, sizeof mixing->weight);
}

const struct imp_walk_integrator *imp__walks_from(const struct imp_walk_integrator *of,
                                                  enum imp_from from)
{
    if (of && of->both && from != IMP_FROM_SCENE) of = of->other_end; /* from one */
    if (from == IMP_FROM_SCENE || !of || (from == IMP_FROM_LIGHTS) == of->from_lights)
        return of;
    return of->other_end;
}
