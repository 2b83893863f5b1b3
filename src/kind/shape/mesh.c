/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangle meshes, from files (`obj`, `ply`, `serialized`) or from calls (`mesh`), in world
 * space after build. A mirroring to_world or flip_normals reverses the winding, so that
 * geometric and shading normals agree (docs/scene-format.md 4.3, as Mitsuba 3.10). */
#include "math/warp.h"
#include "mesh_triangle.h"
#include <math.h>
#include <string.h>

/* A point of a triangle in two floats: 60 bits, of which the triangle's number takes what
 * it needs, and two barycentric weights the rest. So a point is found without its position,
 * which of a mesh in a group is another in each instance. An integer k below 2^30 is the
 * float of bits k + 0x00800000, between 2^-126 and 4: no operation rounds it. */
#define WORD_BITS  30
#define FLOAT_BASE 0x00800000u

static int weight_bits(const struct imp_shape *s)
{
    int prim = 0;
    while (prim < 31 && s->triangles.n_triangles > (size_t)1 << prim) prim++;
    return imp_min((2 * WORD_BITS - prim) / 2, 26);
}
static double word_write(uint64_t k)
{
    const uint32_t bits = (uint32_t)(k & ((1u << WORD_BITS) - 1)) + FLOAT_BASE;
    float out;
    memcpy(&out, &bits, sizeof out);
    return out;
}
static uint64_t word_read(double v)
{
    const float in = (float)v;
    uint32_t bits;
    memcpy(&bits, &in, sizeof bits);
    return (bits - FLOAT_BASE) & ((1u << WORD_BITS) - 1);
}
static void point_write(const struct imp_shape *s, const struct imp_hit *hit,
                        double uv[2])
{
    const int n = weight_bits(s);
    const double most = (double)((1u << n) - 1);
    const uint64_t u = (uint64_t)rint(imp_clamp(hit->u, 0., 1.) * most),
                   v = (uint64_t)rint(imp_clamp(hit->v, 0., 1.) * most);
    const uint64_t word = ((uint64_t)hit->prim << n | u) << n | v;
    uv[0] = word_write(word);
    uv[1] = word_write(word >> WORD_BITS);
}
static struct imp_hit point_read(const struct imp_shape *s, const double uv[2])
{
    const int n = weight_bits(s);
    const uint64_t word = word_read(uv[1]) << WORD_BITS | word_read(uv[0]);
    const uint64_t most = (1u << n) - 1, prim = word >> 2 * n;
    const double u = (double)(word >> n & most) / (double)most,
                 v = (double)(word & most) / (double)most;
    return (struct imp_hit){.prim = prim < s->triangles.n_triangles ? (int)prim : 0,
                            .u = u,
                            .v = imp_min(v, 1 - u)};
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit,
                    struct imp_surface *out)
{
    const struct imp__mesh *m = s->self;
    if (imp_unlikely(!m->facets)) {
        imp__mesh_from_arrays(m, hit, out);
        return;
    }
    const struct imp__facet *f = &m->facets[hit->prim];
    imp__mesh_point(m, hit, &(struct imp__mesh_corner){f->p0, f->e1, f->e2}, f->ng, out);
    out->dp_du = f->dp_du;
    out->dp_dv = f->dp_dv;
    if (m->face_tangents) {
        out->s = f->s;
        out->t = f->t;
    } else {
        imp__surface_frame(out);
    }
}

void imp__mesh_surface(const struct imp_shape *s, const struct imp_hit *hit,
                       const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    (void)o, (void)d;
    surface(s, hit, out);
    if (imp_unlikely(s->by_triangle)) point_write(s, hit, out->uv);
}

void imp__triangle_weights(const struct imp_shape *s, int prim, const imp_v3 *p,
                           double b[3])
{
    const uint32_t *i = s->triangles.indices + 3 * (size_t)prim;
    const imp_v3 p0 = imp__mesh_load(s->triangles.positions, i[0]);
    const imp_v3 e1 = imp__mesh_load(s->triangles.positions, i[1]) - p0,
                 e2 = imp__mesh_load(s->triangles.positions, i[2]) - p0, d = *p - p0;
    const double a = imp__dot(e1, e1), c = imp__dot(e2, e2), m = imp__dot(e1, e2);
    const double det = a * c - m * m, x = imp__dot(e1, d), y = imp__dot(e2, d);
    const bool sliver = !(det > 0);
    b[1] = sliver ? 0 : imp_clamp((c * x - m * y) / det, 0.0, 1.0);
    b[2] = sliver ? 0 : imp_clamp((a * y - m * x) / det, 0.0, 1.0 - b[1]);
    b[0] = 1 - b[1] - b[2];
}

void imp__mesh_place(const struct imp_shape *s, const double uv[2],
                     struct imp_surface *out, int *prim)
{
    const struct imp_hit hit = point_read(s, uv);
    *prim = hit.prim;
    surface(s, &hit, out);
}

/* A triangle by its area, and barycentric weights in it. */
static inline struct imp_hit draw(const struct imp_shape *s, const struct imp__mesh *m,
                                  const double u[2])
{
    double within;
    const size_t lo = imp__mesh_triangle_draw(s, m, u[0], &within);
    double b[2];
    imp__uniform_triangle((double[2]){within, u[1]}, b);
    return (struct imp_hit){.prim = (int)lo, .u = b[0], .v = b[1]};
}

