/* SPDX-License-Identifier: Apache-2.0
 *
 * Segments through media while a walk is decided, and the way to its light samples. */
#include "tracking.h"
#include "flight.h"
#include "scene/instances.h"

/* ---- Segments ---------------------------------------------------------------------- */

/* Go from a surface to the side that d points to, in a nest without the surface. False:
 * the walk is dropped. */
static bool side_take(struct imp_step *s, const struct imp_shape *shape, imp_v3 ng,
                      imp_v3 d, struct imp_nest *nest, const struct imp_medium **medium)
{
    if (imp_likely(s->scene->priorities == NULL)) {
        *medium = imp__medium_beyond(shape, ng, d, *medium);
        return true;
    }
    if (!shape || shape->priority == 0) {
        nest->around = imp__medium_beyond(shape, ng, d, nest->around);
    } else if (imp__dot(ng, d) < 0 && !imp__nest_enter(nest, shape->index)) {
        s->walk->dropped = IMP_DROP_MEDIUM;
        return false;
    }
    *medium = imp__nest_medium(s->scene, nest);
    return true;
}

/* A surface that a ray passes as if it were not there, though media may change. */
static bool is_passed(const struct imp_scene *scene, const struct imp_shape *shape)
{
    return imp__shape_bsdf(scene, shape)->flags & IMP_BSDF_NULL;
}

/* Is the ray in the medium that should be behind it here? */
static bool consistent(const struct imp_step *s, const struct imp_shape *shape, imp_v3 ng,
                       imp_v3 d, const struct imp_nest *nest, const struct imp_medium *m)
{
    if (imp_unlikely(shape->priority > 0))
        return (imp__dot(ng, d) < 0) != imp__nest_has(nest, shape->index);
    if (imp_unlikely(s->scene->priorities != NULL)) m = nest->around;
    return s->scene->media_open || imp__medium_beyond(shape, ng, -d, m) == m;
}

/* A ray arrives at a surface with a priority, which is taken out of its nest: is another
 * shape there? */
static bool hidden(const struct imp_step *s, const struct imp_shape *shape, imp_v3 ng,
                   imp_v3 d, struct imp_nest *nest)
{
    if (imp__dot(ng, d) > 0) imp__nest_leave(nest, shape->index);
    return !imp__nest_sees(s->scene, nest, shape);
}

/* Entered while it is in the nest already, the shape is there more than once. */
static bool is_copy(const struct imp_shape *shape, imp_v3 ng, imp_v3 d)
{
    return shape->priority > 0 && imp__dot(ng, d) < 0;
}

bool imp__nest_begin(struct imp_step *s, const struct imp_medium *around, imp_v3 p,
                     imp_v3 d)
{
    struct imp_nest nest = {.around = around};
    if (!imp__nest_at(s->scene, s->walk->time, p, d, &nest)) {
        s->walk->dropped = IMP_DROP_MEDIUM;
        return false;
    }
    s->flight.nest = s->flight.nest_here = nest;
    s->flight.medium = s->flight.here = imp__nest_medium(s->scene, &nest);
    return true;
}

static bool begin(struct imp_step *s)
{
    const struct imp_medium *around = s->tracer->sensor->medium;
    s->flight.medium = s->flight.here = around;
    if (imp_unlikely(s->scene->priorities != NULL) &&
        !imp__nest_begin(s, around, s->o, s->d))
        return false;
    return imp__sensor_vertex(s);
}

static enum imp_meeting collision(struct imp_step *s, const struct imp_medium *m,
                                  imp_v3 p, double t)
{
    s->flight.here = m;
    s->flight.nest_here = s->flight.nest;
    s->flight.at = p;
    s->flight.t = t;
    return IMP_MEETS_MEDIUM;
}

/* The step that led here has crossed media. */
static void pass(struct imp_step *s, const struct imp_free_flight *w)
{
    struct imp_vertex *from = s->walk->last;
    if (!w->any) return;
    const double factor = imp__lane_mis_decide(s, w->p);
    imp__step_pass(from, w->f * factor);
    s->beta *= w->p * factor; /* it ends no walk for what is 0 and may grow */
    if (!s->recorded) return;
    from->d.passes = (imp_decided)factor;
    from->on = w->track;
}

