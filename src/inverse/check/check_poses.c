/* SPDX-License-Identifier: Apache-2.0
 *
 * Poses: recorded walks whose vertices move with the objects they lie on, film positions and
 * scattered directions held, against the derivative inside of walks; one row for each pose, scale, and
 * place or direction of a light, its worst walk and number. Places are moved by these numbers
 * themselves, in double, and not by velocities. Other numbers of geometry have fresh rows alone.
 * What jumps at edges is not in it: fresh rows have that. */
#include "check.h"
#include "inverse/estimate/moved_gradient.h"
#include "kind/emitter/ies.h"
#include "kind/sensor/receiver.h"
#include "scene/pose.h"
#include "walk/core/vertex.h"
#include "walk/moved/moved_chain.h"
#include "walk/moved/moved_sky.h"
#include "walk/path/first_segment.h"
#include <math.h>
#include <string.h>

#define FROZEN_LIMIT 1e-6
#define TINY                                                                             \
    1e-3 /* of a walk's value per scale of a number: smaller slopes are rounding */
#define N_STEPS                                                                          \
    5 /* the last ones for vertices that slide fast, seen at a grazing angle */
static const double steps[N_STEPS] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};

/* One pose, scale, place or direction of a light, moved by h along one of its numbers. */
struct moved {
    const struct imp__check *c;
    const struct imp_pose *pose;
    int shape;       /* or IMP_MOVE_CAMERA, or that of a light */
    double turn[9];  /* R(a') R(a)^T */
    double by;       /* scale after over before */
    imp_v3 from, to; /* the centre, or a light's place or direction, before and after */
    imp_spec
        extinction; /* of a medium that fills the scene, by lanes; 0: there is none */
};

static bool is_of_kind(const struct imp_pose *p)
{
    return p->kind == IMP_POSE_RIGID || p->kind == IMP_POSE_SCALE ||
           p->kind == IMP_POSE_POSITION || p->kind == IMP_POSE_DIRECTION;
}

static void move_by(struct moved *m, size_t number, double h)
{
    const struct imp_pose *p = m->pose;
    double there[6] = {0}, old[9], new[9];
    memcpy(there, p->number, p->n * sizeof *there);
    there[number] += h;
    m->by = 1;
    if (p->kind == IMP_POSE_SCALE) {
        m->by = there[0] / p->number[0];
        m->to = m->from;
        return;
    }
    if (p->kind != IMP_POSE_RIGID) {
        m->from = imp__v3(p->number[0], p->number[1], p->number[2]);
        m->to = imp__v3(there[0], there[1], there[2]);
        return;
    }
    imp__rotation_of(p->number + 3, old);
    imp__rotation_of(there + 3, new);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += new[3 * i + k] * old[3 * j + k];
            m->turn[3 * i + j] = sum;
        }
    m->from = p->centre + imp__v3(p->number[0], p->number[1], p->number[2]);
    m->to = p->centre + imp__v3(there[0], there[1], there[2]);
}

static imp_v3 turned(const struct moved *m, imp_v3 d)
{
    const double *R = m->turn;
    return imp__v3(R[0] * d[0] + R[1] * d[1] + R[2] * d[2],
                   R[3] * d[0] + R[4] * d[1] + R[5] * d[2],
                   R[6] * d[0] + R[7] * d[1] + R[8] * d[2]);
}

/* A point of a shape, its normal and a direction in it, and the curvature there, where the pose has
 * moved; the normal of its shading frame. */
struct at {
    imp_v3 p, n, s;
    double curvature;
    imp_v3 straight, shade;
};
static struct at at_rest(const struct imp__glued *x)
{
    return (struct at){x->p,         x->n,        x->s,
                       x->curvature, x->straight, imp__shading_normal(x)};
}
static struct at placed(const struct moved *m, const struct imp__glued *x)
{
    struct at at = at_rest(x);
    if (x->carrier != m->shape) return at;
    if (m->pose->kind == IMP_POSE_SCALE) {
        at.p = m->from + (x->p - m->from) * m->by;
        at.curvature /= m->by;
    } else {
        at.p = m->to + turned(m, x->p - m->from);
        at.n = turned(m, x->n);
        at.s = turned(m, x->s);
        at.straight = turned(m, x->straight);
        at.shade = turned(m, imp__shading_normal(x));
    }
    return at;
}

