/* SPDX-License-Identifier: Apache-2.0
 *
 * importon what-if: walks that importon record has written are evaluated at other
 * parameters, against other targets and in other regions, without the scene and without a
 * ray. Each answer has its standard error and the effective sample size; where too few
 * walks count it is refused. */
#include "shared/blocks.h"
#include "shared/command.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/region.h"
#include "shared/sensor_names.h"
#include "shared/settings.h"
#include "text/progress.h"

#include <importon/walks.h>

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static struct {
    struct picture_options picture;
    int gradient;
    double memory, ess;
    const char *region, *sweep;
} o;

static const struct arg_option options[] = {
    {ARG_LIST, 0, "set", "ID=V[,V..]",
     "evaluate at other values; @FILE: many (--gradient lists them)", &cli.sets, 0, 0,
     NULL},
    {ARG_TEXT, 's', "sensor", "SENSOR", "its name, or its index from 0", &cli.sensor_text,
     0, 0, NULL},
    {ARG_TEXT, 0, "region", "X0,Y0,X1,Y1",
     "mean over the pixels from X0 to before X1 and Y0 to before Y1 (default: all)",
     &o.region, 0, 0, NULL},
    {ARG_FLAG, 0, "gradient", NULL, "derivatives by the active parameters, with errors",
     &o.gradient, 0, 0, NULL},
    {ARG_TEXT, 0, "sweep", "ID=FROM:TO:N",
     "N values of a parameter, or of its value K (ID[K]), and the answer at each",
     &o.sweep, 0, 0, NULL},
    {ARG_NUMBER, 0, "memory", "MB", "for the walks (default 1074)", &o.memory, 1e-3, 1e12,
     NULL},
    {ARG_NUMBER, 0, "ess", "F",
     "refuse below this effective sample size, a fraction (default: the file's)", &o.ess,
     1e-6, 1, NULL},
    {ARG_FLAG, 0, "se", NULL, "add the standard error of every channel to the EXR file",
     &o.picture.standard_error, 0, 0, NULL},
    {ARG_FLAG, 0, "half", NULL, "16-bit floats in the EXR file", &o.picture.half, 0, 0,
     NULL},
    {ARG_NUMBER, 0, "exposure", "STOPS", "exposure of the PNG preview",
     &o.picture.exposure, -100, 100, NULL},
    {ARG_FLAG, 0, "no-preview", NULL, "write no PNG beside the picture",
     &o.picture.no_preview, 0, 0, NULL},
    {0}};

/* ---- Questions ------------------------------------------------------------------- */

static struct {
    imp_walks *walks;
    imp_problem *problem;
    struct imp_run run;
    float *adjoint; /* for the mean over a region; NULL: for a loss */
    float *mask;    /* [height][width] of the region; NULL: all */
    size_t n;
} w;

static int open_all(const char *path)
{
    struct imp_walks_options read = IMP_WALKS_OPTIONS_INIT;
    int rc = cli_open();
    if (rc) return rc;
    cli.scene_path = path;
    read.memory = (size_t)(1e6 * o.memory);
    read.ess = o.ess;
    const enum imp_status st = imp_walks_read(cli.context, NULL, path, &read, &w.walks);
    if (st != IMP_OK) return cli_fail(st, NULL);
    cli.scene = imp_walks_scene(w.walks);
    if (cli.sensor_text) rc = sensor_set(cli.sensor_text);
    for (size_t i = 0; i < cli.sets.n && !rc; i++) rc = settings_apply(cli.sets.item[i]);
    if (!rc && o.region && problem_options.targets.n)
        rc = cli_error(EXIT_USAGE, "--region is of means; the pixels of a loss are "
                                   "chosen by --mask");
    if (!rc && problem_options.clip)
        rc =
            cli_error(EXIT_USAGE, "--clip: pictures decide which numbers count, and kept "
                                  "walks make none");
    w.run = cli_run();
    w.run.walks = w.walks;
    if (!rc) rc = problem_open(&w.problem);
    if (rc) return rc;
    w.n = imp_problem_n_variables(w.problem);
    return problem_options.targets.n
               ? 0
               : region_take(o.region, w.run.sensor, &w.adjoint, &w.mask);
}

static void close_all(void)
{
    if (w.problem) problem_close(w.problem);
    free(w.adjoint);
    free(w.mask);
    cli.scene = NULL; /* the walks' */
    imp_walks_destroy(w.walks);
}

/* ---- Answers --------------------------------------------------------------------- */

struct answer {
    struct imp_estimate value;
    double ess, growth;
    char refused[512]; /* why; "": it is not */
};

