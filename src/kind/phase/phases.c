/* SPDX-License-Identifier: Apache-2.0
 *
 * The phase functions: one line a kind. */
#include "kind/build.h"

#define PHASES(X)                                                                        \
    X(imp__blendphase)                                                                   \
    X(imp__hg)                                                                           \
    X(imp__isotropic)                                                                    \
    X(imp__rayleigh)                                                                     \
    X(imp__tabphase)

#define DECLARE(kind) extern const struct imp_phase_ops kind;
PHASES(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_phase_ops *const imp__phase_kinds[] = {PHASES(ADDRESS) NULL};
