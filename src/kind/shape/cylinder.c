/* SPDX-License-Identifier: Apache-2.0
 *
 * An open cylinder about the line from p0 to p1, in double precision: circular, or what an
 * uneven or shearing to_world makes of that. It is the points
 *
 *     base + n length v + radius (s cos(phi) + t sin(phi))                             (1)
 *
 * where s, t, n are the orthonormal frame of a circular one; for another one they are the
 * images of the axes, with length and radius 1. */
#include "math/ellipse.h"
#include "math/quadratic.h"
#include "shape.h"

struct cylinder {
    imp_v3 base;            /* the middle of the end at p0 */
    struct imp_frame axes;  /* of (1) */
    struct imp_frame inner; /* rows of the inverse of axes: dot products with them are
                               coordinates along axes. For a circular one the same */
    double radius, length;
    double side; /* 1: the normal points outwards */
    bool oval;
    struct imp_ellipse across; /* of an oval one: what is seen of it along its axis */
};

/* From the images of the axes. False: they lie in a plane. */
static bool oval_set(const imp_v3 axis[3], struct cylinder *c)
{
    imp_v3 e[3];
    for (int i = 0; i < 3; i++) e[i] = imp__normalize(axis[i]);
    const double volume = imp__dot(imp__cross(e[0], e[1]), e[2]);
    imp_v3 rows[3];
    for (int i = 0; i < 3; i++)
        rows[i] = imp__cross(e[(i + 1) % 3], e[(i + 2) % 3]) *
                  (1 / (volume * imp__length(axis[i])));
    const imp_v3 p = axis[0] - e[2] * imp__dot(axis[0], e[2]),
                 q = axis[1] - e[2] * imp__dot(axis[1], e[2]);
    c->oval = true;
    c->axes = (struct imp_frame){axis[0], axis[1], axis[2]};
    c->inner = (struct imp_frame){rows[0], rows[1], rows[2]};
    imp__ellipse(&p, &q, &c->across);
    return imp__is_finite(rows[0]) && imp__is_finite(rows[1]) && imp__is_finite(rows[2]);
}

/* s cos(phi) + t sin(phi) is largest along axis i at |(s_i, t_i)|. */
static void box_set(const struct cylinder *c, struct imp_shape *s)
{
    const imp_v3 top = c->base + c->axes.n * c->length;
    for (int i = 0; i < 3; i++) {
        const double most = c->radius * hypot(c->axes.s[i], c->axes.t[i]);
        s->lo[i] = fmin(c->base[i], top[i]) - most;
        s->hi[i] = fmax(c->base[i], top[i]) + most;
    }
    s->lo[3] = s->hi[3] = 0;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_shape *s)
{
    enum imp_status st = IMP_OK;
    struct cylinder *c = self;
    struct imp_placement at;
    double p0[3], p1[3], radius, scale[3], reach = 0;

    IMP_TRY(imp__shape_placement(b, s, &at));
    IMP_TRY(imp_build_vector(b, "p0", (double[3]){0, 0, 0}, p0));
    IMP_TRY(imp_build_vector(b, "p1", (double[3]){0, 0, 1}, p1));
    IMP_TRY(imp_build_float(b, "radius", 1, &radius));
    const imp_v3 a = imp__v3(p0[0], p0[1], p0[2]), e = imp__v3(p1[0], p1[1], p1[2]) - a;
    const double length = imp__length(e);
    if (!(length > 0) || !isfinite(length))
        IMP_TRY(imp_build_error(b, "p1", IMP_E_SCENE, "p0 and p1 are %g apart", length));
    /* to_world T(p0) frame(p1 - p0) S(r, r, length), docs/scene-format.md 4.2. */
    const struct imp_frame f = imp__frame_from_normal(e * (1 / length));
    const struct imp_mat4 local = {{f.s[0], f.t[0], f.n[0], a[0], f.s[1], f.t[1], f.n[1],
                                    a[1], f.s[2], f.t[2], f.n[2], a[2], 0, 0, 0, 1}};
    const struct imp_mat4 placed = imp__mat4_multiply(&at.to_world, &local);
    c->base = imp__point(&placed, imp__v3(0, 0, 0));
    if (imp__placement_frame(&placed, 2, &c->axes, scale)) {
        c->inner = c->axes;
        c->radius = reach = fabs(radius) * scale[0];
        c->length = length * scale[2];
        s->area = IMP_2PI * c->radius * c->length;
    } else {
        const imp_v3 axis[3] = {imp__mat4_column(&placed, 0) * fabs(radius),
                                imp__mat4_column(&placed, 1) * fabs(radius),
                                imp__mat4_column(&placed, 2) * length};
        if (radius != 0 && !oval_set(axis, c))
            IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                    "to_world flattens the shape"));
        c->radius = c->length = 1;
        reach = fabs(radius) * fmax(scale[0], scale[1]);
        s->area = c->across.length * imp__length(axis[2]);
    }
    if (!(s->area > 0) || !(reach < IMP_REACH_MAX) || !isfinite(s->area) ||
        !imp__is_finite(c->base))
        IMP_TRY(imp_build_error(b, "radius", IMP_E_SCENE,
                                "radius: in the world its length, %g, is outside (0, %g)",
                                reach, IMP_REACH_MAX));
    c->side = (at.mirrored != s->flip_normals) ? -1 : 1;
    box_set(c, s);
    s->geometry = IMP_ANALYTIC;
