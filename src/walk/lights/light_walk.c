/* SPDX-License-Identifier: Apache-2.0
 *
 * The end of a walk that begins at a light (light_walk.h): what the one step
 * (core/one_step.h) does there. Light scatters by transposed kernels, is connected to the
 * sensor, and meets the sensor where that is a surface. */
#include "kind/bsdf/transport.h"
#include "light_supply.h"
#include "scene/ray_columns.h"
#include "walk/both/both.h"
#include "walk/core/one_step.h"
#include "walk/core/scatter_with.h"
#include "walk/path/first_segment.h"
#include <float.h>

/* ---- The continuation -------------------------------------------------------------- */

static inline struct imp_light_step *of_light(struct imp_step *s)
{
    return (struct imp_light_step *)s; /* its first member */
}

/* Another vertex makes no path that is too long. */
static inline bool bounces(const struct imp_step *s)
{
    return imp__light_depth_allows(s, s->depth + (s->tracer->sensor->shape ? 1 : 2));
}

static inline bool direction_draw(const struct imp_step *s, const struct imp_vertex *v,
                                  const struct imp_frame *frame,
                                  struct imp_direction *direction)
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_key key = s->walk->key;
    double u[3] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LOBE)),
                   imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_U)),
                   imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_V))};
    struct imp_dirs *dirs = &direction->dirs;
    *dirs = (struct imp_dirs){.wi = s->wo_drawn,
                              .lobe = IMP_SMOOTH,
                              .derivative = imp__derivative_wanted(s, b)};
    direction->by = IMP_DENSITY_KERNEL;
    if (imp_unlikely(s->guided.here) && imp__guided_light_draw(s, frame, u, dirs))
        return true;
    if (imp_likely(!b->shaped)) return imp__bsdf_transposed_sample(b, s->in, u, dirs);
    imp_spec own[IMP_INPUTS_MAX];
    imp__shaped_inputs(b, s->in, imp__waves_drew(s->at.carried), own);
    return imp__bsdf_transposed_sample(b, own, u, dirs);
}

/* Its density, in all lanes together where they differ; 0: the walk ends. d: the direction in
 * the world. *kernel: without a guide. */
static double direction_pdf(struct imp_step *s, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs, imp_v3 d, double *kernel)
{
    if (imp_likely(!b->shaped)) {
        *kernel = imp__bsdf_transposed_pdf(b, s->in, dirs);
        return imp_unlikely(s->guided.here) ? imp__guided_light_pdf(s, *kernel, d)
                                            : *kernel;
    }
    const struct imp_dirs exchanged = {dirs->wi, dirs->wo, dirs->lobe, dirs->derivative};
    imp_spec p;
    imp__shaped_pdf(b, s->at.carried, s->in, &exchanged, &p);
    if (!(p[imp__lane_mis_drew(s)] > 0)) return 0;
    return *kernel = 1 / imp__lane_mis_decide(s, p);
}

/* The weight of the step is f c/p, c for the transposed kernel. Roulette goes by the weight
 * without a guide: where that sends more walks, each is worth no less for it. */
static inline struct imp_drawn density(struct imp_step *s, const struct imp_vertex *v,
                                       const struct imp_surface *at,
                                       const struct imp_dirs *dirs, imp_v3 w, int by,
                                       imp_spec *f)
{
    (void)by;
    const struct imp_bsdf *b = v->bsdf;
    struct imp_drawn p = {.share = 1};
    double kernel = 0;
    p.competing = direction_pdf(s, b, dirs, w, &kernel);
    const double c = v->shape ? imp__bsdf_exchange(b, s->in, dirs, imp__dot(w, at->ng),
                                                   imp__dot(-s->d, at->ng))
                              : 1;
    if (!(p.competing > 0) || !(c > 0)) return p;
    p.pdf = p.competing / c;
    if (imp_unlikely(s->guided.here && kernel > 0)) p.unguided = kernel / c;
    imp__bsdf_eval(b, s->at.carried, s->in, dirs, f);
    return p;
}

