/* SPDX-License-Identifier: Apache-2.0
 *
 * The scene and the call of hand_tracer.c. */
#ifndef HAND_TRACER_H
#define HAND_TRACER_H

#include <stdint.h>

struct hand_sphere {
    double centre[3], radius;
    double albedo[3];
    int mirror; /* else diffuse */
};
/* centre + x a + y b, x and y in [-1, 1]; a and b at a right angle. Its front is that of a x b:
 * it reflects there alone, diffusely, and emits there. */
struct hand_rectangle {
    double centre[3], a[3], b[3];
    double albedo[3], emits[3];
};
struct hand_scene {
    const struct hand_sphere *sphere;
    const struct hand_rectangle *rectangle;
    int n_spheres, n_rectangles;
    int light;                            /* the rectangle that emits */
    double eye[3], target[3], up[3], fov; /* degrees, across the width */
    int max_depth, rr_depth;
};

/* The mean of spp samples of each pixel, box filter; the same picture on any number of threads.
 * out [height][width][3], from the top. */
void hand_render(const struct hand_scene *scene, int width, int height, int spp,
                 uint64_t seed, int threads, double *out);

#endif
