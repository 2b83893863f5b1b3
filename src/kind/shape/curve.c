/* SPDX-License-Identifier: Apache-2.0
 *
 * bsplinecurve and linearcurve: hair, fur, grass. Rays meet them by Embree's round curves, in
 * float and from outside alone; the surface is computed again in double. uv is the turn about
 * the line and the place along all segments, as in Mitsuba 3.9.1. */
#include "curve.h"
#include "base/required.h"

static enum imp_status radius_check(const struct imp_build *b, const float *points,
                                    size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (!(points[4 * k + 3] >= 0))
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "the radius of control point %zu is %g", k,
                                   (double)points[4 * k + 3]);
    return IMP_OK;
}

/* to_world moves the points; their radii stay, as in Mitsuba. */
static enum imp_status points_place(const struct imp_build *b, struct imp_shape *s,
                                    const struct imp_curve_data *data,
                                    const struct imp_placement *at)
{
    float *out = imp__arena_take(b->arena, 4 * data->n_points + 4, sizeof *out);
    if (!out) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    s->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    s->hi = -s->lo;
    for (size_t k = 0; k < data->n_points; k++) {
        const float *q = data->points + 4 * k;
        const imp_v3 p = imp__point(&at->to_world, imp__v3(q[0], q[1], q[2]));
        for (int i = 0; i < 3; i++) {
            if (!(fabs(p[i]) + q[3] < 1e18)) /* Embree takes more for invalid */
                return imp_build_error(b, NULL, IMP_E_SCENE,
                                       "control point %zu lies further out than 1e18", k);
            out[4 * k + (size_t)i] = (float)p[i];
            s->lo[i] = imp_min(p[i] - q[3], s->lo[i]);
            s->hi[i] = imp_max(p[i] + q[3], s->hi[i]);
        }
        out[4 * k + 3] = q[3];
    }
    s->lo[3] = s->hi[3] = 0;
    s->curves.points = out;
    s->curves.n_points = data->n_points;
    return IMP_OK;
}

static enum imp_status segments_make(const struct imp_build *b, struct imp_shape *s,
                                     const struct imp_curve_data *data)
{
    struct imp_curves *c = &s->curves;
    const size_t degree = (size_t)c->degree;
    size_t n = 0;
    for (size_t k = 0; k < data->n_curves; k++) {
        const size_t points = data->first[k + 1] - data->first[k];
        if (points < degree + 1)
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "curve %zu has %zu control points; it needs %zu", k,
                                   points, degree + 1);
        n += points - degree;
    }
    uint32_t *first = imp__arena_take(b->arena, n, sizeof *first);
    uint8_t *joined = imp__arena_take(b->arena, n, 1);
    if (!first || !joined) return imp_build_error(b, NULL, IMP_E_NOMEM, "out of memory");
    n = 0;
    for (size_t k = 0; k < data->n_curves; k++) {
        const size_t points = data->first[k + 1] - data->first[k];
        for (size_t j = 0; j + degree < points; j++, n++) {
            first[n] = data->first[k] + (uint32_t)j;
            joined[n] = (uint8_t)((j > 0) | (j + degree + 1 < points) << 1);
        }
    }
    c->first = first;
    c->joined = joined;
    c->n_segments = n;
    return IMP_OK;
}

