/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a scene's own walks, some of every scatterer, at which densities are asked. */
#ifndef IMP_INVERSE_CHECK_PLACES_H
#define IMP_INVERSE_CHECK_PLACES_H

#include "check.h"
#include "walk/core/step.h"

struct imp__place {
    struct imp_walk walk; /* that it belongs to */
    const struct imp_vertex *v;
    int depth; /* vertices before it */
    struct imp_surface at;
    struct imp_frame frame;
    bool located; /* at and frame are known */
};

/* One scatterer: a material, or the points of a medium. */
struct imp__place_kind {
    const char *name;
    struct imp__place *place; /* [n] */
    int n;
};

struct imp__places {
    struct imp__check *check;
    struct imp_arena arena;
    struct imp_tracer tracer; /* of walks from the sensor; they are recorded */
    int n_kinds;
    struct imp__place_kind
        *kind;               /* [n_kinds] materials, then media, in the scene's order */
    struct imp__place **all; /* [n_all], kind by kind in turn */
    int n_all;
};

/* p->check is set. No places where walks from the sensor are refused. To be destroyed also
 * after a failure. */
enum imp_status imp__places_find(struct imp__places *p);
void imp__places_destroy(struct imp__places *p);

/* The walk that made the place as it was there, with the densities that take part.
 * walk, scratch [IMP_INPUTS_MAX]: room. */
void imp__place_step(const struct imp__places *p, const struct imp__place *place,
                     struct imp_walk *walk, imp_spec *scratch, struct imp_step *s);

#endif
