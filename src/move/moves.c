/* SPDX-License-Identifier: Apache-2.0
 *
 * Movers, the velocities that they give, and the transposes (moves.h). */
#include "moves.h"
#include "base/context.h"
#include "scene/pose.h"

struct imp__moves imp__moves_begin(const struct imp_scene *scene,
                                   const struct imp_sensor *sensor)
{
    return (struct imp__moves){.scene = scene, .sensor = sensor};
}

void imp__moves_free(struct imp__moves *moves)
{
    if (moves->scene) imp__release(moves->scene->ctx, moves->mover);
    *moves = (struct imp__moves){0};
}

enum imp_status imp__moves_add(struct imp__moves *moves, enum imp__move_kind kind,
                               int shape)
{
    imp_context *ctx = moves->scene->ctx;
    struct imp__mover m = {.kind = kind, .shape = shape, .first = moves->n};
    if (shape == IMP_MOVE_CAMERA) {
        if (kind != IMP_MOVE_POSE || !imp__pinhole(moves->sensor, &m.centre))
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "sensor '%s': its rays meet in no point, and it has no "
                              "derivative by its pose",
                              moves->sensor->name);
        m.count = 6;
    } else {
        const struct imp_shape *s = moves->scene->shapes[shape];
        if (s->geometry != IMP_TRIANGLES)
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "shape '%s' (%s) is not made of triangles, and has no "
                              "derivative by its place",
                              s->name, s->ops->name);
        if (kind == IMP_MOVE_VERTICES && s->ops->surface != imp__mesh_surface)
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "shape '%s' (%s) is no mesh, and has no vertices that move",
                              s->name, s->ops->name);
        m.centre = (s->lo + s->hi) * 0.5;
        m.count = kind == IMP_MOVE_POSE    ? 6
                  : kind == IMP_MOVE_SCALE ? 1
                                           : 3 * s->triangles.n_vertices;
    }
    struct imp__mover *more = imp__grow(ctx, moves->mover, &moves->cap_movers,
                                        (size_t)moves->n_movers + 1, sizeof *more);
    if (!more) return imp__error(ctx, IMP_E_NOMEM, "no memory for what moves");
    moves->mover = more;
    moves->mover[moves->n_movers++] = m;
    moves->n += m.count;
    return IMP_OK;
}

bool imp__moves_shape(const struct imp__moves *moves, int shape,
                      const struct imp__mover *but)
{
    for (int k = 0; k < moves->n_movers; k++)
        if (moves->mover[k].shape == shape && &moves->mover[k] != but) return true;
    return false;
}

/* ---- Points ------------------------------------------------------------------------ */

struct corners {
    const uint32_t *index;
    imp_v3 p0, e1, e2;
};

static imp_v3 vertex(const struct imp_triangles *t, uint32_t i)
{
    const float *p = t->positions + 3 * (size_t)i;
    return imp__v3(p[0], p[1], p[2]);
}

static struct corners corners(const struct imp_scene *scene, int shape, int prim)
{
    const struct imp_triangles *t = &scene->shapes[shape]->triangles;
    const uint32_t *i = t->indices + 3 * (size_t)prim;
    const imp_v3 p0 = vertex(t, i[0]);
    return (struct corners){i, p0, vertex(t, i[1]) - p0, vertex(t, i[2]) - p0};
}

static struct imp__glued glued(const struct imp_scene *scene, int shape, int prim,
                               double b1, double b2, imp_v3 side)
{
    const struct corners c = corners(scene, shape, prim);
    struct imp__glued x = {shape, prim, {1 - b1 - b2, b1, b2}, {0}, {0}};
    x.p = c.p0 + c.e1 * b1 + c.e2 * b2;
    x.n = imp__normalize(imp__cross(c.e1, c.e2));
    if (imp__dot(x.n, side) < 0) x.n = -x.n;
    return x;
}

struct imp__glued imp__glued_at(const struct imp_scene *scene, int shape,
                                const struct imp_located *x, imp_v3 n)
{
    return glued(scene, shape, x->prim, x->at[0], x->at[1], n);
}

struct imp__glued imp__glued_near(const struct imp_scene *scene, int shape, int prim,
                                  imp_v3 p, imp_v3 n)
{
    double b[3];
    imp__triangle_weights(scene->shapes[shape], prim, &p, b);
    return glued(scene, shape, prim, b[1], b[2], n);
}

/* ---- Velocities -------------------------------------------------------------------- */

