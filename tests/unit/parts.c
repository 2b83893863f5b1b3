/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts: pictures, losses, gradients, Jacobians with their tables, means and plans have the
 * bits of one run, for any cut; what does not belong together is refused. */
#include "imp_fail_alloc.h"
#include "math/hash.h"
#include "parts_kit.h"
#include <unistd.h>

/* ---- Cuts --------------------------------------------------------------------------- */

static void cuts(const char *filter)
{
    static struct result whole, merged;
    static const int halves[][2] = {{2, 2}, {1, 2}},
                     mixed[][2] = {{4, 4}, {1, 2}, {3, 4}},
                     sevenths[][2] = {{1, 7}, {2, 7}, {3, 7}, {4, 7},
                                      {5, 7}, {6, 7}, {7, 7}};
    static const struct {
        const int (*which)[2];
        int n;
    } cut[] = {{halves, 2}, {mixed, 3}, {sevenths, 7}};
    for (enum job job = 0; job < JOBS; job++) {
        int same = 0;
        char error[400] = "";
        alone(filter, job, &whole);
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < cut[c].n; k++)
                part_make(filter, job, cut[c].which[k][0], cut[c].which[k][1], 1 + k % 2);
            same += merge(filter, job, cut[c].which, cut[c].n, .6, 5, &merged, error) ==
                        IMP_OK &&
                    !memcmp(&merged, &whole, sizeof whole);
        }
        tap_ok(same == 3, "%s, %s%s: parts of three cuts merge to the bit # %d %s",
               names[job], filter, points == IMP_POINTS_SOBOL ? ", sobol" : "", same,
               error);
    }
}

