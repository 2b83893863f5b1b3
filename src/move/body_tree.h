/* SPDX-License-Identifier: Apache-2.0
 *
 * Trees of boxes over the triangles of bodies, by which pairs of triangles that may meet are found. */
#ifndef IMP_MOVE_BODY_TREE_H
#define IMP_MOVE_BODY_TREE_H

#include "edges.h"

struct imp__body_triangle {
    imp_v3 p[3]; /* world */
    int prim;
};

struct imp__body_node {
    imp_v3 lo, hi;
    size_t from, till; /* triangles */
    size_t second;     /* its second child, the first is the next node; 0: a leaf */
};

struct imp__body_tree {
    size_t n;
    struct imp__body_triangle *triangle; /* [n] */
    struct imp__body_node *node;
};

enum imp_status imp__body_tree_build(const struct imp_scene *scene,
                                     const struct imp__body *body,
                                     struct imp__body_tree *out);
void imp__body_tree_free(imp_context *ctx, struct imp__body_tree *tree);

/* Two triangles whose boxes meet, nearly. */
typedef enum imp_status imp__body_pair(void *payload, const struct imp__body_triangle *f,
                                       const struct imp__body_triangle *g);
/* All pairs of a triangle of `a` and one of `b`, which may be `a`, in an order that depends on these
 * alone, but for some that are further than `apart` from each other. */
enum imp_status imp__body_pairs(const struct imp__body_tree *a,
                                const struct imp__body_tree *b, double apart,
                                imp__body_pair *work, void *payload);

#endif
