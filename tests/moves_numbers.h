/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of gradients by what moves: imp_problem_reverse against central differences of pictures
 * of 24 x 16 pixels with the same random numbers. The test has a context, ctx. */
#ifndef IMP_TEST_MOVES_NUMBERS_H
#define IMP_TEST_MOVES_NUMBERS_H

#include "moves_functional.h"

struct number {
    const char *name;
    int k;
    double step;
};

enum { NUMBERS_MAX = 80 };
static void values_get(imp_scene *scene, const char *name, double *out, size_t *n,
                       size_t *index)
{
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_find_param(scene, name, index));
    test_must(ctx, imp_scene_get_param(scene, *index, &info));
    *n = info.count;
    if (*n > NUMBERS_MAX) exit(99);
    test_must(ctx, imp_scene_get_values(scene, *index, out));
}

static struct tap_stat difference_of(imp_scene *scene, const struct number *x, int spp)
{
    enum { GROUPS = 12 };
    struct tap_stat out = {0, 0, 0};
    double rest[NUMBERS_MAX], there[NUMBERS_MAX];
    size_t n, index;
    values_get(scene, x->name, rest, &n, &index);
    for (int g = 0; g < GROUPS; g++) {
        double value[2];
        for (int s = 0; s < 2; s++) {
            memcpy(there, rest, sizeof there);
            there[x->k] += (s ? 1 : -1) * x->step;
            test_must(ctx, imp_scene_set_values(scene, index, n, there));
            value[s] = functional(scene, 500 + g, spp);
        }
        tap_add(&out, (value[1] - value[0]) / (2 * x->step));
    }
    test_must(ctx, imp_scene_set_values(scene, index, n, rest));
    return out;
}

/* The geometric mean of reported over observed standard errors of n derivatives; squares [n]: sums of
 * the squares of the reported ones over the seeds. *counted: derivatives with an error. */
static double error_ratio(const struct tap_stat *g, const double *squares, size_t n,
                          int seeds, int *counted)
{
    double sum = 0;
    *counted = 0;
    for (size_t k = 0; k < n; k++) {
        if (!(squares[k] > 0)) continue;
        const double variance = imp__sqr(tap_se(&g[k])) * seeds;
        sum += 0.5 * log(squares[k] / seeds / variance);
        ++*counted;
    }
    return exp(sum / *counted);
}

/* Parameters are added, and some of their numbers compared; the standard error is at most
 * `largest` of the largest number of the same parameter. Ends the scene. */
static inline void numbers_compare(const char *what, imp_scene *scene, int spp,
                                   int spp_ref, double largest,
                                   const struct number *numbers)
{
    /* What few seeds say of spreads is within a fifth; where it is farther off, there are more. */
    enum { FEW = 12, MANY = 48 };
    imp_problem *p;
    static struct tap_stat g[3 * NUMBERS_MAX];
    double ratio = 1;
    int counted = 0, seeds = FEW;
    memset(g, 0, sizeof g);
    for (const struct number *x = numbers; x->name; x++)
        test_must(ctx, imp_scene_add_geometry(scene, x->name));
    test_must(ctx, imp_problem_create(scene, &p));
    const char *active[3 * NUMBERS_MAX];
    int first[3 * NUMBERS_MAX], n_active = 0;
    for (const struct number *x = numbers; x->name; x++) {
        if (n_active > 0 && strcmp(active[n_active - 1], x->name) == 0) continue;
        first[n_active] = (int)imp_problem_n_variables(p);
        active[n_active++] = x->name;
        test_must(ctx, imp_problem_activate(p, x->name));
    }
    const size_t n = imp_problem_n_variables(p);
    if (n > 3 * NUMBERS_MAX) exit(99);
    first[n_active] = (int)n;
    static double square[3 * NUMBERS_MAX];
    memset(square, 0, sizeof square);
    for (int s = 0; s < seeds; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double v[3 * NUMBERS_MAX], se[3 * NUMBERS_MAX];
        run.spp = spp;
        run.seed = 100 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, v, se));
        for (size_t k = 0; k < n; k++) {
            tap_add(&g[k], v[k]);
            square[k] += se[k] * se[k];
        }
        if (s != FEW - 1) continue;
        ratio = error_ratio(g, square, n, FEW, &counted);
        if (!(ratio > 0.8 && ratio < 1.2)) seeds = MANY;
    }
    imp_problem_destroy(p);
    ratio = error_ratio(g, square, n, seeds, &counted);
    tap_ok(ratio > 0.75 && ratio < 1.3,
           "%s: errors told over errors seen, mean of %d numbers # %.3f", what, counted,
           ratio);
    for (const struct number *x = numbers; x->name; x++) {
        int a = 0;
        double most = 0;
        while (strcmp(active[a], x->name) != 0) a++;
        for (int k = first[a]; k < first[a + 1]; k++) most = fmax(most, fabs(g[k].mean));
        const struct tap_stat ref = difference_of(scene, x, spp_ref),
                              *own = &g[first[a] + x->k];
        const double se = sqrt(square[first[a] + x->k]) / seeds;
        const double z = (own->mean - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < largest * most,
               "%s, %s[%d] # %.5f se %.5f ref %.5f se %.5f z %.2f", what, x->name, x->k,
               own->mean, se, ref.mean, tap_se(&ref), z);
    }
    imp_scene_destroy(scene);
}

/* What it has no gradient by, or what does not become a parameter: the error holds the word. NULL: it
 * has one. Ends the scene. */
static inline void number_refused(const char *what, imp_scene *scene, const char *name,
                                  const char *word)
{
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[NUMBERS_MAX];
    run.spp = 2;
    enum imp_status st = imp_scene_add_geometry(scene, name);
    if (st == IMP_OK) {
        test_must(ctx, imp_problem_create(scene, &p));
        test_must(ctx, imp_problem_activate(p, name));
        st = imp_problem_reverse(p, adjoint, &run, g, NULL);
        imp_problem_destroy(p);
    }
    tap_ok(word ? st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word)
                : st == IMP_OK,
           "%s # %s", what, st == IMP_OK ? "" : imp_last_error(ctx));
    imp_scene_destroy(scene);
}

#endif
