/* SPDX-License-Identifier: Apache-2.0
 *
 * The mean over a sensor's film, as one number of light. */
#ifndef IMP_INVERSE_ROOM_AVERAGE_H
#define IMP_INVERSE_ROOM_AVERAGE_H

#include "scene/scene.h"

/* Luminance of the mean over the film of run->sensor, with the error of the walks' spread:
 * light walks reach many pixels. gradient, gradient_se as imp_problem_functional's. */
enum imp_status imp__room_average(imp_problem *problem, const struct imp_run *run,
                                  struct imp_estimate *value, double *gradient,
                                  double *gradient_se);

#endif
