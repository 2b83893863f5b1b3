/* SPDX-License-Identifier: Apache-2.0
 *
 * A recorded walk from stop to stop where something has moved (check_moved.h). */
#include "check_moved.h"
#include "math/offset.h"
#include "walk/media/media_along.h"
#include "walk/media/tracking.h"
#include "walk/moved/moved_mirror.h"
#include "walk/moved/moved_sky.h"
#include "walk/path/first_segment.h"
#include <math.h>

/* A vertex as it was recorded, and where it is now. */
struct stop {
    const struct imp_vertex *v; /* NULL: none */
    bool floats;                /* it is a point of a medium */
    struct imp__glued old;
    struct imp__moved_at here;
    imp_v3 x, from[2]; /* its place; directions of arrival, now and then */
    bool turns;        /* the ray beyond it comes from a mirror */
    imp_v3 leaves[2];  /* its direction, now and then */
    imp_spec grows;    /* how the light that arrives there has changed on the way */
    imp_spec glows, scatters; /* and what a point of a medium emits and scatters */
    imp_spec P; /* of light that leaves it, where its kernel has not changed */
};

static imp_spec stop_ratio(const struct imp__moved_by *m, const struct stop *s,
                           const imp_v3 w[2], int lobe)
{
    return imp__moved_kernel(m, s->v, &s->here, s->x, s->from, w, &s->old, lobe);
}

/* What a way lets pass that is so much longer in a medium of this extinction. */
static imp_spec fades(imp_spec extinction, double longer)
{
    imp_spec T = imp__spec(1);
    if (imp__is_zero(extinction)) return T;
    for (int c = 0; c < 4; c++) T[c] = exp(-extinction[c] * longer);
    return T;
}

/* A line, now and then. */
struct way {
    imp_v3 o[2], w[2]; /* unit */
    double length[2];
};

/* What media that vary let pass of it, now over then: borders, and sides of a grid's box, stay at their parts of
 * the line or, where it has become longer at its end, at their distances. */
static imp_spec varying_fades(const struct imp__moved_by *m, const struct way *x,
                              bool by_parts, const struct imp_carried *carried)
{
    struct imp__media_line line =
        imp__media_line(&m->borders, x->o[1], x->w[1], x->length[1]);
    struct imp__along a[2] = {{.depth = {0}}, {.depth = {0}}};
    const double parts =
        by_parts && isfinite(x->length[1]) ? x->length[0] / x->length[1] : 1;
    struct imp__stretch s;
    imp_spec T;
    while (imp__media_next(&line, &s)) {
        const bool grid = s.medium && s.medium->majorants;
        if (!s.medium ||
            (grid && !imp__along_box(s.medium, x->o[1], x->w[1], &s.near, &s.far)))
            continue;
        const double near[2] = {s.near * parts, s.near},
                     far[2] = {s.far < x->length[1] ? s.far * parts : x->length[0],
                               s.far};
        for (int k = 0; k < 2; k++)
            if (grid)
                a[k].depth += imp__along_beyond(m->borders.scene, s.medium, x->o[k],
                                                x->w[k], near[k], far[k], carried);
            else
                imp__along_add(m->borders.scene, s.medium, x->o[k], x->w[k], near[k],
                               far[k], carried, false, &a[k]);
    }
    for (int c = 0; c < 4; c++) T[c] = exp(a[1].depth[c] - a[0].depth[c]);
    return T;
}

/* The same of a line from a stop, now and then so long, that has become longer all over: in media that this
 * track crosses. */
static imp_spec line_fades(const struct imp__moved_by *m, const struct imp_track *track,
                           const struct stop *s, const imp_v3 w[2], const double d[2])
{
    const struct imp_carried *carried = s->v->carried;
    const struct way way = {{s->x, s->old.p}, {w[0], w[1]}, {d[0], d[1]}};
    if (!m->borders.any) return fades(m->extinction, d[0] - d[1]);
    if (m->borders.varies) return varying_fades(m, &way, true, carried);
    if (!track || !isfinite(d[1])) return imp__spec(1);
    return fades(imp__track_depth(m->c->problem->scene, track, carried),
                 (d[0] - d[1]) / d[1]);
}

/* The extinction where a ray along w meets the surface at p. */
static imp_spec extinction_before(const struct imp__moved_by *m, imp_v3 p, imp_v3 n,
                                  imp_v3 w, const struct imp_carried *carried)
{
    imp_spec in[IMP_INPUTS_MAX];
    if (!m->borders.any) return m->extinction;
    const struct imp_medium *medium =
        imp__borders_at(&m->borders, imp__offset(p, n, -w), -w);
    return medium ? imp__extinction_at(medium, p, carried, in) : imp__spec(0);
}

