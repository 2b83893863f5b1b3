/* SPDX-License-Identifier: Apache-2.0
 *
 * importon plan: which picture to take next. Ranks candidates by how much they would shrink the
 * intervals of the active numbers, and chooses a set of them. */
#include "plan_answer.h"
#include "plan_maps.h"
#include "shared/command.h"
#include "shared/noise.h"
#include "shared/problem_options.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static struct {
    int take, criterion, improve;
    double budget;
    const char *noise, *map;
} o;

static const char *const criterion_words[] = {"D", "A", NULL};

static const struct arg_option options[] = {
    {ARG_INT | ARG_REPLAYS, 'k', "take", "K", "choose K candidates together (default 1)",
     &o.take, 1, 4096, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "budget", "COST",
     "choose as many as these costs allow (with --take: at most K)", &o.budget, 1e-12,
     1e12, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 0, "criterion", "WORD",
     "D (default): determinant of the covariance; A: sum of the variances", &o.criterion,
     0, 0, criterion_words},
    {ARG_TEXT | ARG_REPLAYS, 0, "noise", "KEY=V[,..]",
     "of a value v at time of exposure 1: variance read^2 + shot v + (relative v)^2; "
     "with "
     "white=V values from V on are saturated (default: read is 1 % of the picture's "
     "mean)",
     &o.noise, 0, 0, NULL},
    {ARG_INT, 0, "improve", "ROUNDS",
     "move the best camera of --sphere or --path along the derivative of its gain, at "
     "its "
     "distance",
     &o.improve, 1, 200, NULL},
    {ARG_TEXT, 0, "map", "PREFIX",
     "pictures of which pixels of the best candidate tell of which number, and of the "
     "criterion",
     &o.map, 0, 0, NULL},
    OPTION_PART,
    {0}};

/* What we have, and the best candidate, which moves. The result belongs to the problem, and the
 * search makes others: the ranking is made again, to the bit. */
static int improve(imp_problem *problem, struct plan_answer *a)
{
    const struct candidates *c = a->candidates;
    const size_t best = a->result->rows->candidate;
    struct imp_plan_candidate *some = cli_alloc(c->n_have + 1, sizeof *some);
    memcpy(some, c->c, c->n_have * sizeof *some);
    some[c->n_have] = c->c[best];
    enum imp_status st = IMP_OK;
    int rc = 0;
    if (!c->c[best].placed)
        rc = cli_error(EXIT_USAGE,
                       "--improve: %s is a sensor of the scene; it moves "
                       "cameras of --sphere and --path",
                       c->c[best].name);
    else
        st = imp_plan_improve(problem, some, c->n_have + 1, a->options, a->run, o.improve,
                              a->origin, &a->gain);
    if (!rc && st == IMP_OK)
        st = imp_plan(problem, c->c, c->n, a->options, a->run, &a->result);
    free(some);
    a->improved = !rc && st == IMP_OK;
    return rc ? rc : st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

static int plan(imp_problem *problem, const struct candidates *c,
                const struct plan_numbers *numbers)
{
    const struct imp_run run = cli_run();
    const struct imp_plan_result *result = NULL;
    struct imp_plan_options p = IMP_PLAN_OPTIONS_INIT;
    p.criterion = o.criterion ? IMP_PLAN_A : IMP_PLAN_D;
    p.of = numbers->n_of ? numbers->of : NULL;
    p.n_of = numbers->n_of;
    p.prior = numbers->prior;
    p.take = (size_t)o.take;
    p.budget = o.budget;
    struct noise noise = {0};
    int rc = o.noise ? noise_read(o.noise, true, &noise) : 0;
    p.read = noise.read;
    p.shot = noise.shot;
    p.relative = noise.relative;
    p.white = noise.white;
    if (!rc && o.map) rc = plan_map_writable(o.map, numbers);
    if (rc) return rc;
    const enum imp_status st = imp_plan(problem, c->c, c->n, &p, &run, &result);
    if (st == IMP_CANCELLED)
        return cli_error(cli_done(), "interrupted: there is no ranking yet");
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    struct plan_answer a = {c, numbers, &p, result, &run, .improved = 0};
    if (o.improve) rc = improve(problem, &a);
    if (rc) return rc;
    if (cli.json) plan_answer_json(&a);
    else plan_answer_print(&a);
    return o.map ? plan_map_write(o.map, problem, &a) : 0;
}

static int run_plan(int n, char **operand)
{
    imp_problem *problem = NULL;
    struct candidates candidates = {0};
    struct plan_numbers numbers = {0};
    (void)n;
    int rc = cli_load(operand[0]);
    if (!rc) rc = problem_open(&problem);
    if (rc) return rc;
    rc = candidates_make(&candidates);
    if (!rc) rc = plan_numbers_make(problem, &numbers);
    if (!rc) rc = plan(problem, &candidates, &numbers);
    plan_numbers_free(&numbers);
    candidates_free(&candidates);
    problem_close(problem);
    return rc ? rc : cli_done();
}

const struct command command_plan = {
    {"plan",
     "SCENE",
     "which picture to take next, by the intervals that it would leave",
     {options, options_candidates, options_numbers, options_params, options_run,
      options_scene, options_file, options_general},
     1,
     1},
    run_plan,
    1,
    1,
    REPLAYS_PARTS};
