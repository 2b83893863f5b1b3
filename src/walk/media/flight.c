/* SPDX-License-Identifier: Apache-2.0
 *
 * Free flights through media: closed form where extinction is uniform, delta tracking
 * where it varies. */
#include "flight.h"
#include "math/exp.h"
#include "probe.h"
#include "scene/majorants.h"

static double uniform(struct imp_free_flight *w) { return imp__u01(w->key, w->n++); }
/* 1 - u is exact. */
static double path_by(double u) { return -imp__log_1(1 - u); }
static double free_path(struct imp_free_flight *w) { return path_by(uniform(w)); }

struct imp_free_flight imp__flight_from(struct imp_step *s, imp_v3 o, imp_v3 d,
                                        int stream)
{
    return (struct imp_free_flight){.s = s,
                                    .key =
                                        imp__key_branch(s->walk->key, s->depth, stream),
                                    .o = imp__decide(o),
                                    .d = imp__decide(d),
                                    .f = imp__spec(1),
                                    .p = imp__spec(1)};
}

bool imp__flight_event(struct imp_free_flight *w, struct imp_event e)
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

#define DEEP 0.5 /* least optical depth of a stretch of fixed collisions */
/* ... and that of the scene's radius, for a stretch without an end: all of these are deep,
 * but what light there is to scatter is near the scene. */
#define DEEP_OPEN 0.1

/* A stretch whose collisions are fixed. Lengths are those of all lanes. */
static inline double depth_least(const struct imp_free_flight *w)
{
    return DEEP * imp__lane_mis_count(w->s);
}
static inline double sigma_sum(const struct imp_free_flight *w, imp_spec sigma)
{
    double sum = 0;
    for (int c = 0; c < imp__lane_mis_count(w->s); c++) sum += sigma[c];
    return sum;
}
static inline bool open_is_fixed(const struct imp_free_flight *w, double sum)
{
    return sum * w->s->scene->ball.radius >= DEEP_OPEN * imp__lane_mis_count(w->s);
}

double imp__flight_reach(struct imp_free_flight *w, const struct imp_medium *m,
                         double near)
{
    imp_spec in[IMP_INPUTS_MAX];
    if (m->majorants) return INFINITY;
    w->ahead = m;
    w->sigma = imp__extinction_at(m, w->o, w->s->at.carried, in);
    w->path = path_by(imp__u01(w->key, w->n)); /* uniform_fly counts it */
    const double mine = w->sigma[imp__lane_mis_drew(w->s)], sum = sigma_sum(w, w->sigma);
    if (!(mine > 0)) return INFINITY;
    double length = w->path / mine;
    /* The form of a derivative depends on whether the stretch is deep, too. */
    if (w->s->recorded || w->s->probing) {
        if (!open_is_fixed(w, sum)) return INFINITY;
        length = imp_max(length, depth_least(w) / sum);
    }
    return (near + length) * (1 + IMP_REACH_SLACK) +
           IMP_REACH_SLACK * w->s->scene->ball.radius;
}

static bool uniform_fly(struct imp_free_flight *w, const struct imp_medium *m,
                        double near, double far, bool collides, double *t, bool *fixed)
{
    imp_spec in[IMP_INPUTS_MAX];
    const bool known = collides && w->ahead == m;
    const imp_spec sigma =
        known ? w->sigma : imp__extinction_at(m, w->o, w->s->at.carried, in);
    const double sum = sigma_sum(w, sigma);
    double length = far - near;
    bool hit = false;
    *fixed = collides &&
             (isfinite(far) ? sum * length >= depth_least(w) : open_is_fixed(w, sum));
    if (collides) {
        const double path = known ? w->path : path_by(imp__u01(w->key, w->n)),
                     mine = sigma[imp__lane_mis_drew(w->s)];
        w->n++;
        hit = mine > 0 && path < length * mine;
        if (hit) length = path / mine;
    }
    *t = near + length;
    length = imp__decide1(length);
    const imp_spec T = imp__attenuation(sigma, length);
    const imp_spec value = hit ? sigma * T : T;
    w->f *= value;
    w->p *= value;
    imp__flight_event(w, (struct imp_event){.t = (imp_decided)length,
                                            .bound = *fixed,
                                            .medium = m->index,
                                            .kind = hit ? IMP_COLLIDES : IMP_CROSSES});
    return hit;
}

/* ---- Media whose extinction varies -------------------------------------------------- */

/* All events of a walk; an unbounded extinction would go on for hours. */
#define EVENTS_MAX (1 << 20)

#define EMPTY 0.125 /* of the largest bound, where there is none */

static inline bool has_room(const struct imp_free_flight *w)
{
    return imp_unlikely(w->s->tracer->headroom > 1);
}

