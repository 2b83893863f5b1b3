/* SPDX-License-Identifier: Apache-2.0
 *
 * What a fit has found: its table, and its files: history, JSON, pictures, settings. */
#include "fit_answer.h"
#include "fit_scene.h"
#include "shared/blocks.h"

#include "fit_pictures.h"
#include "shared/answer_file.h"
#include "shared/command.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "shared/plot.h"

#include <importon/clip.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static int write_history(const struct imp_fit_result *r)
{
    char *csv = join_path(cli.out, "loss.csv"), *svg = join_path(cli.out, "loss.svg");
    struct output to;
    int rc = output_open(&to, csv, OUTPUT_TABLE);
    if (!rc) {
        fprintf(to.file, "iteration,loss,se\n");
        for (size_t i = 0; i < r->n_history; i++)
            fprintf(to.file, "%zu,%.9g,%.3g\n", i, r->history[i],
                    r->history_se ? r->history_se[i] : NAN);
        rc = output_close(&to, 0);
    }
    if (!rc)
        rc = plot_curve(svg, "Loss", "iteration", loss_word(), r->n_history, r->history,
                        r->history_se);
    free(csv);
    free(svg);
    return rc;
}

static int write_json(const struct fit_answer *a, char **paths)
{
    struct answer_file to;
    const int rc = answer_open(&to, cli.out, "parameters.json", "fit");
    if (rc) return rc;
    fit_answer_json(&to.json, a, paths);
    return answer_close(&to, 0);
}

/* What is left, or that it is below the noise of so many samples. */
static void print_residual(const struct imp_fit_result *r)
{
    if (!isfinite(r->residual)) return;
    if (!(r->residual_hi > 0)) printf("residual within its noise");
    else if (r->residual_hi > 1.5 * r->residual)
        printf("residual below %.2g %% of the targets", 100 * r->residual_hi);
    else printf("residual %.3g %% of the targets", 100 * r->residual);
    if (isfinite(r->chi2) && (r->chi2_se < 1 || r->chi2 > 3 * r->chi2_se))
        printf("; chi-square per degree of freedom %.*f +- %.1g", r->chi2 < 100, r->chi2,
               r->chi2_se);
    else if (isfinite(r->chi2))
        printf("; chi-square needs more --spp: our noise is above the targets'");
    printf("\n");
}

static struct imp_clipped clipped_of(const imp_problem *problem)
{
    struct imp_clipped c = IMP_CLIPPED_INIT;
    if (imp_problem_get_clipped(problem, &c) != IMP_OK) c.numbers = 0;
    return c;
}

static void print_clipped(const imp_problem *problem)
{
    const struct imp_clipped c = clipped_of(problem);
    if (c.numbers)
        printf("%zu of %zu numbers are clipped, %zu in which the scene disagrees; %zu at "
               "the "
               "levels or near have no weight\n",
               c.clipped, c.numbers, c.against, c.silent);
}

void fit_clipped_json(struct json *j, const imp_problem *problem)
{
    const struct imp_clipped c = clipped_of(problem);
    if (!c.numbers) return;
    json_object(j, "clipped");
    json_integer(j, "numbers", (int64_t)c.numbers);
    json_integer(j, "clipped", (int64_t)c.clipped);
    json_integer(j, "silent", (int64_t)c.silent);
    json_integer(j, "against", (int64_t)c.against);
    json_end_object(j);
}

