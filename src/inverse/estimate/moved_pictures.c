/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures by poses, from walks and from draws (moved_pictures.h). A sample of draws is
 * made as a walk from a light is: it reaches film positions, each with a flux. */
#include "moved_pictures.h"
#include "base/team.h"
#include "channel_sink.h"
#include <string.h>

static imp_spec channel(int c)
{
    imp_spec one = {0};
    one[c] = 1;
    return one;
}

bool imp__moved_rows(const struct imp__moved_gradient *m, struct imp_arena *arena,
                     const struct imp_walk *walk, double *x)
{
    struct imp_lanes lanes = imp__lanes_into(m->tracer, walk, x);
    double *bar = imp__arena_take(arena, m->moves.n, sizeof *bar);
    if (!bar) return false;
    for (int c = 0; c < lanes.channels; c++) {
        memset(bar, 0, m->moves.n * sizeof *bar);
        if (!imp__moved_walk(m, arena, walk, channel(c), bar)) return false;
        imp__moved_numbers(m, bar, channel(c), &lanes.sink);
    }
    return true;
}

void imp__moved_sample(const struct imp__moved_gradient *m,
                       const struct imp_tracer *tracer, struct imp_sample *s)
{
    struct imp_walk walk;
    imp__sample_walk(s, tracer, &walk);
    imp__lanes_values(tracer, &walk, s->value);
    if (imp_likely(!m) || s->dropped != IMP_DROP_NONE) return;
    if (!imp__moved_rows(m, s->arena, &walk, s->value + tracer->scene->channels))
        s->dropped = IMP_DROP_MEMORY;
}

/* ---- Pictures of draws --------------------------------------------------------------- */

/* What one flux reaches. */
struct edge_reach {
    struct imp_reach reach; /* first */
    const struct imp__flux *flux;
};

struct pictures {
    const struct imp__moved_gradient *m;
    const struct imp__functional *f; /* of sums; else NULL */
    const double *x_dot;             /* of one direction; else NULL */
    int64_t strata;                  /* samples of a sweep along the list of edges */
};

/* A sample of all kinds: draws times s, times s + 1, ... of each. */
static void sample_draw(const void *payload, struct imp_arena *arena, int64_t index,
                        struct imp_light_walk *out)
{
    const struct pictures *own = payload;
    const struct imp__moved_gradient *m = own->m;
    struct imp_reach **end = &out->reach;
    bool no_memory = false;
    *out = (struct imp_light_walk){.arena = arena};
    for (int kind = 0; kind < IMP_BOUNDARY_KINDS; kind++) {
        const int times = imp__moved_times[kind];
        for (int i = 0; i < times; i++) {
            const int64_t number = m->first + index * times + i, n = own->strata * times;
            struct imp__flux *f = imp__boundary_draw(
                &m->boundary, arena, (enum imp__boundary_kind)kind, number,
                (struct imp__stratum){number % n, n}, &no_memory);
            for (; f; f = f->next) {
                struct edge_reach *r = imp__arena_array(arena, 1, sizeof *r);
                no_memory |= !r;
                if (!r) continue;
                f->L *= imp__spec(1. / times);
                *r = (struct edge_reach){{.px = f->px, .py = f->py, .L = f->L}, f};
                *end = &r->reach;
                end = &r->reach.next;
                out->n_reach++;
            }
        }
    }
    if (no_memory) out->walk.dropped = IMP_DROP_MEMORY;
}

/* value [active->n][channels] of a flux. False: no memory. */
static bool flux_rows(const struct imp__moved_gradient *m,
                      const struct imp_light_walk *walk, const struct imp__flux *flux,
                      double *value)
{
    struct imp_lanes lanes = imp__lanes_into(m->tracer, &walk->walk, value);
    double *bar = imp__arena_array(walk->arena, m->moves.n, sizeof *bar);
    memset(value, 0, m->tracer->active->n * (size_t)lanes.channels * sizeof *value);
    if (!bar) return false;
    imp__flux_bar(&m->moves, flux, 1, bar);
    imp__moved_numbers(m, bar, flux->L, &lanes.sink);
    return true;
}

static void reach_rows(const void *payload, const struct imp_light_walk *walk,
                       const struct imp_reach *reach, double *value)
{
    const struct pictures *own = payload;
    const struct edge_reach *r = (const struct edge_reach *)reach;
    if (!flux_rows(own->m, walk, r->flux, value)) value[0] = NAN;
}

