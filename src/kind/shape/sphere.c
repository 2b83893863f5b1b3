/* SPDX-License-Identifier: Apache-2.0
 *
 * The sphere, in double precision. Seen from outside it is sampled by the cone of
 * directions it fills, from inside by area. */
#include "math/quadratic.h"
#include "math/trig.h"
#include "math/warp.h"
#include "shape_lanes.h"

struct sphere {
    imp_v3 center;
    struct imp_frame axes; /* orthonormal, local x, y, z; of the left hand if mirrored */
    double radius;
    double side; /* 1: the normal points outwards */
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_shape *s)
{
    enum imp_status st = IMP_OK;
    struct sphere *p = self;
    struct imp_placement at;
    double center[3], radius, scale[3];

    IMP_TRY(imp__shape_placement(b, s, &at));
    IMP_TRY(imp_build_vector(b, "center", (double[3]){0, 0, 0}, center));
    IMP_TRY(imp_build_float(b, "radius", 1, &radius));
    if (!imp__placement_frame(&at.to_world, 3, &p->axes, scale)) {
        char where[512];
        imp__warn(b->ctx,
                  "%s: shape '%s' (%s): to_world shears it or scales it unevenly; it "
                  "stays round, with the scale of its x axis",
                  imp__loc_text(b->node->loc, where, sizeof where),
                  b->node->id ? b->node->id : "", b->node->type);
    }
    p->center = imp__point(&at.to_world, imp__v3(center[0], center[1], center[2]));
    p->radius = fabs(radius) * scale[0];
    s->area = 4 * IMP_PI * p->radius * p->radius;
    if (!(s->area > 0) || !(p->radius < IMP_REACH_MAX) || !imp__is_finite(p->center))
        IMP_TRY(imp_build_error(b, "radius", IMP_E_SCENE,
                                "radius: in the world its length, %g, is outside (0, %g)",
                                p->radius, IMP_REACH_MAX));
    /* A mirroring placement turns the normal inwards, flip_normals turns it back
     * (docs/scene-format.md 4.2). A negative radius mirrors all three axes. */
    if (radius < 0) p->axes = (struct imp_frame){-p->axes.s, -p->axes.t, -p->axes.n};
    p->side = ((at.mirrored != (radius < 0)) != s->flip_normals) ? -1 : 1;
    const imp_v3 r = imp__v3(p->radius, p->radius, p->radius);
    s->lo = p->center - r;
    s->hi = p->center + r;
    s->geometry = IMP_ANALYTIC;
out:
    return st;
}

/* Discriminant from the distance of the centre to the line, not from b^2 - ac: no digits are
 * lost far away or for small spheres (Haines et al., Ray Tracing Gems, ch. 7). */
static bool intersect(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                      double tmin, double tmax, struct imp_hit *hit)
{
    const struct sphere *p = s->self;
    const imp_v3 oc = *o - p->center;
    const double a = imp__dot(*d, *d), b = -imp__dot(oc, *d);
    const imp_v3 l = oc + *d * (b / a);
    const double r2 = p->radius * p->radius, e = r2 - imp__dot(l, l);
    if (!(e >= 0)) return false;
    double root[2];
    imp__quadratic_roots(a, b, imp__dot(oc, oc) - r2, e, root);
    const double t = root[0] > tmin ? root[0] : root[1];
    if (!(t > tmin && t < tmax)) return false;
    hit->t = t;
    hit->u = hit->v = 0;
    hit->prim = 0;
    return true;
}

