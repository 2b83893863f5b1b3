/* SPDX-License-Identifier: Apache-2.0
 *
 * Places, kernels and light samples of recorded vertices where something has moved (check_moved.h). */
#include "check_moved.h"
#include "kind/sensor/receiver.h"
#include <math.h>
#include <string.h>

/* The motion of an instance, one of whose places has these numbers. */
static void motion_by(struct imp__moved_by *m, const double there[6])
{
    const struct imp_pose *p = m->pose;
    const int side = p->kind == IMP_POSE_RIGID_END;
    const imp_v3 from = p->centre + imp__v3(p->number[0], p->number[1], p->number[2]),
                 to = p->centre + imp__v3(there[0], there[1], there[2]);
    double old[9], new[9];
    m->motion = *p->scene->world->instance[p->instance].motion;
    imp__rotation_of(p->number + 3, old);
    imp__rotation_of(there + 3, new);
    /* Back to where the file has it, and from there. */
    const double back[3] = {-p->number[3], -p->number[4], -p->number[5]};
    const imp_v3 r = m->motion.shift[side] - from;
    imp_v3 rest = {0}, shift = to;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) rest[i] += old[3 * j + i] * r[j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) shift[i] += new[3 * i + j] * rest[j];
    imp__motion_turn(&m->motion, side, back, rest);
    imp__motion_turn(&m->motion, side, there + 3, shift);
}

void imp__moved_time(struct imp__moved_by *m, double time)
{
    const struct imp_pose *p = m->pose;
    const struct imp_motion *then =
        p->instance >= 0 ? p->scene->world->instance[p->instance].motion : NULL;
    struct imp_map old[2], new[2];
    if (!then) return;
    imp__motion_at(then, time, &old[0], &old[1]);
    imp__motion_at(&m->motion, time, &new[0], &new[1]);
    const struct imp_map by = imp__map_product(&new[0], &old[1]);
    for (int k = 0; k < 9; k++) m->turn[k] = by.m[k / 3 * 4 + k % 3];
    m->from = imp__v3(old[0].m[3], old[0].m[7], old[0].m[11]);
    m->to = imp__v3(new[0].m[3], new[0].m[7], new[0].m[11]);
}

