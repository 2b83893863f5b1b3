/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a scene's geometry that a design moves, and the readings at their values. */
#ifndef IMP_INVERSE_DESIGN_MOVING_H
#define IMP_INVERSE_DESIGN_MOVING_H

#include "designing.h"

struct imp__moving {
    struct imp__design_model *m;
    size_t n; /* numbers that move */
    int iterations, steps;
    /* [n] which number of which parameter; the lamp whose readings it changes, or m->n: all. */
    size_t *param, *component, *lamp;
    double *first, *lo, *hi;
    double *at; /* [n] where the scene has them */
    /* For the search (imp__moving_rows): */
    double *p, *trial;                  /* [n] */
    double *x, *before;                 /* [m->n] levels */
    double *turn;                       /* [m->n] */
    bool *used, *again;                 /* [m->n] */
    double *g, *side[2];                /* [m->n_rows] */
    double *scale;                      /* [m->n_rows] */
    size_t width;                       /* m->n + n + 1 */
    double *slope;                      /* [m->n_rows][width] */
    double *step, *cost, *least, *most; /* [width] */
    double penalty;
    double more; /* margins are so many times those of a design */
    double
        started; /* objective of the best combination at the first places; infinite: none */
    bool begun; /* is that known? */
    double *end,
        *ended;   /* [m->o.starts] objectives, and places [m->o.starts][n], of searches */
    size_t start; /* the best of them */
    struct imp__design_reading *kept; /* [m->n] */
};

/* The readings at some places, to go back to. */
struct imp__moving_readings {
    struct imp__design_reading base;
    double *source, *direct, *base_source, *base_direct;
};

/* Sizes, names and bounds that are numbers. */
enum imp_status imp__moving_check(const struct imp__moving *v,
                                  const struct imp_design_move *moves);
/* Makes the numbers parameters of the scene, and checks their bounds: before a problem is made with
 * the scene. m has context, scene and arena, no more. */
enum imp_status imp__moving_names(struct imp__moving *v,
                                  const struct imp_design_move *moves);
/* Which lamp each moves; bounds that were not given. m has its lamps. */
enum imp_status imp__moving_bounds(struct imp__moving *v,
                                   const struct imp_design_move *moves, double clearance);
/* Room for a search. */
enum imp_status imp__moving_rows(struct imp__moving *v);
/* The scene has these values from here on. */
enum imp_status imp__moving_place(struct imp__moving *v, const double *p);
struct imp__moving_readings imp__moving_keep(const struct imp__moving *v);
void imp__moving_restore(struct imp__moving *v, const struct imp__moving_readings *kept);

/* The search, from v->p on; v->p and the scene have its places afterwards. */
enum imp_status imp__design_move(struct imp__moving *v);
/* m->o.starts searches: v->p and the scene have the places of the best afterwards. */
enum imp_status imp__design_starts(struct imp__moving *v);

#endif