/* uv, derivatives and frame from the outward unit normal. */
static void surface_at(const struct sphere *p, imp_v3 outward, struct imp_surface *out)
{
    const imp_v3 q = imp__to_local(&p->axes, outward);
    const double rho = sqrt(q[0] * q[0] + q[1] * q[1]);
    out->p = p->center + outward * p->radius;
    out->ng = out->n = outward * p->side;
    /* Longitude, over a turn, and latitude; 0 of the former at a pole. */
    const imp_v3 angle = imp__angles_4((imp_v3){rho > 0 ? q[0] : 1, q[2], 1, 1},
                                       (imp_v3){fabs(q[1]), rho, 0, 0});
    const double turn = angle[0] * (1 / IMP_2PI), u = q[1] < 0 ? 1 - turn : turn;
    out->uv[0] = u < 1 ? u : 0;
    out->uv[1] = angle[1] * IMP_INV_PI;
    out->dp_du = imp__to_world(&p->axes, imp__v3(-q[1], q[0], 0)) * (IMP_2PI * p->radius);
    const double c = rho > 0 ? q[0] / rho : 1, si = rho > 0 ? q[1] / rho : 0;
    out->dp_dv = imp__to_world(&p->axes, imp__v3(q[2] * c, q[2] * si, -rho)) *
                 (IMP_PI * p->radius);
    imp__surface_frame(out);
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out)
{
    const struct sphere *p = s->self;
    surface_at(p, imp__normalize(*o + *d * hit->t - p->center), out);
}

static void place(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim)
{
    (void)prim;
    const struct sphere *p = s->self;
    const double phi = IMP_2PI * uv[0], theta = IMP_PI * uv[1], rho = sin(theta);
    const imp_v3 q = imp__v3(rho * cos(phi), rho * sin(phi), cos(theta));
    surface_at(p, imp__to_world(&p->axes, q), out);
}

static void sample_area(const struct imp_shape *s, const double u[2],
                        struct imp_surface *out)
{
    const struct sphere *p = s->self;
    surface_at(p, imp__to_world(&p->axes, imp__uniform_sphere(u)), out);
}

/* 1 - cos(theta_max) of the cone seen from distance r; < 0 on and inside the sphere. A
 * point of the sphere itself may lie outside by rounding: its cone would hold nothing but
 * itself. */
static double cone_height(const struct sphere *p, double distance)
{
    if (!(distance > p->radius * (1 + 1e-9))) return -1;
    const double s2 = imp__sqr(p->radius / distance);
    return s2 / (1 + sqrt(imp_max(1 - s2, 0)));
}

static bool sample_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                          struct imp_light_sample *out)
{
    const struct sphere *p = s->self;
    const imp_v3 to_center = p->center - *ref;
    const double distance = imp__length(to_center), height = cone_height(p, distance);
    struct imp_surface at;
    if (height < 0) {
        const imp_v3 w = imp__uniform_sphere(u);
        surface_at(p, imp__to_world(&p->axes, w), &at);
        out->uv[0] = at.uv[0];
        out->uv[1] = at.uv[1];
        return imp__light_from_area(*ref, at.p, at.ng, at.n, 1 / s->area, out);
    }
    if (!(distance < INFINITY)) return false;
    /* Everything from 1 - cos(theta), so that a distant sphere keeps its digits. gamma is
     * the angle at the near point between the ray and the normal: sin(gamma) = sin(theta)
     * / sin(theta_max); alpha = gamma - theta the angle at the centre. */
    const double k = u[0] * height, sin2 = k * (2 - k), cos_theta = 1 - k;
    const double sin_theta = sqrt(sin2), sin2_max = height * (2 - height);
    const double sin2_gamma = imp_min(sin2 / sin2_max, 1);
    const double sin_gamma = sqrt(sin2_gamma), cos_gamma = sqrt(1 - sin2_gamma);
    const double cos_alpha = cos_gamma * cos_theta + sin_gamma * sin_theta;
    const double sin_alpha = sin_gamma * cos_theta - cos_gamma * sin_theta;
    const double phi = IMP_2PI * u[1];
    const struct imp_frame f = imp__frame_from_normal(to_center * (1 / distance));
    const imp_v3 across = f.s * cos(phi) + f.t * sin(phi);
    const imp_v3 outward = across * sin_alpha - f.n * cos_alpha;
    surface_at(p, imp__normalize(outward), &at);
    out->wi = across * sin_theta + f.n * cos_theta;
    out->dist = imp__length(at.p - *ref);
    out->pdf = 1 / (IMP_2PI * height);
    out->uv[0] = at.uv[0];
    out->uv[1] = at.uv[1];
    out->cos_light = -imp__dot(out->wi, at.n);
    out->p = at.p;
    out->ng = at.ng;
    return out->dist > 0;
}

