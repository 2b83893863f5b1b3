/* SPDX-License-Identifier: Apache-2.0
 *
 * Shapes: hits and what `surface` makes of them, the box, the area; draws of points are in
 * selftest_points.c. Shapes of groups are tested where the group has them. */
#include "selftest_shape.h"
#include "base/context.h"
#include "kind/sensor/receiver.h"
#include "scene/instances.h"
#include <string.h>

#define LOOKED 4000 /* hits whose neighbours are looked at */
#define STEP   1e-5 /* to the neighbours, over the reach */

struct look {
    double n, bad;         /* hits */
    double near, skew;     /* frames and neighbours; wrong ones */
    double mapped, astray; /* places in uv; wrong ones */
    double outside;        /* hits outside of the box */
    double asked, unmet;   /* of the scene */
    double odd;            /* lines that cross an odd number of times */
    double front, behind;  /* crossings of a closed shape whose side is right, wrong */
    double moved,
        left;      /* hits, and that are not where `move` should bring them, or ... */
    double placed; /* ... `placed` */
};

static double largest(imp_v3 v) { return imp__max3(imp__abs(v)); }

/* ---- Hits ---------------------------------------------------------------------------- */

static bool is_frame(const struct imp_surface *at)
{
    return fabs(imp__dot(at->s, at->s) - 1) < 1e-6 &&
           fabs(imp__dot(at->t, at->t) - 1) < 1e-6 &&
           fabs(imp__dot(at->n, at->n) - 1) < 1e-6 &&
           fabs(imp__dot(at->s, at->t)) < 1e-6 && fabs(imp__dot(at->s, at->n)) < 1e-6 &&
           fabs(imp__dot(at->t, at->n)) < 1e-6;
}

/* `intersect` finds this hit behind `from`, and nothing before it or in a shorter piece. */
static bool is_nearest(const struct imp__probe *p, const struct imp__chord *l,
                       const struct imp_hit *hit, double from)
{
    const struct imp_shape *s = p->s;
    const double little = 1e-9 * p->scale;
    struct imp_hit other = {.shape = s->index};
    if (s->geometry != IMP_ANALYTIC) return true;
    if (!(hit->t > from && hit->t < l->length)) return false;
    return s->ops->intersect(s, &l->o, &l->d, from, hit->t + little, &other) &&
           fabs(other.t - hit->t) <= little &&
           (hit->t - little <= from ||
            !s->ops->intersect(s, &l->o, &l->d, from, hit->t - little, &other));
}

/* The hit of a line beside this one, on the same triangle. */
static bool beside(const struct imp__probe *p, const struct imp__chord *l, imp_v3 step,
                   const struct imp_hit *hit, struct imp_surface *out)
{
    struct imp__chord other = *l;
    struct imp_hit near;
    int rank;
    other.o += step;
    if (!imp__probe_hit(p, &other, hit->t, 40 * STEP * p->reach, &near, &rank) ||
        (p->s->geometry != IMP_ANALYTIC && near.prim != hit->prim))
        return false;
    imp__probe_surface(p, &near, &other, out);
    return true;
}

/* Neighbours lie in the plane across ng, and their uv differs by what dp_du and dp_dv say. An edge
 * of the surface may be between, on one side: one of two opposite neighbours must agree. */
static void neighbours_look(const struct imp__probe *p, const struct imp__chord *l,
                            const struct imp_hit *hit, const struct imp_surface *at,
                            struct look *a)
{
    const struct imp_frame f = imp__frame_from_normal(l->d);
    const double h = STEP * p->reach;
    const imp_v3 across = imp__cross(at->dp_du, at->dp_dv);
    const bool maps = !p->s->by_triangle && p->s->geometry != IMP_CURVES &&
                      imp__length(across) > 1e-6 * imp__sqr(p->reach);
    if (!(fabs(imp__dot(at->ng, l->d)) > 0.2)) return;
    for (int axis = 0; axis < 2; axis++) {
        int seen = 0, flat = 0, linear = 0;
        for (int side = -1; side <= 1; side += 2) {
            struct imp_surface near;
            const imp_v3 step = (axis ? f.t : f.s) * (side * h);
            if (!beside(p, l, step, hit, &near)) continue;
            seen++;
            const imp_v3 dp = near.p - at->p;
            flat += fabs(imp__dot(dp, at->ng)) < 0.01 * imp__length(dp);
            const double du = near.uv[0] - at->uv[0], dv = near.uv[1] - at->uv[1];
            const imp_v3 rest = dp - (at->dp_du * du + at->dp_dv * dv);
            linear += imp__length(rest) < 0.02 * imp__length(dp);
        }
        if (seen < 2) continue;
        a->near++;
        a->skew += flat == 0;
        if (!maps) continue;
        a->mapped++;
        a->astray += linear == 0;
    }
}

