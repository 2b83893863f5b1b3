/* SPDX-License-Identifier: Apache-2.0
 *
 * Embree's geometries of shapes and of instances: triangles and curves are its own, others are user
 * geometries with bounds and callbacks. */
#include "instances.h"
#include "intersector.h"
#include "math/offset.h"

static void bounds_set(imp_v3 lo, imp_v3 hi, struct RTCBounds *b)
{
    b->lower_x = nextafterf((float)lo[0], -INFINITY);
    b->lower_y = nextafterf((float)lo[1], -INFINITY);
    b->lower_z = nextafterf((float)lo[2], -INFINITY);
    b->upper_x = nextafterf((float)hi[0], INFINITY);
    b->upper_y = nextafterf((float)hi[1], INFINITY);
    b->upper_z = nextafterf((float)hi[2], INFINITY);
}

static void analytic_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    const imp_v3 a = imp__abs(s->lo), b = imp__abs(s->hi);
    const double size = fmax(fmax(fmax(a[0], a[1]), a[2]), fmax(fmax(b[0], b[1]), b[2]));
    /* It is intersected also where a triangle was met that may lie behind it. */
    const imp_v3 more = imp__spec((1 + size) * IMP_RAY_EPSILON);
    bounds_set(s->lo - more, s->hi + more, args->bounds_o);
}

static void instance_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const struct imp_group *g = args->geometryUserPtr;
    imp_v3 lo, hi;
    imp__instance_box(&g->instance[args->primID], &lo, &hi);
    bounds_set(lo, hi, args->bounds_o);
}

RTCGeometry imp__instances_create(RTCDevice rtc, const struct imp_group *g)
{
    RTCGeometry made = rtcNewGeometry(rtc, RTC_GEOMETRY_TYPE_USER);
    if (!made) return NULL;
    rtcSetGeometryUserPrimitiveCount(made, (unsigned)g->n_instances);
    rtcSetGeometryUserData(made, (void *)(uintptr_t)g);
    rtcSetGeometryBoundsFunction(made, instance_bounds, NULL);
    rtcSetGeometryIntersectFunction(made, imp__instance_intersect);
    rtcSetGeometryOccludedFunction(made, imp__instance_occluded);
    rtcCommitGeometry(made);
    return made;
}

static RTCGeometry curves_create(RTCDevice rtc, const struct imp_curves *c)
{
    const bool cones = c->degree == 1;
    RTCGeometry g = rtcNewGeometry(rtc, cones ? RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE
                                              : RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE);
    if (!g) return NULL;
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, c->points,
                               0, 4 * sizeof(float), c->n_points);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, c->first, 0,
                               sizeof(uint32_t), c->n_segments);
    if (cones)
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_FLAGS, 0, RTC_FORMAT_UCHAR,
                                   c->joined, 0, 1, c->n_segments);
    rtcSetGeometryIntersectFilterFunction(g, imp__curve_filter);
    rtcSetGeometryOccludedFilterFunction(g, imp__curve_filter);
    rtcCommitGeometry(g);
    return g;
}

RTCGeometry imp__geometry_create(RTCDevice rtc, const struct imp_shape *s,
                                 const struct imp_tree_quads *quads, bool all, bool brief)
{
    if (s->geometry == IMP_CURVES) return curves_create(rtc, &s->curves);
    const bool analytic = s->geometry == IMP_ANALYTIC;
    RTCGeometry g = rtcNewGeometry(rtc, analytic ? RTC_GEOMETRY_TYPE_USER
                                        : quads  ? RTC_GEOMETRY_TYPE_QUAD
                                                 : RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!g) return NULL;
    if (analytic) {
        rtcSetGeometryUserPrimitiveCount(g, 1);
        rtcSetGeometryUserData(g, (void *)(uintptr_t)s);
        rtcSetGeometryBoundsFunction(g, analytic_bounds, NULL);
        rtcSetGeometryIntersectFunction(g, all ? imp__gather_analytic
                                               : imp__analytic_intersect);
        rtcSetGeometryOccludedFunction(g, imp__analytic_occluded);
    } else {
        const struct imp_triangles *t = &s->triangles;
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   t->positions, 0, 3 * sizeof(float), t->n_vertices);
        if (quads)
            rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4,
                                       quads->quad, 0, sizeof *quads->quad, quads->n);
        else
            rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                       t->indices, 0, 3 * sizeof(uint32_t),
                                       t->n_triangles);
    }
    if (brief) rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_LOW);
    rtcCommitGeometry(g);
    return g;
}
