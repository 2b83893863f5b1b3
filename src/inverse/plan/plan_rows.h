/* SPDX-License-Identifier: Apache-2.0
 *
 * A plan at work (plan_rank.c), and the rows that candidates have in it. */
#ifndef IMP_PLAN_ROWS_H
#define IMP_PLAN_ROWS_H

#include "planning.h"
#include "walk/run/run.h"

struct imp__plan_work {
    struct imp_problem *p, *blank;
    struct imp_arena *arena;
    struct imp_plan_options o;
    struct imp_plan_candidate *c; /* [n_all] */
    size_t n_all, n;              /* candidates; variables */
    struct imp_run run;
    double *width;     /* [n] standard deviations of the priors */
    double *span;      /* [n] large changes */
    const bool *given; /* [n] they are the caller's */
    const bool *held;  /* [n] numbers that stay */
    double *unit;      /* [n] own unit over that of x */
    struct imp__plan_model model;
    struct imp__plan_data *data; /* [n_all] */
    const struct imp__plan_data **have,
        **open;      /* those that we have, and that are ranked */
    size_t *open_at; /* [n_open] index of the candidate */
    double *cost;    /* [n_open] */
    size_t n_have, n_open;
    struct imp__plan_known today, then;
    size_t own, done; /* for progress: this process's candidates, and twice those found */
};

/* The standard deviations that a covariance C has, in the numbers' own units. */
enum imp_status imp__plan_errors(const struct imp__plan_work *plan, const double *C,
                                 const double **out);

/* Rows of the open candidates, by falling worth, in groups without a significant difference. */
enum imp_status imp__plan_rows(struct imp__plan_work *plan, struct imp_plan_result *r);

#endif