/* As a record stores it. */
static double raised(const struct imp_free_flight *w, const struct imp_majorants *g,
                     double bound)
{
    const double h = w->s->tracer->headroom;
    double size = 0;
    if (!has_room(w)) return bound;
    for (int a = 0; a < 3; a++) {
        imp_v3 edge = {0};
        edge[a] = 1;
        size = imp_max(imp__length(imp__vector(&g->to_world, edge)), size);
    }
    const double empty = imp_max(1 / size, EMPTY * (double)g->most);
    return imp__decide1(imp_max(h * bound, (h - 1) * empty));
}

/* Extinction over its bound at a tentative collision. False: the walk is dropped. */
static inline bool tentative(struct imp_free_flight *w, const struct imp_medium *m,
                             double t, double bound, imp_spec *sigma)
{
    struct imp_step *s = w->s;
    imp_spec in[IMP_INPUTS_MAX];
    if (imp_unlikely(s->flight.events++ == EVENTS_MAX)) {
        s->walk->dropped = IMP_DROP_EVENTS;
        return false;
    }
    *sigma = imp__extinction_at(m, w->o + w->d * t, s->at.carried, in) * (1 / bound);
    for (int c = 0; c < imp__lane_mis_count(s); c++)
        if (!((*sigma)[c] >= 0 && (*sigma)[c] <= 1)) {
            s->walk->dropped = IMP_DROP_MAJORANT;
            return false;
        }
    return true;
}

/* A tentative collision at t. Real, by the lane that draws? */
static bool collide(struct imp_free_flight *w, const struct imp_medium *m, double t,
                    double bound, bool collides)
{
    struct imp_step *s = w->s;
    imp_spec sigma;
    if (!tentative(w, m, t, bound, &sigma)) return true;
    imp_spec p = sigma;
    if (has_room(w)) p = imp__greater(p, imp__spec(imp__real_least(s->tracer->headroom)));
    const bool real = collides && uniform(w) < p[imp__lane_mis_drew(s)];
    w->f *= real ? sigma : 1 - sigma;
    w->p *= real ? p : 1 - p;
    imp__flight_event(w, (struct imp_event){.t = (imp_decided)t,
                                            .bound = (imp_decided)bound,
                                            .medium = m->index,
                                            .kind = real ? IMP_REAL_AT : IMP_NULL_AT});
    return real;
}

/* ... on the way to a light sample, decided for each lane. */
static void decide_lanes(struct imp_free_flight *w, const struct imp_medium *m, double t,
                         double bound)
{
    imp_spec sigma, p;
    if (!tentative(w, m, t, bound, &sigma)) return;
    const double u = uniform(w);
    for (int c = 0; c < 4; c++)
        p[c] = u < sigma[c] ? INFINITY : imp__decide1(1 - sigma[c]);
    const struct imp_event e[3] = {
        {.t = (imp_decided)t,
         .bound = (imp_decided)bound,
         .medium = m->index,
         .kind = IMP_DELTA_AT},
        {.t = (imp_decided)p[0], .bound = (imp_decided)p[1], .kind = IMP_DELTA_OF},
        {.t = (imp_decided)p[2], .bound = (imp_decided)p[3], .kind = IMP_DELTA_OF}};
    w->f *= (1 - sigma) * imp__delta_weight(e);
    for (int k = 0; k < 3 && imp__flight_event(w, e[k]); k++) {}
}

/* Tentative collisions with the density of the local bound, one after another. */
static bool varying_fly(struct imp_free_flight *w, const struct imp_medium *m,
                        const struct imp_majorant_walk *from, bool collides, double *t)
{
    struct imp_majorant_walk cells = *from; /* in registers */
    const bool lanes =
        !collides && w->s->tracer->integrator->transmittance == IMP_DELTA_TRACKING;
    double path = free_path(w), at = cells.t;
    cells.bound = raised(w, cells.of, cells.bound);
    for (;;) {
        const double room = (cells.leave - at) * cells.bound;
        if (!(path < room)) {
            path -= room;
            if (!imp__majorants_next(&cells)) return false;
            at = cells.t;
            if (has_room(w)) cells.bound = raised(w, cells.of, cells.bound);
            continue;
        }
        at += path / cells.bound;
        path = free_path(w);
        const double here = imp__decide1(at);
        bool real = false;
        if (imp_unlikely(lanes)) decide_lanes(w, m, here, cells.bound);
        else real = collide(w, m, here, cells.bound, collides);
        if (w->s->walk->dropped) return false;
        if (real) {
            *t = at;
            return true;
        }
        /* No factor that follows changes a transmittance of 0. */
        if (!collides && imp__is_zero_used(w->f, w->s->at.carried)) return false;
    }
}

