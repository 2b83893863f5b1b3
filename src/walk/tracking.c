/* SPDX-License-Identifier: Apache-2.0
 *
 * Flights through media while a walk is decided, and the way to its light samples. */
#include "tracking.h"
#include "probe.h"
#include "scene/instances.h"
#include "scene/majorants.h"

/* A ray through media, from its start. */
struct flight {
    struct imp_step *s;
    struct imp_key key;      /* of its own random numbers */
    uint32_t n;              /* of them used */
    imp_v3 o, d;             /* as decided: where extinction is looked up */
    imp_spec f;              /* the segment's value */
    struct imp_track *track; /* NULL: not kept */
    bool any;                /* it has crossed a medium */
    struct imp_event line;   /* IMP_LINE_AT so far; bound 0: none */
    double length;           /* of the stretches that it was chosen from */
};

static double uniform(struct flight *w) { return imp__u01(w->key, w->n++); }
static double free_path(struct flight *w) { return -log1p(-uniform(w)); }

enum {
    ALONG_WALK = 0x7001,
    TO_LIGHT,
    ON_LINE
}; /* streams of random numbers of a vertex */

static struct flight flight_from(struct imp_step *s, imp_v3 o, imp_v3 d, int stream)
{
    return (struct flight){.s = s,
                           .key = imp__key_branch(s->walk->key, s->depth, stream),
                           .o = imp__decide(o),
                           .d = imp__decide(d),
                           .f = imp__spec(1)};
}

/* What a flight has done is kept where the walk is. */
static bool event_add(struct flight *w, struct imp_event e)
{
    struct imp_step *s = w->s;
    struct imp_track *k = w->track;
    w->any = true;
    if (!s->recorded) return true;
    if (!k) {
        k = w->track = imp__arena_take(s->arena, 1, sizeof *k);
        if (!k) goto no_memory;
        *k = (struct imp_track){.n = 0};
        imp__store_v3(k->o, w->o);
        imp__store_v3(k->d, w->d);
    }
    if (k->n == k->cap) {
        const int cap = k->cap ? 2 * k->cap : 2;
        struct imp_event *more = imp__arena_take(s->arena, (size_t)cap, sizeof *more);
        if (!more) goto no_memory;
        for (int i = 0; i < k->n; i++) more[i] = k->event[i];
        k->event = more;
        k->cap = cap;
    }
    k->event[k->n++] = e;
    return true;
no_memory:
    s->walk->dropped = IMP_DROP_MEMORY;
    return false;
}

/* ---- Media of uniform extinction --------------------------------------------------- */

#define DEEP 0.5 /* optical depth from which on a stretch stands */

static bool uniform_fly(struct flight *w, const struct imp_medium *m, double near,
                        double far, bool collides, double *t, bool *stands)
{
    imp_spec in[IMP_INPUTS_MAX];
    const imp_spec sigma = imp__extinction_at(m, w->o, w->s->at.carried, in);
    double length = far - near, sum = 0;
    bool hit = false;
    for (int c = 0; c < imp__lane_mis_count(w->s); c++) sum += sigma[c];
    *stands = collides && sum * length >= DEEP * imp__lane_mis_count(w->s);
    if (collides) {
        const double path = free_path(w), mine = sigma[imp__lane_mis_drew(w->s)];
        hit = mine > 0 && path < length * mine;
        if (hit) length = path / mine;
    }
    *t = near + length;
    length = imp__decide1(length);
    const imp_spec T = imp__attenuation(sigma, length);
    w->f *= hit ? sigma * T : T;
    event_add(w, (struct imp_event){.t = (imp_decided)length,
                                    .bound = *stands,
                                    .medium = m->index,
                                    .kind = hit ? IMP_COLLIDES : IMP_CROSSES});
    return hit;
}

/* ---- Media whose extinction varies -------------------------------------------------- */

/* A tentative collision at t. Real, by the lane that draws? */
static bool collide(struct flight *w, const struct imp_medium *m, double t, double bound,
                    bool collides)
{
    struct imp_step *s = w->s;
    imp_spec in[IMP_INPUTS_MAX];
    const imp_spec sigma =
        imp__extinction_at(m, w->o + w->d * t, s->at.carried, in) * (1 / bound);
    for (int c = 0; c < imp__lane_mis_count(s); c++)
        if (!(sigma[c] >= 0 && sigma[c] <= 1)) {
            s->walk->dropped = IMP_DROP_MAJORANT;
            return true;
        }
    const bool real = collides && uniform(w) < sigma[imp__lane_mis_drew(s)];
    w->f *= real ? sigma : 1 - sigma;
    event_add(w, (struct imp_event){.t = (imp_decided)t,
                                    .bound = (imp_decided)bound,
                                    .medium = m->index,
                                    .kind = real ? IMP_REAL_AT : IMP_NULL_AT});
    return real;
}

