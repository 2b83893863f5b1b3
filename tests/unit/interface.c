/* SPDX-License-Identifier: Apache-2.0
 *
 * What hosts of other versions rely on: rows that are longer or shorter than the caller's
 * struct, the version of the library, names of 0.1, and calls of a build that return their
 * error. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/elements.h>
#include <math.h>

/* Rows as a host of an older version sees them: their first members. */
struct old_check_row {
    size_t size;
    const char *method, *param;
};
/* And as one of a newer version does. */
struct new_check_row {
    struct imp_check_row known;
    double more;
};

static void rows(imp_context *ctx, imp_scene *s)
{
    imp_problem *p = test_problem(ctx, s, "red.reflectance");
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_check_row *all;
    size_t n, same = 0, sized = 0;
    o.draws_s = 0.02;
    o.paths = 20, o.fresh_spp = 2, run.spp = 2;
    test_must(ctx, imp_check(p, &o, &run, &all, &n));
    for (size_t k = 0; k < n; k++) {
        const struct old_check_row *old =
            IMP_ROW(old_check_row, (const struct old_check_row *)(const void *)all, k);
        sized += all[k].size == sizeof *all;
        same += old->method == all[k].method && old->param == all[k].param;
    }
    tap_ok(n > 3 && sized == n, "each row has its size # %d rows", (int)n);
    tap_ok(same == n, "a caller with a shorter struct meets the same rows");
    const struct new_check_row *newer = (const struct new_check_row *)(const void *)all;
    tap_ok(!(sizeof *newer <= all->size) && IMP_ROW_HAS(imp_check_row, all, kinks),
           "one with a longer struct is not given what is not there");
    /* Rows of a library that has more members: twice as long. */
    struct imp_check_row wide[6] = {{0}};
    for (int k = 0; k < 6; k += 2) wide[k].size = 2 * sizeof *wide, wide[k].step = k;
    const struct imp_check_row *first = wide;
    tap_ok(IMP_ROW(imp_check_row, first, 2)->step == 4 &&
               IMP_ROW(imp_check_row, first, 1)->step == 2,
           "rows of a newer library are stepped through by their size");
    imp_problem_destroy(p);
}

static void self_test(imp_context *ctx, imp_scene *s)
{
    const struct imp_selftest_row *row;
    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    size_t n, sized = 0;
    o.samples = 1000, o.directions = 1;
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_MATERIAL, &o, &row, &n));
    for (size_t k = 0; k < n; k++)
        sized += IMP_ROW(imp_selftest_row, row, k)->size == sizeof *row;
    tap_ok(n > 0 && sized == n, "so have those of a self-test # %d rows", (int)n);
}

static void elements(imp_context *ctx, imp_scene *s)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_info info = {.size = sizeof info};
    imp_elements *e;
    const struct imp_elements_row *row;
    struct imp_elements_arrival *a;
    size_t n, m;
    o.stop = 0.3;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_get_info(e, &info));
    test_must(ctx, imp_elements_sensitivity(e, &row, &n));
    test_must(ctx, imp_elements_arrivals(e, 0, &a, &m));
    tap_ok(info.n_steps > 0 && info.steps->size == sizeof *info.steps && n > 0 &&
               IMP_ROW(imp_elements_row, row, n - 1)->size == sizeof *row && m > 0 &&
               IMP_ROW(imp_elements_arrival, a, m - 1)->size == sizeof *a,
           "and those of finite elements");
    imp_free(ctx, a);
    imp_elements_destroy(e);
}

static void names(imp_context *ctx, imp_scene *s)
{
    imp_problem *p = test_problem(ctx, s, "red.reflectance");
    struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
    size_t param, element;
    double lo, hi;
    test_must(ctx, imp_problem_get_variable(p, 1, &v));
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
    tap_ok(imp_problem_n(p) == imp_problem_n_variables(p) &&
               imp_problem_variable(p, 1, &param, &element, &lo, &hi) == IMP_OK &&
               param == v.param && element == 1 && lo == v.lo && hi == v.hi &&
               imp_problem_variable(p, 1, NULL, NULL, NULL, NULL) == IMP_OK &&
               imp_problem_variable(p, 99, NULL, NULL, NULL, NULL) == IMP_E_ARG,
           "names of 0.1 do the same");
#pragma GCC diagnostic pop
    imp_problem_destroy(p);
    char text[32];
    snprintf(text, sizeof text, "%d.%d.%d", imp_version_number() / 10000,
             imp_version_number() / 100 % 100, imp_version_number() % 100);
    tap_ok(imp_version_fits() && strcmp(text, imp_version()) == 0 &&
               strcmp(text, IMP_VERSION_STRING) == 0,
           "the version in words and numbers # %s", text);
}

static void build(imp_context *ctx)
{
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    tap_ok(imp_scene_begin(s, "shape", "sphere", NULL, NULL) == IMP_OK &&
               imp_scene_float(s, "radius", 1) == IMP_OK &&
               imp_scene_float(s, "width", NAN) == IMP_E_ARG,
           "a call of a build returns its error # %s", imp_last_error(ctx));
    const enum imp_status st = imp_scene_end(s);
    tap_ok(st == IMP_E_ARG && strstr(imp_last_error(ctx), "nan") &&
               imp_scene_commit(s) == st,
           "later calls and the commit return it, too # %s", imp_last_error(ctx));
    imp_scene_destroy(s);
    tap_ok(imp_scene_end(NULL) == IMP_E_ARG, "of no scene # %s", imp_last_error(NULL));
}

int main(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    rows(ctx, s);
    self_test(ctx, s);
    elements(ctx, s);
    names(ctx, s);
    build(ctx);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
