/* SPDX-License-Identifier: Apache-2.0
 *
 * importon jacobian: one picture per control, dI/dtheta, all from one set of walks. A
 * colour is one control: lane c of a picture depends on lane c of a colour only, so the
 * three derivatives share one picture without loss (CONVENTIONS.md). */
#include "shared/blocks.h"
#include "shared/command.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/sheet.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int separate;
static const char *sheet_path, *layers_path;
static struct sheet sheet;
static const struct arg_option options[] = {
    {ARG_FLAG | ARG_REPLAYS, 0, "separate", NULL,
     "one picture per value, also for colours", &separate, 0, 0, NULL},
    {ARG_TEXT | ARG_ASIDE, 0, "sheet", "FILE.png",
     "one PNG with all the pictures side by side", &sheet_path, 0, 0, NULL},
    {ARG_TEXT | ARG_ASIDE, 0, "layers", "FILE.exr",
     "one EXR with the picture and its derivatives as layers d.NAME, for viewers",
     &layers_path, 0, 0, NULL},
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

/* A block is one control, or as many as it has values. */
static size_t n_controls(const struct block *b)
{
    return !separate && b->n == 3 && (b->info.flags & IMP_PARAM_COLOR) ? 1 : b->n;
}
static char *control_name(const struct block *b, size_t i, char *name, size_t size)
{
    if (n_controls(b) == 1) snprintf(name, size, "%s", b->info.name);
    else snprintf(name, size, "%s.%zu", b->info.name, i);
    return name;
}
static char *control_path(const char *name)
{
    char file[600];
    snprintf(file, sizeof file, "%s.exr", name);
    make_file_name(file);
    return join_path(cli.out, file);
}

/* May everything be written? */
enum { LAYERS_MAX = 254, LAYER_NAME = 148 }; /* of four channels, 1024 in all */

static int writable(const struct block *blocks, size_t n_blocks)
{
    char name[512];
    size_t layers = 0;
    int rc = overwrite_check_in(cli.out, "controls.csv", OUTPUT_TABLE);
    char *picture = join_path(cli.out, "picture.exr");
    if (!rc) rc = picture_writable(picture, 1);
    free(picture);
    for (size_t k = 0; k < n_blocks; k++)
        for (size_t i = 0; i < n_controls(&blocks[k]) && !rc; i++) {
            char *path = control_path(control_name(&blocks[k], i, name, sizeof name));
            rc = picture_writable(path, 1);
            free(path);
            if (!rc && layers_path && (strpbrk(name, " ,") || strlen(name) > LAYER_NAME))
                rc = cli_error(EXIT_USAGE, "--layers: '%.60s' is no name of a layer",
                               name);
            layers++;
        }
    if (!rc && layers_path && layers > LAYERS_MAX)
        rc = cli_error(EXIT_USAGE, "--layers: %zu derivatives; a file has room for %d",
                       layers, LAYERS_MAX);
    if (!rc && sheet_path) rc = picture_writable(sheet_path, 0);
    if (!rc && layers_path) rc = picture_writable(layers_path, 0);
    return rc;
}

/* A picture of one derivative, its line in the answer and in the table beside it. */
static int write_control(struct json *j, FILE *table, imp_film *film,
                         struct imp_estimate mean, const char *name,
                         const struct imp_run *run)
{
    const double red = picture_range(film);
    const struct picture_options o = {.standard_error = 1, .diverging = 1, .range = red};
    char *path = control_path(name);
    picture_stamp(film, run);
    const int rc = picture_write(film, path, &o);
    sheet_add(&sheet, path);
    if (!rc)
        fprintf(table, "%s,%.9g,%.3g,%.9g\n", strrchr(path, '/') + 1, mean.value, mean.se,
                red);
    if (!rc && cli.json) {
        json_object(j, NULL);
        json_text(j, "name", name);
        json_text(j, "file", path);
        json_number(j, "mean", mean.value);
        json_number(j, "se", mean.se);
        json_number(j, "red", red);
        json_end_object(j);
    } else if (!rc) {
        char blue[32];
        snprintf(blue, sizeof blue, "-%.3g", red);
        printf("%-40s mean %-12.6g +- %-9.2g %s is blue, %.3g red\n", path, mean.value,
               mean.se, blue, red);
    }
    free(path);
    return rc;
}

/* The picture that each number belongs to, [n_x]; returns how many there are. */
static int group_numbers(const struct block *blocks, size_t n_blocks, int *group)
{
    int n = 0;
    for (size_t k = 0; k < n_blocks; k++)
        for (size_t i = 0; i < blocks[k].n; i++) {
            n += i == 0 || n_controls(&blocks[k]) > 1;
            group[blocks[k].first + i] = n - 1;
        }
    return n;
}

/* means: those of the block's pictures. */
static int write_block(struct json *j, FILE *table, const struct block *b,
                       imp_film **films, const struct imp_estimate *means,
                       const struct imp_run *run)
{
    const size_t n = n_controls(b);
    char name[512];
    int rc = 0;
    for (size_t i = 1; i < b->n && n == 1; i++)
        add_film(films[b->first], films[b->first + i]);
    for (size_t i = 0; i < n && !rc; i++) {
        if (n > 1 && block_held(b, i)) { /* its picture is 0 */
            if (!cli.json) printf("%-40s held\n", control_name(b, i, name, sizeof name));
            continue;
        }
        rc = write_control(j, table, films[b->first + i], means[i],
                           control_name(b, i, name, sizeof name), run);
    }
    return rc;
}

/* The picture, which is changed, with all derivatives as layers. */
static int write_layers(imp_film *primal, imp_film **films, const struct block *blocks,
                        size_t n_blocks)
{
    const struct picture_options o = {.standard_error = 1, .no_preview = 1};
    char name[512], layer[520];
    enum imp_status st = imp_film_set_text(primal, PICTURE_LAYERS, "derivatives");
    for (size_t k = 0; k < n_blocks; k++)
        for (size_t i = 0; i < n_controls(&blocks[k]) && st == IMP_OK; i++) {
            control_name(&blocks[k], i, name, sizeof name);
            snprintf(layer, sizeof layer, "d.%s", name);
            st = imp_film_add_layer(primal, films[blocks[k].first + i], layer);
        }
    return st == IMP_OK ? picture_write(primal, layers_path, &o) : cli_fail(st, NULL);
}

/* Everything, once the walks are done. */
static int answer(const struct imp_run *run, imp_film *primal, imp_film **films,
                  struct imp_estimate mean, const struct imp_estimate *means,
                  const struct block *blocks, size_t n_blocks)
{
    const struct picture_options plain = {.standard_error = 1};
    struct imp_film_info info = {.size = sizeof info};
    struct json j = {stdout, 0};
    struct output table;
    char *csv = join_path(cli.out, "controls.csv");
    char *path = join_path(cli.out, "picture.exr");
    int rc = output_open(&table, csv, OUTPUT_TABLE);
    if (!rc) {
        fprintf(table.file, "file,mean,se,red\n");
        if (cli.json) {
            imp_film_get_info(primal, &info);
            j = cli_json();
            json_seed(&j, "seed", run->seed);
            json_integer(&j, "spp", cli_spp(run));
            json_integer(&j, "spp_taken", info.spp);
            json_array(&j, "controls");
        }
        picture_stamp(primal, run);
        rc = picture_write(primal, path, &plain);
        sheet_add(&sheet, path);
        if (!rc && !cli.json)
            printf("%-40s mean %-12.6g +- %.2g\n", path, mean.value, mean.se);
        for (size_t k = 0; k < n_blocks && !rc; k++) {
            rc = write_block(&j, table.file, &blocks[k], films, means, run);
            means += n_controls(&blocks[k]);
        }
        if (cli.json) {
            json_end_array(&j);
            json_object(&j, "picture");
            json_text(&j, "file", path);
            json_number(&j, "mean", mean.value);
            json_number(&j, "se", mean.se);
            json_end_object(&j);
            cli_json_end(&j);
        }
        rc = output_close(&table, rc);
    }
    if (!rc && sheet_path) rc = sheet_write(&sheet, 4, sheet_path);
    if (!rc && layers_path) rc = write_layers(primal, films, blocks, n_blocks);
    free(path);
    free(csv);
    return rc;
}

/* Has every pixel some? */
static int has_samples(const imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    return info.spp > 0;
}

static int run_jacobian(int n, char **operand)
{
    imp_problem *problem = NULL;
    imp_film *primal = NULL, **films = NULL;
    struct imp_estimate mean = {0}, *means = NULL;
    int *group = NULL;
    struct block *blocks = NULL;
    size_t n_blocks = 0;
    (void)n;
    int rc = cli_load(operand[0]);
    if (rc) return rc;
    if (!cli.out && !cli.part)
        return cli_error(EXIT_USAGE, "jacobian: -o DIR is needed: a picture for "
                                     "each control goes there");
    rc = problem_open(&problem);
    if (rc) return rc;
    if (!cli.part) rc = make_folder(cli.out);
    blocks = problem_blocks(problem, &n_blocks);
    if (!rc && !cli.part) rc = writable(blocks, n_blocks);
    if (rc) {
        free(blocks);
        problem_close(problem);
        return rc;
    }
    const struct imp_run run = cli_run();
    const size_t n_x = imp_problem_n_variables(problem);
    films = cli_alloc(n_x, sizeof *films);
    means = cli_alloc(n_x, sizeof *means);
    group = cli_alloc(n_x, sizeof *group);
    const int n_groups = group_numbers(blocks, n_blocks, group);
    enum imp_status st = imp_problem_jacobian(problem, &run, &primal, films);
    const int whole = !primal || has_samples(primal);
    if (st == IMP_PART || (primal && whole && !cli_failed(st))) {
        progress_resume(); /* the pictures that are there get their errors */
        st = imp_problem_jacobian_sums(problem, NULL, &run, primal, films, group,
                                       n_groups, &mean, means);
    }
    if (cli_failed(st)) rc = cli_fail(st, cli.scene_path);
    /* none, or not of every pixel: their means would be those of a part */
    if (!rc && (!primal || !whole) && st != IMP_PART)
        cli_say("interrupted in the first pass: no pictures are written");
    if (!rc && primal && whole)
        rc = answer(&run, primal, films, mean, means, blocks, n_blocks);
    if (!rc) rc = cli_done();
    sheet_free(&sheet);
    imp_film_destroy(primal);
    for (size_t i = 0; i < n_x; i++) imp_film_destroy(films[i]);
    free(films);
    free(means);
    free(group);
    free(blocks);
    problem_close(problem);
    return rc;
}

const struct command command_jacobian = {
    {"jacobian",
     "SCENE",
     "one derivative picture per parameter, from one set of walks",
     {options, options_params, options_run, options_limits, options_guide, options_scene,
      options_folder, options_general},
     1,
     1},
    run_jacobian,
    0,
    1,
    REPLAYS_PARTS};
