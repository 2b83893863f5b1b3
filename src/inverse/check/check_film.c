/* SPDX-License-Identifier: Apache-2.0
 *
 * What a walk begins with: its place on the film, its time, and its wavelengths.
 *
 * film: places are even within a pixel. times: while the shutter is open they are even, or have
 * the density of the sensor's response, of which the truth is a quadrature; so have those of
 * light walks. waves: the sum of the weights that channels give to a
 * walk's wavelengths is an estimate of the integral of the responses, also over each of eight
 * parts of the spectrum; the truth is a quadrature of the responses. */
#include "check_sources.h"
#include "check_walks.h"
#include "math/course.h"
#include "math/rng.h"
#include "walk/core/step.h"
#include <math.h>

#define BINS   8
#define POINTS 4000 /* of a quadrature, in each part */
#define BEYOND 200  /* nm */
enum { WHOLE, PARTS, ACROSS = PARTS, DOWN = PARTS + BINS };

struct start {
    const struct imp_tracer *tracer;
    imp_spec weight; /* of the channels */
    double integral[BINS], all;
    double share[BINS], mean; /* of times, from 0 to 1 while the shutter is open */
};

static void film_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct start *f = payload;
    const struct imp_film_desc *film = &f->tracer->sensor->film;
    struct imp_tracer tracer = *f->tracer;
    double px, py;
    tracer.seed = seed;
    const int x = (int)(i % film->crop_w), y = (int)(i / film->crop_w % film->crop_h);
    imp__walk_position(&tracer, x, y, i, &px, &py);
    px -= film->crop_x + x;
    py -= film->crop_y + y;
    imp__pair_add(p, WHOLE, px + py, 1);
    for (int k = 0; k < BINS; k++) {
        imp__pair_add(p, ACROSS + k, floor(px * BINS) == k, 1.0 / BINS);
        imp__pair_add(p, DOWN + k, floor(py * BINS) == k, 1.0 / BINS);
    }
}

static void time_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct start *f = payload;
    const struct imp_sensor *s = f->tracer->sensor;
    struct imp_tracer tracer = *f->tracer;
    struct imp_walk walk;
    double lens[2];
    tracer.seed = seed;
    if (i & 1) imp__light_walk_begin(&tracer, &walk, imp__key(seed, 0x71, (uint64_t)i));
    else imp__walk_begin(&tracer, 0, 0, i, &walk, lens);
    const double past = (walk.time - s->open) / (s->close - s->open);
    imp__pair_add(p, WHOLE, past, f->mean);
    for (int k = 0; k < BINS; k++)
        imp__pair_add(p, PARTS + k, floor(past * BINS) == k, f->share[k]);
}

static void shares_set(struct start *f)
{
    const struct imp_sensor *s = f->tracer->sensor;
    double sum = 0;
    for (int k = 0; k < BINS * POINTS; k++) {
        const double past = (k + 0.5) / (BINS * POINTS),
                     at = s->open + past * (s->close - s->open),
                     value = s->course ? imp__course_at(s->course, at) : 1;
        f->share[k / POINTS] += value;
        f->mean += value * past;
        sum += value;
    }
    f->mean /= sum;
    for (int k = 0; k < BINS; k++) f->share[k] /= sum;
}

static void wave_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct start *f = payload;
    const struct imp_wavelengths *w = f->tracer->wavelengths;
    struct imp_waves waves;
    imp__waves_make(w, imp__u01(imp__key(seed, 0x3a, (uint64_t)i), 0), &waves);
    for (int j = 0; j < waves.carried.n; j++) {
        double sum = 0;
        for (int c = 0; c < waves.n_channels; c++)
            sum += f->weight[c] * waves.channel[c][j];
        const int bin = imp_clamp(
            (int)((waves.carried.nm[j] - w->lo) / (w->hi - w->lo) * BINS), 0, BINS - 1);
        imp__pair_add(p, PARTS + bin, sum, 0);
        imp__pair_add(p, WHOLE, sum, 0);
    }
    for (int k = 0; k < BINS; k++) imp__pair_add(p, PARTS + k, 0, f->integral[k]);
    imp__pair_add(p, WHOLE, 0, f->all);
}

static void integrals_set(struct start *f, const struct imp__check *c)
{
    const struct imp_wavelengths *w = f->tracer->wavelengths;
    f->weight = w->n_channels == 3 ? imp__kept_fold_bar(c) : imp__spec(1);
    for (int k = 0; k < BINS; k++) {
        /* Beyond both ends too, where no walk has a wavelength. */
        const double wide = (w->hi - w->lo) / BINS,
                     from = k == 0 ? w->lo - BEYOND : w->lo + k * wide,
                     to = k == BINS - 1 ? w->hi + BEYOND : w->lo + (k + 1) * wide;
        const double step = (to - from) / POINTS;
        for (int i = 0; i < POINTS; i++)
            for (int j = 0; j < w->n_channels; j++)
                f->integral[k] +=
                    f->weight[j] * step *
                    imp_spectrum_value(&w->response[j], from + (i + 0.5) * step);
        f->all += f->integral[k];
    }
}

enum imp_status imp__check_film(struct imp__draw_list *l,
                                const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_tracer *t = &places->tracer;
    struct start *f = imp__arena_array(&l->arena, 1, sizeof *f);
    const char *name = t->sensor->name ? t->sensor->name : t->sensor->ops->name;
    if (!f) IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
    *f = (struct start){.tracer = t};
    IMP_TRY(imp__draw_add(
        l, &(struct imp__draw_row){
               .method = "film", .name = name, .pair = film_pair, .payload = f}));
    if (t->sensor->close > t->sensor->open) {
        shares_set(f);
        IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "times",
                                                         .name = name,
                                                         .pair = time_pair,
                                                         .payload = f,
                                                         .slack = 1e-3}));
    }
    if (!t->wavelengths) return IMP_OK;
    integrals_set(f, l->check);
    IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "waves",
                                                     .name = name,
                                                     .pair = wave_pair,
                                                     .payload = f,
                                                     .slack = 1e-3}));
out:
    return st;
}