/* A direction, and a point, of what moves, as they were when the walk was recorded. */
static imp_v3 turned_back(const struct moved *m, int carrier, imp_v3 d)
{
    const double *R = m->turn;
    if (carrier != m->shape || m->pose->kind != IMP_POSE_RIGID) return d;
    return imp__v3(R[0] * d[0] + R[3] * d[1] + R[6] * d[2],
                   R[1] * d[0] + R[4] * d[1] + R[7] * d[2],
                   R[2] * d[0] + R[5] * d[1] + R[8] * d[2]);
}
static imp_v3 was_at(const struct moved *m, int carrier, imp_v3 x)
{
    const imp_v3 r = x - m->to;
    if (carrier != m->shape) return x;
    if (m->pose->kind == IMP_POSE_SCALE) return m->from + r * (1 / m->by);
    return m->from + turned_back(m, carrier, r);
}

/* The shading normal at x, in the plane of a triangle with vertex normals. */
static imp_v3 shaded_at(const struct moved *m, const struct imp__glued *then, imp_v3 x)
{
    const struct imp__corners f =
        imp__corners(m->c->problem->scene, then->shape, then->prim, then->place);
    const imp_v3 r = was_at(m, then->carrier, x) - then->p;
    double b[3] = {then->b[0], then->b[1], then->b[2]};
    imp_v3 N = {0};
    for (int k = 0; k < 2; k++) {
        b[k + 1] += imp__dot(then->slope[k], r);
        b[0] -= imp__dot(then->slope[k], r);
    }
    for (int k = 0; k < 3; k++) N += f.n[k] * b[k];
    N = imp__normalize(N);
    return then->carrier == m->shape && m->pose->kind == IMP_POSE_RIGID ? turned(m, N)
                                                                        : N;
}

/* The point of a vertex, with its frame's s where its material is not Lambertian. */
static struct imp__glued vertex_glued(const struct imp_scene *scene,
                                      const struct imp_vertex *v, double time)
{
    struct imp__glued x =
        imp__glued_at(scene, v->d.shape, &v->d.located, v->d.place, v->ng);
    struct imp_surface at;
    if (v->bsdf && !imp__is_plain(v->bsdf) &&
        imp__decided_surface(scene, &v->d, time, &at))
        x.s = at.s;
    return x;
}

/* Where a ray from o along w meets the plane of a place, or the sphere that it lies on; the normal
 * there. */
static imp_v3 met_at(imp_v3 o, imp_v3 w, struct at *x)
{
    const double plane = imp__dot(x->n, x->p - o) / imp__dot(x->n, w);
    if (x->curvature == 0) return o + w * plane;
    const imp_v3 centre = x->p - x->n * (1 / x->curvature);
    /* A cylinder is met in the plane across its axis. */
    const imp_v3 a = x->straight, flat = w - a * imp__dot(a, w);
    imp_v3 r = centre - o;
    r -= a * imp__dot(a, r);
    const double slope = imp__length(flat), middle = imp__dot(r, flat) / slope;
    const imp_v3 across = r - flat * (middle / slope);
    const double half =
        sqrt(fmax(imp__sqr(1 / x->curvature) - imp__dot(across, across), 0));
    const double far = (middle + half) / slope, near = (middle - half) / slope;
    const imp_v3 p = o + w * (fabs(far - plane) < fabs(near - plane) ? far : near);
    const imp_v3 out = p - centre;
    x->n = imp__normalize((out - a * imp__dot(a, out)) * x->curvature);
    return p;
}

/* cos_y/d^2 from a point to another one. */
static double receives(imp_v3 x, imp_v3 y, imp_v3 n_y)
{
    const imp_v3 r = y - x;
    const double d = imp__length(r);
    return imp__dot(n_y, r) / (d * d * d);
}

