/* SPDX-License-Identifier: Apache-2.0
 *
 * What sensors share: placement; of projective ones clipping planes, field of view.
 */
#ifndef IMP_KIND_PROJECTION_H
#define IMP_KIND_PROJECTION_H

#include "kind/build.h"
#include "math/transform.h"

struct imp_projection {
    struct imp_mat4 to_world, to_local;
    double near_clip, far_clip, focus_distance;
};

/* to_world and its inverse; an error where it is not finite, affine and invertible. */
enum imp_status imp__sensor_place(const struct imp_build *b, struct imp_mat4 *m,
                                  struct imp_mat4 *inverse);

/* to_world, near_clip, far_clip and focus_distance. `rigid`: a scale in to_world is an error (tolerance 1e-3). */
enum imp_status imp__projection_build(const struct imp_build *b, bool rigid,
                                      struct imp_projection *out);

/* tan of half the horizontal field of view, from fov and fov_axis, or focal_length;
 * aspect is width/height of the full film (docs/scene-format.md 9). */
enum imp_status imp__fov_build(const struct imp_build *b, double aspect,
                               double *tan_half_x);

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

/* Of a camera whose rays through local point o run along (x0 + px dx, y0 + py dy, 1) - o/f:
 * the ray that comes from ref (imp_sensor_ops.connect), if it may be on the film. Solid
 * angle and film area are
 *
 *     dw = |dx dy| cos(theta)^3 dpx dpy,    theta: the angle with the axis */
struct imp_film_plane {
    double x0, dx, y0, dy;
    /* Bounds of x0 + px dx and y0 + py dy on the film, with a filter's radius and a pixel
     * beside it. */
    double x_least, x_most, y_least, y_most;
};
void imp__film_plane_bound(const struct imp_film_desc *film,
                           struct imp_film_plane *plane);
bool imp__projection_connect(const struct imp_projection *p,
                             const struct imp_film_plane *film, imp_v3 o, double focus,
                             imp_v3 ref, bool far, struct imp_sensor_sample *out);

#endif
