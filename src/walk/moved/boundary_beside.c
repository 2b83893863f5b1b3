/* SPDX-License-Identifier: Apache-2.0
 *
 * Where a look past an edge goes (boundary.h). A face beside the edge may be seen at so flat an angle
 * that it is narrower than the look is apart from the edge: near silhouettes of fine meshes that is so
 * along a part of each edge that does not shrink with the triangles. Such a look would pass the face,
 * and see the jump of the silhouette behind it, which has draws of its own, a second time. It goes
 * to a point of the face instead.
 *
 * What is seen of a face is seen next to the edge, by weights of its corners in double, and not where a
 * ray beside the edge meets it: on a face at a flat angle that is far away, and what differs in
 * between would count as a jump. */
#include "boundary_parts.h"
#include "scene/instances.h"
#include "walk/core/step.h"

/* The face that a look along w sees first on the side that m points to. NULL: none is there. */
static const struct imp__edge_face *face_seen(const struct imp__edge_draw *d, imp_v3 w,
                                              imp_v3 m)
{
    const struct imp__edge_face *seen = NULL;
    double least = INFINITY;
    for (int k = 0; k < d->edge->n_faces; k++) {
        const struct imp__edge_face *f = &d->edges->face[d->edge->first + (size_t)k];
        const double side = imp__dot(f->in, m), depth = imp__dot(f->in, w) / side;
        if (!(side > 0) || !(depth < least)) continue;
        least = depth;
        seen = f;
    }
    return seen;
}

#define NEXT 0.3 /* per `apart`: so far from the edge, in a face */

/* Is a point of the triangle's plane in it? */
static bool is_inside(const imp_v3 p[3], imp_v3 n, imp_v3 q)
{
    int same = 0;
    for (int k = 0; k < 3; k++) {
        const imp_v3 side = p[(k + 1) % 3] - p[k];
        const double turn = imp__dot(imp__cross(side, q - p[k]), n);
        same += turn > 0 ? 1 : turn < 0 ? -1 : 0;
    }
    return same == 3 || same == -3;
}

/* From the edge's point into the face: to its middle, or, where a seam divides it, to half the way to the
 * corner that is farthest from the seam. */
static imp_v3 inwards(const struct imp__edge_draw *d, const struct imp__edge_face *f,
                      const imp_v3 p[3])
{
    imp_v3 r = (p[0] + p[1] + p[2]) * (1.0 / 3) - d->p;
    if (!d->edge->seam) return r;
    for (int k = 0; k < 3; k++)
        if (k == 0 || imp__dot(p[k] - d->p, f->in) > 2 * imp__dot(r, f->in))
            r = (p[k] - d->p) * 0.5;
    return r;
}

/* The point at which a look aims, where this face, with its corners, is seen beside the edge. */
static imp_v3 beside_face(const struct imp__edge_draw *d, const struct imp__edge_face *f,
                          const imp_v3 p[3], imp_v3 w, imp_v3 m, double apart)
{
    const imp_v3 past = d->p + m * apart;
    if (is_inside(p, f->n, past - w * (apart * imp__dot(m, f->n) / imp__dot(w, f->n))))
        return past;
    const imp_v3 middle = inwards(d, f, p);
    const double across = imp__dot(middle, m);
    return d->p + middle * (across > 2 * apart ? apart / across : 0.5);
}

static struct imp__corners corners_of(const struct imp__edge_draw *d,
                                      const struct imp__edge_face *f)
{
    return imp__corners(d->b->tracer->scene, f->shape, f->prim, f->place, d->time);
}

imp_v3 imp__edge_beside(const struct imp__edge_draw *d, imp_v3 w, imp_v3 m, double apart)
{
    const struct imp__edge_face *f = d->edge ? face_seen(d, w, m) : NULL;
    if (!f) return d->p + m * (d->rim ? imp__strand_apart(d, w, apart) : apart);
    const struct imp__corners facet = corners_of(d, f);
    return beside_face(d, f, facet.p, w, m, apart);
}

/* Weights of the second and third corner at a point of the triangle's plane. */
static void weights(const imp_v3 p[3], imp_v3 q, double b[2])
{
    const imp_v3 e1 = p[1] - p[0], e2 = p[2] - p[0], r = q - p[0];
    const double aa = imp__dot(e1, e1), ab = imp__dot(e1, e2), bb = imp__dot(e2, e2);
    const double ra = imp__dot(r, e1), rb = imp__dot(r, e2), det = aa * bb - ab * ab;
    b[0] = (bb * ra - ab * rb) / det;
    b[1] = (aa * rb - ab * ra) / det;
}

bool imp__edge_face_hit(const struct imp__edge_draw *d, const struct imp__edge_face *f,
                        const struct imp_hit *hit)
{
    /* An instance may have a material of its own, and with it a shape. */
    return hit->prim == f->prim && hit->place == f->place &&
           (hit->shape == f->shape ||
            hit->shape == imp__placed_shape(d->b->tracer->scene, f->shape, f->place));
}

static void look_at(struct imp__edge_draw *d, const imp_v3 p[3], imp_v3 o,
                    struct imp_hit *hit, int before, struct imp_walk *walk)
{
    const imp_v3 r = p[0] + (p[1] - p[0]) * hit->u + (p[2] - p[0]) * hit->v - o;
    struct imp_sensor_ray ray = {.o = o, .t_near = 0, .t_far = INFINITY};
    hit->t = imp__length(r);
    ray.d = r * (1 / hit->t);
    imp__edge_walk(d, &ray, before, hit, walk);
}

void imp__look_at(struct imp__edge_draw *d, imp_v3 o, struct imp_hit *hit, int before,
                  struct imp_walk *walk)
{
    const struct imp__corners facet =
        imp__corners(d->b->tracer->scene, hit->shape, hit->prim, hit->place, d->time);
    look_at(d, facet.p, o, hit, before, walk);
}

bool imp__edge_face_look(struct imp__edge_draw *d, imp_v3 o, bool parallel, imp_v3 m,
                         double apart, int before, struct imp_walk *walk)
{
    const imp_v3 w = imp__normalize(d->p - o);
    const struct imp__edge_face *f = d->edge ? face_seen(d, w, m) : NULL;
    if (!f) return false;
    const struct imp__corners facet = corners_of(d, f);
    const imp_v3 *p = facet.p, past = beside_face(d, f, p, w, m, apart);
    const imp_v3 from = parallel ? o + (past - d->p) : o,
                 to = imp__normalize(past - from);
    struct imp_hit hit;
    if (!imp__intersect_at(d->b->tracer->scene, d->time, &from, &to, d->near, INFINITY,
                           &hit) ||
        !imp__edge_face_hit(d, f, &hit))
        return false;
    const imp_v3 middle = inwards(d, f, p);
    const double across = imp__dot(middle, f->in), next = NEXT * apart;
    double b[2];
    const imp_v3 on = middle * (across > 2 * next ? next / across : 0.5);
    if (parallel) o += on;
    weights(p, d->p + on, b);
    hit.u = b[0];
    hit.v = b[1];
    look_at(d, p, o, &hit, before, walk);
    return true;
}
