/* SPDX-License-Identifier: Apache-2.0
 *
 * Objective and gradient of a problem of bent rays: trace, targets, adjoint,
 * regularisers. Only the exits are stored between tracing and
 * adjoint. */
#include "bend_problem.h"
#include <string.h>

struct passes {
    struct imp_bend_options options;
    struct imp_bend_rays rays;
    struct imp_bend_exit *exits, *taps;
    struct imp_bend_cotangent *bars, *tap_bars;
};

static void passes_free(const imp_bend *b, struct passes *p)
{
    imp__release(b->ctx, p->exits), imp__release(b->ctx, p->taps);
    imp__release(b->ctx, p->bars), imp__release(b->ctx, p->tap_bars);
}

static enum imp_status passes_trace(const imp_bend *b, bool adjoint, struct passes *p,
                                    struct imp_bend_stats *stats)
{
    *p = (struct passes){.rays = imp__bend_rays(b)};
    const size_t n = imp_max(b->n, (size_t)1), n_taps = n * b->options.n_taps;
    if (b->n == 0) return imp__error(b->ctx, IMP_E_ARG, "a problem without rays");
    const enum imp_status st = imp__bend_options_ready(b, &p->options);
    if (st != IMP_OK) return st;
    p->exits = imp__alloc(b->ctx, n, sizeof *p->exits);
    if (n_taps) p->taps = imp__alloc(b->ctx, n_taps, sizeof *p->taps);
    if (adjoint) p->bars = imp__alloc(b->ctx, n, sizeof *p->bars);
    if (adjoint && n_taps) p->tap_bars = imp__alloc(b->ctx, n_taps, sizeof *p->tap_bars);
    if (!p->exits || (n_taps && !p->taps) || (adjoint && !p->bars) ||
        (adjoint && n_taps && !p->tap_bars))
        return imp__error(b->ctx, IMP_E_NOMEM, "no memory for the exits of %zu rays",
                          b->n);
    return imp__bundles_trace(b, b->field, &p->options, &p->rays, p->exits, p->taps,
                              stats);
}

enum imp_status imp__bend_traced(const imp_bend *b, const struct imp_bend_stats *s)
{
    if (s->traced > 0) return IMP_OK;
    return imp__error(b->ctx, IMP_E_NUMERIC,
                      "none of %llu rays comes to its end: %llu start outside "
                      "the field, %llu leave it without an exit, %llu take more "
                      "than max_steps, %llu graze, %llu are broken",
                      (unsigned long long)s->rays, (unsigned long long)s->started_out,
                      (unsigned long long)s->missed, (unsigned long long)s->truncated,
                      (unsigned long long)s->grazing, (unsigned long long)s->broken);
}

enum imp_status imp_bend_objective(imp_bend *b, double *value, double *gradient,
                                   double *targets, struct imp_bend_stats *stats)
{
    struct passes p;
    uint8_t *mask = NULL;
    double *bar = NULL, total = 0, *parts = NULL;
    struct imp_bend_stats s = IMP_BEND_STATS_INIT;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, value, "value");
    if (stats) IMP_SIZED(b->ctx, stats, "stats");
    IMP_FLOAT_MODE;
    enum imp_status st = passes_trace(b, gradient != NULL, &p, &s);
    if (st != IMP_OK) goto out;
    /* Counts are returned also where no ray came to its end: they give the reason. */
    if (stats) IMP_TRY(imp__info_give(b->ctx, __func__, "stats", stats, &s, sizeof s));
    IMP_TRY(imp__bend_traced(b, &s));
    parts = imp__alloc(b->ctx, b->n_targets + 1, sizeof *parts);
    if (!parts) IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for the targets"));
    for (size_t i = 0; i < b->n_targets; i++) {
        IMP_TRY(imp__target_value(b, &b->targets[i], p.exits, p.taps, &parts[i], p.bars,
                                  p.tap_bars));
        total += parts[i];
    }
    if (gradient) {
        const size_t n = b->field->n_theta;
        mask = imp__alloc(b->ctx, n + 1, 1);
        bar = imp__alloc(b->ctx, n + 1, sizeof *bar);
        if (!mask || !bar)
            IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for a gradient"));
        IMP_TRY(imp__bundles_adjoint(b, &p.options, &p.rays, p.exits, p.taps, p.bars,
                                     p.tap_bars, bar, &s));
        total += imp__smooth_value(b, bar);
        imp__bend_hold(b, mask, NULL);
        for (size_t i = 0; i < n; i++) gradient[i] = mask[i] ? 0 : bar[i];
    } else {
        total += imp__smooth_value(b, NULL);
    }
    if (targets) memcpy(targets, parts, b->n_targets * sizeof *parts);
    if (stats) IMP_TRY(imp__info_give(b->ctx, __func__, "stats", stats, &s, sizeof s));
    *value = total;
