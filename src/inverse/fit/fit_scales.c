/* SPDX-License-Identifier: Apache-2.0
 *
 * A large change of a variable: its whole range, or its size at the start. Zeros take the
 * size of their neighbours in the same parameter, or 1 in the parameter's unit. A pose, which may
 * well start at 0, has that of the scene. */
#include "fit.h"
#include "scene/pose.h"
#include <float.h>
#include <math.h>

/* A large change of a mesh in smooth steps over that of single vertices: the smoother makes what is not
 * as smooth much smaller, and the one size of all steps is that of the largest derivative. */
#define SMOOTH 5

/* The large change of a number of geometry; 0: it is none. */
static double pose_scale(const struct imp_problem *p, const struct imp__block *b,
                         size_t e)
{
    if (b->log || imp__block_factor(p, b)) return 0;
    const struct imp_pose *pose = imp__pose_of(p->scene, b->param);
    return pose ? imp__pose_large(pose, e) : 0;
}

bool imp__block_is_rigid(const struct imp_problem *p, const struct imp__block *b)
{
    const struct imp_pose *pose = imp__pose_of(p->scene, b->param);
    return pose && imp__pose_is_rigid(pose->kind) && b->tie < 0;
}

static bool is_bounded(const struct imp__block *b)
{
    return !b->log && isfinite(b->lo) && isfinite(b->hi) && b->hi - b->lo < DBL_MAX;
}
/* The large change of a logarithm is 1, a factor of e. */
static double typical_of(const struct imp__block *b, double square)
{
    return square > 0 && !b->log ? sqrt(square / (double)b->count) : 1;
}
static void span_scale(const struct imp__block *b, double square, struct imp__span *span)
{
    const bool bounded = is_bounded(b);
    const double scale = bounded ? b->hi - b->lo : typical_of(b, square);
    span->by_start = !bounded && !b->log;
    span->scale = scale > 0 ? scale : 1;
    span->settles = bounded;
}
void imp__fit_span_scale(const struct imp__block *b, const double *x,
                         struct imp__span *span)
{
    double square = 0;
    for (size_t e = 0; e < b->count; e++) square += imp__sqr(x[b->first + e]);
    span_scale(b, square, span);
}

double imp__large_change(const struct imp_problem *p, const struct imp__block *b,
                         size_t e, double start, double square)
{
    const double pose = pose_scale(p, b, e);
    const double scale = pose > 0        ? pose
                         : is_bounded(b) ? b->hi - b->lo
                         : b->log        ? 1
                                         : fmax(fabs(start), typical_of(b, square));
    return scale > 0 ? scale : 1;
}

void imp__fit_scales(struct imp__fit *f, const struct imp__search *search)
{
    const struct imp_problem *p = f->problem;
    size_t span = 0;
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        double square = 0;
        for (size_t e = 0; e < b->count; e++)
            square += imp__sqr(imp__search_start(search, b->first + e));
        for (size_t e = b->first; f->spans && e < b->first + b->count; span++) {
            const double pose = pose_scale(p, b, e - b->first);
            span_scale(b, square, &f->spans[span]);
            if (pose > 0) {
                f->spans[span].scale = f->spans[span].smooth ? SMOOTH * pose : pose;
                f->spans[span].by_start = false;
            }
            e = f->spans[span].end;
        }
        for (size_t e = 0; f->scale && e < b->count; e++) {
            const double start = imp__search_start(search, b->first + e);
            f->scale[b->first + e] = imp__large_change(p, b, e, start, square);
            f->settles[b->first + e] = is_bounded(b);
        }
    }
}
