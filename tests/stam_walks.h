/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of Stam's system: the walks of a scene, the gradient the library drops from
 * one, and this test's own value of the same walk in dual numbers. The record supplies
 * where the walk went, its cosines and the densities it was drawn with; values,
 * derivatives and the densities once more are made here, from formulas of their own. */
#ifndef STAM_WALKS_H
#define STAM_WALKS_H

#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/core/dims.h"
#include "walk/core/vertex.h"
#include <stdbool.h>

/* theta_1 .. theta_7 of the paper, from 0. */
enum { EMISSION, AMBIENT2, DIFFUSE2, SPECULAR, EXPONENT, AMBIENT3, DIFFUSE3, N_CONTROLS };
static const char *const control_name[N_CONTROLS] = {
    "light.emission.value",  "sphere.ambient.value",  "sphere.diffuse.value",
    "sphere.specular.value", "sphere.exponent.value", "walls.ambient.value",
    "walls.diffuse.value"};

struct stam {
    imp_context *ctx;
    imp_scene *scene;
    uint8_t *chosen; /* [n_params] all */
    struct imp_active active;
    struct imp_tracer tracer;
    struct imp_arena arena;
    int width, height;
    double absorb;          /* of all its materials */
    int64_t at[N_CONTROLS]; /* in x; -1: this scene has no such parameter */
    double theta[N_CONTROLS];
};

static inline struct stam stam_walks(imp_context *ctx, imp_scene *scene, uint64_t seed)
{
    struct stam s = {.ctx = ctx, .scene = scene};
    const size_t n = imp_scene_n_params(scene);
    s.chosen = malloc(n);
    memset(s.chosen, 1, n);
    test_must(ctx, imp__active_create(scene, s.chosen, &s.active));
    imp__arena_init(&s.arena, ctx);
    for (int k = 0; k < N_CONTROLS; k++) {
        size_t index;
        s.at[k] = -1;
        if (imp_scene_find_param(scene, control_name[k], &index) != IMP_OK) continue;
        s.at[k] = s.active.base[index];
        test_must(ctx, imp_scene_get_values(scene, index, &s.theta[k]));
    }
    const struct imp_sensor *sensor = scene->sensors[0];
    s.absorb = scene->bsdfs[0]->absorb;
    s.width = sensor->film.crop_w;
    s.height = sensor->film.crop_h;
    s.tracer = (struct imp_tracer){.scene = scene,
                                   .integrator = imp__walk_integrator(scene),
                                   .sensor = sensor,
                                   .seed = seed};
    return s;
}

/* The tracer points into *s, which must not move after this. */
static inline struct imp_walk stam_trace(struct stam *s, int x, int y, int64_t sample)
{
    struct imp_walk walk;
    s->tracer.active = &s->active;
    imp__walk_trace(&s->tracer, &s->arena, x, y, sample, &walk);
    return walk;
}

static inline void stam_close(struct stam *s)
{
    imp__arena_free(&s->arena);
    imp__active_destroy(s->ctx, &s->active);
    free(s->chosen);
    imp_scene_destroy(s->scene);
}

/* ---- The library's gradient of one walk ---------------------------------------- */

struct stam_sink {
    struct imp_sink sink; /* first */
    const struct stam *s;
    double *g; /* [N_CONTROLS] */
};

static inline void stam_sink_add(struct imp_sink *sink, int param, size_t element,
                                 int channels, const imp_spec *bar)
{
    struct stam_sink *to = (struct stam_sink *)sink;
    (void)element, (void)channels;
    for (int k = 0; k < N_CONTROLS; k++)
        if (to->s->at[k] >= 0 && to->s->at[k] == to->s->active.base[param])
            to->g[k] += (*bar)[0];
}

static inline void stam_gradient(const struct stam *s, const struct imp_walk *walk,
                                 double adjoint, double g[N_CONTROLS])
{
    struct stam_sink to = {{.add = stam_sink_add}, s, g};
    memset(g, 0, N_CONTROLS * sizeof *g);
    imp__walk_sweep(&s->tracer, walk, (imp_spec){adjoint}, &to.sink);
}

/* ---- This test's own value ----------------------------------------------------- */

enum stam_variant { STAM_RECIPROCAL, STAM_MICROFACET, STAM_PAPER };
enum stam_sampling { STAM_MIXTURE, STAM_COSINE, STAM_PHONG };

struct dual {
    double v, d[N_CONTROLS];
};

