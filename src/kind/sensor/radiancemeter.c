/* SPDX-License-Identifier: Apache-2.0
 *
 * The radiance that arrives along one ray; or, with `grid`, along the rays to an observer from
 * the points in the middles of the cells of a rectangle. */
#include "radiancemeter.h"
#include "math/transform.h"
#include "projection.h"
#include "receiver.h"

struct radiancemeter {
    imp_v3 o, d;
    bool grid, placed; /* placed: by this map, not by numbers of its own */
    struct imp_projection by;
    imp_v3 middle, u, v, n; /* of the rectangle: half of its sides, its normal */
};

static imp_v3 vector_read(const double x[3]) { return imp__v3(x[0], x[1], x[2]); }

static enum imp_status grid_read(const struct imp_build *b, struct imp_sensor *s,
                                 struct radiancemeter *r)
{
    enum imp_status st = IMP_OK;
    struct imp_mat4 m;
    double o[3];
    IMP_TRY(imp_build_transform(b, "grid", m.m));
    if (!imp_build_has(b, "origin"))
        IMP_TRY(imp_build_error(b, "grid", IMP_E_SCENE,
                                "'origin' is missing: the observer who looks at the "
                                "grid"));
    IMP_TRY(imp_build_vector(b, "origin", (double[3]){0, 0, 0}, o));
    r->grid = true;
    r->o = vector_read(o);
    r->middle = imp__point(&m, imp__v3(0, 0, 0));
    r->u = imp__vector(&m, imp__v3(1, 0, 0));
    r->v = imp__vector(&m, imp__v3(0, 1, 0));
    const imp_v3 n = imp__cross(r->u, r->v);
    const double area = imp__length(n);
    if (!imp__mat4_is_finite(&m) || !imp__mat4_is_affine(&m) || !(area > 0) ||
        !isfinite(area))
        IMP_TRY(imp_build_error(b, "grid", IMP_E_SCENE,
                                "grid is not affine, or its rectangle has no area"));
    r->n = n * (1 / area);
    IMP_TRY(imp__grid_film(b, s));
    for (int y = 0; y < s->film.height; y++)
        for (int x = 0; x < s->film.width; x++) {
            imp_v3 normal;
            s->self = r;
            if (!(imp__length(imp__grid_looked_at(s, x + 0.5, y + 0.5, &normal) - r->o) >
                  0))
                IMP_TRY(imp_build_error(b, "origin", IMP_E_SCENE,
                                        "the observer is at a point of the grid"));
        }
out:
    return st;
}

static enum imp_status ray_read(const struct imp_build *b, const struct imp_sensor *s,
                                struct radiancemeter *r)
{
    enum imp_status st = IMP_OK;
    struct imp_mat4 m, inverse;
    double o[3], d[3];
    const bool by_ray = imp_build_has(b, "origin") || imp_build_has(b, "direction");

    if (s->film.width != 1 || s->film.height != 1)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "its film has %d x %d pixels; it measures one ray: 1 x 1",
                                s->film.width, s->film.height));
    if (by_ray && imp_build_has(b, "to_world"))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "give origin and direction, or to_world, not both"));
    if (by_ray && !(imp_build_has(b, "origin") && imp_build_has(b, "direction")))
        IMP_TRY(imp_build_error(b, imp_build_has(b, "origin") ? "origin" : "direction",
                                IMP_E_SCENE,
                                "give both origin and direction, or to_world"));
    IMP_TRY(imp_build_vector(b, "origin", (double[3]){0, 0, 0}, o));
    IMP_TRY(imp_build_vector(b, "direction", (double[3]){0, 0, 1}, d));
    IMP_TRY(imp__sensor_place(b, &m, &inverse));
    r->o = imp__point(&m, vector_read(o));
    r->d = imp__vector(&m, vector_read(d));
    const double length = imp__length(r->d);
    if (!(length > 0) || !isfinite(length) || !imp__is_finite(r->o))
        IMP_TRY(imp_build_error(b, by_ray ? "direction" : "to_world", IMP_E_SCENE,
                                "its direction has length %g", length));
    r->d *= imp__spec(1 / length);
    r->placed = !by_ray;
    r->by = (struct imp_projection){.to_world = m, .to_local = inverse};
out:
    return st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    return imp_build_has(b, "grid") ? grid_read(b, s, self) : ray_read(b, s, self);
}

imp_v3 imp__grid_looked_at(const struct imp_sensor *s, double px, double py,
                           imp_v3 *normal)
{
    const struct radiancemeter *r = s->self;
    const double size[2] = {s->film.width, s->film.height}, at[2] = {px, py};
    double x[2];
    for (int k = 0; k < 2; k++)
        x[k] = 2 * (imp_clamp(floor(at[k]), 0.0, size[k] - 1) + 0.5) / size[k] - 1;
    *normal = r->n;
    return r->middle + r->u * x[0] + r->v * x[1];
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    (void)lens;
    const struct radiancemeter *r = s->self;
    imp_v3 d = r->d, n;
    if (r->grid) d = imp__normalize(imp__grid_looked_at(s, px, py, &n) - r->o);
    *out = (struct imp_sensor_ray){r->o, d, 0, INFINITY};
}

/* The observer, with the rectangle that is looked at. */
static void move(struct imp_sensor *s, const double to_world[12])
{
    struct radiancemeter *r = s->self;
    r->o = imp__rows_point(to_world, r->o);
    r->d = imp__rows_vector(to_world, r->d);
    r->middle = imp__rows_point(to_world, r->middle);
    r->u = imp__rows_vector(to_world, r->u);
    r->v = imp__rows_vector(to_world, r->v);
    r->n = imp__rows_vector(to_world, r->n);
    imp__projection_move(&r->by, to_world);
}

static bool placed(struct imp_sensor *s, double to_world[12], bool set)
{
    struct radiancemeter *r = s->self;
    if (!r->placed || !imp__projection_placed(&r->by, true, to_world, set)) return false;
    r->o = imp__point(&r->by.to_world, imp__v3(0, 0, 0));
    r->d = imp__normalize(imp__vector(&r->by.to_world, imp__v3(0, 0, 1)));
    return true;
}

const struct imp_sensor_ops imp__radiancemeter = {.size = sizeof(struct imp_sensor_ops),
                                                  .name = "radiancemeter",
                                                  .object_size =
                                                      sizeof(struct radiancemeter),
                                                  .build = build,
                                                  .ray = ray,
                                                  .move = move,
                                                  .placed = placed};

bool imp__looks_at_grid(const struct imp_sensor *s)
{
    return s->ops == &imp__radiancemeter && ((const struct radiancemeter *)s->self)->grid;
}
