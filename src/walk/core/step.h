/* SPDX-License-Identifier: Apache-2.0
 *
 * A walk while it is decided, and what happens at a vertex: emission is met, a light is
 * sampled (light.c), the continuation is drawn (direction.c, scatter.c), and branches
 * where the walk is split (walk_split.c). Only trace.c puts them together, walk_trace.c
 * begins a walk and closes it. */
#ifndef IMP_WALK_STEP_H
#define IMP_WALK_STEP_H

#include "dims.h"
#include "lane_mis.h"
#include "scene/light_tree.h"
#include "scene/priorities.h"
#include "segment.h"
#include "shaped.h"

struct imp_both;
struct imp_direction;
struct imp_light_point;

/* State of a guided walk (guided.c). */
struct imp_guided {
    const struct imp_guide *guide; /* NULL: none */
    bool here,
        left; /* the guide covers this vertex; the one where the ray in flight left */
    struct imp_guide_place at, from;
    double reference; /* radiance that it expects of this walk; 0: none */
    double rest;      /* what it expects of the continuation here, at throughput 1 */
    imp_spec before;  /* throughput on arrival */
};

/* The mixture that directions are drawn from (direction.c). */
struct imp_mixed {
    const struct imp_mixing *all; /* of the walk; NULL: its kernels draw */
    bool same;                    /* for all materials, whatever weights they have */
    /* At the vertex at work: */
    bool here;   /* more than the kernel draws */
    bool splits; /* one continuation from each member, with MIS */
    bool sphere; /* the uniform member samples the full sphere */
    int only; /* at a vertex that splits, the member that draws; -1: chosen by its share */
    int members;
    double share[IMP_DENSITIES];
    double strength[2]; /* sums of lights' and proxies' strengths, seen from p */
    imp_v3 p;
};

/* Position of a walk in media (tracking.c). */
struct imp_flight {
    const struct imp_medium *medium; /* that the ray in flight is in; NULL: none */
    const struct imp_medium
        *here;      /* that the vertex at work lies in, or is reached from */
    imp_v3 at;      /* of the last collision */
    double t, base; /* of the collision; length before the last surface that was passed */
    bool fixed;     /* a fixed collision (tracking.h) */
    int events;     /* tentative collisions of the walk */
    /* Where shapes have priorities: around the ray in flight, and around the vertex at work
     * without the surface that it lies on. */
    struct imp_nest nest, nest_here;
    double behind; /* the ray begins so far behind the point that it leaves */
};

struct imp_step {
    const struct imp_tracer *tracer;
    const struct imp_scene *scene;
    struct imp_walk *walk;
    struct imp_arena *arena;
    struct imp_point_block block; /* of the walk's point, for the vertex at work */
    bool recorded; /* also where only the value counts, if vertices move with a field */
    int depth;     /* vertices before this one, which number its random numbers */
    int straight;  /* of them, those that light passed straight on: no bounces */

    /* The vertex at work: as decided, in double; its inputs. */
    struct imp_texcoord at;
    imp_v3 wo, wo_drawn; /* as decided; before rounding, from which the walk goes on */
    const imp_spec *in;
    imp_spec *scratch; /* [IMP_INPUTS_MAX] inputs of a walk that is not recorded */

    /* The ray in flight. */
    const struct imp_segment_ops *segment;
    imp_v3 o, d;
    double t_min, t_max;
    double pdf;  /* of d per steradian; 0: a delta lobe or the sensor chose it */
    imp_v3 from; /* where the ray left, for densities of lights */

    /* For roulette only. */
    imp_spec beta; /* throughput, zero factors left out */
    double eta;    /* product of index ratios */
    int zeros[4];  /* per lane: factors that are zero but have a derivative */

    struct imp_lane_mis lanes;