/* Tentative collisions with the density of the local bound, one after another. */
static bool varying_fly(struct flight *w, const struct imp_medium *m,
                        struct imp_majorant_walk *cells, bool collides, double *t)
{
    double path = free_path(w), at = cells->t;
    for (;;) {
        const double room = (cells->leave - at) * cells->bound;
        if (!(path < room)) {
            path -= room;
            if (!imp__majorants_next(cells)) return false;
            at = cells->t;
            continue;
        }
        at += path / cells->bound;
        path = free_path(w);
        const bool real = collide(w, m, imp__decide1(at), cells->bound, collides);
        if (w->s->walk->dropped) return false;
        if (!real) continue;
        *t = at;
        return true;
    }
}

/* The way to a light sample is in m from near to far: a point of it is chosen for the
 * derivative of its transmittance, which tentative collisions do not have where the bound
 * is 0. */
static void line_offer(struct flight *w, const struct imp_medium *m, double near,
                       double far)
{
    const struct imp_step *s = w->s;
    const struct imp_key key = imp__key_branch(s->walk->key, s->depth, ON_LINE);
    const double length = far - near;
    const uint32_t n = 2 * (uint32_t)w->line.kind; /* stretches so far */
    w->length += length;
    w->line.kind++;
    if (!(imp__u01(key, n) * w->length < length)) return;
    w->line.t = (imp_decided)(near + length * imp__u01(key, n + 1));
    w->line.medium = m->index;
}
static bool line_add(struct flight *w)
{
    struct imp_event e = w->line;
    if (e.kind == 0) return true;
    e.kind = IMP_LINE_AT;
    e.bound = (imp_decided)w->length;
    return event_add(w, e);
}

/* From near to far in a medium; true: a collision at *t. */
static bool fly(struct flight *w, const struct imp_medium *m, double near, double far,
                bool collides, double *t)
{
    struct imp_step *s = w->s;
    struct imp_majorant_walk cells;
    const imp_spec before = w->f;
    const int first = w->track ? w->track->n : 0;
    bool hit, stands = false;
    if (!(near < far)) return false;
    if (!m->majorants) {
        hit = uniform_fly(w, m, near, far, collides, t, &stands);
    } else {
        if (!imp__majorants_enter(m->majorants, w->o, w->d, near, far, &cells))
            return false;
        near = cells.t;
        far = cells.end;
        hit = varying_fly(w, m, &cells, collides, t);
        if (!collides && s->probing && s->tracer->active->medium[m->index])
            line_offer(w, m, near, far);
        /* A probe asks for a track, and an empty one has its start. */
        if (!w->track && s->probing && collides) {
            event_add(w, (struct imp_event){.t = 0});
            if (w->track) w->track->n = 0;
        }
    }
    if (s->walk->dropped) return false;
    if (collides) s->flight.stands = stands;
    if (collides && !stands && s->probing && s->tracer->active->medium[m->index])
        imp__probe_offer(s, m, w->track, first, before, near, hit ? *t : far);
    return hit;
}

/* ---- Segments ---------------------------------------------------------------------- */

/* The medium on the side of the surface that d points to. */
static const struct imp_medium *beyond(const struct imp_shape *shape, imp_v3 ng, imp_v3 d,
                                       const struct imp_medium *here)
{
    if (!shape || (!shape->interior && !shape->exterior)) return here;
    return imp__dot(ng, d) < 0 ? shape->interior : shape->exterior;
}

/* Rays from a point of a medium begin a little behind it: a boundary as near as Embree's
 * rounding is met then, and met from its wrong side it is not there. */
static double behind(imp_v3 p)
{
    return (1 + fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2])))) * IMP_RAY_EPSILON;
}

/* A surface that a ray passes as if it were not there, though media may change. */
static bool is_passed(const struct imp_scene *scene, const struct imp_shape *shape)
{
    return imp__shape_bsdf(scene, shape)->flags & IMP_BSDF_NULL;
}

/* Is the ray in the medium that should be behind it here? */
static bool consistent(const struct imp_step *s, const struct imp_shape *shape, imp_v3 ng,
                       imp_v3 d, const struct imp_medium *m)
{
    return s->scene->media_open || beyond(shape, ng, -d, m) == m;
}

static bool begin(struct imp_step *s)
{
    s->flight.medium = s->flight.here = s->tracer->sensor->medium;
    return imp__sensor_vertex(s);
}

static enum imp_meeting collision(struct imp_step *s, const struct imp_medium *m,
                                  imp_v3 p, double t)
{
    s->flight.here = m;
    s->flight.at = p;
    s->flight.t = t;
    return IMP_MEETS_MEDIUM;
}

/* The step that led here has crossed media. */
static void pass(struct imp_step *s, const struct flight *w)
{
    struct imp_vertex *from = s->walk->last;
    if (!w->any) return;
    const double factor = imp__lane_mis_decide(s, w->f);
    const imp_spec weight = w->f * factor;
    imp__step_pass(from, weight);
    s->beta *= weight;
    if (!s->recorded) return;
    from->d.passes = (imp_decided)factor;
    from->on = w->track;
}

