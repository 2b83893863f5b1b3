/* SPDX-License-Identifier: Apache-2.0
 *
 * The disc of an emitter `sun`. */
#ifndef IMP_KIND_EMITTER_SUN_H
#define IMP_KIND_EMITTER_SUN_H

#include "kind/build.h"
#include "math/vec.h"

/* Direction towards its middle, world, and its solid angle. False: e is no `sun`. */
bool imp__sun_disc(const struct imp_emitter *e, imp_v3 *axis, double *size);

#endif
