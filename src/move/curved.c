/* SPDX-License-Identifier: Apache-2.0
 *
 * Spheres, disks and open circular cylinders, as what moves has them (moves.h), also in instances:
 * rims, and points that are glued to them and to curves. */
#include "kind/shape/shape.h"
#include "math/warp.h"
#include "strand.h"

extern const struct imp_shape_ops imp__sphere, imp__disk, imp__cylinder;

/* So far a map may be from one that stretches all directions alike, per its length. */
#define ALIKE 2e-6

/* The factor by which a map stretches lengths. False: it differs by direction. */
static bool stretches_alike(const struct imp_map *map, double *factor)
{
    imp_v3 column[3];
    for (int k = 0; k < 3; k++)
        column[k] = imp__v3(map->m[k], map->m[4 + k], map->m[8 + k]);
    const double square = imp__dot(column[0], column[0]);
    for (int k = 0; k < 3; k++) {
        const double length = imp__dot(column[k], column[k]),
                     across = imp__dot(column[k], column[(k + 1) % 3]);
        if (!(fabs(length - square) < 2 * ALIKE * square) ||
            !(fabs(across) < ALIKE * square))
            return false;
    }
    *factor = sqrt(square);
    return true;
}

bool imp__place_alike(const struct imp_scene *scene, int64_t place, double *factor)
{
    struct imp_map map[2];
    *factor = 1;
    if (place == 0) return true;
    imp__place_map(scene, place, 0, &map[0], &map[1]);
    return stretches_alike(&map[0], factor);
}

double imp__place_scale(const struct imp_scene *scene, int64_t place)
{
    struct imp_map map[2];
    if (place == 0) return 1;
    imp__place_map(scene, place, 0, &map[0], &map[1]);
    const double *m = map[0].m;
    return cbrt(fabs(
        imp__dot(imp__v3(m[0], m[1], m[2]),
                 imp__cross(imp__v3(m[4], m[5], m[6]), imp__v3(m[8], m[9], m[10])))));
}

/* What a shape is part of, world. */
static bool round_at(const struct imp_scene *scene, int shape, int64_t place,
                     struct imp_round *out, double *factor)
{
    const struct imp_shape *s = scene->shapes[shape];
    struct imp_map map[2];
    *factor = 1;
    s->ops->round(s, out);
    if (place == 0) return true;
    imp__place_map(scene, place, 0, &map[0], &map[1]);
    if (!stretches_alike(&map[0], factor)) return false;
    out->centre = imp__map_point(&map[0], out->centre);
    out->axis = imp__map_vector(&map[0], out->axis) * (1 / *factor);
    out->radius *= *factor;
    return true;
}

bool imp__moves_sphere(const struct imp_scene *scene, int shape, int64_t place,
                       struct imp_round *out)
{
    double factor;
    return scene->shapes[shape]->ops == &imp__sphere &&
           round_at(scene, shape, place, out, &factor);
}

bool imp__moves_disk(const struct imp_scene *scene, int shape)
{
    return scene->shapes[shape]->ops == &imp__disk;
}

bool imp__moves_cylinder(const struct imp_scene *scene, int shape, int64_t place,
                         struct imp__tube *out)
{
    const struct imp_shape *s = scene->shapes[shape];
    struct imp_round round;
    double factor;
    if (s->ops != &imp__cylinder || !round_at(scene, shape, place, &round, &factor))
        return false;
    if (!(round.radius > 0)) return false; /* an oval one */
    *out = (struct imp__tube){round.centre, round.axis, round.radius,
                              s->area * factor * factor / (IMP_2PI * round.radius)};
    return true;
}

bool imp__moves_curved(const struct imp_scene *scene, int shape, int64_t place)
{
    struct imp_round round;
    struct imp__tube tube;
    return imp__moves_disk(scene, shape) ||
           imp__moves_sphere(scene, shape, place, &round) ||
           imp__moves_cylinder(scene, shape, place, &tube) ||
           imp__is_strand(scene, shape, place);
}

/* ---- Rims -------------------------------------------------------------------------- */

int imp__rims(const struct imp_scene *scene, int shape)
{
    struct imp__tube tube;
    if (imp__moves_disk(scene, shape)) return 1;
    return imp__moves_cylinder(scene, shape, 0, &tube) ? 2 : 0;
}

static struct imp__rim_point tube_rim(const struct imp__tube *c, int k, double v)
{
    const struct imp_frame f = imp__frame_from_normal(c->axis);
    const double x = cos(IMP_2PI * v), y = sin(IMP_2PI * v);
    const imp_v3 n = f.s * x + f.t * y;
    return (struct imp__rim_point){.p = c->base + c->axis * (k * c->length) +
                                        n * c->radius,
                                   .along = f.t * x - f.s * y,
                                   .out = k ? c->axis : -c->axis,
                                   .n = n,
                                   .rate = IMP_2PI * c->radius};
}

