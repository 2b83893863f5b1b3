/* SPDX-License-Identifier: Apache-2.0
 *
 * One stage: which numbers it fits, the fit, and what it has come to. */
#include "base/arguments.h"
#include "inverse/problem/match.h"
#include "math/rng.h"
#include "measuring.h"
#include "scene/pose.h"
#include <importon/clip.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SEED       0x57a6e
#define ITERATIONS 12 /* of a stage that is not the last fit */
#define COMPARE    0xc03a
#define LEVELS     4    /* of cameras, in the first round, ... */
#define ACROSS     8    /* ... through tents of at most this part of a photograph */
#define TEXTURE    4    /* levels of textures */
#define NEVER      1e30 /* a level that no value reaches */
#define SEARCHES                                                                         \
    5 /* of the last fit, at most, with decisions on clipped values before each, */
#define CAMERAS 2 /* of cameras; one of the other stages */
#define DOUBT   3 /* errors of chi-square above 1 from which on a stage is not explained */

/* ---- Which numbers --------------------------------------------------------------------- */

/* While cameras are found, all numbers but textures go along: contrasts between wrong paints would
 * turn the cameras. So they do with lenses, and cameras with them, as a place looks like a principal
 * point. A lens that is far off keeps its place while cameras are, which blurred pictures show without
 * it. Films' numbers go along with lights. */
static bool is_along(const struct imp__measure *m, enum imp_measure_stage stage, size_t k)
{
    if (stage == IMP_MEASURE_CAMERAS && m->stage[k] == IMP_MEASURE_LENS) return false;
    if (stage <= IMP_MEASURE_LENS) return m->stage[k] < IMP_MEASURE_TEXTURES;
    return stage == IMP_MEASURE_LIGHTS && m->stage[k] == IMP_MEASURE_EXPOSURE;
}

/* While films are found, all measured lights keep their ratios. */
static bool is_tied(const struct imp__measure *m, enum imp_measure_stage stage, size_t k)
{
    const struct imp_param *q = &m->scene->params[k];
    bool shines = false;
    if (stage != IMP_MEASURE_EXPOSURE || m->stage[k] != IMP_MEASURE_LIGHTS ||
        !imp__measure_shines(m, k) || imp__measure_holds(m, k))
        return false;
    for (size_t e = 0; e < q->info.count; e++) shines |= imp__param_get(q, e) > 0;
    return shines && !strpbrk(q->info.name, "*?[],");
}

static enum imp_status lights_tie(struct imp__measure *m, enum imp_measure_stage stage,
                                  imp_problem *p)
{
    size_t room = 1, n = 0;
    for (size_t k = 0; k < m->scene->n_params; k++)
        if (is_tied(m, stage, k)) room += strlen(m->scene->params[k].info.name) + 1;
    if (room == 1) return IMP_OK;
    char *globs = imp__alloc(m->ctx, room, 1);
    if (!globs) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a stage");
    for (size_t k = 0; k < m->scene->n_params; k++)
        if (is_tied(m, stage, k))
            n += (size_t)snprintf(globs + n, room - n, "%s%s", n ? "," : "",
                                  m->scene->params[k].info.name);
    const enum imp_status st = imp_problem_tie(p, globs, IMP_TIE_FACTOR);
    imp__release(m->ctx, globs);
    return st;
}

/* Exposures move as logarithms. */
static enum imp_status exposures_tie(struct imp__measure *m, imp_problem *p)
{
    for (size_t i = 0; i < m->n_photos; i++) {
        size_t k;
        const struct imp_param *q =
            imp__measure_film_number(m, &m->photos[i], "exposure", &k);
        if (!q || !p->chosen[k] || !(imp__param_get(q, 0) > 0) ||
            imp__measure_holds(m, k) || strpbrk(q->info.name, "*?[],"))
            continue;
        IMP_CHECKED(imp_problem_tie(p, q->info.name, IMP_TIE_LOG));
    }
    return IMP_OK;
}

/* Until the last fit, pixels have robust weights; where noise varies, those of their noise. weights
 * [n_pixels]. */
