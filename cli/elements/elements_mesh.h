/* SPDX-License-Identifier: Apache-2.0
 *
 * Which elements of a solution the report's page draws. */
#ifndef ELEMENTS_MESH_H
#define ELEMENTS_MESH_H

#include <importon/elements.h>

/* Ids of elements on the page: those that are drawn first, then others that links come
 * from. Where there are too many leaves, an element with at most `most` of them replaces
 * them: it is fine where the solution is. */
struct elements_mesh {
    const imp_elements *e;
    size_t n; /* elements of the solution */
    struct imp_elements_element *all;
    int channels;
    size_t *leaves; /* [n] below each, or 1 */
    size_t most;
    double least_area; /* of what is drawn, where there are too many polygons */
    size_t n_leaves, shown, others;
    size_t *index;     /* [shown + others] of an element */
    size_t *id;        /* [n] ELEMENTS_NONE: not yet given */
    const char **name; /* [n_names] shapes */
    size_t n_names;
};
#define ELEMENTS_NONE SIZE_MAX

/* All [n] elements; a status of the command. */
int elements_mesh_read(struct elements_mesh *m, const imp_elements *e, size_t n);
void elements_mesh_choose(struct elements_mesh *m); /* those that are drawn */
/* A name's place in the list; the same pointer is the same shape. */
size_t elements_mesh_name(struct elements_mesh *m, const char *name);
/* Id of what is drawn in an element's place, or of a place of its own. */
size_t elements_mesh_id(struct elements_mesh *m, size_t k);
void elements_mesh_free(struct elements_mesh *m);

#endif
