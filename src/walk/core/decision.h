/* SPDX-License-Identifier: Apache-2.0
 *
 * What rays and random numbers settle at a vertex of a walk (walk_parts.h).
 *
 * Decisions are rounded to what a kept record stores before they are first evaluated:
 * evaluating a kept record gives the walk's value and gradient to the bit. Rays go on
 * from places and directions in double. */
#ifndef IMP_WALK_DECISION_H
#define IMP_WALK_DECISION_H

#include "kind/build.h"
#include "math/vec.h"
#include <stdbool.h>
#include <stdint.h>

typedef float imp_decided;

struct imp_scene;
struct imp_sensor;

enum imp_scatterer {
    IMP_AT_SURFACE,  /* a BSDF */
    IMP_AT_BOUNDARY, /* a surface that light passes as if nothing were there */
    IMP_AT_SKY,      /* an environment, met where the walk leaves the scene; where there
                        are several, one vertex of each, one behind the other */
    IMP_IN_MEDIUM,   /* a phase function, between surfaces */
    IMP_AT_SENSOR,   /* where a walk begins, if its first segment crosses media */
    IMP_AT_LIGHT     /* where a walk from a light begins (light_walk.h) */
};

enum imp_connection { IMP_NOT_CONNECTED, IMP_OCCLUDED, IMP_CONNECTED };

/* Emission that the ray met: of an area light at the vertex, or of the environment. */
struct imp_met {
    int32_t emitter;    /* -1: none */
    imp_decided weight; /* MIS weight, or 1/absorb */
    imp_decided dist, cos_light, d[3];
};

/* The light sample of a vertex, the walk's connection to a light. */
struct imp_light {
    int32_t emitter;
    imp_decided weight; /* MIS weight over the sample's density */
    imp_decided uv[2], dist, cos_light, d[3], p[3];
    imp_decided wi[3]; /* towards it, shading frame of the vertex */
    struct imp_located
        located; /* the same point on its shape (located.h); of a connection to
                                   a sensor that on the sensor's. prim -1: on none */
};

struct imp_decision {
    int32_t shape;          /* index; in a medium, the medium's; -1: none */
    uint8_t scatterer;      /* enum imp_scatterer */
    int8_t lobe;            /* of the continuation: IMP_SMOOTH or a delta lobe */
    uint8_t connection : 4; /* enum imp_connection: what became of the light sample */
    bool back : 1;          /* the ray came from behind the geometric normal */
    bool glows : 1;         /* the BSDF's own emission counts */
    bool goes_on : 1;       /* the walk continues */
    bool fixed : 1;         /* in a medium: a fixed collision, whose factor is
                                 differentiated by the extinction (tracking.h) */
    uint8_t drawn : 3;      /* enum imp_density that drew the continuation */
    bool alone : 1;         /* its vertex splits, and one member of the mixture drew it */
    bool from_light : 1;    /* of a walk from a light: the light sample is a connection to
                                 the sensor, what is met the sensor, wi is given */
    /* Where it is: of a surface the primitive and the point on it (located.h), prim -1: on
     * none; the instance in which the shape was met (imp_hit.place), IMP_PLACE_MOST: one
     * whose number is too large; at the sky p is the direction. */
    struct imp_located located;
    uint32_t place;
    imp_decided uv[2], p[3];
    imp_decided wo[3], wi[3]; /* of the continuation, shading frame */
    imp_decided pdf, survive; /* p, s of the continuation */
    imp_decided share, rest;  /* p before roulette = share k + rest, k: the BSDF's own
                                 density of wi; in each lane, if lanes differ; with
                                 `alone` in the lane that drew */
    imp_decided passes;       /* T of the segment that follows, where no parameter that
                                 is differentiated changes it */
    imp_decided glow_weight;  /* of the BSDF's own emission: 1, or 1/absorb */
    struct imp_met met;
    struct imp_light light;
};

#define IMP_PLACE_MOST UINT32_MAX
static inline uint32_t imp__place_decided(int64_t place)
{
    return place < IMP_PLACE_MOST ? (uint32_t)place : IMP_PLACE_MOST;
}

static inline imp_v3 imp__decided_v3(const imp_decided v[3])
{
    return imp__widen((imp_float4){v[0], v[1], v[2], 0});
}
static inline struct imp_emission imp__light_emission(const struct imp_light *l)
{
    return (struct imp_emission){
        {l->uv[0], l->uv[1]}, l->dist, l->cos_light, imp__decided_v3(l->d)};
}

/* ---- decided_surface.c ---- */
/* The surface at a vertex, world, from its decisions alone: the shape as it is now, in its
 * instance as that is at the walk's time. False: it lies on none (in a medium, at the sky or a
 * camera, on a light that is a point), or its shape does not compute surfaces without a ray. */
bool imp__decided_surface(const struct imp_scene *scene, const struct imp_decision *d,
                          double time, struct imp_surface *out);
/* The same of the point of its light sample; of a walk from a light, of the point on the
 * sensor (NULL: none) or, of a vertex on the light, of that itself. */
bool imp__decided_light(const struct imp_scene *scene, const struct imp_sensor *sensor,
                        const struct imp_decision *d, double time,
                        struct imp_surface *out);

#endif