/* What passes a way to the surface at p with the normal n, now over then. */
static imp_spec way_fades(const struct imp__moved_by *m, const struct way *x, imp_v3 p,
                          imp_v3 n, const struct imp_carried *carried)
{
    return m->borders.varies ? varying_fades(m, x, false, carried)
                             : fades(extinction_before(m, p, n, x->w[1], carried),
                                     x->length[0] - x->length[1]);
}

/* Light from a place of a lamp, now and then, to a stop: `glued` to the place, it has become so many
 * times as much. Of a point of a medium only a part of it is glued, and the rest has a fixed
 * direction. */
static imp_spec lamp_ratio(const struct imp__moved_by *m, const struct stop *s, int lobe,
                           const struct imp_emitter *e, const struct imp__moved_at *now,
                           const struct imp__glued *then, imp_spec glued)
{
    imp_v3 w[2];
    double unused;
    if (!s->floats) return glued;
    const double d[2] = {imp__length(now->p - s->x), imp__length(then->p - s->old.p)};
    struct imp__moved_at met = *now;
    w[0] = w[1] = imp__normalize(then->p - s->old.p);
    const double fixed = imp__length(imp__moved_met(s->x, w[0], &met) - s->x);
    const struct way way = {{s->x, s->old.p}, {w[0], w[1]}, {fixed, d[1]}};
    return glued * imp__glued_part(e, d[0], &unused) +
           stop_ratio(m, s, w, lobe) *
               way_fades(m, &way, then->p, then->n, s->v->carried) *
               (1 - imp__glued_part(e, fixed, &unused));
}

/* What its light sample brings, of light that reaches it with P. */
static double light_frozen(const struct imp__moved_by *m, const struct stop *s,
                           imp_spec P)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const struct imp_light *l = &s->v->d.light;
    imp_v3 to[2];
    double farther;
    if (s->v->d.connection != IMP_CONNECTED) return 0;
    const double ratio = imp__moved_light(m, s->v, &s->old, s->x, to, &farther);
    const struct imp_emitter *e = scene->emitters[l->emitter];
    imp_spec all = stop_ratio(m, s, to, IMP_SMOOTH);
    const double then = l->dist, d[2] = {then + farther, then};
    const imp_spec T = line_fades(m, s->v->to_light, s, to, d);
    if (s->floats && e->shape) {
        const struct imp__glued y = imp__glued_at(scene, e->shape->index, &l->located, 0,
                                                  s->old.time, imp__decided_v3(l->d));
        const struct imp__moved_at now = imp__moved_placed(m, &y);
        all = lamp_ratio(m, s, IMP_SMOOTH, e, &now, &y, all * ratio * T);
        return imp__sum_used(P * s->v->b * all, scene->lanes);
    }
    return ratio * imp__sum_used(P * s->v->b * all * T, scene->lanes);
}

/* Emission that is met from there, glued to the light. */
static double met_frozen(const struct imp__moved_by *m, const struct stop *s,
                         const struct stop *y)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const imp_v3 to[2] = {imp__normalize(y->here.p - s->x),
                          imp__normalize(y->old.p - s->old.p)};
    const double now = imp__moved_receives(s->x, y->here.p, y->here.n),
                 then = imp__moved_receives(s->old.p, y->old.p, y->old.n);
    const double d[2] = {imp__length(y->here.p - s->x), imp__length(y->old.p - s->old.p)};
    const imp_spec T = line_fades(m, s->v->on, s, to, d);
    imp_spec all = stop_ratio(m, s, to, s->v->d.lobe);
    if (!s->floats)
        return imp__sum_used(s->P * y->v->e * all * T, scene->lanes) * now / then;
    all = lamp_ratio(m, s, s->v->d.lobe, scene->emitters[y->v->d.met.emitter], &y->here,
                     &y->old, all * (now / then) * T);
    return imp__sum_used(s->P * y->v->e * all, scene->lanes);
}

/* How coefficients have changed on the way to where a point of a medium that varies is now: of light that it
 * scatters, and of what it emits. */
static void place_changed(const struct imp__moved_by *m, struct stop *s)
{
    const struct imp_medium *medium = m->borders.scene->media[s->v->d.shape];
    struct imp_coefficients c[2];
    for (int k = 0; k < 2; k++) {
        const struct imp_texcoord at = {.p = k ? s->old.p : s->x,
                                        .carried = s->v->carried};
        imp_spec in[IMP_INPUTS_MAX];
        imp__inputs_eval(medium->input, medium->n_own, &at, in);
        medium->ops->eval(medium, in, &c[k]);
    }
    const imp_spec *sigma[2] = {&c[0].extinction, &c[1].extinction};
    for (int k = 0; k < 4; k++) {
        const double a = (*sigma[0])[k], b = (*sigma[1])[k];
        if (!(a > 0 && b > 0)) continue;
        const double albedo[2] = {c[0].scattering[k] / a, c[1].scattering[k] / b},
                     glow[2] = {(1 - albedo[0]) * c[0].emission[k],
                                (1 - albedo[1]) * c[1].emission[k]};
        s->grows[k] *= a / b;
        if (albedo[1] > 0) s->scatters[k] = albedo[0] / albedo[1];
        if (glow[1] > 0) s->glows[k] = glow[0] / glow[1];
    }
}