    struct imp_flight flight;
    struct imp_probing *probing;     /* NULL: nothing is probed */
    struct imp_graded_state *graded; /* NULL: no graded medium in the scene */
    struct imp_guided guided;
    struct imp_mixed mixed;
    struct imp_both *both; /* of a sample from both ends, whose weights it has; NULL */
    /* Where lights are chosen by a tree. */
    const struct imp_light_tree *light_tree; /* NULL: by their weights */
    struct imp_light_cut
        *cut; /* of the last place, where many walks begin; NULL: none is kept */
    struct imp_light_place left; /* where the ray in flight left */
};

/* Depth of the vertex at work as max_depth counts it. */
static inline int imp__bounces(const struct imp_step *s)
{
    return s->depth - s->straight;
}

/* Random number of the vertex at work for a use (dims.h). */
static inline double imp__step_number(const struct imp_step *s, int use)
{
    if (s->walk->point.points) return imp__block_number(s->block, imp__slot(use));
    return imp__u01(s->walk->key, imp__dim(s->depth, use));
}

static inline void imp__step_numbers(struct imp_step *s)
{
    if (!s->walk->point.points) return;
    s->block = imp__point_block(s->walk->point, imp__block(s->depth));
    __builtin_prefetch(s->block.lead);
}

/* What a record stores of v, in double again. */
static inline imp_v3 imp__decide(imp_v3 v)
{
    imp_float4 stored = imp__narrow(v);
    IMP_OPAQUE(stored);
    return imp__widen(stored);
}
static inline double imp__decide1(double x)
{
    imp_decided stored = (imp_decided)x;
    IMP_OPAQUE(stored);
    return stored;
}
static inline void imp__store_v3(imp_decided out[3], imp_v3 v)
{
    const imp_float4 rounded = imp__narrow(v);
    for (int k = 0; k < 3; k++) out[k] = rounded[k];
}

/* ---- vertices.c ---- */
/* A vertex behind the last one, with room for the inputs of its BSDF. NULL: the walk is
 * dropped. */
struct imp_vertex *imp__vertex_add(struct imp_step *s, int n_in);
/* Where the surface is, as decided, and its inputs; d: direction of arrival, t: length of
 * the segment that leads there. */
void imp__vertex_place(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       imp_v3 d, double t);
/* The ray in flight leaves the scene and meets the environment. */
void imp__sky_meet(struct imp_step *s);
/* The vertex that the first segment begins at, if it has a weight. False: no memory. */
bool imp__sensor_vertex(struct imp_step *s);
/* ---- trace.c ---- */
/* Step after step from the ray in flight, until the walk ends; from a sensor that is a
 * surface, whose vertex comes first. */
void imp__walk_on(struct imp_step *s);
void imp__walk_on_meter(struct imp_step *s);
/* From a hit that the ray has, as of imp__walk_along. */
void imp__walk_on_hit(struct imp_step *s, struct imp_hit *hit, imp_v3 along);
/* What is scattered at point p of a medium back along s->d: a walk of its own, that
 * begins with a copy of s; its walk is empty. */
imp_spec imp__walk_scattered(struct imp_step *s, const struct imp_bsdf *scatterer,
                             imp_v3 p);

/* ---- walk_split.c ---- */
/* The continuation of v, and its branches: one from each member of the mixture, or as many
 * as the tracer wants. False: the walk itself ends here. */
bool imp__scatter_split(struct imp_step *s, struct imp_vertex *v,
                        const struct imp_surface *at, const struct imp_frame *frame);

/* ---- walk_trace.c ---- */
/* A walk from a light, with nothing but its key and time; a step at the beginning of a walk,
 * with its ray in flight. Field by field: clearing such structs takes part of a walk's time. */
void imp__light_walk_begin(const struct imp_tracer *tracer, struct imp_walk *walk,
                           struct imp_key key);
void imp__step_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                     struct imp_walk *walk, imp_spec *scratch, struct imp_step *s);

/* ---- tracking.c ---- */
/* The shapes with a priority around p, where a walk begins in `around` outside of them, by a
 * ray along d. False: it is dropped. */
bool imp__nest_begin(struct imp_step *s, const struct imp_medium *around, imp_v3 p,
                     imp_v3 d);

/* ---- segment.c ---- */
/* The nearest hit of the ray in flight. With hide_emitters, a camera ray skips area
 * lights. */