static inline bool survives(struct imp_step *s, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs, imp_spec factor, double *survive)
{
    (void)b, (void)dirs, (void)factor;
    if (s->depth < s->tracer->integrator->rr_depth) return true;
    *survive = imp__decide1(imp_min(imp__max_used(s->beta, s->at.carried), 0.95));
    return imp__u01(s->walk->key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < *survive;
}

/* Connections pass a vertex where light goes straight on: the way goes on from before. */
static inline void left(struct imp_step *s, const struct imp_vertex *v,
                        const struct imp_surface *at, const struct imp_dirs *dirs,
                        bool straight, const struct imp_drawn *p, double pdf)
{
    (void)at, (void)pdf;
    struct imp_light_step *w = of_light(s);
    if (imp_unlikely(straight)) {
        w->passed += v->t;
        return;
    }
    w->passed = 0;
    s->pdf = dirs->lobe == IMP_SMOOTH ? p->competing : 0;
    w->pdf_across = 0;
    if (w->both) imp__both_light_leaves(w, v->bsdf, dirs);
}

static const struct imp_scatter_ops transposed_kernel = {.transposed = true,
                                                         .bounces = bounces,
                                                         .density = density,
                                                         .survives = survives,
                                                         .left = left};

static inline bool scatter(struct imp_step *s, struct imp_vertex *v,
                           const struct imp_surface *at, const struct imp_frame *frame,
                           struct imp_direction *direction)
{
    return imp__scatter_with(&transposed_kernel, s, v, at, frame, direction);
}

/* ---- The end ----------------------------------------------------------------------- */

static inline bool passes(const struct imp_step *s)
{
    (void)s;
    return true;
}

static inline bool arrive(struct imp_step *s, struct imp_vertex *v,
                          const struct imp_hit *hit, const struct imp_surface *at,
                          const struct imp_frame *frame)
{
    struct imp_light_step *w = of_light(s);
    if (imp_unlikely(s->guided.guide != NULL)) imp__guided_light_arrive(s, v, hit, at);
    if (s->recorded) {
        v->d.from_light = true;
        v->d.met.weight = 0;
        imp__store_v3(v->d.wi, s->wo);
        imp__store_v3(v->d.wo, (imp_v3){0});
    }
    if (!w->both || imp__both_light_arrives(w, v, at, frame)) return true;
    s->walk->dropped = IMP_DROP_MEMORY;
    return false;
}

/* The surface of the sensor. */
static inline bool meet(struct imp_step *s, struct imp_vertex *v,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)hit;
    if (v->shape && v->shape->sensor == s->tracer->sensor)
        imp__light_meet_sensor(of_light(s), v, at);
    return !s->walk->dropped;
}

static const struct imp_end_ops light_end = {.arrive = arrive,
                                             .bounces = bounces,
                                             .passes = passes,
                                             .connects_last = true,
                                             .meet = meet,
                                             .link_draw = imp__light_link_draw,
                                             .link_weigh = imp__light_link_weigh,
                                             .link_see = imp__light_link_see,
                                             .direction_draw = direction_draw,
                                             .scatter = scatter};

/* ---- Walks ------------------------------------------------------------------------ */

void imp__reach_value(const struct imp_tracer *tracer, struct imp_walk *walk,
                      struct imp_reach *r, imp_spec values)
{
    imp_spec used = r->values = values;
    if (!tracer->wavelengths) used[3] = 0;
    if (imp_unlikely(!imp__is_within(used, FLT_MAX)))
        walk->dropped = imp__drop_cause(used);
    r->L = imp__walk_seen(walk, values);
}

void imp__light_walk_close(const struct imp_tracer *tracer, struct imp_light_walk *out)
{
    struct imp_walk *walk = &out->walk;
    imp_spec P = imp__spec(1);
    struct imp_reach *r = out->reach;
    for (struct imp_vertex *v = walk->first; v && r && !walk->dropped; v = v->next) {
        for (; r && r->vertex == v; r = r->next)
            imp__reach_value(tracer, walk, r, P * (r->met ? v->e : v->b));
        P *= v->w;
    }
    if (r && !r->vertex && !walk->dropped)
        imp__reach_value(tracer, walk, r,
                         imp__walk_fold(&out->both->eye) * out->both->pixels);
    if (!walk->dropped) return;
    out->reach = NULL;
    out->n_reach = 0;
}

void imp__light_step_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                           imp_spec *scratch, struct imp_light_walk *out,
                           struct imp_light_step *w)
{
    imp__step_begin(tracer, arena, &out->walk, scratch, &w->s);
    w->out = out;
    w->end = &out->reach;
    w->pdf_across = w->passed = 0;
    w->both = out->both;
    w->given = NULL;
    if (out->both)
        w->s.lanes.drew = imp__lane_drawn(out->both->eye.key, imp__lane_mis_count(&w->s));
}

void imp__light_walk_follow(const struct imp_tracer *tracer, struct imp_arena *arena,
                            struct imp_light_walk *out)
{
    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_light_step w;
    imp__light_step_begin(tracer, arena, scratch, out, &w);
    if (imp__light_start(&w))
        while (imp__one_step(&light_end, &w.s)) w.s.depth++;
}

static void walk_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                       int64_t index, struct imp_light_walk *out)
{
    imp__light_walk_begin(tracer, &out->walk, imp__light_key(tracer, index));
    out->reach = NULL;
    out->n_reach = 0;
    out->both = NULL;
    out->arena = arena;
}

