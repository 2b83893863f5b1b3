/* SPDX-License-Identifier: Apache-2.0
 *
 * The unit disk at z = 0 under an affine map, hence any ellipse. */
#include "math/warp.h"
#include "shape.h"
#include <string.h>

struct disk {
    struct imp_mat4 to_world, to_local;
    imp_v3 n;
    double inv_area;
};

/* Area and box, of where it is. */
static void settle(struct disk *k, struct imp_shape *s)
{
    const imp_v3 a = imp__mat4_column(&k->to_world, 0),
                 c = imp__mat4_column(&k->to_world, 1);
    s->area = IMP_PI * imp__length(imp__cross(a, c));
    k->inv_area = 1 / s->area;
    /* |x a_i + y c_i| is largest on the unit circle where (x, y) is along (a_i, c_i). */
    const imp_v3 center = imp__point(&k->to_world, imp__v3(0, 0, 0));
    for (int i = 0; i < 3; i++) {
        const double reach = hypot(a[i], c[i]);
        s->lo[i] = center[i] - reach;
        s->hi[i] = center[i] + reach;
    }
    s->lo[3] = s->hi[3] = 0;
}

static void face(struct disk *k, const struct imp_shape *s, bool mirrored)
{
    k->n = imp__normalize(imp__cross(imp__mat4_column(&k->to_world, 0),
                                     imp__mat4_column(&k->to_world, 1))) *
           ((mirrored != s->flip_normals) ? -1.0 : 1.0);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_shape *s)
{
    struct disk *k = self;
    struct imp_placement at;
    const enum imp_status st = imp__shape_placement(b, s, &at);
    if (st != IMP_OK) return st;
    k->to_world = at.to_world;
    k->to_local = at.to_local;
    face(k, s, at.mirrored);
    settle(k, s);
    if (!(s->area > 0) || !isfinite(s->area))
        return imp_build_error(b, NULL, IMP_E_SCENE, "its area is %g", s->area);
    s->geometry = IMP_ANALYTIC;
    return IMP_OK;
}

/* u, v of the hit: x and y on the unit disk. */
static bool intersect(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                      double tmin, double tmax, struct imp_hit *hit)
{
    const struct disk *k = s->self;
    const imp_v3 p = imp__point(&k->to_local, *o), w = imp__vector(&k->to_local, *d);
    const double t = -p[2] / w[2];
    const double x = p[0] + t * w[0], y = p[1] + t * w[1];
    if (!(t > tmin && t < tmax) || !(x * x + y * y <= 1)) return false;
    hit->t = t;
    hit->u = x;
    hit->v = y;
    hit->prim = 0;
    return true;
}

static void surface_at(const struct disk *k, double x, double y, struct imp_surface *out)
{
    const double r = sqrt(x * x + y * y);
    out->p = imp__point(&k->to_world, imp__v3(x, y, 0));
    out->ng = out->n = k->n;
    out->uv[0] = r;
    out->uv[1] = imp__uv_turn(x, y);
    out->dp_du =
        imp__vector(&k->to_world, r > 0 ? imp__v3(x / r, y / r, 0) : imp__v3(1, 0, 0));
    out->dp_dv = imp__vector(&k->to_world, imp__v3(-y, x, 0)) * IMP_2PI;
    imp__surface_frame(out);
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out)
{
    (void)o, (void)d;
    surface_at(s->self, hit->u, hit->v, out);
}

static void place(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim)
{
    (void)prim;
    const double phi = IMP_2PI * uv[1];
    surface_at(s->self, uv[0] * cos(phi), uv[0] * sin(phi), out);
}

static void sample_area(const struct imp_shape *s, const double u[2],
                        struct imp_surface *out)
{
    double xy[2];
    imp__concentric_disk(u, xy);
    surface_at(s->self, xy[0], xy[1], out);
}

static bool sample_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                          struct imp_light_sample *out)
{
    const struct disk *k = s->self;
    double xy[2];
    imp__concentric_disk(u, xy);
    out->uv[0] = sqrt(xy[0] * xy[0] + xy[1] * xy[1]);
    out->uv[1] = imp__uv_turn(xy[0], xy[1]);
    return imp__light_from_area(*ref, imp__point(&k->to_world, imp__v3(xy[0], xy[1], 0)),
                                k->n, k->n, k->inv_area, out);
}

static double pdf_toward(const struct imp_shape *s, const imp_v3 *ref,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    const struct disk *k = s->self;
    return imp__area_to_angle(*ref, at->p, at->ng, k->inv_area);
}

static void move(struct imp_shape *s, const double to_world[12])
{
    struct disk *k = s->self;
    struct imp_mat4 by = {{0}}, back;
    memcpy(by.m, to_world, 12 * sizeof *to_world);
    by.m[15] = 1;
    if (!imp__mat4_inverse(&by, &back)) return; /* no motion is singular */
    k->to_world = imp__mat4_multiply(&by, &k->to_world);
    k->to_local = imp__mat4_multiply(&k->to_local, &back);
    k->n = imp__normalize(imp__rows_vector(to_world, k->n));
    settle(k, s);
}

static bool placed(struct imp_shape *s, double to_world[12], bool set)
{
    struct disk *k = s->self;
    if (!set) {
        memcpy(to_world, k->to_world.m, 12 * sizeof *to_world);
        return true;
    }
    k->to_world = imp__mat4_of_rows(to_world);
    if (!imp__mat4_inverse(&k->to_world, &k->to_local)) return false;
    face(k, s, imp__mat4_det3(&k->to_world) < 0);
    settle(k, s);
    return true;
}

const struct imp_shape_ops imp__disk = {.size = sizeof(struct imp_shape_ops),
                                        .name = "disk",
                                        .flags = IMP_SHAPE_CONVEX | IMP_SHAPE_FLAT,
                                        .object_size = sizeof(struct disk),
                                        .build = build,
                                        .intersect = intersect,
                                        .surface = surface,
                                        .sample_toward = sample_toward,
                                        .pdf_toward = pdf_toward,
                                        .sample_area = sample_area,
                                        .place = place,
                                        .move = move,
                                        .placed = placed};