/* What a ray in medium m has met. */
struct surface_ahead {
    const struct imp_shape *shape;
    struct imp_surface at; /* unless plain */
    bool plain;            /* it has nothing to do with media */
    bool passes;           /* as if it were not there */
    bool left;             /* the ray has left it already */
    bool wrong;            /* the ray is not in the medium that should be before it */
};
static void look(const struct imp_step *s, imp_v3 d, bool hide, const struct imp_hit *hit,
                 const struct imp_nest *nest, const struct imp_medium *m, int passed,
                 struct surface_ahead *a)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_shape *shape = a->shape = scene->shapes[hit->shape];
    a->passes = is_passed(scene, shape) || (hide && shape->emitter >= 0);
    a->left = a->wrong = false;
    a->plain = !a->passes && !shape->interior && !shape->exterior && shape->priority == 0;
    if (a->plain) return;
    imp__hit_surface(scene, hit, &s->o, &d, &a->at);
    const bool wrong = !consistent(s, shape, a->at.ng, d, nest, m);
    a->left = wrong && hit->t <= 2 * s->flight.behind && !passed;
    a->wrong = wrong && !a->left && !is_copy(shape, a->at.ng, d);
}

/* Where a ray grazes an edge of a mesh, Embree may meet its two sides in the wrong order, or
 * one of them alone: they lie within its rounding. A ray that starts close before them has
 * digits enough to tell. What it meets is looked at in place of *hit; if that is nothing,
 * the ray passes beside the edge. */
static void look_closely(const struct imp_step *s, imp_v3 d, bool hide,
                         struct imp_hit *hit, const struct imp_nest *nest,
                         const struct imp_medium *m, int passed, struct surface_ahead *a)
{
    const imp_v3 p = s->o + d * hit->t;
    const double back = imp_min(imp__begins_behind(p) + hit->t * IMP_RAY_EPSILON, hit->t);
    const imp_v3 from = s->o + d * (hit->t - back);
    struct imp_hit first;
    if (!imp__intersect_at(s->scene, s->walk->time, &from, &d, 0, 2 * back, &first)) {
        a->left = a->passes = true;
        a->wrong = false;
        return;
    }
    first.t += hit->t - back;
    *hit = first;
    look(s, d, hide, hit, nest, m, passed, a);
}

enum imp_passing imp__surface_ahead(struct imp_step *s, bool hide, int passed,
                                    struct imp_hit *hit)
{
    const imp_v3 d = s->d;
    struct surface_ahead a;
    struct imp_nest *nest = &s->flight.nest_here;
    const struct imp_medium *m = s->flight.here;
    look(s, d, hide, hit, nest, m, passed, &a);
    if (imp_unlikely(a.wrong)) look_closely(s, d, hide, hit, nest, m, passed, &a);
    if (a.plain) return IMP_PASSING_ENDS;
    if (a.wrong) {
        s->walk->dropped = IMP_DROP_MEDIUM;
        return IMP_PASSING_DROPS;
    }
    bool passes = a.passes;
    if (imp_unlikely(a.shape->priority > 0) && !a.left)
        passes |= hidden(s, a.shape, a.at.ng, d, nest);
    if (!passes && !a.left) return IMP_PASSING_ENDS;
    if (passed == IMP_WALK_MAX) {
        s->walk->dropped = IMP_DROP_LONG;
        return IMP_PASSING_DROPS;
    }
    if (!a.left && !side_take(s, a.shape, a.at.ng, d, nest, &s->flight.medium))
        return IMP_PASSING_DROPS;
    if (imp_unlikely(s->scene->priorities != NULL)) s->flight.nest = *nest;
    s->o = imp__offset(a.at.p, a.at.ng, d);
    s->t_min = 0;
    return IMP_PASSING_GOES_ON;
}

