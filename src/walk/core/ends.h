/* SPDX-License-Identifier: Apache-2.0
 *
 * What an end does in a step of a walk. A walk begins at the sensor (path/trace.c), at a light
 * (lights/light_walk.c), or at the sensor as one of a pair whose vertices are joined
 * (both/both_trace.c). The step (one_step.h) and what scatters in it (scatter_with.h) are one
 * text for all, which an end instantiates with a constant table: nothing is looked up while
 * walks are made. A slot that is NULL has nothing to do. */
#ifndef IMP_WALK_ENDS_H
#define IMP_WALK_ENDS_H

#include "drawn.h"

/* The density of a direction as drawn: p, in all lanes together where they differ (0: the walk
 * ends), and the one that a connection competes with. share, rest as in struct imp_decision. */
struct imp_drawn {
    double pdf, competing, share, rest;
    double unguided; /* by which roulette goes in place of pdf; 0: pdf */
};

/* How the continuation is weighed. */
struct imp_scatter_ops {
    bool transposed; /* wi is known and wo drawn */
    /* Another bounce is within max_depth. */
    bool (*bounces)(const struct imp_step *s);
    /* Density and value of dirs, of which w is the drawn one in the world. */
    struct imp_drawn (*density)(struct imp_step *s, const struct imp_vertex *v,
                                const struct imp_surface *at, const struct imp_dirs *dirs,
                                imp_v3 w, int by, imp_spec *f);
    /* Roulette; factor: weight of the step before it. Survival, as decided. */
    bool (*survives)(struct imp_step *s, const struct imp_bsdf *b,
                     const struct imp_dirs *dirs, imp_spec factor, double *survive);
    /* The next ray is in flight: what MIS needs of it. straight: the vertex was passed. */
    void (*left)(struct imp_step *s, const struct imp_vertex *v,
                 const struct imp_surface *at, const struct imp_dirs *dirs, bool straight,
                 const struct imp_drawn *p, double pdf);
};

/* A vertex, connected to the other end of paths: to a point of a light, or of the sensor. */
struct imp_link {
    struct imp_shadow shadow;
    union {
        struct imp_light_point light;
        struct imp_sensor_sample sensor;
    };
    /* To the sensor: what enters is f le weight. */
    imp_spec f, le;
    double weight;
};

struct imp_end_ops {
    /* ---- Arrival ---- */
    /* The ray leaves the scene. */
    void (*nothing)(struct imp_step *s);
    /* v is met. False: the walk ends. */
    bool (*arrive)(struct imp_step *s, struct imp_vertex *v, const struct imp_hit *hit,
                   const struct imp_surface *at, const struct imp_frame *frame);

    /* ---- At the vertex ---- */
    bool (*bounces)(const struct imp_step *s); /* within max_depth */
    bool (*passes)(const struct imp_step *s);  /* ... by a lobe that is no bounce */
    bool connects_last; /* the vertex is connected although no bounce is left */
    /* The densities of directions, apart from the kernel's. */
    void (*densities)(struct imp_step *s, const struct imp_vertex *v,
                      const struct imp_surface *at);
    /* Emission, or response of the sensor, that is met. False: the walk ends. */
    bool (*meet)(struct imp_step *s, struct imp_vertex *v, const struct imp_hit *hit,
                 const struct imp_surface *at);
    /* Something may follow behind v. */
    void (*goes_on)(struct imp_step *s, const struct imp_vertex *v);

    /* A connection: drawn, weighed, resolved by its shadow ray. */
    bool (*link_draw)(struct imp_step *s, const struct imp_vertex *v,
                      const struct imp_surface *at, struct imp_link *link);
    void (*link_weigh)(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       struct imp_link *link);
    void (*link_see)(struct imp_step *s, struct imp_vertex *v,
                     const struct imp_surface *at, const struct imp_link *link);
    /* Further connections, which add to that one and depend on the lanes on arrival. False:
     * the walk is dropped. */
    bool (*join)(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *at,
                 const struct imp_frame *frame);

    /* The continuation: drawn, and weighed; or several, where the vertex splits. */
    bool (*splits)(const struct imp_step *s);
    bool (*direction_draw)(const struct imp_step *s, const struct imp_vertex *v,
                           const struct imp_frame *frame,
                           struct imp_direction *direction);
    bool (*scatter)(struct imp_step *s, struct imp_vertex *v,
                    const struct imp_surface *at, const struct imp_frame *frame,
                    struct imp_direction *direction);
    bool (*scatter_split)(struct imp_step *s, struct imp_vertex *v,
                          const struct imp_surface *at, const struct imp_frame *frame);
};

#endif
