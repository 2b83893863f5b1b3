/* SPDX-License-Identifier: Apache-2.0
 *
 * Settings of integrators of walks, read from the scene and settled when all of it is
 * there. */
#include "walk_settings.h"
#include "kind/sensor/receiver.h"

enum imp_status imp__depth_read(const struct imp_build *build, int fallback,
                                struct imp_integrator *i, struct imp_walk_integrator *w)
{
    enum imp_status st = IMP_OK;
    int64_t depth;
    IMP_TRY(imp__props_bool(build->ctx, build->node, "hide_emitters", false,
                            &w->hide_emitters));
    IMP_TRY(imp__props_int(build->ctx, build->node, "max_depth", fallback, -1, INT32_MAX,
                           &depth));
    i->max_depth = w->max_depth = (int)depth;
out:
    return st;
}

enum light_choice { BY_COUNT, BY_WEIGHTS, BY_TREE };
#define LIGHTS_MANY 64 /* from so many on by the tree, if nobody says */

enum imp_status imp__light_choice_read(const struct imp_build *build,
                                       struct imp_walk_integrator *w)
{
    static const char *const words[] = {"automatic", "weights", "tree"};
    int choice;
    const enum imp_status st = imp__props_choice(build->ctx, build->node, "light_choice",
                                                 words, 3, BY_COUNT, &choice);
    w->light_choice = choice;
    return st;
}

void imp__light_choice_ready(struct imp_scene *scene, struct imp_walk_integrator *w)
{
    w->light_tree = /* bidirectional walks are weighed by the lights' weights */
        w->lights && !w->both &&
        (w->light_choice == BY_TREE ||
         (w->light_choice == BY_COUNT && scene->n_emitters >= LIGHTS_MANY));
    scene->lights_in_tree |= w->light_tree;
    scene->grids_by_tree |= w->lights && !w->both && w->light_choice == BY_COUNT;
    if (w->other_end) w->other_end->light_tree = w->light_tree;
}

const struct imp_walk_integrator *imp__walks_read(const struct imp_scene *scene,
                                                  const struct imp_sensor *sensor,
                                                  const struct imp_walk_integrator *of,
                                                  struct imp_walk_integrator *own)
{
    if (!of || of->light_tree || of->light_choice != BY_COUNT || !of->lights ||
        of->from_lights || of->both || !scene->light_tree || sensor->gain ||
        !imp__has_grid(sensor))
        return of;
    *own = *of;
    own->light_tree = true;
    return own;
}

#define SPLIT_MAX 6
enum imp_status imp__mixture_read(const struct imp_build *build,
                                  struct imp_walk_integrator *w)
{
    enum imp_status st = IMP_OK;
    int64_t split;
    IMP_TRY(imp__mixing_read(build, &w->mixing));
    IMP_TRY(imp__props_int(build->ctx, build->node, "split", 0, 0, SPLIT_MAX, &split));
    w->split = (int)split;
out:
    return st;
}

enum imp_status imp__mixture_settle(struct imp_scene *scene,
                                    const struct imp_integrator *i,
                                    struct imp_walk_integrator *w)
{
    if (!w->mixing) {
        w->mixing = imp__arena_array(&scene->arena, 1, sizeof *w->mixing);
        if (!w->mixing)
            return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
        double *weight = w->mixing->weight;
        bool varied = false;
        for (int k = 0; k < scene->n_environments; k++)
            varied |= !(scene->emitters[scene->environments[k]]->ops->flags &
                        IMP_EMITTER_UNIFORM);
        weight[IMP_DENSITY_KERNEL] = 1;
        weight[IMP_DENSITY_GUIDE] = -1;
        weight[IMP_DENSITY_PROXIES] = imp__mixing_possible(scene, IMP_DENSITY_PROXIES);
        if (w->ends_by == IMP_ENDS_BY_ALBEDO) { /* no connection helps them */
            weight[IMP_DENSITY_EMITTERS] =
                imp__mixing_possible(scene, IMP_DENSITY_EMITTERS);
            weight[IMP_DENSITY_ENVIRONMENT] = varied;
        }
    }
    imp__light_choice_ready(scene, w);
    const enum imp_status st = imp__mixing_settle(scene, w->mixing);
    const bool mixes = scene->materials_mix || imp__mixing_mixes(w->mixing);
    w->mixes = mixes ? w->mixing : NULL;
    if (st == IMP_OK && w->split > 0 &&
        (scene->n_bodies > 0 || (w->media && (scene->n_media > 0 || scene->priorities))))
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "integrator %s: walks through media do not split; set 'split' "
                          "to 0",
                          i->ops->name);
    return st;
}

enum imp_status imp__other_end_make(const struct imp_build *build,
                                    struct imp_walk_integrator *w)
{
    struct imp_walk_integrator *other = imp__arena_array(build->arena, 1, sizeof *other);
    if (!other)
        return imp__error(build->ctx, IMP_E_NOMEM, "no memory for the integrator");
    *other = *w;
    other->from_lights = !w->from_lights;
    if (other->from_lights && w->media) other->media = IMP_CROSSES_WHAT_IS_THERE;
    other->guided = false;
    other->mixing = NULL;
    other->split = 0;
    w->other_end = other;
    return IMP_OK;
}
