/* SPDX-License-Identifier: Apache-2.0
 *
 * importon compare: do two pictures have the same expectation?
 * (docs/scene-format.md 14.) */
#include "shared/command.h"
#include "shared/picture_files.h"
#include <string.h>

static struct {
    const char *variance;
    double n_test, n_reference, floor;
    int plain;
} o;

static const struct arg_option options[] = {
    {ARG_TEXT, 0, "variance", "FILE", "per-sample variance of the reference", &o.variance,
     0, 0, NULL},
    {ARG_NUMBER, 0, "spp-test", "N", "samples per pixel of the test picture", &o.n_test,
     1, 1e15, NULL},
    {ARG_NUMBER, 0, "spp-ref", "N", "samples per pixel of the reference (default: exact)",
     &o.n_reference, 1, 1e15, NULL},
    {ARG_NUMBER, 0, "floor", "V",
     "smallest variance used (default 1e-4 of the squared mean)", &o.floor, 1e-300, 1e300,
     NULL},
    {ARG_FLAG, 0, "plain-variance", NULL,
     "channels of the variance are R, G, B (default: X, Y, Z converted to RGB)", &o.plain,
     0, 0, NULL},
    {0}};

static int has_channel(const imp_film *film, const char *name)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    for (int c = 0; c < info.channels; c++)
        if (!strcmp(imp_film_channel(film, c), name)) return 1;
    return 0;
}

/* xyz: of other channels than the files have. */
static void print_text(const struct imp_compare_result *r, bool xyz)
{
    printf("mean%s%.9g   %.9g\n", xyz ? " of XYZ   " : "          ", r->mean_a,
           r->mean_b);
    printf("rmse          %.6g\n", r->rmse);
    printf("relative rmse %.6g\n", r->relative_rmse);
    printf("max |a-b|     %.6g\n", r->max_abs);
    if (r->has_z) {
        printf("failing       %.4g of the pixels (1 %% test over the whole picture)\n",
               r->p_fail_fraction);
        printf("|z| > 2       %.4g of the pixels (0.0455 expected)\n", r->over2);
        printf("z of the mean %.4g (4 is the limit)\n", r->mean_z);
        printf("%s\n", r->agree ? "agree" : "DISAGREE");
    } else {
        printf("%s\n", r->agree ? "equal" : "different (no variance given: no z-test)");
    }
}

static int run_compare(int n, char **operand)
{
    struct imp_compare_options options_z = IMP_COMPARE_OPTIONS_INIT;
    struct imp_compare_result r = {.size = sizeof r};
    imp_film *a = NULL, *b = NULL, *variance = NULL;
    (void)n;
    int rc = cli_open();
    if (!rc) rc = picture_read(operand[0], &a);
    if (!rc) rc = picture_read(operand[1], &b);
    if (!rc && o.variance) rc = picture_read(o.variance, &variance);
    if (rc) goto out;
    options_z.variance = variance;
    options_z.n_test = o.n_test;
    options_z.n_reference = o.n_reference;
    options_z.floor = o.floor;
    options_z.xyz = variance && !o.plain && has_channel(variance, "R");
    const enum imp_status st = imp_compare(cli.context, a, b, &options_z, &r);
    if (st != IMP_OK) {
        rc = cli_fail(st, NULL);
        goto out;
    }
    if (cli.json) {
        struct json j = cli_json();
        json_text(&j, "test", operand[0]);
        json_text(&j, "reference", operand[1]);
        if (options_z.xyz) json_text(&j, "channels", "XYZ");
        json_number(&j, "mean_test", r.mean_a);
        json_number(&j, "mean_reference", r.mean_b);
        json_number(&j, "rmse", r.rmse);
        json_number(&j, "relative_rmse", r.relative_rmse);
        json_number(&j, "max_abs", r.max_abs);
        json_bool(&j, "has_z", r.has_z);
        if (r.has_z) {
            json_number(&j, "failing_fraction", r.p_fail_fraction);
            json_number(&j, "over2_fraction", r.over2);
            json_number(&j, "mean_z", r.mean_z);
        }
        json_bool(&j, "agree", r.agree);
        cli_json_end(&j);
    } else {
        print_text(&r, options_z.xyz);
    }
    rc = r.agree ? EXIT_DONE : EXIT_NO;
out:
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_film_destroy(variance);
    return rc;
}

const struct command command_compare = {
    {"compare",
     "TEST REFERENCE",
     "test whether two pictures have the same expectation",
     {options, options_file, options_general},
     2,
     2},
    run_compare,
    1,
    0,
    REPLAYS_NEVER};
