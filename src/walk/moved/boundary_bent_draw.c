/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays from the camera to curved mirrors and glass, and the chains of surfaces that they meet
 * (boundary_bent.c): where Newton's method begins. */
#include "bent_chain.h"
#include "kind/cleared.h"
#include "moved_mirror.h"

#define LOBE_LEAST 0.1  /* probability of either lobe */
#define STOP       0.3  /* that a chain ends before what it could go on with */
#define STOP_OTHER 0.05 /* the same where the place is hardly: within glass, or outside */

/* A random point of one of these, with random numbers u in [0, 1). */
static imp_v3 bender_point(const struct imp__edge_draw *d, const struct imp__bender *x,
                           const double u[3])
{
    const struct imp_scene *scene = d->b->tracer->scene;
    double b[2];
    if (x->kind == IMP_BENDER_BALL)
        return x->round.centre + imp__uniform_sphere(&u[1]) * x->round.radius;
    if (x->kind == IMP_BENDER_TUBE)
        return imp__rim(scene, x->shape, x->place, 0, u[1]).p +
               x->tube.axis * (x->tube.length * u[2]);
    if (x->kind == IMP_BENDER_DISK) {
        const imp_v3 p = imp__rim(scene, x->shape, x->place, 0, u[1]).p,
                     q = imp__rim(scene, x->shape, x->place, 0, u[1] + 0.5).p;
        return p + (q - p) * (0.5 * (1 - sqrt(u[2])));
    }
    const int prim = imp_min((int)(u[0] * x->n_facets), x->n_facets - 1);
    const struct imp__corners f = imp__corners(scene, x->shape, prim, x->place, 0);
    imp__uniform_triangle(&u[1], b);
    return f.p[0] + (f.p[1] - f.p[0]) * b[0] + (f.p[2] - f.p[0]) * b[1];
}

/* A ray of the eye to a random point of one of these, or of its image in flat mirrors: where the ray is parallel
 * to others, the place where it begins, else its direction. */
static bool ray_draw(const struct imp__edge_draw *d, struct imp_key key, imp_v3 *from)
{
    const struct imp__boundary *b = d->b;
    const size_t n = b->n_benders;
    const double which = imp__u01(key, IMP_BENT_WHICH) * (double)n;
    const size_t k = imp_min((size_t)which, n - 1);
    const double u[3] = {which - (double)k, imp__u01(key, IMP_BENT_POINT_U),
                         imp__u01(key, IMP_BENT_POINT_V)};
    imp_v3 p = bender_point(d, &b->bender[k], u);
    if (b->n_planes > 0 && imp__u01(key, IMP_BENT_PLANES) < 0.5) {
        struct imp__edge_draw other = *d;
        struct imp__sight s;
        other.key = key;
        if (!imp__sight_draw(&other, 0, &s)) return false;
        p = imp__sight_image(&s, p);
    }
    if (b->parallel) *from = p - d->eye * (2 * b->size);
    else *from = imp__normalize(p - d->eye);
    return true;
}

/* The surface that a ray along w has hit, which reflects or bends it by chance. False: it ends there. */
static bool surface_draw(const struct imp__edge_draw *d, const struct imp_hit *hit,
                         const struct imp_surface *at, imp_v3 w, double u,
                         struct imp__bent_surface *out)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp_round round;
    struct imp__tube tube;
    double ratio;
    const imp_spec F = imp__edge_reflected(d, hit, at, w),
                   T = imp__edge_refracted(d, hit, at, w, &ratio);
    const double f = imp__max_used(F, d->waves), t = imp__max_used(T, d->waves);
    if (!(f + t > 0)) return false;
    const double chance = !(t > 0)   ? 1
                          : !(f > 0) ? 0
                                     : imp_clamp(f / (f + t), LOBE_LEAST, 1 - LOBE_LEAST);
    const int shape = hit->shape;
    *out = (struct imp__bent_surface){.shape = shape, .place = hit->place};
    /* index of where the ray comes from, over that of where it goes: the eye is on this side */
    out->ratio = u < chance ? 0 : ratio;
    if (imp__moves_sphere(scene, shape, hit->place, &round)) {
        out->p = round.centre;
        out->radius = round.radius;
        out->inside = imp__dot(at->p - round.centre, w) > 0;
    } else if (imp__moves_cylinder(scene, shape, hit->place, &tube)) {
        out->p = tube.base;
        out->axis = tube.axis;
        out->radius = tube.radius;
        out->inside = imp__dot(imp__across_axis(tube.axis, at->p - tube.base), w) > 0;
    } else { /* as imp__flat_draw has it: facets of a face are in one plane */
        const int number = imp__plane_number(d->b, hit);
        if (number == 0) return false;
        const double by = out->ratio;
        imp__plane_surface(d->b, (size_t)number - 1, out);
        out->ratio = by;
    }
    return true;
}

