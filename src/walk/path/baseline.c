/* SPDX-License-Identifier: Apache-2.0
 *
 * The baseline of what flights bring: measured by a few walks before a job, read by the
 * rest. */
#include "baseline.h"
#include "walk/media/tracking.h"

/* One walk of so many is made for the baseline, so that it costs little; from some
 * hundred on more make no difference. */
#define SHARE     64
#define WALKS_MIN 16
#define WALKS_MAX 256

/* Sums over the flights, of a lane: a = x^2. */
struct sums {
    double a, a_light, aa, aa_light, aa_light2;
};

static bool wanted(const struct imp_tracer *t)
{
    const struct imp_active *active = t->active;
    /* A light that is hidden from the camera makes walks that do not count, and these would
     * lack the baseline. */
    if (t->collisions_fixed || !active || !active->medium || !t->integrator->media ||
        t->integrator->both || t->integrator->hide_emitters)
        return false;
    for (int i = 0; i < t->scene->n_media; i++)
        if (active->medium[i] && !t->scene->media[i]->majorants) return true;
    return false;
}

/* d log p/d sigma of the flight's fixed stretches. */
static imp_spec slope_of(const struct imp_tracer *t, const struct imp_vertex *v)
{
    imp_spec slope = {0}, in[IMP_INPUTS_MAX];
    for (int i = 0; i < v->on->n; i++) {
        const struct imp_event *e = &v->on->event[i];
        if (e->kind > IMP_COLLIDES || !(e->bound > 0) || !isfinite(e->t)) continue;
        slope -= imp__spec((double)e->t);
        if (e->kind != IMP_COLLIDES) continue;
        const imp_spec sigma = imp__extinction_at(
            t->scene->media[e->medium], imp__decided_v3(v->on->o), v->carried, in);
        for (int c = 0; c < 4; c++)
            if (sigma[c] > 0) slope[c] += 1 / sigma[c];
    }
    return slope;
}

static void walk_add(const struct imp_tracer *t, const struct imp_walk *w,
                     struct sums sums[4])
{
    imp_spec P = imp__spec(1);
    if (w->dropped) return;
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        P *= v->w;
        if (!v->on || !v->d.goes_on) continue;
        const imp_spec x = P * slope_of(t, v), a = x * x;
        for (int c = 0; c < 4; c++) {
            struct sums *s = &sums[c];
            const double L = v->beyond[c];
            if (!isfinite(a[c]) || !isfinite(L)) continue;
            s->a += a[c];
            s->a_light += a[c] * L;
            s->aa += a[c] * a[c];
            s->aa_light += a[c] * a[c] * L;
            s->aa_light2 += a[c] * a[c] * L * L;
        }
    }
}

/* b of the sums, drawn towards 0 as far as it is noise: of light that few walks find,
 * little is known. */
static double baseline_of(const struct sums *s)
{
    if (!(s->a > 0)) return 0;
    const double b = s->a_light / s->a,
                 variance =
                     (s->aa_light2 - 2 * b * s->aa_light + b * b * s->aa) / (s->a * s->a);
    return b == 0 || !isfinite(variance) ? 0
                                         : b * b * b / (b * b + imp_max(variance, 0.0));
}

enum imp_status imp__baseline_set(struct imp_tracer *tracer, int64_t walks)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const int64_t n = imp_min(walks / SHARE, (int64_t)WALKS_MAX);
    struct sums sums[4] = {{0}};
    struct imp_arena arena;
    enum imp_status st = IMP_OK;
    tracer->baseline = (imp_spec){0};
    struct imp_tracer own = *tracer;
    if (n < WALKS_MIN || !wanted(tracer)) return IMP_OK;
    own.seed = imp__key(tracer->seed, 0xba5e, 0).state;
    own.points = NULL;
    own.set = 1;
    imp__arena_init(&arena, tracer->scene->ctx);
    const struct imp_arena_mark start = imp__arena_mark(&arena);
    for (int64_t i = 0; i < n && st == IMP_OK; i++) {
        const struct imp_key key = imp__key(own.seed, 0x91ce1, (uint64_t)i);
        struct imp_walk w;
        imp__walk_trace(&own, &arena, (int)(imp__u01(key, 0) * film->crop_w),
                        (int)(imp__u01(key, 1) * film->crop_h), i, &w);
        if (w.dropped == IMP_DROP_MEMORY)
            st = imp__error(tracer->scene->ctx, IMP_E_NOMEM, "no memory to record walks");
        else walk_add(tracer, &w, sums);
        imp__arena_rewind(&arena, start);
    }
    imp__arena_free(&arena);
    if (tracer->wavelengths) /* a lane has another wavelength on each walk */
        for (int c = 1; c < 4; c++) {
            sums[0].a += sums[c].a;
            sums[0].a_light += sums[c].a_light;
            sums[0].aa += sums[c].aa;
            sums[0].aa_light += sums[c].aa_light;
            sums[0].aa_light2 += sums[c].aa_light2;
        }
    for (int c = 0; c < 4; c++)
        tracer->baseline[c] = baseline_of(&sums[tracer->wavelengths ? 0 : c]);
    return st;
}