out:
    return st;
}

/* v of the hit: the height along the axis, 0..1. As for the sphere, in the plane across.
 */
static bool intersect(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                      double tmin, double tmax, struct imp_hit *hit)
{
    const struct cylinder *k = s->self;
    const imp_v3 p = imp__to_local(&k->inner, *o - k->base),
                 w = imp__to_local(&k->inner, *d);
    const double a = w[0] * w[0] + w[1] * w[1], b = -(p[0] * w[0] + p[1] * w[1]);
    const double lx = p[0] + w[0] * (b / a), ly = p[1] + w[1] * (b / a);
    const double r2 = k->radius * k->radius, e = r2 - (lx * lx + ly * ly);
    if (!(e >= 0)) return false; /* and rays along the axis, where a is 0 */
    double t[2];
    imp__quadratic_roots(a, b, p[0] * p[0] + p[1] * p[1] - r2, e, t);
    bool met = false;
    for (int i = 0; !met && i < 2; i++) {
        const double z = p[2] + t[i] * w[2];
        met = t[i] > tmin && t[i] < tmax && z >= 0 && z <= k->length;
        if (!met) continue;
        hit->t = t[i];
        hit->u = 0;
        hit->v = z / k->length;
        hit->prim = 0;
    }
    return met;
}

/* x, y: cosine and sine of phi. */
static void surface_at(const struct cylinder *k, double x, double y, double v,
                       struct imp_surface *out)
{
    const imp_v3 across = k->axes.s * x + k->axes.t * y;
    const imp_v3 outward =
        k->oval ? imp__normalize(k->inner.s * x + k->inner.t * y) : across;
    out->p = k->base + k->axes.n * (v * k->length) + across * k->radius;
    out->ng = out->n = outward * k->side;
    out->uv[0] = imp__uv_turn(x, y);
    out->uv[1] = v;
    out->dp_du = (k->axes.t * x - k->axes.s * y) * (IMP_2PI * k->radius);
    out->dp_dv = k->axes.n * k->length;
    imp__surface_frame(out);
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out)
{
    const struct cylinder *k = s->self;
    const imp_v3 p = *o + *d * hit->t - k->base;
    const double x = imp__dot(p, k->inner.s), y = imp__dot(p, k->inner.t);
    const double r = 1 / sqrt(x * x + y * y);
    surface_at(k, x * r, y * r, hit->v, out);
}

static void place(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim)
{
    (void)prim;
    surface_at(s->self, cos(IMP_2PI * uv[0]), sin(IMP_2PI * uv[0]), uv[1], out);
}

static void sample_area(const struct imp_shape *s, const double u[2],
                        struct imp_surface *out)
{
    const struct cylinder *k = s->self;
    const double phi = k->oval ? imp__ellipse_phi(&k->across, u[0]) : IMP_2PI * u[0];
    surface_at(k, cos(phi), sin(phi), u[1], out);
}

