/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays against the scene: the one file that includes Embree. Triangles are Embree's own
 * work, in float; analytic shapes answer through their ops, in double, and their hits
 * never pass through a float (struct query carries ray and hit past it).
 *
 * One device a process, made on first use and kept until the process ends: Embree's
 * thread library makes a thread when a device is released, or when a second one is made,
 * and ends the process if it cannot. Scenes are built in the thread that commits, the
 * same way each time; no thread of Embree's is used. */
#include "scene.h"
#include <embree3/rtcore.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Memory and errors of one commit: Embree calls back in the committing thread. */
static _Thread_local struct commit {
    int64_t bytes;
    enum RTCError error;
    char message[256];
} told;

struct intersector {
    RTCScene rtc;
    bool analytic; /* some shape answers through its ops */
    int64_t bytes;
};

static void error_keep(void *user, enum RTCError error, const char *text)
{
    (void)user;
    if (told.error != RTC_ERROR_NONE) return;
    told.error = error;
    snprintf(told.message, sizeof told.message, "%s", text ? text : "");
}

static bool bytes_count(void *user, ssize_t bytes, bool post)
{
    (void)user, (void)post;
    told.bytes += bytes;
    return true;
}

static enum imp_status device_error(imp_context *ctx, enum RTCError error,
                                    const char *text)
{
    const char *colon = *text ? ": " : "";
    if (error == RTC_ERROR_OUT_OF_MEMORY)
        return imp__error(ctx, IMP_E_NOMEM, "out of memory for Embree%s%s", colon, text);
    return imp__error(ctx, IMP_E_UNSUPPORTED, "Embree: error %d%s%s", (int)error, colon,
                      text);
}

static RTCDevice device;
static _Atomic long builder; /* process of the thread that is with Embree; 0: none */

/* One thread at a time makes the device, a scene, or releases one. Not a mutex: the process
 * may be forked while a thread is here, and then the child takes its place. */
static void build_enter(void)
{
    const long here = (long)getpid();
    for (;;) {
        long by = 0;
        if (atomic_compare_exchange_strong(&builder, &by, here)) return;
        if (by != here && atomic_compare_exchange_strong(&builder, &by, here)) return;
        nanosleep(&(struct timespec){0, 100000}, NULL);
    }
}
static void build_leave(void) { atomic_store(&builder, 0); }

/* Inside build_enter. */
static enum imp_status device_get(imp_context *ctx, RTCDevice *out)
{
    enum imp_status st = IMP_OK;
    if (!(*out = device)) {
        *out = rtcNewDevice("threads=1,ignore_config_files=1");
        if (*out) {
            rtcSetDeviceErrorFunction(*out, error_keep, NULL);
            rtcSetDeviceMemoryMonitorFunction(*out, bytes_count, NULL);
        } else {
            st = device_error(ctx, rtcGetDeviceError(NULL), "");
        }
        device = *out;
    }
    return st;
}

/* ---- analytic shapes ----------------------------------------------------------- */

/* Passed through Embree to the callbacks: ray and nearest analytic hit, in double. */
struct query {
    struct RTCIntersectContext context; /* first: callbacks get its address */
    const imp_v3 *o, *d;
    double tmin, tmax;
    struct imp_hit hit; /* hit.shape -1: none yet */
};

static void analytic_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    struct RTCBounds *b = args->bounds_o;
    b->lower_x = nextafterf((float)s->lo[0], -INFINITY);
    b->lower_y = nextafterf((float)s->lo[1], -INFINITY);
    b->lower_z = nextafterf((float)s->lo[2], -INFINITY);
    b->upper_x = nextafterf((float)s->hi[0], INFINITY);
    b->upper_y = nextafterf((float)s->hi[1], INFINITY);
    b->upper_z = nextafterf((float)s->hi[2], INFINITY);
}

