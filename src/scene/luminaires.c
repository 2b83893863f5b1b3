/* SPDX-License-Identifier: Apache-2.0
 *
 * Luminaires of a scene: its emitters that have a photometric table. */
#include "luminaires.h"
#include "base/arguments.h"
#include "color/rgb.h"
#include "kind/emitter/ies.h"
#include <importon/rooms.h>

static bool is_luminaire(const struct imp_emitter *e)
{
    return e->ops == &imp__ies_light || e->ops == &imp__ies_area;
}

int imp_scene_n_luminaires(const imp_scene *scene)
{
    int n = 0;
    for (int i = 0; scene && i < scene->n_emitters; i++)
        n += is_luminaire(scene->emitters[i]);
    return n;
}

const struct imp_emitter *imp__luminaire_at(const struct imp_scene *scene, int luminaire)
{
    int left = luminaire;
    for (int i = 0; i < scene->n_emitters && luminaire >= 0; i++)
        if (is_luminaire(scene->emitters[i]) && left-- == 0) return scene->emitters[i];
    return NULL;
}

/* Luminance of the scale; of a texture, 1: its mean is not known here. */
static double scale_of(const struct imp_scene *scene, const struct imp_emitter *e)
{
    if (e->n_in == 0 || e->input[0]->texture) return 1;
    const imp_spec c = e->input[0]->value;
    return scene->channels == 1 ? c[0] : imp__luminance(c[0], c[1], c[2]);
}

enum imp_status imp_scene_get_luminaire(const imp_scene *scene, int luminaire,
                                        struct imp_luminaire_info *info)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, info, "info");
    IMP_CHECKED(imp__size_check(scene->ctx, __func__, "info", info->size, sizeof *info));
    const struct imp_emitter *e = imp__luminaire_at(scene, luminaire);
    if (!e)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no luminaire %d; the scene has %d", luminaire,
                          imp_scene_n_luminaires(scene));
    const struct imp__ies *x = e->self;
    const double rated = imp__ies_flux(x) * x->lumens, scale = scale_of(scene, e);
    const double reduced = x->dimming * x->maintenance * x->kept;
    struct imp_luminaire_info all = {.size = sizeof all,
                                     .name = e->name,
                                     .flux = rated * scale,
                                     .lamp_flux = x->data->lamp_flux,
                                     .watts = x->data->watts,
                                     .dimming = x->dimming,
                                     .maintenance = x->maintenance,
                                     .is_point = !e->shape,
                                     .level = x->dimming * scale,
                                     .file = x->file};
    /* A scale stands for a dimmer that is set later, so power follows it as it follows dimming;
     * age and dirt (maintenance) save nothing. */
    all.power = all.watts * all.level;
    if (all.watts > 0 && reduced > 0) all.efficacy = rated / reduced / all.watts;
    const imp_v3 p = e->shape ? (e->shape->lo + e->shape->hi) * 0.5 : x->position;
    for (int k = 0; k < 3; k++) {
        all.position[k] = p[k];
        all.opening[k] = x->data->size[k];
    }
    IMP_GIVE(scene->ctx, info, all, "info");
    return IMP_OK;
}
