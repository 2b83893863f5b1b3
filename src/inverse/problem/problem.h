/* SPDX-License-Identifier: Apache-2.0
 *
 * A problem: which parameters are active, and what is to be matched. What is estimated of it
 * lies in the rooms above: adjoints and sums (inverse/estimate), loss, gradient and Jacobian
 * (inverse/gradient), normal equations (inverse/gauss). */
#ifndef IMP_INVERSE_PROBLEM_H
#define IMP_INVERSE_PROBLEM_H

#include "base/film.h"
#include "base/pool.h"
#include "color/wavelength.h"
#include "scene/camera_gain.h"
#include "scene/scene.h"
#include "walk/core/walk.h"

struct imp_problem;
struct imp__allocation;

struct imp__target {
    struct imp_target desc; /* pixels, weights, noise_se point to copies */
    float *pixels, *weights, *noise_se;
    struct imp_photograph photograph; /* the pixels, if they have a gamma; else NULL */
    float *
        value_noise; /* noise_se of a photograph, for what is far from the scene; NULL: not known */
    struct imp__clip *clip; /* levels, and who has no weight; NULL: none */
    const uint8_t *silent;  /* of clip, [height][width][channels]; NULL: all count */
    float *precision; /* a factor of the weight of each value, [height][width][channels];
                         NULL: 1 */
    /* A film with response curves, unless they are three: targets of up to three of
     * its curves, each with walks of its own; they share the weights. n_parts 0: none. */
    int n_parts;
    struct imp__target *part;
    bool of_curves;                                /* it is such a part */
    struct imp_wavelengths waves[IMP_WAVES_DRAWN]; /* of a part: its curves */
};
/* Has a pixel a part in the loss? */
static inline bool imp__target_counts(const struct imp__target *t, size_t pixel)
{
    return !t->weights || t->weights[pixel] != 0;
}
/* Factor of the loss of channel c of a pixel. */
static inline double imp__target_weight(const struct imp__target *t, size_t pixel, int c)
{
    const size_t at = pixel * (size_t)t->desc.channels + (size_t)c;
    const double w = t->desc.scale * (t->weights ? t->weights[pixel] : 1);
    if (t->silent && t->silent[at]) return 0;
    return t->precision ? w * t->precision[at] : w;
}
static inline int imp__target_parts(const struct imp__target *t)
{
    return t->n_parts ? t->n_parts : 1;
}
static inline const struct imp__target *imp__target_part(const struct imp__target *t,
                                                         int k)
{
    return t->n_parts ? &t->part[k] : t;
}
/* ---- target_parts.c ---- */
/* Makes the parts; t has been checked. */
enum imp_status imp__target_split(struct imp_problem *p, struct imp__target *t);
void imp__target_free(imp_context *ctx, struct imp__target *t);
/* problem.c: where the film of its sensor has a gamma, the pixels are a photograph. */
void imp__target_photograph(const struct imp_problem *p, struct imp__target *t);

struct imp__regulariser {
    enum { IMP_TIKHONOV, IMP_SMOOTHNESS } kind;
    double weight;
    uint8_t *on;    /* [n_params] which parameters it covers */
    double *origin; /* [n_theta] x0, or NULL for 0 */
};

/* Parameters tied to common values (tied_parameters.c). */
struct imp__param_tie {
    enum imp_tie kind;
    uint8_t *on; /* [n_params] its parameters, two or more but for logarithms */
    char *name;  /* of a common factor */
    size_t n_members;
    const char **members; /* their names; of the scene */
    double *origin;       /* of a factor: [n_theta] what it multiplies; else NULL */
};

/* Numbers of x that belong together: an active parameter, or one that speaks for others.
 * v = x, exp(x) with log, and times what a common factor multiplies. */
struct imp__block {
    size_t param, first, count;
    double lo, hi; /* of x */
    bool log;
    int tie; /* of the problem: SAME or FACTOR; -1: no others follow */
};

struct imp__search;
struct imp__variate;

/* What a loss and its gradient are for: which plan their samples have (imp__replicates_loss). */
enum imp__loss_use {
    IMP_LOSS_TOLD,    /* with their errors */
    IMP_LOSS_SOUGHT,  /* by a search, which wants little variance */
    IMP_LOSS_COMPARED /* with those of the same walks in Gauss-Newton matrices, or kept */
};

/* The last fit, as imp_problem_get_fit_variable returns it (fit_result.c). */
struct imp__fit_block { /* numbers of one parameter */
    size_t first;
    double lo, hi; /* of x */
    bool log;
    const double *start; /* of values kept in doubles; NULL: the search's */
};
struct imp__fit_answer {
    size_t n;                            /* 0: there is none */
    const struct imp_fit_variable *rows; /* [n] in fit_arena; NULL: too many for that */
    struct imp__search *search;          /* settled; owned */
    size_t n_blocks;
    struct imp__fit_block *blocks; /* in fit_arena */
    const double *se; /* [n] in fit_arena, of lm with many values; NULL: none */
};
void imp__fit_answer_free(struct imp_problem *p);