static void place_look(const struct imp__probe *p, const struct imp_surface *at,
                       struct look *a)
{
    const struct imp_shape *s = p->s;
    if (!s->ops->place || s->ops->flags & IMP_SHAPE_TRIANGLES ||
        s->geometry == IMP_CURVES)
        return;
    struct imp_surface again = {.located = {.prim = -1}};
    const double uv[2] = {(float)at->uv[0], (float)at->uv[1]};
    int prim = 0;
    s->ops->place(s, uv, &again, &prim);
    const double off =
        1e-6 * (p->scale + imp__length(at->dp_du) + imp__length(at->dp_dv));
    a->mapped++;
    a->astray += !(largest(again.p - at->p) < off && imp__dot(again.ng, at->ng) > 0.999);
}

/* Does the scene find it, as the nearest in a short piece? At borders and where the line grazes,
 * rays in float may miss. */
static void scene_look(const struct imp__probe *p, const struct imp__chord *l,
                       const struct imp_hit *hit, const struct imp_surface *at,
                       struct look *a)
{
    const double piece = 1e-4 * p->scale, border = 1e-3;
    struct imp_hit met;
    if (!p->stands || !(fabs(imp__dot(at->ng, l->d)) > 0.2)) return;
    if (p->s->geometry == IMP_TRIANGLES &&
        (hit->u < border || hit->v < border || hit->u + hit->v > 1 - border))
        return;
    const double from = fmax(hit->t - piece, 0);
    a->asked++;
    a->unmet += !imp__intersect(p->scene, &l->o, &l->d, from, hit->t + piece, &met) ||
                !imp__occluded(p->scene, &l->o, &l->d, from, hit->t + piece);
}

/* Curves are met in float, the less exactly the more the line grazes them. */
static bool is_sane(const struct imp__probe *p, const struct imp__chord *l,
                    const struct imp_hit *hit, const struct imp_surface *at)
{
    const double cosine = fabs(imp__dot(at->ng, l->d));
    const double slack =
        (p->s->geometry == IMP_CURVES ? 1e-5 / fmax(cosine, 0.01) : 1e-6) * p->scale;
    return imp__is_finite(at->p) && imp__is_finite(at->ng) && imp__is_finite(at->n) &&
           imp__is_finite(at->dp_du) && imp__is_finite(at->dp_dv) &&
           isfinite(at->uv[0]) && isfinite(at->uv[1]) &&
           largest(at->p - (l->o + l->d * hit->t)) < slack;
}

static void hit_look(const struct imp__probe *p, const struct imp__chord *l,
                     const struct imp_hit *hit, double from, struct look *a)
{
    const struct imp_shape *s = p->s;
    struct imp_surface at;
    imp__probe_surface(p, hit, l, &at);
    const bool sane = is_sane(p, l, hit, &at);
    a->n++;
    a->bad += !sane || !is_nearest(p, l, hit, from);
    if (!sane) return;
    const bool unit = fabs(imp__dot(at.ng, at.ng) - 1) < 1e-6 && is_frame(&at) &&
                      (s->smooth || imp__dot(at.n, at.ng) > 0);
    a->skew += !unit;
    a->near++;
    a->outside += imp__shape_outside(p, at.p);
    if (unit) neighbours_look(p, l, hit, &at, a);
    place_look(p, &at, a);
    scene_look(p, l, hit, &at, a);
}

