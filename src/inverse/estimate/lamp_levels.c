/* SPDX-License-Identifier: Apache-2.0
 *
 * Lamps at levels, for a while. */
#include "lamp_levels.h"
#include "base/arguments.h"
#include "scene/light_weights.h"
#include <math.h>

enum imp_status imp__lamp_levels_begin(struct imp_scene *scene, const double *level,
                                       struct imp__lamp_levels *out)
{
    const size_t n = (size_t)scene->n_emitters;
    *out = (struct imp__lamp_levels){0};
    const struct imp_course **before = imp__alloc(scene->ctx, n + 1, sizeof *before);
    struct imp_course *now = imp__alloc(scene->ctx, n + 1, sizeof *now);
    double *numbers = imp__alloc(scene->ctx, 4 * n + 1, sizeof *numbers), sum = 0;
    if (!before || !now || !numbers) {
        imp__release(scene->ctx, before);
        imp__release(scene->ctx, now);
        imp__release(scene->ctx, numbers);
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the levels of lamps");
    }
    *out = (struct imp__lamp_levels){scene, before, now, numbers, scene->timed_lights};
    for (size_t k = 0; k < n; k++) {
        struct imp_emitter *e = scene->emitters[k];
        double *time = numbers + k, *value = numbers + n + k;
        before[k] = e->course;
        numbers[2 * n + k] = scene->light_cdf[k];
        numbers[3 * n + k] = e->weight;
        if (!isnan(level[k])) {
            *value = level[k];
            now[k] = (struct imp_course){1, time, value};
            e->course = &now[k];
            e->weight *= level[k];
            scene->timed_lights = true;
        }
        sum += e->weight;
        scene->light_cdf[k] = sum;
    }
    for (size_t k = 0; k < n; k++)
        scene->light_cdf[k] = sum > 0 ? scene->light_cdf[k] / sum : 0;
    imp__light_tree_weigh(scene);
    return IMP_OK;
}

void imp__lamp_levels_end(struct imp__lamp_levels *l)
{
    struct imp_scene *scene = l->scene;
    if (!scene) return;
    const size_t n = (size_t)scene->n_emitters;
    for (size_t k = 0; k < n; k++) {
        scene->emitters[k]->course = l->before[k];
        scene->light_cdf[k] = l->numbers[2 * n + k];
        scene->emitters[k]->weight = l->numbers[3 * n + k];
    }
    scene->timed_lights = l->timed;
    imp__light_tree_weigh(scene);
    imp__release(scene->ctx, l->before);
    imp__release(scene->ctx, l->now);
    imp__release(scene->ctx, l->numbers);
    *l = (struct imp__lamp_levels){0};
}
