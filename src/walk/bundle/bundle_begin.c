/* SPDX-License-Identifier: Apache-2.0
 *
 * The beginning of the walks of a bundle: numbers, and rays of the sensor. */
#include "depth.h"
#include "kind/kind_lanes.h"
#include "walk/core/lane_mis.h"
#include <string.h>

#define TAKE(p) ((p) = imp__arena_take(arena, n + IMP_COLUMN_SLACK, sizeof *(p)))

/* What walk k has from its ray alone. */
static inline void ray_put(struct imp_bundle *b, int k, struct imp_flights *rays)
{
    rays->pdf[k] = 0;
    imp__color_put(rays->beta, b->colors, k, imp__spec(1));
    rays->eta[k] = 1;
    rays->walk[k] = rays->up[k] = k;
    if (rays->left) rays->left[k] = (struct imp_light_place){.faces = false};
    if (rays->zeros) rays->zeros[k] = 0;
    if (rays->medium) {
        const struct imp_medium *m = b->tracer->sensor->medium;
        rays->medium[k] = m ? m->index : -1;
        rays->behind[k] = 0;
        imp__column_put(rays->ratio, k, imp__spec(1));
        rays->share[k] = 1;
    }
    b->time[k] = b->tracer->sensor->open;
}

static void key_put(struct imp_bundle *b, int k, const struct imp_walk *walk)
{
    if (imp_likely(!b->keys)) return;
    b->keys[k] = walk->key.state;
    b->drew[k] = imp__lane_drawn(walk->key, b->tracer->scene->channels);
}

bool imp__begin_alone(struct imp_bundle *b, struct imp_arena *arena, const int at[2],
                      int64_t sample, int k, struct imp_walk *walk)
{
    double lens[2];
    imp__walk_begin(b->tracer, at[0], at[1], sample, walk, lens);
    b->px[k] = walk->px;
    b->py[k] = walk->py;
    b->time[k] = walk->time;
    b->set[k] = b->tracer->points ? walk->point.set : walk->key.state;
    b->index[k] = walk->point.index;
    key_put(b, k, walk);
    if (imp_likely(!b->waves)) return true;
    const bool ok =
        imp__walk_wave(b->tracer, arena, imp__wave_draw(b->tracer, walk, sample), walk);
    b->waves[k] = walk->waves;
    return ok;
}

/* One by one. *begin: none has a near end. False: no memory. */
static bool rays_alone(struct imp_bundle *b, struct imp_arena *arena, const int (*xy)[2],
                       int n_samples, const int64_t *samples, struct imp_flights *rays,
                       bool *begin)
{
    *begin = true;
    for (int k = 0; k < b->n; k++) {
        struct imp_walk own, *walk = b->walks ? &b->walks[k] : &own;
        if (!imp__begin_alone(b, arena, xy[k / n_samples], samples[k % n_samples], k,
                              walk))
            return false;
        ray_put(b, k, rays);
        b->time[k] = walk->time;
        imp__column_put(rays->ray.o, k, walk->ray.o);
        imp__column_put(rays->ray.d, k, walk->ray.d);
        rays->ray.near[k] = walk->ray.t_near;
        rays->ray.far[k] = walk->ray.t_far;
        imp__column_put(rays->from, k, walk->ray.o);
        *begin &= walk->ray.t_near == 0;
    }
    return true;
}

/* The beginning of a record, whose numbers and ray are made. */
static void record_begin(struct imp_bundle *b, const struct imp_flights *rays, int k)
{
    struct imp_walk *walk = &b->walks[k];
    walk->px = b->px[k];
    walk->py = b->py[k];
    walk->time = b->time[k];
    walk->ray = (struct imp_sensor_ray){.o = imp__column_v3(rays->ray.o, k),
                                        .d = imp__column_v3(rays->ray.d, k),
                                        .t_near = rays->ray.near[k],
                                        .t_far = rays->ray.far[k]};
}

/* What wavelengths are drawn from: keys before they are mixed; of each walk a number, and one of its
 * lanes. */
struct draws {
    uint64_t *key;
    double *u, *lane;
};

/* Where its random numbers come from. */
static void numbers_of(struct imp_bundle *b, const int at[2], int64_t sample, int k,
                       struct draws *draws)
{
    struct imp_walk own, *walk = b->walks ? &b->walks[k] : &own;
    if (b->walks) imp__walk_clear(walk);
    imp__walk_numbers(b->tracer, at[0], at[1], sample, walk);
    b->set[k] = b->tracer->points ? walk->point.set : walk->key.state;
    key_put(b, k, walk);
    if (b->waves && b->tracer->set > 1)
        draws->u[k] = imp__wave_draw(b->tracer, walk, sample);
}

/* imp__wave_draw where walks are in no set, and imp__lane_drawn, of the walks at[lanes]; block: of
 * their points. */
