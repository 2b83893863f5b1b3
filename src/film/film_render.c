/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_render: the scene's integrator decides which solver makes the picture. */
#include "film_render.h"
#include "film_light.h"
#include "film_measure.h"
#include "film_picture.h"
#include "parts.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"

/* alone: as of imp__render_grid; NULL: pixels are independent. */
static enum imp_status render(const struct imp_scene *scene, const struct imp_run *run,
                              const bool *only, int *alone, imp_film **out)
{
    struct imp_measure measure;
    struct imp_same same[IMP_SAME_MAX];
    const struct imp_sensor *sensor;
    enum imp_status st = imp__run_sensor(scene, run, &sensor);
    if (st == IMP_OK && imp__team_shares(scene->ctx))
        st = imp__team_same(scene->ctx, same, imp__same_run(scene, run, "render", same));
    const bool solves =
        scene->integrator && scene->integrator->ops->flags & IMP_INTEGRATOR_SOLVES;
    if (st == IMP_OK && solves) {
        struct imp_job job = imp__job(scene, sensor, run, NULL);
        imp__job_state(&job, IMP_HAS_ELEMENTS, NULL);
        st = imp__job_allowed(&job);
    }
    if (st != IMP_OK) return st;
    st = imp__measure_create(scene, run, &measure);
    if (st != IMP_OK) return st;
    if (alone) {
        *alone = 0;
        if (!solves && !measure.from_lights) st = imp__measure_together(&measure);
        if (measure.together) *alone = measure.n / 2;
    }
    if (st != IMP_OK) {
        /* nothing is rendered */
    } else if (solves) {
        st = imp__render_elements(&measure, run, out);
    } else if (measure.from_lights) {
        st = imp__render_from_lights(&measure, run, out);
    } else {
        const struct imp_picture picture = {.sensor = measure.sensor,
                                            .stage = "render",
                                            .names = measure.names,
                                            .n = measure.n,
                                            .sample = imp__measure_sample,
                                            .payload = &measure,
                                            .set = measure.set,
                                            .only = only,
                                            .walks = imp__measure_bundles(&measure),
                                            .points = imp__tracer_sets(&measure.tracer)};
        st = imp__picture_make(scene->ctx, &picture, run, out);
    }
    imp__measure_destroy(&measure);
    return st;
}

enum imp_status imp__render_pixels(const struct imp_scene *scene,
                                   const struct imp_run *run, const bool *only,
                                   imp_film **out)
{
    return render(scene, run, only, NULL, out);
}

enum imp_status imp__render_grid(const struct imp_scene *scene, const struct imp_run *run,
                                 int *alone, imp_film **out)
{
    return render(scene, run, NULL, alone, out);
}

enum imp_status imp_render(const imp_scene *scene, const struct imp_run *run,
                           imp_film **out)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "out");
    IMP_RUN_PICTURE(scene->ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    return imp__render_pixels(scene, &own, NULL, out);
}
