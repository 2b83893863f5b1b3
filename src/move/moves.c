/* SPDX-License-Identifier: Apache-2.0
 *
 * Movers, the velocities that they give, and the transposes (moves.h). */
#include "affine.h"
#include "base/arguments.h"
#include "base/context.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include "kind/emitter/projector.h"
#include "strand.h"
#include "suns.h"

struct imp__moves imp__moves_begin(const struct imp_scene *scene,
                                   const struct imp_sensor *sensor)
{
    return (struct imp__moves){
        .scene = scene, .sensor = sensor, .borders = {.scene = scene}};
}

void imp__moves_free(struct imp__moves *moves)
{
    for (int k = 0; k < moves->n_movers; k++) {
        imp__fans_free(moves->scene->ctx, moves->mover[k].fans);
        imp__release(moves->scene->ctx, moves->mover[k].suns);
    }
    if (moves->scene) imp__release(moves->scene->ctx, moves->mover);
    *moves = (struct imp__moves){0};
}

static enum imp_status camera_mover(const struct imp__moves *moves, struct imp__mover *m)
{
    const bool whole = m->kind == IMP_MOVE_POSE || m->kind == IMP_MOVE_AFFINE ||
                       m->kind == IMP_MOVE_TURN;
    if ((!whole && m->kind < IMP_MOVE_VIEW) ||
        !imp__lens_middle(moves->sensor, &m->centre))
        return imp__error(moves->scene->ctx, IMP_E_UNSUPPORTED,
                          "sensor '%s': its rays meet in no point, and it has no "
                          "derivative by its pose",
                          moves->sensor->name);
    m->count = m->kind == IMP_MOVE_POSE     ? 6
               : m->kind == IMP_MOVE_TURN   ? 3
               : m->kind == IMP_MOVE_AFFINE ? IMP_AFFINE_NUMBERS
                                            : 1;
    /* A distant sensor turns about its target, or the middle of the scene. */
    if (m->kind == IMP_MOVE_TURN && !imp__sees_rays(moves->sensor, &m->centre))
        m->centre = moves->scene->ball.centre;
    if (whole || moves->sensor->ops->view_velocity || moves->sensor->ops->lens_velocity)
        return IMP_OK;
    return imp__error(moves->scene->ctx, IMP_E_UNSUPPORTED,
                      "sensor '%s' has no field of view that moves", moves->sensor->name);
}

static enum imp_status sun_mover(const struct imp__moves *moves, struct imp__mover *m)
{
    const struct imp_emitter *e = moves->scene->emitters[IMP_MOVE_EMITTER(m->shape)];
    struct imp__sky_sun sun;
    if (!imp__sky_sun_read(e, &sun))
        return imp__error(moves->scene->ctx, IMP_E_UNSUPPORTED,
                          "light '%s' (%s) has no sun", e->name, e->ops->name);
    m->axis = sun.towards;
    if (m->kind == IMP_MOVE_DISC) {
        m->count = 1;
        m->rate = 1 / tan(sun.radius / 2);
        if (!sun.power) return IMP_OK; /* it is as bright */
    }
    return imp__suns_make(moves->scene->ctx, e, m->kind, &m->suns);
}

static enum imp_status light_mover(struct imp__moves *moves, struct imp__mover *m)
{
    struct imp_emitter *e = moves->scene->emitters[IMP_MOVE_EMITTER(m->shape)];
    const bool sky = e->ops->flags & IMP_EMITTER_ENVIRONMENT;
    double v[3];
    m->count = m->kind == IMP_MOVE_AFFINE ? IMP_AFFINE_NUMBERS : 3;
    moves->skies |= sky;
    if (m->kind == IMP_MOVE_SUN || m->kind == IMP_MOVE_DISC) return sun_mover(moves, m);
    if (sky && m->kind == IMP_MOVE_TURN) return IMP_OK; /* about the middle of all */
    if (m->kind == IMP_MOVE_SPREAD) {
        m->count = 1;
        m->axis = imp__light_frame_of(e)->axis[2];
        imp__projector_fov(e, &m->rate);
        return IMP_OK;
    }
    if (!e->ops->aim || m->kind == IMP_MOVE_TURN ||
        (m->kind == IMP_MOVE_AXIS && !imp__light_frame_of(e) &&
         e->ops != &imp__ies_light && !sky))
        return imp__error(moves->scene->ctx, IMP_E_UNSUPPORTED,
                          "light '%s' (%s) has no derivative by its %s", e->name,
                          e->ops->name, m->kind == IMP_MOVE_AXIS ? "direction" : "place");
    e->ops->aim(e, v, false);
    m->axis = imp__v3(v[0], v[1], v[2]);
    if (sky) return IMP_OK;
    m->centre = m->axis;
    if (m->kind == IMP_MOVE_AXIS) {
        imp__pose_aim(e, IMP_POSE_DIRECTION, v);
        m->axis = imp__v3(v[0], v[1], v[2]);
    }
    return IMP_OK;
}

