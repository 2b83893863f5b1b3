/* SPDX-License-Identifier: Apache-2.0
 *
 * What a fit has found, in JSON. */
#include "fit_answer.h"
#include "shared/blocks.h"
#include "shared/command.h"
#include "shared/places.h"
#include "text/progress.h"

#include <math.h>

struct imp_fit_variable fit_variable(const imp_problem *problem, size_t i)
{
    struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
    (void)!imp_problem_get_fit_variable(problem, i, &v); /* it is there */
    return v;
}

static void put_variable(struct json *j, const imp_problem *problem, size_t i,
                         const struct block *b, const char *name)
{
    const struct imp_fit_variable all = fit_variable(problem, i), *v = &all;
    json_object(j, NULL);
    json_text(j, "name", name);
    json_text(j, "unit", b->info.unit);
    json_number(j, "min", b->info.lo);
    json_number(j, "max", b->info.hi);
    json_number(j, "start", v->start);
    json_number(j, "value", v->value);
    json_number(j, "se", v->se);
    json_number(j, "lo95", v->lo95);
    json_number(j, "hi95", v->hi95);
    json_integer(j, "at_bound", v->at_bound);
    json_bool(j, "determined", v->determined);
    if (block_held(b, i - b->first)) json_bool(j, "held", 1);
    block_ties_json(j, b);
    json_end_object(j);
}

/* The numbers of a field that are least certain, and their place in it. */
enum { LEAST_CERTAIN = 5 };

static void put_least_certain(struct json *j, const struct fit_answer *a,
                              const struct block *b)
{
    size_t found[LEAST_CERTAIN], n = 0;
    for (size_t i = 0; i < b->n; i++) {
        const double se = fit_variable(a->problem, b->first + i).se;
        size_t at = n;
        if (!isfinite(se)) continue;
        while (at > 0 && fit_variable(a->problem, b->first + found[at - 1]).se < se) at--;
        if (at == LEAST_CERTAIN) continue;
        n = n < LEAST_CERTAIN ? n + 1 : n;
        for (size_t k = n - 1; k > at; k--) found[k] = found[k - 1];
        found[at] = i;
    }
    if (!n) return;
    json_array(j, "least_certain");
    for (size_t k = 0; k < n; k++) {
        char name[512];
        put_variable(j, a->problem, b->first + found[k], b,
                     cli_number_name(&b->info, found[k], name, sizeof name));
    }
    json_end_array(j);
}

/* Numbers of textures are in their pictures, not in lists. */
static void put_texture(struct json *j, const struct fit_answer *a, const struct block *b,
                        const char *path)
{
    double lo = INFINITY, hi = -INFINITY, sum = 0;
    int64_t known = 0, bound = 0;
    for (size_t i = 0; i < b->n; i++) {
        const struct imp_fit_variable v = fit_variable(a->problem, b->first + i);
        lo = fmin(lo, v.value);
        hi = fmax(hi, v.value);
        sum += v.value;
        bound += v.at_bound != 0;
        known += isfinite(v.lo95) && isfinite(v.hi95);
    }
    block_json(j, b);
    json_integer(j, "count", (int64_t)b->n);
    json_text(j, "file", path);
    json_number(j, "least", lo);
    json_number(j, "most", hi);
    json_number(j, "mean", sum / (double)b->n);
    json_integer(j, "n_at_bound", bound);
    json_integer(j, "n_intervals", known);
    put_least_certain(j, a, b);
    json_end_object(j);
}

static void put_names(struct json *j, const struct block *blocks, size_t n_blocks)
{
    char name[512];
    json_array(j, "names");
    for (size_t k = 0; k < n_blocks; k++)
        for (size_t i = 0; i < blocks[k].n; i++)
            json_text(j, NULL, cli_number_name(&blocks[k].info, i, name, sizeof name));
    json_end_array(j);
}

