/* SPDX-License-Identifier: Apache-2.0
 *
 * Linear programs that grow: min cost x over lo <= x <= hi and rows a x + b >= 0, by the dual
 * simplex method on a dense dictionary with bounded variables (Chvatal 1983, Linear Programming,
 * ch. 8; Koberstein 2005, The dual simplex method). A row that is added, or a bound that is
 * moved, leaves the dictionary dual feasible, so that the next solution starts from the last one:
 * what branch and bound with cuts needs. */
#ifndef IMP_SEARCH_SIMPLEX_H
#define IMP_SEARCH_SIMPLEX_H

#include "base/context.h"

enum imp__lp_end { IMP_LP_OPTIMAL, IMP_LP_INFEASIBLE };

/* Variables 0 .. n - 1 are those of the program, n + k is the slack of row k, in [0, inf). */
struct imp__lp {
    imp_context *ctx;
    size_t n, m, room;  /* variables, rows, rows that there is room for */
    const double *cost; /* [n] belongs to the caller */
    double *lo, *hi;    /* [n] finite */
    double *row;        /* [room][n + 1] a and b as they were given */
    int *tag;           /* [room] the caller's */
    /* The dictionary: basic variable i is D[i][n] + sum_j D[i][j] nonbasic_j, and the objective is
     * reduced[n] + sum_j reduced[j] nonbasic_j. */
    double *D;       /* [room][n + 1] */
    double *reduced; /* [n + 1] */
    double *value;   /* [room] of the basic variables */
    size_t *basic;   /* [room] */
    size_t *nonbasic;
    bool *upper;   /* [n] is nonbasic variable j at its upper bound? */
    size_t pivots; /* since the dictionary was last made from the rows */
    /* The last solution. */
    double *x;    /* [n] */
    double *dual; /* [room] d objective / d (-b): what a row costs, not negative */
    double objective;
};

/* lo, hi [n] are copied. To be destroyed also after a failure. */
enum imp_status imp__lp_create(imp_context *ctx, size_t n, const double *cost,
                               const double *lo, const double *hi, struct imp__lp *out);
void imp__lp_destroy(struct imp__lp *lp);
/* a [n] is copied. */
enum imp_status imp__lp_add(struct imp__lp *lp, const double *a, double b, int tag);
/* Leave out rows from `first` on that hold without being needed, by more than `slack`. */
enum imp_status imp__lp_purge(struct imp__lp *lp, size_t first, double slack);
/* IMP_E_NUMERIC if it does not end. */
enum imp_status imp__lp_solve(struct imp__lp *lp, enum imp__lp_end *end);

#endif