static void analytic_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    struct query *q = (struct query *)args->context;
    struct RTCRayHit *r = (struct RTCRayHit *)args->rayhit; /* N is 1 for rtcIntersect1 */
    struct imp_hit hit;
    if (!args->valid[0]) return;
    const double tmax = fmin(r->ray.tfar, q->tmax);
    if (!s->ops->intersect(s, q->o, q->d, q->tmin, tmax, &hit)) return;
    hit.shape = s->index;
    q->hit = hit;
    q->tmax = hit.t;
    r->ray.tfar = (float)hit.t;
    r->hit.geomID = args->geomID;
    r->hit.primID = (unsigned)hit.prim;
    r->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

static void analytic_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    const struct query *q = (const struct query *)args->context;
    struct imp_hit hit;
    if (!args->valid[0]) return;
    if (s->ops->intersect(s, q->o, q->d, q->tmin, q->tmax, &hit))
        ((struct RTCRay *)args->ray)->tfar = -INFINITY;
}

/* ---- all hits ------------------------------------------------------------------ */

/* Those of a ray with aims, nearest first, as many as there is room for. */
struct gather {
    struct RTCIntersectContext context; /* first */
    const imp_v3 *o, *d;
    double tmin;
    const struct imp_hit *last; /* those up to this one are known; NULL: none are */
    struct imp_hit *hit;        /* [max] */
    int n, max;
};

static bool later(const struct imp_hit *a, const struct imp_hit *b)
{
    if (a->t != b->t) return a->t > b->t;
    return a->shape != b->shape ? a->shape > b->shape : a->prim > b->prim;
}

static void gather_add(struct gather *g, const struct imp_hit *hit)
{
    if (g->last && !later(hit, g->last)) return;
    if (g->n == g->max && !later(&g->hit[g->n - 1], hit)) return;
    int k = g->n < g->max ? g->n++ : g->n - 1;
    for (; k > 0 && later(&g->hit[k - 1], hit); k--) g->hit[k] = g->hit[k - 1];
    g->hit[k] = *hit;
}

static void gather_analytic(const struct RTCIntersectFunctionNArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    struct gather *g = (struct gather *)args->context;
    struct imp_hit hit = {.t = g->tmin};
    if (!args->valid[0]) return;
    while (s->ops->intersect(s, g->o, g->d, hit.t, INFINITY, &hit)) {
        hit.shape = (int)args->geomID;
        gather_add(g, &hit);
        if (s->ops->flags & IMP_SHAPE_NEAREST) break;
    }
}

/* Of triangles: the hit is kept, and refused, so that the ray goes on. */
static void gather_triangle(const struct RTCFilterFunctionNArguments *args)
{
    struct gather *g = (struct gather *)args->context;
    if (!args->valid[0]) return;
    /* N is 1 for rtcIntersect1 */
    const struct RTCHit *h = (const struct RTCHit *)args->hit;
    const struct RTCRay *r = (const struct RTCRay *)args->ray;
    const struct imp_hit hit = {.shape = (int)h->geomID,
                                .prim = (int)h->primID,
                                .t = (double)r->tfar,
                                .u = (double)h->u,
                                .v = (double)h->v};
    gather_add(g, &hit);
    args->valid[0] = 0;
}

/* ---- building ------------------------------------------------------------------ */

/* all: its geometries are asked for all hits of a ray, not for the nearest. */
static RTCGeometry geometry_create(RTCDevice rtc, const struct imp_shape *s, bool all)
{
    const bool analytic = s->geometry == IMP_ANALYTIC;
    RTCGeometry g = rtcNewGeometry(rtc, analytic ? RTC_GEOMETRY_TYPE_USER
                                                 : RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!g) return NULL;
    if (analytic) {
        rtcSetGeometryUserPrimitiveCount(g, 1);
        rtcSetGeometryUserData(g, (void *)(uintptr_t)s);
        rtcSetGeometryBoundsFunction(g, analytic_bounds, NULL);
        rtcSetGeometryIntersectFunction(g, all ? gather_analytic : analytic_intersect);
        rtcSetGeometryOccludedFunction(g, analytic_occluded);
    } else {
        const struct imp_triangles *t = &s->triangles;
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   t->positions, 0, 3 * sizeof(float), t->n_vertices);
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   t->indices, 0, 3 * sizeof(uint32_t), t->n_triangles);
    }
    rtcCommitGeometry(g);
    return g;
}

