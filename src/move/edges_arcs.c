/* SPDX-License-Identifier: Apache-2.0
 *
 * Seams of spheres (edges.h): circles in which they cross the planes of triangles, as far as these
 * reach, and other spheres. They move as seams of triangles do (edges_seams.h), with the normals of both
 * surfaces at each point. */
#include "base/arguments.h"
#include "base/context.h"
#include "edges.h"
#include "math/warp.h"

#define TOUCH 1e-5 /* of a sphere's radius: nearer surfaces touch it */

struct arcs {
    const struct imp_scene *scene;
    struct imp__edges *out;
    size_t cap;
};

static enum imp_status arc_add(struct arcs *x, const struct imp__arc *circle, double from,
                               double till)
{
    struct imp__edges *e = x->out;
    struct imp__arc *more =
        imp__grow(e->ctx, e->arc, &x->cap, e->n_arcs + 1, sizeof *more);
    if (!more) return imp__error(e->ctx, IMP_E_NOMEM, "no memory for edges");
    e->arc = more;
    more[e->n_arcs] = *circle;
    more[e->n_arcs].from = from;
    more[e->n_arcs++].till = till;
    return IMP_OK;
}

/* A circle about a point, in the plane across the unit vector n. */
static struct imp__arc circle_make(imp_v3 centre, imp_v3 n, double radius)
{
    const struct imp_frame f = imp__frame_from_normal(n);
    return (struct imp__arc){.centre = centre, .s = f.s, .t = f.t, .radius = radius};
}

/* Turns at which the circle crosses the line from p to q, in its plane. */
static int crossings(const struct imp__arc *c, imp_v3 n, imp_v3 p, imp_v3 q, double *turn)
{
    const imp_v3 in = imp__normalize(imp__cross(n, q - p));
    const double x = imp__dot(c->s, in), y = imp__dot(c->t, in);
    const double cosine = imp__dot(p - c->centre, in) / c->radius;
    if (!(fabs(cosine) < 1)) return 0;
    const double middle = atan2(y, x), half = acos(cosine);
    for (int k = 0; k < 2; k++) {
        const double at = (middle + (k ? half : -half)) / IMP_2PI;
        turn[k] = at - floor(at);
    }
    return 2;
}

static imp_v3 circle_point(const struct imp__arc *c, double turn)
{
    return c->centre +
           (c->s * cos(IMP_2PI * turn) + c->t * sin(IMP_2PI * turn)) * c->radius;
}

static bool is_inside(const struct imp__corners *f, imp_v3 n, imp_v3 p)
{
    for (int k = 0; k < 3; k++)
        if (imp__dot(imp__cross(f->p[(k + 1) % 3] - f->p[k], p - f->p[k]), n) < 0)
            return false;
    return true;
}

/* What of the circle is in the triangle: between crossings with its sides. */
static enum imp_status triangle_work(struct arcs *x, const struct imp__arc *ball,
                                     const struct imp_round *round,
                                     const struct imp__corners *f)
{
    const imp_v3 across = imp__cross(f->p[1] - f->p[0], f->p[2] - f->p[0]);
    if (imp__is_zero(across)) return IMP_OK;
    const imp_v3 n = imp__normalize(across);
    const double off = imp__dot(n, round->centre - f->p[0]);
    if (!(fabs(off) < round->radius * (1 - TOUCH))) return IMP_OK;
    struct imp__arc c = circle_make(round->centre - n * off, n,
                                    sqrt(round->radius * round->radius - off * off));
    c.side[0] = ball->side[0];
    c.side[1] = ball->side[1];
    c.side[1].n = n;
    double turn[7];
    int count = 0;
    for (int k = 0; k < 3; k++)
        count += crossings(&c, n, f->p[k], f->p[(k + 1) % 3], turn + count);
    if (count == 0)
        return is_inside(f, n, circle_point(&c, 0)) ? arc_add(x, &c, 0, 1) : IMP_OK;
    for (int i = 1; i < count; i++) /* sorted */
        for (int j = i; j > 0 && turn[j] < turn[j - 1]; j--) {
            const double other = turn[j];
            turn[j] = turn[j - 1];
            turn[j - 1] = other;
        }
    turn[count] = turn[0] + 1;
    for (int k = 0; k < count; k++)
        if (turn[k + 1] > turn[k] &&
            is_inside(f, n, circle_point(&c, 0.5 * (turn[k] + turn[k + 1]))))
            IMP_CHECKED(arc_add(x, &c, turn[k], turn[k + 1]));
    return IMP_OK;
}

