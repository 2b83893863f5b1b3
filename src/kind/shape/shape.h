/* SPDX-License-Identifier: Apache-2.0
 *
 * What shapes share: where they are placed, the shading frame, and the change of measure
 * between area and solid angle. */
#ifndef IMP_KIND_SHAPE_H
#define IMP_KIND_SHAPE_H

#include "base/compiler.h"
#include "kind/build.h"
#include "math/motion.h"

struct imp_placement {
    struct imp_mat4 to_world, to_local;
    bool mirrored; /* to_world turns right hands into left hands */
};

/* Read the properties that all shapes have: to_world (affine and invertible, or an
 * error), flip_normals, and silhouette_sampling_weight, which forward pictures ignore. */
enum imp_status imp__shape_placement(const struct imp_build *b, struct imp_shape *s,
                                     struct imp_placement *out);

/* A column of the upper left 3x3: the image of a unit vector. */
static inline imp_v3 imp__mat4_column(const struct imp_mat4 *a, int j)
{
    return imp__v3(a->m[j], a->m[4 + j], a->m[8 + j]);
}

/* The images of x, y, z as an orthonormal frame (of either hand) and their lengths. False:
 * to_world shears, or the first `equal` of the lengths differ, so that they are not all. */
bool imp__placement_frame(const struct imp_mat4 *to_world, int equal,
                          struct imp_frame *frame, double length[3]);

/* The sphere or circular cylinder that a shape is part of. False: none. */
static inline bool imp__shape_round(const struct imp_shape *s, struct imp_round *out)
{
    *out = (struct imp_round){.radius = 0};
    if (s->ops->round) s->ops->round(s, out);
    return out->radius > 0;
}

/* s and t from n and dp_du (docs/scene-format.md 3.2); the basis of n alone where dp_du
 * vanishes. */
static inline void imp__surface_frame(struct imp_surface *x)
{
    const imp_v3 s = x->dp_du - x->n * imp__dot(x->n, x->dp_du);
    const double l2 = imp__dot(s, s);
    if (imp_likely(l2 > 1e-20 * imp__dot(x->dp_du, x->dp_du))) {
        x->s = s * (1 / sqrt(l2));
        x->t = imp__cross(x->n, x->s);
    } else {
        const struct imp_frame f = imp__frame_from_normal(x->n);
        x->s = f.s;
        x->t = f.t;
    }
}

/* From a group to the world. */
static inline void imp__surface_move(struct imp_surface *x,
                                     const struct imp_map *to_world,
                                     const struct imp_map *to_local)
{
    x->p = imp__map_point(to_world, x->p);
    x->ng = imp__normalize(imp__map_normal(to_local, x->ng));
    x->n = imp__normalize(imp__map_normal(to_local, x->n));
    x->dp_du = imp__map_vector(to_world, x->dp_du);
    x->dp_dv = imp__map_vector(to_world, x->dp_dv);
    imp__surface_frame(x);
}

/* A point of the shape as decisions name it (scene/located.h); drawn: what drew it set, uv
 * there. */
static inline struct imp_located imp__located_drawn(const struct imp_shape *s,
                                                    const struct imp_located *drawn,
                                                    const double uv[2])
{
    if (!s) return (struct imp_located){.prim = -1, .at = {0, 0}};
    if (imp_likely(s->geometry == IMP_TRIANGLES)) return *drawn;
    return (struct imp_located){0, {(float)uv[0], (float)uv[1]}};
}

/* Points nearer to edge-on than this are neither drawn nor given a density. */
#define IMP_GRAZING 1e-12

/* Density per solid angle at ref of the point p, drawn uniformly from `area`:
 * p(w) = r^2 / (area |cos|) with the geometric normal (PBR 4e, eq. 6.30). */
static inline double imp__area_to_angle(imp_v3 ref, imp_v3 p, imp_v3 ng, double inv_area)
{
    const imp_v3 d = p - ref;
    const double r2 = imp__dot(d, d), c = fabs(imp__dot(d, ng));
    return c > IMP_GRAZING * sqrt(r2) ? r2 * sqrt(r2) * inv_area / c : 0;
}

