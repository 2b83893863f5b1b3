/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays from the camera over a chain of mirrors and glass that meet a place, as roots (boundary_bent.c).
 *
 * A ray depends on the two numbers of its direction at the eye (or, of parallel rays, of where it begins),
 * and so do its place and direction behind each surface: with q' where it meets one of normal n, and
 * n' = q'/R on a ball of radius R, or the part of it across the axis of a cylinder,
 *
 *     q' = o' + t w' - w n.(o' + t w')/(n.w),   w_o' as moved_mirror.h has it.
 *
 * These are Newton's matrix, and the film's area over the area across the rays at the place p is that over
 * the solid angle at the eye, times 1/|det dp/dw|. The line that touches a ball B on the way is a root of
 * two other numbers: the distance of the ray from its centre, less the radius, and that of the point there
 * from a plane through the centre, which is drawn. Circles of such planes, on a ball of radius R, meet a
 * curve on it (Crofton) as
 *
 *     int F dl = pi R E[sum over crossings of F].
 *
 * On a cylinder of length L circles about its axis meet a piece of the curve along the unit vector t with the
 * density |t.axis|/L, and pairs of lines along the axis with |t x axis|/(pi R). Both are drawn, half of the time
 * each, and a crossing counts one over the mean of the two, which is nowhere 0. */
#include "base/arguments.h"
#include "bent_chain.h"
#include "math/warp.h"
#include "moved_mirror.h"

/* ---- Chains ------------------------------------------------------------------------------ */

struct imp__bent_ray imp__bent_begin(const struct imp__edge_draw *d, imp_v3 from)
{
    struct imp__bent_ray x = {.o = {0}};
    const imp_v3 w = d->b->parallel ? d->eye : from;
    const struct imp_frame f = imp__frame_from_normal(w);
    imp_v3 *by = d->b->parallel ? x.o_d : x.w_d;
    x.o = d->b->parallel ? from : d->eye;
    x.w = w;
    by[0] = f.s;
    by[1] = f.t;
    return x;
}

/* On to a surface of the chain, and beyond it. False: it is not met, or reflects all. */
static bool pencil_pass(struct imp__bent_ray *x, struct imp__bent_surface *s)
{
    const imp_v3 r = imp__across_axis(s->axis, x->o - s->p);
    double t;
    if (s->radius > 0) {
        const double a = 1 - imp__sqr(imp__dot(s->axis, x->w)), b = imp__dot(r, x->w),
                     square = b * b - a * (imp__dot(r, r) - imp__sqr(s->radius));
        if (!(square > 0)) return false;
        t = (s->inside ? -b + sqrt(square) : -b - sqrt(square)) / a;
    } else t = -imp__dot(s->n, r) / imp__dot(s->n, x->w);
    if (!(t > 0)) return false;
    s->q = x->o + x->w * t;
    s->normal =
        s->radius > 0 ? imp__across_axis(s->axis, s->q - s->p) * (1 / s->radius) : s->n;
    const double along = imp__dot(s->normal, x->w), side = along > 0 ? -1 : 1,
                 c = fabs(along);
    const imp_v3 n = s->normal * side;
    imp_v3 out;
    if (c == 0 || !imp__bend(n, x->w, s->ratio, &out)) return false;
    const double r_i = s->ratio, c_t = r_i == 0 ? -c : sqrt(1 - r_i * r_i * (1 - c * c)),
                 by_n = r_i == 0 ? 2 * c : r_i * c - c_t,
                 by_c = r_i == 0 ? 2 : r_i - r_i * r_i * c / c_t;
    for (int k = 0; k < 2; k++) {
        imp_v3 shift = x->o_d[k] + x->w_d[k] * t;
        shift += x->w * (imp__dot(n, shift) / c);
        const imp_v3 turn = s->radius > 0
                                ? imp__across_axis(s->axis, shift) * (side / s->radius)
                                : (imp_v3){0};
        const double c_d = -(imp__dot(turn, x->w) + imp__dot(n, x->w_d[k]));
        x->o_d[k] = shift;
        x->w_d[k] = x->w_d[k] * (r_i == 0 ? 1 : r_i) + turn * by_n + n * (by_c * c_d);
    }
    x->o = s->q;
    x->w = out;
    return true;
}

/* ---- Roots ------------------------------------------------------------------------------- */

/* How far F is from 0, of the derivative J, and the step there. */
static bool newton_step(const double F[2], double J[2][2], double *miss, double step[2])
{
    const double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    *miss = sqrt(F[0] * F[0] + F[1] * F[1]);
    step[0] = -(J[1][1] * F[0] - J[0][1] * F[1]) / det;
    step[1] = -(J[0][0] * F[1] - J[1][0] * F[0]) / det;
    return isfinite(*miss) && isfinite(step[0]) && isfinite(step[1]);
}