bool imp__shape_outside(const struct imp__probe *p, imp_v3 x)
{
    const double slack = 1e-6 * p->scale;
    for (int i = 0; i < 3; i++)
        if (!(x[i] >= p->s->lo[i] - slack && x[i] <= p->s->hi[i] + slack)) return true;
    return false;
}

/* ---- Sides --------------------------------------------------------------------------- */

/* Does the map that put it where it is exchange left and right? Without `placed`: no. */
static bool is_mirrored(const struct imp_shape *s)
{
    double m[12];
    if (!s->ops->placed || !s->ops->placed((struct imp_shape *)(uintptr_t)s, m, false))
        return false;
    const struct imp_mat4 map = imp__mat4_of_rows(m);
    return imp__mat4_det3(&map) < 0;
}

/* Lines enter and leave a closed shape in turn, and its normals point out of it, unless it is
 * mirrored or turned by flip_normals, but not both. */
static void sides_look(const struct imp__probe *p, const struct imp__chord *l,
                       const struct imp_hit *hit, int n, bool inwards, struct look *a)
{
    a->odd += n % 2;
    for (int k = 0; k < n; k++) {
        struct imp_surface at;
        imp__probe_surface(p, &hit[k], l, &at);
        const bool enters = k % 2 == 0, against = imp__dot(at.ng, l->d) < 0;
        if (enters == (against != inwards)) a->front++;
        else a->behind++;
    }
}

/* ---- Moves ---------------------------------------------------------------------------- */

/* Is a crossing of the shape, moved by the map, one of `copy` by the moved line? */
static bool goes_along(const struct imp__probe *p, struct imp_shape *copy,
                       const double map[12], const struct imp__chord *l,
                       const struct imp_hit *hit)
{
    const struct imp__probe there = {p->scene, copy,     false,       p->centre,
                                     p->half,  p->reach, 4 * p->scale};
    struct imp__chord moved = *l;
    struct imp_hit again;
    struct imp_surface was, is;
    int rank;
    moved.o = imp__rows_point(map, l->o);
    moved.d = imp__rows_vector(map, l->d);
    if (!imp__probe_hit(&there, &moved, hit->t, 1e-6 * there.scale, &again, &rank))
        return false;
    imp__probe_surface(p, hit, l, &was);
    imp__probe_surface(&there, &again, &moved, &is);
    const double du = fabs(is.uv[0] - was.uv[0]), dv = fabs(is.uv[1] - was.uv[1]);
    return largest(is.p - imp__rows_point(map, was.p)) < 1e-6 * there.scale &&
           imp__dot(is.ng, imp__rows_vector(map, was.ng)) > 1 - 1e-6 &&
           fabs(du - rint(du)) < 1e-5 && fabs(dv - rint(dv)) < 1e-5 &&
           !imp__shape_outside(&there, is.p) && fabs(copy->area / p->s->area - 1) < 1e-9;
}

/* Copies of the shape are moved by a turn and a shift, by `move` and by `placed`; the shape itself
 * stays. Triangles, whose vertices lie outside of `self`, are left out. */
static enum imp_status moves_look(struct imp__selftest *t, const struct imp__probe *p,
                                  struct look *a)
{
    const struct imp_shape *s = p->s;
    if (s->geometry != IMP_ANALYTIC || !s->ops->move) return IMP_OK;
    struct imp_shape copy[2] = {*s, *s};
    /* Alignment is that of `self`. */
    const size_t size = (imp_max(s->ops->object_size, (size_t)1) + 63) / 64 * 64;
    char *selves = imp__alloc(t->ctx, 2, size);
    if (!selves) return imp__error(t->ctx, IMP_E_NOMEM, "no memory for a self-test");
    const imp_v3 axis = imp__selftest_direction(5, t->options.seed);
    const struct imp_mat4 turn = imp__rotate(axis, 37);
    double map[12], world[12];
    memcpy(map, turn.m, sizeof map);
    for (int i = 0; i < 3; i++) map[4 * i + 3] += (0.5 + 0.25 * i) * p->reach;
    for (int k = 0; k < 2; k++) {
        copy[k].self = selves + (size_t)k * size;
        memcpy(copy[k].self, s->self, s->ops->object_size);
    }
    s->ops->move(&copy[0], map);
    const bool placed = s->ops->placed && s->ops->placed(&copy[1], world, false);
    if (placed) {
        const struct imp_mat4 by = imp__mat4_of_rows(map), was = imp__mat4_of_rows(world);
        struct imp_mat4 now = imp__mat4_multiply(&by, &was);
        a->placed += !s->ops->placed(&copy[1], now.m, true);
    }
    for (int k = 0; k < LOOKED; k++) {
        const struct imp__chord l =
            imp__probe_line(p, imp__key(t->options.seed, 52, (uint64_t)k));
        struct imp_hit hit[IMP_CROSSINGS_MAX];
        const int n = imp__probe_crossings(p, &l, hit);
        for (int i = 0; i < n; i++) {
            a->moved++;
            a->left += !goes_along(p, &copy[0], map, &l, &hit[i]);
            if (placed) a->placed += !goes_along(p, &copy[1], map, &l, &hit[i]);
        }
    }
    imp__release(t->ctx, selves);
    return IMP_OK;
}

