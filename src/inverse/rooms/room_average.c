/* SPDX-License-Identifier: Apache-2.0
 *
 * The functional of a meter's mean. */
#include "room_average.h"
#include "base/arguments.h"
#include "color/rgb.h"
#include "inverse/problem/problem.h"

enum imp_status imp__room_average(imp_problem *problem, const struct imp_run *run,
                                  struct imp_estimate *value, double *gradient,
                                  double *gradient_se)
{
    const struct imp_scene *scene = problem->scene;
    if (run->sensor < 0 || run->sensor >= scene->n_sensors)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no sensor %d; the scene has %d", run->sensor,
                          scene->n_sensors);
    const struct imp_film_desc *f = &scene->sensors[run->sensor]->film;
    const size_t pixels = (size_t)f->crop_w * (size_t)f->crop_h;
    const size_t channels = (size_t)scene->channels;
    float *adjoint = imp__alloc(scene->ctx, pixels * channels, sizeof *adjoint);
    if (!adjoint) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for an average");
    for (size_t i = 0; i < pixels * channels; i++) {
        const size_t c = i % channels;
        const double w = channels == 1 ? 1 : imp__luminance(c == 0, c == 1, c == 2);
        adjoint[i] = (float)(w / (double)pixels);
    }
    const enum imp_status st =
        imp_problem_functional(problem, adjoint, run, value, gradient, gradient_se);
    imp__release(scene->ctx, adjoint);
    return st;
}
