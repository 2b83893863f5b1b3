/* SPDX-License-Identifier: Apache-2.0
 *
 * Curved shapes and the edges of a scene (edges.h): where surfaces pass through each other, and rims
 * that lie on each other. */
#include "edges.h"
#include "kind/sensor/receiver.h"
#include "math/offset.h"
#include "strand.h"

#define TOUCH 1e-5 /* of a sphere's radius: nearer surfaces touch it */
#define END   1e-5 /* of a segment: nearer hits are of what begins there */

/* Chords of a rim, by which it is tested: what is pierced by less than 3e-4 of the radius counts
 * as touched. */
#define CHORDS 128

/* A disk and the surface of a sphere. */
static bool disk_meets(const struct imp_scene *scene, const struct imp__body *disk,
                       const struct imp_round *round)
{
    double least = INFINITY, most = 0;
    bool over = true; /* is the centre above the disk? */
    for (int k = 0; k < CHORDS; k++) {
        const struct imp__rim_point rim =
            imp__rim(scene, disk->shape, disk->place, 0, (double)k / CHORDS);
        const imp_v3 r = rim.p - round->centre;
        least = imp_min(least, imp__length(r));
        most = imp_max(most, imp__length(r));
        over &= imp__dot(r, rim.out) > 0;
    }
    const struct imp__rim_point rim = imp__rim(scene, disk->shape, disk->place, 0, 0);
    if (over) least = imp_min(least, fabs(imp__dot(rim.n, rim.p - round->centre)));
    return least < round->radius * (1 - TOUCH) && most > round->radius * (1 + TOUCH);
}

static bool is_hit(const struct imp_hit *hit, int shape, int64_t place)
{
    return hit->shape == shape && hit->place == place;
}

/* A shape that a segment from a to b of a body passes through, from its ends inwards by `end` parts of
 * it; not `but`. -1: none. */
static int segment_pierces(const struct imp__edges *edges, const struct imp_scene *scene,
                           const struct imp__body *body, const struct imp__rim_name *but,
                           imp_v3 a, imp_v3 b, double end)
{
    for (int back = 0; back < 2; back++) { /* curves are met from outside alone */
        const imp_v3 o = back ? b : a, d = back ? a - b : b - a;
        struct imp_hit hit;
        for (double from = end; imp__intersect(scene, &o, &d, from, 1 - end, &hit);
             from = hit.t + END)
            if (imp__edges_pair(edges, scene, hit.shape, body->shape) &&
                !is_hit(&hit, body->shape, body->place) &&
                !(but && is_hit(&hit, but->shape, but->place)))
                return hit.shape;
    }
    return -1;
}

/* A shape that a rim passes through, or a straight line in a cylinder. */
static int rims_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                        int *other)
{
    for (size_t k = 0; k < edges->n_bodies; k++) {
        const struct imp__body *body = &edges->body[k];
        const int rims = imp__rims(scene, body->shape);
        struct imp__rim_name beside, *but = NULL;
        *other = body->shape;
        for (int j = 0; j < rims * CHORDS; j++) {
            const struct imp__rim_name rim = {body->shape, body->place, j / CHORDS};
            const double v = (double)(j % CHORDS) / CHORDS;
            const imp_v3 a = imp__rim(scene, rim.shape, rim.place, rim.k, v).p,
                         b = imp__rim(scene, rim.shape, rim.place, rim.k, v + 1. / CHORDS)
                                 .p;
            if (j % CHORDS == 0)
                but = imp__rim_beside(edges, scene, &rim, &beside) ? &beside : NULL;
            int met = segment_pierces(edges, scene, body, but, a, b, 0);
            if (met < 0 && rims == 2 && rim.k == 0)
                met = segment_pierces(edges, scene, body, NULL, a,
                                      imp__rim(scene, rim.shape, rim.place, 1, v).p, END);
            if (met >= 0) return met;
        }
    }
    return -1;
}

/* A sphere and the surface of a cylinder. */
static bool tube_meets(const struct imp__tube *c, const struct imp_round *round)
{
    const imp_v3 r = round->centre - c->base;
    const double z = imp__dot(r, c->axis), rho = imp__length(r - c->axis * z);
    const double below = imp_max(imp_max(-z, z - c->length), 0.0);
    const double least = hypot(rho - c->radius, below),
                 most = hypot(rho + c->radius, imp_max(fabs(z), fabs(z - c->length)));
    return least < round->radius * (1 - TOUCH) && most > round->radius * (1 + TOUCH);
}

