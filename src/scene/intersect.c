/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays against the scene. Triangles are Embree's own work, in float, where there are more than
 * a few (facets.h); where a pair of them is met is computed again, in double (tree_quads.h). Analytic
 * shapes are met through their ops, in double, and their hits never pass through a float (where
 * Embree has them in its tree, struct query carries ray and hit past it). Instances are shapes of
 * this kind, too: each takes the ray to its group, in double, and intersects the group's own scene
 * of Embree. So they can be nested and move, and one costs 232 bytes and 63 in Embree's tree (of
 * 200,000); Embree's own instances cost 375 to 400, and those of Debian cannot be nested. */
#include "instances.h"
#include "intersector.h"
#include <string.h>

/* ---- analytic shapes ----------------------------------------------------------- */

/* Passed through Embree to the callbacks: ray and nearest analytic hit, in double. */
struct query {
    struct RTCIntersectContext context; /* first: callbacks get its address */
    const imp_v3 *o, *d;
    double tmin, tmax, time;
    struct imp_hit hit; /* if `geometry` is one */
    unsigned geometry;  /* that the hit is of */
};

/* far: up to where triangles are met before it. */
static void query_hit(struct query *q, const struct imp_hit *hit, float far,
                      const struct RTCIntersectFunctionNArguments *args)
{
    struct RTCRayHit *r = (struct RTCRayHit *)args->rayhit; /* N is 1 for rtcIntersect1 */
    q->hit = *hit;
    q->geometry = args->geomID;
    q->tmax = hit->t;
    r->ray.tfar = far;
    r->hit.geomID = args->geomID;
    r->hit.primID = args->primID;
    r->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

void imp__analytic_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    struct query *q = (struct query *)args->context;
    const struct RTCRayHit *r = (const struct RTCRayHit *)args->rayhit;
    struct imp_hit hit;
    if (!args->valid[0]) return;
    if (!s->ops->intersect(s, q->o, q->d, q->tmin, q->tmax, &hit)) return;
    const float far = imp__triangle_far(q->o, q->d, hit.t);
    /* Where the nearest is a triangle's. */
    if (r->hit.geomID != q->geometry && r->ray.tfar <= far) return;
    hit.shape = s->index;
    hit.place = 0;
    query_hit(q, &hit, far, args);
}

void imp__analytic_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    const struct imp_shape *s = args->geometryUserPtr;
    const struct query *q = (const struct query *)args->context;
    struct imp_hit hit;
    if (!args->valid[0]) return;
    if (s->ops->intersect(s, q->o, q->d, q->tmin, q->tmax, &hit))
        ((struct RTCRay *)args->ray)->tfar = -INFINITY;
}

/* A tube is met from outside alone, as in Mitsuba: what goes on inside is for its material.
 * Embree may be built to do this itself; Debian's is not. */
