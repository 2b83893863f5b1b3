/* SPDX-License-Identifier: Apache-2.0
 *
 * importon jacobian: one picture per control, dI/dtheta, all from one set of walks. A
 * colour is one control: lane c of a picture depends on lane c of a colour only, so the
 * three derivatives share one picture without loss (CONVENTIONS.md). */
#include "command.h"
#include "picture.h"
#include "problem.h"
#include "progress.h"
#include "sheet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int separate;
static const char *sheet_path;
static struct sheet sheet;
static const struct arg_option options[] = {
    {ARG_FLAG, 0, "separate", NULL, "one picture per number, also for colours", &separate,
     0, 0, NULL},
    {ARG_TEXT, 0, "sheet", "FILE.png", "one PNG with all the pictures side by side",
     &sheet_path, 0, 0, NULL},
    {0}};

/* Sum of the films of one colour; they do not overlap, so errors add in squares. */
static void add_film(imp_film *sum, imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(sum, &info);
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    float *a = imp_film_mean(sum), *a_se = imp_film_se(sum);
    const float *b = imp_film_mean(film), *b_se = imp_film_se(film);
    for (size_t i = 0; i < n; i++) {
        a[i] += b[i];
        if (a_se && b_se) a_se[i] = (float)hypot(a_se[i], b_se[i]);
    }
}

/* Mean over pixels and channels. */
static void film_sums(imp_film *film, double *mean, double *mean_se)
{
    struct imp_film_info info = {.size = sizeof info};
    double sum = 0, squares = 0;
    imp_film_get_info(film, &info);
    const size_t n = (size_t)info.width * (size_t)info.height, c = (size_t)info.channels;
    const float *m = imp_film_mean(film), *se = imp_film_se(film);
    for (size_t i = 0; i < n; i++) {
        double error = 0; /* the channels of a pixel share walks */
        for (size_t k = i * c; k < (i + 1) * c; k++) {
            sum += m[k];
            if (se) error += se[k];
        }
        squares += error * error;
    }
    *mean = sum / (double)(n * c);
    *mean_se = se ? sqrt(squares) / (double)(n * c) : NAN;
}

static int write_control(struct json *j, imp_film *film, const char *name,
                         const struct imp_run *run, const struct picture_options *o)
{
    double mean, se;
    char file[600];
    snprintf(file, sizeof file, "%s.exr", name);
    make_file_name(file);
    char *path = join_path(cli.out, file);
    picture_stamp(film, run);
    const int rc = picture_write(film, path, o);
    film_sums(film, &mean, &se);
    sheet_add(&sheet, path);
    if (!rc && cli.json) {
        json_object(j, NULL);
        json_text(j, "name", name);
        json_text(j, "file", path);
        json_number(j, "mean", mean);
        json_number(j, "se", se);
        json_end_object(j);
    } else if (!rc) {
        printf("%-40s mean %-12.6g +- %.2g\n", path, mean, se);
    }
    free(path);
    return rc;
}

static int write_block(struct json *j, const struct block *b, imp_film **films,
                       const struct imp_run *run)
{
    const struct picture_options o = {.standard_error = 1, .diverging = 1};
    const int one = !separate && b->n == 3 && (b->info.flags & IMP_PARAM_COLOR);
    int rc = 0;
    if (one) {
        add_film(films[b->first], films[b->first + 1]);
        add_film(films[b->first], films[b->first + 2]);
        return write_control(j, films[b->first], b->info.name, run, &o);
    }
    for (size_t i = 0; i < b->n && !rc; i++) {
        char name[512];
        if (b->n == 1) snprintf(name, sizeof name, "%s", b->info.name);
        else snprintf(name, sizeof name, "%s.%zu", b->info.name, i);
        rc = write_control(j, films[b->first + i], name, run, &o);
    }
    return rc;
}

static int run_jacobian(int n, char **operand)
{
    imp_problem *problem = NULL;
    imp_film *primal = NULL, **films = NULL;
    struct block *blocks = NULL;
    size_t n_blocks = 0;
    (void)n;
    int rc = cli_load(operand[0]);
    if (rc) return rc;
    if (!cli.out)
        return cli_error(EXIT_USAGE, "jacobian: -o DIR is needed: a picture for "
                                     "each control goes there");
    rc = problem_open(&problem);
    if (rc) return rc;
    rc = make_folder(cli.out);
    if (!rc && sheet_path) rc = picture_writable(sheet_path);
    if (rc) {
        problem_close(problem);
        return rc;
    }
    const struct imp_run run = cli_run();
    progress_deadline(cli.time_s);
    const size_t n_x = imp_problem_n(problem);
    films = cli_alloc(n_x, sizeof *films);
    const enum imp_status st = imp_problem_jacobian(problem, &run, &primal, films);
    if (cli_failed(st)) rc = cli_fail(st, cli.scene_path);
    if (!rc && !primal) rc = cli_done(); /* stopped before anything was there */
    if (!rc && primal) {
        const struct picture_options plain = {.standard_error = 1};
        struct json j = {stdout, 0};
        if (cli.json) {
            j = cli_json();
            json_seed(&j, "seed", run.seed);
            json_integer(&j, "spp", cli_spp(&run));
            json_array(&j, "controls");
        }
        char *path = join_path(cli.out, "picture.exr");
        picture_stamp(primal, &run);
        rc = picture_write(primal, path, &plain);
        sheet_add(&sheet, path);
        free(path);
        blocks = problem_blocks(problem, &n_blocks);
        for (size_t k = 0; k < n_blocks && !rc; k++)
            rc = write_block(&j, &blocks[k], films, &run);
        if (cli.json) {
            json_end_array(&j);
            cli_json_end(&j);
        }
        if (!rc && sheet_path) rc = sheet_write(&sheet, 4, sheet_path);
        if (!rc) rc = cli_done();
    }
    sheet_free(&sheet);
    imp_film_destroy(primal);
    for (size_t i = 0; i < n_x; i++) imp_film_destroy(films[i]);
    free(films);
    free(blocks);
    problem_close(problem);
    return rc;
}

const struct command command_jacobian = {
    {"jacobian",
     "SCENE",
     "one derivative picture per parameter, from one set of walks",
     {options, options_params, options_run, options_guide, options_scene,
      options_general},
     1,
     1},
    run_jacobian,
    0};
