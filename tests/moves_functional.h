/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of gradients by what moves: a weighted sum over pictures of 24 x 16 pixels. The test has a
 * context, ctx. */
#ifndef IMP_TEST_MOVES_FUNCTIONAL_H
#define IMP_TEST_MOVES_FUNCTIONAL_H

#include "imp_scene.h"
#include "imp_tap.h"
#include "math/vec.h"

enum { WIDTH = 24, HEIGHT = 16 };
static imp_context *ctx;

/* Smooth over the picture, in steps of pixels that no difference notices. */
static float adjoint[WIDTH * HEIGHT * 3];
static inline void adjoint_make(void)
{
    for (int p = 0; p < WIDTH * HEIGHT; p++)
        for (int c = 0; c < 3; c++) {
            const double x = (p % WIDTH + .5) / WIDTH, y = (p / WIDTH + .5) / HEIGHT;
            adjoint[3 * p + c] =
                (float)((1 + 0.3 * sin(3 * x + 2 * y + c)) / (WIDTH * HEIGHT));
        }
}

static double functional(imp_scene *scene, int64_t seed, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p;
    struct imp_estimate value;
    run.spp = spp;
    run.seed = (uint64_t)seed;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_functional(p, adjoint, &run, &value, NULL, NULL));
    imp_problem_destroy(p);
    return value.value;
}

#endif
