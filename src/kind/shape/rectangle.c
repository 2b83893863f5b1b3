/* SPDX-License-Identifier: Apache-2.0
 *
 * The square [-1,1]^2 at z = 0 under an affine map: a parallelogram. Embree sees two
 * triangles; the surface is computed from the parallelogram itself, in double. */
#include "math/pair.h"
#include "shape_lanes.h"
#include <string.h>

struct rectangle {
    imp_v3 corner, eu, ev; /* p = corner + u eu + v ev, so eu and ev are dp_du, dp_dv */
    imp_v3 up;             /* the image of local +z, of which the side alone matters */
    imp_v3 s, t, n;        /* the shading frame is the same everywhere */
    double inv_area;
    float positions[12 + 4]; /* and Embree's 16 bytes */
    uint32_t indices[6];
};

/* What follows from corner, edges and normal. */
static void settle(struct rectangle *r, struct imp_shape *s)
{
    struct imp_surface frame = {.n = r->n, .dp_du = r->eu};
    imp__surface_frame(&frame);
    r->s = frame.s;
    r->t = frame.t;
    s->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    s->hi = -s->lo;
    for (int k = 0; k < 4; k++) {
        const imp_v3 p =
            r->corner + r->eu * (double)(k == 1 || k == 2) + r->ev * (double)(k >= 2);
        for (int i = 0; i < 3; i++) {
            r->positions[3 * k + i] = (float)p[i];
            s->lo[i] = imp_min(p[i], s->lo[i]);
            s->hi[i] = imp_max(p[i], s->hi[i]);
        }
    }
    s->lo[3] = s->hi[3] = 0;
}

/* By to_world, all but what follows. */
static void lay(struct rectangle *r, struct imp_shape *s, const struct imp_mat4 *to_world,
                bool mirrored)
{
    r->corner = imp__point(to_world, imp__v3(-1, -1, 0));
    r->eu = imp__vector(to_world, imp__v3(2, 0, 0));
    r->ev = imp__vector(to_world, imp__v3(0, 2, 0));
    r->up = imp__mat4_column(to_world, 2);
    s->area = imp__length(imp__cross(r->eu, r->ev));
    r->inv_area = 1 / s->area;
    /* The image of local +z as normals go, so that mirroring in the plane keeps its side.
     */
    r->n = imp__normalize(imp__cross(r->eu, r->ev)) *
           ((mirrored != s->flip_normals) ? -1.0 : 1.0);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_shape *s)
{
    struct rectangle *r = self;
    struct imp_placement at;
    const enum imp_status st = imp__shape_placement(b, s, &at);
    if (st != IMP_OK) return st;

    lay(r, s, &at.to_world, at.mirrored);
    if (!(s->area > 0) || !isfinite(s->area))
        return imp_build_error(b, NULL, IMP_E_SCENE, "its area is %g", s->area);

    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    memcpy(r->indices, indices, sizeof indices);
    settle(r, s);
    s->geometry = IMP_TRIANGLES;
    s->triangles = (struct imp_triangles){4, 2, r->positions, r->indices, 0};
    return IMP_OK;
}

static void move(struct imp_shape *s, const double to_world[12])
{
    struct rectangle *r = s->self;
    r->corner = imp__rows_point(to_world, r->corner);
    r->eu = imp__rows_vector(to_world, r->eu);
    r->ev = imp__rows_vector(to_world, r->ev);
    r->up = imp__rows_vector(to_world, r->up);
    r->n = imp__normalize(imp__rows_vector(to_world, r->n));
    settle(r, s);
}

static bool placed(struct imp_shape *s, double to_world[12], bool set)
{
    struct rectangle *r = s->self;
    if (set) {
        const struct imp_mat4 m = imp__mat4_of_rows(to_world);
        lay(r, s, &m, imp__mat4_det3(&m) < 0);
        settle(r, s);
    } else {
        imp__rows_of_columns(r->eu * 0.5, r->ev * 0.5, r->up,
                             r->corner + (r->eu + r->ev) * 0.5, to_world);
    }
    return true;
}

static inline void surface_at(const struct rectangle *r, double u, double v,
                              struct imp_surface *out)
{
    out->uv[0] = u;
    out->uv[1] = v;
    out->p = r->corner + r->eu * u + r->ev * v;
    out->ng = out->n = r->n;
    out->s = r->s;
    out->t = r->t;
    out->dp_du = r->eu;
    out->dp_dv = r->ev;
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out)
{
    (void)o, (void)d;
    /* Corners (0,0) (1,0) (1,1) (0,1), triangles 012 and 023. */
    const double sum = hit->u + hit->v;
    surface_at(s->self, hit->prim == 0 ? sum : hit->u, hit->prim == 0 ? hit->v : sum,
               out);
}

static void place(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim)
{
    (void)prim;
    const struct imp_hit hit = {.prim = 0, .u = uv[0] - uv[1], .v = uv[1]};
    surface(s, &hit, NULL, NULL, out);
}