static inline struct dual dual_of(double v) { return (struct dual){.v = v}; }
static inline struct dual dual_control(const double *theta, int k)
{
    struct dual x = {.v = theta[k]};
    x.d[k] = 1;
    return x;
}
static inline struct dual dual_add(struct dual a, struct dual b)
{
    a.v += b.v;
    for (int k = 0; k < N_CONTROLS; k++) a.d[k] += b.d[k];
    return a;
}
static inline struct dual dual_mul(struct dual a, struct dual b)
{
    struct dual c = {.v = a.v * b.v};
    for (int k = 0; k < N_CONTROLS; k++) c.d[k] = a.d[k] * b.v + a.v * b.d[k];
    return c;
}
static inline struct dual dual_scale(struct dual a, double s)
{
    return dual_mul(a, dual_of(s));
}
static inline struct dual dual_exp(struct dual a)
{
    struct dual e = {.v = exp(a.v)};
    for (int k = 0; k < N_CONTROLS; k++) e.d[k] = e.v * a.d[k];
    return e;
}

struct stam_half {
    double c, sin, mo;
};
static inline struct stam_half stam_half(const struct imp_dirs *d)
{
    const double x = d->wi[0] + d->wo[0], y = d->wi[1] + d->wo[1],
                 z = d->wi[2] + d->wo[2];
    const double length = sqrt(x * x + y * y + z * z);
    const double along = x * d->wo[0] + y * d->wo[1] + z * d->wo[2];
    return (struct stam_half){z / length, sqrt(x * x + y * y) / length, along / length};
}

/* M2's f cos(theta_i): theta_3 cos/pi + theta_4 (a + 2)/(8 pi mo) exp((a + 1) ln cos_m)
 * V. */
static inline struct dual stam_m2(const struct imp_dirs *d, enum stam_variant variant,
                                  const double *theta)
{
    const struct stam_half h = stam_half(d);
    const double V = variant == STAM_PAPER        ? h.sin
                     : variant == STAM_MICROFACET ? 1
                     : d->wi[2] < d->wo[2]        ? d->wi[2] / d->wo[2]
                                                  : 1;
    const struct dual alpha = dual_control(theta, EXPONENT);
    const struct dual power = dual_exp(dual_scale(dual_add(alpha, dual_of(1)), log(h.c)));
    const struct dual lobe = dual_mul(dual_add(alpha, dual_of(2)), power);
    return dual_add(
        dual_scale(dual_control(theta, DIFFUSE2), d->wi[2] / M_PI),
        dual_scale(dual_mul(dual_control(theta, SPECULAR), lobe), V / (8 * M_PI * h.mo)));
}

/* Density of M2's draws per steradian. */
static inline double stam_m2_pdf(const struct imp_dirs *d, enum stam_sampling sampling,
                                 double alpha)
{
    const struct stam_half h = stam_half(d);
    const double q = sampling == STAM_MIXTURE ? .5 : sampling == STAM_COSINE ? 1 : 0;
    return q * d->wi[2] / M_PI +
           (1 - q) * (alpha + 2) * pow(h.c, alpha + 1) / (8 * M_PI * h.mo);
}

static inline bool stam_is(const struct imp_vertex *v, const char *material)
{
    return v->bsdf && v->bsdf->name && strcmp(v->bsdf->name, material) == 0;
}

/* L in the order the walk goes (the library folds from the far end). Counts scatterings.
 */
static inline struct dual stam_value(const struct imp_walk *w, enum stam_variant variant,
                                     double absorb, const double *theta, int *n2, int *n3)
{
    struct dual T = dual_of(1);
    *n2 = *n3 = 0;
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        if (v->d.met.emitter >= 0) return dual_mul(T, dual_control(theta, EMISSION));
        const bool sphere = stam_is(v, "sphere");
        if (!v->next) { /* absorbed here, or lost: below the horizon, or too deep */
            const struct dual glow = dual_control(theta, sphere ? AMBIENT2 : AMBIENT3);
            (void)absorb; /* 1/absorb, as decided */
            return w->absorbed ? dual_mul(T, dual_scale(glow, v->d.glow_weight))
                               : dual_of(0);
        }
        const struct imp_dirs dirs = imp__vertex_dirs(v);
        const struct dual f =
            sphere ? stam_m2(&dirs, variant, theta)
                   : dual_scale(dual_control(theta, DIFFUSE3), v->d.wi[2] / M_PI);
        T = dual_mul(T, dual_scale(f, v->scale[0]));
        ++*(sphere ? n2 : n3);
    }
    return dual_of(0);
}

#endif
