/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows that draw: what a density claims, against what is drawn with it. A row is a stream of
 * independent pairs. Each pair adds to parts of the row, which are subsets of what can be
 * drawn, an estimate by what was drawn and one by what the density claims; both have the same
 * mean in every part if the density is right. Part 0 is everything.
 *
 * All rows go through one loop: they draw until a relative error of 2 % of a density would be
 * seen, or until the time of all such rows together has been used up, of which each row has
 * its share. What a row would have seen is said in imp_check_row.sees. A row that looks wrong
 * is measured again with new numbers, and fails if the same part is wrong again in the same
 * direction: by chance beyond 3.5 standard errors, 5e-4, and then beyond 4.5 on the same side,
 * 3e-6, for each part at each of up to ten looks; 4e-7 for a row. */
#ifndef IMP_INVERSE_CHECK_DRAWS_H
#define IMP_INVERSE_CHECK_DRAWS_H

#include "check.h"

#define IMP_DRAW_PARTS 24
/* A bias of this many standard errors is seen: the limit of the first look is 3.5, so that 96
 * of 100 such biases pass it. */
#define IMP_DRAW_SEEN 5.3
/* The relative bias that rows want to see, of everything; and that of a part into which this
 * share of the draws falls, such as a sun in a sky, over that of everything. */
#define IMP_DRAW_WANTED 0.02
#define IMP_DRAW_OFTEN  0.2
#define IMP_DRAW_COARSE 5
#define IMP_DRAW_FINE   0.05

struct imp__compared {
    double n; /* pairs */
    struct {
        double drawn, claimed; /* sums */
        double square;         /* of (drawn - claimed) of a pair */
        double hits;           /* pairs whose draw fell into the part */
    } part[IMP_DRAW_PARTS];
};

/* One pair while it is made. */
struct imp__pair {
    uint32_t touched; /* parts */
    double drawn[IMP_DRAW_PARTS], claimed[IMP_DRAW_PARTS];
};
static inline void imp__pair_add(struct imp__pair *p, int part, double drawn,
                                 double claimed)
{
    if (!(p->touched >> part & 1)) p->drawn[part] = p->claimed[part] = 0;
    p->touched |= UINT32_C(1) << part;
    p->drawn[part] += drawn;
    p->claimed[part] += claimed;
}

struct imp__draw_row {
    const char *method;
    const char *name; /* of what is looked at; lives as long as the list */
    /* Makes pair i, from random numbers of `seed`. It is called by many threads. */
    void (*pair)(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p);
    const void *payload;
    double slack; /* relative error that the claim may have by quadrature or rounding */
    uint32_t
        fine; /* parts of which it wants to see IMP_DRAW_FINE, however rarely drawn */
};

/* The rows of a check, and what their payloads lie in. */
struct imp__draw_list {
    struct imp__check *check;
    struct imp_arena arena;
    struct imp__draw_row *row; /* [n] */
    size_t n, cap;
};
/* Add a row, if the caller of the check wants its method. */
enum imp_status imp__draw_add(struct imp__draw_list *l, const struct imp__draw_row *row);
/* Draw for all of them, and report. */
enum imp_status imp__draw_all(struct imp__draw_list *l);

/* What a part says. */
struct imp__part_answer {
    double drawn, claimed; /* means */
    double se;             /* of their difference */
    double z;              /* of the difference, less the slack */
    double sees;           /* relative bias that would be seen; INFINITY: none */
};
struct imp__part_answer imp__compared_part(const struct imp__compared *c, int part,
                                           double slack);

#endif