/* What the material looks up at x: of a shape that has moved since, where this point of it was when
 * the walk was recorded. */
static void looked_up(const struct moved *m, const struct imp_vertex *v, imp_v3 x,
                      bool moved, const struct imp__glued *then, imp_spec *in)
{
    const struct imp_scene *scene = m->c->problem->scene;
    struct imp_texcoord at = imp__vertex_at(v);
    struct imp_surface old;
    imp_v3 grad[2];
    if (moved) x = was_at(m, then->carrier, x);
    if (then->curvature !=
        0) { /* the point itself, as one that a ray of no length hits */
        const struct imp_hit hit = {.shape = then->shape, .place = then->place};
        imp__hit_surface(scene, &hit, &x, &(imp_v3){0}, &old);
        at.uv[0] = old.uv[0];
        if (imp__is_zero(then->straight)) at.uv[1] = old.uv[1];
        else /* the height of a cylinder is not of the point, but of the hit */
            at.uv[1] += imp__dot(old.dp_dv, x - then->p) / imp__dot(old.dp_dv, old.dp_dv);
    } else if (imp__decided_surface(scene, &v->d, 0, &old)) {
        imp__surface_grad(&old, grad);
        for (int k = 0; k < 2; k++) at.uv[k] += imp__dot(grad[k], x - then->p);
    }
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &at, in);
}

/* The density of directions of a meter, where it was when the walk was recorded. */
static double received(const struct moved *m, imp_v3 w)
{
    const struct imp_receiver *r = m->c->tracer.sensor->receiver;
    return imp__receiver_density(r, imp__to_local(&r->frame, w));
}

/* The kernel of a vertex, now at x, over that at its recorded place, by lanes: between o and w, unit,
 * now and then. */
static imp_spec kernel_ratio(const struct moved *m, const struct imp_vertex *v,
                             const struct at *now, imp_v3 x, const imp_v3 o[2],
                             const imp_v3 w[2], const struct imp__glued *then, int lobe)
{
    imp_spec in[IMP_INPUTS_MAX];
    const bool meter =
        m->c->tracer.sensor->shape && v->prev && v->prev->d.scatterer == IMP_AT_SENSOR;
    if (meter && m->c->tracer.sensor->receiver)
        return imp__spec(received(m, turned_back(m, then->carrier, w[0])) /
                         received(m, w[1]));
    if (meter || imp__is_plain(v->bsdf))
        return imp__spec(imp__dot(now->shade, w[0]) /
                         imp__dot(imp__shading_normal(then), w[1]));
    imp_spec K[2];
    const bool textured = imp__is_textured(v->bsdf);
    if (v->d.scatterer == IMP_IN_MEDIUM) { /* its frame has the axes of the world */
        for (int k = 0; k < 2; k++) {
            const struct imp_dirs d = {-o[k], w[k], lobe, 0};
            v->bsdf->ops->eval(v->bsdf, v->in, &d, &K[k]);
        }
        return K[0] / K[1];
    }
    for (int k = 0; k < 2; k++) {
        if (textured) looked_up(m, v, k ? then->p : x, k == 0, then, in);
        const imp_v3 n = k ? imp__shading_normal(then) : now->shade,
                     across = k ? then->s : now->s;
        const imp_v3 s = imp__normalize(across - n * imp__dot(n, across));
        const struct imp_frame f = {s, imp__cross(n, s), n};
        const struct imp_dirs d = {imp__to_local(&f, -o[k]), imp__to_local(&f, w[k]),
                                   lobe, 0};
        v->bsdf->ops->eval(v->bsdf, textured ? in : v->in, &d, &K[k]);
    }
    for (int c = 0; c < 4; c++) K[0][c] = K[1][c] != 0 ? K[0][c] / K[1][c] : 0;
    return K[0];
}

/* Directions to the light sample of a vertex at x, now and at its recorded place, and by how much it
 * is farther away; returns how what it receives, without its kernel, has changed. */
