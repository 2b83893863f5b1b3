/* SPDX-License-Identifier: Apache-2.0
 *
 * Which kind of segment the walks of a tracer begin with: the kinds lie in rooms below, and
 * no other file includes them all. */
#include "first_segment.h"
#include "walk/graded/graded.h"
#include "walk/media/tracking.h"

/* Adjoint photons and walks from lights cross media where there are some; else they are walks
 * of surfaces alone, as those of path. */
static bool tracks(const struct imp_tracer *tracer)
{
    const bool any = tracer->scene->n_media > 0 || tracer->scene->priorities;
    switch (tracer->integrator->media) {
    case IMP_CROSSES_NOTHING: return false;
    case IMP_CROSSES_WHAT_IS_THERE: return any;
    case IMP_CROSSES_MEDIA: break;
    }
    return true;
}

const struct imp_segment_ops *imp__segment_first(const struct imp_tracer *tracer)
{
    return imp_unlikely(tracer->scene->n_bodies > 0) ? &imp__graded_outside
           : imp_unlikely(tracks(tracer))            ? &imp__tracking
                                                     : &imp__straight_ops;
}
