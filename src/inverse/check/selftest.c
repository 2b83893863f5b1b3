/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_selftest: the rows, one a contract and object. */
#include "selftest.h"
#include "base/arguments.h"
#include "base/pool.h"
#include "math/warp.h"
#include <string.h>

/* ---- Rows ------------------------------------------------------------------------ */

#define ASKS_S 0.1 /* seconds between two questions to the caller */

bool imp__selftest_stopped(struct imp__selftest *t)
{
    if (t->stopped || !t->options.progress) return t->stopped;
    const double now = imp__now(), elapsed = now - t->start_s;
    if (now - t->asked_s < ASKS_S) return false;
    t->asked_s = now;
    const struct imp_progress p = {
        .size = sizeof p,
        .stage = "selftest",
        .fraction = t->part,
        .elapsed_s = elapsed,
        .eta_s = t->part > 0 ? elapsed * (1 - t->part) / t->part : -1,
        .rate = elapsed > 0 ? (double)t->n_rows / elapsed : 0,
        .rate_unit = "rows"};
    t->stopped = t->options.progress(&p, t->options.progress_payload) != 0;
    return t->stopped;
}

bool imp__selftest_watch(void *test) { return imp__selftest_stopped(test); }

enum imp_status imp__selftest_row(struct imp__selftest *t,
                                  const struct imp_selftest_row *row)
{
    if (imp__selftest_stopped(t))
        return imp__error(t->ctx, IMP_CANCELLED, "the self-test was cancelled");
    struct imp_selftest_row *rows =
        imp__grow(t->ctx, t->rows, &t->cap_rows, t->n_rows + 1, sizeof *rows);
    if (!rows) return imp__error(t->ctx, IMP_E_NOMEM, "no memory for a self-test");
    t->rows = rows;
    struct imp_selftest_row *r = &rows[t->n_rows++];
    *r = *row;
    r->size = sizeof *r;
    if (r->ok != IMP_VERDICT_OPEN)
        r->ok = r->error <= r->limit ? IMP_VERDICT_RIGHT : IMP_VERDICT_WRONG;
    if (r->ok == IMP_VERDICT_RIGHT && r->sees > IMP_SELFTEST_WANTED)
        r->ok = IMP_VERDICT_OPEN;
    return IMP_OK;
}

enum imp_status imp__selftest_count(struct imp__selftest *t, const char *object,
                                    const char *kind, const char *contract, double value,
                                    double n)
{
    return imp__selftest_row(t, &(struct imp_selftest_row){.object = object,
                                                           .kind = kind,
                                                           .contract = contract,
                                                           .value = value,
                                                           .answers = n,
                                                           .error = value,
                                                           .chance = -1});
}

enum imp_status imp__selftest_draws(struct imp__selftest *t, const char *object,
                                    const char *kind, double chance, double sees)
{
    const double least = fmax(chance, 1e-300);
    return imp__selftest_row(
        t, &(struct imp_selftest_row){.object = object,
                                      .kind = kind,
                                      .contract = "draws",
                                      .value = chance,
                                      .reference = t->level,
                                      .error = fmax(0, -imp__normal_quantile(least)),
                                      .limit = -imp__normal_quantile(t->level),
                                      .chance = chance,
                                      .sees = sees});
}

enum imp_status imp__selftest_z(struct imp__selftest *t, const char *object,
                                const char *kind, const char *contract,
                                const struct imp__scores *s)
{
    const double z = fabs(s->z);
    return imp__selftest_row(
        t, &(struct imp_selftest_row){.object = object,
                                      .kind = kind,
                                      .contract = contract,
                                      .value = s->value,
                                      .reference = s->reference,
                                      .se = s->se,
                                      .error = isfinite(z) ? z : INFINITY,
                                      .limit = IMP_SELFTEST_LIMIT,
                                      .chance = isfinite(z) ? 2 * imp__normal_cdf(-z) : 0,
                                      .sees = s->sees});
}