/* By the first triangle, whose weights may leave it. */
static inline struct imp_located located(double u, double v)
{
    return (struct imp_located){0, {(float)(u - v), (float)v}};
}

static void sample_area(const struct imp_shape *s, const double u[2],
                        struct imp_surface *out)
{
    /* uv as `surface` makes them of a hit before the diagonal or behind it: the larger one
     * is the smaller one plus what it is larger by. */
    const double sum = imp_min(u[0], u[1]) + fabs(u[0] - u[1]);
    const imp_pair uv = imp__pair_choose(imp__pair_exceeds(u[1], u[0]),
                                         (imp_pair){u[0], sum}, (imp_pair){sum, u[1]});
    surface_at(s->self, uv[0], uv[1], out);
    out->located = located(uv[0], uv[1]);
}

static bool sample_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                          struct imp_light_sample *out)
{
    const struct rectangle *r = s->self;
    out->uv[0] = u[0];
    out->uv[1] = u[1];
    out->located = located(u[0], u[1]);
    return imp__light_from_area(*ref, r->corner + r->eu * u[0] + r->ev * u[1], r->n, r->n,
                                r->inv_area, out);
}

static double pdf_toward(const struct imp_shape *s, const imp_v3 *ref,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    const struct rectangle *r = s->self;
    return imp__area_to_angle(*ref, at->p, at->ng, r->inv_area);
}

const struct imp_shape_ops imp__rectangle = {.size = sizeof(struct imp_shape_ops),
                                             .name = "rectangle",
                                             .flags = IMP_SHAPE_CONVEX |
                                                      IMP_SHAPE_SQUARE | IMP_SHAPE_FLAT,
                                             .object_size = sizeof(struct rectangle),
                                             .build = build,
                                             .surface = surface,
                                             .sample_toward = sample_toward,
                                             .pdf_toward = pdf_toward,
                                             .sample_area = sample_area,
                                             .place = place,
                                             .move = move,
                                             .placed = placed};

/* ---- In lanes ---------------------------------------------------------------------------- */

static imp_wide3 points_at(const struct rectangle *r, imp_wide u, imp_wide v)
{
    return imp__wide3_plus(imp__wide3_plus(imp__wide3_of(r->corner),
                                           imp__wide3_times(imp__wide3_of(r->eu), u)),
                           imp__wide3_times(imp__wide3_of(r->ev), v));
}

static void surfaces(const struct imp_shape *s, const struct imp_wide_hits *h, bool uv,
                     struct imp_wide_surface *out)
{
    const struct rectangle *r = s->self;
    const imp_wide u = imp__wide_taken(h->u, h->at), v = imp__wide_taken(h->v, h->at);
    const imp_wide sum = u + v;
    imp_wide_truth before;
    for (int k = 0; k < IMP_WIDE_LANES; k++)
        before[k] = -(int64_t)(h->prim[h->at[k]] == 0);
    const imp_wide at_u = imp__wide_choose(before, sum, u),
                   at_v = imp__wide_choose(before, v, sum);
    out->p = points_at(r, at_u, at_v);
    out->ng = imp__wide3_of(r->n);
    out->frame = (imp_wide_frame){imp__wide3_of(r->s), imp__wide3_of(r->t), out->ng};
    if (!uv) return;
    out->uv[0] = at_u;
    out->uv[1] = at_v;
}

static void sample_toward_lanes(const struct imp_shape *s, const imp_wide3 *ref,
                                const imp_wide u[2], struct imp_wide_light *out)
{
    const struct rectangle *r = s->self;
    const imp_wide3 n = imp__wide3_of(r->n);
    imp__lights_from_area(*ref, points_at(r, u[0], u[1]), n, n, imp__wide(r->inv_area),
                          out);
    if (!out->recorded) return;
    for (int k = 0; k < IMP_WIDE_LANES; k++) out->prim[k] = 0;
    out->located[0] = u[0] - u[1];
    out->located[1] = out->uv[1] = u[1];
    out->uv[0] = u[0];
}

static void sample_area_lanes(const struct imp_shape *s, const imp_wide u[2],
                              struct imp_wide_emission *out)
{
    const struct rectangle *r = s->self;
    const imp_wide sum = imp__wide_lesser(u[0], u[1]) + imp__wide_magnitude(u[0] - u[1]);
    const imp_wide_truth behind = u[1] > u[0];
    out->uv[0] = imp__wide_choose(behind, u[0], sum);
    out->uv[1] = imp__wide_choose(behind, sum, u[1]);
    out->p = points_at(r, out->uv[0], out->uv[1]);
    out->ng = out->n = imp__wide3_of(r->n);
    for (int k = 0; k < IMP_WIDE_LANES; k++) out->prim[k] = 0;
    out->located[0] = out->uv[0] - out->uv[1];
    out->located[1] = out->uv[1];
}

const struct imp_shape_lanes imp__rectangle_lanes = {.surface = surfaces,
                                                     .sample_toward = sample_toward_lanes,
                                                     .sample_area = sample_area_lanes};