static double light_ratio(const struct moved *m, const struct imp_vertex *v,
                          const struct imp__glued *old, imp_v3 x, imp_v3 w[2],
                          double *farther)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const struct imp_emitter *e = scene->emitters[v->d.light.emitter];
    const imp_v3 d = imp__decided_v3(v->d.light.d);
    const bool moves = m->pose->emitter == e;
    w[0] = w[1] = imp__normalize(-d);
    *farther = 0;
    if (e->ops->flags & IMP_EMITTER_ENVIRONMENT) return 1;
    if (!e->shape && e->ops->flags & IMP_EMITTER_FAR) {
        const double side = imp__dot(d, m->from) < 0 ? 1 : -1;
        if (moves) w[0] = imp__normalize(m->to) * side;
        return 1;
    }
    if (!e->shape) {
        double at[3];
        e->ops->aim((struct imp_emitter *)(uintptr_t)e, at, false);
        const imp_v3 y = imp__v3(at[0], at[1], at[2]), r = (moves ? m->to : y) - x,
                     r_old = y - old->p;
        w[0] = imp__normalize(r);
        w[1] = imp__normalize(r_old);
        *farther = imp__length(r) - imp__length(r_old);
        return imp__dot(r_old, r_old) / imp__dot(r, r);
    }
    const struct imp__glued y =
        imp__glued_at(scene, e->shape->index, &v->d.light.located, 0, d);
    const struct at there = placed(m, &y);
    w[0] = imp__normalize(there.p - x);
    w[1] = imp__normalize(y.p - old->p);
    *farther = imp__length(there.p - x) - imp__length(y.p - old->p);
    return receives(x, there.p, there.n) / receives(old->p, y.p, y.n);
}

/* Has it light of a spot or ies light, whose intensity changes with the direction? */
static bool has_spots(const struct imp_scene *scene, const struct imp_walk *walk)
{
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        if (v->d.scatterer != IMP_AT_SKY && v->d.met.emitter >= 0 &&
            scene->emitters[v->d.met.emitter]->ops == &imp__ies_area)
            return true;
        if (v->d.connection != IMP_CONNECTED) continue;
        const struct imp_emitter_ops *ops = scene->emitters[v->d.light.emitter]->ops;
        if (ops->cone || ops == &imp__ies_light || ops == &imp__ies_area) return true;
    }
    return false;
}

/* A vertex as it was recorded, and where it is now. */
struct stop {
    const struct imp_vertex *v; /* NULL: none */
    bool floats;                /* it is a point of a medium */
    struct imp__glued old;
    struct at here;
    imp_v3 x, from[2]; /* its place; directions of arrival, now and then */
    imp_spec grows;    /* how the light that arrives there has changed on the way */
    imp_spec P;        /* of light that leaves it, where its kernel has not changed */
};

static imp_spec stop_ratio(const struct moved *m, const struct stop *s, const imp_v3 w[2],
                           int lobe)
{
    return kernel_ratio(m, s->v, &s->here, s->x, s->from, w, &s->old, lobe);
}

/* What a way that is so much longer lets pass. */
static imp_spec fades(const struct moved *m, double longer)
{
    imp_spec T = imp__spec(1);
    if (imp__is_zero(m->extinction)) return T;
    for (int c = 0; c < 4; c++) T[c] = exp(-m->extinction[c] * longer);
    return T;
}

/* Light from a place of a lamp, now and then, to a stop: `glued` to the place, it has become so many
 * times as much. Of a point of a medium only a part of it is glued, and the rest has a fixed
 * direction. */
static imp_spec lamp_ratio(const struct moved *m, const struct stop *s, int lobe,
                           const struct imp_emitter *e, const struct at *now, imp_v3 then,
                           imp_spec glued)
{
    imp_v3 w[2];
    double unused;
    if (!s->floats) return glued;
    const double d[2] = {imp__length(now->p - s->x), imp__length(then - s->old.p)};
    struct at met = *now;
    w[0] = w[1] = imp__normalize(then - s->old.p);
    const double fixed = imp__length(met_at(s->x, w[0], &met) - s->x);
    return glued * imp__glued_part(e, d[0], &unused) +
           stop_ratio(m, s, w, lobe) * fades(m, fixed - d[1]) *
               (1 - imp__glued_part(e, fixed, &unused));
}