/* A sphere and the circles of a curve. */
static bool strand_meets(const struct imp_scene *scene, const struct imp__body *body,
                         const struct imp_round *round)
{
    enum { PLACES = 16 };
    const struct imp_curves *k = &scene->shapes[body->shape]->curves;
    for (size_t i = 0; i < k->n_segments; i++)
        for (int m = 0; m <= PLACES; m++) {
            struct imp__strand x;
            imp__strand_at(scene, body->shape, body->place, (int)i, (double)m / PLACES,
                           &x);
            const struct imp__strand_axes axes = imp__strand_axes(&x);
            const imp_v3 r = round->centre - x.c;
            const double z = imp__dot(r, axes.a), rho = imp__length(r - axes.a * z);
            if (hypot(rho - x.r, z) < round->radius * (1 - TOUCH) &&
                hypot(rho + x.r, z) > round->radius * (1 + TOUCH))
                return true;
        }
    return false;
}

bool imp__body_is_away(const struct imp_scene *scene, const struct imp__body *body,
                       const struct imp_map *map, const struct imp_round *round)
{
    imp_v3 lo = scene->shapes[body->shape]->lo, hi = scene->shapes[body->shape]->hi;
    bool away = false;
    if (body->place > 0) imp__map_box(map, &lo, &hi);
    for (int k = 0; k < 3; k++)
        away |= round->centre[k] + round->radius < lo[k] ||
                round->centre[k] - round->radius > hi[k];
    return away;
}

/* Does the surface of a sphere meet this disk, cylinder or curve? Where they touch, it does not. */
static bool meets_sphere(const struct imp_scene *scene, const struct imp__body *body,
                         const struct imp_round *round)
{
    const int64_t place = body->place;
    struct imp_map map[2];
    struct imp__tube tube;
    if (place > 0) imp__place_map(scene, place, 0, &map[0], &map[1]);
    if (imp__body_is_away(scene, body, &map[0], round)) return false;
    if (imp__moves_cylinder(scene, body->shape, place, &tube))
        return tube_meets(&tube, round);
    if (imp__is_strand(scene, body->shape, place))
        return strand_meets(scene, body, round);
    return imp__moves_disk(scene, body->shape) && disk_meets(scene, body, round);
}

static int spheres_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                           int *other)
{
    for (size_t k = 0; k < edges->n_bodies; k++) {
        const struct imp__body *ball = &edges->body[k];
        struct imp_round round;
        if (!imp__moves_sphere(scene, ball->shape, ball->place, &round)) continue;
        for (size_t j = 0; j < edges->n_bodies; j++)
            if (j != k &&
                imp__edges_pair(edges, scene, ball->shape, edges->body[j].shape) &&
                meets_sphere(scene, &edges->body[j], &round)) {
                *other = edges->body[j].shape;
                return ball->shape;
            }
    }
    return -1;
}

/* ---- Curves ----------------------------------------------------------------------------- */

/* A point at a turn about a curve's line. */
static imp_v3 strand_place(const struct imp_scene *scene, const struct imp__body *body,
                           int segment, double v, double turn)
{
    struct imp__strand x;
    imp__strand_at(scene, body->shape, body->place, segment, v, &x);
    const struct imp__strand_axes axes = imp__strand_axes(&x);
    return x.c + (axes.s * cos(IMP_2PI * turn) + axes.t * sin(IMP_2PI * turn)) * x.r;
}

/* Is it this segment, or does it go on where this one ends? */
static bool is_neighbour(const struct imp_curves *c, int segment, int other)
{
    return other == segment || (other == segment + 1 && c->joined[segment] & 2) ||
           (other == segment - 1 && c->joined[segment] & 1);
}

/* What a line passes through on its way from a to b: another shape, or a segment of the same that is no
 * neighbour. -1: nothing. */
