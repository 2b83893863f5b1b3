/* SPDX-License-Identifier: Apache-2.0
 *
 * The data of a guide that was made from a solution, and the functions that fill it. */
#ifndef IMP_ELEMENTS_GUIDE_H
#define IMP_ELEMENTS_GUIDE_H

#include "elements.h"
#include "scene/guide.h"

#define GUIDE_SIDE 16 /* of the histogram */
#define GUIDE_BINS (GUIDE_SIDE * GUIDE_SIDE)

/* A cut through the quadtrees: elements at the level, and leaves above it. */
struct imp__guide_cells {
    int level;
    size_t n;
    uint32_t *of;    /* [n_elements] or EL_NONE */
    uint32_t *where; /* [n] element */
};
/* Lookup of a point's cell on a root that is a parallelogram, by a regular grid. */
struct imp__guide_finder {
    imp_v3 origin, to_u, to_v;
    int side;
    uint32_t *grid; /* [side side], NULL: by the tree */
};
/* Directions at cells, for one field. */
struct imp__guide_directions {
    float *cdf;   /* [wide][GUIDE_BINS] cumulative; NULL: none */
    float *share; /* [wide] of continuations drawn from the histogram; 0 where nothing
                     arrives or the material has lobes */
};
/* Where and whither lights send, for one field: piecewise constant densities of the
 * uniform numbers that a point and a direction are made of, cumulative. */
struct imp__guide_emission {
    int across, side; /* bins of points and of directions, along each number */
    float *point;     /* [n_lights][across across]; NULL: none */
    float *direction; /* [n_lights][across across][side side] */
};
struct imp__guide {
    struct imp_guide base;
    const imp_elements *e;
    int n_lights;
    double light_base;
    struct imp__guide_cells cells, wide; /* wide: with directions */
    struct imp__guide_finder *finder;    /* [n_roots] */
    uint32_t *grids;
    double *light;     /* [cells][n_lights] cumulative */
    double *pmf;       /* [n_lights] as the scene has them */
    uint32_t *wide_of; /* [cells] */
    struct imp__guide_directions directions[IMP_GUIDE_FIELDS];
    float (*leaving)[2]; /* [cells][rose rose] luminance: all; reflected twice or more */
    int rose;
    double *send; /* [n_lights] cumulative; NULL: no importance */
    struct imp__guide_emission emission[IMP_GUIDE_FIELDS];
};
struct imp__guide_build {
    struct imp__guide *g;
    double share;
    enum imp_guide_field field; /* of the loop over cells or lights at work */
    double *scratch;            /* [workers][2 GUIDE_BINS] */
    double *basis;              /* [rose rose][EL_N_MAX] at the middle of bins */
};

/* The deepest level from `level` up that cuts the trees into few enough cells. */
enum imp_status imp__guide_cells(const imp_elements *e, int level,
                                 struct imp__guide_cells *c);
/* Grids for roots that are parallelograms, as fine as their finest cell. */
enum imp_status imp__guide_finders(struct imp__guide *g);

/* Work of loops over cells (g->cells), payload: struct imp__guide_build. The choice of
 * lights, and what leaves. */
enum imp_status imp__guide_cell_work(size_t item, int worker, int slot, void *payload);
/* Over g->wide: directions of b->field. */
enum imp_status imp__guide_wide_work(size_t item, int worker, int slot, void *payload);

/* The emitter that a root shines for; -1: none, or an ambient term. */
int imp__guide_emitter(const imp_elements *e, const struct imp__el_root *r);
/* The surface of the sensor, which walks may have to meet; NULL: it has none, or there is no
 * importance. */
const struct imp_shape *imp__guide_meter(const imp_elements *e);
/* The bin of a direction in the frame of its surface. */
int imp__guide_bin(imp_v3 w);
/* The bin of a piecewise constant density, cumulative in cdf [n], that u chooses; *rest is
 * uniform again. Returns its probability. */
double imp__guide_pick(const float *cdf, int n, double u, int *bin, double *rest);
/* Each bin [side side] takes part of its neighbours. */
void imp__guide_smooth(int side, const double *in, double *out);
/* Cumulative probabilities of n sums, of which `base` is spread evenly; all of it where the
 * sums are 0. */
void imp__guide_cumulate(const double *sum, int n, double base, float *cdf);

/* guide_send.c, for light walks: the choice of the light, of its point and direction. */
enum imp_status imp__guide_send(struct imp__guide *g);

#endif