static void weights_make(const struct imp__photo *p, bool last, float *weights)
{
    const size_t C = (size_t)p->desc.channels;
    for (size_t i = 0; i < p->n_pixels; i++) {
        double variance = 0;
        weights[i] = last ? p->weights[i] : p->weights[i] * p->robust[i];
        for (size_t c = 0; c < C; c++)
            variance += imp__sqr((double)p->noise_se[i * C + c]) / (double)C;
        if (imp__measure_noise_varies(p))
            weights[i] *= (float)(p->noise * p->noise / variance);
    }
}

/* The photograph's values without what its noise adds to their means; those that are clipped, and others, stay
 * so. values [n_values]. */
static void values_make(const struct imp__photo *p, float *values)
{
    const struct imp_photo *d = &p->desc;
    const float low = (float)d->low, high = (float)d->high;
    for (size_t i = 0; i < p->n_values; i++) {
        const float T = d->pixels[i];
        values[i] = T - p->lift[i];
        if (!d->clipped) continue;
        if (T <= low || T >= high) values[i] = T;
        else
            values[i] =
                imp_clamp(values[i], nextafterf(low, high), nextafterf(high, low));
    }
}

/* Levels also where nothing was clipped: pictures of the start then say how well walks know each value,
 * and a power is expanded about what the scene has. */
static enum imp_status target_add(struct imp__measure *m, imp_problem *p, size_t i,
                                  bool last)
{
    enum imp_status st = IMP_OK;
    const struct imp__photo *photo = &m->photos[i];
    const struct imp_photo *d = &photo->desc;
    struct imp_target t = IMP_TARGET_INIT;
    float *weights = NULL, *values = NULL;
    t.sensor = d->sensor;
    t.width = d->width;
    t.height = d->height;
    t.channels = d->channels;
    t.pixels = d->pixels;
    t.weights = d->weights || photo->n_masked > 0 ? photo->weights : NULL;
    t.noise_se = photo->noise_se;
    t.scale = 1 / (photo->noise * photo->noise);
    if (!last || imp__measure_noise_varies(photo)) {
        weights = imp__alloc(m->ctx, photo->n_pixels, sizeof *weights);
        if (!weights) IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for a stage"));
        weights_make(photo, last, weights);
        t.weights = weights;
    }
    if (imp__measure_noise_varies(photo)) {
        values = imp__alloc(m->ctx, photo->n_values, sizeof *values);
        if (!values) IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for a stage"));
        values_make(photo, values);
        t.pixels = values;
    }
    st = imp_problem_add_target(p, &t);
    if (st != IMP_OK) IMP_TRY(imp__error_prefix(m->ctx, st, "%s", photo->name));
    IMP_TRY(imp_problem_clip(p, (int)i, d->clipped ? d->low : -NEVER,
                             d->clipped ? d->high : NEVER));
out:
    imp__release(m->ctx, weights);
    imp__release(m->ctx, values);
    return st;
}

/* Numbers of materials that have no bound above (roughnesses, extinctions) move as logarithms, too: a step
 * that takes a roughness to nearly nothing ends where few pixels tell of it, and no derivative
 * leads back. */
static enum imp_status sizes_tie(struct imp__measure *m, imp_problem *p)
{
    for (size_t k = 0; k < m->scene->n_params; k++) {
        const struct imp_param *q = &m->scene->params[k];
        bool positive = m->stage[k] == IMP_MEASURE_MATERIALS && p->chosen[k] &&
                        !isfinite(q->info.hi) && q->info.lo >= 0;
        for (size_t e = 0; e < q->info.count; e++) positive &= imp__param_get(q, e) > 0;
        if (!positive || imp__measure_holds(m, k) || strpbrk(q->info.name, "*?[],"))
            continue;
        IMP_CHECKED(imp_problem_tie(p, q->info.name, IMP_TIE_LOG));
    }
    return IMP_OK;
}

