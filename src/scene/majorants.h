/* SPDX-License-Identifier: Apache-2.0
 *
 * Bounds of the extinction of a medium that varies in space, in the cells of a coarse
 * grid over its box. They follow the numbers that they are made of. */
#ifndef IMP_SCENE_MAJORANTS_H
#define IMP_SCENE_MAJORANTS_H

#include "math/transform.h"
#include "scene_build.h"

struct imp_majorants {
    const struct imp_medium *medium;
    int channels;
    bool ends;               /* outside the box there is none of the medium */
    struct imp_mat4 to_unit; /* world to unit cube */
    struct imp_mat4 to_world;
    int n[3];
    float *bound; /* [n[2]][n[1]][n[0]] */
    float most;   /* the largest */
    /* For residual ratio tracking; NULL: nobody asked. Of each cell an extinction that is
     * close to all in it, and a bound of the difference, to which estimates owe no more than
     * small variance: where it is passed they are still right in the mean. */
    struct imp_control {
        float mean, reach;
    } * control;
};

/* Makes m->majorants, unless its extinction is the same everywhere. */
enum imp_status imp__majorants_create(struct imp_scene *scene,
                                      const struct imp_node *node, struct imp_medium *m);

enum imp_status imp__majorants_control(struct imp_scene *scene, struct imp_majorants *g);

/* A ray through the cells. */
struct imp_majorant_walk {
    const struct imp_majorants *of;
    double t, leave, end; /* where the ray is, where it leaves the cell, and the box */
    double bound;         /* in the cell */
    int cell[3], step[3];
    double next[3], each[3]; /* of the walls ahead: distance, and between two of them */
};
/* From o + near d to o + far d. False: it does not meet the box. */
bool imp__majorants_enter(const struct imp_majorants *of, imp_v3 o, imp_v3 d, double near,
                          double far, struct imp_majorant_walk *w);
static inline size_t imp__majorants_cell(const struct imp_majorant_walk *w)
{
    return ((size_t)w->cell[2] * (size_t)w->of->n[1] + (size_t)w->cell[1]) *
               (size_t)w->of->n[0] +
           (size_t)w->cell[0];
}
/* To the next cell; false: the ray has left. */
bool imp__majorants_next(struct imp_majorant_walk *w);

#endif
