/* SPDX-License-Identifier: Apache-2.0
 *
 * The camera's exposure and its like as the last factor of a walk (scene/camera_gain.h):
 * a picture is linear in it, so its numbers have derivatives without a ray. */
#include "scene/camera_gain.h"
#include "walk.h"

imp_spec imp__walk_gain(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    return imp__gain_at(tracer->sensor->gain, tracer->photograph, walk->px, walk->py,
                        NULL);
}

imp_spec imp__walk_offset(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    return imp__gain_offset(tracer->sensor->gain, tracer->photograph, walk->px, walk->py,
                            NULL);
}

void imp__gain_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, struct imp_sink *sink)
{
    const struct imp_camera_gain *g = tracer->sensor->gain;
    imp_spec d[IMP_GAIN_INPUTS], d_offset;
    imp__gain_at(g, tracer->photograph, walk->px, walk->py, d);
    imp__gain_offset(g, tracer->photograph, walk->px, walk->py, &d_offset);
    const imp_spec seen = imp__walk_seen(walk, walk->values) * adjoint;
    for (int k = 0; k < IMP_GAIN_INPUTS; k++) {
        const int param = g->input[k]->param;
        imp_spec bar = seen * d[k];
        if (k == IMP_GAIN_GAMMA) bar += adjoint * d_offset;
        for (int c = tracer->scene->channels; c < 4; c++) bar[c] = 0;
        if (param >= 0 && tracer->active->base[param] >= 0)
            sink->add(sink, param, 0, 1, &bar);
    }
}

imp_spec imp__gain_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot)
{
    const struct imp_camera_gain *g = tracer->sensor->gain;
    const imp_spec seen = imp__walk_seen(walk, walk->values);
    imp_spec d[IMP_GAIN_INPUTS], d_offset, dot = {0};
    imp__gain_at(g, tracer->photograph, walk->px, walk->py, d);
    imp__gain_offset(g, tracer->photograph, walk->px, walk->py, &d_offset);
    for (int k = 0; k < IMP_GAIN_INPUTS; k++) {
        const int param = g->input[k]->param;
        if (param < 0 || tracer->active->base[param] < 0) continue;
        const imp_spec of = k == IMP_GAIN_GAMMA ? seen * d[k] + d_offset : seen * d[k];
        dot += of * (x_dot[imp__active_at(tracer->active, param, 0)] *
                     imp__active_slope(tracer->active, param, 0));
    }
    return dot;
}