static void refusals(void)
{
    static const int all[][2] = {{1, 4}, {2, 4}, {3, 4}, {4, 4}},
                     twice[][2] = {{1, 2}, {1, 2}}, over[][2] = {{1, 2}, {2, 4}, {2, 2}};
    static struct result r;
    char error[400], path[96], other[96];
    for (int i = 1; i <= 4; i++) part_make("box", PICTURE, i, 4, 1);
    for (int i = 1; i <= 2; i++) part_make("box", PICTURE, i, 2, 1);

    const struct {
        const int (*which)[2];
        int n;
        enum job job;
        double red;
        uint64_t seed;
        const char *says;
    } bad[] = {
        {all, 3, PICTURE, .6, 5, "missing: 4/4"},
        {all + 3, 1, PICTURE, .6, 5, "missing: 1/4 to 3/4"},
        {twice, 2, PICTURE, .6, 5, "part 1 of 2 is there twice, with equal contents"},
        {over, 3, PICTURE, .6, 5, "overlap"},
        {all, 4, PICTURE, .61, 5, "part 1 of 4 was made with another set of"},
        {all, 4, PICTURE, .6, 6, "made with another seed or number of samples"},
        {all, 4, LOSS, .6, 5, "part 1 of 4 was made with another call"}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const enum imp_status st = merge("box", bad[k].job, bad[k].which, bad[k].n,
                                         bad[k].red, bad[k].seed, &r, error);
        tap_ok(st == IMP_E_ARG && strstr(error, bad[k].says), "refused: %s # %s",
               bad[k].says, error);
    }

    for (int i = 1; i <= 2; i++) part_make("box", PLAN, i, 2, 1);
    plan_noise = 0.2;
    const enum imp_status other_noise =
        merge("box", PLAN, (const int[][2]){{1, 2}, {2, 2}}, 2, .6, 5, &r, error);
    tap_ok(other_noise == IMP_E_ARG && strstr(error, "other candidates, noise or priors"),
           "refused: a plan with other noise # %s", error);
    plan_noise = 0.1;
    for (int i = 1; i <= 2; i++) part_make("box", PICTURE, i, 2, 1);

    /* The same part of two runs. */
    imp_parts *parts = NULL;
    imp_context *ctx = test_context(1);
    char command[256];
    snprintf(command, sizeof command, "cp %s %s/copy", part_path(path, 1, 2), folder);
    if (system(command) != 0) exit(99);
    part_make("box", LOSS, 1, 2, 1);
    snprintf(other, sizeof other, "%s/copy", folder);
    const char *two[] = {path, other};
    enum imp_status st = imp_parts_read(ctx, two, 2, &parts);
    tap_ok(st == IMP_E_ARG &&
               strstr(imp_last_error(ctx),
                      "part 1 of 2 is there twice, with different contents") &&
               strstr(imp_last_error(ctx), path) && strstr(imp_last_error(ctx), other),
           "the same part with different contents: both files are named # %s",
           imp_last_error(ctx));
    part_make("box", PICTURE, 1, 2, 1);
    /* Of another importon: the format's version, and the program's. */
    const struct {
        long at;
        const char *bytes, *says;
    } strange[] = {{12, "\x09", "version 9; this importon has"},
                   {16, "importon 9.9.9", "made on \"importon 9.9.9"}};
    for (int k = 0; k < 2; k++) {
        static unsigned char bytes[1 << 22];
        FILE *f = fopen(other, "rb+");
        const size_t n = fread(bytes, 1, sizeof bytes, f);
        memcpy(bytes + strange[k].at, strange[k].bytes, strlen(strange[k].bytes));
        const uint64_t sum = imp__hash(0, bytes, n - sizeof sum);
        memcpy(bytes + n - sizeof sum, &sum, sizeof sum);
        rewind(f);
        fwrite(bytes, 1, n, f);
        fclose(f);
        const char *mixed[] = {part_path(path, 2, 2), other};
        st = imp_parts_read(ctx, mixed, 2, &parts);
        tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), strange[k].says),
               "a part of another version: both sides # %s", imp_last_error(ctx));
        snprintf(command, sizeof command, "cp %s %s", part_path(path, 1, 2), other);
        if (system(command) != 0) exit(99);
    }
    imp_context_destroy(ctx);

    /* Every byte of a file counts. */
    FILE *f = fopen(part_path(path, 2, 2), "rb+");
    int found = 0, tried = 0;
    fseek(f, 0, SEEK_END);
    const long size = ftell(f);
    for (long at = 0; at < size; at += size / 23 + 1, tried++) {
        fseek(f, at, SEEK_SET);
        const int byte = fgetc(f);
        fseek(f, at, SEEK_SET);
        fputc(byte ^ 0x10, f);
        fflush(f);
        const enum imp_status st =
            merge("box", PICTURE, (const int[][2]){{1, 2}, {2, 2}}, 2, .6, 5, &r, error);
        found += st == IMP_E_IO || st == IMP_E_SCENE || st == IMP_E_ARG;
        fseek(f, at, SEEK_SET);
        fputc(byte, f);
        fflush(f);
    }
    fclose(f);
    tap_ok(found == tried, "one changed byte is found, wherever # %d of %d", found,
           tried);
    snprintf(other, sizeof other, "%s/other", folder);
    tap_ok(truncate(path, size / 2) == 0 &&
               merge("box", PICTURE, (const int[][2]){{1, 2}, {2, 2}}, 2, .6, 5, &r,
                     error) == IMP_E_IO,
           "half a file is refused # %s", error);
}

/* What needs results of what was before is not cut. */
static void no_parts(void)
{
    static struct result r;
    imp_parts *part;
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_make(ctx, "box", .6);
    test_must(ctx, imp_parts_create(ctx, 1, 2, "a test", &part));
    test_must(ctx, imp_context_set_parts(ctx, part));
    tap_ok(job_run(ctx, s, FIT, 5, &r) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "a fit cannot be made in parts"),
           "a fit in parts is refused # %s", imp_last_error(ctx));
    test_must(ctx, imp_context_set_parts(ctx, NULL));
    tap_ok(job_run(ctx, s, PICTURE, 5, &r) == IMP_OK, "without parts: whole again");
    imp_parts_destroy(part);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* Parts of parts. */
