/* SPDX-License-Identifier: Apache-2.0
 *
 * Readings of a design's grids: with one lamp at a time, and with the lamps of an answer. */
#include "base/arguments.h"
#include "designing.h"
#include "inverse/estimate/lamp_levels.h"
#include "kind/sensor/receiver.h"
#include "math/rng.h"
#include <math.h>

#define SEED 0x3de5

enum imp_status imp__design_reading_make(struct imp__design_model *m,
                                         struct imp__design_reading *r)
{
    r->value = imp__arena_array(m->arena, 2 * m->n_points, sizeof *r->value);
    r->average = imp__arena_array(m->arena, m->n_grids, sizeof *r->average);
    if (!r->value || !r->average)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for readings");
    r->se = r->value + m->n_points;
    r->freedom = INFINITY;
    return IMP_OK;
}

static int progress(const struct imp_progress *p, void *payload)
{
    const struct imp__design_model *m = payload;
    struct imp_progress own = *p;
    own.stage = "design";
    own.fraction = fmin((m->done + p->fraction) / m->whole, 1);
    own.eta_s = -1;
    return m->run.progress(&own, m->run.progress_payload);
}

/* All grids at the levels of the emitters, added to `out`: values, and squares of errors. */
static enum imp_status grids_add(struct imp__design_model *m, const double *level,
                                 uint64_t seed, double *work,
                                 struct imp__design_reading *out)
{
    enum imp_status st = IMP_OK;
    struct imp__lamp_levels levels = {0};
    IMP_TRY(imp__lamp_levels_begin(m->scene, level, &levels));
    for (size_t g = 0; g < m->n_grids; g++) {
        const struct imp__design_grid *grid = &m->grid[g];
        struct imp_run run = m->run;
        struct imp_estimate average;
        int64_t sets;
        run.sensor = grid->sensor;
        run.seed = imp__mix64(seed + g);
        if (run.progress) {
            run.progress = progress;
            run.progress_payload = m;
        }
        IMP_TRY(imp_grid_read(m->scene, &run, work, work + grid->n, &average, &sets));
        m->done++;
        out->freedom = fmin(out->freedom, (double)sets - 1);
        out->average[g].value += average.value;
        out->average[g].se += average.se * average.se;
        for (size_t i = 0; i < grid->n; i++) {
            out->value[grid->first + i] += work[i];
            out->se[grid->first + i] += work[grid->n + i] * work[grid->n + i];
        }
    }
out:
    imp__lamp_levels_end(&levels);
    return st;
}

/* The mean of so many readings, and its errors, from their sums. */
static void mean_take(const struct imp__design_model *m, int repeats,
                      struct imp__design_reading *r)
{
    for (size_t i = 0; i < m->n_points; i++) {
        r->value[i] /= repeats;
        r->se[i] = sqrt(r->se[i]) / repeats;
    }
    for (size_t g = 0; g < m->n_grids; g++) {
        r->average[g].value /= repeats;
        r->average[g].se = sqrt(r->average[g].se) / repeats;
    }
    r->freedom *= repeats;
}

static enum imp_status levels_read(struct imp__design_model *m, const double *level,
                                   uint64_t seed, int repeats,
                                   struct imp__design_reading *out)
{
    enum imp_status st = IMP_OK;
    double *work = imp__alloc(m->ctx, 2 * m->n_points + 1, sizeof *work);
    if (!work) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for readings");
    for (int k = 0; k < repeats; k++)
        IMP_TRY(grids_add(m, level, imp__mix64(seed + 0x10000 * (uint64_t)k), work, out));
    mean_take(m, repeats, out);
out:
    imp__release(m->ctx, work);
    return st;
}

static bool is_lamp(const struct imp__design_model *m, int emitter)
{
    for (size_t j = 0; j < m->n; j++)
        if (m->emitter[j] == emitter) return true;
    return false;
}

/* Levels of all emitters with lamp j alone, or, with j = m->n, with all that are no lamps. */
static void levels_set(const struct imp__design_model *m, size_t j, double *level)
{
    for (int e = 0; e < m->scene->n_emitters; e++)
        level[e] = j < m->n ? e == m->emitter[j] : is_lamp(m, e) ? 0 : NAN;
}

static bool has_others(const struct imp__design_model *m)
{
    return (size_t)m->scene->n_emitters > m->n;
}