static void draws_put(const struct imp_tracer *t, const struct imp_wide_block *block,
                      const int32_t *at, int i, struct draws *draws)
{
    struct imp_wide_block keys = imp__wide_block(NULL, draws->key, NULL, at, 0);
    const int n = t->wavelengths->lanes;
    keys.hash = imp__wide_mix64(keys.hash);
    const imp_wide lane =
        imp__wide_floor(imp__wide_number(&keys, imp__dim_start(IMP_DIM_LANE)) * n);
    imp__wide_store(&draws->lane[i], imp__wide_lesser(lane, imp__wide(n - 1)));
    if (t->set > 1) return;
    imp_wide u = imp__wide_number(&keys, imp__dim_start(IMP_DIM_WAVELENGTH));
    if (t->points && t->stratified)
        u = (imp__wide_floor(n * u) + imp__wide_number(block, IMP_SLOT_WAVELENGTH)) / n;
    imp__wide_store(&draws->u[i], u);
}

/* The wavelengths that are drawn so. False: no memory. */
static bool waves_put(struct imp_bundle *b, struct imp_arena *arena,
                      const struct draws *draws)
{
    struct imp_waves *all = imp__arena_take(arena, (size_t)b->n, sizeof *all);
    for (int k = 0; all && k < b->n; k++) {
        imp__waves_make(b->tracer->wavelengths, draws->u[k], &all[k]);
        all[k].drew = (int)draws->lane[k];
        b->waves[k] = &all[k];
        if (!b->walks) continue;
        b->walks[k].wave = draws->u[k];
        b->walks[k].waves = &all[k];
    }
    return all;
}

/* In lanes, of a sensor whose shutter is open for an instant. */
static bool rays_in_lanes(struct imp_bundle *b, struct imp_arena *arena,
                          const struct imp_sensor_lanes *lanes, const int (*xy)[2],
                          int n_samples, const int64_t *samples, struct imp_flights *rays,
                          bool *begins)
{
    const struct imp_tracer *t = b->tracer;
    const struct imp_film_desc *film = &t->sensor->film;
    /* More than the set's numbers. */
    const bool each = !t->points || (b->waves && t->set > 1) || b->walks || b->keys;
    const size_t n = (size_t)b->n;
    bool begin = true;
    struct draws draws = {0};
    uint64_t pixel = 0;
    if (b->waves && (!TAKE(draws.key) || !TAKE(draws.u) || !TAKE(draws.lane)))
        return false;
    for (int k = 0, s = 0, p = 0; k < b->n; k++) {
        const int *at = xy[p];
        const bool first =
            s == 0 || samples[s] / IMP_SET_POINTS != samples[s - 1] / IMP_SET_POINTS;
        if (each || first) numbers_of(b, at, samples[s], k, &draws);
        if (!each && !first) b->set[k] = b->set[k - 1];
        if (b->waves) {
            if (s == 0) pixel = imp__walk_pixel(t, at[0], at[1]);
            draws.key[k] = pixel ^ ((uint64_t)samples[s] + IMP_KEY_SAMPLE);
        }
        b->index[k] = (uint32_t)samples[s] % IMP_SET_POINTS;
        b->px[k] = film->crop_x + at[0];
        b->py[k] = film->crop_y + at[1];
        ray_put(b, k, rays);
        if (++s < n_samples) continue;
        s = 0;
        p++;
    }
    for (int i = 0; i < b->n; i += IMP_WIDE_LANES) {
        int32_t at[IMP_WIDE_LANES];
        struct imp_wide_ray r;
        for (int k = 0; k < IMP_WIDE_LANES; k++) at[k] = imp_min(i + k, b->n - 1);
        const struct imp_wide_block block =
            imp__wide_block(t->points, b->set, b->index, at, 0);
        const imp_wide px = imp__wide_load(&b->px[i]) +
                            imp__wide_number(&block, IMP_DIM_PIXEL_X),
                       py = imp__wide_load(&b->py[i]) +
                            imp__wide_number(&block, IMP_DIM_PIXEL_Y);
        if (b->waves) draws_put(t, &block, at, i, &draws);
        lanes->ray(t->sensor, px, py, &r);
        imp__wide_store(&b->px[i], px);
        imp__wide_store(&b->py[i], py);
        imp__wide3_store(rays->ray.o, i, r.o);
        imp__wide3_store(rays->ray.d, i, r.d);
        imp__wide3_store(rays->from, i, r.o);
        imp__wide_store(&rays->ray.near[i], r.near);
        imp__wide_store(&rays->ray.far[i], r.far);
        begin &= !(imp__wide_bits(r.near != imp__wide(0)) & imp__bits_first(b->n - i));
    }
    if (b->waves && !waves_put(b, arena, &draws)) return false;
    for (int k = 0; b->walks && k < b->n; k++) record_begin(b, rays, k);
    *begins = begin;
    return true;
}

bool imp__camera_begin(struct imp_arena *arena, struct imp_bundle *b, const int (*xy)[2],
                       int n_samples, const int64_t *samples, struct imp_flights *rays)
{
    const size_t n = (size_t)b->n;
    const bool instant = !rays->ray.time;
    const struct imp_sensor_lanes *lanes =
        instant ? imp__sensor_lanes(b->tracer->sensor) : NULL;
    if (!TAKE(rays->ray.near)) return false;
    bool begin = true;
    if (!(lanes ? rays_in_lanes(b, arena, lanes, xy, n_samples, samples, rays, &begin)
                : rays_alone(b, arena, xy, n_samples, samples, rays, &begin)))
        return false;
    rays->ray.n = b->n;
    if (!instant) memcpy(rays->ray.time, b->time, n * sizeof *b->time);
    if (begin) rays->ray.near = NULL;
    return true;
}