/* Side of the tubes, without what a radius that varies adds: Gauss's rule of three points. */
static double area_of(const struct imp_curves *c)
{
    static const double x[3] = {0.1127016653792583, 0.5, 0.8872983346207417},
                        w[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    double sum = 0;
    for (size_t k = 0; k < c->n_segments; k++)
        for (int i = 0; i < 3; i++) {
            struct imp__curve_at at;
            imp__curve_at(c, (int)k, x[i], &at);
            sum += w[i] * IMP_2PI * at.r * imp__length(at.d1);
        }
    return sum;
}

static enum imp_status build(const struct imp_build *b, struct imp_shape *s, int degree)
{
    enum imp_status st = IMP_OK;
    struct imp_placement at;
    const char *filename;
    const struct imp_curve_data *data = b->node->curves;
    IMP_TRY(imp__shape_placement(b, s, &at));
    IMP_TRY(imp_build_string(b, "filename", NULL, &filename));
    if (!data) IMP_TRY(imp__node_missing(b->ctx, b->node, "filename"));
    if (s->flip_normals)
        IMP_TRY(imp_build_error(b, "flip_normals", IMP_E_UNSUPPORTED,
                                "curves are met from outside alone, and their normals "
                                "point there"));
    s->geometry = IMP_CURVES;
    s->curves.degree = degree;
    IMP_TRY(radius_check(b, data->points, data->n_points));
    IMP_TRY(points_place(b, s, data, &at));
    IMP_TRY(segments_make(b, s, data));
    s->area = area_of(&s->curves);
out:
    return st;
}
static enum imp_status bspline_build(const struct imp_build *b, void *self,
                                     struct imp_shape *s)
{
    (void)self;
    return build(b, s, 3);
}
static enum imp_status linear_build(const struct imp_build *b, void *self,
                                    struct imp_shape *s)
{
    (void)self;
    return build(b, s, 1);
}

/* The directions across the line from which the turn is counted: a quarter of it apart. */
struct across {
    imp_v3 axis, start, turned;
};
static struct across across_of(const struct imp__curve_at *at)
{
    const imp_v3 axis = imp__curve_axis(at);
    const imp_v3 z = imp__v3(0, 0, 1) - axis * axis[2];
    const imp_v3 turned = imp__dot(z, z) > 1e-14 ? imp__normalize(z) : imp__v3(0, 1, 0);
    return (struct across){axis, imp__cross(turned, axis), turned};
}

/* de/dv, where e, from the line to the point, keeps its turn while the line bends. */
static imp_v3 bending(const struct imp__curve_at *at, const struct across *x, imp_v3 e)
{
    const double length = imp__length(at->d1);
    const imp_v3 z = imp__v3(0, 0, 1) - x->axis * x->axis[2];
    const double across = imp__length(z);
    if (!(length > 0) || !(across > 1e-7)) return (imp_v3){0};
    const imp_v3 axis_d = (at->d2 - x->axis * imp__dot(x->axis, at->d2)) * (1 / length);
    const imp_v3 z_d = -(axis_d * x->axis[2] + x->axis * axis_d[2]);
    const imp_v3 turned_d = (z_d - x->turned * imp__dot(x->turned, z_d)) * (1 / across);
    const imp_v3 start_d = imp__cross(turned_d, x->axis) + imp__cross(x->turned, axis_d);
    return start_d * imp__dot(x->start, e) + turned_d * imp__dot(x->turned, e);
}

/* At a line's point, outward from it; all but uv. */
static void surface_at(const struct imp_curves *k, const struct imp__curve_at *at,
                       const struct across *x, imp_v3 outward, struct imp_surface *out)
{
    const imp_v3 q = outward * at->r;
    out->p = at->c + q;
    const imp_v3 n = imp__normalize(imp__curve_normal(k, at, outward));
    out->n = out->ng = imp__is_finite(n) ? n : outward; /* a sharp bend */
    out->dp_du = imp__cross(x->axis, q) * IMP_2PI;
    out->dp_dv = (at->d1 + outward * at->r1 + bending(at, x, outward) * at->r) *
                 (double)k->n_segments;
    imp__surface_frame(out);
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out)
{
    const struct imp_curves *k = &s->curves;
    struct imp__curve_at at;
    double v = hit->u;
    const imp_v3 outward = imp__curve_meet(k, hit->prim, hit->t, &v, *o, *d, &at);
    const struct across x = across_of(&at);
    out->uv[0] = imp__uv_turn(imp__dot(x.start, outward), imp__dot(x.turned, outward));
    out->uv[1] = (v + hit->prim) / (double)k->n_segments;
    surface_at(k, &at, &x, outward, out);
}

/* Swept circles: on the ball at a joint of cones one uv belongs to many points. */
static void place(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim)
{
    (void)prim;
    const struct imp_curves *k = &s->curves;
    const double along = imp_clamp(uv[1], 0, 1) * (double)k->n_segments;
    const double segment = fmin(floor(along), (double)(k->n_segments - 1));
    struct imp__curve_at at;
    imp__curve_at(k, (int)segment, along - segment, &at);
    const struct across x = across_of(&at);
    const double turn = IMP_2PI * uv[0];
    out->uv[0] = uv[0];
    out->uv[1] = uv[1];
    surface_at(k, &at, &x, x.start * cos(turn) + x.turned * sin(turn), out);
}

/* Nearer to an end of a cone than this it is the ball there that was met. */
#define AT_END 1e-9

struct imp_located imp__curve_locate(const struct imp_curves *k, int segment,
                                     const double uv[2], imp_v3 normal)
{
    const double v = imp_clamp(uv[1] * (double)k->n_segments - segment, 0.0, 1.0);
    struct imp_located x = {segment, {(float)uv[0], (float)v}};
    if (k->degree != 1 || (v > AT_END && v < 1 - AT_END)) return x;
    struct imp__curve_at at;
    imp__curve_at(k, segment, v < 0.5 ? 0 : 1, &at);
    const imp_v3 axis = imp__curve_axis(&at);
    const double angle =
        atan2(imp__length(imp__cross(axis, normal)), imp__dot(axis, normal));
    x.at[1] = (float)(v < 0.5 ? -1 - angle : 2 + angle);
    return x;
}

void imp__curve_surface(const struct imp_curves *k, int segment, const float at[2],
                        struct imp_surface *out)
{
    const double turn = IMP_2PI * at[0];
    const bool ball = at[1] < 0 || at[1] > 1;
    const double v = imp_clamp((double)at[1], 0.0, 1.0);
    struct imp__curve_at here;
    imp__curve_at(k, segment, v, &here);
    const struct across x = across_of(&here);
    double along = 0, across = 1; /* outward, which on a cone leans */
    if (ball) {
        const double angle = at[1] < 0 ? -1 - (double)at[1] : (double)at[1] - 2;
        along = cos(angle);
        across = sin(angle);
    } else if (k->degree == 1) {
        const double length = imp__length(here.d1);
        along = length > 0 ? imp_clamp(-here.r1 / length, -1.0, 1.0) : 0;
        across = sqrt(1 - along * along);
    }
    out->uv[0] = at[0];
    out->uv[1] = (v + segment) / (double)k->n_segments;
    const imp_v3 round = x.start * cos(turn) + x.turned * sin(turn);
    surface_at(k, &here, &x, x.axis * along + round * across, out);
}

/* Turned, shifted and stretched alike, with the radii. */
static void move(struct imp_shape *s, const double to_world[12])
{
    float *points = (float *)(uintptr_t)s->curves.points; /* its own, of build() */
    const double scale = imp__length(imp__rows_vector(to_world, imp__v3(1, 0, 0)));
    s->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    s->hi = -s->lo;
    for (size_t k = 0; k < s->curves.n_points; k++) {
        float *q = points + 4 * k;
        const imp_v3 p = imp__rows_point(to_world, imp__v3(q[0], q[1], q[2]));
        const double r = q[3] * scale;
        for (int i = 0; i < 3; i++) {
            q[i] = (float)p[i];
            s->lo[i] = imp_min(p[i] - r, s->lo[i]);
            s->hi[i] = imp_max(p[i] + r, s->hi[i]);
        }
        q[3] = (float)r;
    }
    s->lo[3] = s->hi[3] = 0;
    s->area = area_of(&s->curves);
}

#define CURVE_OPS(name_, build_, place_, move_)                                          \
    {                                                                                    \
        .size = sizeof(struct imp_shape_ops), .name = name_, .build = build_,            \
        .surface = surface, .place = place_, .move = move_                               \
    }
const struct imp_shape_ops imp__bsplinecurve =
    CURVE_OPS("bsplinecurve", bspline_build, place, move);
const struct imp_shape_ops imp__linearcurve =
    CURVE_OPS("linearcurve", linear_build, NULL, NULL);
