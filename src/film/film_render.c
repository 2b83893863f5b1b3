/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_render: the scene's integrator decides which solver makes the picture. */
#include "film_render.h"
#include "film_measure.h"
#include "film_picture.h"
#include "walk/run.h"

static bool sample(const void *payload, struct imp_arena *arena, int x, int y,
                   int64_t index, double *value, double *px, double *py)
{
    return imp__measure_sample(payload, arena, x, y, index, value, px, py);
}

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
    if (scene->integrator.kind == IMP_INTEGRATOR_ELEMENTS) {
        st = imp__render_elements(&measure, &own, out);
    } else {
        const struct imp_picture picture = {
            measure.sensor, "render", measure.names, measure.n, sample, &measure, NULL};
        st = imp__picture_make(scene->ctx, &picture, &own, out);
    }
    imp__measure_destroy(&measure);
    return st;
}