static enum imp_status shape_mover(const struct imp__moves *moves, struct imp__mover *m)
{
    imp_context *ctx = moves->scene->ctx;
    const struct imp_shape *s = moves->scene->shapes[m->shape];
    if (s->geometry != IMP_TRIANGLES && !imp__moves_curved(moves->scene, m->shape, 0))
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "shape '%s' (%s) is neither made of triangles nor a sphere, "
            "disk, circular cylinder or bsplinecurve, and has no derivative by its place",
            s->name, s->ops->name);
    if ((m->kind == IMP_MOVE_VERTICES || m->kind == IMP_MOVE_NORMALS) &&
        (s->geometry != IMP_TRIANGLES || s->ops->surface != imp__mesh_surface))
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "shape '%s' (%s) is no mesh, and has no vertices that move",
                          s->name, s->ops->name);
    if ((m->kind == IMP_MOVE_CONTROL) && s->geometry != IMP_CURVES)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "shape '%s' (%s) is no bsplinecurve, and has no points of "
                          "control",
                          s->name, s->ops->name);
    m->centre = (s->lo + s->hi) * 0.5;
    m->count = m->kind == IMP_MOVE_POSE      ? 6
               : m->kind == IMP_MOVE_SCALE   ? 1
               : m->kind == IMP_MOVE_AFFINE  ? IMP_AFFINE_NUMBERS
               : m->kind == IMP_MOVE_CONTROL ? 4 * s->curves.n_points
                                             : 3 * s->triangles.n_vertices;
    if (m->kind != IMP_MOVE_VERTICES || !imp__moves_smooth(moves->scene, m->shape))
        return IMP_OK;
    m->count *= 2;
    return imp__fans_make(ctx, &s->triangles, &m->fans);
}

static enum imp_status instance_mover(const struct imp__moves *moves,
                                      struct imp__mover *m)
{
    const struct imp_instance *p =
        &moves->scene->world->instance[m->shape - IMP_MOVE_INSTANCE(0)];
    m->centre = imp__map_point(&p->to_world, (p->group->lo + p->group->hi) * 0.5);
    m->count = m->kind == IMP_MOVE_POSE || m->kind == IMP_MOVE_KEY ? 6
               : m->kind == IMP_MOVE_AFFINE                        ? IMP_AFFINE_NUMBERS
                                                                   : 1;
    return IMP_OK;
}

