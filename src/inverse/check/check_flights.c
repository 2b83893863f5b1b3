/* SPDX-License-Identifier: Apache-2.0
 *
 * Distances drawn in media, and transmittances estimated on the way to light samples, against
 * exp of minus the extinction's integral along the ray, by quadrature of what the medium is at
 * points of it.
 *
 * flights: does a flight pass a distance? Three of them; and the weights by which the lanes
 * are combined, of flights that collide and of those that do not. passes: the estimate of
 * the transmittance, in each lane. Rays begin at the scene's own vertices in the medium, or
 * where it has none at points of its box. */
#include "check_sources.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene/instances.h"
#include "scene/majorants.h"
#include "walk/media/flight.h"
#include <math.h>

#define RAYS   64
#define POINTS 4096 /* of a quadrature */
#define DEEP   1.5  /* optical depth at which rays end */
#define PLACES 3    /* distances of a ray that flights may pass */
#define SLACK  1e-3 /* of the quadrature */
enum { WHOLE, PASSED, WEIGHT = PASSED + PLACES, COLLIDED, LANES };

struct ray {
    const struct imp__place *place; /* whose walk flies */
    imp_v3 o, d;
    double t[PLACES];
    imp_spec depth[PLACES];
};
struct flights {
    const struct imp__places *places;
    const struct imp_medium *medium;
    int n;
    struct ray ray[RAYS];
};

/* ---- Rays ---------------------------------------------------------------------------- */

static imp_spec sigma_at(const struct flights *f, const struct ray *r, double t)
{
    imp_spec in[IMP_INPUTS_MAX];
    return imp__extinction_at(f->medium, r->o + r->d * t, r->place->v->carried, in);
}
/* Optical depth up to t. */
static imp_spec depth_to(const struct flights *f, const struct ray *r, double t)
{
    const int n = f->medium->majorants ? POINTS : 1;
    imp_spec sum = {0};
    for (int k = 0; k < n; k++) sum += sigma_at(f, r, t * ((k + 0.5) / n));
    return sum * (t / n);
}

/* Where the ray leaves the box, or the region that is one cube of the scene's size. */
static double leaves(const struct imp_scene *scene, const struct imp_medium *m, imp_v3 o,
                     imp_v3 d)
{
    double t = 2 * scene->ball.radius;
    if (!m->majorants) return t;
    const imp_v3 a = imp__point(&m->majorants->to_unit, o),
                 b = imp__vector(&m->majorants->to_unit, d);
    for (int k = 0; k < 3; k++)
        if (b[k] != 0) t = fmin(t, ((b[k] > 0 ? 1 : 0) - a[k]) / b[k]);
    return fmax(t, 0);
}

/* From vertex k, or from a point of the box. False: nothing of the medium is there. */
static bool ray_make(const struct flights *f, const struct imp__place *x, bool inside,
                     uint64_t k, struct ray *r)
{
    const struct imp_scene *scene = f->places->tracer.scene;
    const struct imp_medium *m = f->medium;
    const struct imp_key key = imp__key(0xf119, k, (uint64_t)m->index);
    *r = (struct ray){.place = x, .o = x->at.p};
    r->d = imp__uniform_sphere((double[2]){imp__u01(key, 0), imp__u01(key, 1)});
    if (!inside && m->majorants)
        r->o = imp__point(&m->majorants->to_world,
                          (imp_v3){imp__u01(key, 2), imp__u01(key, 3), imp__u01(key, 4)});
    /* As a walk would have them. */
    for (int a = 0; a < 3; a++) r->o[a] = (float)r->o[a], r->d[a] = (float)r->d[a];
    double far = leaves(scene, m, r->o, r->d);
    struct imp_hit hit;
    if (inside && imp__intersect_at(scene, x->walk.time, &r->o, &r->d, 0, far, &hit))
        far = hit.t;
    if (!(far > 0)) return false;
    const double most = imp__max_used(depth_to(f, r, far), true);
    if (most > DEEP) { /* bisection: the depth grows with the distance */
        double lo = 0, hi = far;
        for (int i = 0; i < 20; i++) {
            const double mid = 0.5 * (lo + hi);
            *(imp__max_used(depth_to(f, r, mid), true) > DEEP ? &hi : &lo) = mid;
        }
        far = hi;
    }
    for (int i = 0; i < PLACES; i++) {
        r->t[i] = far * (i + 1) / PLACES;
        r->depth[i] = depth_to(f, r, r->t[i]);
    }
    return imp__max_used(r->depth[PLACES - 1], true) > 1e-3;
}

/* ---- Pairs ---------------------------------------------------------------------------- */