static void print_table(const struct fit_answer *a, char **paths)
{
    const struct imp_fit_result *r = a->result;
    int width = 9;
    for (size_t k = 0; k < a->n_blocks; k++)
        if ((int)strlen(a->blocks[k].info.name) + 3 > width)
            width = (int)strlen(a->blocks[k].info.name) + 3;
    printf("%-*s  %-11s %-11s %-22s %s\n", width, "parameter", "start", "value",
           "95 % interval", "unit");
    for (size_t k = 0; k < a->n_blocks; k++) {
        const struct block *b = &a->blocks[k];
        char name[512];
        if (block_is_large(b)) {
            printf("%-*s  %zu numbers%s%s\n", width, b->info.name, b->n,
                   paths[k] ? " -> " : "", paths[k] ? paths[k] : "");
            continue;
        }
        for (size_t i = 0; i < b->n; i++) {
            const struct imp_fit_variable all = fit_variable(a->problem, b->first + i),
                                          *v = &all;
            printf("%-*s  %-11.6g %-11.6g ", width,
                   cli_number_row(&b->info, i, name, sizeof name), v->start, v->value);
            char interval[64] = "-";
            if (isfinite(v->lo95) && isfinite(v->hi95))
                snprintf(interval, sizeof interval, "[%.6g, %.6g]%s", v->lo95, v->hi95,
                         v->determined ? "" : " (prior)");
            else if (!a->no_intervals && !v->determined)
                snprintf(interval, sizeof interval, "not determined");
            printf("%-22s %s", interval, b->info.unit);
            printf("%s\n", block_held(b, i)  ? "  held"
                           : v->at_bound < 0 ? "  at its lower bound"
                           : v->at_bound > 0 ? "  at its upper bound"
                                             : "");
        }
    }
    printf("\n%s %.6g +- %.2g after %d iteration%s: %s\n", loss_word(),
           r->objective.value, r->objective.se, r->iterations, plural(r->iterations),
           r->reason ? r->reason : "");
    print_residual(r);
    print_clipped(a->problem);
    if (a->looked) fit_missing_print(a);
}

/* Half the width of the 95 % intervals of a field as a picture of its own, where there are
 * any: NAME.interval.exr; where there are none, that of an earlier fit goes. Volumes have none. */
static int write_intervals(const struct fit_answer *a, const struct block *b)
{
    double *half = cli_alloc(imp_problem_n_variables(a->problem), sizeof *half);
    char name[512], *path = NULL;
    struct block of = *b;
    int known = 0, rc = 0;
    for (size_t i = 0; i < b->n; i++) {
        const struct imp_fit_variable v = fit_variable(a->problem, b->first + i);
        half[b->first + i] = (v.hi95 - v.lo95) / 2;
        known |= isfinite(half[b->first + i]);
    }
    snprintf(name, sizeof name, "%s.interval", b->info.name);
    of.info.name = name;
    if (!(b->info.flags & IMP_PARAM_VOLUME)) {
        rc = block_writable(&of, cli.out, 0);
        if (!rc && known) rc = block_write(&of, half, NULL, cli.out, &path);
        if (!rc && !known) block_remove(&of, cli.out);
    }
    free(path);
    free(half);
    return rc;
}

/* Recovered textures, as pictures. */
static int write_textures(const struct fit_answer *a, char **paths)
{
    int rc = 0;
    double *x = cli_alloc(imp_problem_n_variables(a->problem), sizeof *x);
    imp_problem_get_x(a->problem, x);
    for (size_t k = 0; k < a->n_blocks; k++) {
        const struct block *b = &a->blocks[k];
        for (size_t i = 0; b->tie.log && i < b->n; i++)
            x[b->first + i] = exp(x[b->first + i]);
    }
    for (size_t k = 0; k < a->n_blocks && !rc; k++)
        if (block_is_large(&a->blocks[k]))
            rc = block_write(&a->blocks[k], x, NULL, cli.out, &paths[k]);
    for (size_t k = 0; k < a->n_blocks && !rc; k++)
        if (block_is_large(&a->blocks[k])) rc = write_intervals(a, &a->blocks[k]);
    free(x);
    return rc;
}

/* The scene's values: for tied parameters, each one's own. */
static void write_member(FILE *file, const char *name)
{
    struct block b = {.info.size = sizeof b.info};
    size_t index;
    if (imp_scene_find_param(cli.scene, name, &index) != IMP_OK ||
        imp_scene_get_param(cli.scene, index, &b.info) != IMP_OK)
        return;
    b.n = b.info.count;
    if (block_is_large(&b)) return;
    double *values = cli_alloc(b.n, sizeof *values);
    if (imp_scene_get_values(cli.scene, index, values) == IMP_OK) {
        fprintf(file, "%s=", name);
        for (size_t i = 0; i < b.n; i++)
            fprintf(file, "%s%.17g", i ? "," : "", values[i]);
        fprintf(file, "\n");
    }
    free(values);
}

