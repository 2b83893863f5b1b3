/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrators: what a picture holds. A kind is a table; those of this program are listed
 * by the room that makes pictures (film/film_integrator.c), since most belong to rooms
 * above this one: walk, elements, film. The scene makes them and does not depend on their
 * settings. */
#ifndef IMP_SCENE_INTEGRATOR_H
#define IMP_SCENE_INTEGRATOR_H

#include "kind/build.h"

struct imp_scene;

enum imp_integrator_flags {
    IMP_INTEGRATOR_WALKS = 1,      /* radiance along walks; self is a struct
                                 imp_walk_integrator (walk/core/walk_integrator.h) */
    IMP_INTEGRATOR_SOLVES = 2,     /* finite elements; self is a struct
                                  imp_elements_integrator */
    IMP_INTEGRATOR_CONTAINS = 4,   /* others, which must be INNER */
    IMP_INTEGRATOR_INNER = 8,      /* may be contained */
    IMP_INTEGRATOR_NO_FIELDS = 16, /* has no derivative of a graded index */
    IMP_INTEGRATOR_MEDIA = 32      /* media scatter its walks */
};

struct imp_integrator {
    const struct imp_integrator_ops *ops;
    void *self;       /* ops->object_size bytes, filled by build */
    const char *name; /* of one that is contained: its slot, for names of channels */
    int max_depth;    /* as in imp_scene_get_info; -1: unlimited, or none */
    int n_inner;
    struct imp_integrator *inner; /* [n_inner], in document order */
};

struct imp_integrator_ops {
    size_t size; /* size, name, object_size: as all tables of kinds (kinds.h) */
    const char *name;
    size_t object_size;
    unsigned flags;
    /* Read the properties, fill self and max_depth. What it contains is there. */
    enum imp_status (*build)(const struct imp_build *build, struct imp_integrator *i);
    /* All objects of the scene are there: settle what depends on them. NULL: nothing. */
    enum imp_status (*ready)(struct imp_scene *scene, const struct imp_integrator *i);
};

#endif