/* A point of a medium, at a part of its stretch of the ray from `begin` (now and then) to what lies
 * beyond. */
static void float_at(const struct imp__moved_by *m, struct stop *s, imp_v3 o,
                     const imp_v3 begin[2])
{
    const struct imp_scene *scene = m->c->problem->scene;
    struct imp__link_point p = imp__medium_point(imp__decided_v3(s->v->d.p));
    imp_spec in[IMP_INPUTS_MAX];
    imp__float_aim(&m->borders, &p, begin[1]);
    const double t = imp__length(p.x.p - begin[1]);
    s->x = begin[0] + s->from[0] * t;
    s->grows = imp__spec(1);
    struct way way = {{begin[0], begin[1]}, {s->from[0], s->from[1]}, {t, t}};
    if (p.open) {
        if (m->borders.varies) s->grows = varying_fades(m, &way, false, s->v->carried);
        place_changed(m, s);
        return;
    }
    const struct imp__glued beyond = imp__link_glued(&p);
    struct imp__moved_at there = imp__moved_placed(m, &beyond),
                         rest = imp__moved_rest(&beyond);
    const double longer =
        imp__length(imp__moved_met(o, s->from[0], &there) - begin[0]) -
        imp__length(imp__moved_met(begin[1], s->from[1], &rest) - begin[1]);
    const imp_spec extinction =
        imp__extinction_at(scene->media[s->v->d.shape], p.x.p, s->v->carried, in);
    s->x = begin[0] + s->from[0] * (t + p.part * longer);
    way.length[0] += p.part * longer;
    s->grows = (m->borders.varies ? varying_fades(m, &way, false, s->v->carried)
                                  : fades(extinction, p.part * longer)) *
               (1 + longer / p.stretch);
    place_changed(m, s);
}

/* The direction of what leaves a mirror, or a pass behind one, now, of that which was recorded, and
 * rounded. */
static imp_v3 leaving(const struct stop *s, imp_v3 then)
{
    return imp__normalize(s->leaves[0] + then - s->leaves[1]);
}

/* The next stop of a walk, behind `before` (NULL: the camera); seen: along the camera's ray, else along
 * a fixed direction. */
static struct stop stop_at(const struct imp__moved_by *m, const struct imp_walk *walk,
                           const struct imp_vertex *v, const struct stop *before,
                           bool seen)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const bool turns = m->shape == IMP_MOVE_CAMERA && seen;
    struct stop s = {.v = v,
                     .floats = v->d.scatterer == IMP_IN_MEDIUM,
                     .glows = imp__spec(1),
                     .scatters = imp__spec(1)};
    if (s.floats) s.old.p = imp__decided_v3(v->d.p);
    else s.old = imp__moved_glued(scene, v, walk->time);
    imp_v3 o = seen ? walk->ray.o : before->x;
    s.from[1] = imp__normalize(s.old.p - (seen ? o : before->old.p));
    s.from[0] = turns                     ? imp__moved_turn(m, s.from[1])
                : before && before->turns ? leaving(before, s.from[1])
                                          : s.from[1];
    if (turns) o = m->to + imp__moved_turn(m, o - m->from);
    const imp_v3 near[2] = {s.from[0] * walk->ray.t_near, s.from[1] * walk->ray.t_near};
    const imp_v3 begin[2] = {before ? before->x : o + near[0],
                             before ? before->old.p : walk->ray.o + near[1]};
    if (s.floats) {
        float_at(m, &s, o, begin);
        return s;
    }
    s.here = imp__moved_placed(m, &s.old);
    const bool meter = !before && m->c->tracer.sensor->shape;
    s.x = meter ? s.here.p : imp__moved_met(o, s.from[0], &s.here);
    s.here.shade = s.old.smooth ? imp__moved_shade(m, &s.old, s.x) : s.here.n;
    const struct way way = {
        {begin[0], begin[1]},
        {s.from[0], s.from[1]},
        {imp__length(s.x - begin[0]), imp__length(s.old.p - begin[1])}};
    if (m->fades) s.grows = way_fades(m, &way, s.old.p, s.old.n, v->carried);
    return s;
}

