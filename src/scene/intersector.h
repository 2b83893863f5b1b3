/* SPDX-License-Identifier: Apache-2.0
 *
 * Shared by intersect.c and intersect_build.c, the two files that see Embree. */
#ifndef IMP_INTERSECTOR_H
#define IMP_INTERSECTOR_H

#include "facets.h"
#include "shape_balls.h"
#include "tree_quads.h"
#include <embree3/rtcore.h>

struct imp_intersector {
    RTCScene rtc;
    /* Outside of Embree: few analytic shapes, and few triangles (NULL: none). */
    struct imp_shape_balls balls;
    struct imp_facets *facets;
    bool holds;      /* Embree's scene is not empty */
    bool brief;      /* its tree was made in little time */
    bool calls_back; /* for analytic shapes or instances */
    bool packets;    /* it takes eight rays at a time, and each has its numbers then */
    int first;       /* index of its first shape */
    struct imp_tree_quads *
        *quads; /* [n_quads] those of its shapes; NULL: its triangles are alone */
    int n_quads;
    int64_t bytes;
};

/* A triangle's distance is rounded, by a few units of 2^-24 of what it is computed from; an
 * analytic hit's is not. Nearer to each other than this the two are at one place, and the
 * analytic shape is met: mostly it is a lamp that lies on a mesh. (Rays leave surfaces from
 * IMP_RAY_EPSILON in front of them, which is far more.) */
#define IMP_HIT_TIE (4 * 0x1p-24)
/* Up to where a triangle is met before the analytic hit at t. */
static inline float imp__triangle_far(const imp_v3 *o, const imp_v3 *d, double t)
{
    const imp_v3 a = imp__abs(*o), b = imp__abs(*d);
    return (float)(t - IMP_HIT_TIE * (t + (a[0] + a[1] + a[2]) / (b[0] + b[1] + b[2])));
}

/* Rays that are not within Embree's numbers hit nothing. */
static inline bool imp__ray_valid(const imp_v3 *o, const imp_v3 *d, double tmin,
                                  double tmax)
{
    const imp_v3 size = imp__abs(*o) + imp__abs(*d);
    return (size[0] + size[1]) + size[2] < IMP_REACH_MAX && tmin >= 0 && tmin < tmax;
}

/* Embree's hit of a mesh. */
static inline void imp__mesh_hit(const struct imp_intersector *x, imp_v3 o, imp_v3 d,
                                 double tmin, unsigned geometry, unsigned prim, float t,
                                 float u, float v, struct imp_hit *hit)
{
    hit->shape = x->first + (int)geometry;
    hit->prim = (int)prim;
    hit->t = (double)t;
    hit->u = (double)u;
    hit->v = (double)v;
    hit->place = 0;
    if (x->quads && x->quads[geometry])
        imp__tree_quads_hit(x->quads[geometry], prim, hit->u, hit->v, o, d, tmin, hit);
}

/* For a scene of Embree; NULL: it has no memory. quads: of a mesh, or NULL; all: all hits of a ray are
 * reported, not the nearest; brief: its own tree is made in little time. */
RTCGeometry imp__geometry_create(RTCDevice rtc, const struct imp_shape *s,
                                 const struct imp_tree_quads *quads, bool all,
                                 bool brief);
RTCGeometry imp__instances_create(RTCDevice rtc, const struct imp_group *g);

/* What Embree calls for analytic shapes. */
void imp__analytic_intersect(const struct RTCIntersectFunctionNArguments *args);
void imp__analytic_occluded(const struct RTCOccludedFunctionNArguments *args);
/* ... for curves, whether a hit counts ... */
void imp__curve_filter(const struct RTCFilterFunctionNArguments *args);
/* ... and for instances. */
void imp__instance_intersect(const struct RTCIntersectFunctionNArguments *args);
void imp__instance_occluded(const struct RTCOccludedFunctionNArguments *args);
/* Those of analytic shapes where all hits of a ray are gathered. */
void imp__gather_analytic(const struct RTCIntersectFunctionNArguments *args);

#endif
