/* SPDX-License-Identifier: Apache-2.0
 *
 * Bent segments of a walk through a scene: a ray from a point on or in a body of graded
 * index to the first shape it hits, and the derivatives of that. Refraction and radiance
 * at its ends are the walk's. */
#ifndef IMP_BEND_INSIDE_H
#define IMP_BEND_INSIDE_H

#include "bend_problem.h"
#include "scene/scene.h"

struct imp_graded {
    imp_bend *bend; /* field and options */
    struct imp__plan plan;
    bool ready;
};

/* Takes the bend over, also on failure. */
enum imp_status imp__graded_create(imp_bend *bend, struct imp_graded **out);
void imp__graded_destroy(struct imp_graded *g);
/* Choose the step for shapes that lie in lo..hi. Error messages have no file and line. */
enum imp_status imp__graded_ready(struct imp_graded *g, imp_v3 lo, imp_v3 hi);
static inline const imp_field *imp__graded_field(const struct imp_graded *g)
{
    return g->bend->field;
}
static inline double imp__graded_index(const struct imp_graded *g, const imp_v3 *x)
{
    struct imp__jet j;
    imp__field_eval1(g->bend->field, x, 1, &j);
    return j.eta;
}
/* Add to a hash what is no parameter of a medium (where its field lies, a profile's axis),
 * by the index at some points. */
uint64_t imp__graded_hash(uint64_t h, const struct imp_body *m);

/* The surface of a shape near a point p of it, as a level set. */
void imp__level(const struct imp_shape *s, imp_v3 p, imp_v3 ng,
                struct imp__surface *level);
/* The hit that the shape's `surface` needs to recompute x: of a straight ray of unit
 * direction d that reaches x, on the shape, after the distance `far`. */
void imp__hit_at(const struct imp_shape *s, imp_v3 x, imp_v3 d, double far,
                 struct imp_hit *hit);

struct imp__ride {
    imp_v3 x, d, end;           /* start, unit directions there and at the end */
    struct imp__jet j, k;       /* index and its gradient there */
    struct imp__state from, at; /* start and end of the last, fractional step */
    double tau, length;         /* of that step; from start to end, along the ray */
    uint32_t steps;             /* whole steps before it */
    struct imp__surface level;  /* the surface hit */
};
/* Trace a ray from x along d; ng is the normal of the surface it leaves (0: none). False:
 * it left the body without a hit, or the index is not a positive number there. */
bool imp__ride(const struct imp_body *medium, const struct imp_scene *scene, imp_v3 x,
               imp_v3 ng, imp_v3 d, struct imp__ride *ride, struct imp_hit *hit);

/* Derivatives with respect to the numbers of a medium that are active. base [n_params]:
 * place of a parameter's first number in x, or -1. */
struct imp__graded_active {
    const struct imp_body *medium;
    const int64_t *base;
    struct imp_sink *sink;    /* reverse */
    int lane;                 /* of it */
    const double *x_dot;      /* forward */
    struct imp__block *block; /* reverse: splats of one cell are gathered here; or NULL */
};
/* a d eta + b . d grad eta at x goes to the sink. */
void imp__graded_splat(const struct imp__graded_active *to, const imp_v3 *x, double a,
                       const imp_v3 *b);
double imp__graded_tangent(const struct imp__graded_active *along, const imp_v3 *x);
/* Cotangents of position and unit direction at the end -> at the start. */
void imp__ride_back(const struct imp__graded_active *to, const struct imp__ride *ride,
                    imp_v3 *lam, imp_v3 *mu);
/* Tangents of position and unit direction at the start -> at the end. */
void imp__ride_tangent(const struct imp__graded_active *along,
                       const struct imp__ride *ride, imp_v3 *x_dot, imp_v3 *d_dot);

#endif
