/* SPDX-License-Identifier: Apache-2.0
 *
 * What the parts of a design share (importon/design.h has the model). */
#ifndef IMP_INVERSE_DESIGNING_H
#define IMP_INVERSE_DESIGNING_H

#include "inverse/rooms/glare_sources.h"
#include "search/choice.h"
#include <importon/design.h>

#define IMP_DESIGN_MARGIN 4 /* standard errors that a want holds by, in the search */

/* A grid that something is wanted of. */
struct imp__design_grid {
    int sensor;
    size_t n, first; /* points, and the first of them among all grids' */
    bool rated;      /* a glare limit is among the wants */
};

/* One reading of all grids. */
struct imp__design_reading {
    double *value, *se;           /* [n_points] */
    struct imp_estimate *average; /* [n_grids] */
    double freedom;               /* degrees of freedom of the errors */
};

struct imp__design_model {
    imp_context *ctx;
    struct imp_scene *scene;
    struct imp_arena *arena;
    struct imp_run run;
    struct imp_design_options o;
    size_t n;                     /* lamps */
    struct imp_design_lamp *lamp; /* [n] with all defaults set */
    int *emitter;                 /* [n] */
    double *watts, *flux;         /* [n] at level 1 */
    size_t *place;                /* [n] */
    size_t n_places;
    bool *needed; /* [n_places] */
    size_t n_wants;
    struct imp_design_want *want; /* [n_wants] */
    size_t *grid_of;              /* [n_wants] */
    size_t n_grids, n_points;
    struct imp__design_grid *grid;
    /* Responses: readings with one lamp at level 1, and with the other emitters alone. */
    struct imp__design_reading *with; /* [n] */
    struct imp__design_reading base;
    /* Glare, of points of rated grids: sum L^2 w/p^2 and direct illuminance. */
    double *source, *direct;           /* [n_points][n] */
    double *base_source, *base_direct; /* [n_points] */
    /* The linear constraints of a search (design_rows.c). */
    size_t n_rows, *first_row; /* [n_wants + 1] */
    struct imp__choice_row *row;
    double *scale;                        /* [n_rows] that they are divided by */
    double *price, *fixed, *least, *most; /* [n] */
    double done, whole;                   /* readings, for progress */
    int64_t nodes;
};

/* ---- design_arguments.c ------------------------------------------------------------------ */

enum imp_status imp__design_lamps_take(struct imp__design_model *m,
                                       const struct imp_design_lamp *lamps);
enum imp_status imp__design_wants_take(struct imp__design_model *m,
                                       const struct imp_design_want *wants);
enum imp_status imp__design_options_take(struct imp__design_model *m,
                                         const struct imp_design_options *options);

/* ---- design_readings.c -------------------------------------------------------------------- */

/* Arrays of the arena. */
enum imp_status imp__design_reading_make(struct imp__design_model *m,
                                         struct imp__design_reading *r);
/* All responses, and what observers see. */
enum imp_status imp__design_responses(struct imp__design_model *m);
/* That of lamp j, or of the other emitters (m->n), once more: the same walks where nothing has moved. */
enum imp_status imp__design_response(struct imp__design_model *m, size_t j);
/* What observers see, once more. */
enum imp_status imp__design_observe(struct imp__design_model *m);
/* The readings with the lamps at x [n] and the other emitters as they are, from `repeats` readings
 * with each one that is used. */
enum imp_status imp__design_read(struct imp__design_model *m, const double *x,
                                 uint64_t seed, int repeats,
                                 struct imp__design_reading *out);

/* ---- design_rows.c ------------------------------------------------------------------------ */

enum imp_status imp__design_rows_make(struct imp__design_model *m);
/* The rows of want k for the value `wanted` and margins of z standard errors. */
void imp__design_rows_set(struct imp__design_model *m, size_t k, double wanted, double z);
/* d objective / d wanted of want k by the duals of all rows. */
double imp__design_price(const struct imp__design_model *m, size_t k, double wanted,
                         const double *x, const double *dual);
/* One standard error of the objective, at most. */
double imp__design_objective_se(const struct imp__design_model *m, const double *x,
                                const double *dual);

/* ---- design_verdict.c --------------------------------------------------------------------- */

/* value, sure, holds and at of want k, by a reading at x; each bound misses with `risk`. */
void imp__design_judge(const struct imp__design_model *m, size_t k, const double *x,
                       const struct imp__design_reading *r, double risk,
                       struct imp_design_finding *out);
static inline bool imp__design_upper(enum imp_design_want_of of)
{
    return of == IMP_WANT_MAXIMUM || of == IMP_WANT_UGR;
}

/* ---- design_search.c ---------------------------------------------------------------------- */

/* The best set with the rows as they are set; arrays of `out` of the arena. */
enum imp_status imp__design_search(struct imp__design_model *m,
                                   const bool *const *not_these, size_t n_not, bool any,
                                   struct imp__choice_answer *out);
/* Watts, flux or cost of levels. */
double imp__design_objective(const struct imp__design_model *m,
                             enum imp_design_least what, const double *x);
/* Without an answer: what each want can have, with the others and alone. */
enum imp_status imp__design_attainable(struct imp__design_model *m,
                                       struct imp_design_finding *finding);

#endif