/* The least effective sample size of the chosen sensors. */
static enum imp_status weigh(struct answer *a)
{
    const size_t n = problem_options.targets.n;
    a->ess = 1;
    a->growth = 0;
    for (size_t i = 0; i < (n ? n : 1); i++) {
        struct imp_walks_weight weight = IMP_WALKS_WEIGHT_INIT;
        const int sensor = n ? target_sensor(i) : w.run.sensor;
        const enum imp_status st = imp_walks_weigh(w.walks, sensor, w.mask, &weight);
        if (st != IMP_OK) return st;
        if (weight.refused) snprintf(a->refused, sizeof a->refused, "%s", weight.refused);
        a->ess = fmin(a->ess, weight.ess);
        a->growth = fmax(a->growth, weight.growth);
    }
    return IMP_OK;
}

/* grad and se [n]; NULL: the value alone. */
static enum imp_status ask(struct answer *a, double *grad, double *se)
{
    memset(a, 0, sizeof *a);
    enum imp_status st = weigh(a);
    if (st == IMP_OK)
        st = w.adjoint
                 ? imp_problem_functional(w.problem, w.adjoint, &w.run, &a->value, grad,
                                          se)
                 : imp_problem_objective(w.problem, NULL, &w.run, &a->value, grad, se);
    if (st == IMP_E_NUMERIC || st == IMP_E_UNSUPPORTED)
        snprintf(a->refused, sizeof a->refused, "%s", imp_last_error(cli.context));
    /* Answers are from all pixels, the weights from a subset of them. */
    return st == IMP_OK && a->refused[0] ? IMP_E_NUMERIC : st;
}

static const char *functional(void)
{
    return !w.adjoint ? "loss" : o.region ? "mean of the region" : "mean";
}

/* ---- One point ------------------------------------------------------------------- */

static void gradient_print(const struct block *blocks, size_t n_blocks, const double *x,
                           const double *grad, const double *se)
{
    int width = 9;
    char name[512];
    for (size_t k = 0; k < n_blocks; k++)
        if ((int)strlen(blocks[k].info.name) + 3 > width)
            width = (int)strlen(blocks[k].info.name) + 3;
    printf("\n%-*s  %-14s %-14s %s\n", width, "parameter", "value", "gradient", "se");
    for (size_t k = 0; k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        double sum = 0;
        for (size_t i = b->first; i < b->first + b->n; i++) {
            sum += grad[i];
            if (!block_is_large(b))
                printf("%-*s  %-14.8g %-14.7g %.2g\n", width,
                       cli_number_row(&b->info, i - b->first, name, sizeof name), x[i],
                       grad[i], se[i]);
        }
        if (block_is_large(b))
            printf("%-*s  %zu numbers: sum of gradient %.6g\n", width, b->info.name, b->n,
                   sum);
    }
}

static void gradient_json(struct json *j, const struct block *blocks, size_t n_blocks,
                          const double *x, const double *grad, const double *se)
{
    json_array(j, "params");
    for (size_t k = 0; k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        block_json(j, b);
        json_numbers(j, "value", b->n, x + b->first);
        json_numbers(j, "grad", b->n, grad + b->first);
        json_numbers(j, "se", b->n, se + b->first);
        json_end_object(j);
    }
    json_end_array(j);
}

static struct json begin_json(void)
{
    struct imp_walks_info info = {.size = sizeof info};
    struct json j = cli_json();
    (void)imp_walks_get_info(w.walks, &info);
    json_seed(&j, "seed", info.seed);
    json_integer(&j, "spp", info.spp);
    json_number(&j, "walks", info.n_walks);
    json_text(&j, "functional", functional());
    if (!w.adjoint) json_text(&j, "loss", loss_word());
    return j;
}

static int answer_one(const char *picture)
{
    struct answer a;
    struct block *blocks = NULL;
    size_t n_blocks = 0;
    double *x = cli_alloc(3 * w.n + 1, sizeof *x), *grad = x + w.n, *se = grad + w.n;
    imp_problem_get_x(w.problem, x);
    const enum imp_status st = ask(&a, o.gradient ? grad : NULL, o.gradient ? se : NULL);
    int rc = st == IMP_OK ? 0
             : st == IMP_E_NUMERIC && a.refused[0]
                 ? cli_error(EXIT_RUN, "%s: %s", cli.scene_path, a.refused)
                 : cli_fail(st, cli.scene_path);
    if (!rc) blocks = problem_blocks(w.problem, &n_blocks);
    if (!rc && cli.json) {
        struct json j = begin_json();
        json_number(&j, "value", a.value.value);
        json_number(&j, "se", a.value.se);
        json_number(&j, "ess", a.ess);
        json_number(&j, "growth", a.growth);
        if (picture) json_text(&j, "file", picture);
        if (o.gradient) gradient_json(&j, blocks, n_blocks, x, grad, se);
        cli_json_end(&j);
    } else if (!rc) {
        printf("%s  %.8g +- %.2g, effective sample size %.3g\n", functional(),
               a.value.value, a.value.se, a.ess);
        if (o.gradient) gradient_print(blocks, n_blocks, x, grad, se);
    }
    free(blocks);
    free(x);
    return rc;
}

/* ---- A sweep --------------------------------------------------------------------- */

struct sweep {
    char name[256];
    size_t param, first, n; /* values that change */
    size_t count;           /* of the parameter */
    double from, to;
    int points;
    double *values; /* [count] */
};