static double pdf_toward(const struct imp_shape *s, const imp_v3 *ref,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    const struct sphere *p = s->self;
    const double height = cone_height(p, imp__length(p->center - *ref));
    return height >= 0 ? 1 / (IMP_2PI * height)
                       : imp__area_to_angle(*ref, at->p, at->ng, 1 / s->area);
}

static void round_of(const struct imp_shape *s, struct imp_round *out)
{
    const struct sphere *p = s->self;
    *out = (struct imp_round){.centre = p->center, .radius = p->radius};
}

/* Area and box, of where it is. */
static void measure(const struct sphere *p, struct imp_shape *s)
{
    const imp_v3 r = imp__v3(p->radius, p->radius, p->radius);
    s->area = 4 * IMP_PI * p->radius * p->radius;
    s->lo = p->center - r;
    s->hi = p->center + r;
}

static void move(struct imp_shape *s, const double to_world[12])
{
    struct sphere *p = s->self;
    const imp_v3 x = imp__rows_vector(to_world, p->axes.s);
    const double scale = imp__length(x);
    p->center = imp__rows_point(to_world, p->center);
    p->axes.s = x * (1 / scale);
    p->axes.t = imp__rows_vector(to_world, p->axes.t) * (1 / scale);
    p->axes.n = imp__rows_vector(to_world, p->axes.n) * (1 / scale);
    p->radius *= scale;
    measure(p, s);
}

static bool placed(struct imp_shape *s, double to_world[12], bool set)
{
    struct sphere *p = s->self;
    double scale[3];
    if (!set) {
        imp__rows_of_columns(p->axes.s * p->radius, p->axes.t * p->radius,
                             p->axes.n * p->radius, p->center, to_world);
        return true;
    }
    const struct imp_mat4 m = imp__mat4_of_rows(to_world);
    const bool round = imp__placement_frame(&m, 3, &p->axes, scale);
    p->center = imp__mat4_column(&m, 3);
    p->radius = scale[0];
    measure(p, s);
    return round;
}

const struct imp_shape_ops imp__sphere = {.size = sizeof(struct imp_shape_ops),
                                          .name = "sphere",
                                          .flags = IMP_SHAPE_CONVEX | IMP_SHAPE_NEAREST,
                                          .object_size = sizeof(struct sphere),
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

/* ---- In lanes ---------------------------------------------------------------------------- */

static void surfaces(const struct imp_shape *s, const struct imp_wide_hits *h, bool uv,
                     struct imp_wide_surface *out)
{
    const struct sphere *p = s->self;
    const imp_wide3 o = imp__wide3_taken(h->o, h->at), d = imp__wide3_taken(h->d, h->at),
                    center = imp__wide3_of(p->center);
    const imp_wide3 outward = imp__wide3_unit(imp__wide3_minus(
        imp__wide3_plus(o, imp__wide3_times(d, imp__wide_taken(h->t, h->at))), center));
    const imp_wide_frame axes = {imp__wide3_of(p->axes.s), imp__wide3_of(p->axes.t),
                                 imp__wide3_of(p->axes.n)};
    const imp_wide3 q = imp__into_wide_frame(&axes, outward);
    out->p = imp__wide3_plus(center, imp__wide3_times(outward, imp__wide(p->radius)));
    out->ng = imp__wide3_times(outward, imp__wide(p->side));
    out->frame.n = out->ng;
    const imp_wide3 turned =
        imp__out_of_wide_frame(&axes, (imp_wide3){-q.y, q.x, imp__wide(0)});
    imp__wide_surface_frame(&out->frame,
                            imp__wide3_times(turned, imp__wide(IMP_2PI * p->radius)));
    if (!uv) return;
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const imp_wide rho = imp__wide_root(q.x * q.x + q.y * q.y);
    const imp_wide turn = IMP_WIDE_OF(imp__angles)(imp__wide_choose(rho > zero, q.x, one),
                                                   imp__wide_magnitude(q.y)) *
                          (1 / IMP_2PI);
    const imp_wide u = imp__wide_choose(q.y < zero, 1 - turn, turn);
    out->uv[0] = imp__wide_choose(u < one, u, zero);
    out->uv[1] = IMP_WIDE_OF(imp__angles)(q.z, rho) * IMP_INV_PI;
}

const struct imp_shape_lanes imp__sphere_lanes = {.surface = surfaces};