/* What was recovered as --set @FILE takes it, for the next fit, or a render. */
static int write_set(const struct fit_answer *a)
{
    char *path = join_path(cli.out, "recovered.txt");
    struct output to;
    int rc = output_open(&to, path, OUTPUT_SETTINGS);
    if (!rc) fprintf(to.file, "# importon %s fit\n", imp_version());
    for (size_t k = 0; !rc && k < a->n_blocks; k++) {
        const struct block *b = &a->blocks[k];
        if (block_is_large(b)) continue;
        for (size_t m = 0; m < b->tie.n_members; m++)
            write_member(to.file, b->tie.members[m]);
    }
    rc = output_close(&to, rc);
    free(path);
    return rc;
}

/* The scene of what was recovered, and of `more`, names [n_more]. */
static int write_scene(const struct fit_answer *a)
{
    size_t most = a->n_more, n = 0;
    for (size_t k = 0; k < a->n_blocks; k++) most += a->blocks[k].tie.n_members;
    const char **large = cli_alloc(most, sizeof *large);
    for (size_t k = 0; k < a->n_blocks; k++)
        for (size_t m = 0;
             block_is_large(&a->blocks[k]) && m < a->blocks[k].tie.n_members; m++)
            large[n++] = a->blocks[k].tie.members[m];
    for (size_t k = 0; k < a->n_more; k++) large[n++] = a->more[k];
    const int rc = fit_scene_write(large, n);
    free(large);
    return rc;
}

/* Besides pictures. */
static const struct {
    const char *name;
    enum output_kind kind;
} outputs[] = {{"loss.csv", OUTPUT_TABLE},
               {"loss.svg", OUTPUT_CURVE},
               {"parameters.json", OUTPUT_JSON},
               {"recovered.txt", OUTPUT_SETTINGS}};

int fit_answer_writable(const struct block *blocks, size_t n_blocks)
{
    int rc = make_folder(cli.out);
    for (size_t k = 0; k < sizeof outputs / sizeof *outputs && !rc; k++)
        rc = overwrite_check_in(cli.out, outputs[k].name, outputs[k].kind);
    if (!rc) rc = fit_scene_writable();
    if (!rc) rc = fit_pictures_writable();
    for (size_t k = 0; k < n_blocks && !rc; k++)
        if (block_is_large(&blocks[k])) rc = block_writable(&blocks[k], cli.out, 0);
    return rc;
}

static int write_all(const struct fit_answer *a, char **paths)
{
    int rc = write_textures(a, paths);
    if (!rc) rc = write_history(a->result);
    if (!rc) rc = write_json(a, paths);
    if (!rc) rc = write_set(a);
    if (!rc) rc = write_scene(a);
    if (!rc && a->result->loosest) rc = fit_loosest_write(a->problem, a->result->loosest);
    if (!rc && !a->result->loosest)
        fit_pictures_remove("undetermined"); /* a former fit's */
    return rc;
}

static void paths_free(const struct fit_answer *a, char **paths)
{
    for (size_t k = 0; k < a->n_blocks; k++) free(paths[k]);
    free(paths);
}

int fit_answer_write(const struct fit_answer *a)
{
    char **paths = cli_alloc(a->n_blocks, sizeof *paths);
    const int rc = write_all(a, paths);
    paths_free(a, paths);
    return rc;
}

void fit_answer_print(const struct fit_answer *a)
{
    char **paths = cli_alloc(a->n_blocks, sizeof *paths);
    print_table(a, paths);
    paths_free(a, paths);
}

int fit_answer_give(const struct fit_answer *a)
{
    char **paths = cli_alloc(a->n_blocks, sizeof *paths);
    const int rc = cli.out ? write_all(a, paths) : 0;
    if (cli.json) {
        struct json j = cli_json();
        fit_answer_json(&j, a, paths);
        cli_json_end(&j);
    } else {
        print_table(a, paths);
    }
    if (a->result->walks) cli_say("importon: walks: %s", a->result->walks);
    if (a->result->control_variate) cli_say("importon: %s", a->result->control_variate);
    if (a->result->warning) cli_say("importon: warning: %s", a->result->warning);
    paths_free(a, paths);
    return rc;
}