/* What leaves a stop for the next vertex, in place of what reaches it; s->P. */
static imp_spec step_frozen(const struct imp__moved_by *m, struct stop *s, imp_spec P)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const struct imp_vertex *next = s->v->next;
    imp_v3 w[2] = {s->from[0], s->from[1]};
    s->P = P * s->v->w;
    const bool mirrored = imp__is_mirrored(s->v);
    s->turns |= mirrored;
    for (int k = 0; k < 2; k++) {
        s->leaves[k] = s->from[k];
        if (mirrored)
            imp__bend(k ? s->old.n : s->here.n, s->from[k], imp__vertex_ratio(s->v),
                      &s->leaves[k]);
    }
    if (!imp__goes_straight(s->v)) {
        const bool place =
            next->d.scatterer == IMP_AT_SKY || next->d.scatterer == IMP_IN_MEDIUM;
        const imp_v3 p = place ? imp__decided_v3(next->d.p)
                               : imp__moved_glued(scene, next, s->old.time).p;
        w[1] = imp__normalize(next->d.scatterer == IMP_AT_SKY ? p : p - s->old.p);
        w[0] = mirrored ? leaving(s, w[1]) : w[1];
    }
    return s->P * stop_ratio(m, s, w, s->v->d.lobe);
}

/* Media that vary on the way to the sky, from a stop or, where it is seen, from the camera. */
static imp_spec sky_fades(const struct imp__moved_by *m, const struct imp_walk *walk,
                          const struct stop *s, bool seen, const struct imp_vertex *sky)
{
    const bool turns = m->shape == IMP_MOVE_CAMERA && seen;
    const imp_v3 d = seen ? walk->ray.d : imp__normalize(imp__decided_v3(sky->d.p)),
                 to = turns ? imp__moved_turn(m, d) : d;
    struct way way = {{s->x, s->old.p}, {to, d}, {INFINITY, INFINITY}};
    if (!m->borders.varies) return imp__spec(1);
    if (seen) {
        way.o[1] = walk->ray.o + d * walk->ray.t_near;
        way.o[0] =
            (turns ? m->to + imp__moved_turn(m, walk->ray.o - m->from) : walk->ray.o) +
            to * walk->ray.t_near;
    }
    return varying_fades(m, &way, false, sky->carried);
}

double imp__frozen_walk(struct imp__moved_by *m, const struct imp_walk *walk, imp_spec P)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const bool through = imp__segment_first(&m->c->tracer)->through;
    const struct imp_vertex *v = walk->first;
    struct stop here = {.v = NULL}, from = {.v = NULL}; /* from which light is sampled */
    bool seen = true;                                   /* by the camera's ray */
    double value = 0;
    imp__moved_time(m, walk->time);
    m->extinction = (imp_spec){0};
    m->borders = (struct imp__borders){.scene = scene};
    if (through) m->borders = imp__borders_of(scene, m->c->tracer.sensor->medium);
    m->fades =
        m->borders.any || (v && imp__fog(&m->c->tracer, v->carried, &m->extinction));
    if (v && v->d.scatterer == IMP_AT_SENSOR) {
        P *= v->w;
        v = v->next;
    }
    for (; v; v = v->next) {
        if (v->d.scatterer == IMP_AT_SKY) {
            const imp_v3 d = walk->ray.d;
            const imp_spec sky =
                here.v && here.turns ? imp__skies_from(scene, here.leaves[0], v->carried)
                : !seen
                    ? here.v->beyond
                    : imp__skies_from(
                          scene, m->shape == IMP_MOVE_CAMERA ? imp__moved_turn(m, d) : d,
                          v->carried);
            return value + imp__sum_used(P * sky * sky_fades(m, walk, &here, seen, v),
                                         scene->lanes);
        }
        const struct stop before = here;
        const bool passed =
            m->fades || (here.v && (here.turns || imp__goes_straight(here.v)));
        here = stop_at(m, walk, v, here.v ? &before : NULL, seen);
        here.turns = before.v && before.turns && imp__goes_straight(v);
        if (m->fades) P *= here.grows;
        if (here.floats) value += imp__sum_used(P * v->e * here.glows, scene->lanes);
        P *= here.scatters;
        if (!here.floats && v->d.met.emitter >= 0) {
            if (from.v) value += met_frozen(m, &from, &here);
            else if (passed) value += imp__sum_used(P * v->e, scene->lanes);
        }
        value += light_frozen(m, &here, P);
        if (!v->d.goes_on || !v->next) break;
        P = step_frozen(m, &here, P);
        if (imp__is_mirrored(v)) {
            from.v = NULL;
            seen = false;
        } else if (!imp__goes_straight(v)) {
            from = here;
            seen = false;
        } else if (through) from.P *= v->w;
        else from.v = NULL;
    }
    return value;
}