/* What its light sample brings, of light that reaches it with P. */
static double light_frozen(const struct moved *m, const struct stop *s, imp_spec P)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const struct imp_light *l = &s->v->d.light;
    imp_v3 to[2];
    double farther;
    if (s->v->d.connection != IMP_CONNECTED) return 0;
    const double ratio = light_ratio(m, s->v, &s->old, s->x, to, &farther);
    const struct imp_emitter *e = scene->emitters[l->emitter];
    imp_spec all = stop_ratio(m, s, to, IMP_SMOOTH);
    if (s->floats && e->shape) {
        const struct imp__glued y =
            imp__glued_at(scene, e->shape->index, &l->located, 0, imp__decided_v3(l->d));
        const struct at now = placed(m, &y);
        all = lamp_ratio(m, s, IMP_SMOOTH, e, &now, y.p, all * ratio * fades(m, farther));
        return imp__sum_used(P * s->v->b * all, scene->lanes);
    }
    return ratio * imp__sum_used(P * s->v->b * all * fades(m, farther), scene->lanes);
}

/* Emission that is met from there, glued to the light. */
static double met_frozen(const struct moved *m, const struct stop *s,
                         const struct stop *y)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const imp_v3 to[2] = {imp__normalize(y->here.p - s->x),
                          imp__normalize(y->old.p - s->old.p)};
    const double now = receives(s->x, y->here.p, y->here.n),
                 then = receives(s->old.p, y->old.p, y->old.n);
    const double farther =
        imp__length(y->here.p - s->x) - imp__length(y->old.p - s->old.p);
    imp_spec all = stop_ratio(m, s, to, s->v->d.lobe);
    if (!s->floats)
        return imp__sum_used(s->P * y->v->e * all * fades(m, farther), scene->lanes) *
               now / then;
    all = lamp_ratio(m, s, s->v->d.lobe, scene->emitters[y->v->d.met.emitter], &y->here,
                     y->old.p, all * (now / then) * fades(m, farther));
    return imp__sum_used(s->P * y->v->e * all, scene->lanes);
}

/* A point of a medium, at a part of the way from `begin` (now and then) along the ray to what lies
 * beyond. */
static void float_at(const struct moved *m, struct stop *s, imp_v3 o,
                     const imp_v3 begin[2])
{
    const struct imp_scene *scene = m->c->problem->scene;
    struct imp__link_point p = imp__medium_point(imp__decided_v3(s->v->d.p));
    imp__float_aim(scene, &p, begin[1]);
    const double t = imp__length(p.x.p - begin[1]);
    s->x = begin[0] + s->from[0] * t;
    s->grows = imp__spec(1);
    if (p.open) return;
    const struct imp__glued beyond = imp__link_glued(&p);
    struct at there = placed(m, &beyond), rest = at_rest(&beyond);
    const double now = imp__length(met_at(o, s->from[0], &there) - begin[0]),
                 then = imp__length(met_at(begin[1], s->from[1], &rest) - begin[1]);
    s->x = begin[0] + s->from[0] * (t * now / then);
    s->grows = fades(m, t * (now / then - 1)) * (now / then);
}

/* The next stop of a walk, behind `before` (NULL: the camera); seen: along the camera's ray, else along
 * a fixed direction. */