static enum imp_status problem_make(struct imp__measure *m, enum imp_measure_stage stage,
                                    bool last, imp_problem **out)
{
    enum imp_status st = IMP_OK;
    imp_problem *p = NULL;
    uint8_t *chosen = imp__alloc(m->ctx, m->scene->n_params + 1, 1);
    if (!chosen) IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for a stage"));
    for (size_t k = 0; k < m->scene->n_params; k++)
        chosen[k] = imp__measure_has(m, stage, k) || is_along(m, stage, k) ||
                    is_tied(m, stage, k);
    IMP_TRY(imp_problem_create(m->scene, &p));
    IMP_TRY(imp__problem_layout(p, chosen));
    if (m->held) IMP_TRY(imp__problem_hold_marked(p, m->held));
    IMP_TRY(lights_tie(m, stage, p));
    IMP_TRY(exposures_tie(m, p));
    IMP_TRY(sizes_tie(m, p));
    for (size_t i = 0; i < m->n_photos; i++) IMP_TRY(target_add(m, p, i, last));
    p->near_searches = stage == IMP_MEASURE_TOGETHER ? SEARCHES
                       : stage <= IMP_MEASURE_LENS   ? CAMERAS
                                                     : 1;
    *out = p;
    p = NULL;
out:
    imp_problem_destroy(p);
    imp__release(m->ctx, chosen);
    return st;
}

/* ---- The fit --------------------------------------------------------------------------- */

/* Cameras are compared through wide filters first, in the first round. */
static int levels_of(const struct imp__measure *m, enum imp_measure_stage stage,
                     int round)
{
    int levels = 1;
    if (stage == IMP_MEASURE_TEXTURES) return m->joined ? 0 : TEXTURE;
    if (stage != IMP_MEASURE_CAMERAS || round > 1) return 0;
    for (size_t i = 0; i < m->n_photos; i++) {
        const struct imp_photo *d = &m->photos[i].desc;
        int own = 1;
        while (own < LEVELS && ACROSS << own <= imp_min(d->width, d->height)) own++;
        levels = imp_max(levels, own);
    }
    return levels;
}

/* Where its own stage has left each number. */
static void places_note(struct imp__measure *m, enum imp_measure_stage stage,
                        const imp_problem *p)
{
    if (stage == IMP_MEASURE_TOGETHER) return;
    for (size_t i = 0; i < p->n; i++) {
        const struct imp__block *b = imp__problem_block(p, i);
        struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
        if (imp__block_factor(p, b) || !imp__measure_has(m, stage, b->param) ||
            imp_problem_get_fit_variable(p, i, &v) != IMP_OK)
            continue;
        const size_t at = m->scene->params[b->param].info.offset + (i - b->first);
        m->at[at] = v.value;
        m->at_se[at] = isfinite(v.se) && v.determined ? v.se : 0;
    }
}

/* Photographs beside pictures after so many fits: fits of photographs with a gamma estimate their
 * noise from what is left, and have no chi-square of their own. */
static enum imp_status photos_look(struct imp__measure *m, size_t fits)
{
    for (size_t i = 0; i < m->n_photos; i++)
        IMP_CHECKED(
            imp__measure_residual(m, &m->photos[i], COMPARE + 64 * (uint64_t)fits + i));
    m->looked = true;
    return IMP_OK;
}

enum imp_status imp__measure_look(struct imp__measure *m)
{
    return m->looked ? IMP_OK : photos_look(m, m->n_rows);
}

void imp__measure_judge(const struct imp__measure *m, double own_part,
                        struct imp_measure_row *row)
{
    double sum = 0, variance = 0, values = 0, noise_of = 0;
    for (size_t i = 0; i < m->n_photos; i++) {
        const struct imp__photo *p = &m->photos[i];
        const double n = (double)p->n_compared;
        if (!(n > 0)) continue;
        sum += n * p->chi2;
        variance += imp__sqr(n * p->chi2_se);
        noise_of += n * p->noise_of;
        values += n;
    }
    const double freedom = fmax(values - (double)row->n, 1);
    const double n = (double)row->n,
                 own = isfinite(own_part) ? own_part * n / freedom : 0;
    row->chi2 = sum / freedom - own;
    row->chi2_se =
        hypot(hypot(sqrt(variance), noise_of) / freedom, n > 0 ? own * sqrt(2 / n) : 0);
    row->explained = values > 0 && row->chi2 - 1 < DOUBT * row->chi2_se &&
                     row->chi2_se < IMP_MEASURE_BLIND;
}

