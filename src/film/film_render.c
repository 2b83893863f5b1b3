/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_render: the scene's integrator decides which solver makes the picture. */
#include "film_render.h"
#include "film_measure.h"
#include "film_picture.h"
#include "walk/run.h"

enum imp_status imp_render(const imp_scene *scene, const struct imp_run *run,
                           imp_film **out)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "out");
    IMP_RUN(scene->ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    struct imp_measure measure;
    enum imp_status st = imp__measure_create(scene, &own, &measure);
    if (st != IMP_OK) return st;
    if (scene->integrator->ops->flags & IMP_INTEGRATOR_SOLVES) {
        st = imp__render_elements(&measure, &own, out);
    } else {
        const struct imp_picture picture = {.sensor = measure.sensor,
                                            .stage = "render",
                                            .names = measure.names,
                                            .n = measure.n,
                                            .sample = imp__measure_sample,
                                            .payload = &measure};
        st = imp__picture_make(scene->ctx, &picture, &own, out);
    }
    imp__measure_destroy(&measure);
    return st;
}
