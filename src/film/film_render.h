/* SPDX-License-Identifier: Apache-2.0
 *
 * Between the solvers: this room is above walk and elements, which do not include each
 * other. */
#ifndef IMP_FILM_RENDER_H
#define IMP_FILM_RENDER_H

#include "film_measure.h"

/* Solve the scene by finite elements and render it with the measure's sensor, in the
 * pixel format of its film. IMP_CANCELLED with the picture of a coarser solution. */
enum imp_status imp__render_elements(const struct imp_measure *measure,
                                     const struct imp_run *run, imp_film **out);

/* imp_render by a checked run, of some pixels [height][width] where a pixel's samples are its own: the
 * others stay 0. only NULL: all. */
enum imp_status imp__render_pixels(const struct imp_scene *scene,
                                   const struct imp_run *run, const bool *only,
                                   imp_film **out);
/* imp__render_pixels of all points of a grid, which share what they meet where they can
 * (imp__measure_together). *alone: the first channel without that; 0: they do not share. */
enum imp_status imp__render_grid(const struct imp_scene *scene, const struct imp_run *run,
                                 int *alone, imp_film **out);

#endif