/* ---- Rows ------------------------------------------------------------------------------ */

static enum imp_status looks(struct imp__selftest *t, const struct imp__probe *p,
                             struct look *a)
{
    const int most = (int)fmin(LOOKED, imp__probe_most(p) / 5);
    const bool inwards = is_mirrored(p->s) != p->s->flip_normals;
    for (int k = 0; k < 50 * most && a->n < most; k++) {
        const struct imp__chord l =
            imp__probe_line(p, imp__key(t->options.seed, 51, (uint64_t)k));
        struct imp_hit hit[IMP_CROSSINGS_MAX];
        const int n = imp__probe_crossings(p, &l, hit);
        for (int i = 0; i < n; i++)
            hit_look(p, &l, &hit[i], i ? hit[i - 1].t + 1e-9 * p->scale : 0, a);
        sides_look(p, &l, hit, n, inwards, a);
    }
    return moves_look(t, p, a);
}

static enum imp_status shape(struct imp__selftest *t, const struct imp_shape *s,
                             bool stands)
{
    enum imp_status st = IMP_OK;
    const char *name = s->name, *kind = s->ops->name;
    struct imp__probe p;
    struct look a = {0};
    if (s->geometry == IMP_CURVES && !stands) return IMP_OK;
    if (!imp__probe_set(&p, t->scene, s, stands))
        return imp__selftest_count(t, name, kind, "box", 1, 1);
    IMP_TRY(looks(t, &p, &a));
    IMP_TRY(imp__selftest_count(t, name, kind, "hits", a.bad + (a.n == 0), a.n));
    if (a.bad > 0 || a.n == 0) return IMP_OK;
    IMP_TRY(imp__selftest_count(t, name, kind, "normal", a.skew, a.near));
    if (a.mapped > 0)
        IMP_TRY(imp__selftest_count(t, name, kind, "uv", a.astray, a.mapped));
    if (s->geometry == IMP_ANALYTIC && a.odd == 0)
        IMP_TRY(
            imp__selftest_count(t, name, kind, "sides", a.behind, a.front + a.behind));
    IMP_TRY(imp__selftest_count(t, name, kind, "box", a.outside, a.n));
    if (p.stands) IMP_TRY(imp__selftest_count(t, name, kind, "met", a.unmet, a.asked));
    if (a.moved > 0)
        IMP_TRY(imp__selftest_count(t, name, kind, "moves", a.left + a.placed, a.moved));
    if (s->geometry != IMP_CURVES) IMP_TRY(imp__selftest_points(t, &p));
out:
    return st;
}

enum imp_status imp__selftest_shapes(struct imp__selftest *t)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = t->scene;
    for (int k = 0; k < scene->n_shapes; k++)
        IMP_TRY(shape(t, scene->shapes[k], !imp__shape_is_absent(scene->shapes[k])));
    for (int g = 0; g < scene->n_groups; g++)
        for (int k = 0; k < scene->groups[g]->n_shapes; k++)
            IMP_TRY(shape(t, scene->shapes[scene->groups[g]->first + k], false));
out:
    return st;
}