static enum imp_meeting meet(struct imp_step *s, struct imp_hit *hit)
{
    const struct imp_scene *scene = s->scene;
    const bool hide = s->tracer->integrator->hide_emitters && imp__bounces(s) == 0;
    const imp_v3 start = s->o, d = s->d;
    enum imp_meeting met = IMP_MEETS_NOTHING;
    struct imp_free_flight w = imp__flight_from(s, start, d, IMP_FLIGHT_ALONG);
    double t, t_max = s->t_max, base = 0;
    for (int passed = 0;; passed++) {
        const struct imp_medium *m = s->flight.medium;
        const double near = passed ? base : imp_max(s->t_min, s->flight.behind),
                     reach = m ? imp__flight_reach(&w, m, near) - base : INFINITY;
        const bool found = imp__intersect_at(scene, s->walk->time, &s->o, &d, s->t_min,
                                             imp_min(t_max, reach), hit);
        const double far = base + (found ? hit->t : t_max);
        s->flight.base = base;
        w.open = !found;
        if (m && imp__fly(&w, m, near, far, true, &t)) {
            met = collision(s, m, s->o + d * (t - base), t);
            break;
        }
        if (s->walk->dropped) return IMP_MEETS_DROP;
        s->flight.here = m;
        if (imp_unlikely(scene->priorities != NULL)) s->flight.nest_here = s->flight.nest;
        if (!found) break;

        /* A surface: does the ray end there, and what is behind it? */
        const enum imp_passing ahead = imp__surface_ahead(s, hide, passed, hit);
        if (ahead == IMP_PASSING_DROPS) return IMP_MEETS_DROP;
        if (ahead == IMP_PASSING_ENDS) {
            met = IMP_MEETS_SURFACE;
            break;
        }
        base = imp__dot(s->o - start, d);
        t_max -= hit->t;
    }
    pass(s, &w);
    return met;
}

static bool arrive(struct imp_step *s, struct imp_vertex *v, struct imp_hit *hit,
                   struct imp_surface *at)
{
    (void)hit, (void)at;
    v->t += s->flight.base;
    return true;
}

static void leave(struct imp_step *s, const struct imp_vertex *v,
                  const struct imp_surface *at)
{
    s->flight.medium = s->flight.here;
    s->flight.nest = s->flight.nest_here;
    side_take(s, v->shape, at->ng, s->d, &s->flight.nest, &s->flight.medium);
    s->flight.behind = v->shape ? 0 : imp__begins_behind(at->p);
    s->o -= s->d * s->flight.behind;
}

/* ---- To light samples ---------------------------------------------------------------- */

/* Past a surface that lets a part go straight on. False: nothing, or no memory. */
static bool go_through(struct imp_free_flight *w, const struct imp_shape *shape, int prim,
                       const struct imp_surface *at)
{
    struct imp_step *s = w->s;
    const struct imp_bsdf *b = imp__shape_bsdf(s->scene, shape);
    struct imp_track here;
    const struct imp_event e[2] = {{.t = (imp_decided)imp__dot(at->p - w->o, w->d),
                                    .bound = (imp_decided)-imp__dot(at->n, w->d),
                                    .medium = shape->index,
                                    .kind = IMP_PASSES},
                                   {.t = (imp_decided)at->uv[0],
                                    .bound = (imp_decided)at->uv[1],
                                    .medium = prim,
                                    .kind = IMP_PASSES_UV}};
    imp__store_v3(here.o, w->o);
    imp__store_v3(here.d, w->d);
    const imp_spec f = imp__passes_eval(s->scene, &here, e, s->at.carried);
    if (imp__is_zero_used(f, s->at.carried) && !imp__wants_derivative(s, b)) return false;
    w->f *= f;
    return imp__flight_event(w, e[0]) && imp__flight_event(w, e[1]);
}

/* The light sample of v is seen. */
static bool arrived(struct imp_free_flight *w, struct imp_vertex *v, imp_spec *T)
{
    if (!imp__flight_end(w)) return false;
    *T = w->f;
    if (w->s->recorded) v->to_light = w->track;
    return true;
}