enum imp_meeting imp__straight_meet(struct imp_step *s, struct imp_hit *hit);

/* ---- evaluate.c: the values of a vertex from its decisions ---- */
/* The index of a boundary is that of the body behind it (body_index.c). */
void imp__body_inputs(const struct imp_bsdf *b, const struct imp_shape *shape,
                      const struct imp_texcoord *at, imp_spec *in);
static inline void imp__evaluate_inputs(const struct imp_bsdf *b,
                                        const struct imp_shape *shape,
                                        const struct imp_texcoord *at, imp_spec *in)
{
    imp__inputs_eval(b->input, b->n_in, at, in);
    if (imp_unlikely(shape && shape->body)) imp__body_inputs(b, shape, at, in);
}
/* f with densities frozen becomes the weight of the step; T of the segment that follows
 * is not known yet. */
static inline void imp__step_weigh(struct imp_vertex *v, imp_spec f, double pdf,
                                   double survive)
{
    v->scale = imp__spec(1 / (pdf * survive));
    v->w = f * v->scale;
}
/* ... and now it is. */
static inline void imp__step_pass(struct imp_vertex *v, imp_spec transmittance)
{
    v->scale *= transmittance;
    v->w *= transmittance;
}

/* ---- light.c ---- */
/* The shadow ray of a light sample, and what it brings if nothing is in its way; `wanted`
 * false: there is nothing to see. */
struct imp_shadow {
    imp_v3 o, d;
    double reach;
    imp_spec brings;
    bool wanted;
};
/* Emission met by the ray at an area light, or the environment (hit, at NULL). */
void imp__emission_meet(struct imp_step *s, struct imp_vertex *v, int emitter,
                        double weight, const struct imp_hit *hit,
                        const struct imp_surface *at);
/* What v gets from a point of a light (drawn.h), and the shadow ray. */
void imp__light_sample(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       const struct imp_light_point *to, struct imp_shadow *shadow);

/* ---- stam.c ---- */
/* Stam's termination: with probability `absorb` the walk ends and collects what glows
 * here, divided by it; else it goes on, divided by the rest (docs/estimators.md 6, E22 to
 * E24). Weight of the emission here: 1/absorb, or 0 where the walk goes on; 1 where
 * nothing absorbs. */
bool imp__absorb(struct imp_step *s, const struct imp_bsdf *b, double *weight);
/* Stam's exponent by the attached form, or only its first term as in his App. C
 * (docs/estimators.md 4, E9): replaces the detached derivative of the inputs where the
 * kind offers it. d [n_in]. */
void imp__attached_d(const struct imp_walk *walk, const struct imp_vertex *v, int depth,
                     imp_spec *d);

/* ---- direction.c ---- */
/* The densities that take part at a vertex at p, of material b; with s->mixed.all set, or
 * where a guide covers the place. */
void imp__mixture_prepare(struct imp_step *s, const struct imp_bsdf *b, imp_v3 p);
/* Draw the continuation, as imp_bsdf_ops.sample does, and which member drew it (enum
 * imp_density). */
bool imp__mixture_draw(const struct imp_step *s, const struct imp_bsdf *b,
                       const struct imp_frame *frame, const double u[3],
                       struct imp_dirs *dirs, int *drawn);
/* By what the value of direction w, world, is divided if `drawn` drew it (-1: none did);
 * the BSDF alone has `kernel` for it. *competing: the density that a light sample competes
 * with. */
double imp__mixture_pdf(const struct imp_step *s, double kernel, imp_v3 w, int drawn,
                        int lobe, double *competing);
static inline bool imp__direction_draw(const struct imp_step *s, const struct imp_bsdf *b,
                                       const struct imp_frame *frame, const double u[3],
                                       struct imp_dirs *dirs, int *drawn)
{
    *drawn = IMP_DENSITY_KERNEL;
    return imp_unlikely(s->mixed.here || b->shaped)
               ? imp__mixture_draw(s, b, frame, u, dirs, drawn)
               : b->ops->sample(b, s->in, u, dirs);
}
static inline double imp__direction_pdf(const struct imp_step *s, double kernel, imp_v3 w,
                                        int drawn, int lobe, double *competing)
{
    return imp_unlikely(s->mixed.here)
               ? imp__mixture_pdf(s, kernel, w, drawn, lobe, competing)
               : (*competing = kernel);
}