/* The chain of surfaces that a ray meets. False: none, or flat mirrors alone. */
static bool chain_draw(const struct imp__edge_draw *d, struct imp_key key, imp_v3 from,
                       bool on_glass, struct imp__bent_chain *out)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const int depth = d->b->tracer->integrator->max_depth,
              longest = depth < 0 ? IMP_SIGHT_MAX : imp_min(depth - 1, IMP_SIGHT_MAX);
    const struct imp__bent_ray ray = imp__bent_begin(d, from);
    imp_v3 o = ray.o, w = ray.w;
    bool bends = false, glass = false;
    out->n = 0;
    for (unsigned k = 0; k < IMP_BENT_PASSES; k++) {
        const double u = imp__u01(key, IMP_BENT_FIRST + 3 * k),
                     v = imp__u01(key, IMP_BENT_FIRST + 3 * k + 1),
                     stop = imp__u01(key, IMP_BENT_FIRST + 3 * k + 2);
        struct imp_hit hit;
        struct imp_surface at;
        struct imp__bent_surface s;
        if (!imp__intersect_at(scene, d->time, &o, &w, 0, INFINITY, &hit)) break;
        imp__hit_surface(scene, &hit, &o, &w, &at);
        const struct imp_bsdf *b = imp__hit_bsdf(scene, &hit);
        const bool mirrors = imp__mirror_lobes(b) != 0;
        struct imp_sensor_sample to;
        /* In front of the camera's near clip, or of where its rays begin, nothing is met. */
        const bool clipped =
            out->n == 0 &&
            !imp__sensor_connect(d->b->tracer->sensor, &at.p, false, d->lens, &to);
        if (clipped || (b->straight && (!mirrors || u < 0.5))) {
            o = imp__offset(at.p, at.ng, w);
            continue;
        }
        if (!mirrors || out->n == longest || !surface_draw(d, &hit, &at, w, v, &s) ||
            (bends && stop < (glass == on_glass ? STOP : STOP_OTHER)))
            break;
        const imp_v3 n =
            s.radius > 0 ? imp__normalize(imp__across_axis(s.axis, at.p - s.p)) : s.n;
        imp_v3 next;
        if (!imp__bend(n, w, s.ratio, &next)) break;
        if (s.ratio > 0) glass = imp__dot(next, n) < 0;
        out->at[out->n++] = s;
        bends |= s.radius > 0 || s.ratio > 0;
        w = next;
        o = imp__offset(at.p, at.ng, w);
    }
    return bends;
}

/* Do they go over the same shapes in the same way? */
static bool alike(const struct imp__bent_chain *a, const struct imp__bent_chain *b)
{
    bool same = a->n == b->n;
    for (int k = 0; k < a->n && same; k++) {
        const struct imp__bent_surface *x = &a->at[k], *y = &b->at[k];
        same = x->plane == y->plane && x->shape == y->shape && x->place == y->place &&
               x->inside == y->inside && (x->ratio == 0) == (y->ratio == 0);
    }
    return same;
}

bool imp__bent_draw(const struct imp__edge_draw *d, struct imp_key key,
                    const struct imp__bent_goal *goal, const struct imp__bent_root *of,
                    struct imp__bent_root *x)
{
    return ray_draw(d, key, &x->from) &&
           chain_draw(d, key, x->from, goal->on_glass, &x->chain) &&
           (of ? alike(&x->chain, &of->chain)
               : !imp__round_chain(d, goal, &x->chain) &&
                     !imp__flat_chain(goal, &x->chain)) &&
           imp__bent_find(d, goal, x) && (!of || imp__bent_same(d, of, x));
}