static struct stop stop_at(const struct moved *m, const struct imp_walk *walk,
                           const struct imp_vertex *v, const struct stop *before,
                           bool seen)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const bool turns = m->shape == IMP_MOVE_CAMERA && seen;
    struct stop s = {.v = v, .floats = v->d.scatterer == IMP_IN_MEDIUM};
    if (s.floats) s.old.p = imp__decided_v3(v->d.p);
    else s.old = vertex_glued(scene, v, walk->time);
    imp_v3 o = seen ? walk->ray.o : before->x;
    s.from[1] = imp__normalize(s.old.p - (seen ? o : before->old.p));
    s.from[0] = turns ? turned(m, s.from[1]) : s.from[1];
    if (turns) o = m->to + turned(m, o - m->from);
    const imp_v3 near[2] = {s.from[0] * walk->ray.t_near, s.from[1] * walk->ray.t_near};
    const imp_v3 begin[2] = {before ? before->x : o + near[0],
                             before ? before->old.p : walk->ray.o + near[1]};
    if (s.floats) {
        float_at(m, &s, o, begin);
        return s;
    }
    s.here = placed(m, &s.old);
    const bool meter = !before && m->c->tracer.sensor->shape;
    s.x = meter ? s.here.p : met_at(o, s.from[0], &s.here);
    s.here.shade = s.old.smooth ? shaded_at(m, &s.old, s.x) : s.here.n;
    s.grows = fades(m, imp__length(s.x - begin[0]) - imp__length(s.old.p - begin[1]));
    return s;
}

/* What leaves a stop for the next vertex, in place of what reaches it; s->P. */
static imp_spec step_frozen(const struct moved *m, struct stop *s, imp_spec P)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const struct imp_vertex *next = s->v->next;
    imp_v3 w[2] = {s->from[0], s->from[1]};
    s->P = P * s->v->w;
    if (!imp__goes_straight(s->v)) {
        const bool place =
            next->d.scatterer == IMP_AT_SKY || next->d.scatterer == IMP_IN_MEDIUM;
        const imp_v3 p =
            place ? imp__decided_v3(next->d.p) : vertex_glued(scene, next, 0).p;
        w[0] = w[1] = imp__normalize(next->d.scatterer == IMP_AT_SKY ? p : p - s->old.p);
    }
    return s->P * stop_ratio(m, s, w, s->v->d.lobe);
}

/* The walk's value, weighted by channels, where the pose has moved. What the camera sees through
 * nothing does not change, and is left out. */
static double frozen(struct moved *m, const struct imp_walk *walk, imp_spec P)
{
    const struct imp_scene *scene = m->c->problem->scene;
    const bool through = imp__segment_first(&m->c->tracer)->through;
    const struct imp_vertex *v = walk->first;
    struct stop here = {.v = NULL}, from = {.v = NULL}; /* from which light is sampled */
    bool seen = true;                                   /* by the camera's ray */
    double value = 0;
    m->extinction = (imp_spec){0};
    const bool fog = v && imp__fog(&m->c->tracer, v->carried, &m->extinction);
    if (v && v->d.scatterer == IMP_AT_SENSOR) {
        P *= v->w;
        v = v->next;
    }
    for (; v; v = v->next) {
        if (v->d.scatterer == IMP_AT_SKY) {
            const imp_v3 d = walk->ray.d;
            const imp_spec sky =
                !seen ? here.v->beyond
                      : imp__skies_from(scene,
                                        m->shape == IMP_MOVE_CAMERA ? turned(m, d) : d,
                                        v->carried);
            return value + imp__sum_used(P * sky, scene->lanes);
        }
        const struct stop before = here;
        const bool passed = fog || (here.v && imp__goes_straight(here.v));
        here = stop_at(m, walk, v, here.v ? &before : NULL, seen);
        if (fog) P *= here.grows;
        if (!here.floats && v->d.met.emitter >= 0) {
            if (from.v) value += met_frozen(m, &from, &here);
            else if (passed) value += imp__sum_used(P * v->e, scene->lanes);
        }
        value += light_frozen(m, &here, P);
        if (!v->d.goes_on || !v->next) break;
        P = step_frozen(m, &here, P);
        if (!imp__goes_straight(v)) {
            from = here;
            seen = false;
        } else if (through) from.P *= v->w;
        else from.v = NULL;
    }
    return value;
}

/* A walk's slopes along the numbers against differences, each at its best step; *worst: the row of
 * the largest error so far. */
