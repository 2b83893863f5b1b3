/* SPDX-License-Identifier: Apache-2.0
 *
 * What imp_fit, which runs a search on a problem, shares with its parts. */
#ifndef IMP_INVERSE_FIT_H
#define IMP_INVERSE_FIT_H

#include "inverse/gradient/allocation.h"
#include "inverse/problem/problem.h"
#include "search/checkpoint.h"
#include "search/sparse_errors.h"

struct imp__fit {
    struct imp_problem *problem;
    struct imp_fit_options options; /* defaults filled in */
    struct imp_run run;             /* of one evaluation; its progress is ours */
    struct imp_run outer;           /* the caller's */
    bool coarse;                    /* a part of the samples is taken for now ... */
    int fine_spp;                   /* ... in place of these */
    struct imp__goal goal;
    struct imp__fingerprint fingerprint;
    double *lo, *hi, *scale; /* [n]; NULL with spans */
    double *g_se;            /* [n], for Gauss-Newton; likewise */
    bool *settles;           /* [n], likewise */
    struct imp__span *spans; /* Adam of many variables, and of meshes; or NULL */
    size_t n_spans;
    struct imp__fit_mesh *meshes; /* [n_meshes] in smooth steps */
    size_t n_meshes;
    bool seams;       /* some of their vertices are at one place */
    double *H_prior;  /* [n][n] second derivative of the regularisers */
    bool noise_known; /* every target has noise_se */

    const struct imp__search *search; /* being run, for reports */
    double start_s, deadline_s;       /* deadline 0: none */
    double last_report_s, last_checkpoint_s, checkpoint_cost_s;
    double fraction;
    double search_share;          /* of the work, the rest is what comes after it */
    int clipped_rounds;           /* searches after the first (fit_clip.c) */
    int final_calls, final_total; /* evaluations after the search; total 0: not there */
    int first_iteration;          /* of this call; not 0 where the fit was continued */
    bool stopped;                 /* by the caller or the deadline */

    struct imp__allocation allocation; /* of the search's samples; n 0: all alike */
    const struct imp__metric *metric;  /* of the next evaluation's variance; or NULL */
    int rounds_fit; /* rows of derivatives of so many rounds are known to fit into memory */

    /* Recorded walks of searches with common random numbers (fit_kept.c). */
    imp_walks *walks; /* NULL: none are */
    uint64_t walks_seed;
    double walks_bytes; /* of the last draw */
    int draws, evaluated, traced;
    bool stale;          /* the last evaluation was far from the draw */
    const char *untaken; /* why walks are not kept; NULL: they are, or were not wanted */

    /* Control variates of Adam (fit_variates.c). */
    struct imp__variate *variate; /* NULL: there is none */
    bool searching;               /* evaluations are those of the search */
    bool quiet;                   /* imp__opt_options */
    char without_variate[512];    /* why not; empty: there is one, or none was wanted */
    struct imp__sparse_errors errors; /* of many values; x NULL: there are none */
    char note[96];
};

/* fit_begin.c: sets everything of `fit` but the search. */
enum imp_status imp__fit_begin(struct imp_problem *problem,
                               const struct imp_fit_options *options,
                               const struct imp_run *run, struct imp__fit *fit);
/* Reports progress. IMP_CANCELLED: it shall stop here, by the caller or its time limit, on
 * this rank or another. All ranks call it alike. */
enum imp_status imp__fit_goes_on(struct imp__fit *fit, double fraction);
/* fit_sparse.c: are normal equations those of rows of derivatives? */
static inline bool imp__fit_is_sparse(const struct imp__fit *fit)
{
    return fit->options.optimizer == IMP_LM && fit->problem->n > IMP_DENSE_MAX;
}
/* imp__goal.sparse. */
enum imp_status imp__fit_sparse(const double *x, uint64_t seed, int rounds,
                                struct imp__sparse_normal *out, void *payload);
/* Samples per pixel of one evaluation, as given. */
int imp__fit_spp(const struct imp__fit *fit);
/* Those of a search that is far from its end. */
int imp__fit_coarse_spp(const struct imp__fit *fit);
/* fit_fingerprint.c: sets that of the fit. */
void imp__fit_fingerprint(struct imp__fit *fit);
/* Is the block a rigid pose, whose numbers have two units? */
bool imp__block_is_rigid(const struct imp_problem *p, const struct imp__block *b);
/* Scales of the variables, from where the search starts. */
void imp__fit_scales(struct imp__fit *fit, const struct imp__search *search);
/* A large change of value e of a block that is `start`; square: sum of squares of all its values. */
double imp__large_change(const struct imp_problem *p, const struct imp__block *b,
                         size_t e, double start, double square);
void imp__fit_end(struct imp__fit *fit);
/* fit_mesh.c: the meshes whose vertices are fitted in smooth steps; is the block one of them? And
 * imp__goal.smooth. */
enum imp_status imp__fit_meshes(struct imp__fit *fit);
void imp__fit_meshes_free(struct imp__fit *fit);
bool imp__fit_smooths(const struct imp__fit *fit, const struct imp__block *block);
void imp__fit_smooth(double *v, bool step, void *fit);
/* fit_goal.c: the goal of a search, which points to `fit`: it does not move any more. */
void imp__fit_goal_make(struct imp__fit *fit);
/* IMP_E_UNSUPPORTED where it would not be possible at any step: places beside outermost cells. */
enum imp_status imp__fit_places(const struct imp_problem *p);
/* Scale of the block's values in x [n], for `spans`. */
void imp__fit_span_scale(const struct imp__block *block, const double *x,
                         struct imp__span *span);