bool imp__light_walk_start(const struct imp_tracer *tracer, struct imp_arena *arena,
                           int64_t index, struct imp_light_walk *out)
{
    walk_begin(tracer, arena, index, out);
    return !tracer->wavelengths ||
           imp__walk_wave(tracer, arena, imp__wave_draw(tracer, &out->walk, index),
                          &out->walk);
}

void imp__light_walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                           int64_t index, struct imp_light_walk *out)
{
    if (tracer->integrator->both) {
        walk_begin(tracer, arena, index, out);
        imp__both_trace(tracer, arena, index, out);
        return;
    }
    if (!imp__light_walk_start(tracer, arena, index, out)) return;
    imp__light_walk_follow(tracer, arena, out);
    imp__light_walk_close(tracer, out);
}

/* ---- Some at a time -------------------------------------------------------------------- */

bool imp__light_walks_go_together(const struct imp_tracer *t)
{
    return !t->integrator->both && !t->integrator->hide_emitters && !t->kept &&
           imp__segment_first(t) == &imp__straight_ops;
}

#define TAKE(p, n)                                                                       \
    ((p) = imp__arena_take(arena, (size_t)(n) + IMP_COLUMN_SLACK, sizeof *(p)))

/* Walks under way, and what their rays meet. */
struct together {
    struct imp_light_step *step;
    struct imp_ray_columns rays;
    struct imp_hit_columns hits;
    int *going; /* walks whose rays are in flight */
    int n_going;
};

static bool together_create(struct imp_arena *arena, int n, struct together *t)
{
    bool ok = TAKE(t->step, n) && TAKE(t->going, n) && TAKE(t->rays.near, n) &&
              TAKE(t->rays.far, n) && TAKE(t->rays.time, n) && TAKE(t->hits.t, n) &&
              TAKE(t->hits.u, n) && TAKE(t->hits.v, n) && TAKE(t->hits.shape, n) &&
              TAKE(t->hits.prim, n) && TAKE(t->hits.place, n);
    for (int c = 0; c < 3; c++) ok = ok && TAKE(t->rays.o[c], n) && TAKE(t->rays.d[c], n);
    t->n_going = 0;
    return ok;
}

static void rays_put(struct together *t)
{
    struct imp_ray_columns *rays = &t->rays;
    rays->n = t->n_going;
    for (int i = 0; i < t->n_going; i++) {
        const struct imp_step *s = &t->step[t->going[i]].s;
        for (int c = 0; c < 3; c++) {
            rays->o[c][i] = s->o[c];
            rays->d[c][i] = s->d[c];
        }
        rays->near[i] = s->t_min;
        rays->far[i] = s->t_max;
        rays->time[i] = s->walk->time;
    }
}

/* The step of the walk whose ray is number i. True: it goes on. */
static bool step_on(struct together *t, int i)
{
    struct imp_step *s = &t->step[t->going[i]].s;
    struct imp_hit hit = {.shape = t->hits.shape[i],
                          .prim = t->hits.prim[i],
                          .t = t->hits.t[i],
                          .u = t->hits.u[i],
                          .v = t->hits.v[i],
                          .place = t->hits.place[i],
                          .time = s->walk->time};
    const bool found = hit.shape >= 0;
    imp__step_numbers(s);
    if (!imp__step_on(&light_end, s, found ? IMP_MEETS_SURFACE : IMP_MEETS_NOTHING, &hit))
        return false;
    s->depth++;
    return true;
}

bool imp__light_walks_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                            int64_t first, int n, struct imp_light_walk *out)
{
    struct together t;
    struct imp_light_given *given;
    imp_spec scratch[IMP_INPUTS_MAX]; /* of the step at work */
    if (!TAKE(given, n) || !together_create(arena, n, &t)) return false;
    const bool known = imp__light_starts(tracer, first, n, given);
    for (int k = 0; k < n; k++) {
        if (!imp__light_walk_start(tracer, arena, first + k, &out[k])) continue;
        imp__light_step_begin(tracer, arena, scratch, &out[k], &t.step[k]);
        if (known) t.step[k].given = &given[k];
        if (imp__light_start(&t.step[k])) t.going[t.n_going++] = k;
    }
    while (t.n_going > 0) {
        int next = 0;
        rays_put(&t);
        imp__intersect_columns(tracer->scene, &t.rays, &t.hits);
        for (int i = 0; i < t.n_going; i++)
            if (step_on(&t, i)) t.going[next++] = t.going[i];
        t.n_going = next;
    }
    for (int k = 0; k < n; k++) imp__light_walk_close(tracer, &out[k]);
    return !arena->failed;
}
