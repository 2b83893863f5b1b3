/* SPDX-License-Identifier: Apache-2.0
 *
 * A scene from photographs: the order of the stages, what is masked and what is repeated
 * (importon/measure.h). */
#include "base/arguments.h"
#include "base/lock.h"
#include "measuring.h"
#include "walk/run/run.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define SPP     64   /* samples per pixel of an evaluation, where nobody chose */
#define LOOK    64   /* samples by which those that are held are tested, at least: once */
#define STRANGE 3    /* times the chi-square of the others */
#define CHANCE  1e-4 /* chance and drop of chi-square by which a number that is held ... */
#define DROP    20   /* ... is wrong though all pixels together are explained */

/* ---- Decisions ------------------------------------------------------------------------- */

enum imp_status imp__measure_say(struct imp__measure *m, const char *format, ...)
{
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    for (char *c = text; *c; c++)
        if (*c == '\n') *c = ' ';
    char **lines =
        imp__grow(m->ctx, m->lines, &m->cap_lines, m->n_lines + 1, sizeof *lines);
    char *copy = imp__strdup(m->ctx, text);
    if (lines) m->lines = lines;
    if (!lines || !copy) {
        imp__release(m->ctx, copy);
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a line");
    }
    m->lines[m->n_lines++] = copy;
    if (m->o.say && !m->repeats) m->o.say(copy, m->o.say_payload);
    return IMP_OK;
}

/* ---- Rounds ---------------------------------------------------------------------------- */

/* By how many standard errors numbers of a stage have moved since it ended, at most. */
static double moved_since(const struct imp__measure *m, enum imp_measure_stage stage)
{
    double most = 0;
    for (size_t k = 0; k < m->scene->n_params; k++)
        for (size_t e = 0; e < m->scene->params[k].info.count; e++) {
            const size_t at = m->scene->params[k].info.offset + e;
            if (m->stage[k] != stage || !(m->at_se[at] > 0)) continue;
            const double now = imp__param_get(&m->scene->params[k], e);
            most = fmax(most, fabs(now - m->at[at]) / m->at_se[at]);
        }
    return most;
}

/* What the fit of all numbers has found is what the next round's is compared with. */
static void places_follow(struct imp__measure *m)
{
    for (size_t k = 0; k < m->scene->n_params; k++)
        for (size_t e = 0; e < m->scene->params[k].info.count; e++)
            m->at[m->scene->params[k].info.offset + e] =
                imp__param_get(&m->scene->params[k], e);
}

static struct imp_measure_row *row_of(struct imp__measure *m, int stage)
{
    for (size_t i = 0; i < m->n_rows; i++)
        if (m->rows[i].round == m->round && (int)m->rows[i].stage == stage)
            return &m->rows[i];
    return NULL;
}

/* Which stages are due again, where the last fit does not explain the photographs: those whose numbers
 * it has moved, or all where other pixels count. A fit of all numbers that explains them needs no
 * other, however far single ones have moved along what the stages could not tell apart; where other
 * pixels count, or the noise is found to be less, it is repeated alone. */
static enum imp_status stages_judge(struct imp__measure *m, const double *moved,
                                    bool masks_changed, bool quieter, bool *again)
{
    const struct imp_measure_row *answer = &m->rows[m->n_rows - 1];
    const bool explained = answer->explained, last = m->round >= m->o.rounds;
    const bool blind = answer->chi2_se >= IMP_MEASURE_BLIND &&
                       answer->chi2 - 1 < IMP_MEASURE_SURE * answer->chi2_se;
    if (blind) {
        *again = false;
        memset(m->due, 0, sizeof m->due);
        return imp__measure_say(m,
                                "round %d: with so few samples chi-square tells nothing, "
                                "and other rounds would not: more are needed (--spp)",
                                m->round);
    }
    *again = masks_changed || quieter;
    for (int s = 0; s < IMP_MEASURE_TOGETHER; s++) {
        struct imp_measure_row *row = row_of(m, s);
        const enum imp_measure_stage stage = (enum imp_measure_stage)s;
        if (row) row->moved = moved[s];
        m->due[s] = imp__measure_count(m, stage) > 0 && !explained &&
                    (masks_changed || moved[s] > IMP_MEASURE_SURE);
        *again |= m->due[s];
        if (!m->due[s] || last || masks_changed) continue;
        IMP_CHECKED(imp__measure_say(m,
                                     "round %d: %s again, as a number of it has moved by "
                                     "%.3g standard errors since",
                                     m->round, imp_measure_stage_name(stage), moved[s]));
    }
    if (masks_changed && !last)
        IMP_CHECKED(imp__measure_say(m, "round %d: %s again, as other pixels are masked",
                                     m->round,
                                     explained ? "the last fit" : "all stages"));
    else if (quieter && explained && !last)
        IMP_CHECKED(
            imp__measure_say(m, "round %d: the last fit again, by this noise", m->round));
    if (*again && last)
        IMP_CHECKED(imp__measure_say(
            m, "round %d is the last, though stages are due again", m->round));
    return IMP_OK;
}