static imp_v3 number3(const double *theta)
{
    return imp__v3(theta[0], theta[1], theta[2]);
}
static void add3(double *bar, imp_v3 v)
{
    for (int i = 0; i < 3; i++) bar[i] += v[i];
}

/* n = c/|c|, c = e1 x e2: n' and the logarithm of |c|. */
static void vertices_velocity(const struct imp__moves *moves, const struct imp__glued *x,
                              const double *theta, struct imp__velocity *out)
{
    const struct corners k = corners(moves->scene, x->shape, x->prim);
    const imp_v3 v0 = number3(theta + 3 * (size_t)k.index[0]),
                 v1 = number3(theta + 3 * (size_t)k.index[1]),
                 v2 = number3(theta + 3 * (size_t)k.index[2]);
    const imp_v3 c = imp__cross(k.e1, k.e2), n = imp__normalize(c);
    const imp_v3 c_dot = imp__cross(v1 - v0, k.e2) + imp__cross(k.e1, v2 - v0);
    const double inverse = 1 / imp__length(c), along = imp__dot(n, c_dot) * inverse;
    const double side = imp__dot(n, x->n) < 0 ? -1 : 1;
    out->v += v0 * x->b[0] + v1 * x->b[1] + v2 * x->b[2];
    out->n += (c_dot * inverse - n * along) * side;
    out->area += along;
}

static void vertices_bar(const struct imp__moves *moves, const struct imp__glued *x,
                         const struct imp__velocity *bar, double *theta_bar)
{
    const struct corners k = corners(moves->scene, x->shape, x->prim);
    const imp_v3 c = imp__cross(k.e1, k.e2), n = imp__normalize(c);
    const double inverse = 1 / imp__length(c), side = imp__dot(n, x->n) < 0 ? -1 : 1;
    const imp_v3 turn = bar->n * side;
    const imp_v3 c_bar = (turn - n * imp__dot(n, turn) + n * bar->area) * inverse;
    const imp_v3 e1_bar = imp__cross(k.e2, c_bar), e2_bar = imp__cross(c_bar, k.e1);
    add3(theta_bar + 3 * (size_t)k.index[0], bar->v * x->b[0] - e1_bar - e2_bar);
    add3(theta_bar + 3 * (size_t)k.index[1], bar->v * x->b[1] + e1_bar);
    add3(theta_bar + 3 * (size_t)k.index[2], bar->v * x->b[2] + e2_bar);
}

struct imp__velocity imp__velocity_of(const struct imp__moves *moves,
                                      const struct imp__glued *x, const double *theta_dot)
{
    struct imp__velocity out = {{0}, {0}, 0};
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != x->shape) continue;
        const double *theta = theta_dot + m->first;
        const imp_v3 r = x->p - m->centre;
        switch (m->kind) {
        case IMP_MOVE_POSE:
            out.v += number3(theta) + imp__cross(number3(theta + 3), r);
            out.n += imp__cross(number3(theta + 3), x->n);
            break;
        case IMP_MOVE_SCALE:
            out.v += r * theta[0];
            out.area += 2 * theta[0];
            break;
        case IMP_MOVE_VERTICES: vertices_velocity(moves, x, theta, &out); break;
        }
    }
    return out;
}

void imp__velocity_bar(const struct imp__moves *moves, const struct imp__glued *x,
                       const struct imp__velocity *bar, double *theta_bar)
{
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != x->shape) continue;
        double *theta = theta_bar + m->first;
        const imp_v3 r = x->p - m->centre;
        switch (m->kind) {
        case IMP_MOVE_POSE:
            add3(theta, bar->v);
            add3(theta + 3, imp__cross(r, bar->v) + imp__cross(x->n, bar->n));
            break;
        case IMP_MOVE_SCALE: theta[0] += imp__dot(r, bar->v) + 2 * bar->area; break;
        case IMP_MOVE_VERTICES: vertices_bar(moves, x, bar, theta); break;
        }
    }
}

imp_v3 imp__camera_velocity(const struct imp__moves *moves, imp_v3 p,
                            const double *theta_dot)
{
    imp_v3 u = {0};
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != IMP_MOVE_CAMERA) continue;
        const double *theta = theta_dot + m->first;
        u += number3(theta) + imp__cross(number3(theta + 3), p - m->centre);
    }
    return u;
}

void imp__camera_velocity_bar(const struct imp__moves *moves, imp_v3 p, imp_v3 bar,
                              double *theta_bar)
{
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != IMP_MOVE_CAMERA) continue;
        add3(theta_bar + m->first, bar);
        add3(theta_bar + m->first + 3, imp__cross(p - m->centre, bar));
    }
}
