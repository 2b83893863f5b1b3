/* SPDX-License-Identifier: Apache-2.0
 *
 * What sensors share: placement, and for projective ones clipping planes and field of
 * view.
 */
#ifndef IMP_KIND_PROJECTION_H
#define IMP_KIND_PROJECTION_H

#include "distortion.h"
#include "kind/build.h"
#include "math/transform.h"

struct imp_projection {
    struct imp_mat4 to_world, to_local;
    double near_clip, far_clip, focus_distance;
};

/* to_world and its inverse; an error where it is not finite, affine and invertible. */
enum imp_status imp__sensor_place(const struct imp_build *b, struct imp_mat4 *m,
                                  struct imp_mat4 *inverse);

/* to_world, near_clip, far_clip and focus_distance. `rigid`: a scale in to_world is an error
 * (tolerance 1e-3). */
enum imp_status imp__projection_build(const struct imp_build *b, bool rigid,
                                      struct imp_projection *out);

/* tan of half the horizontal field of view, from fov and fov_axis, or focal_length;
 * aspect is width/height of the full film (docs/scene-format.md 9). */
enum imp_status imp__fov_build(const struct imp_build *b, double aspect,
                               double *tan_half_x);

/* Moves its place in the world (imp_sensor_ops.move). */
void imp__projection_move(struct imp_projection *p, const double to_world[12]);
/* Its place as a map (imp_sensor_ops.placed). `rigid`: that may turn and shift it from where it is,
 * and no more (tolerance 1e-6). */
bool imp__projection_placed(struct imp_projection *p, bool rigid, double to_world[12],
                            bool set);

/* A ray through local point o along v (v_z > 0), starting on the near plane: t is
 * measured from there. */
static inline void imp__projection_ray(const struct imp_projection *p, imp_v3 o, imp_v3 v,
                                       struct imp_sensor_ray *out)
{
    const double inv_z = 1 / v[2];
    const imp_v3 d = imp__vector(&p->to_world, v);
    const double length = imp__length(d);
    out->o = imp__point(&p->to_world, o + v * (p->near_clip * inv_z));
    out->d = d * (1 / length);
    out->t_near = 0;
    out->t_far = (p->far_clip - p->near_clip) * inv_z * length;
}

/* The film of a camera whose rays through local point o run along (x, y, 1) - o/f. Without a lens
 * x = x0 + px dx, y = y0 + py dy, and solid angle and film area are
 *
 *     dw = |dx dy| cos(theta)^3 dpx dpy,    theta: the angle with the axis
 *
 * A lens divides that by the determinant of its slope (distortion.h). */
struct imp_film_plane {
    double x0, dx, y0, dy;
    /* Bounds of x and y on the film, with a filter's radius and a pixel beside it. */
    double x_least, x_most, y_least, y_most;
    double beside, width, height;      /* the filter's radius, and the film, in pixels */
    double k[5];                       /* of the lens: k1, k2, p1, p2, k3 */
    struct imp_distortion *table;      /* place for the lens */
    const struct imp_distortion *lens; /* the table, filled; NULL: k is 0 */
};
/* Field of view, principal point and distortion. `offset`: principal_point_offset_x, _y
 * are properties too. */
enum imp_status imp__film_plane_build(const struct imp_build *b, bool offset,
                                      const struct imp_film_desc *film,
                                      struct imp_film_plane *out);
/* imp_sensor_ops.view. */
bool imp__film_plane_view(struct imp_film_plane *film, double number[IMP_VIEW_NUMBERS],
                          bool set);
/* d(x, y)/d(number) of what a fixed film position sees, where it sees (x, y, 1). */
void imp__film_plane_velocity(const struct imp_film_plane *film, int number,
                              const double at[2], double out[2]);
/* (x, y, 1) at a film position. */
static inline imp_v3 imp__film_plane_at(const struct imp_film_plane *film, double px,
                                        double py)
{
    const double x = film->x0 + px * film->dx, y = film->y0 + py * film->dy;
    if (!film->lens) return imp__v3(x, y, 1);
    double out[2]; /* of axes to the right and down */
    imp__undistort(film->lens, (double[2]){-x, -y}, out);
    return imp__v3(-out[0], -out[1], 1);
}
/* The ray that comes from ref (imp_sensor_ops.connect), if it may be on the film. */
bool imp__projection_connect(const struct imp_projection *p,
                             const struct imp_film_plane *film, imp_v3 o, double focus,
                             imp_v3 ref, bool far, struct imp_sensor_sample *out);

#endif
