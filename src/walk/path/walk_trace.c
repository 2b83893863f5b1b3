/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk from a sensor, from its number to its radiance: key, film position, ray, time
 * and wavelengths; its steps (trace.c); the fold. */
#include "first_segment.h"
#include "kind/cleared.h"
#include "surface_sensor.h"
#include "walk/media/probe.h"
#include <float.h>
#include <string.h>

/* Keys use full-film pixels: a crop renders the same samples as the whole picture. The
 * border of wide filters may lie outside the film, hence the offset. */
static inline uint64_t pixel_number(const struct imp_tracer *tracer, int x, int y)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const uint64_t row = (uint64_t)(y + film->crop_y + 0x8000);
    return row << 32 | (uint64_t)(x + film->crop_x + 0x8000);
}
static inline void point_of(const struct imp_tracer *tracer, uint64_t pixel,
                            int64_t sample, struct imp_point *point)
{
    point->points = tracer->points;
    if (imp_likely(!tracer->points)) return;
    const uint64_t set = (uint64_t)sample / IMP_SET_POINTS | 1ull << 63;
    point->set = imp__key(tracer->seed, pixel, set).state;
    point->index = (uint32_t)sample % IMP_SET_POINTS;
}
static inline void number(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                          struct imp_walk *walk)
{
    const uint64_t pixel = pixel_number(tracer, x, y);
    walk->key = imp__key(tracer->seed, pixel, (uint64_t)sample);
    point_of(tracer, pixel, sample, &walk->point);
}
uint64_t imp__walk_pixel(const struct imp_tracer *tracer, int x, int y)
{
    return imp__key_pixel(tracer->seed, pixel_number(tracer, x, y));
}
void imp__walk_numbers(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                       struct imp_walk *walk)
{
    number(tracer, x, y, sample, walk);
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
    struct imp_walk walk;
    number(tracer, x, y, sample, &walk);
    position(tracer, &walk, x, y, px, py);
}

enum imp_drop imp__drop_cause(imp_spec L)
{
    double sum = 0, largest = 0;
    for (int c = 0; c < 4; c++) {
        sum += L[c];
        largest = imp_max(fabs(L[c]), largest);
    }
    if (isnan(sum)) return IMP_DROP_NAN;
    return largest <= FLT_MAX ? IMP_DROP_NEGATIVE : IMP_DROP_INFINITE;
}

static inline __attribute__((always_inline)) void
walk_close(const struct imp_tracer *tracer, struct imp_walk *walk)
{
    imp__walk_value(tracer, walk, imp__walk_fold(walk));
}

void imp__walk_close(const struct imp_tracer *tracer, struct imp_walk *walk)
{
    walk_close(tracer, walk);
}

/* Walks and steps are begun field by field: compilers clear structs of this size by an
 * instruction that takes 2 % of a walk. Builds with assertions fill them first, so that a
 * field that was forgotten is found. */
#ifdef NDEBUG
#define FILL(p) ((void)0)
#else
#define FILL(p) memset((p), 0xff, sizeof *(p))
#endif

static inline __attribute__((always_inline)) void
walk_begin(const struct imp_tracer *tracer, int x, int y, int64_t sample,
           struct imp_walk *walk, double lens[2])
{
    const struct imp_sensor *sensor = tracer->sensor;
    FILL(walk);
    imp__walk_clear(walk);
    number(tracer, x, y, sample, walk);
    position(tracer, walk, x, y, &walk->px, &walk->py);
    lens[0] = imp__start_number(walk->key, walk->point, IMP_DIM_LENS_U);
    lens[1] = imp__start_number(walk->key, walk->point, IMP_DIM_LENS_V);
    imp__sensor_ray(sensor, walk->px, walk->py, lens, &walk->ray);
    walk->time = imp__walk_time(tracer, walk);
}

void imp__walk_begin(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                     struct imp_walk *walk, double lens[2])
{
    walk_begin(tracer, x, y, sample, walk, lens);
}

/* The first ray in flight. The states of guide and mixture are written where they
 * are evaluated, and read behind that only. */
