/* SPDX-License-Identifier: Apache-2.0
 *
 * Which of several things, and how much of each: levels x_j that are 0 or in [least_j, most_j], at
 * most one of a place above 0, of least price sum (price_j x_j + fixed_j [j is used]), such that
 *
 *     b + a x - z sqrt(v0 + sum v_j x_j^2) - sum q_j x_j^2 >= 0
 *
 * in each row: a sum of responses, less z of its standard errors, less a convex square. By branch
 * and bound (Land and Doig 1960) on linear programs, in which a row is its tangents at solutions
 * that violate it (Kelley 1960; the left side is concave, so that tangents cut nothing off): the
 * answer is the best of all choices, and `bound` is the proof. */
#ifndef IMP_SEARCH_CHOICE_H
#define IMP_SEARCH_CHOICE_H

#include "base/context.h"

struct imp__choice_row {
    double b, z, v0;
    const double *a; /* [n] */
    const double *v; /* [n] not negative; NULL where z is 0 */
    const double *q; /* [n] not negative; NULL: none */
};

struct imp__choice {
    imp_context *ctx;
    size_t n;
    const double *price, *fixed; /* [n] not negative */
    const double *least, *most;  /* [n] 0 <= least <= most, most above 0 */
    const size_t *place;         /* [n] number of the place, below n_places */
    size_t n_places;
    const bool *needed; /* [n_places] one of it is used */
    size_t n_rows;
    const struct imp__choice_row *rows; /* numbers near 1 */
    size_t n_not;
    const bool *const *not_these; /* [n_not][n] sets of used ones that are no answers */
    size_t nodes;                 /* linear programs solved by branching, at most */
    double gap; /* relative difference between price and bound that is no matter */
    bool any;   /* the first answer that is found does */
};

struct imp__choice_answer {
    bool found;  /* there is an answer: x, used, price and dual are set */
    bool proven; /* the tree was searched to its end: it is the best, or there is none */
    double price, bound;
    double *x;  /* [n] */
    bool *used; /* [n] */
    double
        *dual; /* [n_rows] d price / d (-b) with these used: what more of a row costs */
    size_t nodes;
};

/* The left side of a row. */
double imp__choice_row_at(const struct imp__choice_row *r, size_t n, const double *x);
/* The arrays of `out` are the caller's. IMP_CANCELLED does not occur. */
enum imp_status imp__choose(const struct imp__choice *c, struct imp__choice_answer *out);

#endif