/* By the residuals that the fits have left. */
static enum imp_status photos_mask(struct imp__measure *m, bool *changed)
{
    *changed = false;
    for (size_t i = 0; i < m->n_photos; i++)
        IMP_CHECKED(imp__measure_mask(m, &m->photos[i], changed));
    return IMP_OK;
}

/* Noise by the residuals of a last fit that explains the photographs by the noise that they seemed to
 * have, and so has their edges; *quieter: it is less, and the fit was judged again. */
static enum imp_status photos_quiet(struct imp__measure *m, bool *quieter)
{
    *quieter = false;
    if (!m->rows[m->n_rows - 1].explained) return IMP_OK;
    for (size_t i = 0; i < m->n_photos; i++)
        IMP_CHECKED(imp__measure_noise_again(m, &m->photos[i], quieter));
    return *quieter ? imp__measure_judge_again(m) : IMP_OK;
}

/* One round. *again: others follow. */
static enum imp_status round_run(struct imp__measure *m, imp_problem **problem,
                                 const struct imp_fit_result **result, bool *again)
{
    enum imp_measure_stage last = imp__measure_last_stage(m);
    double moved[IMP_MEASURE_STAGES] = {0};
    bool changed = false, quieter = false;
    for (int s = m->next; s < IMP_MEASURE_TOGETHER; s++) {
        const enum imp_measure_stage stage = (enum imp_measure_stage)s;
        if (stage == last || !m->due[s] || imp__measure_count(m, stage) == 0) continue;
        IMP_CHECKED(imp__measure_stage(m, stage, NULL, NULL));
        m->next = s + 1;
        IMP_CHECKED(imp__measure_state_write(m));
    }
    imp_problem_destroy(*problem);
    *problem = NULL;
    if (m->n_rows > 0 && m->rows[m->n_rows - 1].round == m->round) {
        IMP_CHECKED(imp__measure_look(m)); /* where it goes on from a checkpoint */
        IMP_CHECKED(photos_mask(m, &changed));
        if (changed) m->looked = false;
    }
    IMP_CHECKED(imp__measure_last(m, problem, result));
    last = imp__measure_last_stage(m);
    for (int s = 0; s < IMP_MEASURE_TEXTURES; s++)
        moved[s] =
            last == IMP_MEASURE_TOGETHER ? moved_since(m, (enum imp_measure_stage)s) : 0;
    if (!m->astray) IMP_CHECKED(photos_mask(m, &changed));
    IMP_CHECKED(photos_quiet(m, &quieter));
    IMP_CHECKED(stages_judge(m, moved, changed, quieter, again));
    places_follow(m);
    m->round++;
    m->next = 0;
    *again &= m->round <= m->o.rounds;
    return *again ? imp__measure_state_write(m) : IMP_OK;
}

/* ---- The answer ------------------------------------------------------------------------ */

static enum imp_status missing_find(struct imp__measure *m, imp_problem *p,
                                    struct imp_measure_result *r)
{
    struct imp_run run = m->run;
    run.spp = imp_max(LOOK, run.spp);
    const enum imp_status st = imp_problem_missing(p, &run, &r->missing, &r->n_missing);
    if (st != IMP_E_UNSUPPORTED && st != IMP_E_BIAS) return st;
    r->n_missing = 0;
    if (r->explained) return IMP_OK;
    return imp__measure_say(m, "numbers that may be wrong are not looked for: %s",
                            imp_last_error(m->ctx));
}

/* Chi-square of all pixels does not see what is wrong in few of them; the test of a single number does. Is
 * one of those that are not measured wrong beyond doubt? */
