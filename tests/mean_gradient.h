/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of derivatives in closed form: gradients of the mean of a picture, and scenes of media. */
#ifndef IMP_TEST_MEAN_GRADIENT_H
#define IMP_TEST_MEAN_GRADIENT_H

#include "imp_scene.h"
#include "imp_tap.h"

#define VOLPATH(DEPTH)                                                                   \
    "<integrator type='volpath'><integer name='max_depth' value='" DEPTH                 \
    "'/></integrator>"

enum { MEAN_NUMBERS_MAX = 16, MEAN_VALUES_MAX = 1024 * 3 };

/* d (mean of sensor 0's picture)/d numbers of some parameters, added to out [numbers of all] for each
 * seed. */
static inline void mean_gradients(imp_context *ctx, imp_scene *scene,
                                  const char *const *name, int n_names, int spp,
                                  int seeds, struct tap_stat *out)
{
    static float adjoint[MEAN_VALUES_MAX];
    struct imp_scene_info info = {.size = sizeof info};
    struct imp_sensor_info film = {.size = sizeof film};
    double g[MEAN_NUMBERS_MAX];
    imp_problem *p;
    test_must(ctx, imp_scene_get_info(scene, &info));
    test_must(ctx, imp_scene_get_sensor(scene, 0, &film));
    const size_t n = (size_t)film.width * (size_t)film.height * (size_t)info.channels;
    for (size_t k = 0; k < n && k < MEAN_VALUES_MAX; k++)
        adjoint[k] = (float)(1. / (double)n);
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < n_names; k++) test_must(ctx, imp_problem_activate(p, name[k]));
    const size_t numbers = imp_problem_n_variables(p);
    if (n > MEAN_VALUES_MAX || numbers > MEAN_NUMBERS_MAX) exit(99);
    for (int s = 0; s < seeds; s++) {
        struct imp_run run = IMP_RUN_INIT;
        run.spp = spp;
        run.seed = 7 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
        for (size_t k = 0; k < numbers; k++) tap_add(&out[k], g[k]);
    }
    imp_problem_destroy(p);
}

static inline void mean_gradient(imp_context *ctx, imp_scene *scene, const char *name,
                                 int spp, int seeds, struct tap_stat *out)
{
    mean_gradients(ctx, scene, &name, 1, spp, seeds, out);
}

/* One number of `name`, a parameter by what moves, in a scene of these objects: within `most` of ref. */
static inline void mean_gradient_test(imp_context *ctx, const char *what,
                                      const char *objects, const char *name, int number,
                                      int spp, double ref, double most)
{
    char xml[4096];
    struct tap_stat g[MEAN_NUMBERS_MAX] = {{0, 0, 0}};
    if (snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", objects) >=
        (int)sizeof xml)
        exit(99);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, name));
    mean_gradient(ctx, scene, name, spp, 16, g);
    tap_z(&g[number], ref, most, what);
    imp_scene_destroy(scene);
}

#endif
