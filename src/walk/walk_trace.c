/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk from a sensor, from its number to its radiance: key, film position, ray, time
 * and wavelengths; its steps (trace.c); the fold. */
#include "meter.h"
#include "probe.h"
#include <float.h>

/* Keys use full-film pixels: a crop renders the same samples as the whole picture. The
 * border of wide filters may lie outside the film, hence the offset. */
static struct imp_walk walk_numbered(const struct imp_tracer *tracer, int x, int y,
                                     int64_t sample)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const uint64_t row = (uint64_t)(y + film->crop_y + 0x8000);
    const uint64_t column = (uint64_t)(x + film->crop_x + 0x8000),
                   pixel = row << 32 | column;
    struct imp_walk walk = {.key = imp__key(tracer->seed, pixel, (uint64_t)sample)};
    if (!tracer->points) return walk;
    const uint64_t set = (uint64_t)sample / IMP_SET_POINTS | 1ull << 63;
    walk.point = (struct imp_point){.points = tracer->points,
                                    .set = imp__key(tracer->seed, pixel, set).state,
                                    .index = (uint32_t)sample % IMP_SET_POINTS};
    return walk;
}

static inline void position(const struct imp_tracer *tracer, const struct imp_walk *w,
                            int x, int y, double *px, double *py)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    *px = film->crop_x + x + imp__start_number(w->key, w->point, IMP_DIM_PIXEL_X);
    *py = film->crop_y + y + imp__start_number(w->key, w->point, IMP_DIM_PIXEL_Y);
}

void imp__walk_position(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                        double *px, double *py)
{
    const struct imp_walk walk = walk_numbered(tracer, x, y, sample);
    position(tracer, &walk, x, y, px, py);
}

enum imp_drop imp__drop_cause(imp_spec L)
{
    double sum = 0, largest = 0;
    for (int c = 0; c < 4; c++) {
        sum += L[c];
        largest = fmax(largest, fabs(L[c]));
    }
    if (isnan(sum)) return IMP_DROP_NAN;
    return largest <= FLT_MAX ? IMP_DROP_NEGATIVE : IMP_DROP_INFINITE;
}

void imp__walk_close(const struct imp_tracer *tracer, struct imp_walk *walk)
{
    const imp_spec L = imp__walk_fold(walk);
    imp_spec used = L;
    if (!tracer->wavelengths) used[3] = 0;
    if (imp_unlikely(!imp__is_within(used, FLT_MAX)))
        walk->dropped = imp__drop_cause(used);
    walk->values = walk->dropped || !walk->valid ? (imp_spec){0} : L;
    walk->L = imp__walk_channels(tracer, walk, walk->values);
}

void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk)
{
    const struct imp_sensor *sensor = tracer->sensor;
    *walk = walk_numbered(tracer, x, y, sample);
    position(tracer, walk, x, y, &walk->px, &walk->py);
    const double lens[2] = {imp__start_number(walk->key, walk->point, IMP_DIM_LENS_U),
                            imp__start_number(walk->key, walk->point, IMP_DIM_LENS_V)};
    sensor->ops->ray(sensor, walk->px, walk->py, lens, &walk->ray);
    walk->time = imp__walk_time(tracer, walk);

    if (imp_unlikely(tracer->wavelengths != NULL) &&
        !imp__walk_wave(tracer, arena, imp__wave_draw(tracer, walk, sample), walk))
        return;

    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_step s = {.tracer = tracer,
                         .scene = tracer->scene,
                         .walk = walk,
                         .arena = arena,
                         .recorded = !tracer->value_only ||
                                     (tracer->active && tracer->active->body),
                         .scratch = scratch,
                         .at.carried = walk->waves ? &walk->waves->carried : NULL,
                         .segment = imp__segment_first(tracer),
                         .o = walk->ray.o,
                         .d = walk->ray.d,
                         .t_min = walk->ray.t_near,
                         .t_max = walk->ray.t_far,
                         .from = walk->ray.o,
                         .beta = {1, 1, 1, 1},
                         .eta = 1,
                         .lanes = IMP_LANE_MIS_INIT,
                         .guided.guide = tracer->guide};
    s.mixed.same = tracer->mixing != NULL;
    s.mixed.all = tracer->mixing              ? tracer->mixing
                  : tracer->integrator->mixes ? tracer->integrator->mixing
                                              : NULL;
    struct imp_probing probing = {.n = 0};
    if (imp_unlikely(tracer->active && tracer->active->medium) && s.recorded &&
        !tracer->collisions_stand && tracer->integrator->media)
        s.probing = &probing;
    if (imp_unlikely(sensor->shape != NULL)) imp__walk_on_meter(&s);
    else if (imp_likely(s.segment->begin == NULL) || s.segment->begin(&s))
        imp__walk_on(&s);
    if (imp_unlikely(s.probing != NULL)) imp__probe_follow(&s);

    imp__walk_close(tracer, walk);
}
