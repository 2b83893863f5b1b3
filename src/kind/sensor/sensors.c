/* SPDX-License-Identifier: Apache-2.0
 *
 * The sensors: one line a kind. */
#include "kind/build.h"

#define SENSORS(X)                                                                       \
    X(imp__perspective)                                                                  \
    X(imp__thinlens)                                                                     \
    X(imp__orthographic)                                                                 \
    X(imp__irradiancemeter)                                                              \
    X(imp__radiancemeter)                                                                \
    X(imp__distant)                                                                      \
    X(imp__batch)

#define DECLARE(kind) extern const struct imp_sensor_ops kind;
SENSORS(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_sensor_ops *const imp__sensor_kinds[] = {SENSORS(ADDRESS) NULL};