struct imp__rim_point imp__rim(const struct imp_scene *scene, int shape, int64_t place,
                               int k, double v)
{
    const struct imp_shape *s = scene->shapes[shape];
    const double uv[2] = {1, v};
    struct imp__tube tube;
    struct imp_surface at;
    int prim;
    if (imp__moves_cylinder(scene, shape, place, &tube)) return tube_rim(&tube, k, v);
    s->ops->place(s, uv, &at, &prim);
    if (place > 0) {
        struct imp_map map[2];
        imp__place_map(scene, place, 0, &map[0], &map[1]);
        imp__surface_move(&at, &map[0], &map[1]);
    }
    const double rate = imp__length(at.dp_dv);
    const imp_v3 along = at.dp_dv * (1 / rate), out = imp__cross(along, at.ng);
    return (struct imp__rim_point){at.p, along, imp__dot(out, at.dp_du) < 0 ? -out : out,
                                   at.ng, rate};
}

static imp_v3 rim_point(const struct imp_scene *scene, const struct imp__rim_name *r,
                        double v)
{
    return imp__rim(scene, r->shape, r->place, r->k, v).p;
}

#define MEET 1e-5 /* of the scene's size */
bool imp__rims_meet(const struct imp_scene *scene, const struct imp__rim_name *a,
                    const struct imp__rim_name *b)
{
    enum { AROUND = 7 };
    const double near = MEET * imp__length(scene->hi - scene->lo);
    const imp_v3 middle = (rim_point(scene, a, 0) + rim_point(scene, a, 0.5)) * 0.5;
    const imp_v3 apart =
        (rim_point(scene, b, 0) + rim_point(scene, b, 0.5)) * 0.5 - middle;
    if (!(imp__length(apart) < near)) return false;
    for (int i = 0; i < AROUND; i++) {
        const imp_v3 p = rim_point(scene, a, (double)i / AROUND);
        double least = INFINITY;
        /* The nearest point of the other one, by halving steps around it. */
        double at = 0, step = 1. / 16;
        for (int m = 0; m < 16; m++) {
            const double d = imp__length(rim_point(scene, b, m * step) - p);
            if (d < least) at = m * step;
            least = imp_min(least, d);
        }
        for (; step > 1e-9; step *= 0.5)
            for (int side = -1; side <= 1; side += 2) {
                const double there = at + side * step;
                const double d = imp__length(rim_point(scene, b, there) - p);
                if (d < least) at = there;
                least = imp_min(least, d);
            }
        if (!(least < near)) return false;
    }
    return true;
}

/* ---- Points ------------------------------------------------------------------------- */

static void strand_glue(const struct imp_scene *scene, imp_v3 p, struct imp__glued *x)
{
    struct imp__strand line;
    struct imp__strand_point at;
    x->b[0] = imp__strand_foot(scene, x->shape, x->place, x->prim, p);
    imp__strand_at(scene, x->shape, x->place, x->prim, x->b[0], &line);
    const struct imp__strand_axes axes = imp__strand_axes(&line);
    const imp_v3 q = p - line.c, across = q - axes.a * imp__dot(axes.a, q),
                 e = imp__dot(across, across) > 0 ? imp__normalize(across) : axes.s;
    x->n = e;
    if (!imp__strand_point(&line, &axes, e, &at)) return;
    x->p = at.p;
    x->n = at.n;
    x->strand = line.r > 0;
    if (!x->strand) return;
    x->turn[0] = at.n_v;
    x->slope[0] = at.along * (1 / imp__dot(at.along, at.along));
    x->turn[1] = at.n_t;
    x->slope[1] = at.around * (1 / line.r);
}

struct imp__glued imp__glued_curved(const struct imp_scene *scene, int shape, int prim,
                                    int64_t place, imp_v3 p, imp_v3 n)
{
    struct imp__glued x = {.shape = shape,
                           .prim = prim,
                           .place = place,
                           .carrier = imp__carrier(scene, shape, place),
                           .b = {1, 0, 0},
                           .p = p};
    struct imp_round round;
    struct imp__tube tube;
    if (imp__moves_sphere(scene, shape, place, &round)) {
        x.n = imp__normalize(p - round.centre);
        x.p = round.centre + x.n * round.radius;
        x.curvature = 1 / round.radius;
    } else if (imp__moves_cylinder(scene, shape, place, &tube)) {
        const imp_v3 r = p - tube.base, up = tube.axis * imp__dot(r, tube.axis);
        x.n = imp__normalize(r - up);
        x.p = tube.base + up + x.n * tube.radius;
        x.curvature = 1 / tube.radius;
        x.straight = tube.axis;
    } else if (scene->shapes[shape]->geometry == IMP_CURVES) {
        strand_glue(scene, p, &x);
    } else {
        x.n = imp__rim(scene, shape, place, 0, 0).n;
    }
    if (!(imp__dot(x.n, n) < 0)) return x;
    x.n = -x.n;
    x.curvature = -x.curvature;
    for (int k = 0; k < 2; k++) x.turn[k] = -x.turn[k];
    return x;
}