/* One lamp at a time: no walk has to choose among lamps, and errors of lamps are independent. */
enum imp_status imp__design_read(struct imp__design_model *m, const double *x,
                                 uint64_t seed, int repeats,
                                 struct imp__design_reading *out)
{
    enum imp_status st = IMP_OK;
    struct imp__design_reading one;
    double *level = imp__alloc(m->ctx, (size_t)m->scene->n_emitters + 1, sizeof *level);
    if (!level) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for levels");
    IMP_TRY(imp__design_reading_make(m, out));
    for (size_t j = 0; j <= m->n; j++) {
        const double share = j < m->n ? x[j] : has_others(m);
        const uint64_t own = imp__mix64(imp__mix64(m->run.seed ^ imp__mix64(seed)) + j);
        if (share == 0) continue;
        levels_set(m, j, level);
        IMP_TRY(imp__design_reading_make(m, &one));
        IMP_TRY(levels_read(m, level, own, repeats, &one));
        for (size_t i = 0; i < m->n_points; i++) {
            out->value[i] += share * one.value[i];
            out->se[i] = hypot(out->se[i], share * one.se[i]);
        }
        for (size_t g = 0; g < m->n_grids; g++) {
            out->average[g].value += share * one.average[g].value;
            out->average[g].se = hypot(out->average[g].se, share * one.average[g].se);
        }
        out->freedom = fmin(out->freedom, one.freedom);
    }
out:
    imp__release(m->ctx, level);
    return st;
}

/* ---- Observers ------------------------------------------------------------------------ */

static enum imp_status observers_look(struct imp__design_model *m,
                                      const struct imp__design_grid *g, double *place)
{
    const struct imp_receiver *r = m->scene->sensors[g->sensor]->receiver;
    const imp_v3 sight = imp__to_world(&r->frame, r->facing);
    IMP_CHECKED(imp_grid_points(m->scene, g->sensor, place, NULL));
    for (size_t i = 0; i < g->n; i++) {
        const size_t p = g->first + i;
        const imp_v3 eye = imp__v3(place[3 * i], place[3 * i + 1], place[3 * i + 2]);
        for (int e = 0; e < m->scene->n_emitters; e++) {
            const struct imp_emitter *emitter = m->scene->emitters[e];
            struct imp__glare_seen s;
            if (!imp__glare_look(m->scene, emitter, eye, sight, r->frame.n, &s)) continue;
            IMP_CHECKED(imp__glare_area_check(m->scene, emitter, &s));
            const double ratio = s.source.luminance / s.source.position;
            double *source = &m->base_source[p], *direct = &m->base_direct[p];
            for (size_t j = 0; j < m->n; j++)
                if (m->emitter[j] == e) {
                    source = &m->source[p * m->n + j];
                    direct = &m->direct[p * m->n + j];
                }
            *source += ratio * ratio * s.source.solid_angle;
            *direct += s.direct;
        }
    }
    return IMP_OK;
}

enum imp_status imp__design_observe(struct imp__design_model *m)
{
    enum imp_status st = IMP_OK;
    m->source = imp__arena_array(m->arena, m->n_points * m->n, sizeof *m->source);
    m->direct = imp__arena_array(m->arena, m->n_points * m->n, sizeof *m->direct);
    m->base_source = imp__arena_array(m->arena, m->n_points, sizeof *m->base_source);
    m->base_direct = imp__arena_array(m->arena, m->n_points, sizeof *m->base_direct);
    double *place = imp__alloc(m->ctx, 3 * m->n_points + 1, sizeof *place);
    if (!m->source || !m->direct || !m->base_source || !m->base_direct || !place)
        IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for observers"));
    for (size_t g = 0; g < m->n_grids; g++)
        if (m->grid[g].rated) IMP_TRY(observers_look(m, &m->grid[g], place));
out:
    imp__release(m->ctx, place);
    return st;
}

enum imp_status imp__design_response(struct imp__design_model *m, size_t j)
{
    struct imp__design_reading *r = j < m->n ? &m->with[j] : &m->base;
    const uint64_t seed = imp__mix64(m->run.seed ^ imp__mix64(SEED + j));
    IMP_CHECKED(imp__design_reading_make(m, r));
    if (j == m->n && !has_others(m)) return IMP_OK;
    double *level = imp__alloc(m->ctx, (size_t)m->scene->n_emitters + 1, sizeof *level);
    if (!level) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for responses");
    levels_set(m, j, level);
    const enum imp_status st = levels_read(m, level, seed, 1, r);
    imp__release(m->ctx, level);
    return st;
}

enum imp_status imp__design_responses(struct imp__design_model *m)
{
    m->with = imp__arena_array(m->arena, m->n, sizeof *m->with);
    if (!m->with) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for responses");
    for (size_t j = 0; j <= m->n; j++) IMP_CHECKED(imp__design_response(m, j));
    return imp__design_observe(m);
}