static inline void step_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                              struct imp_walk *walk, imp_spec *scratch,
                              struct imp_step *s)
{
    FILL(s);
    s->tracer = tracer;
    s->scene = tracer->scene;
    s->walk = walk;
    s->arena = arena;
    s->recorded = !tracer->value_only || (tracer->active && tracer->active->body);
    s->scratch = scratch;
    s->depth = s->straight = 0;
    s->at.carried = walk->waves ? &walk->waves->carried : NULL;
    s->at.surface = NULL;
    s->at.prim = 0;
    s->cut = NULL;
    s->light_tree = tracer->integrator->light_tree ? tracer->scene->light_tree : NULL;
    s->segment = imp__segment_first(tracer);
    s->o = s->from = walk->ray.o;
    s->d = walk->ray.d;
    s->t_min = walk->ray.t_near;
    s->t_max = walk->ray.t_far;
    s->pdf = 0;
    s->beta = imp__spec(1);
    s->eta = 1;
    for (int c = 0; c < 4; c++) s->zeros[c] = 0;
    s->lanes = IMP_LANE_MIS_INIT;
    s->flight.medium = s->flight.here = NULL;
    s->flight.at = (imp_v3){0};
    s->flight.t = s->flight.base = s->flight.behind = 0;
    s->flight.fixed = false;
    s->flight.events = 0;
    s->flight.nest.around = s->flight.nest_here.around = NULL;
    s->flight.nest.n = s->flight.nest_here.n = 0;
    s->probing = NULL;
    s->graded = NULL;
    s->guided.guide = tracer->guide;
    s->guided.here = s->guided.left = false;
    s->guided.reference = 0;
    s->mixed.same = tracer->mixing != NULL;
    s->mixed.all = tracer->mixing ? tracer->mixing : tracer->integrator->mixes;
    s->mixed.here = s->mixed.splits = s->mixed.sphere = false;
    s->both = NULL;
}

void imp__light_walk_begin(const struct imp_tracer *tracer, struct imp_walk *walk,
                           struct imp_key key)
{
    FILL(walk);
    imp__walk_clear(walk);
    walk->key = key;
    walk->px = walk->py = 0;
    walk->point = (struct imp_point){0};
    walk->valid = true;
    walk->time = imp__walk_time(tracer, walk);
}

void imp__step_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                     struct imp_walk *walk, imp_spec *scratch, struct imp_step *s)
{
    step_begin(tracer, arena, walk, scratch, s);
}

void imp__walk_along(const struct imp_tracer *tracer, struct imp_arena *arena,
                     struct imp_key key, double time, const struct imp_sensor_ray *ray,
                     const struct imp_waves *waves, int depth, struct imp_hit *hit,
                     imp_v3 along, const struct imp_medium *medium, struct imp_walk *walk)
{
    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_step s;
    FILL(walk);
    imp__walk_clear(walk);
    walk->key = key;
    walk->point = (struct imp_point){0};
    walk->px = walk->py = 0;
    walk->ray = *ray;
    walk->depth = depth;
    walk->waves = waves;
    walk->time = time;
    step_begin(tracer, arena, walk, scratch, &s);
    s.depth = depth;
    if (imp_likely(s.segment->begin == NULL) || s.segment->begin(&s)) {
        s.flight.medium = s.flight.here = medium;
        if (hit) imp__walk_on_hit(&s, hit, along);
        else imp__walk_on(&s);
    }
    walk_close(tracer, walk);
}

void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk)
{
    const struct imp_sensor *sensor = tracer->sensor;
    if (imp_unlikely(tracer->kept != NULL)) {
        imp__walk_source(tracer)->walk(tracer, arena, x, y, sample, walk);
        return;
    }
    double lens[2];
    walk_begin(tracer, x, y, sample, walk, lens);

    if (imp_unlikely(tracer->wavelengths != NULL) &&
        !imp__walk_wave(tracer, arena, imp__wave_draw(tracer, walk, sample), walk))
        return;

    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_step s;
    step_begin(tracer, arena, walk, scratch, &s);
    struct imp_probing probing;
    if (imp_unlikely(tracer->active && tracer->active->medium) && s.recorded &&
        !tracer->collisions_fixed && tracer->integrator->media) {
        imp__probe_begin(walk, &probing);
        probing.scattered = imp__walk_scattered;
        s.probing = &probing;
    }
    if (imp_unlikely(sensor->shape != NULL)) imp__walk_on_meter(&s);
    else if (imp_likely(s.segment->begin == NULL) || s.segment->begin(&s))
        imp__walk_on(&s);
    if (imp_unlikely(s.probing != NULL)) imp__probe_follow(&s);

    walk_close(tracer, walk);
}
