/* SPDX-License-Identifier: Apache-2.0
 *
 * Bounds of the extinction of a medium that varies in space, in the cells of a coarse
 * grid over its box. They are updated when the values they depend on change. */
#ifndef IMP_SCENE_MAJORANTS_H
#define IMP_SCENE_MAJORANTS_H

#include "math/transform.h"
#include "scene_build.h"

struct imp_majorants {
    const struct imp_medium *medium;
    const struct imp_texture *box; /* the volume whose box it is; NULL: the unit cube */
    int channels;
    bool ends;               /* outside the box there is none of the medium */
    struct imp_mat4 to_unit; /* world to unit cube */
    struct imp_mat4 to_world;
    int n[3];
    float *bound; /* [n[2]][n[1]][n[0]] */
    float most;   /* the largest */
    /* For residual ratio tracking; NULL: not needed. For each cell an extinction that is
     * close to all in it, and a bound of the difference, to which estimates owe no more than
     * small variance: where it is passed they are still right in the mean. */
    struct imp_control {
        float mean, reach;
    } * control;
};

/* Numbers of cells of a volume along x, y and z. */
static inline void imp__grid_cells(const struct imp_param_info *info, int n[3])
{
    const bool colours = info->flags & IMP_PARAM_COLOR; /* [layers y][x][3] */
    n[2] = (int)info->layers;
    n[1] = colours ? (int)(info->dims[0] / info->layers) : (int)info->dims[1];
    n[0] = (int)info->dims[colours ? 1 : 2];
}

/* Makes m->majorants, unless its extinction is the same everywhere. */
enum imp_status imp__majorants_create(struct imp_scene *scene,
                                      const struct imp_node *node, struct imp_medium *m);

/* A volume has been moved. NULL: there are none. */
void imp__majorants_renew(struct imp_majorants *g);

enum imp_status imp__majorants_control(struct imp_scene *scene, struct imp_majorants *g);

/* A ray through the cells. */
struct imp_majorant_walk {
    const struct imp_majorants *of;
    double t, leave, end; /* where the ray is, where it leaves the cell, and the box */
    double bound;         /* in the cell */
    ptrdiff_t cell;       /* its index */
    ptrdiff_t stride[3];  /* from a cell to the next along an axis, */
    int left[3];          /* and how many there are */
    /* Distance of the walls ahead, and between two of them; INFINITY in the fourth lane. */
    imp_v3 next, each;
};
/* From o + near d to o + far d. False: it does not meet the box. */
bool imp__majorants_enter(const struct imp_majorants *of, imp_v3 o, imp_v3 d, double near,
                          double far, struct imp_majorant_walk *w);

/* The nearest of the walls. */
static inline double imp__majorants_wall(const struct imp_majorant_walk *w)
{
    return imp_min(imp_min(w->next[0], w->next[1]), w->next[2]);
}
/* To the next cell; false: the ray has left. Where walls meet, all of them are passed at
 * once. Without a branch on the axis, which cannot be predicted. */
static inline bool imp__majorants_next(struct imp_majorant_walk *w)
{
    typedef int64_t bits __attribute__((vector_size(32)));
    const double t = imp__majorants_wall(w);
    if (!(t < w->end)) return false;
    const bits passed = w->next <= imp__spec(t);
    w->next += (imp_v3)(passed & (bits)w->each);
    for (int a = 0; a < 3; a++) {
        w->left[a] += (int)passed[a];
        w->cell += (ptrdiff_t)passed[a] & w->stride[a];
    }
    if ((w->left[0] | w->left[1] | w->left[2]) < 0) return false;
    w->t = imp_max(w->t, t);
    w->leave = imp_min(imp__majorants_wall(w), w->end);
    w->bound = (double)w->of->bound[w->cell];
    return true;
}

#endif
