/* SPDX-License-Identifier: Apache-2.0
 *
 * The integrator `elements` of a scene file: options of the solver. */
#ifndef IMP_ELEMENTS_INTEGRATOR_H
#define IMP_ELEMENTS_INTEGRATOR_H

#include "scene/integrator.h"
#include <importon/elements.h>

struct imp_elements_integrator { /* 0: default (struct imp_elements_options) */
    enum imp_elements_image image;
    int order, rays, max_level;
    bool no_importance;
    double stop; /* < 0: never */
    double eps;
    size_t max_links, max_bytes;
};

extern const struct imp_integrator_ops imp__integrator_elements;

/* NULL: another integrator, or none. */
static inline const struct imp_elements_integrator *
imp__elements_integrator(const struct imp_integrator *i)
{
    return i && i->ops->flags & IMP_INTEGRATOR_SOLVES ? i->self : NULL;
}

#endif