void imp__mesh_area_numbers(const struct imp_shape *s, int prim, const double b[2],
                            double u[2])
{
    const struct imp__mesh *m = s->self;
    const double *c = m->cumulative + prim;
    double within[2];
    imp__uniform_triangle_inverse(b, within);
    for (int k = 0; k < 2; k++) within[k] = imp_clamp(within[k], 1e-9, 1 - 1e-9);
    u[0] = (c[0] + within[0] * (c[1] - c[0])) / s->area;
    u[1] = within[1];
}

static inline struct imp_located located(const struct imp_hit *hit)
{
    return (struct imp_located){hit->prim, {(float)hit->u, (float)hit->v}};
}

/* The point of a hit as a light sample: density inv_area. */
static inline bool sample_at(const struct imp_shape *s, const struct imp_hit *hit,
                             const imp_v3 *ref, const double *inv_area,
                             struct imp_light_sample *out)
{
    const struct imp__mesh *m = s->self;
    const size_t lo = (size_t)hit->prim;
    const struct imp__facet *f = m->facets ? &m->facets[lo] : NULL;
    const struct imp__mesh_corner c =
        f ? (struct imp__mesh_corner){f->p0, f->e1, f->e2} : imp__mesh_corner(m, lo);
    struct imp_surface at;
    imp__mesh_point(m, hit, &c, f ? f->ng : imp__mesh_face_normal(&c), &at);
    if (imp_unlikely(s->by_triangle)) point_write(s, hit, at.uv);
    out->uv[0] = at.uv[0];
    out->uv[1] = at.uv[1];
    out->located = located(hit);
    const double one = inv_area ? *inv_area : 2 / imp__length(imp__cross(c.e1, c.e2));
    return imp__light_from_area(*ref, at.p, at.ng, at.n, one, out);
}

bool imp__mesh_sample(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                      struct imp_light_sample *out)
{
    const struct imp__mesh *m = s->self;
    if (!(s->area > 0)) return false;
    const struct imp_hit hit = draw(s, m, u);
    return sample_at(s, &hit, ref, &m->inv_area, out);
}

bool imp__mesh_sample_triangle(const struct imp_shape *s, int prim, const imp_v3 *ref,
                               const double u[2], struct imp_light_sample *out)
{
    double b[2];
    imp__uniform_triangle(u, b);
    const struct imp_hit hit = {.prim = prim, .u = b[0], .v = b[1]};
    return sample_at(s, &hit, ref, NULL, out);
}

void imp__mesh_sample_area(const struct imp_shape *s, const double u[2],
                           struct imp_surface *out)
{
    const struct imp_hit hit = draw(s, s->self, u);
    imp__mesh_surface(s, &hit, NULL, NULL, out);
    out->located = located(&hit);
}

double imp__mesh_pdf(const struct imp_shape *s, const imp_v3 *ref,
                     const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    const struct imp__mesh *m = s->self;
    return imp__area_to_angle(*ref, at->p, at->ng, m->inv_area);
}

static enum imp_status mesh_build(const struct imp_build *b, void *self,
                                  struct imp_shape *s)
{
    bool face_normals;
    const enum imp_status st = imp_build_bool(b, "face_normals", false, &face_normals);
    if (st != IMP_OK) return st;
    if (!b->node->mesh)
        return imp_build_error(b, NULL, IMP_E_SCENE, "no triangles were given to it");
    return imp__mesh_build(b, self, s, b->node->mesh, face_normals);
}

/* The file has been read by now; its properties are only marked as known. */
static enum imp_status file_build(const struct imp_build *b, void *self,
                                  struct imp_shape *s)
{
    const char *filename;
    bool flip;
    enum imp_status st = imp_build_string(b, "filename", NULL, &filename);
    if (st == IMP_OK) st = imp_build_bool(b, "flip_tex_coords", false, &flip);
    if (st != IMP_OK) return st;
    return mesh_build(b, self, s);
}

static enum imp_status serialized_build(const struct imp_build *b, void *self,
                                        struct imp_shape *s)
{
    int64_t index;
    const enum imp_status st = imp_build_int(b, "shape_index", 0, 0, INT32_MAX, &index);
    return st == IMP_OK ? file_build(b, self, s) : st;
}

#define MESH_OPS(name_, build_)                                                          \
    {                                                                                    \
        .size = sizeof(struct imp_shape_ops), .name = name_,                             \
        .object_size = sizeof(struct imp__mesh), .build = build_,                        \
        .surface = imp__mesh_surface, .sample_toward = imp__mesh_sample,                 \
        .pdf_toward = imp__mesh_pdf, .sample_area = imp__mesh_sample_area,               \
        .flags = IMP_SHAPE_TRIANGLES, .place = imp__mesh_place,                          \
        .sample_triangle = imp__mesh_sample_triangle, .move = imp__mesh_move,            \
        .placed = imp__mesh_placed                                                       \
    }

const struct imp_shape_ops imp__mesh = MESH_OPS("mesh", mesh_build);
const struct imp_shape_ops imp__obj = MESH_OPS("obj", file_build);
const struct imp_shape_ops imp__ply = MESH_OPS("ply", file_build);
const struct imp_shape_ops imp__serialized = MESH_OPS("serialized", serialized_build);
