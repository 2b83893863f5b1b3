/* SPDX-License-Identifier: Apache-2.0
 *
 * Shared by intersect.c and intersect_build.c, the two files that see Embree. */
#ifndef IMP_INTERSECTOR_H
#define IMP_INTERSECTOR_H

#include "facets.h"
#include "shape_balls.h"
#include <embree3/rtcore.h>

struct imp_intersector {
    RTCScene rtc;
    /* Outside of Embree: few analytic shapes, and few triangles (NULL: none). */
    struct imp_shape_balls balls;
    struct imp_facets *facets;
    bool holds;      /* Embree's scene is not empty */
    bool calls_back; /* for analytic shapes or instances */
    int first;       /* index of its first shape */
    int64_t bytes;
};

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
