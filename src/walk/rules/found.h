/* SPDX-License-Identifier: Apache-2.0
 *
 * Predicates of features (features.h): one a feature, which fills in who bears it. */
#ifndef IMP_WALK_FOUND_H
#define IMP_WALK_FOUND_H

#include "features.h"

#define IMP_FOUND(name)                                                                  \
    bool imp__found_##name(const struct imp_job *j, struct imp_bearer *by)
#define IMP_BEARS(object)                                                                \
    (*by = (struct imp_bearer){.name = (object)->name, .kind = (object)->ops->name})

#define IMP_FOUND_DECLARED(name, text) IMP_FOUND(name);
IMP_FOUND_FEATURES(IMP_FOUND_DECLARED)

#endif