static int sweep_read(struct sweep *s)
{
    const char *equal = strrchr(o.sweep, '=');
    struct imp_param_info info = {.size = sizeof info};
    char end;
    *s = (struct sweep){.n = 0};
    if (!equal || (size_t)(equal - o.sweep) >= sizeof s->name ||
        sscanf(equal + 1, "%lf:%lf:%d%c", &s->from, &s->to, &s->points, &end) != 3 ||
        s->points < 2 || s->points > 100000 || !isfinite(s->from) || !isfinite(s->to))
        return cli_error(EXIT_USAGE, "--sweep %s: expected ID=FROM:TO:N, N at least 2",
                         o.sweep);
    memcpy(s->name, o.sweep, (size_t)(equal - o.sweep));
    char name[sizeof s->name];
    memcpy(name, s->name, sizeof name);
    char *bracket = strrchr(name, '[');
    unsigned long element = 0;
    const bool one = bracket && sscanf(bracket, "[%lu]%c", &element, &end) == 1;
    if (one) *bracket = 0;
    enum imp_status st = imp_scene_find_param(cli.scene, name, &s->param);
    if (st == IMP_OK) st = imp_scene_get_param(cli.scene, s->param, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    if (element >= info.count)
        return cli_error(EXIT_USAGE, "--sweep %s: %s has %zu numbers", o.sweep, name,
                         info.count);
    s->count = info.count;
    s->first = one ? element : 0;
    s->n = one ? 1 : info.count;
    s->values = cli_alloc(info.count, sizeof *s->values);
    st = imp_scene_get_values(cli.scene, s->param, s->values);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

static int answer_sweep(void)
{
    struct sweep s;
    struct json j = {0};
    int rc = sweep_read(&s);
    if (rc) return rc;
    if (cli.json) {
        j = begin_json();
        json_text(&j, "sweep", s.name);
        json_array(&j, "rows");
    } else printf("%-14s %-14s %-10s %s\n", s.name, functional(), "se", "ess");
    for (int k = 0; k < s.points && !rc && !progress_interrupted(); k++) {
        const double at = s.from + (s.to - s.from) * k / (s.points - 1);
        struct answer a = {.ess = NAN};
        for (size_t e = 0; e < s.n; e++) s.values[s.first + e] = at;
        enum imp_status st = imp_scene_set_values(cli.scene, s.param, s.count, s.values);
        if (st == IMP_E_ARG) { /* beyond a bound */
            snprintf(a.refused, sizeof a.refused, "%s", imp_last_error(cli.context));
            st = IMP_E_NUMERIC;
        } else if (st == IMP_OK) st = ask(&a, NULL, NULL);
        if (st != IMP_OK && st != IMP_E_NUMERIC && st != IMP_E_UNSUPPORTED) {
            rc = cli_fail(st, cli.scene_path);
        } else if (cli.json) {
            json_object(&j, NULL);
            json_number(&j, "at", at);
            json_number(&j, "value", st == IMP_OK ? a.value.value : NAN);
            json_number(&j, "se", st == IMP_OK ? a.value.se : NAN);
            json_number(&j, "ess", a.ess);
            if (st != IMP_OK) json_text(&j, "refused", a.refused);
            json_end_object(&j);
        } else if (st == IMP_OK) {
            printf("%-14.8g %-14.8g %-10.2g %.3g\n", at, a.value.value, a.value.se,
                   a.ess);
        } else printf("%-14.8g refused: %s\n", at, a.refused);
    }
    if (cli.json) {
        json_end_array(&j);
        cli_json_end(&j);
    }
    free(s.values);
    return rc;
}

/* ---- The command ----------------------------------------------------------------- */

static int picture_make(const char *path)
{
    imp_film *film = NULL;
    int rc = picture_writable(path, !o.picture.no_preview);
    if (rc) return rc;
    const enum imp_status st = imp_render(cli.scene, &w.run, &film);
    if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    if (!rc) picture_stamp(film, &w.run);
    if (!rc) rc = picture_write(film, path, &o.picture);
    imp_film_destroy(film);
    return rc;
}

static int run_whatif(int n, char **operand)
{
    (void)n;
    if (o.sweep && (o.gradient || cli.out))
        return cli_error(EXIT_USAGE, "--sweep is a table of values: not with %s",
                         o.gradient ? "--gradient" : "-o");
    int rc = open_all(operand[0]);
    if (!rc && cli.out) rc = picture_make(cli.out);
    if (!rc && (!cli.out || strcmp(cli.out, "-"))) /* which the picture has */
        rc = o.sweep ? answer_sweep() : answer_one(cli.out);
    close_all();
    return rc ? rc : cli_done();
}

const struct command command_whatif = {
    {"what-if",
     "FILE",
     "answers at other parameters from recorded walks, without the scene",
     {options, options_targets, options_params, options_file, options_general},
     1,
     1},
    run_whatif,
    0,
    0,
    REPLAYS_NEVER};