/* fit_blur.c: of poses, the searches through wider filters, before the first iteration of `fine`. Films
 * and targets are afterwards as they were. */
bool imp__fit_blurs(const struct imp__fit *fit);
enum imp_status imp__fit_blurs_allowed(const struct imp_problem *problem,
                                       const struct imp_fit_options *options);
enum imp_status imp__fit_blurred(struct imp__fit *fit,
                                 const struct imp__opt_options *options,
                                 struct imp__search *fine);
/* fit_levels.c: the searches on coarse cells, before the first iteration of `fine`, which
 * then begins where they end and has their history. IMP_CANCELLED: so far. */
enum imp_status imp__fit_levels(struct imp__fit *fit,
                                const struct imp__opt_options *options,
                                struct imp__search *fine);
enum imp_status imp__fit_levels_allowed(const struct imp_problem *problem,
                                        const struct imp_fit_options *options);

/* fit_clip.c: before the first search, of clipped targets. */
enum imp_status imp__fit_clipped_begin(struct imp__fit *fit);
/* Clipped targets: decides anew after search *s, the round-th. *again: with
 * other weights, and *s is the next search, which has not begun, of these options. */
enum imp_status imp__fit_clipped(struct imp__fit *fit, int round,
                                 struct imp__opt_options *options, struct imp__search **s,
                                 bool *again);
enum imp_status imp__fit_clipped_allowed(const struct imp_problem *problem,
                                         const struct imp_fit_options *options);

/* fit_kept.c: walks of the search are drawn and kept, where its method evaluates one draw;
 * what belongs to imp__goal.draw and is_stale. */
bool imp__fit_keeps(const struct imp__fit *fit);
enum imp_status imp__fit_draw(const double *x, uint64_t seed, void *fit);
bool imp__fit_is_stale(void *fit);
/* run->walks, if the walks of this seed may be evaluated at x. */
enum imp_status imp__fit_take_walks(struct imp__fit *fit, const double *x, uint64_t seed);
/* What was kept, as a sentence; NULL: nothing was wanted. In the problem's fit_arena. */
const char *imp__fit_walks_text(const struct imp__fit *fit);

/* fit_variates.c: the control variates of the search, where they are wanted and possible;
 * what they brought, or why there are none, as a sentence in the problem's fit_arena (NULL:
 * nothing was wanted); and checkpoints, which hold them. */
struct imp__variate;
enum imp_status imp__fit_variates(struct imp__fit *fit);
const char *imp__fit_variate_text(const struct imp__fit *fit);
enum imp_status imp__fit_checkpoint_write(const struct imp__fit *fit,
                                          const struct imp__search *search);
enum imp_status imp__fit_checkpoint_read(struct imp__fit *fit, struct imp__search *search,
                                         bool *found);

struct imp__uncertainty;

/* fit_result.c: the values before the fit, for its report and to restore them. `many`:
 * only those that are not stored as floats; the search keeps the others. */
enum imp_status imp__fit_start_keep(const struct imp_problem *p, bool many, double **out);
void imp__fit_start_restore(struct imp_problem *p, bool many, const double *start,
                            struct imp__search *s);
/* fit_result.c: what stays with the problem. rows [n] in fit_arena have errors and
 * intervals; NULL: more than IMP_SEARCH_FEW values, and the problem owns the search from
 * then on. */
struct imp__fit_shift;
enum imp_status imp__fit_answer(struct imp__fit *fit, struct imp__search *s,
                                struct imp_estimate objective,
                                const struct imp__uncertainty *u,
                                struct imp_fit_variable *rows, const double *start,
                                const char *why, const struct imp__fit_shift *shift,
                                const struct imp_fit_result **out);

/* fit_residual.c: the residual between scene and targets; NAN: undefined. */
struct imp__fit_residual {
    double relative;       /* root of sum w (I - T)^2 / sum w T^2, */
    double relative_hi;    /* and with two standard errors added to the loss */
    double chi2, chi2_se;  /* per degree of freedom */
    double count, freedom; /* residuals; and those less the determined values */
};
struct imp__fit_residual imp__fit_residual(const struct imp__fit *fit, const double *x,
                                           struct imp_estimate objective,
                                           size_t determined);

/* fit_bias.c: the shift of the answer by the bias of few samples. */
struct imp__fit_shift {
    size_t variable;        /* the one that moves most of its standard errors */
    double step, se, of_se; /* with four times the samples; of_se < 0: not known */
};
bool imp__fit_is_biased(const struct imp_problem *p);
/* G [n][n]: inverse of H in the directions that are determined. */
enum imp_status imp__fit_shift(struct imp__fit *fit, const double *x, const double *G,
                               uint64_t seed, const struct imp_fit_variable *variables,
                               struct imp__fit_shift *out);

/* fit_report.c: names and warnings. Text in the problem's fit_arena; NULL: out of memory.
 */
const char *imp__fit_warning(const struct imp__fit *fit, int bias_order,
                             const struct imp_fit_variable *variables,
                             const struct imp__uncertainty *u, const char *no_intervals,
                             const struct imp__fit_residual *residual,
                             const struct imp__fit_shift *shift);

#endif