static void larger_parts(void)
{
    static struct result whole, r;

    char path[6][96];
    struct imp_parts_info info = {.size = sizeof info};
    imp_context *ctx = test_context(1);
    imp_parts *parts;
    imp_scene *s = scene_make(ctx, "gaussian", .6);

    alone("gaussian", LOSS, &whole);
    for (int i = 1; i <= 3; i++) part_make("gaussian", LOSS, i, 3, 1);
    const char *first[] = {part_path(path[0], 1, 3), part_path(path[1], 3, 3)};
    test_must(ctx, imp_parts_read(ctx, first, 2, &parts));
    test_must(ctx, imp_parts_get_info(parts, &info));
    tap_ok(info.n == 2 && info.missing == 1 && !strcmp(info.holes, "2/3"),
           "two of three: 2/3 is missing # %s", info.holes);
    test_must(ctx, imp_parts_write(parts, part_path(path[2], 13, 3)));
    imp_parts_destroy(parts);
    const char *both[] = {path[2], part_path(path[3], 2, 3)};
    test_must(ctx, imp_parts_read(ctx, both, 2, &parts));
    test_must(ctx, imp_context_set_parts(ctx, parts));
    test_must(ctx, job_run(ctx, s, LOSS, 5, &r));
    imp_parts_destroy(parts);
    tap_ok(!memcmp(&r, &whole, sizeof r), "a part of two parts, and the third: the bits");
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

static int stop(const struct imp_progress *progress, void *payload)
{
    (void)progress, (void)payload;
    return 1;
}

/* A part that was stopped is none, and says so. */
static void stopped(void)
{
    imp_parts *part;
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_make(ctx, "box", .6);
    imp_problem *p = problem_make(ctx, s, "ball.*");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    double g[3], se[3];
    imp_film *film = NULL;
    run.progress = stop;
    test_must(ctx, imp_parts_create(ctx, 1, 2, "a test", &part));
    test_must(ctx, imp_context_set_parts(ctx, part));
    enum imp_status st = imp_render(s, &run, &film);
    tap_ok(st == IMP_CANCELLED && !film, "a part of a picture is cancelled # %s",
           imp_status_text(st));
    st = imp_problem_objective(p, NULL, &run, &e, g, se);
    tap_ok(st == IMP_CANCELLED, "a part of a loss is cancelled # %s",
           imp_status_text(st));
    imp_problem_destroy(p);
    imp_parts_destroy(part);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

static enum imp_status read_part(imp_context *ctx)
{
    char path[96];
    const char *const paths[] = {part_path(path, 1, 2)};
    imp_parts *parts = NULL;
    const enum imp_status st = imp_parts_read(ctx, paths, 1, &parts);
    imp_parts_destroy(parts);
    return st;
}
/* Without memory a good file is not damaged. */
static void starved(void)
{
    struct fail_alloc heap = {0};
    imp_context *ctx = fail_alloc_context(&heap);
    part_make("box", PICTURE, 1, 2, 1);
    const int failed = fail_alloc_in_turn(&heap, read_part, ctx);
    tap_ok(failed > 2, "%d allocations fail in turn: out of memory", failed);
    imp_context_destroy(ctx);
    tap_ok(heap.live == 0, "and nothing leaks");
}

int main(void)
{
    snprintf(folder, sizeof folder, "/tmp/parts.XXXXXX");
    if (!mkdtemp(folder)) return 99;
    target_set();
    cuts("box");
    cuts("gaussian");
    points = IMP_POINTS_SOBOL;
    cuts("gaussian");
    points = IMP_POINTS_INDEPENDENT;
    refusals();
    no_parts();
    larger_parts();
    stopped();
    starved();
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) tap_ok(0, "the folder is removed");
    return tap_done();
}
