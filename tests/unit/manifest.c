/* SPDX-License-Identifier: Apache-2.0
 *
 * Manifests: a run that keeps one has the bits of a run without; it is verified on any
 * number of threads, whole or in part; and what is false is found: a scene, a result, a
 * sum on the way. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/hash.h"
#include <importon/importon.h>
#include <unistd.h>

enum job { PICTURE, GRADIENT, FIT, JOBS };
static const char *const names[] = {"picture", "loss and gradient", "fit"};
enum { SIDE = 24, PIXELS = SIDE * SIDE * 3 };

static char folder[64], scene_path[96], proof[96], output[96];
static float target[PIXELS];

static enum imp_status scene_read(imp_context *ctx, imp_scene **s)
{
    const char *const defines[] = {"res=24"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.defines = defines;
    o.n_defines = 1;
    return imp_scene_load(ctx, scene_path, &o, s);
}
static imp_scene *scene_load(imp_context *ctx)
{
    imp_scene *s;
    test_must(ctx, scene_read(ctx, &s));
    return s;
}

/* The results [n] of a job, its sums kept or verified. */
static enum imp_status job_run(imp_context *ctx, imp_scene *s, enum job job,
                               imp_manifest *m, double result[PIXELS], size_t *n)
{
    struct imp_run run = IMP_RUN_INIT;
    enum imp_status st = imp_context_set_manifest(ctx, m);
    run.seed = 3;
    run.spp = 9;
    *n = 0;
    if (st != IMP_OK) return st;
    if (job == PICTURE) {
        imp_film *film = NULL;
        st = imp_render(s, &run, &film);
        for (; st == IMP_OK && *n < PIXELS; ++*n) result[*n] = imp_film_mean(film)[*n];
        imp_film_destroy(film);
    } else {
        struct imp_target t = IMP_TARGET_INIT;
        imp_problem *p;
        t.width = t.height = SIDE, t.channels = 3, t.pixels = target;
        test_must(ctx, imp_problem_create(s, &p));
        test_must(ctx, imp_problem_activate(p, "ball.*"));
        test_must(ctx, imp_problem_add_target(p, &t));
        struct imp_estimate e = {0};
        if (job == GRADIENT) {
            st = imp_problem_objective(p, NULL, &run, &e, result + 2, result + 3);
            result[0] = e.value, result[1] = e.se;
            *n = 4;
        } else {
            struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
            const struct imp_fit_result *f;
            o.max_iterations = 4;
            st = imp_fit(p, &o, &run, &f);
            if (st == IMP_OK) result[0] = f->variables[0].value, *n = 1;
        }
        imp_problem_destroy(p);
    }
    const enum imp_status left = imp_context_set_manifest(ctx, NULL);
    return st == IMP_OK ? left : st;
}

