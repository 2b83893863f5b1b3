/* SPDX-License-Identifier: Apache-2.0
 *
 * What the numbers of a fit by Levenberg and Marquardt cost, as JSON: processor seconds of
 * two iterations at 96 x 64 pixels and 8 samples, by 24 to 4,107 numbers, the texels of a
 * wall that each pixel sees a part of; and the same over those of 24. From 257 numbers on they
 * are products of sparse rows. One thread; the least of seven rounds. */
#include "../tests/imp_scene.h"
#include <math.h>
#include <sys/resource.h>

enum { WIDTH = 96, HEIGHT = 64, KINDS = 7, ROUNDS = 7, MOST = 37 };

static const int texels[KINDS][2] = {{4, 2},  {4, 4},   {8, 4},  {8, 8},
                                     {16, 8}, {31, 11}, {37, 37}};

static double processor_s(void)
{
    struct rusage u;
    getrusage(RUSAGE_SELF, &u);
    return (double)u.ru_utime.tv_sec + 1e-6 * (double)u.ru_utime.tv_usec;
}

static double fit_s(imp_context *ctx, int w, int h)
{
    static float target[WIDTH * HEIGHT * 3], pixels[MOST * MOST * 3];
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *result;
    imp_problem *p;
    imp_scene *s;
    for (size_t k = 0; k < sizeof pixels / sizeof *pixels; k++) pixels[k] = .5f;
    for (size_t k = 0; k < sizeof target / sizeof *target; k++) target[k] = .4f;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, WIDTH, HEIGHT);
    test_picture_wall(s, w, h, pixels);
    test_must(ctx, imp_scene_commit(s));
    test_must(ctx, imp_problem_create(s, &p));
    t.width = WIDTH, t.height = HEIGHT, t.channels = 3, t.pixels = target;
    test_must(ctx, imp_problem_activate(p, "*data*"));
    test_must(ctx, imp_problem_add_target(p, &t));
    o.optimizer = IMP_LM;
    o.max_iterations = 2;
    run.spp = 8;
    const double start = processor_s();
    test_must(ctx, imp_fit(p, &o, &run, &result));
    const double taken = processor_s() - start;
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    return taken;
}

int main(void)
{
    imp_context *ctx = test_context(1);
    double least[KINDS];
    for (int k = 0; k < KINDS; k++) least[k] = INFINITY;
    for (int round = 0; round < ROUNDS; round++)
        for (int k = 0; k < KINDS; k++)
            least[k] = fmin(least[k], fit_s(ctx, texels[k][0], texels[k][1]));
    for (int k = 0; k < KINDS; k++)
        printf("%s{\"numbers\":%d,\"seconds\":%.3f,\"ratio\":%.2f}", k ? "," : "[",
               3 * texels[k][0] * texels[k][1], least[k], least[k] / least[0]);
    printf("]\n");
    imp_context_destroy(ctx);
    return 0;
}