static void reach_tangent(const void *payload, const struct imp_light_walk *walk,
                          const struct imp_reach *reach, double *value)
{
    const struct pictures *own = payload;
    const struct edge_reach *r = (const struct edge_reach *)reach;
    const size_t K = own->m->tracer->active->n;
    const size_t C = (size_t)own->m->tracer->scene->channels;
    double *row = imp__arena_take(walk->arena, K * C, sizeof *row);
    for (size_t c = 0; c < C; c++) value[c] = 0;
    if (!row || !flux_rows(own->m, walk, r->flux, row)) value[0] = NAN;
    for (size_t k = 0; row && k < K; k++)
        for (size_t c = 0; c < C; c++) value[c] += own->x_dot[k] * row[k * C + c];
}

/* Sweeps of a picture, whose spread is its error: one of each pixel's samples, or so many where
 * these are few. */
#define SWEEPS_LEAST 8

static struct imp_light_picture picture_of(struct pictures *own,
                                           const struct imp__moved_run *r)
{
    const struct imp__moved_gradient *m = own->m;
    const struct imp_film_desc *film = &m->tracer->sensor->film;
    const int margin = m->scale.margin;
    const int64_t pixels =
        (int64_t)(film->crop_w + 2 * margin) * (film->crop_h + 2 * margin);
    const int64_t sweeps = imp_max(r->spp, (int64_t)SWEEPS_LEAST);
    own->strata = imp_max(r->spp * pixels / sweeps, (int64_t)1);
    return (struct imp_light_picture){.tracer = m->tracer,
                                      .run = r->run,
                                      .stage = r->stage,
                                      .trace = sample_draw,
                                      .payload = own,
                                      .first = r->first * pixels,
                                      .walks = own->strata * sweeps,
                                      .sweep = own->strata};
}

enum imp_status imp__moved_pictures(const struct imp__moved_gradient *m,
                                    const struct imp__moved_run *r, const double *x_dot,
                                    double *mean, double *se)
{
    struct pictures own = {m, NULL, x_dot, 1};
    struct imp_light_picture picture = picture_of(&own, r);
    const size_t numbers = x_dot ? 1 : m->tracer->active->n;
    picture.n = (int)numbers * m->tracer->scene->channels;
    picture.values = x_dot ? reach_tangent : reach_rows;
    return imp__light_picture_make(&picture, mean, se, NULL);
}

void imp__moved_film_add(imp_film *film, int at, int channels, size_t k, size_t n,
                         const double *mean, const double *se)
{
    const size_t C = (size_t)channels;
    for (size_t p = 0; p < (size_t)film->width * (size_t)film->height; p++)
        for (size_t c = 0; c < C; c++) {
            const size_t to = p * (size_t)film->channels + (size_t)at + c;
            const size_t from = (p * n + k) * C + c;
            film->mean[to] = (float)(film->mean[to] + mean[from]);
            if (se && film->se) film->se[to] = (float)hypot(film->se[to], se[from]);
        }
}

/* ---- Sums ---------------------------------------------------------------------------- */

/* value [n_groups] of a sample of draws: sums over the pixels that it reaches. */
static void sample_sums(const void *payload, const struct imp_light_walk *walk,
                        double *value)
{
    const struct pictures *own = payload;
    const struct imp__functional *f = own->f;
    const size_t C = (size_t)f->channels, K = f->tracer.active->n;
    double *row = imp__arena_take(walk->arena, (K + 1) * C, sizeof *row);
    for (int g = 0; g < f->n_groups; g++) value[g] = row ? 0 : NAN;
    for (const struct imp_reach *r = row ? walk->reach : NULL; r; r = r->next) {
        struct imp_splat_taps taps;
        imp__splat_taps(f->film, &own->m->scale, r->px, r->py, &taps);
        reach_rows(payload, walk, r, row);
        for (int j = 0; j < taps.down.n; j++)
            for (int i = 0; i < taps.across.n; i++) {
                const float *a = f->adjoint + ((size_t)(taps.down.first + j) *
                                                   (size_t)f->film->crop_w +
                                               (size_t)(taps.across.first + i)) *
                                                  C;
                const double w = taps.down.w[j] * taps.across.w[i] / f->norm;
                for (size_t k = 0; k < K; k++)
                    for (size_t c = 0; c < C; c++)
                        value[f->group[k]] += w * a[c] * row[k * C + c];
            }
    }
}

enum imp_status imp__moved_sums(const struct imp__moved_gradient *m,
                                const struct imp__functional *f,
                                const struct imp__moved_run *r, double *se)
{
    enum imp_status st = IMP_OK;
    struct pictures own = {m, f, NULL, 1};
    struct imp_light_picture picture = picture_of(&own, r);
    double *mean = imp__alloc(m->tracer->scene->ctx, (size_t)f->n_groups, sizeof *mean);
    if (!mean)
        return imp__error(m->tracer->scene->ctx, IMP_E_NOMEM, "no memory for sums");
    picture.n = f->n_groups;
    picture.whole = sample_sums;
    st = imp__light_picture_make(&picture, mean, se, NULL);
    imp__release(m->tracer->scene->ctx, mean);
    return st;
}