static void compare(struct moved *m, const struct imp_walk *walk, imp_spec P,
                    const double slope[6], struct imp_check_row *worst)
{
    static const double places[4] = {1, -1, 2, -2};
    move_by(m, 0, 0);
    const double still = fabs(frozen(m, walk, P));
    for (size_t e = 0; e < m->pose->n; e++) {
        const double scale = 0.1 * imp__pose_large(m->pose, e);
        struct imp_check_row best = {.error = INFINITY};
        for (int s = 0; s < N_STEPS; s++) {
            const double h = steps[s] * scale;
            double f[4];
            for (int i = 0; i < 4; i++) {
                move_by(m, e, places[i] * h);
                f[i] = frozen(m, walk, P);
            }
            const double d = (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h);
            const double least = fmax(fabs(slope[e]), TINY * still / scale);
            const double error = d == slope[e] ? 0 : fabs(d - slope[e]) / least;
            if (error < best.error)
                best = (struct imp_check_row){
                    .step = h, .value = slope[e], .reference = d, .error = error};
        }
        if (!(best.error <= worst->error) || worst->step == 0) *worst = best;
    }
}

/* The numbers' slopes of a walk, six at most: the part of bar that belongs to the pose. */
struct six {
    struct imp_sink sink; /* first */
    int param;
    double number[6];
};
static void six_add(struct imp_sink *sink, int param, size_t element, int channels,
                    const imp_spec *bar)
{
    struct six *s = (struct six *)sink;
    (void)channels;
    if (param == s->param) s->number[element] += (*bar)[0];
}

static enum imp_status pose_check(struct imp__check *c, struct imp__moved_gradient *g,
                                  struct imp_arena *arena, int mover)
{
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const uint64_t pixels = (uint64_t)film->crop_w * (uint64_t)film->crop_h;
    struct moved m = {.c = c,
                      .pose = g->pose[mover],
                      .shape = g->moves.mover[mover].shape,
                      .from = g->moves.mover[mover].centre};
    struct imp_check_row worst = {0};
    for (int t = 0; t < c->options.paths; t++) {
        const uint64_t pixel = imp__mix64((uint64_t)t + 0x51ed270b) % pixels;
        const struct imp_arena_mark mark = imp__arena_mark(arena);
        struct imp_walk walk;
        imp__walk_trace(&c->tracer, arena, (int)(pixel % (uint64_t)film->crop_w),
                        (int)(pixel / (uint64_t)film->crop_w), t, &walk);
        double *bar = imp__arena_array(arena, g->moves.n, sizeof *bar);
        const imp_spec channels = {1, 0.7, 0.4, 0};
        if (!bar || walk.dropped == IMP_DROP_MEMORY ||
            !imp__moved_walk(g, arena, &walk, channels, bar))
            return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
        struct six six = {{six_add, false}, m.pose->param, {0}};
        imp__moved_numbers(g, bar, (imp_spec){1, 0, 0, 0}, &six.sink);
        if (walk.dropped == IMP_DROP_NONE && walk.valid &&
            !has_spots(c->problem->scene, &walk))
            compare(&m, &walk, imp__walk_values(&c->tracer, &walk, channels), six.number,
                    &worst);
        imp__arena_rewind(arena, mark);
    }
    worst.limit = FROZEN_LIMIT;
    worst.ok = worst.error <= FROZEN_LIMIT;
    return imp__check_row(c, "frozen", c->problem->scene->params[m.pose->param].info.name,
                          -1, &worst);
}

enum imp_status imp__check_poses(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    struct imp__moved_gradient g = {0};
    struct imp_arena arena;
    imp__arena_init(&arena, c->ctx);
    IMP_TRY(imp__moved_begin(c->problem, &c->tracer, &g));
    for (int k = 0; k < g.moves.n_movers; k++) {
        if (is_of_kind(g.pose[k])) IMP_TRY(pose_check(c, &g, &arena, k));
        IMP_TRY(imp__check_progress(c, 0));
    }
out:
    imp__moved_end(&g);
    imp__arena_free(&arena);
    return st;
}