static enum imp_status row_add(struct imp__measure *m, enum imp_measure_stage stage,
                               int round, const struct imp_fit_result *r)
{
    struct imp_measure_row *rows =
        imp__grow(m->ctx, m->rows, &m->cap_rows, m->n_rows + 1, sizeof *rows);
    if (!rows) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a stage");
    m->rows = rows;
    struct imp_measure_row *row = &rows[m->n_rows];
    *row = (struct imp_measure_row){.size = sizeof *row,
                                    .round = round,
                                    .stage = stage,
                                    .n = r->n,
                                    .iterations = r->iterations,
                                    .residual = r->residual,
                                    .residual_hi = r->residual_hi};
    IMP_CHECKED(photos_look(m, m->n_rows + 1));
    m->own_part = r->own_part;
    imp__measure_judge(m, m->own_part, row);
    m->n_rows++;
    return imp__measure_say(
        m,
        "round %d, %s: %zu number%s, %d iteration%s: residual %.3g %%, "
        "chi-square per degree of freedom %.3g +- %.2g, %s",
        round, imp_measure_stage_name(stage), r->n, r->n == 1 ? "" : "s", r->iterations,
        r->iterations == 1 ? "" : "s", 100 * r->residual, row->chi2, row->chi2_se,
        row->explained ? "explained" : "not explained");
}

enum imp_status imp__measure_judge_again(struct imp__measure *m)
{
    struct imp_measure_row *row = &m->rows[m->n_rows - 1];
    m->looked = false;
    IMP_CHECKED(imp__measure_look(m));
    imp__measure_judge(m, m->own_part, row);
    return imp__measure_say(m,
                            "round %d, %s: by this noise chi-square is %.3g +- %.2g, %s",
                            row->round, imp_measure_stage_name(row->stage), row->chi2,
                            row->chi2_se, row->explained ? "explained" : "not explained");
}

enum imp_status imp__measure_fit(struct imp__measure *m, enum imp_measure_stage stage,
                                 int round, imp_problem **problem,
                                 const struct imp_fit_result **result)
{
    enum imp_status st = IMP_OK;
    imp_problem *p = NULL;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = m->run;
    const struct imp_fit_result *r = NULL;
    const char *name = imp_measure_stage_name(stage);
    run.seed = imp__mix64(m->run.seed ^ (SEED + 16 * (uint64_t)round + (uint64_t)stage));
    const bool many = stage == IMP_MEASURE_TEXTURES && !m->joined;
    o.optimizer = many ? IMP_ADAM : IMP_LM;
    o.intervals = !many;
    o.max_iterations = m->o.max_iterations ? m->o.max_iterations
                       : problem           ? 0
                                           : ITERATIONS;
    if (many) o.max_iterations = m->o.max_iterations;
    o.levels = levels_of(m, stage, round);
    IMP_TRY(imp__measure_look(m));
    IMP_TRY(problem_make(m, stage, stage == IMP_MEASURE_TOGETHER && !m->doubtful, &p));
    st = imp_fit(p, &o, &run, &r);
    if (st != IMP_OK && st != IMP_CANCELLED)
        IMP_TRY(imp__error_prefix(m->ctx, st, "stage %s", name));
    if (st != IMP_OK) goto out;
    places_note(m, stage, p);
    IMP_TRY(row_add(m, stage, round, r));
    if (r->warning)
        IMP_TRY(imp__measure_say(m, "round %d, %s: %s", round, name, r->warning));
    if (problem) {
        *problem = p;
        *result = r;
        p = NULL;
    }
out:
    imp_problem_destroy(p);
    return st;
}
