/* SPDX-License-Identifier: Apache-2.0
 *
 * A fit while it runs, and its objective as an optimiser sees it. */
#ifndef IMP_BEND_FIT_H
#define IMP_BEND_FIT_H

#include "bend_fingerprint.h"
#include "lbfgs.h"
#include "sobolev.h"

struct imp__bend_run {
    imp_bend *b;
    const struct imp_bend_fit_options *o;
    struct imp__goal goal;
    struct imp__opt_options opt;
    struct imp__fingerprint print;
    struct imp__sobolev metric;
    uint8_t *held;
    double *theta, *bar, *lo, *hi, *scale,
        *x0;    /* [n_theta], of active numbers where [n] */
    size_t *at; /* [n] index in theta */
    /* Search and grid of the level before, whose memory is carried on. */
    struct imp__search *last;
    imp_field *coarse;
    size_t *coarse_at; /* [last->n] */
    bool carries;
    int level, levels, done_iterations, n_evaluated;
    double fraction_lo, fraction_hi, start_s, last_report_s, last_checkpoint_s;
    double last_value, best_value, rays_done;
    struct imp_bend_stats stats;
    char note[80];
};

/* Values of the active numbers, into the field. */
enum imp_status imp__bend_fit_set(struct imp__bend_run *f, const double *x);
/* Calls the caller's progress, at most ten times a second unless forced. True: the fit is to stop. */
bool imp__bend_fit_report(struct imp__bend_run *f, bool force);
/* For struct imp__goal: the objective with its gradient, and what follows an iteration. */
enum imp_status imp__bend_fit_eval(const double *x, uint64_t seed, struct imp_estimate *e,
                                   double *g, double *g_se, void *payload);
enum imp_status imp__bend_fit_iterated(const struct imp__search *s, void *payload);
/* Active numbers by M of sobolev.h. */
void imp__bend_fit_smoothed(double *x, void *payload);

#endif
