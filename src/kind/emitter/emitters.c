/* SPDX-License-Identifier: Apache-2.0
 *
 * The lights: one line a kind. */
#include "kind/build.h"

#define EMITTERS(X)                                                                      \
    X(imp__area)                                                                         \
    X(imp__stam_m1)                                                                      \
    X(imp__beam_light)                                                                   \
    X(imp__point_light)                                                                  \
    X(imp__ies_light)                                                                    \
    X(imp__ies_area)                                                                     \
    X(imp__constant)                                                                     \
    X(imp__envmap)                                                                       \
    X(imp__directional)                                                                  \
    X(imp__directionalarea)                                                              \
    X(imp__spot_light)                                                                   \
    X(imp__sun)                                                                          \
    X(imp__projector)                                                                    \
    X(imp__sunsky)                                                                       \
    X(imp__ciesky)                                                                       \
    X(imp__perezsky)

#define DECLARE(kind) extern const struct imp_emitter_ops kind;
EMITTERS(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_emitter_ops *const imp__emitter_kinds[] = {EMITTERS(ADDRESS) NULL};