/* The light sample of a point drawn uniformly by area; n is the shading normal. */
static inline bool imp__light_from_area(imp_v3 ref, imp_v3 p, imp_v3 ng, imp_v3 n,
                                        double inv_area, struct imp_light_sample *out)
{
    const imp_v3 d = p - ref;
    const double r = imp__length(d);
    out->pdf = imp__area_to_angle(ref, p, ng, inv_area);
    if (!(out->pdf > 0) || !(r < INFINITY)) return false;
    out->wi = d * (1 / r);
    out->dist = r;
    out->cos_light = -imp__dot(out->wi, n);
    out->p = p;
    out->ng = ng;
    return true;
}

/* Angle about the axis over 2 pi, in [0, 1). */
static inline double imp__uv_turn(double x, double y)
{
    const double phi = atan2(y, x) * (1 / IMP_2PI), turn = phi < 0 ? phi + 1 : phi;
    return turn < 1 ? turn : 0;
}

/* A mesh from arrays that live as long as the scene (mesh_build.c); b, s as in build. */
enum imp_status imp__mesh_build(const struct imp_build *b, void *self,
                                struct imp_shape *s, const struct imp_mesh_data *data,
                                bool face_normals);
/* The area of a mesh, and what its points are drawn by (mesh_build.c); others have theirs. For a
 * shape that emits, measures or is aimed at; done again, it does nothing. */
enum imp_status imp__shape_measure(imp_context *ctx, struct imp_arena *arena,
                                   struct imp_shape *s);
/* Angle-weighted vertex normals, averaged over vertices at equal positions
 * (mesh_normals.c). out [3 n_vertices]. */
enum imp_status imp__mesh_normals(imp_context *ctx, size_t n_vertices, size_t n_triangles,
                                  const float *positions, const uint32_t *indices,
                                  float *out);
/* A triangle as light samples and hits want it, in double: made once for meshes of few. */
struct imp__facet {
    imp_v3 p0, e1, e2, ng; /* first vertex, edges from it, face normal */
    imp_v3 dp_du, dp_dv;
    imp_v3 s, t; /* shading frame, where the normals are the faces' */
};
#define IMP_FACETS_MAX 1024 /* triangles of a mesh that has them: 256 kB */
struct imp__mesh {
    const float *positions, *normals, *uvs; /* world; normals, uvs may be NULL */
    const uint32_t *indices;
    bool reversed;      /* second and third vertex were exchanged */
    double *cumulative; /* [n + 1] area of the triangles before this one; NULL: no points
                           are drawn (imp__shape_measure), and the next two are 0 */
    size_t last;        /* the last triangle that has area */
    double inv_area;
    const double *face_tangents; /* [3 n_triangles] s of the shading frame of flat meshes,
                                    where it does not vary over a triangle; else NULL */
    const struct imp__facet *facets; /* [n_triangles]; NULL: too many */
    double to_world[12];
};
void imp__mesh_surface(const struct imp_shape *s, const struct imp_hit *hit,
                       const imp_v3 *o, const imp_v3 *d, struct imp_surface *out);
/* A circular cylinder between the middles of its ends; its frame turns as little as possible. */
void imp__cylinder_set(struct imp_shape *s, imp_v3 p0, imp_v3 p1, double radius);
/* As imp_shape_ops.move (mesh_build.c). */
void imp__mesh_move(struct imp_shape *s, const double to_world[12]);
bool imp__mesh_placed(struct imp_shape *s, double to_world[12], bool set);
/* As imp_shape_ops.place. */
void imp__mesh_place(const struct imp_shape *s, const double uv[2],
                     struct imp_surface *out, int *prim);
/* Barycentric weights of the point of a triangle that is next to p in its plane, within
 * the triangle. */
void imp__triangle_weights(const struct imp_shape *s, int prim, const imp_v3 *p,
                           double b[3]);
void imp__mesh_sample_area(const struct imp_shape *s, const double u[2],
                           struct imp_surface *out);
/* The numbers u by which imp__mesh_sample_area makes a point of a triangle, given by the weights of
 * its second and third vertex. The point moves by a part of 1e-9 at most, since one on an edge
 * might be that of another triangle after rounding. */
void imp__mesh_area_numbers(const struct imp_shape *s, int prim, const double b[2],
                            double u[2]);
bool imp__mesh_sample(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                      struct imp_light_sample *out);
/* As imp_shape_ops.sample_triangle. */
bool imp__mesh_sample_triangle(const struct imp_shape *s, int prim, const imp_v3 *ref,
                               const double u[2], struct imp_light_sample *out);
double imp__mesh_pdf(const struct imp_shape *s, const imp_v3 *ref,
                     const struct imp_hit *hit, const struct imp_surface *at);

#endif