static bool sample_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                          struct imp_light_sample *out)
{
    struct imp_surface at;
    sample_area(s, u, &at);
    out->uv[0] = at.uv[0];
    out->uv[1] = at.uv[1];
    return imp__light_from_area(*ref, at.p, at.ng, at.n, 1 / s->area, out);
}

static double pdf_toward(const struct imp_shape *s, const imp_v3 *ref,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    return imp__area_to_angle(*ref, at->p, at->ng, 1 / s->area);
}

static void round_of(const struct imp_shape *s, struct imp_round *out)
{
    const struct cylinder *k = s->self;
    *out = k->oval ? (struct imp_round){.radius = 0}
                   : (struct imp_round){k->base, k->axes.n, k->radius};
}

static void move(struct imp_shape *s, const double to_world[12])
{
    struct cylinder *k = s->self;
    const imp_v3 axis[3] = {imp__rows_vector(to_world, k->axes.s),
                            imp__rows_vector(to_world, k->axes.t),
                            imp__rows_vector(to_world, k->axes.n)};
    const double scale = imp__length(axis[2]) / imp__length(k->axes.n);
    k->base = imp__rows_point(to_world, k->base);
    s->area *= scale * scale;
    if (k->oval) {
        oval_set(axis, k); /* no motion flattens it */
    } else {
        k->axes = (struct imp_frame){axis[0] * (1 / scale), axis[1] * (1 / scale),
                                     axis[2] * (1 / scale)};
        k->inner = k->axes;
        k->radius *= scale;
        k->length *= scale;
    }
    box_set(k, s);
}

/* The rotation that takes the unit vector a to b, of a vector across which both may lie. */
static imp_v3 turned(imp_v3 a, imp_v3 b, imp_v3 v)
{
    const imp_v3 w = imp__cross(a, b);
    const double cosine = imp__dot(a, b);
    if (!(cosine > -1 + 1e-12)) return v; /* half a turn: about whatever v is */
    return v + imp__cross(w, v) + imp__cross(w, imp__cross(w, v)) * (1 / (1 + cosine));
}

void imp__cylinder_set(struct imp_shape *s, imp_v3 p0, imp_v3 p1, double radius)
{
    struct cylinder *k = s->self;
    const imp_v3 n = imp__normalize(p1 - p0), was = imp__normalize(k->axes.n);
    const bool opposite = !(imp__dot(n, was) > -1 + 1e-12);
    k->base = p0;
    k->length = imp__length(p1 - p0);
    k->radius = radius;
    k->axes = (struct imp_frame){turned(was, n, k->axes.s),
                                 turned(was, n, k->axes.t) * (opposite ? -1.0 : 1.0), n};
    k->inner = k->axes;
    s->area = IMP_2PI * radius * k->length;
    box_set(k, s);
}

static bool placed(struct imp_shape *s, double to_world[12], bool set)
{
    struct cylinder *k = s->self;
    double scale[3];
    if (k->oval) return false;
    if (!set) {
        imp__rows_of_columns(k->axes.s * k->radius, k->axes.t * k->radius,
                             k->axes.n * k->length, k->base, to_world);
        return true;
    }
    const struct imp_mat4 m = imp__mat4_of_rows(to_world);
    const bool round = imp__placement_frame(&m, 2, &k->axes, scale);
    k->inner = k->axes;
    k->base = imp__mat4_column(&m, 3);
    k->radius = scale[0];
    k->length = scale[2];
    s->area = IMP_2PI * k->radius * k->length;
    box_set(k, s);
    return round;
}

const struct imp_shape_ops imp__cylinder = {.size = sizeof(struct imp_shape_ops),
                                            .name = "cylinder",
                                            .object_size = sizeof(struct cylinder),
                                            .build = build,
                                            .intersect = intersect,
                                            .surface = surface,
                                            .sample_toward = sample_toward,
                                            .pdf_toward = pdf_toward,
                                            .round = round_of,
                                            .sample_area = sample_area,
                                            .place = place,
                                            .move = move,
                                            .placed = placed};
