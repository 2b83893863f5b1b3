/* SPDX-License-Identifier: Apache-2.0
 *
 * What densities of directions aim at: the surfaces of lights, and proxies, shapes that
 * light passes and rays do not meet (the opening of a reflector, a cover glass). An aim
 * is chosen by its strength over the squared distance, and a point of it by its shape:
 *
 *     p(w) = sum_t S_t/r_t^2 / (sum_u S_u/r_u^2) p_t(w)
 *
 * with p_t the shape's density per steradian, of all points of it that lie along w: what
 * is in front of a point is not known before a ray is traced. */
#ifndef IMP_SCENE_AIMS_H
#define IMP_SCENE_AIMS_H

#include "mixing.h"
#include <importon/kinds.h>

struct imp_aim {
    const struct imp_shape *shape;
    /* The light whose directions it gives; NULL: a proxy of none. */
    const struct imp_emitter *light;
    double part;     /* of the light's strength; or the proxy's own */
    double strength; /* mean intensity of the light, or weight times area */
    imp_v3 centre;
    double near2; /* squared distance below which 1/r^2 is cut: half the diagonal */
};

struct imp_aims {
    int n, n_lights; /* those of lights come first */
    struct imp_aim *list;
    bool aimed;        /* some mixture has a weight for them */
    void *intersector; /* of all aims, if they are aimed at */
};

/* A proxy as it was written: a shape, or a reference to one that is there. */
struct imp_proxy {
    struct imp_node *node;
    const char *parent, *slot;    /* for its name */
    const struct imp_node *owner; /* a light's node; NULL: of no light */
};

/* Take the children named proxy, proxy2, ... of a node; parent: its name. */
enum imp_status imp__proxies_take(struct imp_scene *scene, struct imp_node *node,
                                  const char *parent);
bool imp__is_proxy(const struct imp_child *child);

/* When all objects are there. */
enum imp_status imp__aims_build(struct imp_scene *scene);
/* When it is known that they are aimed at: their strengths, which follow the lights'
 * parameters, and the intersector. */
enum imp_status imp__aims_aim(struct imp_scene *scene);

/* Chosen by u in [0, 1), from [first, end) of the list, whose strengths over squared
 * distances add up to `sum`; its probability. */
int imp__aim_choose(const struct imp_aims *t, int first, int end, double sum, imp_v3 from,
                    double u, double *chance);
double imp__aims_sum(const struct imp_aims *t, int first, int end, imp_v3 from);
/* Densities of direction w per steradian: p[0] towards lights, p[1] towards proxies, each
 * for strengths that add up to sum[]. */
void imp__aims_pdf(const struct imp_aims *t, const double sum[2], imp_v3 from, imp_v3 w,
                   double p[2]);

/* part [t->n]: S_t/r_t^2 p_t(w) of every aim; w NULL: S_t/r_t^2. */
void imp__aims_apart(const struct imp_aims *t, imp_v3 from, const imp_v3 *w,
                     double *part);

/* ---- intersect.c ---- */
enum imp_status imp__aims_commit(struct imp_scene *scene);
/* Hits of o + t d, t > tmin, with aims, nearest first, at most `max` of those behind
 * `last` (NULL: all); hit.shape is the aim's index. How many. */
int imp__aims_hit(const struct imp_aims *t, const imp_v3 *o, const imp_v3 *d, double tmin,
                  const struct imp_hit *last, int max, struct imp_hit *hit);

#endif
