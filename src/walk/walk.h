/* SPDX-License-Identifier: Apache-2.0
 *
 * Walk and sweep: the two ideas of the program.
 *
 * A walk is one random path from the sensor, recorded vertex by vertex with everything
 * its value is a product of. With E emission met, B the light sample and w = f/(p s) the
 * step weight (f holds the cosine), the radiance leaving vertex k towards the sensor is
 *
 *     L_k = E_k + B_k + w_k L_{k+1}                               (fold, far end first)
 *
 * The sweep carries the adjoint P from the sensor outwards, P_{k+1} = P_k w_k, and at
 * every vertex a piece of gradient falls off (Stam 2020, Eq. 14 on one path; gradients.md
 * 6):
 *
 *     P_k (dE_k + dB_k + dw_k L_{k+1}),   dw = df/(p s): densities are constants
 *
 * The tangent is the same product rule run with the fold. All three read the same record;
 * none traces a ray. */
#ifndef IMP_WALK_H
#define IMP_WALK_H

#include "math/rng.h"
#include "scene/guide.h"

struct imp_vertex {
    struct imp_vertex *prev, *next;
    const struct imp_bsdf *bsdf; /* NULL: the environment, or nothing */
    const struct imp_shape *shape;
    imp_spec *in; /* [bsdf->n_in] inputs at this point */
    struct imp_texcoord at;
    struct imp_dirs dirs; /* of the continuation, shading frame */

    imp_spec w;    /* f inv_ps: weight of the step to the next vertex */
    imp_spec lin;  /* L_{k+1}, set by fold */
    double inv_ps; /* 1/(p s); 0: the walk ends here */

    int emitter;     /* met here, -1: none */
    double e_weight; /* MIS weight, or 1/absorb */
    bool glows;      /* the BSDF's own emission counts here */
    double g_weight; /* 1, or 1/absorb */
    struct imp_emission e_at;
    imp_spec e; /* E_k: all emission of this vertex, weighted */

    int light;       /* emitter sampled and visible, -1: none */
    double l_weight; /* MIS weight / density; > 0, light -1: something is in between */
    struct imp_emission l_at;
    imp_v3 l_wi;        /* local */
    imp_v3 l_p;         /* point on the light */
    imp_spec l_f, l_le; /* BSDF and radiance; B_k = l_f l_le l_weight */

    struct imp_leg *leg; /* the way here, for derivatives of media (bend.h); or NULL */

    imp_v3 ng;              /* geometric normal, world, for describe */
    double pdf, survive, t; /* density, survival, distance from the last vertex */
};

/* Vertices of a walk. One of more is dropped: nothing ends it, as in a closed white room
 * without roulette. With roulette at 0.95 the chance to get here is 1e-365. */
#define IMP_WALK_MAX (1 << 14)

struct imp_walk {
    struct imp_vertex *first, *last;
    int n;         /* vertices */
    double px, py; /* film position, pixels of the full film */
    struct imp_key key;
    struct imp_sensor_ray ray;
    imp_spec L;            /* radiance at the sensor */
    bool valid;            /* alpha 1 (scene-format 11) */
    bool absorbed;         /* Stam: ended by absorption */
    enum imp_drop dropped; /* then L is 0 and there is nothing to sweep */
};

/* Which numbers a derivative is wanted for, prepared once a job. */
struct imp_active {
    size_t n;         /* numbers in x */
    int64_t *base;    /* [n_params] index in x of a parameter's first number, or -1 */
    uint8_t *bsdf;    /* [n_bsdfs] does it depend on an active number */
    uint8_t *emitter; /* [n_emitters] */
    uint8_t *medium;  /* [n_media]; NULL: none of them */
};
/* `chosen` [n_params]. */
enum imp_status imp__active_create(const struct imp_scene *scene, const uint8_t *chosen,
                                   struct imp_active *out);
void imp__active_destroy(imp_context *ctx, struct imp_active *active);

/* What walks are made with; read-only, shared by all workers. */
struct imp_tracer {
    const struct imp_scene *scene;
    const struct imp_integrator *integrator; /* PATH, DIRECT or STAM */
    const struct imp_sensor *sensor;
    /* NULL: value only. Else walks go on through factors that are zero but have a
     * derivative (gradients.md 9.2). */
    const struct imp_active *active;
    uint64_t seed;
    const struct imp_guide *guide; /* of PATH; NULL: none */
};

/* The guide that walks of this integrator follow: its densities are made for paths, in
 * scenes that finite elements know. */
static inline const struct imp_guide *imp__guide_of(const struct imp_scene *scene,
                                                    const struct imp_integrator *i,
                                                    const struct imp_guide *guide)
{
    return i->kind == IMP_INTEGRATOR_PATH && scene->n_media == 0 ? guide : NULL;
}

/* Record walk (x, y, sample) of the picture (x, y from the crop's corner) in the arena
 * and fold it. Running out of memory drops the walk. */
void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk);

/* Film position alone of the same walk. */
void imp__walk_position(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                        double *px, double *py);

/* L = E + B + w L, from the far end; sets lin of every vertex. */
imp_spec imp__walk_fold(struct imp_walk *walk);

/* Reverse mode: adds (dL/dtheta)^T adjoint to the sink, lane by lane. */
void imp__walk_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, struct imp_sink *sink);

/* Forward mode: dL in the direction x_dot [active->n]. */
imp_spec imp__walk_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot);

/* L of the same vertices, densities and decisions at the scene's present parameters: what
 * central differences on frozen walks are made of (gradients.md 13 A). */
imp_spec imp__walk_frozen(const struct imp_tracer *tracer, const struct imp_walk *walk);

/* Radiance of an emitter at x, point p of it, at the scene's present parameters. */
imp_spec imp__emitter_radiance(const struct imp_scene *scene, int emitter,
                               const struct imp_emission *x, imp_v3 p);

#endif