/* The same of a direction. */
static bool aim_far(const struct imp__bent_goal *goal, const struct imp__bent_ray *ray,
                    struct imp__bent_root *x, double *miss, double step[2])
{
    const struct imp_frame f = imp__frame_from_normal(goal->across);
    const double F[2] = {imp__dot(f.s, ray->w), imp__dot(f.t, ray->w)};
    double J[2][2];
    if (!(imp__dot(goal->across, ray->w) > 0)) return false;
    for (int k = 0; k < 2; k++) {
        J[0][k] = imp__dot(f.s, ray->w_d[k]);
        J[1][k] = imp__dot(f.t, ray->w_d[k]);
    }
    x->p = ray->o;
    x->det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    return newton_step(F, J, miss, step);
}

/* How far the ray of these numbers is from the goal, and the step to it. False: it does not go over the
 * chain, or away from the goal. */
static bool aim(const struct imp__edge_draw *d, const struct imp__bent_goal *goal,
                struct imp__bent_root *x, double *miss, double step[2])
{
    struct imp__bent_ray ray = imp__bent_begin(d, x->from);
    double F[2], J[2][2];
    imp_v3 at[2];
    for (int k = 0; k < x->chain.n; k++)
        if (!pencil_pass(&ray, &x->chain.at[k])) return false;
    x->w = ray.w;
    if (goal->far) return aim_far(goal, &ray, x, miss, step);
    const imp_v3 to = imp__across_axis(goal->axis, goal->p - ray.o),
                 w = imp__across_axis(goal->axis, ray.w);
    const double square = imp__dot(w, w), t = imp__dot(to, ray.w) / square;
    if (!(t > 0)) return false;
    const struct imp_frame f = imp__frame_from_normal(ray.w);
    x->p = ray.o + ray.w * t;
    for (int k = 0; k < 2; k++) at[k] = ray.o_d[k] + ray.w_d[k] * t;
    x->det = imp__dot(f.s, at[0]) * imp__dot(f.t, at[1]) -
             imp__dot(f.s, at[1]) * imp__dot(f.t, at[0]);
    if (goal->radius > 0) {
        const imp_v3 e = imp__across_axis(goal->axis, x->p - goal->p);
        const double length = imp__length(e);
        F[0] = length - goal->radius;
        F[1] = imp__dot(x->p - goal->p, goal->across);
        for (int k = 0; k < 2; k++) {
            const double t_d =
                (imp__dot(to - w * (2 * t), ray.w_d[k]) - imp__dot(ray.o_d[k], w)) /
                square;
            at[k] += ray.w * t_d;
            J[0][k] = imp__dot(e, at[k]) / length;
            J[1][k] = imp__dot(goal->across, at[k]);
        }
        x->along = at[1] * J[0][0] - at[0] * J[0][1];
    } else {
        const imp_v3 r = x->p - goal->p;
        F[0] = imp__dot(f.s, r);
        F[1] = imp__dot(f.t, r);
        for (int k = 0; k < 2; k++) {
            J[0][k] = imp__dot(f.s, at[k]);
            J[1][k] = imp__dot(f.t, at[k]);
        }
    }
    return newton_step(F, J, miss, step);
}

#define STEPS    20 /* of Newton's method */
#define HALVINGS 4  /* of a step: starts that need more end nowhere, mostly */
#define EXACT                                                                            \
    1e-9 /* of the scene's size: so near, one step more is as near as doubles are */
#define WIDEST 0.5 /* a step, in radians, or in parts of the scene's size */

static imp_v3 stepped(const struct imp__edge_draw *d, imp_v3 from, const double step[2],
                      double part)
{
    const struct imp_frame f = imp__frame_from_normal(d->b->parallel ? d->eye : from);
    const imp_v3 by = f.s * (step[0] * part) + f.t * (step[1] * part);
    return d->b->parallel ? from + by : imp__normalize(from + by);
}

bool imp__bent_find(const struct imp__edge_draw *d, const struct imp__bent_goal *goal,
                    struct imp__bent_root *x)
{
    const double exact = EXACT * (goal->far ? 1 : d->b->size);
    double miss, step[2];
    if (!aim(d, goal, x, &miss, step)) return false;
    for (int k = 0; k < STEPS; k++) {
        const bool last = miss <= exact;
        const double length = sqrt(step[0] * step[0] + step[1] * step[1]),
                     most = WIDEST * (d->b->parallel ? d->b->size : 1);
        double part = length > most ? most / length : 1;
        const imp_v3 from = x->from;
        double next, on[2];
        for (int halved = 0;; halved++, part *= 0.5) {
            if (halved > HALVINGS) return false;
            x->from = stepped(d, from, step, part);
            if (aim(d, goal, x, &next, on) && (last || next < miss)) break;
            if (last) return false;
        }
        if (last) return true;
        miss = next;
        step[0] = on[0];
        step[1] = on[1];
    }
    return false;
}

#define SAME 1e-6 /* of the scene's size: places of one root */

bool imp__bent_same(const struct imp__edge_draw *d, const struct imp__bent_root *a,
                    const struct imp__bent_root *b)
{
    if (a->chain.n != b->chain.n) return false;
    for (int k = 0; k < a->chain.n; k++)
        if (imp__length(a->chain.at[k].q - b->chain.at[k].q) > SAME * d->b->size)
            return false;
    return imp__length(a->p - b->p) <= SAME * d->b->size;
}
