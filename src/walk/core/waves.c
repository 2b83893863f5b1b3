/* SPDX-License-Identifier: Apache-2.0
 *
 * Wavelengths of a walk: drawn at its start, the same for all its vertices. */
#include "lane_mis.h"
#include "walk.h"

/* Default number of walks in a set: there are at least four sets, whose spread is the
 * standard error. */
#define SET_MAX   16
#define SET_TIMED 4 /* where it is not known how many there will be */
/* Sets of points of a pixel, at least; and the degrees of freedom that the errors of all pixels
 * together have, at least, in sets of four points or more. */
#define SETS    4
#define FREEDOM 16

static int set_default(int64_t n)
{
    return n > 0 ? (int)imp_clamp(n / 4, (int64_t)1, (int64_t)SET_MAX) : SET_TIMED;
}
/* The same of points, which gain with the size of a set. */
static int set_of_points(const struct imp_film_desc *film, int64_t n, bool whole)
{
    if (n <= 0) return SET_TIMED;
    const double pixels = (double)film->crop_w * film->crop_h;
    const int64_t free = imp_min((int64_t)ceil(FREEDOM / pixels) + 1, n / 4);
    const int64_t full = (n - 1) / IMP_SET_POINTS + 1;
    const int64_t sets = whole ? full : imp_max(imp_max(full, free), (int64_t)SETS);
    return (int)imp_max(n / sets, (int64_t)1);
}
static int set_of(const struct imp_run *run, int64_t n)
{
    if (run->wavelengths == IMP_WAVELENGTHS_INDEPENDENT) return 1;
    if (run->wavelength_set > 0)
        return n > 0 ? (int)imp_min((int64_t)run->wavelength_set, n)
                     : run->wavelength_set;
    return set_default(n);
}

void imp__tracer_numbers(struct imp_tracer *tracer, const struct imp_run *run, int64_t n)
{
    const struct imp_scene *scene = tracer->scene;
    const struct imp_wavelengths *all = scene->wavelengths;
    const struct imp_sensor *sensor = scene->sensors[run->sensor];
    tracer->points =
        imp__points_of(sensor, run) == IMP_POINTS_SOBOL ? imp__points() : NULL;
    tracer->whole = run->points == IMP_POINTS_WHOLE;
    if (!all) return;
    const int drawn = run->wavelengths == IMP_WAVELENGTHS_IMPORTANCE
                          ? IMP_WAVES_IMPORTANCE
                          : IMP_WAVES_UNIFORM;
    tracer->wavelengths = all + (size_t)run->sensor * IMP_WAVES_DRAWN + drawn;
    tracer->set = n == 1 || tracer->points ? 1 : set_of(run, n);
    tracer->stratified = run->wavelengths != IMP_WAVELENGTHS_INDEPENDENT;
    tracer->period = n;
}

int imp__tracer_set(const struct imp_tracer *tracer, int64_t n)
{
    if (tracer->kept && imp__walk_source(tracer)->set > 0)
        return imp__walk_source(tracer)->set;
    if (tracer->set > 1) return tracer->set;
    return tracer->points ? set_of_points(&tracer->sensor->film, n, tracer->whole) : 1;
}

double imp__sensor_time(const struct imp_sensor *s, double u)
{
    if (!(s->close > s->open)) return s->open;
    if (s->course) return imp__course_draw(s->course, s->open, s->close, u);
    return s->open + u * (s->close - s->open);
}

/* Walk k of a set of n covers the k-th of n parts of [0, 1); of a hero with C wavelengths
 * the k-th of n parts of one of the C equal ranges, chosen at random: its companions
 * cover the others. */
double imp__walk_time(const struct imp_tracer *tracer, const struct imp_walk *walk)
{
    const struct imp_sensor *s = tracer->sensor;
    if (imp_likely(!(s->close > s->open))) return s->open;
    const double u = walk->point.points
                         ? imp__point_number(walk->point, 0, IMP_SLOT_TIME)
                         : imp__u01(walk->key, imp__dim_start(IMP_DIM_TIME));
    return imp__sensor_time(s, u);
}

double imp__wave_draw(const struct imp_tracer *tracer, const struct imp_walk *walk,
                      int64_t sample)
{
    const double u = imp__u01(walk->key, imp__dim_start(IMP_DIM_WAVELENGTH));
    const int C = tracer->wavelengths->lanes;
    if (tracer->set <= 1 && walk->point.points && tracer->stratified)
        return (floor(C * u) + imp__point_number(walk->point, 0, IMP_SLOT_WAVELENGTH)) /
               C;
    if (tracer->set <= 1) return u;
    int64_t first, n;
    imp__set_at(tracer->set, tracer->period, sample, &first, &n);
    const int64_t k = sample - first;
    const double range = floor(C * u), part = C * u - range;
    return imp_min((range + ((double)k + part) / (double)n) / C, 0x1.fffffffffffffp-1);
}

bool imp__walk_wave(const struct imp_tracer *tracer, struct imp_arena *arena, double u,
                    struct imp_walk *walk)
{
    struct imp_waves *waves = imp__arena_take(arena, 1, sizeof *waves);
    if (!waves) {
        walk->dropped = IMP_DROP_MEMORY;
        return false;
    }
    imp__waves_make(tracer->wavelengths, u, waves);
    waves->drew = imp__lane_drawn(walk->key, tracer->wavelengths->lanes);
    walk->wave = u;
    walk->waves = waves;
    return true;
}
