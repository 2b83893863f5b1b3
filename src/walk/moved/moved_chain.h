/* SPDX-License-Identifier: Apache-2.0
 *
 * Links of a chain from the camera over points that move (moved.h), transposed: adjoints of the
 * logarithm of a link become adjoints of velocities, and an adjoint of a point that slides along a
 * ray becomes one of where the ray begins. */
#ifndef IMP_WALK_MOVED_CHAIN_H
#define IMP_WALK_MOVED_CHAIN_H

#include "moved.h"
#include "moved_kernel.h"

/* A vertex: the glued point of its surface, and adjoints of its velocity. At the sky x.p is the
 * direction. A point of a medium floats at a part of the way to the surface beyond it, from a border on
 * where one is on that way; its x is of that surface, but for x.p. */
struct imp__link_point {
    struct imp__glued x;
    struct imp__velocity bar; /* of the surface there: V, n', d ln dA */
    imp_v3 moved_bar;         /* of v', the vertex itself */
    imp_v3 wo_bar;            /* of the direction to the camera, across it */
    double along;             /* of the length of the ray that leads to the surface */
    bool sky;
    bool turns; /* the ray that leads there comes from a mirror, and turns with it */
    bool floats;
    bool open;  /* it floats, and no surface, or the border of its medium, is beyond it */
    bool stays; /* it floats on a border, and is open */
    double part;         /* of its stretch of the medium; 1: on the surface */
    double stretch;      /* the length of that */
    imp_spec extinction; /* of the medium before it, or in which it is; 0: none */
    imp_v3 beyond;       /* the place of x on the surface */
};

static inline struct imp__link_point
imp__surface_point(const struct imp_scene *scene, int shape, const struct imp_located *at,
                   int64_t place, double time, imp_v3 n)
{
    return (struct imp__link_point){.x = imp__glued_at(scene, shape, at, place, time, n)};
}
/* It floats, and has no surface beyond it yet. */
static inline struct imp__link_point imp__medium_point(imp_v3 p)
{
    return (struct imp__link_point){
        .x = {.shape = -1, .p = p}, .floats = true, .open = true};
}
static inline struct imp__link_point imp__sky_point(imp_v3 d)
{
    return (struct imp__link_point){.x.p = d, .sky = true};
}

static inline imp_v3 imp__link_direction(const struct imp__link_point *from,
                                         const struct imp__link_point *to)
{
    return to->sky ? to->x.p : imp__normalize(to->x.p - from->x.p);
}

/* The adjoint of a kernel at x, of a step in a fixed direction. */
static inline void imp__scatter_bar(struct imp__link_point *x,
                                    const struct imp__kernel_bar *kernel)
{
    if (x->x.smooth) x->bar.shade += kernel->n;
    else x->bar.n += kernel->n;
    x->bar.turn += kernel->turn;
    x->moved_bar += kernel->slide;
    x->bar.v -= kernel->slide;
}

/* Adds the adjoint of the logarithm of 1/d^2 (`bar`), of the distance d (`along`), and of what else
 * depends on the unit direction w from x towards y (`turn`), d away: to x, which slides; returns that
 * of y. */
static inline imp_v3 imp__apart_bar(struct imp__link_point *x, imp_v3 w, double d,
                                    imp_v3 turn, double bar, double along)
{
    imp_v3 apart = (turn - w * (imp__dot(w, turn) + 2 * bar)) * (1 / d);
    if (imp_unlikely(along != 0)) apart += w * along;
    x->moved_bar -= apart;
    return apart;
}

/* The adjoint of the kernel at x, which slides, and (`bar`) of the logarithm of cos_y dA_y/d^2 of
 * y, which is glued; of d (`along`). */
static inline void imp__connection_bar(struct imp__link_point *x,
                                       struct imp__link_point *y,
                                       const struct imp__kernel_bar *kernel, double bar,
                                       double along)
{
    const imp_v3 r = y->x.p - x->x.p;
    const double d = imp__length(r);
    const imp_v3 w = r * (1 / d);
    const double by = bar / imp__dot(y->x.n, w);
    imp__scatter_bar(x, kernel);
    y->bar.n += w * by;
    y->bar.area += bar;
    y->bar.v += imp__apart_bar(x, w, d, kernel->wi + y->x.n * by, bar, along);
}

/* The adjoint of the kernel at x, and of the logarithm of 1/d^2 between x, which slides, and a
 * light at the point y; returns that of the light's velocity. */
static inline imp_v3 imp__point_bar(struct imp__link_point *x, imp_v3 y,
                                    const struct imp__kernel_bar *kernel, double bar,
                                    double along)
{
    const imp_v3 r = y - x->x.p;
    const double d = imp__length(r);
    imp__scatter_bar(x, kernel);
    return imp__apart_bar(x, r * (1 / d), d, kernel->wi, bar, along);
}

/* The surface that a ray along w meets: by `on` times the shift of the point where it does along the
 * ray. Returns the adjoint of a shift of the ray there. */
static inline imp_v3 imp__reached_bar(struct imp__link_point *x, imp_v3 w, double on)
{
    const imp_v3 across = x->x.n * (on / imp__dot(x->x.n, w));
    x->bar.v += across;
    return -across;
}

/* The vertex that a ray along w meets slides along it: what its adjoint is to the surface it
 * lies on, which is added there, and to a shift of the ray, which is returned. *far, where it is not
 * NULL: of that the part of a shift where the ray meets the surface beyond a point that floats. */