out:
    imp__release(b->ctx, parts);
    imp__release(b->ctx, mask);
    imp__release(b->ctx, bar);
    passes_free(b, &p);
    return st;
}

enum imp_status imp_bend_run(imp_bend *b, struct imp_bend_exit *exits,
                             struct imp_bend_exit *taps, struct imp_bend_stats *stats)
{
    struct passes p;
    struct imp_bend_stats all = IMP_BEND_STATS_INIT;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, exits, "exits");
    if (stats) IMP_SIZED(b->ctx, stats, "stats");
    IMP_FLOAT_MODE;
    enum imp_status st = passes_trace(b, false, &p, stats ? &all : NULL);
    if (st == IMP_OK) {
        memcpy(exits, p.exits, b->n * sizeof *exits);
        if (taps && p.taps) memcpy(taps, p.taps, b->n * b->options.n_taps * sizeof *taps);
        if (stats)
            st = imp__info_give(b->ctx, __func__, "stats", stats, &all, sizeof all);
    }
    passes_free(b, &p);
    return st;
}

enum imp_status imp_bend_arrivals(imp_bend *b, size_t target,
                                  struct imp_bend_arrival *arrivals, size_t *n)
{
    struct passes p;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, arrivals, "arrivals");
    IMP_REQUIRE(b->ctx, n, "n");
    IMP_FLOAT_MODE;
    if (target >= b->n_targets)
        return imp__error(b->ctx, IMP_E_ARG, "no target %zu", target);
    const struct imp__target_of_rays *t = &b->targets[target];
    const enum imp_status st = passes_trace(b, false, &p, NULL);
    if (st == IMP_OK) {
        size_t k = 0;
        for (size_t i = t->first; i < t->last; i++) {
            struct imp__arrival a;
            if (!imp__arrive(
                    &t->desc,
                    imp__target_exit(&t->desc, p.exits, p.taps, b->options.n_taps, i),
                    &a))
                continue;
            struct imp_bend_arrival *o = &arrivals[k++];
            imp__v3_store(a.x, o->x);
            imp__v3_store(a.d, o->d);
            o->path = a.path;
            o->weight = a.weight * b->power[i] / t->power;
            o->ray = (uint32_t)i;
        }
        *n = k;
    }
    passes_free(b, &p);
    return st;
}

enum imp_status imp_bend_image(imp_bend *b, size_t target, float *pixels)
{
    struct passes p;
    double value;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, pixels, "pixels");
    IMP_FLOAT_MODE;
    if (target >= b->n_targets || !b->targets[target].pixels)
        return imp__error(b->ctx, IMP_E_ARG, "target %zu is no image", target);
    enum imp_status st = passes_trace(b, false, &p, NULL);
    if (st == IMP_OK)
        st = imp__image_value(b, &b->targets[target], p.exits, p.taps, &value, NULL, NULL,
                              pixels);
    passes_free(b, &p);
    return st;
}
