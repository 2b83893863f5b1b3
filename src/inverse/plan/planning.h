/* SPDX-License-Identifier: Apache-2.0
 *
 * What the parts of a plan share (importon/plan.h has the model). Matrices are in the units of the
 * priors: number k over its prior's standard deviation, so that the prior is the unit matrix. */
#ifndef IMP_INVERSE_PLANNING_H
#define IMP_INVERSE_PLANNING_H

#include "inverse/estimate/lamp_levels.h"
#include "inverse/problem/problem.h"
#include "search/optimize.h"
#include <importon/plan.h>

/* ---- plan_stage.c: a candidate put into the scene ------------------------------------ */

struct imp__plan_stage {
    struct imp_scene *scene;
    struct imp_sensor *sensor; /* moved; NULL: it stands where it was */
    void *rest;                /* what it was */
    struct imp__lamp_levels lamps;
};
/* What messages call it. */
const char *imp__plan_name(const struct imp_scene *scene,
                           const struct imp_plan_candidate *c);
/* To be ended by imp__plan_stage_end, also after a failure. */
enum imp_status imp__plan_stage_begin(struct imp_scene *scene,
                                      const struct imp_plan_candidate *c,
                                      struct imp__plan_stage *stage);
void imp__plan_stage_end(struct imp__plan_stage *stage);

/* ---- plan_information.c ---------------------------------------------------------------- */

/* The information of a picture. */
struct imp__plan_data {
    double *H;          /* [n][n] J^T W J */
    double *deviations; /* [IMP_DEVIATIONS][n][n] its jackknife (search/optimize.h) */
    double lit;         /* fraction of values that count */
};
/* The picture as a target whose values and weights, each value's own, come from a pilot picture
 * with seed run->seed, on the stage. `blank`: a problem of the scene in which nothing is active.
 * The caller frees it by imp__target_free. */
enum imp_status imp__plan_target(struct imp_problem *p, struct imp_problem *blank,
                                 const struct imp_plan_candidate *c,
                                 const struct imp_plan_options *options,
                                 const struct imp_run *run, struct imp__target *target,
                                 double *lit);
/* width [n]: the prior's standard deviations. Sets all of `out`, whose arrays are there. */
enum imp_status imp__plan_information(struct imp_problem *p, struct imp_problem *blank,
                                      const struct imp_plan_candidate *c,
                                      const struct imp_plan_options *options,
                                      const struct imp_run *run, const double *width,
                                      struct imp__plan_data *out);

/* ---- plan_parts.c ---------------------------------------------------------------------- */

/* Is this process to find the information of candidate i of n_all? Of parts, one is; a merge is of none. */
bool imp__plan_part_has(const imp_context *ctx, size_t candidate, size_t n_all);
/* A part computes its candidates as one process would: it leaves the team of parts, which is to be put back
 * into ctx->team if it is not NULL. */
struct imp__team *imp__plan_part_alone(imp_context *ctx);
/* Parts and their merge have the same candidates, noise, widths [p->n] and run. */
enum imp_status imp__plan_parts_same(struct imp_problem *p,
                                     const struct imp_plan_candidate *candidates,
                                     size_t n_all, const struct imp_plan_options *options,
                                     const double *width, const struct imp_run *run);
/* data [n_all], whose H and deviations are one array: a part keeps its own and returns IMP_PART, a merge
 * reads those of all. */
enum imp_status imp__plan_parts_share(imp_context *ctx, struct imp__plan_data *data,
                                      size_t n_all, size_t n);

/* ---- plan_criterion.c ------------------------------------------------------------------ */

struct imp__plan_model {
    imp_context *ctx;
    size_t n;
    enum imp_plan_criterion kind;
    const size_t *of; /* [n_of] wanted numbers */
    size_t n_of;
};
/* What is known with some pictures. */
struct imp__plan_known {
    double *C;    /* [n][n] covariance */
    double *pull; /* [n][n] d phi / d (sum of information) */
    double *values,
        *vectors; /* [n] eigenvalues of the sum of information, ascending; [n][n]
                                 row k belongs to values[k] */
    bool *loose;  /* [n] values[k] is not above twice its error: it counts as 0 */
    double phi;   /* of the criterion: the gain is what it grows by */
    double
        hidden; /* what phi would grow by if loose directions had as much as their errors allow:
                      not known, and so a part of the error of phi */
    double *work;
};
enum imp_status imp__plan_known_create(const struct imp__plan_model *m,
                                       struct imp__plan_known *out);
void imp__plan_known_destroy(imp_context *ctx, struct imp__plan_known *k);
/* With `items` [n_items]. */
enum imp_status imp__plan_evaluate(const struct imp__plan_model *m,
                                   const struct imp__plan_data *const *items,
                                   size_t n_items, struct imp__plan_known *out);
/* Information on a direction, in those of its prior, below which it is not determined: the
 * posterior is half as wide as the prior. */
#define IMP_PLAN_LOOSE 3
/* out [n][n]: *r unit vectors that span what `items` leave undetermined. Uses up `scratch`. */
enum imp_status imp__plan_loose(const struct imp__plan_model *m,
                                const struct imp__plan_data *const *items, size_t n_items,
                                struct imp__plan_known *scratch, double *out, size_t *r);
/* out [IMP_DEVIATIONS]: trace of pull times the deviations of an item. */
void imp__plan_deviations(size_t n, const double *pull, const struct imp__plan_data *item,
                          double *out);

/* ---- plan_choose.c --------------------------------------------------------------------- */

struct imp__plan_choice {
    const struct imp__plan_model *model;
    const struct imp__plan_data *const *have; /* [n_have] */
    size_t n_have;
    const struct imp__plan_data *const *items; /* [n] that may be chosen */
    const double *cost;                        /* [n] */
    size_t n, take;
    double budget;
};
/* chosen [n] indices, *n_chosen of them, in the order of their worth at their turn; *gain with the
 * error by all items; known: with them. */
enum imp_status imp__plan_choose(const struct imp__plan_choice *choice, size_t *chosen,
                                 size_t *n_chosen, struct imp__plan_known *known,
                                 struct imp_estimate *gain);

#endif
