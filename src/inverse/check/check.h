/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradient checks: what imp_check's files share. Frozen checks see wrong derivative code
 * and are blind to wrong densities; fresh seeds see those too, with noise
 * (docs/estimators.md 13). */
#ifndef IMP_INVERSE_CHECK_H
#define IMP_INVERSE_CHECK_H

#include "inverse/estimate/replicates.h"

/* dF/d a value, or along a direction through all numbers of a parameter
 * (imp__check_direction), by walks from one end. */
struct imp__slope {
    size_t param;
    int64_t element; /* -1: the parameter's only value, or the direction */
    struct imp_estimate d;
};

struct imp__check {
    struct imp_problem *problem;
    imp_context *ctx;
    struct imp_run run, outer; /* of an evaluation, with our progress; the caller's */
    struct imp_check_options options;
    struct imp_tracer tracer;
    struct imp_check_row *rows; /* [n_rows], names in the problem's check_arena */
    size_t n_rows, cap_rows;
    struct imp__slope *slopes; /* [n_slopes] of fresh rows, by the check's own walks */
    size_t n_slopes;
    double start_s, done, total; /* pieces of work */
    double shown;                /* fraction reported last */
    bool stopped;
};

/* A row; `element` < 0: of the parameter as a whole, param NULL: of all of them. */
enum imp_status imp__check_row(struct imp__check *c, const char *method,
                               const char *param, int64_t element,
                               const struct imp_check_row *row);
/* Does the caller want rows of this method? */
bool imp__check_wants(const struct imp__check *c, const char *method);
/* `work` more pieces are done; IMP_CANCELLED if the caller wants to stop. */
enum imp_status imp__check_progress(struct imp__check *c, double work);

/* Typical size of value e of a parameter: its value, not below 1e-3 of its range. */
double imp__check_scale(const struct imp_param *p, size_t e);

/* Parameters of more values than this have one row, along a direction. */
#define IMP_CHECK_SINGLY 3
/* That direction: each value moves to the side where it has more room, since texels may
 * be at both bounds. w [count] */
void imp__check_direction(const struct imp_param *p, double *w);

enum imp_status imp__check_frozen(struct imp__check *c); /* frozen, dot, euler */
enum imp_status imp__check_poses(struct imp__check *c);  /* frozen, of poses */
enum imp_status imp__check_fresh(struct imp__check *c);
enum imp_status imp__check_losses(struct imp__check *c);
enum imp_status imp__check_ends(struct imp__check *c);
enum imp_status imp__check_densities(struct imp__check *c);
enum imp_status imp__check_sampling(struct imp__check *c); /* uniform, energy, aim */
enum imp_status imp__check_aims(struct imp__check *c, const struct imp_tracer *tracer);

#endif