static struct imp__edge_face face_of(const struct imp__body *body)
{
    return (struct imp__edge_face){
        .shape = body->shape, .prim = -1, .place = body->place};
}

static enum imp_status mesh_work(struct arcs *x, const struct imp__body *ball,
                                 const struct imp_round *round,
                                 const struct imp__body *mesh)
{
    const struct imp_shape *s = x->scene->shapes[mesh->shape];
    struct imp__arc c = {.side = {face_of(ball), face_of(mesh)}};
    struct imp_map map[2];
    if (mesh->place > 0) imp__place_map(x->scene, mesh->place, 0, &map[0], &map[1]);
    if (imp__body_is_away(x->scene, mesh, map, round)) return IMP_OK;
    for (size_t k = 0; k < s->triangles.n_triangles; k++) {
        const struct imp__corners f = imp__corners_mapped(x->scene, mesh->shape, (int)k,
                                                          mesh->place > 0 ? map : NULL);
        c.side[1].prim = (int)k;
        IMP_CHECKED(triangle_work(x, &c, round, &f));
    }
    return IMP_OK;
}

/* Two spheres: the plane of their circle is  d^2 + r_1^2 - r_2^2 over 2 d  from the first centre. */
static enum imp_status balls_work(struct arcs *x, const struct imp__body *a,
                                  const struct imp_round *p, const struct imp__body *b,
                                  const struct imp_round *q)
{
    const imp_v3 way = q->centre - p->centre;
    const double d = imp__length(way), r = p->radius;
    const double touch = TOUCH * imp_min(r, q->radius);
    if (!(d < r + q->radius - touch) || !(d > fabs(r - q->radius) + touch)) return IMP_OK;
    const double to = (d * d + r * r - q->radius * q->radius) / (2 * d);
    struct imp__arc c = circle_make(p->centre + way * (to / d), way * (1 / d),
                                    sqrt(imp_max(r * r - to * to, 0.0)));
    c.side[0] = face_of(a);
    c.side[1] = face_of(b);
    return arc_add(x, &c, 0, 1);
}

enum imp_status imp__arcs_find(const struct imp_scene *scene, struct imp__edges *edges)
{
    struct arcs x = {.scene = scene, .out = edges};
    for (size_t k = 0; k < edges->n_bodies; k++) {
        const struct imp__body *ball = &edges->body[k];
        struct imp_round round, other;
        if (!imp__moves_sphere(scene, ball->shape, ball->place, &round)) continue;
        for (size_t j = 0; j < edges->n_bodies; j++) {
            const struct imp__body *body = &edges->body[j];
            if (scene->shapes[body->shape]->geometry == IMP_TRIANGLES)
                IMP_CHECKED(mesh_work(&x, ball, &round, body));
            else if (j > k && imp__moves_sphere(scene, body->shape, body->place, &other))
                IMP_CHECKED(balls_work(&x, ball, &round, body, &other));
        }
    }
    return IMP_OK;
}

void imp__arc_point(const struct imp__arc *arc, double u, imp_v3 *p, imp_v3 *along)
{
    const double turn = arc->from + (arc->till - arc->from) * u;
    *p = circle_point(arc, turn);
    *along = arc->t * cos(IMP_2PI * turn) - arc->s * sin(IMP_2PI * turn);
}

void imp__arc_bar(const struct imp_scene *scene, const struct imp__arc *arc, imp_v3 p,
                  imp_v3 along, imp_v3 m, struct imp__glued x[2], imp_v3 bar[2])
{
    imp_v3 in[2];
    for (int k = 0; k < 2; k++) {
        const struct imp__edge_face *f = &arc->side[k];
        x[k] =
            imp__glued_near(scene, f->shape, imp_max(f->prim, 0), f->place, 0, p, f->n);
        in[k] = imp__cross(x[k].n, along);
    }
    for (int k = 0; k < 2; k++)
        bar[k] = x[k].n * (imp__dot(m, in[1 - k]) / imp__dot(x[k].n, in[1 - k]));
}
