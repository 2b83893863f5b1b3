/* SPDX-License-Identifier: Apache-2.0
 *
 * Spheres, disks and open circular cylinders, as what moves has them (moves.h): rims, and points
 * that are glued to them. */
#include "math/warp.h"
#include "moves.h"

extern const struct imp_shape_ops imp__sphere, imp__disk, imp__cylinder;

bool imp__moves_sphere(const struct imp_scene *scene, int shape, struct imp_round *out)
{
    const struct imp_shape *s = scene->shapes[shape];
    if (s->ops != &imp__sphere) return false;
    s->ops->round(s, out);
    return true;
}

bool imp__moves_disk(const struct imp_scene *scene, int shape)
{
    return scene->shapes[shape]->ops == &imp__disk;
}

bool imp__moves_cylinder(const struct imp_scene *scene, int shape, struct imp__tube *out)
{
    const struct imp_shape *s = scene->shapes[shape];
    struct imp_round round;
    if (s->ops != &imp__cylinder) return false;
    s->ops->round(s, &round);
    if (!(round.radius > 0)) return false; /* an oval one */
    *out = (struct imp__tube){round.centre, round.axis, round.radius,
                              s->area / (IMP_2PI * round.radius)};
    return true;
}

bool imp__moves_curved(const struct imp_scene *scene, int shape)
{
    struct imp_round round;
    struct imp__tube tube;
    return imp__moves_disk(scene, shape) || imp__moves_sphere(scene, shape, &round) ||
           imp__moves_cylinder(scene, shape, &tube);
}

/* ---- Rims -------------------------------------------------------------------------- */

int imp__rims(const struct imp_scene *scene, int shape)
{
    struct imp__tube tube;
    if (imp__moves_disk(scene, shape)) return 1;
    return imp__moves_cylinder(scene, shape, &tube) ? 2 : 0;
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

struct imp__rim_point imp__rim(const struct imp_scene *scene, int shape, int k, double v)
{
    const struct imp_shape *s = scene->shapes[shape];
    const double uv[2] = {1, v};
    struct imp__tube tube;
    struct imp_surface at;
    int prim;
    if (imp__moves_cylinder(scene, shape, &tube)) return tube_rim(&tube, k, v);
    s->ops->place(s, uv, &at, &prim);
    const double rate = imp__length(at.dp_dv);
    const imp_v3 along = at.dp_dv * (1 / rate), out = imp__cross(along, at.ng);
    return (struct imp__rim_point){at.p, along, imp__dot(out, at.dp_du) < 0 ? -out : out,
                                   at.ng, rate};
}

#define MEET 1e-5 /* of the scene's size */
bool imp__rims_meet(const struct imp_scene *scene, int shape, int k, int other, int j)
{
    enum { AROUND = 7 };
    const double near = MEET * imp__length(scene->hi - scene->lo);
    const imp_v3 middle =
        (imp__rim(scene, shape, k, 0).p + imp__rim(scene, shape, k, 0.5).p) * 0.5;
    const imp_v3 apart =
        (imp__rim(scene, other, j, 0).p + imp__rim(scene, other, j, 0.5).p) * 0.5 -
        middle;
    if (!(imp__length(apart) < near)) return false;
    for (int i = 0; i < AROUND; i++) {
        const imp_v3 p = imp__rim(scene, shape, k, (double)i / AROUND).p;
        double least = INFINITY;
        /* The nearest point of the other one, by halving steps around it. */
        double at = 0, step = 1. / 16;
        for (int m = 0; m < 16; m++) {
            const double d = imp__length(imp__rim(scene, other, j, m * step).p - p);
            if (d < least) at = m * step;
            least = imp_min(least, d);
        }
        for (; step > 1e-9; step *= 0.5)
            for (int side = -1; side <= 1; side += 2) {
                const double there = at + side * step;
                const double d = imp__length(imp__rim(scene, other, j, there).p - p);
                if (d < least) at = there;
                least = imp_min(least, d);
            }
        if (!(least < near)) return false;
    }
    return true;
}

/* ---- Points ------------------------------------------------------------------------- */

struct imp__glued imp__glued_curved(const struct imp_scene *scene, int shape, imp_v3 p,
                                    imp_v3 n)
{
    struct imp__glued x = {.shape = shape, .b = {1, 0, 0}, .p = p};
    struct imp_round round;
    struct imp__tube tube;
    if (imp__moves_sphere(scene, shape, &round)) {
        x.n = imp__normalize(p - round.centre);
        x.p = round.centre + x.n * round.radius;
        x.curvature = 1 / round.radius;
    } else if (imp__moves_cylinder(scene, shape, &tube)) {
        const imp_v3 r = p - tube.base, up = tube.axis * imp__dot(r, tube.axis);
        x.n = imp__normalize(r - up);
        x.p = tube.base + up + x.n * tube.radius;
        x.curvature = 1 / tube.radius;
        x.straight = tube.axis;
    } else {
        x.n = imp__rim(scene, shape, 0, 0).n;
    }
    if (!(imp__dot(x.n, n) < 0)) return x;
    x.n = -x.n;
    x.curvature = -x.curvature;
    return x;
}
