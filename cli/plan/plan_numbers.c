/* SPDX-License-Identifier: Apache-2.0
 *
 * --of and --prior: names of active numbers, patterns too. */
#include "plan_numbers.h"
#include "shared/blocks.h"

#include <fnmatch.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static struct arg_list of, prior;

const struct arg_option options_numbers[] = {
    {ARG_LIST | ARG_REPLAYS, 0, "of", "NAME",
     "the wanted numbers: a parameter, one of its numbers NAME[K], or a pattern "
     "(default: "
     "all active ones)",
     &of, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "prior", "NAME=SIGMA",
     "known without pictures: one standard deviation of these numbers", &prior, 0, 0,
     NULL},
    {0}};

const struct block *plan_number_block(const struct plan_numbers *p, size_t i)
{
    size_t b = 0;
    while (b + 1 < p->n_blocks && p->blocks[b + 1].first <= i) b++;
    return &p->blocks[b];
}

const char *plan_number_name(const struct plan_numbers *p, size_t i, char *text,
                             size_t size)
{
    const struct block *b = plan_number_block(p, i);
    return cli_number_row(&b->info, i - b->first, text, size);
}

/* Is the number meant? By its parameter's name, with or without a last ".value", or with
 * its index behind it. */
static bool is_meant(const struct plan_numbers *p, size_t i, const char *glob)
{
    const struct block *b = plan_number_block(p, i);
    const char *name = b->info.name;
    char number[600];
    const size_t n = strlen(name), value = strlen(".value");
    if (!strcmp(glob, name) || fnmatch(glob, name, 0) == 0) return true;
    cli_number_name(&b->info, i - b->first, number, sizeof number);
    if (!strcmp(glob, number)) return true;
    if (n <= value || strcmp(name + n - value, ".value") != 0) return false;
    snprintf(number, sizeof number, "%.*s", (int)(n - value), name);
    return !strcmp(glob, number);
}

static int not_active(const char *option, const char *name, const struct plan_numbers *p)
{
    size_t index;
    char first[600];
    if (!strpbrk(name, "*?[") && imp_scene_find_param(cli.scene, name, &index) != IMP_OK)
        return cli_fail(IMP_E_ARG, cli.scene_path);
    return cli_error(
        EXIT_USAGE,
        "--%s %s: none of the %zu active numbers has this name (the first is "
        "%s)",
        option, name, p->n, plan_number_name(p, 0, first, sizeof first));
}

static int of_read(struct plan_numbers *p)
{
    bool *meant = cli_alloc(p->n + 1, sizeof *meant);
    int rc = 0;
    for (size_t k = 0; k < of.n && !rc; k++) {
        size_t met = 0;
        for (size_t i = 0; i < p->n; i++)
            if (is_meant(p, i, of.item[k])) met++, meant[i] = true;
        if (!met) rc = not_active("of", of.item[k], p);
    }
    for (size_t i = 0; i < p->n && !rc; i++)
        if (meant[i]) p->of[p->n_of++] = i;
    free(meant);
    return rc;
}

static int prior_read(struct plan_numbers *p)
{
    for (size_t k = 0; k < prior.n; k++) {
        const char *text = prior.item[k], *equal = strrchr(text, '=');
        char name[600], *end = NULL;
        const double sigma = equal ? strtod(equal + 1, &end) : NAN;
        size_t met = 0;
        if (!equal || end == equal + 1 || *end || !(sigma > 0) || !isfinite(sigma))
            return cli_error(
                EXIT_USAGE,
                "--prior %s: expected NAME=SIGMA, a standard deviation above "
                "0",
                text);
        snprintf(name, sizeof name, "%.*s", (int)(equal - text), text);
        for (size_t i = 0; i < p->n; i++) {
            const struct block *b = plan_number_block(p, i);
            double x[1];
            if (!is_meant(p, i, name)) continue;
            met++;
            p->prior[i] = sigma;
            if (!b->tie.log) continue;
            /* x is the logarithm: sigma of the number over the number. */
            size_t param;
            if (imp_scene_find_param(cli.scene, b->info.name, &param) != IMP_OK) continue;
            double *values = cli_alloc(b->info.count, sizeof *values);
            if (imp_scene_get_values(cli.scene, param, values) == IMP_OK) {
                x[0] = values[i - b->first];
                p->prior[i] = sigma / x[0];
            }
            free(values);
        }
        if (!met) return not_active("prior", name, p);
    }
    return 0;
}

int plan_numbers_make(const imp_problem *problem, struct plan_numbers *out)
{
    *out = (struct plan_numbers){.problem = problem};
    out->n = imp_problem_n_variables(problem);
    out->blocks = problem_blocks(problem, &out->n_blocks);
    out->of = cli_alloc(out->n + 1, sizeof *out->of);
    out->prior = cli_alloc(out->n + 1, sizeof *out->prior);
    const int rc = of_read(out);
    return rc ? rc : prior_read(out);
}

void plan_numbers_free(struct plan_numbers *p)
{
    free(p->blocks);
    free(p->of);
    free(p->prior);
    args_list_free(&of);
    args_list_free(&prior);
}