static enum imp_meeting meet(struct imp_step *s, struct imp_hit *hit)
{
    const struct imp_scene *scene = s->scene;
    const bool hide = s->tracer->integrator->hide_emitters && imp__bounces(s) == 0;
    const imp_v3 start = s->o, d = s->d;
    enum imp_meeting met = IMP_MEETS_NOTHING;
    struct flight w = flight_from(s, start, d, ALONG_WALK);
    double t, t_max = s->t_max, base = 0;
    for (int passed = 0;; passed++) {
        const bool found =
            imp__intersect_at(scene, s->walk->time, &s->o, &d, s->t_min, t_max, hit);
        const double near = passed ? base : fmax(s->t_min, s->flight.behind),
                     far = base + (found ? hit->t : t_max);
        const struct imp_medium *m = s->flight.medium;
        s->flight.base = base;
        if (m && fly(&w, m, near, far, true, &t)) {
            met = collision(s, m, s->o + d * (t - base), t);
            break;
        }
        if (s->walk->dropped) return IMP_MEETS_DROP;
        s->flight.here = m;
        if (!found) break;

        /* A surface: does the ray end there, and what is behind it? */
        const struct imp_shape *shape = scene->shapes[hit->shape];
        const bool passes = is_passed(scene, shape) || (hide && shape->emitter >= 0);
        if (!passes && !shape->interior && !shape->exterior) {
            met = IMP_MEETS_SURFACE;
            break;
        }
        struct imp_surface at;
        imp__hit_surface(scene, hit, &s->o, &d, &at);
        const bool wrong = !consistent(s, shape, at.ng, d, m);
        const bool left = wrong && hit->t <= 2 * s->flight.behind && !passed;
        if (wrong && !left) {
            s->walk->dropped = IMP_DROP_MEDIUM;
            return IMP_MEETS_DROP;
        }
        if (!passes && !left) {
            met = IMP_MEETS_SURFACE;
            break;
        }
        if (passed == IMP_WALK_MAX) {
            s->walk->dropped = IMP_DROP_LONG;
            return IMP_MEETS_DROP;
        }
        if (!left) s->flight.medium = beyond(shape, at.ng, d, m);
        s->o = imp__offset(at.p, at.ng, d);
        base = imp__dot(s->o - start, d);
        t_max -= hit->t;
        s->t_min = 0;
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
    s->flight.medium = beyond(v->shape, at->ng, s->d, s->flight.here);
    s->flight.behind = v->shape ? 0 : behind(at->p);
    s->o -= s->d * s->flight.behind;
}

/* ---- To light samples ---------------------------------------------------------------- */

/* Past a surface that lets a part go straight on. False: nothing, or no memory. */
static bool go_through(struct flight *w, const struct imp_shape *shape,
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
                                    .kind = IMP_PASSES_UV}};
    imp__store_v3(here.o, w->o);
    imp__store_v3(here.d, w->d);
    const imp_spec f = imp__passes_eval(s->scene, &here, e, s->at.carried);
    if (imp__is_zero_used(f, s->at.carried) && !imp__wants_derivative(s, b)) return false;
    w->f *= f;
    return event_add(w, e[0]) && event_add(w, e[1]);
}

/* The light sample of v is seen. */
static bool arrived(struct flight *w, struct imp_vertex *v, imp_spec *T)
{
    if (!line_add(w)) return false;
    *T = w->f;
    if (w->s->recorded) v->to_light = w->track;
    return true;
}

static bool sees(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *from,
                 const struct imp_shadow *shadow, imp_spec *T)
{
    const struct imp_scene *scene = s->scene;
    const double time = s->walk->time;
    const double length = imp__length(shadow->d);
    const imp_v3 d = shadow->d * (1 / length);
    const double back = v->shape ? 0 : behind(from->p);
    const imp_v3 start = shadow->o - d * back;
    const double end = shadow->reach * length + back;
    const struct imp_medium *m = beyond(v->shape, from->ng, d, s->flight.here);
    struct flight w = flight_from(s, start, d, TO_LIGHT);
    imp_v3 o = start;
    double t, base = 0;
    for (int passed = 0; passed <= IMP_WALK_MAX; passed++) {
        struct imp_hit hit;
        const bool found = imp__intersect_at(scene, time, &o, &d, 0, end - base, &hit);
        const struct imp_shape *shape = found ? scene->shapes[hit.shape] : NULL;
        const bool hole = found && is_passed(scene, shape);
        if (found && !hole && !imp__shape_bsdf(scene, shape)->straight) return false;
        if (m) fly(&w, m, passed ? base : back, found ? base + hit.t : end, false, &t);
        if (s->walk->dropped) return false;
        if (!found) return arrived(&w, v, T);
        struct imp_surface at;
        imp__hit_surface(scene, &hit, &o, &d, &at);
        if (!hole && !go_through(&w, shape, &at)) return false;
        m = beyond(shape, at.ng, d, m);
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