void imp__curve_filter(const struct RTCFilterFunctionNArguments *args)
{
    /* N is 1 for rtcIntersect1 and rtcOccluded1 */
    const struct RTCRay *r = (const struct RTCRay *)args->ray;
    const struct RTCHit *h = (const struct RTCHit *)args->hit;
    const float c = h->Ng_x * r->dir_x + h->Ng_y * r->dir_y + h->Ng_z * r->dir_z;
    if (args->valid[0] && !(c < 0)) args->valid[0] = 0;
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

void imp__gather_analytic(const struct RTCIntersectFunctionNArguments *args)
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

/* Filter of triangles: the hit is kept, and refused, so that the ray goes on. */
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

/* ---- queries ------------------------------------------------------------------- */

/* Embree reads (org, tnear) and (dir, time) as 16 bytes each. Written as single floats
 * they could not be forwarded from the store buffer, which costs 10 ns a ray. */
static inline void ray_fill(struct RTCRay *r, const imp_v3 *o, const imp_v3 *d,
                            double tmin, float tmax)
{
    imp_float4 org = imp__narrow(*o), dir = imp__narrow(*d);
    org[3] = (float)tmin;
    dir[3] = 0;
    memcpy(&r->org_x, &org, sizeof org);
    memcpy(&r->dir_x, &dir, sizeof dir);
    r->tfar = tmax;
    r->mask = ~0u;
    r->id = 0;
    r->flags = 0;
}

static inline void query_fill(struct query *q, const struct imp_intersector *x,
                              double time, const imp_v3 *o, const imp_v3 *d, double tmin,
                              double tmax)
{
    rtcInitIntersectContext(&q->context);
    q->geometry = RTC_INVALID_GEOMETRY_ID;
    if (!x->calls_back) return;
    q->o = o;
    q->d = d;
    q->tmin = tmin;
    q->tmax = tmax;
    q->time = time;
}

static inline __attribute__((always_inline)) bool
nearest(const struct imp_intersector *x, double time, const imp_v3 *o, const imp_v3 *d,
        double tmin, double tmax, struct imp_hit *hit)
{
    struct query q;
    struct RTCRayHit r;
    if (imp_unlikely(!imp__ray_valid(o, d, tmin, tmax))) return false;
    bool met = imp__shape_balls_nearest(&x->balls, o, d, tmin, &tmax, hit);
    float far = met ? imp__triangle_far(o, d, tmax) : (float)tmax;
    if (x->facets &&
        imp__facets_nearest(x->facets, o, d, tmin, met ? (double)far : tmax, hit)) {
        met = true;
        tmax = hit->t;
        far = (float)tmax;
    }
    if (!x->holds) return met;
    query_fill(&q, x, time, o, d, tmin, tmax);
    ray_fill(&r.ray, o, d, tmin, far);
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(x->rtc, &q.context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return met;
    if (q.geometry == r.hit.geomID) {
        *hit = q.hit;
        return true;
    }
    imp__mesh_hit(x, *o, *d, tmin, r.hit.geomID, r.hit.primID, r.ray.tfar, r.hit.u,
                  r.hit.v, hit);
    return true;
}

static inline __attribute__((always_inline)) bool
anything(const struct imp_intersector *x, double time, const imp_v3 *o, const imp_v3 *d,
         double tmin, double tmax)
{
    struct query q;
    struct RTCRay r;
    if (imp_unlikely(!imp__ray_valid(o, d, tmin, tmax))) return false;
    if (imp__shape_balls_occluded(&x->balls, o, d, tmin, tmax)) return true;
    if (x->facets && imp__facets_occluded(x->facets, o, d, tmin, tmax)) return true;
    if (!x->holds) return false;
    query_fill(&q, x, time, o, d, tmin, tmax);
    ray_fill(&r, o, d, tmin, (float)tmax);
    rtcOccluded1(x->rtc, &q.context, &r);
    return r.tfar < 0;
}

bool imp__intersect_at(const struct imp_scene *scene, double time, const imp_v3 *o,
                       const imp_v3 *d, double tmin, double tmax, struct imp_hit *hit)
{
    if (!nearest(scene->intersector, time, o, d, tmin, tmax, hit)) return false;
    hit->time = time;
    if (imp_unlikely(hit->place > 0) && (scene->n_covered > 0 || scene->raised))
        hit->shape = imp__placed_shape(scene, hit->shape, hit->place);
    return true;
}

bool imp__occluded_at(const struct imp_scene *scene, double time, const imp_v3 *o,
                      const imp_v3 *d, double tmin, double tmax)
{
    return anything(scene->intersector, time, o, d, tmin, tmax);
}

/* ---- instances ------------------------------------------------------------------ */

/* The ray in the group of an instance. Its direction is not a unit vector there, so that
 * distances along it stay what they are. */
static const struct imp_intersector *
ray_enter(const struct imp_instance *p, const struct query *q, imp_v3 *o, imp_v3 *d)
{
    struct imp_map room[2];
    const struct imp_map *to_local = imp__instance_local(p, q->time, room);
    *o = imp__map_point(to_local, *q->o);
    *d = imp__map_vector(to_local, *q->d);
    return p->group->intersector;
}

void imp__instance_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    const struct imp_group *g = args->geometryUserPtr;
    const struct imp_instance *p = &g->instance[args->primID];
    struct query *q = (struct query *)args->context;
    const struct RTCRayHit *r = (const struct RTCRayHit *)args->rayhit;
    struct imp_hit hit;
    imp_v3 o, d;
    if (!args->valid[0]) return;
    const struct imp_intersector *x = ray_enter(p, q, &o, &d);
    const double tmax = imp_min((double)r->ray.tfar, q->tmax);
    if (!nearest(x, q->time, &o, &d, q->tmin, tmax, &hit)) return;
    hit.place += p->before + 1;
    float far = (float)hit.t; /* not beyond it */
    if (far > hit.t) far = nextafterf(far, 0);
    query_hit(q, &hit, far, args);
}

void imp__instance_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    const struct imp_group *g = args->geometryUserPtr;
    const struct imp_instance *p = &g->instance[args->primID];
    const struct query *q = (const struct query *)args->context;
    imp_v3 o, d;
    if (!args->valid[0]) return;
    const struct imp_intersector *x = ray_enter(p, q, &o, &d);
    if (anything(x, q->time, &o, &d, q->tmin, q->tmax))
        ((struct RTCRay *)args->ray)->tfar = -INFINITY;
}

/* ---- aims ---------------------------------------------------------------------- */

int imp__aims_hit(const struct imp_aims *t, const imp_v3 *o, const imp_v3 *d, double tmin,
                  const struct imp_hit *last, int max, struct imp_hit *hit)
{
    const struct imp_intersector *x = t->intersector;
    const struct imp_hit from = last ? *last : (struct imp_hit){.shape = -1};
    struct gather g = {.o = o,
                       .d = d,
                       .tmin = tmin,
                       .last = last ? &from : NULL,
                       .hit = hit,
                       .max = max};
    struct RTCRayHit r;
    if (imp_unlikely(!x || !imp__ray_valid(o, d, tmin, INFINITY))) return 0;
    rtcInitIntersectContext(&g.context);
    g.context.filter = gather_triangle;
    ray_fill(&r.ray, o, d, tmin, INFINITY);
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(x->rtc, &g.context, &r);
    return g.n;
}