/* A surface on the way to a light sample. */
enum in_way {
    IN_WAY_CLOSED,
    IN_WAY_WRONG,    /* the ray is not in the medium that should be before it */
    IN_WAY_LEFT,     /* the ray has left it already */
    IN_WAY_HOLE,     /* passed as if it were not there, though media may change */
    IN_WAY_STRAIGHT, /* it lets a part go straight on */
};

/* from: where the ray from o along d began, it may have left the surface already. at: set
 * unless it is closed. */
static enum in_way in_way(const struct imp_step *s, const struct imp_hit *hit, imp_v3 o,
                          imp_v3 d, bool from, const struct imp_medium *m,
                          struct imp_nest *nest, struct imp_surface *at)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_shape *shape = scene->shapes[hit->shape];
    const bool straight = imp__shape_bsdf(scene, shape)->straight;
    const bool ranks = shape->priority > 0;
    bool hole = is_passed(scene, shape);
    if (!hole && !ranks && !straight) return IN_WAY_CLOSED;
    imp__hit_surface(scene, hit, &o, &d, at);
    if (imp_unlikely(ranks)) {
        const bool wrong = !consistent(s, shape, at->ng, d, nest, m);
        if (wrong && from) return IN_WAY_LEFT;
        if (wrong && !is_copy(shape, at->ng, d)) return IN_WAY_WRONG;
        hole |= hidden(s, shape, at->ng, d, nest);
    }
    return hole ? IN_WAY_HOLE : straight ? IN_WAY_STRAIGHT : IN_WAY_CLOSED;
}

static bool sees(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *from,
                 const struct imp_shadow *shadow, imp_spec *T)
{
    const double length = imp__length(shadow->d);
    const imp_v3 d = shadow->d * (1 / length);
    const double back = imp__is_zero(from->ng) ? imp__begins_behind(from->p) : 0;
    const imp_v3 start = shadow->o - d * back;
    const double end = shadow->reach * length + back;
    const struct imp_medium *m = s->flight.here;
    struct imp_nest nest = s->flight.nest_here;
    struct imp_free_flight w = imp__flight_from(s, start, d, IMP_FLIGHT_TO_LIGHT);
    imp_v3 o = start;
    double t, base = 0;
    if (!side_take(s, v->shape, from->ng, d, &nest, &m)) return false;
    for (int passed = 0; passed <= IMP_WALK_MAX; passed++) {
        struct imp_hit hit;
        struct imp_surface at;
        enum in_way surface = IN_WAY_HOLE;
        const bool found =
            imp__intersect_at(s->scene, s->walk->time, &o, &d, 0, end - base, &hit);
        if (found) {
            const bool at_start = !passed && hit.t <= 2 * back;
            surface = in_way(s, &hit, o, d, at_start, m, &nest, &at);
        }
        if (surface == IN_WAY_WRONG) s->walk->dropped = IMP_DROP_MEDIUM;
        if (surface == IN_WAY_WRONG || surface == IN_WAY_CLOSED) return false;

        /* The medium before it, and what is behind it. */
        if (m)
            imp__fly(&w, m, passed ? base : back, found ? base + hit.t : end, false, &t);
        if (s->walk->dropped) return false;
        if (!found) return arrived(&w, v, T);
        const struct imp_shape *shape = s->scene->shapes[hit.shape];
        if (surface == IN_WAY_STRAIGHT && !go_through(&w, shape, hit.prim, &at))
            return false;
        if (surface != IN_WAY_LEFT && !side_take(s, shape, at.ng, d, &nest, &m))
            return false;
        o = imp__offset(at.p, at.ng, d);
        base = imp__dot(o - start, d);
        if (!(base < end)) /* the last boundary lies within rounding of the light */
            return arrived(&w, v, T);
    }
    s->walk->dropped = IMP_DROP_LONG;
    return false;
}

const struct imp_segment_ops imp__tracking = {.name = "tracking",
                                              .connects = true,
                                              .through = true,
                                              .begin = begin,
                                              .meet = meet,
                                              .arrive = arrive,
                                              .leave = leave,
                                              .sees = sees};