/* Does light travel on the inner side of the mesh: in a room, a body of glass, a medium?
 * Of 10^8 rays in closed rooms and through bodies, 22 slip between two triangles without
 * Embree's robust flag, 20 of them in rooms of 20,480 triangles; 1 slips with the flag
 * everywhere, and 1 by this rule (tests/stat/leaks.c long). A ray that slips into an
 * opaque body is lost to the picture as if it were black there.
 * Rays without the flag take three quarters of the instructions. */
#define FEW 64
static bool is_boundary(const struct imp_scene *scene, const struct imp_shape *s)
{
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    if (s->geometry != IMP_TRIANGLES || s->triangles.n_triangles <= FEW) return false;
    if (s->body || s->interior || s->exterior ||
        (b->flags & (IMP_BSDF_TRANSMIT | IMP_BSDF_NULL)))
        return true;
    if (b->n_child > 0) return true; /* two-sided */
    const imp_v3 size = s->hi - s->lo;
    return s->triangles.volume < -0.05 * (size[0] * size[1] * size[2]);
}

/* Of n shapes, the scene's (aims NULL) or the aims'. */
static enum imp_status intersector_make(struct imp_scene *scene,
                                        const struct imp_aims *aims, int n, void **out)
{
    enum imp_status st = IMP_OK;
    RTCDevice rtc;

    build_enter();
    IMP_TRY(device_get(scene->ctx, &rtc));
    struct intersector *x = imp__alloc(scene->ctx, 1, sizeof *x);
    if (!x)
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "out of memory for the intersector"));

    told = (struct commit){.error = RTC_ERROR_NONE};
    x->rtc = rtcNewScene(rtc);
    bool robust = aims != NULL;
    for (int i = 0; !aims && i < n; i++) robust |= is_boundary(scene, scene->shapes[i]);
    if (x->rtc)
        rtcSetSceneFlags(x->rtc, (robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE) |
                                     (aims ? RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION : 0));
    for (int i = 0; x->rtc && i < n && told.error == RTC_ERROR_NONE; i++) {
        const struct imp_shape *s = aims ? aims->list[i].shape : scene->shapes[i];
        RTCGeometry g = geometry_create(rtc, s, aims != NULL);
        if (!g) break;
        rtcAttachGeometryByID(x->rtc, g, (unsigned)i);
        rtcReleaseGeometry(g); /* the scene holds it now */
        x->analytic |= s->geometry == IMP_ANALYTIC;
    }
    if (x->rtc && told.error == RTC_ERROR_NONE) rtcCommitScene(x->rtc);
    const enum RTCError error =
        !x->rtc && told.error == RTC_ERROR_NONE ? RTC_ERROR_UNKNOWN : told.error;
    x->bytes = told.bytes;
    if (error != RTC_ERROR_NONE) {
        if (x->rtc) rtcReleaseScene(x->rtc);
        imp__release(scene->ctx, x);
        IMP_TRY(device_error(scene->ctx, error, told.message));
    }
    *out = x;
out:
    build_leave();
    return st;
}

enum imp_status imp__intersector_create(struct imp_scene *scene)
{
    return intersector_make(scene, NULL, scene->n_shapes, &scene->intersector);
}
enum imp_status imp__aims_commit(struct imp_scene *scene)
{
    struct imp_aims *t = &scene->aims;
    return intersector_make(scene, t, t->n, &t->intersector);
}

static void intersector_release(struct imp_scene *scene, void **intersector)
{
    struct intersector *x = *intersector;
    if (!x) return;
    build_enter();
    rtcReleaseScene(x->rtc);
    build_leave();
    imp__release(scene->ctx, x);
    *intersector = NULL;
}
void imp__intersector_destroy(struct imp_scene *scene)
{
    intersector_release(scene, &scene->intersector);
    intersector_release(scene, &scene->aims.intersector);
}