enum imp_status imp__moves_add(struct imp__moves *moves, enum imp__move_kind kind,
                               int shape)
{
    imp_context *ctx = moves->scene->ctx;
    struct imp__mover m = {.kind = kind, .shape = shape, .first = moves->n, .rate = 1};
    const enum imp_status st = shape >= 0                      ? shape_mover(moves, &m)
                               : shape == IMP_MOVE_CAMERA      ? camera_mover(moves, &m)
                               : imp__is_moved_instance(shape) ? instance_mover(moves, &m)
                                                               : light_mover(moves, &m);
    if (st != IMP_OK) return st;
    struct imp__mover *more = imp__grow(ctx, moves->mover, &moves->cap_movers,
                                        (size_t)moves->n_movers + 1, sizeof *more);
    if (!more) {
        imp__fans_free(ctx, m.fans);
        imp__release(ctx, m.suns);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for what moves");
    }
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

bool imp__moves_place(const struct imp__moves *moves, int shape)
{
    for (int k = 0; k < moves->n_movers; k++)
        if (moves->mover[k].shape == shape && moves->mover[k].kind != IMP_MOVE_NORMALS)
            return true;
    return false;
}

/* ---- Velocities -------------------------------------------------------------------- */

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

/* s = in_edges[0] e1 + in_edges[1] e2. False: there is no s, or no triangle. */
static bool edges_of(const struct corners *k, imp_v3 s, double in_edges[2])
{
    const double a = imp__dot(k->e1, k->e1), c = imp__dot(k->e2, k->e2),
                 m = imp__dot(k->e1, k->e2), det = a * c - m * m;
    const double x = imp__dot(k->e1, s), y = imp__dot(k->e2, s);
    if (imp__is_zero(s) || !(det > 0)) return false;
    in_edges[0] = (c * x - m * y) / det;
    in_edges[1] = (a * y - m * x) / det;
    return true;
}

/* N/|N| by the normals [3 n_vertices] of a triangle's vertices. */
static void normals_velocity(const struct imp__glued *x, const uint32_t index[3],
                             const double *normals, struct imp__velocity *out)
{
    imp_v3 dot = {0};
    if (!x->smooth) return;
    for (int i = 0; i < 3; i++)
        dot += imp__move_vector(normals + 3 * (size_t)index[i]) * (x->b[i] / x->length);
    out->shade += dot - x->shade * imp__dot(x->shade, dot);
}
static void normals_bar(const struct imp__glued *x, const uint32_t index[3],
                        const struct imp__velocity *bar, double *normals)
{
    if (!x->smooth) return;
    const imp_v3 across = bar->shade - x->shade * imp__dot(x->shade, bar->shade);
    for (int i = 0; i < 3; i++)
        imp__move_vector_bar(normals + 3 * (size_t)index[i],
                             across * (x->b[i] / x->length));
}
static const uint32_t *vertices_of(const struct imp__moves *moves,
                                   const struct imp__glued *x)
{
    return moves->scene->shapes[x->shape]->triangles.indices + 3 * (size_t)x->prim;
}

/* n = c/|c|, c = e1 x e2: n' and the logarithm of |c|. */
static void vertices_velocity(const struct imp__moves *moves, const struct imp__glued *x,
                              const double *theta, struct imp__velocity *out)
{
    const struct corners k = corners(moves->scene, x->shape, x->prim);
    const imp_v3 v0 = imp__move_vector(theta + 3 * (size_t)k.index[0]),
                 v1 = imp__move_vector(theta + 3 * (size_t)k.index[1]),
                 v2 = imp__move_vector(theta + 3 * (size_t)k.index[2]);
    const imp_v3 c = imp__cross(k.e1, k.e2), n = imp__normalize(c);
    const imp_v3 c_dot = imp__cross(v1 - v0, k.e2) + imp__cross(k.e1, v2 - v0);
    const double inverse = 1 / imp__length(c), along = imp__dot(n, c_dot) * inverse;
    const double side = imp__dot(n, x->n) < 0 ? -1 : 1;
    out->v += v0 * x->b[0] + v1 * x->b[1] + v2 * x->b[2];
    out->n += (c_dot * inverse - n * along) * side;
    out->area += along;
    normals_velocity(x, k.index,
                     theta + 3 * moves->scene->shapes[x->shape]->triangles.n_vertices,
                     out);
    double in_edges[2];
    if (!edges_of(&k, x->s, in_edges)) return;
    const imp_v3 s_dot = (v1 - v0) * in_edges[0] + (v2 - v0) * in_edges[1];
    out->turn += imp__dot(imp__cross(x->n, x->s), s_dot);
}

static void vertices_bar(const struct imp__moves *moves, const struct imp__glued *x,
                         const struct imp__velocity *bar, double *theta_bar)
{
    const struct corners k = corners(moves->scene, x->shape, x->prim);
    const imp_v3 c = imp__cross(k.e1, k.e2), n = imp__normalize(c);
    const double inverse = 1 / imp__length(c), side = imp__dot(n, x->n) < 0 ? -1 : 1;
    const imp_v3 turn = bar->n * side;
    const imp_v3 c_bar = (turn - n * imp__dot(n, turn) + n * bar->area) * inverse;
    imp_v3 e1_bar = imp__cross(k.e2, c_bar), e2_bar = imp__cross(c_bar, k.e1);
    double in_edges[2];
    if (bar->turn != 0 && edges_of(&k, x->s, in_edges)) {
        const imp_v3 s_bar = imp__cross(x->n, x->s) * bar->turn;
        e1_bar += s_bar * in_edges[0];
        e2_bar += s_bar * in_edges[1];
    }
    imp__move_vector_bar(theta_bar + 3 * (size_t)k.index[0],
                         bar->v * x->b[0] - e1_bar - e2_bar);
    imp__move_vector_bar(theta_bar + 3 * (size_t)k.index[1], bar->v * x->b[1] + e1_bar);
    imp__move_vector_bar(theta_bar + 3 * (size_t)k.index[2], bar->v * x->b[2] + e2_bar);
    normals_bar(x, k.index, bar,
                theta_bar + 3 * moves->scene->shapes[x->shape]->triangles.n_vertices);
}

struct imp__velocity imp__velocity_of(const struct imp__moves *moves,
                                      const struct imp__glued *x, const double *theta_dot)
{
    struct imp__velocity out = {.area = 0};
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != x->carrier) continue;
        const double *theta = theta_dot + m->first;
        const imp_v3 r = x->p - m->centre;
        switch (m->kind) {
        case IMP_MOVE_POSE:
            out.v += imp__move_vector(theta) + imp__cross(imp__move_vector(theta + 3), r);
            out.n += imp__cross(imp__move_vector(theta + 3), x->n);
            out.shade += imp__cross(imp__move_vector(theta + 3), x->shade);
            out.turn += imp__dot(imp__move_vector(theta + 3), x->n);
            break;
        case IMP_MOVE_KEY: {
            const struct imp__turned by = imp__key_turned(moves, m, x->time, theta);
            out.v += by.e + imp__cross(by.a, x->p - by.c);
            out.n += imp__cross(by.a, x->n);
            out.shade += imp__cross(by.a, x->shade);
            out.turn += imp__dot(by.a, x->n);
            break;
        }
        case IMP_MOVE_SCALE:
            out.v += r * (m->rate * theta[0]);
            out.area += 2 * m->rate * theta[0];
            break;
        case IMP_MOVE_VERTICES: vertices_velocity(moves, x, theta, &out); break;
        case IMP_MOVE_NORMALS:
            normals_velocity(x, vertices_of(moves, x), theta, &out);
            break;
        case IMP_MOVE_CONTROL: imp__strand_velocity(moves, x, theta, &out); break;
        case IMP_MOVE_AFFINE:
            imp__affine_velocity(moves->scene, x, r, theta, &out);
            break;
        default: break;
        }
    }
    return out;
}

