/* SPDX-License-Identifier: Apache-2.0
 *
 * A tree over the lights of a scene, by which light samples choose among many (Conty Estevez
 * and Kulla 2018; Pharr, Jakob and Humphreys, PBR 4e, section 12.6.3). A node holds bounds of
 * its lights: a box, a cone of their normals, and their strength S, an intensity. From the
 * root on, a child is chosen by its importance at the place to be lit,
 *
 *     S cos(theta') cos(theta_i') / d^2
 *
 * with theta' the least angle between a normal of the node and the way to the place, theta_i'
 * the least one between the way back and the normal of the place, d the distance to the box's
 * centre, of no less than half its diagonal. The importance is 0 only where no light of the
 * node can bring anything, so every light that counts has a probability.
 *
 * The leaves are lights, and triangles of lights that are meshes. Infinite lights (an
 * environment, parallel light) are not in the tree.
 *
 * The tree's shape follows from geometry alone, its strengths from theta: equal values of
 * theta give equal probabilities. They are constants to derivatives. */
#ifndef IMP_SCENE_LIGHT_TREE_H
#define IMP_SCENE_LIGHT_TREE_H

#include "scene.h"

struct imp_light_node {
    float lo[3], hi[3];
    float axis[3], cos_normals; /* cone that the normals lie in */
    float cos_reach; /* of the largest angle to a normal under which light leaves */
    float strength;  /* intensity, mean over all directions */
    float gain; /* over the mean: along the axis of a light whose normals fill the cone */
    int32_t parent; /* -1: the root */
    /* The second child, the first is the next node; in a leaf -1 - item. */
    int32_t second;
};

/* The light, or part of a light, in a leaf. */
struct imp_light_item {
    int32_t emitter, prim; /* triangle; -1: all of the light */
    int32_t leaf;          /* its node */
    double part;           /* of the light's area */
};

struct imp_light_tree {
    struct imp_scene *scene;
    int n_items, n_nodes, n_far;
    struct imp_light_item *item; /* those of a light are next to each other, in order of
                                    triangles */
    struct imp_light_node *node; /* [2 n_items - 1], parents before their children */
    int32_t *first;              /* [n_emitters] its first item; -1: not in the tree */
    int32_t *far_light;          /* [n_far] lights without end */
    double *far_share;           /* [n_far] of them all */
    /* Probability of the tree, where something in it and something far may count. */
    double near_chance;
};

/* A place to be lit. */
struct imp_light_place {
    imp_v3 p, n;
    bool faces; /* what arrives from behind n counts for nothing */
};

/* The nodes among which the first choice is made at a place, for more choices there. Begins as {0}. */
enum { IMP_LIGHT_CUT = 128 }; /* nodes, at most */
struct imp_light_cut {
    bool made;
    struct imp_light_place place;
    int n;
    double sum;
    int32_t node[IMP_LIGHT_CUT];
    double importance[IMP_LIGHT_CUT];
};

/* Made when all objects are there. It listens to the lights' parameters. */
enum imp_status imp__light_tree_build(struct imp_scene *scene);

/* A light, and the triangle of it that is to be sampled (-1: all of it), by u on [0, 1);
 * its probability. *u is uniform on [0, 1) again. -1: no light can count here. cut: of the last
 * place, for walks that have many from one place; NULL: they have not. */
int imp__light_tree_choose(const struct imp_light_tree *t,
                           const struct imp_light_place *place, struct imp_light_cut *cut,
                           double *u, int *prim, double *chance);
/* Probability that it chooses this. prim: the triangle, of lights in triangles. */
double imp__light_tree_chance(const struct imp_light_tree *t,
                              const struct imp_light_place *place, int emitter, int prim);
/* By what the density of a point of this light, drawn from all of it, is multiplied: the
 * probability that the tree chooses the light, or the point's triangle over its part of the
 * light's area. */
double imp__light_tree_factor(const struct imp_light_tree *t,
                              const struct imp_light_place *place, int emitter, int prim);
size_t imp__light_tree_bytes(const struct imp_light_tree *t);

/* ---- light_bounds.c: bounds and strengths of single lights ---- */
/* Directions that a strength is the mean of lie about an axis by multiples of the golden angle,
 * whose cosines and sines serve all lights. */
enum { IMP_LIGHT_DIRECTIONS = 32 };
struct imp_light_turns {
    double cosine[IMP_LIGHT_DIRECTIONS], sine[IMP_LIGHT_DIRECTIONS];
};
void imp__light_turns(struct imp_light_turns *out);
/* Luminous intensity of a whole light as the importance takes it, without its sampling weight:
 * by its parameters as they are. */
double imp__light_strength(const struct imp_scene *scene,
                           const struct imp_light_turns *turns,
                           const struct imp_emitter *e);
/* Mean radiance of a triangle of a light whose radiance depends on the place alone. */
double imp__light_triangle_radiance(const struct imp_scene *scene,
                                    const struct imp_emitter *e, int prim);
/* Box, normals and reach of a light or of a triangle of it; the node's other fields stay. */
void imp__light_bound(const struct imp_emitter *e, int prim, struct imp_light_node *node);
/* The cone alone, of lights whose parameters move it. */
void imp__light_cone(const struct imp_emitter *e, struct imp_light_node *node);
/* Half angle of the cone of normals. */
double imp__light_angle(const struct imp_light_node *node);
/* Box and cones around two whose half angles are ta, tb; out may be one of them, and keeps its
 * other fields. The cosine of out's cone before it is rounded. */
double imp__light_enclose(const struct imp_light_node *a, double ta,
                          const struct imp_light_node *b, double tb,
                          struct imp_light_node *out);
/* The node around both. */
void imp__light_union(const struct imp_light_node *a, const struct imp_light_node *b,
                      struct imp_light_node *out);
/* Is it in triangles? */
static inline bool imp__light_in_triangles(const struct imp_emitter *e)
{
    return e->shape && (e->ops->flags & IMP_EMITTER_BY_SHAPE) &&
           e->shape->ops->sample_triangle && e->shape->triangles.n_triangles > 1;
}

#endif