static size_t bytes_of(const struct intersector *x)
{
    return x && x->bytes > 0 ? (size_t)x->bytes : 0;
}
size_t imp__intersector_bytes(const struct imp_scene *scene)
{
    return bytes_of(scene->intersector) + bytes_of(scene->aims.intersector);
}

/* ---- queries ------------------------------------------------------------------- */

/* Rays that are not within Embree's numbers hit nothing. */
static inline bool ray_valid(const imp_v3 *o, const imp_v3 *d, double tmin, double tmax)
{
    const double size =
        ((fabs((*o)[0]) + fabs((*o)[1])) + (fabs((*o)[2]) + fabs((*d)[0]))) +
        (fabs((*d)[1]) + fabs((*d)[2]));
    return size < IMP_REACH_MAX && tmin >= 0 && tmin < tmax;
}

/* Embree reads (org, tnear) and (dir, time) as 16 bytes each. Written as single floats
 * they could not be forwarded from the store buffer, which costs 10 ns a ray. */
static inline void ray_fill(struct RTCRay *r, const imp_v3 *o, const imp_v3 *d,
                            double tmin, double tmax)
{
    imp_float4 org = imp__narrow(*o), dir = imp__narrow(*d);
    org[3] = (float)tmin;
    dir[3] = 0;
    memcpy(&r->org_x, &org, sizeof org);
    memcpy(&r->dir_x, &dir, sizeof dir);
    r->tfar = (float)tmax;
    r->mask = ~0u;
    r->id = 0;
    r->flags = 0;
}

static inline void query_fill(struct query *q, const struct intersector *x,
                              const imp_v3 *o, const imp_v3 *d, double tmin, double tmax)
{
    rtcInitIntersectContext(&q->context);
    q->hit.shape = -1;
    if (!x->analytic) return;
    q->o = o;
    q->d = d;
    q->tmin = tmin;
    q->tmax = tmax;
}

bool imp__intersect(const struct imp_scene *scene, const imp_v3 *o, const imp_v3 *d,
                    double tmin, double tmax, struct imp_hit *hit)
{
    const struct intersector *x = scene->intersector;
    struct query q;
    struct RTCRayHit r;
    if (imp_unlikely(!ray_valid(o, d, tmin, tmax))) return false;
    query_fill(&q, x, o, d, tmin, tmax);
    ray_fill(&r.ray, o, d, tmin, tmax);
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(x->rtc, &q.context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    if (q.hit.shape == (int)r.hit.geomID) {
        *hit = q.hit;
        return true;
    }
    hit->shape = (int)r.hit.geomID;
    hit->prim = (int)r.hit.primID;
    hit->t = r.ray.tfar;
    hit->u = r.hit.u;
    hit->v = r.hit.v;
    return true;
}

bool imp__occluded(const struct imp_scene *scene, const imp_v3 *o, const imp_v3 *d,
                   double tmin, double tmax)
{
    const struct intersector *x = scene->intersector;
    struct query q;
    struct RTCRay r;
    if (imp_unlikely(!ray_valid(o, d, tmin, tmax))) return false;
    query_fill(&q, x, o, d, tmin, tmax);
    ray_fill(&r, o, d, tmin, tmax);
    rtcOccluded1(x->rtc, &q.context, &r);
    return r.tfar < 0;
}

int imp__aims_hit(const struct imp_aims *t, const imp_v3 *o, const imp_v3 *d, double tmin,
                  const struct imp_hit *last, int max, struct imp_hit *hit)
{
    const struct intersector *x = t->intersector;
    const struct imp_hit from = last ? *last : (struct imp_hit){.shape = -1};
    struct gather g = {.o = o,
                       .d = d,
                       .tmin = tmin,
                       .last = last ? &from : NULL,
                       .hit = hit,
                       .max = max};
    struct RTCRayHit r;
    if (imp_unlikely(!x || !ray_valid(o, d, tmin, INFINITY))) return 0;
    rtcInitIntersectContext(&g.context);
    g.context.filter = gather_triangle;
    ray_fill(&r.ray, o, d, tmin, INFINITY);
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(x->rtc, &g.context, &r);
    return g.n;
}