static bool missing_surely(const struct imp_measure_result *r)
{
    for (size_t k = 0; k < r->n_missing; k++)
        if (r->missing[k].chance < CHANCE &&
            r->missing[k].chi2 - 2 * r->missing[k].chi2_se > DROP)
            return true;
    return false;
}

static enum imp_status missing_say(struct imp__measure *m,
                                   const struct imp_measure_result *r)
{
    enum { MOST = 8 };
    size_t named = 0;
    for (size_t k = 0; k < r->n_missing && named < MOST; k++) {
        const struct imp_missing *row = &r->missing[k];
        const struct imp_param_info *info = &m->scene->params[row->param].info;
        char element[32] = "";
        if (row->chance > 0.05) continue;
        if (info->count > 1 && !row->factor)
            snprintf(element, sizeof element, "[%zu]", row->element);
        IMP_CHECKED(imp__measure_say(m,
                                     "not measured, and may be wrong: %s%s%s%s, %.6g -> "
                                     "%.6g +- %.1g, chi-square -%.4g",
                                     row->factor ? "factor(" : "", info->name,
                                     row->factor ? ")" : "", element, row->value,
                                     row->value + row->step, row->step_se, row->chi2));
        named++;
    }
    return named > 0
               ? IMP_OK
               : imp__measure_say(m, "no number that is not measured explains it: the "
                                     "scene lacks something");
}

/* A photograph that fits far less than the others is named: it may be of something else. */
static enum imp_status stranger_say(struct imp__measure *m)
{
    size_t worst = 0;
    double others = 1;
    for (size_t i = 1; i < m->n_photos; i++)
        if (m->photos[i].chi2 > m->photos[worst].chi2) worst = i;
    for (size_t i = 0; i < m->n_photos; i++)
        if (i != worst && m->photos[i].n_compared > 0)
            others = fmax(others, m->photos[i].chi2);
    const struct imp__photo *p = &m->photos[worst];
    if (!(p->n_compared > 0) ||
        !(p->chi2 - IMP_MEASURE_SURE * p->chi2_se > STRANGE * others))
        return IMP_OK;
    return imp__measure_say(
        m,
        "%s: its chi-square is %.3g, that of the others %.3g at most: "
        "is it of this scene, and of sensor '%s'?",
        p->name, p->chi2, others, p->sensor->name);
}

static enum imp_status result_make(struct imp__measure *m, imp_problem *p,
                                   const struct imp_fit_result *fit,
                                   const struct imp_measure_result **out)
{
    struct imp_arena *a = &p->measure_arena;
    struct imp_measure_result *r = imp__arena_array(a, 1, sizeof *r);
    struct imp_measure_photo *photos = imp__arena_array(a, m->n_photos, sizeof *photos);
    enum imp_status no_memory = IMP_E_NOMEM;
    if (!r || !photos) return imp__error(m->ctx, no_memory, "no memory for an answer");
    r->size = sizeof *r;
    r->fit = fit;
    r->rounds = m->round - 1;
    r->explained = m->rows[m->n_rows - 1].explained;
    IMP_CHECKED(missing_find(m, p, r));
    if (r->explained && missing_surely(r)) {
        r->explained = false;
        IMP_CHECKED(imp__measure_say(m,
                                     "not explained after all: chi-square of all pixels "
                                     "hides what is wrong in few of them"));
    }
    if (!r->explained) {
        IMP_CHECKED(stranger_say(m));
        IMP_CHECKED(missing_say(m, r));
    } else r->n_missing = 0;
    for (size_t i = 0; i < m->n_photos; i++) {
        const struct imp__photo *photo = &m->photos[i];
        float *copy = imp__arena_array(a, 2 * photo->n_pixels, sizeof *copy);
        if (!copy) return imp__error(m->ctx, no_memory, "no memory for an answer");
        memcpy(copy, photo->weights, photo->n_pixels * sizeof *copy);
        for (size_t k = 0; k < photo->n_pixels; k++)
            copy[photo->n_pixels + k] = photo->expected[k] > 0
                                            ? sqrtf(photo->square[k] / photo->expected[k])
                                            : NAN;
        photos[i] = (struct imp_measure_photo){.size = sizeof *photos,
                                               .noise = photo->noise,
                                               .chi2 = photo->chi2,
                                               .block = photo->block,
                                               .n_blocks = (size_t)photo->columns *
                                                           (size_t)photo->rows,
                                               .n_masked = photo->n_masked,
                                               .weights = copy,
                                               .residual = copy + photo->n_pixels};
    }
    size_t *textures = imp__arena_array(a, m->scene->n_params + 1, sizeof *textures);
    if (!textures) return imp__error(m->ctx, no_memory, "no memory for an answer");
    for (size_t k = 0; k < m->scene->n_params; k++)
        if (m->stage[k] == IMP_MEASURE_TEXTURES && !m->joined)
            textures[r->n_textures++] = k;
    r->textures = textures;
    struct imp_measure_row *rows = imp__arena_array(a, m->n_rows, sizeof *rows);
    const char **lines = imp__arena_array(a, m->n_lines, sizeof *lines);
    if (!rows || !lines) return imp__error(m->ctx, no_memory, "no memory for an answer");
    memcpy(rows, m->rows, m->n_rows * sizeof *rows);
    for (size_t i = 0; i < m->n_lines; i++) {
        const size_t n = strlen(m->lines[i]) + 1;
        char *copy = imp__arena_array(a, n, 1);
        if (!copy) return imp__error(m->ctx, no_memory, "no memory for an answer");
        lines[i] = memcpy(copy, m->lines[i], n);
    }
    r->n_rows = m->n_rows;
    r->rows = rows;
    r->n_photos = m->n_photos;
    r->photos = photos;
    r->n_lines = m->n_lines;
    r->lines = lines;
    *out = r;
    return IMP_OK;
}

