/* SPDX-License-Identifier: Apache-2.0
 *
 * The mean of a sensor's film by walks from one end, for tests that compare the ends. */
#ifndef IMP_TEST_END_READING_H
#define IMP_TEST_END_READING_H

#include "imp_scene.h"
#include "imp_tap.h"

static inline struct imp_estimate end_reading(imp_context *ctx, imp_scene *scene,
                                              enum imp_from from, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    imp_problem *p;
    run.from = from;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
    imp_problem_destroy(p);
    return e;
}

#endif