/* Lights behind the normal bring nothing to this material. */
static inline bool imp__is_faced(const struct imp_bsdf *b)
{
    return !(b->flags & (IMP_BSDF_TRANSMIT | IMP_BSDF_TURNED));
}

/* A vertex of material b as the tree of lights sees it. */
static inline struct imp_light_place imp__light_place(const struct imp_step *s,
                                                      const struct imp_bsdf *b,
                                                      const struct imp_surface *at)
{
    const bool medium = at->n[0] == 0 && at->n[1] == 0 && at->n[2] == 0;
    return (struct imp_light_place){.p = at->p,
                                    .n = s->wo[2] < 0 ? -at->n : at->n,
                                    .faces = !medium && imp__is_faced(b)};
}

/* A light by cumulative probabilities [scene->n_emitters], and its own. */
static inline int imp__light_pick_by(const struct imp_scene *scene, const double *cdf,
                                     double u, double *pmf)
{
    /* The first whose cumulative weight exceeds u. */
    int light = 0, above = scene->n_emitters - 1;
    while (light < above) {
        const int middle = (light + above) / 2;
        if (u < cdf[middle]) above = middle;
        else light = middle + 1;
    }
    *pmf = cdf[light] - (light ? cdf[light - 1] : 0);
    return light;
}
/* By its sampling weight. */
static inline int imp__light_pick(const struct imp_scene *scene, double u, double *pmf)
{
    return imp__light_pick_by(scene, scene->light_cdf, u, pmf);
}

/* ---- scatter.c ---- */
/* beta *= f/p, where a lane's first factor that is zero but has a derivative is left out:
 * the walk goes on, because what arrives from beyond is that derivative. A second one
 * ends the lane (docs/estimators.md 9.2). False: all lanes have ended. */
bool imp__throughput_part(struct imp_step *s, const struct imp_bsdf *b, imp_spec factor);
static inline bool imp__throughput_add(struct imp_step *s, const struct imp_bsdf *b,
                                       imp_spec factor)
{
    const bool four = s->at.carried != NULL;
    if (imp_unlikely(factor[0] == 0 || factor[1] == 0 || factor[2] == 0 ||
                     (four && factor[3] == 0)))
        return imp__throughput_part(s, b, factor);
    s->beta *= factor;
    return !imp__is_zero_used(s->beta, four);
}
/* Decide whether the walk goes on along a direction (drawn.h); rounds it. False: it ends here. */
bool imp__scatter_along(struct imp_step *s, struct imp_vertex *v,
                        const struct imp_surface *at, const struct imp_frame *frame,
                        struct imp_direction *direction);
/* A direction, and whether the walk goes on there. */
bool imp__scatter(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *at,
                  const struct imp_frame *frame);

/* ---- guided.c ---- */
void imp__guided_arrive(struct imp_step *s, const struct imp_hit *hit,
                        const struct imp_surface *at);
static inline void imp__guided_leave(struct imp_guided *g)
{
    if (imp_likely(g->guide == NULL)) return;
    g->left = g->here;
    g->from = g->at;
}
/* Survival by what is expected to come; `q`: by throughput. */
double imp__guided_survival(const struct imp_step *s, double q);

/* The inputs of this material with respect to which derivatives are taken (imp_dirs). */
static inline uint64_t imp__derivative_wanted(const struct imp_step *s,
                                              const struct imp_bsdf *b)
{
    const struct imp_active *active = s->tracer->active;
    return imp_unlikely(active != NULL) && b->index >= 0 ? active->inputs[b->index] : 0;
}
static inline bool imp__wants_derivative(const struct imp_step *s,
                                         const struct imp_bsdf *b)
{
    return imp__derivative_wanted(s, b) != 0;
}

#endif