void imp__velocity_bar(const struct imp__moves *moves, const struct imp__glued *x,
                       const struct imp__velocity *bar, double *theta_bar)
{
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != x->carrier) continue;
        double *theta = theta_bar + m->first;
        const imp_v3 r = x->p - m->centre;
        switch (m->kind) {
        case IMP_MOVE_POSE:
            imp__move_vector_bar(theta, bar->v);
            imp__move_vector_bar(theta + 3, imp__cross(r, bar->v) +
                                                imp__cross(x->n, bar->n) +
                                                x->n * bar->turn);
            if (x->smooth)
                imp__move_vector_bar(theta + 3, imp__cross(x->shade, bar->shade));
            break;
        case IMP_MOVE_KEY: {
            const imp_v3 c = imp__key_turned(moves, m, x->time, NULL).c;
            imp_v3 turn = imp__cross(x->p - c, bar->v) + imp__cross(x->n, bar->n) +
                          x->n * bar->turn;
            if (x->smooth) turn += imp__cross(x->shade, bar->shade);
            imp__key_turned_bar(moves, m, x->time, bar->v, turn, theta);
            break;
        }
        case IMP_MOVE_SCALE:
            theta[0] += m->rate * (imp__dot(r, bar->v) + 2 * bar->area);
            break;
        case IMP_MOVE_VERTICES: vertices_bar(moves, x, bar, theta); break;
        case IMP_MOVE_NORMALS: normals_bar(x, vertices_of(moves, x), bar, theta); break;
        case IMP_MOVE_CONTROL: imp__strand_bar(moves, x, bar, theta); break;
        case IMP_MOVE_AFFINE: imp__affine_bar(moves->scene, x, r, bar, theta); break;
        default: break;
        }
    }
}

size_t imp__mover_touched(const struct imp__moves *moves, const struct imp__mover *mover,
                          const struct imp__glued *x, size_t index[IMP_TOUCHED_MOST])
{
    size_t n = 0;
    if (mover->kind == IMP_MOVE_CONTROL) {
        const struct imp_curves *k = &moves->scene->shapes[x->shape]->curves;
        for (; n < 4 * ((size_t)k->degree + 1); n++)
            index[n] = mover->first + 4 * (size_t)k->first[x->prim] + n;
        return n;
    }
    if (mover->kind != IMP_MOVE_VERTICES && mover->kind != IMP_MOVE_NORMALS) {
        for (; n < mover->count; n++) index[n] = mover->first + n;
        return n;
    }
    const struct imp_triangles *t = &moves->scene->shapes[x->shape]->triangles;
    for (size_t row = 0; row < mover->count / (3 * t->n_vertices); row++)
        for (int k = 0; k < 9; k++) {
            const uint32_t vertex = t->indices[3 * (size_t)x->prim + (size_t)(k / 3)];
            index[n++] =
                mover->first + 3 * (row * t->n_vertices + vertex) + (size_t)(k % 3);
        }
    return n;
}