struct imp_problem {
    imp_context *ctx;
    struct imp_scene *scene;
    uint8_t *chosen;          /* [n_params] */
    struct imp_active active; /* follows chosen */
    size_t n;                 /* active values */
    size_t n_blocks;
    struct imp__block *blocks; /* in the order of their numbers */
    size_t n_ties, cap_ties;
    struct imp__param_tie *ties;
    uint8_t *held; /* [n_theta] numbers that stay as they are; NULL: none */
    size_t n_targets, cap_targets;
    struct imp__target *targets;
    size_t n_regularisers, cap_regularisers;
    struct imp__regulariser *regularisers;
    struct imp_run run;                 /* of imp_problem_nlopt */
    struct imp__allocation *allocation; /* of its samples; NULL: all alike */
    struct imp__variate *variate; /* of the evaluation at work (variate.h); NULL: none */
    enum imp__loss_use use;
    /* A fit to clipped targets may begin near its end: pictures of the start decide who counts, and so
     * many searches follow at most; 0: it may begin anywhere (fit_clip.c). */
    int near_searches;
    bool seams_join; /* vertices of a mesh at one place move together (fit_mesh.c) */
    /* The evaluation at work has what moving edges give (moved_gradient.h). */
    bool edge_terms;
    bool
        misses_reported; /* the user has been warned of light that light tracing misses */
    bool same_known;     /* the ranks of a team have the same problem */
    struct imp_arena fit_arena; /* of the last fit's result */
    struct imp__fit_answer fit_answer;
    struct imp_arena check_arena;   /* of the last check's rows */
    struct imp_arena missing_arena; /* of rows of imp_problem_missing */
    struct imp_arena plan_arena;    /* of the last plan's result */
    struct imp_arena measure_arena; /* of the measurement whose last fit this is */
};

/* Is some pose active? Then losses have pictures of replicates, whatever the filter (splat.h). */
bool imp__problem_moves(const struct imp_problem *p);

/* ---- tied_parameters.c ---- */
/* Make the parameters `chosen` [n_params] active, and lay out x by the problem's ties.
 * Replaces active and blocks; after a failure they are as before. */
enum imp_status imp__problem_layout(struct imp_problem *p, const uint8_t *chosen);
/* The block of component i of x. */
const struct imp__block *imp__problem_block(const struct imp_problem *p, size_t i);
static inline const struct imp__param_tie *imp__block_tie(const struct imp_problem *p,
                                                          const struct imp__block *b)
{
    return b->tie < 0 ? NULL : &p->ties[b->tie];
}
static inline bool imp__block_factor(const struct imp_problem *p,
                                     const struct imp__block *b)
{
    return b->tie >= 0 && p->ties[b->tie].kind == IMP_TIE_FACTOR;
}
/* The name of its parameter, or of its factor. */
const char *imp__block_name(const struct imp_problem *p, const struct imp__block *b);
/* The tie that parameter k has, in logarithms or not; -1: none. */
int imp__tie_of(const struct imp_problem *p, size_t k, bool log);
/* Value e of a block, as x has it, from the scene. */
double imp__block_get(const struct imp_problem *p, const struct imp__block *b, size_t e);
/* Parameter k takes its values from x. */
void imp__tied_set(const struct imp_active *active, struct imp_param *param, size_t k,
                   const double *x);
void imp__ties_free(struct imp_problem *p);
/* ---- held_numbers.c ---- */
/* Is some number of parameter k held, or number e of block b? */
bool imp__param_held(const struct imp_problem *p, size_t k);
bool imp__block_held(const struct imp_problem *p, const struct imp__block *b, size_t e);
/* How many numbers of x are. */
size_t imp__held_count(const struct imp_problem *p);
/* Bounds of number e of a block, which are its value where it is held. */
struct imp__bounds {
    double lo, hi;
} imp__block_bounds(const struct imp_problem *p, const struct imp__block *b, size_t e);
/* An item of imp_problem_hold: numbers first to last of the parameters that the glob matches; all
 * of them where last is SIZE_MAX. */
struct imp__held {
    char glob[256];
    size_t first, last;
};
/* The first n bytes of a text as an item. IMP_E_ARG: they are none. */
enum imp_status imp__held_read(imp_context *ctx, const char *text, size_t n,
                               struct imp__held *item);
/* Marks the item's numbers of a parameter in held [n_theta]. IMP_E_ARG: it has fewer. */
enum imp_status imp__held_mark(imp_context *ctx, const struct imp__held *item,
                               const struct imp_param_info *info, uint8_t *held);
/* The marked numbers, held [n_theta], and no others are held. */
enum imp_status imp__problem_hold_marked(struct imp_problem *p, const uint8_t *held);
/* IMP_E_UNSUPPORTED if numbers are held where `what` moves all of them. */
enum imp_status imp__holds_none(const struct imp_problem *p, const char *what);
/* Forgets the tie that was made last; the layout is the caller's. */
void imp__tie_last_free(struct imp_problem *p);
uint64_t imp__ties_hash(const struct imp_problem *p, uint64_t hash);
/* IMP_E_UNSUPPORTED where `what` supports ties of equal values only. */
enum imp_status imp__ties_equal_only(const struct imp_problem *p, const char *what);

/* Hash of pixels, weights, losses and regularisers. */
uint64_t imp__problem_targets_hash(const struct imp_problem *p);
/* IMP_E_ARG if parts, or other ranks, are of another problem, scene or call. */
enum imp_status imp__problem_same(struct imp_problem *p, const struct imp_run *run,
                                  const char *call);
/* IMP_E_UNSUPPORTED where this context's calls are parts, or a merge of such. */
enum imp_status imp__problem_no_parts(const struct imp_problem *p, const char *call);

/* Regularisers' value; adds their gradient (may be NULL). x [n]; NULL: what the scene has
 * now. */
double imp__regularise(const struct imp_problem *p, const double *x, double *gradient);

/* Adds the diagonal of their second derivative to d [n]. */
void imp__regularise_diagonal(const struct imp_problem *p, double *d);
/* Their second derivative, H [n][n]. */
enum imp_status imp__regularise_second(const struct imp_problem *p, double *H);

#endif
