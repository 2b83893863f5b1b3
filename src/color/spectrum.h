/* SPDX-License-Identifier: Apache-2.0
 *
 * A sampled spectrum at a wavelength: linear between its samples, 0 outside. */
#ifndef IMP_COLOR_SPECTRUM_H
#define IMP_COLOR_SPECTRUM_H

#include "base/arena.h"
#include <importon/kinds.h>

/* value = weight[0] value[first] + weight[1] value[first + 1]: what a lane's value is
 * made of, and where its derivative goes. False: outside, where it is 0. */
bool imp__spectrum_at(const struct imp_spectrum *s, double nm, size_t *first,
                      double weight[2]);

/* A copy that lives as long as the arena; NULL if out of memory. */
struct imp_spectrum *imp__spectrum_keep(struct imp_arena *arena, size_t n,
                                        const double *nm, const double *value);

#endif
