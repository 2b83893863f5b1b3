/* SPDX-License-Identifier: Apache-2.0
 *
 * Bidirectional walks (Veach 1997, 10). A sample is a walk from the sensor and one from a
 * light. With vertices y_1 .. y_t of the first and z_1 .. z_s of the second, y_1 on the
 * sensor and z_1 on the light, a path of n = s + t vertices is found in up to n + 1 ways:
 *
 *     s = 0          the walk from the sensor meets a light                (E of the walk)
 *     s = 1          a light sample of y_t                                 (B)
 *     s > 1, t > 1   y_t is connected to z_s, a joint                      (joints, in B)
 *     t = 1          z_s is connected to the sensor                        (reach)
 *     t = 0          the walk from the light meets the sensor's surface    (reach)
 *
 * With s = t = 1, a camera is connected to z_1, a sensor that is a surface to a light sample.
 * Each way has the weight of the
 * power heuristic with exponent 2 among all ways that can find the path, from the densities
 * p_s with which they draw its vertices,
 *
 *     p_s = product over k <= s of p(z_k | z_{k-1}, ..) times that over the others of
 *           p(y_k | y_{k-1}, ..)
 *
 * Only ratios of these enter (both_weight.c). Survival and transmittance are left out: any
 * weights that depend on the path alone and add up to 1 leave the mean as it is. */
#ifndef IMP_WALK_BOTH_H
#define IMP_WALK_BOTH_H

#include "walk/lights/light_step.h"

/* A vertex of either walk, as densities need it. */
struct imp_end {
    imp_v3 p,
        ng;     /* ng 0: it lies in a medium, or is a point. Of `far`, p is the direction
                     towards it */
    double own; /* density with which its walk draws it, per area, of media per volume, of
                     `far` per steradian; 1 behind a delta lobe */
    double other; /* with which the walk from the other end would have; 1 likewise. It
                     depends on the two vertices before this one there, and is known when
                     its walk has gone two vertices further */
    bool delta;   /* its walk goes on by a delta lobe */
    bool far;
};

/* A vertex of the walk from the light that vertices of the other can be connected to. */
struct imp_both_place {
    struct imp_vertex *vertex; /* NULL: it cannot */
    int number;
    const imp_spec *in; /* inputs of its BSDF */
    struct imp_frame frame;
    imp_v3 wi, d; /* where light comes from: in the frame, as decided; world */
    imp_spec P;   /* light that arrives: the product of the weights so far */
    struct imp_lane_mis lanes;
};

/* y is connected to z: B of y has f_y f_z P_z T weight more. */
struct imp_joint {
    struct imp_joint *next; /* in order of y, then z */
    struct imp_vertex *y, *z;
    int z_number;
    imp_decided wi[3]; /* towards z, shading frame of y */
    imp_decided wo[3]; /* towards y, that of z */
    imp_decided weight;
    struct imp_track *track; /* of the way; NULL: T is 1 */
    imp_spec f_y, f_z, T;
};

struct imp_both {
    struct imp_arena *arena;
    const struct imp_sensor *sensor;
    struct imp_walk eye;
    struct imp_joint *joints, **joints_end;
    double pixels; /* walks from the sensor have positions on so many */

    /* While they are decided: */
    struct imp_end *light, *from_eye; /* [n_light], [n_eye] */
    struct imp_both_place *place;     /* [n_light] */
    int n_light, cap_light, n_eye, cap_eye;
    double lens[2];
    double pdf_light, pdf_eye; /* of the rays in flight, per steradian; 0: delta lobes */
    bool sees;   /* the sensor can be connected to the vertex that its walk meets first */
    int emitter; /* of z_1 */
};

/* ---- both_trace.c ---- */
/* Sample `index`: pixels take turns. Fills out->walk with the walk from the light, and
 * out->both; what the walk from the sensor brings is the last reach. */
void imp__both_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                     int64_t index, struct imp_light_walk *out);

/* ---- both_density.c ---- */
/* Room for one more end. NULL: no memory. */
struct imp_end *imp__both_light_end(struct imp_both *b);
struct imp_end *imp__both_eye_end(struct imp_both *b);

/* The walk from the light begins, arrives at a vertex, and has gone on from it along
 * dirs->wo. False: no memory. */
bool imp__both_light_begins(struct imp_light_step *w, int light,
                            const struct imp_emission_sample *start);
bool imp__both_light_arrives(struct imp_light_step *w, struct imp_vertex *v,
                             const struct imp_surface *at, const struct imp_frame *frame);
void imp__both_light_leaves(struct imp_light_step *w, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs);
/* The same of the walk from the sensor; at NULL: the sky. */
bool imp__both_eye_arrives(struct imp_step *s, const struct imp_surface *at);
void imp__both_eye_leaves(struct imp_step *s, const struct imp_bsdf *b,
                          const struct imp_frame *frame);

/* ---- both_weight.c ---- */
/* Weight of emission that the walk from the sensor meets (hit, at NULL: the sky). */
double imp__both_met_weight(const struct imp_step *s, int emitter,
                            const struct imp_hit *hit, const struct imp_surface *at);
/* ... of its light sample. */
double imp__both_sample_weight(const struct imp_step *s, int light,
                               const struct imp_light_sample *to,
                               const struct imp_bsdf *b, const struct imp_dirs *dirs);
/* ... of the vertex at work connected to place k of the walk from the light. */
double imp__both_joint_weight(const struct imp_step *s, int k, const struct imp_bsdf *b,
                              const struct imp_dirs *at_y, const struct imp_dirs *at_z);
/* ... of the last vertex of the walk from the light connected to the sensor. */
double imp__both_reach_weight(const struct imp_light_step *w,
                              const struct imp_sensor_sample *to,
                              const struct imp_bsdf *b, const struct imp_dirs *dirs);
/* ... of the light itself, where x says, connected to a camera. */
double imp__both_light_weight(const struct imp_light_step *w, int emitter,
                              const struct imp_emission_sample *start,
                              const struct imp_emission *x,
                              const struct imp_sensor_sample *to);
/* ... of that vertex, which is on the sensor; cosine: there. */
double imp__both_sensor_weight(const struct imp_light_step *w, double cosine);

#endif