static enum imp_status measure_run(struct imp__measure *m, imp_problem **problem,
                                   const struct imp_measure_result **result)
{
    const struct imp_fit_result *fit = NULL;
    bool found, again = true;
    m->task = imp__measure_hash(m);
    m->round = 1;
    for (int s = 0; s < IMP_MEASURE_STAGES; s++) m->due[s] = true;
    IMP_CHECKED(imp__measure_state_read(m, &found));
    if (!found) {
        IMP_CHECKED(imp__measure_begin(m));
        IMP_CHECKED(imp__measure_state_write(m));
    }
    while (again) IMP_CHECKED(round_run(m, problem, &fit, &again));
    IMP_CHECKED(imp__measure_last_again(m, problem, &fit));
    return result_make(m, *problem, fit, result);
}

static void measure_end(struct imp__measure *m)
{
    imp__measure_photos_free(m);
    for (size_t i = 0; i < m->n_lines; i++) imp__release(m->ctx, m->lines[i]);
    imp__release(m->ctx, m->lines);
    imp__release(m->ctx, m->rows);
    imp__release(m->ctx, m->stage);
    imp__release(m->ctx, m->held);
    imp__release(m->ctx, m->holds);
    imp__release(m->ctx, m->at);
    imp__release(m->ctx, m->at_se);
}

enum imp_status imp_measure(imp_scene *scene, const struct imp_photo *photos, size_t n,
                            const struct imp_measure_options *options,
                            const struct imp_run *run, imp_problem **problem,
                            const struct imp_measure_result **result)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    imp_context *ctx = scene->ctx;
    struct imp__measure m = {.ctx = ctx, .scene = scene};
    struct imp_file_lock lock = {0};
    imp_problem *last = NULL;
    const struct imp_measure_result *answer = NULL;
    IMP_REQUIRE(ctx, photos, "photos");
    IMP_REQUIRE(ctx, problem, "problem");
    IMP_REQUIRE(ctx, result, "result");
    IMP_RUN(ctx, m.run, run);
    IMP_CHECKED(imp__run_traces(ctx, "imp_measure", &m.run));
    if (!scene->committed)
        return imp__error(ctx, IMP_E_ARG, "imp_measure: the scene is not committed");
    IMP_FLOAT_MODE;
    if (m.run.spp == 0) m.run.spp = SPP;
    IMP_TRY(imp__measure_options_take(&m, options));
    IMP_TRY(imp__measure_photos_take(&m, photos, n));
    IMP_TRY(imp__file_lock(ctx, m.o.checkpoint, &lock));
    IMP_TRY(imp__measure_numbers(&m));
    IMP_TRY(measure_run(&m, &last, &answer));
    *problem = last;
    *result = answer;
    last = NULL;
out:
    imp__file_unlock(ctx, &lock);
    measure_end(&m);
    imp_problem_destroy(last);
    return st;
}
