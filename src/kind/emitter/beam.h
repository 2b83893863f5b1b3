/* SPDX-License-Identifier: Apache-2.0
 *
 * Light from a surface with a direction; for solvers that keep it analytic. */
#ifndef IMP_KIND_EMITTER_BEAM_H
#define IMP_KIND_EMITTER_BEAM_H

#include "math/vec.h"

enum { IMP_BEAM_RADIANCE, IMP_BEAM_EXPONENT };

struct imp__beam {
    imp_v3 axis; /* unit, world */
    bool aimed;  /* axis is set; else it is the surface's normal */
};
extern const struct imp_emitter_ops imp__beam_light;

#endif