/* Values that a fit searches by their logarithm are written as they are. */
static void put_row(struct json *j, const struct block *blocks, size_t n_blocks,
                    const double *x)
{
    json_array(j, NULL);
    for (size_t k = 0; k < n_blocks; k++)
        for (size_t i = 0; i < blocks[k].n; i++) {
            const double v = x[blocks[k].first + i];
            json_number(j, NULL, blocks[k].tie.log ? exp(v) : v);
        }
    json_end_array(j);
}

void fit_history_json(struct json *j, const struct fit_history *h,
                      const struct block *blocks, size_t n_blocks)
{
    json_object(j, "history");
    json_numbers(j, "loss", h->n, h->loss);
    if (h->se) json_numbers(j, "se", h->n, h->se);
    if (h->x) {
        put_names(j, blocks, n_blocks);
        json_array(j, "x");
        for (size_t i = 0; i < h->n; i++)
            put_row(j, blocks, n_blocks, h->x + i * h->n_numbers);
        json_end_array(j);
    }
    json_end_object(j);
}

/* The change that is determined least; relative for a logarithm. */
static void put_loosest(struct json *j, const struct fit_answer *a)
{
    json_object(j, "undetermined");
    put_names(j, a->blocks, a->n_blocks);
    json_array(j, "direction");
    for (size_t k = 0; k < a->n_blocks; k++)
        for (size_t i = 0; i < a->blocks[k].n; i++) {
            const size_t at = a->blocks[k].first + i;
            const double by =
                a->blocks[k].tie.log ? fit_variable(a->problem, at).value : 1;
            json_number(j, NULL, by * a->result->loosest[at]);
        }
    json_end_array(j);
    json_end_object(j);
}

/* What a report draws and a table does not print: the loss and the values by iteration,
 * the combination that is determined least, and the covariance of few values. */
static void put_curves(struct json *j, const struct fit_answer *a)
{
    enum { COVARIANCE_MAX = 64 };
    const struct imp_fit_result *r = a->result;
    const struct fit_history h = {r->n_history, r->n, r->history, r->history_se,
                                  r->history_x};
    fit_history_json(j, &h, a->blocks, a->n_blocks);
    if (r->loosest) put_loosest(j, a);
    if (!r->covariance || r->n > COVARIANCE_MAX) return;
    json_array(j, "covariance");
    for (size_t i = 0; i < r->n; i++)
        json_numbers(j, NULL, r->n, r->covariance + i * r->n);
    json_end_array(j);
}

void fit_answer_json(struct json *j, const struct fit_answer *a, char **paths)
{
    const struct imp_fit_result *r = a->result;
    json_text(j, "optimizer", a->optimizer);
    json_text(j, "loss", loss_word());
    json_seed(j, "seed", cli.seed);
    const struct imp_run run = cli_run();
    json_integer(j, "spp", problem_spp(&run));
    json_integer(j, "spp_taken", r->spp);
    json_integer(j, "iterations", r->iterations);
    json_number(j, "value", r->objective.value);
    json_number(j, "se", r->objective.se);
    json_number(j, "residual", r->residual);
    json_number(j, "residual_hi", r->residual_hi);
    json_number(j, "chi2_per_freedom", r->chi2);
    json_number(j, "chi2_se", r->chi2_se);
    fit_clipped_json(j, a->problem);
    json_number(j, "shift", r->shift);
    json_number(j, "condition", r->condition);
    json_text(j, "reason", r->reason);
    json_text(j, "warning", r->warning);
    json_bool(j, "complete", !progress_interrupted());
    json_array(j, "params");
    for (size_t k = 0; k < a->n_blocks; k++) {
        const struct block *b = &a->blocks[k];
        char name[512];
        if (block_is_large(b)) {
            put_texture(j, a, b, paths ? paths[k] : NULL);
            continue;
        }
        for (size_t i = 0; i < b->n; i++)
            put_variable(j, a->problem, b->first + i, b,
                         cli_number_name(&b->info, i, name, sizeof name));
    }
    json_end_array(j);
    const struct places_way way = {r->history_x ? r->n_history : 0, r->n, r->history_x};
    places_json(j, a->blocks, a->n_blocks, &way);
    put_curves(j, a);
    if (a->looked) fit_missing_json(j, a);
}