static void make(enum job job, double result[PIXELS], size_t *n)
{
    imp_context *ctx = test_context(2);
    imp_manifest *m;
    test_must(ctx, imp_manifest_create(ctx, "a test", &m));
    imp_scene *s = scene_load(ctx);
    test_must(ctx, job_run(ctx, s, job, m, result, n));
    test_must(ctx, imp_manifest_result(m, "numbers", result, *n * sizeof *result));
    test_must(ctx, imp_manifest_output(m, output));
    test_must(ctx, imp_manifest_write(m, proof));
    imp_manifest_destroy(m);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* What verifying finds: "" if nothing. */
static const char *verify(enum job job, double fraction, int threads,
                          struct imp_manifest_info *info)
{
    static char found[600];
    static double result[PIXELS];
    size_t n;
    imp_manifest *m = NULL;
    imp_scene *s = NULL;
    imp_context *ctx = test_context(threads);
    *info = (struct imp_manifest_info){.size = sizeof *info};
    enum imp_status st = imp_manifest_read(ctx, proof, fraction, 11, &m);
    if (st != IMP_OK) {
        snprintf(found, sizeof found, "%s", imp_last_error(ctx));
    } else {
        st = scene_read(ctx, &s);
        if (st == IMP_OK) st = job_run(ctx, s, job, m, result, &n);
        snprintf(found, sizeof found, "%s", st == IMP_OK ? "" : imp_last_error(ctx));
        if (st == IMP_OK)
            test_must(ctx, imp_manifest_result(m, "numbers", result, n * sizeof *result));
        test_must(ctx, imp_manifest_get_info(m, info));
        if (info->refuted) snprintf(found, sizeof found, "%s", info->refuted);
        else if (info->n_missing) snprintf(found, sizeof found, "something is missing");
    }
    imp_manifest_destroy(m);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return found;
}

/* Change a byte of a file, `from_end` from its end; of a manifest with a checksum that
 * fits again. */
static void change(const char *path, long from_end, int fits)
{
    static unsigned char bytes[1 << 20];
    FILE *f = fopen(path, "rb+");
    const size_t n = fread(bytes, 1, sizeof bytes, f);
    bytes[n - (size_t)from_end] ^= 0x10;
    if (fits) {
        const uint64_t sum = imp__hash(0, bytes, n - sizeof sum);
        memcpy(bytes + n - sizeof sum, &sum, sizeof sum);
    }
    rewind(f);
    fwrite(bytes, 1, n, f);
    fclose(f);
}

static void text_put(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}

static void good(enum job job)
{
    static double alone[PIXELS], kept[PIXELS];
    struct imp_manifest_info info;
    size_t n, m;
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_load(ctx);
    test_must(ctx, job_run(ctx, s, job, NULL, alone, &n));
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    make(job, kept, &m);
    tap_ok(n == m && !memcmp(alone, kept, n * sizeof *alone),
           "%s: with a manifest, the same bits", names[job]);
    for (int threads = 1; threads <= 2; threads++) {
        const char *found = verify(job, 1, threads, &info);
        tap_ok(!*found && info.n_verified == info.n_sums && info.n_sums > 4,
               "%s: verified by %d threads, %d of %d sums # %s", names[job], threads,
               (int)info.n_verified, (int)info.n_sums, found);
    }
    const char *found = verify(job, .3, 1, &info);
    tap_ok(!*found && info.n_verified > 0 && info.n_verified < info.n_sums,
           "%s: %d of %d sums verified # %s", names[job], (int)info.n_verified,
           (int)info.n_sums, found);
}

static void refuted(enum job job)
{
    static double result[PIXELS];
    struct imp_manifest_info info;
    size_t n;
    make(job, result, &n);
    change(proof, 25, 0);
    const char *found = verify(job, 1, 1, &info);
    tap_ok(strstr(found, "damaged") != NULL, "%s: a damaged manifest # %s", names[job],
           found);
    change(proof, 25, 0);
    /* The last bytes before the checksum are of a sum. */
    change(proof, 25, 1);
    found = verify(job, 1, 2, &info);
    tap_ok(strstr(found, "sums") && strstr(found, "other bits"),
           "%s: a false sum is found # %s", names[job], found);
    /* And where it is not looked at, in what it makes. */
    if (job == GRADIENT) {
        found = verify(job, 1e-5, 1, &info);
        tap_ok(info.n_verified == 0 && strstr(found, "numbers has other bits"),
               "%s: or in the result # %s", names[job], found);
    }
    make(job, result, &n);
    change(scene_path, 6, 0);
    found = verify(job, .1, 1, &info);
    tap_ok(strstr(found, "scene.xml was changed") != NULL, "%s: a changed scene # %s",
           names[job], found);
    change(scene_path, 6, 0);
    change(output, 2, 0);
    found = verify(job, .1, 1, &info);
    tap_ok(strstr(found, "output was changed") != NULL, "%s: a changed output # %s",
           names[job], found);
    change(output, 2, 0);
    found = verify((enum job)((job + 1) % JOBS), 1, 1, &info);
    tap_ok(*found != 0, "%s: another call # %s", names[job], found);
}

/* Sums are announced with a hash of the sensor: one that is not there is an error first. */
static void no_sensor(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_load(ctx);
    struct imp_run run = IMP_RUN_INIT;
    imp_manifest *m;
    imp_film *film;
    imp_problem *p;
    double g[3], g_se[3];
    test_must(ctx, imp_manifest_create(ctx, "a test", &m));
    test_must(ctx, imp_context_set_manifest(ctx, m));
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "ball.*"));
    for (run.sensor = -1; run.sensor < 3; run.sensor += 3) {
        tap_ok(imp_render(s, &run, &film) == IMP_E_ARG, "picture of sensor %d # %s",
               run.sensor, imp_last_error(ctx));
        tap_ok(imp_problem_reverse(p, target, &run, g, g_se) == IMP_E_ARG,
               "gradient of sensor %d # %s", run.sensor, imp_last_error(ctx));
    }
    test_must(ctx, imp_context_set_manifest(ctx, NULL));
    imp_problem_destroy(p);
    imp_manifest_destroy(m);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

static enum imp_status read_proof(imp_context *ctx)
{
    imp_manifest *m = NULL;
    const enum imp_status st = imp_manifest_read(ctx, proof, 1, 1, &m);
    imp_manifest_destroy(m);
    return st;
}
/* Without memory a good file is not damaged. */
static void starved(void)
{
    static double result[PIXELS];
    size_t numbers;
    struct fail_alloc heap = {0};
    imp_context *ctx = fail_alloc_context(&heap);
    make(GRADIENT, result, &numbers);
    const int failed = fail_alloc_in_turn(&heap, read_proof, ctx);
    tap_ok(failed > 2, "%d allocations fail in turn: out of memory", failed);
    imp_context_destroy(ctx);
    tap_ok(heap.live == 0, "and nothing leaks");
}

int main(void)
{
    char text[1 << 14];
    snprintf(folder, sizeof folder, "/tmp/manifest.XXXXXX");
    if (!mkdtemp(folder)) return 99;
    snprintf(scene_path, sizeof scene_path, "%s/scene.xml", folder);
    snprintf(proof, sizeof proof, "%s/proof", folder);
    snprintf(output, sizeof output, "%s/output", folder);
    for (int k = 0; k < PIXELS; k++) target[k] = .5f;
    FILE *f = fopen(IMP_SCENES "/furnace.xml", "r");
    if (!f) return 99;
    text[fread(text, 1, sizeof text - 1, f)] = 0;
    fclose(f);
    strcat(text, "<!-- a -->\n");
    text_put(scene_path, text);
    text_put(output, "what was written\n");
    for (enum job job = 0; job < JOBS; job++) good(job);
    for (enum job job = 0; job < JOBS; job++) refuted(job);
    no_sensor();
    starved();
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) tap_ok(0, "the folder is removed");
    return tap_done();
}
