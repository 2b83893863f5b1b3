/* SPDX-License-Identifier: Apache-2.0
 *
 * Curved shapes and the edges of a scene (edges.h): where surfaces pass through each other, and rims
 * that lie on each other. */
#include "edges.h"
#include "kind/sensor/receiver.h"
#include "math/offset.h"

#define TOUCH 1e-5 /* of a sphere's radius: nearer surfaces touch it */
#define END   1e-5 /* of a segment: nearer hits are of what begins there */

/* The least and the largest distance of a triangle from a point. */
static void triangle_distances(const struct imp_triangles *t, size_t prim, imp_v3 c,
                               double *least, double *most)
{
    imp_v3 p[3];
    *most = 0;
    *least = INFINITY;
    for (int k = 0; k < 3; k++) {
        const float *at = t->positions + 3 * (size_t)t->indices[3 * prim + (size_t)k];
        p[k] = imp__v3(at[0], at[1], at[2]) - c;
        *most = imp_max(*most, imp__length(p[k]));
    }
    const imp_v3 cross = imp__cross(p[1] - p[0], p[2] - p[0]), n = imp__normalize(cross);
    bool inside = true;
    for (int k = 0; k < 3; k++) {
        const imp_v3 e = p[(k + 1) % 3] - p[k];
        const double s = imp_clamp(-imp__dot(p[k], e) / imp__dot(e, e), 0.0, 1.0);
        *least = imp_min(*least, imp__length(p[k] + e * s));
        inside &= imp__dot(imp__cross(e, -p[k]), n) >= 0;
    }
    if (inside) *least = imp_min(*least, fabs(imp__dot(p[0], n)));
}

/* Chords of a rim, by which it is tested: what is pierced by less than 3e-4 of the radius counts
 * as touched. */
#define CHORDS 128

/* A disk and the surface of a sphere. */
static bool disk_meets(const struct imp_scene *scene, int shape,
                       const struct imp_round *round)
{
    double least = INFINITY, most = 0;
    bool over = true; /* is the centre above the disk? */
    for (int k = 0; k < CHORDS; k++) {
        const struct imp__rim_point rim = imp__rim(scene, shape, 0, (double)k / CHORDS);
        const imp_v3 r = rim.p - round->centre;
        least = imp_min(least, imp__length(r));
        most = imp_max(most, imp__length(r));
        over &= imp__dot(r, rim.out) > 0;
    }
    const struct imp__rim_point rim = imp__rim(scene, shape, 0, 0);
    if (over) least = imp_min(least, fabs(imp__dot(rim.n, rim.p - round->centre)));
    return least < round->radius * (1 - TOUCH) && most > round->radius * (1 + TOUCH);
}

/* A shape that a segment from a to b of shape k passes through, from its ends inwards by `end` parts of
 * it; not `but`. -1: none. */
static int segment_pierces(const struct imp_scene *scene, int k, int but, imp_v3 a,
                           imp_v3 b, double end)
{
    const imp_v3 d = b - a;
    struct imp_hit hit;
    for (double from = end; imp__intersect(scene, &a, &d, from, 1 - end, &hit);
         from = hit.t + END)
        if (hit.shape != k && hit.shape != but) return hit.shape;
    return -1;
}

/* A shape that a rim passes through, or a straight line in a cylinder. */
static int rims_pierced(const struct imp_scene *scene, int *other)
{
    for (int k = 0; k < imp__shapes_outside(scene); k++) {
        const int rims = imp__shape_is_absent(scene->shapes[k]) ? 0 : imp__rims(scene, k);
        int beside = -1, unused;
        *other = k;
        for (int j = 0; j < rims * CHORDS; j++) {
            const int rim = j / CHORDS;
            const double v = (double)(j % CHORDS) / CHORDS;
            const imp_v3 a = imp__rim(scene, k, rim, v).p,
                         b = imp__rim(scene, k, rim, v + 1. / CHORDS).p;
            if (j % CHORDS == 0) beside = imp__rim_beside(scene, k, rim, &unused);
            int met = segment_pierces(scene, k, beside, a, b, 0);
            if (met < 0 && rims == 2 && rim == 0)
                met = segment_pierces(scene, k, -1, a, imp__rim(scene, k, 1, v).p, END);
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

/* Does the surface of a sphere meet this shape? Where they touch, it does not. */
static bool meets_sphere(const struct imp_scene *scene, int shape,
                         const struct imp_round *round)
{
    const double inside = round->radius * (1 - TOUCH),
                 outside = round->radius * (1 + TOUCH);
    const struct imp_triangles *t = &scene->shapes[shape]->triangles;
    struct imp__tube tube;
    struct imp_round other;
    if (imp__moves_cylinder(scene, shape, &tube)) return tube_meets(&tube, round);
    if (imp__moves_sphere(scene, shape, &other)) {
        const double d = imp__length(other.centre - round->centre);
        return d < inside + other.radius &&
               d > fabs(round->radius - other.radius) + TOUCH * round->radius;
    }
    if (imp__moves_disk(scene, shape)) return disk_meets(scene, shape, round);
    if (scene->shapes[shape]->geometry != IMP_TRIANGLES) return false;
    for (size_t k = 0; k < t->n_triangles; k++) {
        double least, most;
        triangle_distances(t, k, round->centre, &least, &most);
        if (least < inside && most > outside) return true;
    }
    return false;
}

static int spheres_pierced(const struct imp_scene *scene, int *other)
{
    for (int k = 0; k < imp__shapes_outside(scene); k++) {
        struct imp_round round;
        if (!imp__moves_sphere(scene, k, &round)) continue;
        for (int j = 0; j < imp__shapes_outside(scene); j++)
            if (j != k && !imp__shape_is_absent(scene->shapes[j]) &&
                meets_sphere(scene, j, &round)) {
                *other = j;
                return k;
            }
    }
    return -1;
}

int imp__curved_pierced(const struct imp_scene *scene, int *other)
{
    const int pierced = spheres_pierced(scene, other);
    return pierced >= 0 ? pierced : rims_pierced(scene, other);
}

/* ---- Rims that lie on each other ------------------------------------------------------ */

int imp__rim_beside(const struct imp_scene *scene, int shape, int k, int *rim)
{
    for (int other = 0; other < imp__shapes_outside(scene); other++)
        for (*rim = 0; *rim < imp__rims(scene, other); ++*rim)
            if ((other != shape || *rim != k) &&
                imp__rims_meet(scene, shape, k, other, *rim))
                return other;
    return -1;
}

int imp__rims_torn(const struct imp_scene *scene, const struct imp__moves *moves,
                   int *other)
{
    for (int shape = 0; shape < imp__shapes_outside(scene); shape++)
        for (int k = 0; k < imp__rims(scene, shape); k++) {
            int rim;
            *other = imp__rim_beside(scene, shape, k, &rim);
            if (*other < 0) continue;
            const bool lid =
                imp__moves_disk(scene, shape) != imp__moves_disk(scene, *other);
            if (!lid || imp__moves_shape(moves, shape, NULL) ||
                imp__moves_shape(moves, *other, NULL))
                return shape;
        }
    return -1;
}