static int line_pierces(const struct imp__edges *edges, const struct imp_scene *scene,
                        const struct imp__body *body, int segment, imp_v3 a, imp_v3 b)
{
    const struct imp_curves *c = &scene->shapes[body->shape]->curves;
    const imp_v3 d = b - a;
    struct imp_hit hit;
    for (double from = END; imp__intersect(scene, &a, &d, from, 1 - END, &hit);
         from = hit.t + END) {
        const bool own = is_hit(&hit, body->shape, body->place);
        if (own ? !is_neighbour(c, segment, hit.prim)
                : imp__edges_pair(edges, scene, hit.shape, body->shape))
            return hit.shape;
    }
    return -1;
}

/* A chord of a curve's surface, both ways: curves are met from outside alone. */
static int chord_pierces(const struct imp__edges *edges, const struct imp_scene *scene,
                         const struct imp__body *body, int segment, imp_v3 a, imp_v3 b)
{
    const int met = line_pierces(edges, scene, body, segment, a, b);
    return met >= 0 ? met : line_pierces(edges, scene, body, segment, b, a);
}

/* Lines along a curve, and the rims of its ends. */
static int strands_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                           int *other)
{
    enum { ALONG = 4, AROUND = 6, RIM = 16 };
    for (size_t k = 0; k < edges->n_bodies; k++) {
        const struct imp__body *body = &edges->body[k];
        const struct imp_curves *c = &scene->shapes[body->shape]->curves;
        if (!imp__is_strand(scene, body->shape, body->place)) continue;
        *other = body->shape;
        for (int i = 0; i < (int)c->n_segments; i++) {
            const int ends = imp__strand_ends(c, i);
            for (int j = 0; j < AROUND * ALONG; j++) {
                const double turn = (double)(j / ALONG) / AROUND, v = j % ALONG;
                const int met = chord_pierces(
                    edges, scene, body, i, strand_place(scene, body, i, v / ALONG, turn),
                    strand_place(scene, body, i, (v + 1) / ALONG, turn));
                if (met >= 0) return met;
            }
            for (int j = 0; j < 2 * RIM; j++) {
                const int end = j / RIM;
                if (!(ends & 1 << end)) continue;
                const double turn = (double)(j % RIM) / RIM;
                const int met = chord_pierces(
                    edges, scene, body, i, strand_place(scene, body, i, end, turn),
                    strand_place(scene, body, i, end, turn + 1.0 / RIM));
                if (met >= 0) return met;
            }
        }
    }
    return -1;
}

int imp__curved_pierced(const struct imp__edges *edges, const struct imp_scene *scene,
                        int *other)
{
    int pierced = spheres_pierced(edges, scene, other);
    if (pierced < 0) pierced = strands_pierced(edges, scene, other);
    return pierced >= 0 ? pierced : rims_pierced(edges, scene, other);
}

/* ---- Rims that lie on each other ------------------------------------------------------ */

static bool is_same(const struct imp__rim_name *a, const struct imp__rim_name *b)
{
    return a->shape == b->shape && a->place == b->place && a->k == b->k;
}

bool imp__rim_beside(const struct imp__edges *edges, const struct imp_scene *scene,
                     const struct imp__rim_name *rim, struct imp__rim_name *beside)
{
    for (size_t j = 0; j < edges->n_bodies; j++) {
        const struct imp__body *body = &edges->body[j];
        *beside = (struct imp__rim_name){body->shape, body->place, 0};
        for (; beside->k < imp__rims(scene, body->shape); beside->k++)
            if (!is_same(rim, beside) && imp__rims_meet(scene, rim, beside)) return true;
    }
    return false;
}

int imp__rims_torn(const struct imp__edges *edges, const struct imp_scene *scene,
                   const struct imp__moves *moves, int *other)
{
    for (size_t j = 0; j < edges->n_bodies; j++) {
        const struct imp__body *body = &edges->body[j];
        struct imp__rim_name rim = {body->shape, body->place, 0}, beside;
        for (; rim.k < imp__rims(scene, body->shape); rim.k++) {
            if (!imp__rim_beside(edges, scene, &rim, &beside)) continue;
            const int a = imp__carrier(scene, rim.shape, rim.place),
                      b = imp__carrier(scene, beside.shape, beside.place);
            const bool lid =
                imp__moves_disk(scene, rim.shape) != imp__moves_disk(scene, beside.shape);
            *other = beside.shape;
            if (!lid || (a != b && (imp__moves_shape(moves, a, NULL) ||
                                    imp__moves_shape(moves, b, NULL))))
                return rim.shape;
        }
    }
    return -1;
}
