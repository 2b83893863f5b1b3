/* SPDX-License-Identifier: Apache-2.0
 *
 * A walk from a light while it is decided: what the files that do it share. It begins on
 * a light (light_start.c), goes on vertex by vertex (light_walk.c), and from each vertex
 * light reaches the sensor (light_reach.c).
 *
 * Depth: a connection from vertex k, 0 on the light, makes a path of k + 1 segments, and a
 * sensor that is met there one of k; they count up to max_depth. Vertices where light goes
 * straight on, which connections through media pass, are left out (imp_step.straight). */
#ifndef IMP_WALK_LIGHT_STEP_H
#define IMP_WALK_LIGHT_STEP_H

#include "kind/kind_lanes.h"
#include "light_walk.h"
#include "walk/core/ends.h"
#include "walk/core/guided.h"

/* What a walk from the scene's only light begins with, where it is drawn beforehand. */
struct imp_light_given {
    bool drawn; /* there is one */
    double point[2];
    struct imp_emission_sample start;
};

struct imp_light_step {
    struct imp_step s; /* first: ends are handed it */
    struct imp_light_walk *out;
    struct imp_reach **end; /* of the list */
    /* The ray in flight: its density per area across it, where the sky sent it; else 0. */
    double pdf_across;
    double passed; /* length of the way to where it begins, from where a connection could
                      have been made: light went straight on in between */
    double point[2];       /* numbers that the point on the light was made of */
    struct imp_both *both; /* of a sample from both ends; NULL: none */
    const struct imp_light_given *given; /* NULL: it is drawn where it begins */
};

static inline bool imp__light_depth_allows(const struct imp_step *s, int segments)
{
    const int max = s->tracer->integrator->max_depth;
    return max < 0 || segments - s->straight <= max;
}

/* ---- light_walk.c ---- */
/* All steps of out->walk, whose key, time and wavelengths are set. */
void imp__light_walk_follow(const struct imp_tracer *tracer, struct imp_arena *arena,
                            struct imp_light_walk *out);
/* A walk with its key, time and wavelengths, and nothing else; its step. False: no memory. */
bool imp__light_walk_start(const struct imp_tracer *tracer, struct imp_arena *arena,
                           int64_t index, struct imp_light_walk *out);
void imp__light_step_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                           imp_spec *scratch, struct imp_light_walk *out,
                           struct imp_light_step *w);
/* What r brings; those that are not finite drop the walk. */
void imp__reach_value(const struct imp_tracer *tracer, struct imp_walk *walk,
                      struct imp_reach *r, imp_spec values);
/* The values of what reaches the film. */
void imp__light_walk_close(const struct imp_tracer *tracer, struct imp_light_walk *out);

/* Can walks be made some at a time? */
bool imp__light_walks_go_together(const struct imp_tracer *tracer);
/* Walks first, .., first + n - 1, of such a tracer: their rays go together. False: no memory. */
bool imp__light_walks_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                            int64_t first, int n, struct imp_light_walk *out);

/* In place of a pixel in the key: no pixel of a film has this number. */
static inline struct imp_key imp__light_key(const struct imp_tracer *tracer,
                                            int64_t index)
{
    return imp__key(tracer->seed, UINT64_C(0x4c69676874000000), (uint64_t)index);
}

/* ---- light_given.c ---- */
/* Where walks first, .., first + n - 1 begin. False: they are drawn one by one. */
bool imp__light_starts(const struct imp_tracer *tracer, int64_t first, int n,
                       struct imp_light_given *out);
/* The only light of the scene, if walks can begin there in lanes; else NULL. Points and directions of
 * IMP_WIDE_LANES walks there, by the numbers of their keys; lane k of them. */
const struct imp_emitter_lanes *imp__light_only(const struct imp_tracer *t);
void imp__light_starts_draw(const struct imp_tracer *t,
                            const struct imp_emitter_lanes *lanes,
                            const struct imp_wide_block *keys, imp_wide point[2],
                            struct imp_wide_emission *out);
struct imp_light_given imp__light_given(const struct imp_wide_emission *x,
                                        const imp_wide point[2], int k);

/* ---- light_start.c ---- */
/* Vertex 0: the light that sends the walk, and the ray that leaves it. False: nothing is
 * sent. */
bool imp__light_start(struct imp_light_step *w);

/* ---- light_reach.c ---- */
/* The surface of the sensor, met at v. */
void imp__light_meet_sensor(struct imp_light_step *w, struct imp_vertex *v,
                            const struct imp_surface *at);
/* A connection of a vertex that scatters to the sensor (struct imp_end_ops). s is that of a
 * struct imp_light_step. */
bool imp__light_link_draw(struct imp_step *s, const struct imp_vertex *v,
                          const struct imp_surface *at, struct imp_link *link);
void imp__light_link_weigh(struct imp_step *s, struct imp_vertex *v,
                           const struct imp_surface *at, const struct imp_frame *frame,
                           struct imp_link *link);
void imp__light_link_see(struct imp_step *s, struct imp_vertex *v,
                         const struct imp_surface *from, const struct imp_link *link);
/* The part of the film that connections reach. */
struct imp_film_bounds {
    double x, y, width, height, margin;
};
static inline struct imp_film_bounds imp__light_film(const struct imp_sensor *s)
{
    const struct imp_film_desc *f = &s->film;
    return (struct imp_film_bounds){f->crop_x, f->crop_y, f->crop_w, f->crop_h,
                                    f->sample_border ? ceil(f->filter.radius) : 0};
}
/* Can a connection reach a pixel? */
bool imp__light_on_film(const struct imp_sensor *s, const struct imp_sensor_sample *to);
/* The parts of a connection, for vertices and for lights: the random numbers of the
 * point on the sensor; the weight against a walk that meets the sensor, which has density
 * `pdf` per steradian, or `across` per area across the ray; the shadow ray. */
void imp__light_sensor_numbers(const struct imp_step *s, double u[4]);
double imp__light_connect_weight(const struct imp_step *s,
                                 const struct imp_sensor_sample *to, double pdf,
                                 double across);
static inline double imp__light_shadow_reach(const struct imp_sensor_sample *to)
{
    return imp__dot(to->ng, to->ng) > 0 ? 1 - 10 * IMP_RAY_EPSILON : 1;
}
void imp__light_shadow_aim(const struct imp_surface *from,
                           const struct imp_sensor_sample *to, struct imp_shadow *shadow);

#endif