/* The walk that flies, with numbers of its own and any of its lanes. */
struct flier {
    struct imp_step s;
    struct imp_walk walk;
    struct imp_waves waves;
    imp_spec scratch[IMP_INPUTS_MAX];
};
static void fly_begin(const struct flights *f, const struct ray *r, struct imp_key key,
                      struct flier *x)
{
    imp__place_step(f->places, r->place, &x->walk, x->scratch, &x->s);
    x->walk.key = key;
    x->walk.point = (struct imp_point){0};
    if (!x->walk.waves) return;
    x->waves = *x->walk.waves;
    x->waves.drew = imp__lane_drawn(key, x->waves.carried.n);
    x->walk.waves = &x->waves;
    x->s.at.carried = &x->waves.carried;
}
static imp_spec passes_of(imp_spec depth)
{
    return (imp_spec){exp(-depth[0]), exp(-depth[1]), exp(-depth[2]), exp(-depth[3])};
}

static void flight_pair(const void *payload, uint64_t seed, int64_t i,
                        struct imp__pair *p)
{
    const struct flights *f = payload;
    const struct ray *r = &f->ray[i % f->n];
    struct flier x;
    double t, mean = 0;
    fly_begin(f, r, imp__key(seed, 0xf1, (uint64_t)i), &x);
    struct imp_free_flight w = imp__flight_from(&x.s, r->o, r->d, IMP_FLIGHT_ALONG);
    const bool hit = imp__fly(&w, f->medium, 0, r->t[PLACES - 1], true, &t);
    if (x.walk.dropped) return;
    const int lanes = imp__lane_mis_count(&x.s), drew = imp__lane_mis_drew(&x.s),
              lane = (int)((i / f->n) % lanes);
    for (int k = 0; k < PLACES; k++)
        imp__pair_add(p, PASSED + k, !hit || t > r->t[k], exp(-r->depth[k][drew]));
    const double T = exp(-r->depth[PLACES - 1][lane]);
    imp__pair_add(p, WHOLE, hit, 1 - exp(-r->depth[PLACES - 1][drew]));
    for (int k = 0; k < lanes; k++) mean += w.p[k] / lanes;
    const double weight = w.f[lane] / mean;
    imp__pair_add(p, WEIGHT, hit ? 0 : weight, T);
    imp__pair_add(p, COLLIDED, hit ? weight : 0, 1 - T);
}

static void pass_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct flights *f = payload;
    const struct ray *r = &f->ray[i % f->n];
    struct flier x;
    double t;
    fly_begin(f, r, imp__key(seed, 0xf2, (uint64_t)i), &x);
    struct imp_free_flight w = imp__flight_from(&x.s, r->o, r->d, IMP_FLIGHT_TO_LIGHT);
    imp__fly(&w, f->medium, 0, r->t[PLACES - 1], false, &t);
    if (x.walk.dropped || !imp__flight_end(&w)) return;
    const int lanes = imp__lane_mis_count(&x.s), lane = (int)((i / f->n) % lanes);
    const imp_spec T = passes_of(r->depth[PLACES - 1]);
    imp__pair_add(p, WHOLE, w.f[lane], T[lane]);
    imp__pair_add(p, LANES + lane, w.f[lane], T[lane]);
}

/* ---- Rows ------------------------------------------------------------------------------ */

enum imp_status imp__check_flights(struct imp__draw_list *l,
                                   const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = places->tracer.scene;
    if (!places->tracer.integrator->media || scene->n_bodies > 0 || places->n_all == 0)
        return IMP_OK;
    if (!imp__check_wants(l->check, "flights") && !imp__check_wants(l->check, "passes"))
        return IMP_OK;
    for (int k = 0; k < scene->n_media; k++) {
        const struct imp__place_kind *kind = &places->kind[scene->n_bsdfs + k];
        struct flights *f = imp__arena_array(&l->arena, 1, sizeof *f);
        if (!f) IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
        *f = (struct flights){.places = places, .medium = scene->media[k]};
        for (uint64_t i = 0; i < 4 * RAYS && f->n < RAYS; i++) {
            /* Half of the rays where a walk has been, the others anywhere. */
            const bool inside = kind->n > 0 && (i % 2 == 0 || !f->medium->majorants);
            const struct imp__place *x = inside
                                             ? &kind->place[i / 2 % (uint64_t)kind->n]
                                             : places->all[i % (uint64_t)places->n_all];
            if (!x->located) continue;
            f->n += ray_make(f, x, inside, i, &f->ray[f->n]);
        }
        if (f->n == 0) continue;
        IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "flights",
                                                         .name = f->medium->name,
                                                         .pair = flight_pair,
                                                         .payload = f,
                                                         .slack = SLACK}));
        if (!places->tracer.integrator->lights) continue;
        IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "passes",
                                                         .name = f->medium->name,
                                                         .pair = pass_pair,
                                                         .payload = f,
                                                         .slack = SLACK}));
    }
out:
    return st;
}
