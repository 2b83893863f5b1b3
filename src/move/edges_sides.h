/* SPDX-License-Identifier: Apache-2.0
 *
 * The sides of all triangles, and the lines on which they lie: those on one line have nearly one key. A
 * side has no face, which can be made of its triangle again, since there are many. */
#ifndef IMP_MOVE_EDGES_SIDES_H
#define IMP_MOVE_EDGES_SIDES_H

#include "edges.h"

struct imp__side {
    double a[3], b[3]; /* world; b is ahead of a by the sense that all lines have */
    double key;        /* the same for sides on one line, and with luck for no other */
    double from, till; /* along the line that represents them */
    uint32_t body, prim;
    uint8_t corner; /* of the triangle, at which it begins there */
    bool taken;     /* it has a line */
};
static inline imp_v3 imp__side_a(const struct imp__side *s)
{
    return imp__v3(s->a[0], s->a[1], s->a[2]);
}
static inline imp_v3 imp__side_b(const struct imp__side *s)
{
    return imp__v3(s->b[0], s->b[1], s->b[2]);
}

struct imp__sides {
    const struct imp_scene *scene;
    imp_v3 middle; /* of the scene */
    double near;   /* sides nearer to each other lie on each other */
    double size;   /* of the scene */
    size_t n_bodies;
    struct imp__body *body;   /* [n_bodies] of triangles, by shape and place */
    struct imp_map (*map)[2]; /* of their places */
    size_t n;
    struct imp__side *side; /* [n] by key, body and triangle */
};

/* Those of some bodies of triangles; middle, near and size are given. */
enum imp_status imp__sides_make(struct imp__sides *x, const struct imp__body *body,
                                size_t n_bodies);
void imp__sides_free(struct imp__sides *x);

/* A face as an edge has it. */
struct imp__edge_face imp__side_face(const struct imp__sides *x,
                                     const struct imp__side *side);

/* work() of the sides of each line: in the order of `from`, the first line first. */
typedef enum imp_status imp__line_work(void *payload, struct imp__side *const *side,
                                       size_t n);
enum imp_status imp__lines_find(struct imp__sides *x, imp__line_work *work,
                                void *payload);

#endif