static inline imp_v3 imp__slide_bar(struct imp__link_point *x, imp_v3 w, imp_v3 *far)
{
    imp_v3 shift;
    if (imp_unlikely(x->floats)) {
        const double on = x->part * imp__dot(w, x->moved_bar) + x->along;
        const imp_v3 there = x->open ? (imp_v3){0} : imp__reached_bar(x, w, on);
        shift = x->moved_bar + (far ? (imp_v3){0} : there);
        if (far) *far = there;
    } else {
        /* On a curved surface the normal turns as the vertex slides over it; on a mesh with vertex
         * normals the shading normal does. */
        imp_v3 turn = (x->bar.n - x->x.n * imp__dot(x->x.n, x->bar.n)) * x->x.curvature;
        turn -= x->x.straight * imp__dot(x->x.straight, turn);
        if (imp_unlikely(x->x.strand))
            turn = x->x.slope[0] * imp__dot(x->x.turn[0], x->bar.n) +
                   x->x.slope[1] * imp__dot(x->x.turn[1], x->bar.n);
        if (x->x.smooth)
            turn = x->x.slope[0] * imp__dot(x->x.turn[0], x->bar.shade) +
                   x->x.slope[1] * imp__dot(x->x.turn[1], x->bar.shade);
        x->moved_bar += turn;
        x->bar.v -= turn;
        shift =
            x->moved_bar + imp__reached_bar(x, w, imp__dot(w, x->moved_bar) + x->along);
        if (far) *far = (imp_v3){0};
    }
    x->moved_bar = (imp_v3){0};
    x->along = 0;
    return shift;
}

/* What ends the stretch of a medium behind o along w: the border of that, or what does not pass light as
 * if nothing were there. False: nothing. */
static inline bool imp__stretch_end(const struct imp_scene *scene, imp_v3 o, imp_v3 w,
                                    struct imp_hit *hit, struct imp_surface *at,
                                    bool *border)
{
    enum { PASSES = 256 };
    for (int n = 0; n < PASSES; n++) {
        if (!imp__intersect(scene, &o, &w, 0, INFINITY, hit)) return false;
        const struct imp_shape *s = scene->shapes[hit->shape];
        imp__hit_surface(scene, hit, &o, &w, at);
        *border = imp__is_border(scene, s);
        if (*border || !(imp__shape_bsdf(scene, s)->flags & IMP_BSDF_NULL)) return true;
        o = imp__offset(at->p, at->ng, w);
    }
    return false;
}

/* A point that floats on a ray from `from`: the stretch of the medium that it is in, from there or from a
 * border on, and the surface that ends it. */
static inline void imp__float_aim(const struct imp__borders *borders,
                                  struct imp__link_point *x, imp_v3 from)
{
    const imp_v3 p = x->x.p, r = p - from;
    const double t = imp__length(r);
    const imp_v3 w = r * (1 / t);
    struct imp_hit hit;
    struct imp_surface at;
    bool border;
    double start = 0;
    x->open =
        x->stays || !imp__stretch_end(borders->scene, p, w, &hit, &at, &border) || border;
    if (x->open) return;
    /* In double; hits are as exact as floats. */
    const double far = imp_max(imp__dot(at.ng, at.p - from) / imp__dot(at.ng, w), t);
    x->beyond = from + w * far;
    x->x = imp__glued_near(borders->scene, hit.shape, hit.prim, hit.place, hit.time,
                           x->beyond, at.ng);
    x->x.p = p;
    if (imp_unlikely(borders->any) &&
        imp__stretch_end(borders->scene, p, -w, &hit, &at, &border) && border)
        start = imp_max(t - imp__length(at.p - p), 0.0);
    x->part = (t - start) / (far - start);
    x->stretch = far - start;
}

/* What its surface moves by, as one that is glued there. */
static inline struct imp__glued imp__link_glued(const struct imp__link_point *x)
{
    struct imp__glued g = x->x;
    if (x->floats) g.p = x->beyond;
    return g;
}
static inline void imp__link_velocity_bar(const struct imp__moves *moves,
                                          const struct imp__link_point *x,
                                          double *theta_bar)
{
    if (imp_likely(!x->floats)) {
        imp__velocity_bar(moves, &x->x, &x->bar, theta_bar);
        return;
    }
    const struct imp__glued g = imp__link_glued(x);
    if (!x->open) imp__velocity_bar(moves, &g, &x->bar, theta_bar);
}

/* A vertex that the ray of a fixed film position meets, which begins at o: the end of the chain. Adds
 * to theta_bar. */
static inline void imp__camera_bar(const struct imp__moves *moves, imp_v3 o,
                                   struct imp__link_point *x, double *theta_bar)
{
    const double t = imp__length(x->x.p - o);
    imp_v3 far;
    const imp_v3 shift = imp__slide_bar(x, (x->x.p - o) * (1 / t), &far),
                 wo_bar = x->wo_bar;
    imp__camera_velocity_bar(moves, o, x->x.p, shift, theta_bar);
    if (!imp__is_zero(far)) imp__camera_velocity_bar(moves, o, x->beyond, far, theta_bar);
    if (!imp__is_zero(wo_bar)) {
        /* The ray turns by (u(p) - u(o))/t, and wo against it. */
        imp__camera_velocity_bar(moves, o, x->x.p, wo_bar * (-1 / t), theta_bar);
        imp__camera_velocity_bar(moves, x->x.p, o, wo_bar * (1 / t), theta_bar);
    }
    imp__link_velocity_bar(moves, x, theta_bar);
}

#endif