imp_v3 imp__selftest_direction(int i, uint64_t seed)
{
    const struct imp_key key = imp__key(seed, 77, (uint64_t)i);
    imp_v3 w;
    uint32_t dim = 0;
    do {
        w = imp__uniform_sphere((double[2]){imp__u01(key, dim), imp__u01(key, dim + 1)});
        dim += 2;
    } while (fabs(w[2]) < 0.02);
    w[2] = i % 2 ? -fabs(w[2]) : fabs(w[2]);
    return w;
}

/* ---- The entry ------------------------------------------------------------------- */

/* Rows live as long as the scene, or until its next self-test. */
struct kept {
    imp_context *ctx;
    struct imp_selftest_row *rows;
};
static void kept_destroy(void *object)
{
    struct kept *k = object;
    imp__release(k->ctx, k->rows);
    imp__release(k->ctx, k);
}
static enum imp_status keep(struct imp__selftest *t, imp_scene *scene)
{
    struct kept *k = NULL;
    for (struct imp_owned *o = scene->owned; o && !k; o = o->next)
        if (o->destroy == kept_destroy) k = o->object;
    if (!k) {
        k = imp__alloc(t->ctx, 1, sizeof *k);
        if (!k) return imp__error(t->ctx, IMP_E_NOMEM, "no memory for a self-test");
        k->ctx = t->ctx;
        const enum imp_status st = imp__scene_own(scene, k, kept_destroy);
        if (st != IMP_OK) return st;
    }
    imp__release(k->ctx, k->rows);
    k->rows = t->rows;
    t->rows = NULL;
    return IMP_OK;
}

static enum imp_status run(struct imp__selftest *t, enum imp_selftest_subject subject)
{
    switch (subject) {
    case IMP_SELFTEST_MATERIAL: return imp__selftest_materials(t);
    case IMP_SELFTEST_LIGHT: return imp__selftest_lights(t);
    case IMP_SELFTEST_CAMERA: return imp__selftest_cameras(t);
    case IMP_SELFTEST_PHASE: return imp__selftest_phases(t);
    case IMP_SELFTEST_MEDIUM: return imp__selftest_media(t);
    case IMP_SELFTEST_SHAPE: return imp__selftest_shapes(t);
    }
    return imp__error(t->ctx, IMP_E_ARG, "imp_selftest: subject = %d", (int)subject);
}

enum imp_status imp_selftest(imp_scene *scene, enum imp_selftest_subject subject,
                             const struct imp_selftest_options *options,
                             const struct imp_selftest_row **rows, size_t *n_rows)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, rows, "rows");
    IMP_REQUIRE(scene->ctx, n_rows, "n_rows");
    IMP_FLOAT_MODE;
    imp_context *ctx = scene->ctx;
    struct imp__selftest t = {
        .ctx = ctx, .scene = scene, .options = IMP_SELFTEST_OPTIONS_INIT};
    IMP_OPTIONS(ctx, t.options, options, "options");
    if (t.options.samples < 0 || t.options.directions < 0)
        return imp__error(ctx, IMP_E_ARG, "samples and directions must be >= 0");
    if (!scene->committed)
        return imp__error(ctx, IMP_E_ARG, "imp_selftest: the scene is not committed");
    t.start_s = t.asked_s = imp__now();
    t.raises = t.options.samples == 0;
    if (t.options.samples == 0) t.options.samples = 200000;
    if (t.options.directions == 0) t.options.directions = 12;
    if (t.options.samples / t.options.directions < 1000)
        return imp__error(ctx, IMP_E_ARG,
                          "%d samples for %d directions: chi-square needs 1000 for each",
                          t.options.samples, t.options.directions);
    IMP_SETS(scene, st);
    if (st != IMP_OK) return st;
    t.tree = imp__alloc(ctx, 1, sizeof *t.tree);
    if (!t.tree) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a self-test"));
    IMP_TRY(run(&t, subject));
    const size_t n = t.n_rows;
    const struct imp_selftest_row *own = t.rows;
    IMP_TRY(keep(&t, scene));
    *rows = own;
    *n_rows = n;
out:
    imp__release(ctx, t.tree);
    imp__release(ctx, t.rows);
    return st;
}