void imp__move_by(struct imp__moved_by *m, size_t number, double h)
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
    if (p->instance >= 0 && p->scene->world->instance[p->instance].motion) {
        motion_by(m, there);
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

imp_v3 imp__moved_turn(const struct imp__moved_by *m, imp_v3 d)
{
    const double *R = m->turn;
    return imp__v3(R[0] * d[0] + R[1] * d[1] + R[2] * d[2],
                   R[3] * d[0] + R[4] * d[1] + R[5] * d[2],
                   R[6] * d[0] + R[7] * d[1] + R[8] * d[2]);
}

struct imp__moved_at imp__moved_rest(const struct imp__glued *x)
{
    return (struct imp__moved_at){.p = x->p,
                                  .n = x->n,
                                  .s = x->s,
                                  .curvature = x->curvature,
                                  .straight = x->straight,
                                  .shade = imp__shading_normal(x),
                                  .strand = x->strand,
                                  .turn = {x->turn[0], x->turn[1]},
                                  .slope = {x->slope[0], x->slope[1]}};
}
struct imp__moved_at imp__moved_placed(const struct imp__moved_by *m,
                                       const struct imp__glued *x)
{
    struct imp__moved_at at = imp__moved_rest(x);
    if (x->carrier != m->shape) return at;
    if (m->pose->kind == IMP_POSE_SCALE) {
        at.p = m->from + (x->p - m->from) * m->by;
        at.curvature /= m->by;
        for (int k = 0; k < 2; k++) at.slope[k] *= 1 / m->by;
    } else {
        at.p = m->to + imp__moved_turn(m, x->p - m->from);
        at.n = imp__moved_turn(m, x->n);
        at.s = imp__moved_turn(m, x->s);
        at.straight = imp__moved_turn(m, x->straight);
        at.shade = imp__moved_turn(m, imp__shading_normal(x));
        for (int k = 0; k < 2; k++) {
            at.turn[k] = imp__moved_turn(m, x->turn[k]);
            at.slope[k] = imp__moved_turn(m, x->slope[k]);
        }
    }
    return at;
}

/* A direction, and a point, of what moves, as they were when the walk was recorded. */
static imp_v3 turned_back(const struct imp__moved_by *m, int carrier, imp_v3 d)
{
    const double *R = m->turn;
    if (carrier != m->shape || !imp__moves_rigidly(m)) return d;
    return imp__v3(R[0] * d[0] + R[3] * d[1] + R[6] * d[2],
                   R[1] * d[0] + R[4] * d[1] + R[7] * d[2],
                   R[2] * d[0] + R[5] * d[1] + R[8] * d[2]);
}
static imp_v3 was_at(const struct imp__moved_by *m, int carrier, imp_v3 x)
{
    const imp_v3 r = x - m->to;
    if (carrier != m->shape) return x;
    if (m->pose->kind == IMP_POSE_SCALE) return m->from + r * (1 / m->by);
    return m->from + turned_back(m, carrier, r);
}

imp_v3 imp__moved_shade(const struct imp__moved_by *m, const struct imp__glued *then,
                        imp_v3 x)
{
    const struct imp__corners f = imp__corners(m->c->problem->scene, then->shape,
                                               then->prim, then->place, then->time);
    const imp_v3 r = was_at(m, then->carrier, x) - then->p;
    double b[3] = {then->b[0], then->b[1], then->b[2]};
    imp_v3 N = {0};
    for (int k = 0; k < 2; k++) {
        b[k + 1] += imp__dot(then->slope[k], r);
        b[0] -= imp__dot(then->slope[k], r);
    }
    for (int k = 0; k < 3; k++) N += f.n[k] * b[k];
    N = imp__normalize(N);
    return then->carrier == m->shape && imp__moves_rigidly(m) ? imp__moved_turn(m, N) : N;
}

struct imp__glued imp__moved_glued(const struct imp_scene *scene,
                                   const struct imp_vertex *v, double time)
{
    struct imp__glued x =
        imp__glued_at(scene, v->d.shape, &v->d.located, v->d.place, time, v->ng);
    struct imp_surface at;
    if (v->bsdf && !imp__is_plain(v->bsdf) &&
        imp__decided_surface(scene, &v->d, time, &at))
        x.s = at.s;
    return x;
}

imp_v3 imp__moved_met(imp_v3 o, imp_v3 w, struct imp__moved_at *x)
{
    const double plane = imp__dot(x->n, x->p - o) / imp__dot(x->n, w);
    if (x->strand) { /* by its slopes, which is right to the first order */
        const imp_v3 p = o + w * plane, r = p - x->p;
        x->n = imp__normalize(x->n + x->turn[0] * imp__dot(x->slope[0], r) +
                              x->turn[1] * imp__dot(x->slope[1], r));
        return p;
    }
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

double imp__moved_receives(imp_v3 x, imp_v3 y, imp_v3 n_y)
{
    const imp_v3 r = y - x;
    const double d = imp__length(r);
    return imp__dot(n_y, r) / (d * d * d);
}

/* What the material looks up at x: of a shape that has moved since, where this point of it was when
 * the walk was recorded. */
static void looked_up(const struct imp__moved_by *m, const struct imp_vertex *v, imp_v3 x,
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
    } else if (imp__decided_surface(scene, &v->d, then->time, &old)) {
        imp__surface_grad(&old, grad);
        for (int k = 0; k < 2; k++) at.uv[k] += imp__dot(grad[k], x - then->p);
    }
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &at, in);
}

/* The density of directions of a meter, where it was when the walk was recorded. */
static double received(const struct imp__moved_by *m, imp_v3 w)
{
    const struct imp_receiver *r = m->c->tracer.sensor->receiver;
    return imp__receiver_density(r, imp__to_local(&r->frame, w));
}

imp_spec imp__moved_kernel(const struct imp__moved_by *m, const struct imp_vertex *v,
                           const struct imp__moved_at *now, imp_v3 x, const imp_v3 o[2],
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

double imp__moved_light(const struct imp__moved_by *m, const struct imp_vertex *v,
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
        imp__glued_at(scene, e->shape->index, &v->d.light.located, 0, old->time, d);
    const struct imp__moved_at there = imp__moved_placed(m, &y);
    w[0] = imp__normalize(there.p - x);
    w[1] = imp__normalize(y.p - old->p);
    *farther = imp__length(there.p - x) - imp__length(y.p - old->p);
    return imp__moved_receives(x, there.p, there.n) /
           imp__moved_receives(old->p, y.p, y.n);
}