/* A tentative collision with what the control leaves. */
static bool residual_at(struct imp_free_flight *w, const struct imp_medium *m, double t,
                        double mean, double reach)
{
    struct imp_step *s = w->s;
    imp_spec in[IMP_INPUTS_MAX];
    if (imp_unlikely(s->flight.events++ == EVENTS_MAX)) {
        s->walk->dropped = IMP_DROP_EVENTS;
        return false;
    }
    const imp_spec sigma = imp__extinction_at(m, w->o + w->d * t, s->at.carried, in);
    const struct imp_event e[2] = {{.t = (imp_decided)t,
                                    .bound = (imp_decided)reach,
                                    .medium = m->index,
                                    .kind = IMP_RESIDUAL_AT},
                                   {.t = (imp_decided)mean, .kind = IMP_RESIDUAL_OF}};
    w->f *= imp__residual(sigma, e);
    return imp__flight_event(w, e[0]) && imp__flight_event(w, e[1]) &&
           !imp__is_zero_used(w->f, s->at.carried);
}

/* Residual ratio tracking, cell by cell. */
static void residual_fly(struct imp_free_flight *w, const struct imp_medium *m,
                         struct imp_majorant_walk *cells)
{
    double path = free_path(w);
    do {
        const struct imp_control *c = &m->majorants->control[cells->cell];
        const double mean = c->mean, reach = raised(w, cells->of, c->reach);
        double at = cells->t;
        w->control += mean * (cells->leave - at);
        while (path < (cells->leave - at) * reach) {
            at += path / reach;
            path = free_path(w);
            if (!residual_at(w, m, imp__decide1(at), mean, reach)) return;
        }
        path -= (cells->leave - at) * reach;
    } while (imp__majorants_next(cells));
}

/* The way to a light sample is in m from near to far: a point of it is chosen for the
 * derivative of its transmittance, which tentative collisions do not have where the bound
 * is 0. */
static void line_offer(struct imp_free_flight *w, const struct imp_medium *m, double near,
                       double far)
{
    const struct imp_step *s = w->s;
    const struct imp_key key = imp__key_branch(s->walk->key, s->depth, IMP_FLIGHT_LINE);
    const double length = far - near;
    const uint32_t n = 2 * (uint32_t)w->line.kind; /* stretches so far */
    w->length += length;
    w->line.kind++;
    if (!(imp__u01(key, n) * w->length < length)) return;
    w->line.t = (imp_decided)(near + length * imp__u01(key, n + 1));
    w->line.medium = m->index;
}
bool imp__flight_end(struct imp_free_flight *w)
{
    struct imp_event e = w->line;
    const double depth = imp__decide1(w->control);
    if (depth > 0) {
        w->f *= exp(-depth);
        if (!imp__flight_event(
                w, (struct imp_event){.t = (imp_decided)depth, .kind = IMP_CONTROL}))
            return false;
    }
    if (e.kind == 0) return true;
    e.kind = IMP_LINE_AT;
    e.bound = (imp_decided)w->length;
    return imp__flight_event(w, e);
}

bool imp__fly(struct imp_free_flight *w, const struct imp_medium *m, double near,
              double far, bool collides, double *t)
{
    struct imp_step *s = w->s;
    struct imp_majorant_walk cells;
    const struct imp_flown before = {w->f, w->p};
    const int first = w->track ? w->track->n : 0;
    bool hit, fixed = false;
    if (!(near < far)) return false;
    if (!m->majorants) {
        hit = uniform_fly(w, m, near, far, collides, t, &fixed);
    } else {
        if (!imp__majorants_enter(m->majorants, w->o, w->d, near, far, &cells))
            return false;
        near = cells.t;
        far = cells.end;
        hit = false;
        if (!collides && m->majorants->control) residual_fly(w, m, &cells);
        else hit = varying_fly(w, m, &cells, collides, t);
        if (!collides && s->probing && s->tracer->active->medium[m->index])
            line_offer(w, m, near, far);
        /* A probe asks for a track, and an empty one has its start. */
        if (!w->track && s->probing && collides) {
            imp__flight_event(w, (struct imp_event){.t = 0});
            if (w->track) w->track->n = 0;
        }
    }
    if (s->walk->dropped) return false;
    if (collides) s->flight.fixed = fixed;
    if (!s->probing || !s->tracer->active->medium[m->index]) return hit;
    if (imp_unlikely(isinf(far)) && !hit && !imp__is_zero_used(w->f, s->at.carried) &&
        (!collides || imp__probe_diverges(s, m))) {
        s->walk->dropped = IMP_DROP_INFINITE;
        return false;
    }
    if (fixed) s->walk->valid |= !imp__is_zero_used(s->tracer->baseline, true);
    if (collides && !fixed)
        imp__probe_offer(s, m, w->track, first, before, near, hit ? *t : far, w->open);
    return hit;
}
