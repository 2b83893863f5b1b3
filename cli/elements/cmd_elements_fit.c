/* SPDX-License-Identifier: Apache-2.0
 *
 * importon elements --fit: lamp powers and reflectances for wanted measurements. */
#include "cmd_elements.h"
#include "shared/blocks.h"
#include "shared/output.h"
#include "shared/problem_options.h"
#include "text/progress.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const optimizer_words[] = {"auto", "lm",    "lbfgs",
                                              "mma",  "slsqp", NULL};
static const enum imp_optimizer optimizers[] = {IMP_ADAM, IMP_LM, IMP_LBFGS, IMP_MMA,
                                                IMP_SLSQP};

static struct {
    int fit, optimizer, iterations;
    double tolerance;
    struct arg_list bounds;
    const char *recovered;
} o;

const struct arg_option options_elements_fit[] = {
    {ARG_FLAG, 0, "fit", NULL,
     "fit the parameters of -p to the targets T of --lux, --plane and --region", &o.fit,
     0, 0, NULL},
    {ARG_LIST, 0, "bounds", "GLOB=LO,HI", "bounds of these parameters", &o.bounds, 0, 0,
     NULL},
    {ARG_LIST, 0, "tikhonov", "GLOB=W", "add W/2 |x|^2 over these parameters",
     &problem_options.tikhonov, 0, 0, NULL},
    {ARG_LIST, 0, "stay", "GLOB=W", "add W/2 |x - start|^2 over these parameters",
     &problem_options.stay, 0, 0, NULL},
    {ARG_CHOICE, 0, "optimizer", "NAME", "lm, lbfgs, mma or slsqp", &o.optimizer, 0, 0,
     optimizer_words},
    {ARG_INT, 'n', "iterations", "N", "maximum after every refinement (default 100)",
     &o.iterations, 1, 1e9, NULL},
    {ARG_NUMBER, 0, "tolerance", "T",
     "stop when relative steps stay below (default 1e-8)", &o.tolerance, 1e-15, 1, NULL},
    {ARG_TEXT, 0, "recovered", "FILE", "write the recovered parameters, for --set @FILE",
     &o.recovered, 0, 0, NULL},
    {0}};

/* In use until elements_fit_close. */
static struct {
    imp_problem *problem;
    const struct imp_elements_fit_result *result;
    struct imp_elements_bounds *bounds;
} found;

int elements_fit_wanted(void) { return o.fit; }
int elements_fit_writable(void)
{
    return o.recovered ? overwrite_check(o.recovered, OUTPUT_SETTINGS) : 0;
}

int elements_fit_check(const double *targets, size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (o.fit == isnan(targets[k]))
            return cli_error(EXIT_USAGE, o.fit
                                             ? "elements --fit: every --lux, --plane and "
                                               "--region needs its =TARGET"
                                             : "elements: a =TARGET needs --fit");
    if (o.fit && !n)
        return cli_error(EXIT_USAGE, "elements --fit: a target is needed: --lux "
                                     "SHAPE=TARGET, --plane or --region");
    if (o.fit && !problem_options.params.n)
        return cli_error(EXIT_USAGE,
                         "elements --fit: -p GLOB is needed: what may change");
    return 0;
}

int elements_fit(imp_elements *e, const double *targets, int *complete)
{
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    int rc = elements_bounds(&o.bounds, &found.bounds);
    if (!rc) rc = problem_open(&found.problem);
    if (rc) return rc;
    f.optimizer = optimizers[o.optimizer];
    f.max_iterations = o.iterations;
    f.tolerance = o.tolerance;
    f.targets = targets;
    f.n_bounds = o.bounds.n;
    f.bounds = found.bounds;
    const enum imp_status st = imp_elements_fit(e, found.problem, &f, &found.result);
    if (cli_failed(st)) return cli_fail(st, cli.scene_path);
    *complete = st == IMP_OK;
    return 0;
}

