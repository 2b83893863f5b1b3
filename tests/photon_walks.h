/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of mixtures of densities and of adjoint photons: walks of a scene one by one,
 * their radiance and what they cost. */
#ifndef PHOTON_WALKS_H
#define PHOTON_WALKS_H

#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include "walk/core/walk.h"
#include "walk/core/walk_integrator.h"

struct photons {
    imp_context *ctx;
    imp_scene *scene;
    struct imp_tracer tracer;
    struct imp_arena arena;
    int width, height;
};

static inline struct photons photons_open(imp_context *ctx, imp_scene *scene,
                                          uint64_t seed)
{
    struct photons p = {.ctx = ctx, .scene = scene};
    const struct imp_sensor *sensor = scene->sensors[0];
    imp__arena_init(&p.arena, ctx);
    p.width = sensor->film.crop_w;
    p.height = sensor->film.crop_h;
    p.tracer = (struct imp_tracer){.scene = scene,
                                   .integrator = imp__walk_integrator(scene),
                                   .sensor = sensor,
                                   .seed = seed};
    return p;
}
static inline void photons_close(struct photons *p)
{
    imp__arena_free(&p->arena);
    imp_scene_destroy(p->scene);
}

/* Rays of a walk and of those that hang on it: segments, and shadow rays of light samples.
 */
static inline void photons_rays(const struct imp_walk *w, double *segments,
                                double *shadows)
{
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        *segments += v->d.goes_on;
        *shadows += v->d.connection != IMP_NOT_CONNECTED;
        for (const struct imp_side *s = v->side; s; s = s->next)
            photons_rays(&s->walk, segments, shadows);
    }
}

struct photon_mean {
    struct tap_stat L;
    double segments, shadows; /* of a walk, on average */
};

/* Walk k of the picture: its pixels in turn. It stays until the arena is rewound. */
static inline struct imp_walk photons_trace(struct photons *p, int64_t k)
{
    struct imp_walk walk;
    const int64_t pixels = (int64_t)p->width * p->height, i = k % pixels;
    imp__walk_trace(&p->tracer, &p->arena, (int)(i % p->width), (int)(i / p->width),
                    k / pixels, &walk);
    return walk;
}

/* Mean of lane 0 over n walks. */
static inline struct photon_mean photons_mean(struct photons *p, int64_t n)
{
    struct photon_mean m = {{0}, 0, 0};
    for (int64_t k = 0; k < n; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&p->arena);
        const struct imp_walk walk = photons_trace(p, k);
        m.segments += 1. / (double)n; /* the camera's ray */
        double segments = 0, shadows = 0;
        photons_rays(&walk, &segments, &shadows);
        m.segments += segments / (double)n;
        m.shadows += shadows / (double)n;
        tap_add(&m.L, walk.L[0]);
        imp__arena_rewind(&p->arena, mark);
    }
    return m;
}
static inline double photon_variance(const struct photon_mean *m)
{
    return m->L.m2 / (m->L.n - 1);
}

/* Two means of different samples. */
static inline int tap_same(const struct tap_stat *a, const struct tap_stat *b,
                           const char *what)
{
    const double se = hypot(tap_se(a), tap_se(b)), z = (a->mean - b->mean) / se;
    return tap_ok(fabs(z) <= 4.5, "%s # %.8g se %.2g, %.8g se %.2g, z %.2f", what,
                  a->mean, tap_se(a), b->mean, tap_se(b), z);
}

#endif