static void put_json(struct json *j, const struct elements_sources *s,
                     const struct block *blocks, size_t n_blocks)
{
    const struct imp_elements_fit_result *r = found.result;
    json_object(j, "fit");
    json_integer(j, "iterations", r->iterations);
    json_integer(j, "rounds", r->rounds);
    json_number(j, "value", r->objective);
    json_bool(j, "linear", r->linear);
    json_text(j, "reason", r->reason);
    json_array(j, "goals");
    for (size_t k = 0; k < r->n_goals; k++) {
        json_object(j, NULL);
        json_text(j, "goal", elements_source_name(s, k));
        json_number(j, "target", IMP_ROW(imp_elements_goal, r->goals, k)->target);
        json_number(j, "before", IMP_ROW(imp_elements_goal, r->goals, k)->before);
        json_number(j, "after", IMP_ROW(imp_elements_goal, r->goals, k)->after);
        json_end_object(j);
    }
    json_end_array(j);
    json_array(j, "params");
    for (size_t b = 0; b < n_blocks; b++)
        for (size_t i = 0; i < blocks[b].n; i++) {
            const struct imp_fit_variable *v =
                IMP_ROW(imp_fit_variable, r->variables, blocks[b].first + i);
            char name[512];
            json_object(j, NULL);
            json_text(j, "name", cli_number_name(&blocks[b].info, i, name, sizeof name));
            json_text(j, "unit", blocks[b].info.unit);
            json_number(j, "start", v->start);
            json_number(j, "value", v->value);
            json_integer(j, "at_bound", v->at_bound);
            json_end_object(j);
        }
    json_end_array(j);
    json_end_object(j);
}

static void print(const struct elements_sources *s, const struct block *blocks,
                  size_t n_blocks)
{
    const struct imp_elements_fit_result *r = found.result;
    printf("%-44s %13s %13s %13s\n", "measurement", "target", "before", "after");
    for (size_t k = 0; k < r->n_goals; k++)
        printf("%-44s %13.6g %13.6g %13.6g\n", elements_source_name(s, k),
               IMP_ROW(imp_elements_goal, r->goals, k)->target,
               IMP_ROW(imp_elements_goal, r->goals, k)->before,
               IMP_ROW(imp_elements_goal, r->goals, k)->after);
    printf("\n%-44s %13s %13s\n", "parameter", "start", "value");
    for (size_t b = 0; b < n_blocks; b++)
        for (size_t i = 0; i < blocks[b].n; i++) {
            const struct imp_fit_variable *v =
                IMP_ROW(imp_fit_variable, r->variables, blocks[b].first + i);
            char name[512];
            printf("%-44s %13.6g %13.6g%s\n",
                   cli_number_name(&blocks[b].info, i, name, sizeof name), v->start,
                   v->value,
                   v->at_bound < 0   ? "  at its lower bound"
                   : v->at_bound > 0 ? "  at its upper bound"
                                     : "");
        }
    printf("\nloss %.6g after %d iteration%s in %d round%s: %s\n", r->objective,
           r->iterations, plural(r->iterations), r->rounds, plural(r->rounds), r->reason);
}

static int write_set(const struct block *blocks, size_t n_blocks)
{
    struct output to;
    const int rc = output_open(&to, o.recovered, OUTPUT_SETTINGS);
    if (rc) return rc;
    fprintf(to.file, "# importon %s elements\n", imp_version());
    for (size_t b = 0; b < n_blocks; b++) {
        fprintf(to.file, "%s=", blocks[b].info.name);
        for (size_t i = 0; i < blocks[b].n; i++)
            fprintf(
                to.file, "%s%.17g", i ? "," : "",
                IMP_ROW(imp_fit_variable, found.result->variables, blocks[b].first + i)
                    ->value);
        fprintf(to.file, "\n");
    }
    return output_close(&to, 0);
}

void elements_fit_json(struct json *j, const struct elements_sources *s)
{
    size_t n_blocks;
    struct block *blocks = problem_blocks(found.problem, &n_blocks);
    put_json(j, s, blocks, n_blocks);
    free(blocks);
}

int elements_fit_answer(struct json *j, const struct elements_sources *s)
{
    size_t n_blocks;
    struct block *blocks = problem_blocks(found.problem, &n_blocks);
    const int rc = o.recovered ? write_set(blocks, n_blocks) : 0;
    if (!rc && j && s) put_json(j, s, blocks, n_blocks);
    else if (!rc && s) print(s, blocks, n_blocks);
    free(blocks);
    return rc;
}

void elements_fit_close(void)
{
    if (found.problem) problem_close(found.problem);
    found.problem = NULL;
}
