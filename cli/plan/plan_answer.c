/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer of a plan as tables and as JSON. */
#include "plan_answer.h"
#include "shared/blocks.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define Z95        1.959963984540054
#define NEXT_MAX   3   /* candidates whose half-widths are printed */
#define LOOSE_PART 0.1 /* of a unit vector: below, a number is not named */

static const struct imp_plan_row *row(const struct plan_answer *a, size_t k)
{
    return IMP_ROW(imp_plan_row, a->result->rows, k);
}
static const char *name(const struct plan_answer *a, size_t candidate)
{
    return a->candidates->c[candidate].name;
}
static double cost(const struct plan_answer *a, size_t candidate)
{
    const double c = a->candidates->c[candidate].cost;
    return c > 0 ? c : 1;
}
static bool has_costs(const struct plan_answer *a)
{
    for (size_t k = 0; k < a->candidates->n; k++)
        if (cost(a, k) != 1) return true;
    return false;
}

/* ---- Ranking ----------------------------------------------------------------------------- */

static void print_ranking(const struct plan_answer *a)
{
    const bool costs = has_costs(a);
    int width = 9;
    for (size_t k = 0; k < a->result->n_rows; k++) {
        const int n = (int)strlen(name(a, row(a, k)->candidate));
        width = n > width ? n : width;
    }
    printf("rank  %-*s  %-11s %-9s %s%s\n", width, "candidate", "gain", "se", "intervals",
           costs ? "  cost      gain/cost" : "");
    for (size_t k = 0; k < a->result->n_rows; k++) {
        const struct imp_plan_row *r = row(a, k);
        const bool first = k == 0 || row(a, k - 1)->group != r->group;
        char rank[24] = "=";
        if (first) snprintf(rank, sizeof rank, "%zu", k + 1);
        printf("%-4s  %-*s  %-11.4g %-9.2g x %-*.3g", rank, width, name(a, r->candidate),
               r->gain.value, r->gain.se, costs ? 7 : 0, exp(-0.5 * r->gain.value));
        if (costs) printf("  %-9.4g %.4g", cost(a, r->candidate), r->worth.value);
        printf("%s\n", r->lit == 0 ? "  all black or saturated" : "");
    }
}

/* The first group, where it has several. */
static void print_group(const struct plan_answer *a)
{
    size_t n = 1;
    while (n < a->result->n_rows && row(a, n)->group == 0) n++;
    if (n == 1) return;
    printf("\nThe best %zu cannot be told apart", n);
    if (n <= 8) {
        printf(": ");
        for (size_t k = 0; k < n; k++)
            printf("%s%s",
                   k == 0       ? ""
                   : k + 1 == n ? " or "
                                : ", ",
                   name(a, row(a, k)->candidate));
    }
    printf(row(a, 0)->gain.se > 0 ? ". More --spp may tell.\n" : ".\n");
}

/* ---- Numbers ----------------------------------------------------------------------------- */

static const char *half(double se, char text[16])
{
    if (!isfinite(se)) snprintf(text, 16, "-");
    else snprintf(text, 16, "%.3g", Z95 * se);
    return text;
}

/* Has a number no interval yet, or with one of the next candidates? */
static bool some_open(const struct plan_answer *a, size_t next)
{
    const struct imp_plan_result *r = a->result;
    bool open = false;
    for (size_t i = 0; i < a->numbers->n; i++) {
        open |= !isfinite(r->today[i]);
        for (size_t k = 0; k < next; k++) open |= !isfinite(row(a, k)->se[i]);
        if (r->n_chosen > 1) open |= !isfinite(r->chosen_se[i]);
    }
    return open;
}

static void print_numbers(const struct plan_answer *a)
{
    const struct plan_numbers *p = a->numbers;
    const struct imp_plan_result *r = a->result;
    const size_t next = r->n_rows < NEXT_MAX ? r->n_rows : NEXT_MAX;
    int width = 9;
    char text[600], number[16];
    for (size_t i = 0; i < p->n; i++) {
        const int n = (int)strlen(plan_number_name(p, i, text, sizeof text));
        width = n > width ? n : width;
    }
    printf("\nhalf-widths of 95 %% intervals%s\n",
           some_open(a, next) ? " ('-': not determined)" : "");
    printf("%-*s  %-10s", width, "parameter", "today");
    for (size_t k = 0; k < next; k++) {
        snprintf(text, sizeof text, "with #%zu", k + 1);
        printf(" %-*s", k + 1 < next || r->n_chosen > 1 ? 10 : 0, text);
    }
    printf("%s\n", r->n_chosen > 1 ? " with the chosen" : "");
    for (size_t i = 0; i < p->n; i++) {
        const struct block *b = plan_number_block(p, i);
        if (block_held(b, i - b->first)) {
            printf("%-*s  held\n", width, plan_number_name(p, i, text, sizeof text));
            continue;
        }
        printf("%-*s  %-10s", width, plan_number_name(p, i, text, sizeof text),
               half(r->today[i], number));
        for (size_t k = 0; k < next; k++)
            printf(" %-*s", k + 1 < next || r->n_chosen > 1 ? 10 : 0,
                   half(row(a, k)->se[i], number));
        if (r->n_chosen > 1) printf(" %s", half(r->chosen_se[i], number));
        printf("\n");
    }
}

/* ---- The set, and what stays open ---------------------------------------------------------- */

static double total_cost(const struct plan_answer *a)
{
    double sum = 0;
    for (size_t k = 0; k < a->result->n_chosen; k++) sum += cost(a, a->result->chosen[k]);
    return sum;
}

static void print_chosen(const struct plan_answer *a)
{
    const struct imp_plan_result *r = a->result;
    if (r->n_chosen == 0) {
        printf("\nno candidate fits into the budget of %g\n", a->options->budget);
        return;
    }
    if (a->options->take < 2 && a->options->budget == 0) return;
    printf("\nchosen together: ");
    for (size_t k = 0; k < r->n_chosen; k++)
        printf("%s%s", k ? "; " : "", name(a, r->chosen[k]));
    printf("\ngain %.4g +- %.2g, intervals x %.3g", r->chosen_gain.value,
           r->chosen_gain.se, exp(-0.5 * r->chosen_gain.value));
    if (has_costs(a)) printf(", cost %g", total_cost(a));
    printf("\n");
}

static void print_loose(const struct plan_answer *a)
{
    const struct imp_plan_result *r = a->result;
    char text[600];
    if (r->n_loose == 0) return;
    printf("\nnot determined by all candidates together (combinations, in parts "
           "of ranges or sizes):\n");
    for (size_t j = 0; j < r->n_loose; j++) {
        bool any = false;
        for (size_t i = 0; i < r->n; i++) {
            const double v = r->loose[j * r->n + i];
            if (fabs(v) < LOOSE_PART) continue;
            printf("%s%.2g %s", any ? " " : "  ", v,
                   plan_number_name(a->numbers, i, text, sizeof text));
            any = true;
        }
        printf("\n");
    }
}

void plan_answer_print(const struct plan_answer *a)
{
    print_ranking(a);
    print_group(a);
    if (a->improved)
        printf("\n%s is better at %.4g,%.4g,%.4g: gain %.4g +- %.2g, intervals x %.3g\n",
               name(a, row(a, 0)->candidate), a->origin[0], a->origin[1], a->origin[2],
               a->gain.value, a->gain.se, exp(-0.5 * a->gain.value));
    print_numbers(a);
    print_chosen(a);
    print_loose(a);
}

/* ---- JSON -------------------------------------------------------------------------------- */

static void half_json(struct json *j, const char *key, size_t n, const double *se)
{
    double *h = cli_alloc(n + 1, sizeof *h);
    for (size_t i = 0; i < n; i++) h[i] = Z95 * se[i];
    json_numbers(j, key, n, h);
    free(h);
}

static void candidate_json(struct json *j, const struct plan_answer *a, size_t k)
{
    const struct imp_plan_candidate *c = &a->candidates->c[k];
    json_integer(j, "candidate", (int64_t)k);
    json_text(j, "name", c->name);
    json_integer(j, "sensor", c->sensor);
    if (c->placed) {
        json_numbers(j, "origin", 3, c->origin);
        json_numbers(j, "target", 3, c->target);
        json_numbers(j, "up", 3, c->up);
    }
    if (c->lamps) json_text(j, "lamps", c->lamps);
    json_number(j, "time", c->time > 0 ? c->time : 1);
    json_number(j, "cost", cost(a, k));
}

static void rows_json(struct json *j, const struct plan_answer *a)
{
    json_array(j, "ranking");
    for (size_t k = 0; k < a->result->n_rows; k++) {
        const struct imp_plan_row *r = row(a, k);
        json_object(j, NULL);
        json_integer(j, "rank", (int64_t)k + 1);
        json_integer(j, "group", (int64_t)r->group);
        candidate_json(j, a, r->candidate);
        json_number(j, "gain", r->gain.value);
        json_number(j, "gain_se", r->gain.se);
        json_number(j, "gain_per_cost", r->worth.value);
        json_number(j, "gain_per_cost_se", r->worth.se);
        json_number(j, "intervals", exp(-0.5 * r->gain.value));
        json_number(j, "lit", r->lit);
        half_json(j, "half95", a->result->n, r->se);
        json_end_object(j);
    }
    json_end_array(j);
}

static void chosen_json(struct json *j, const struct plan_answer *a)
{
    const struct imp_plan_result *r = a->result;
    json_object(j, "chosen");
    json_array(j, "candidates");
    for (size_t k = 0; k < r->n_chosen; k++) json_integer(j, NULL, (int64_t)r->chosen[k]);
    json_end_array(j);
    json_array(j, "names");
    for (size_t k = 0; k < r->n_chosen; k++) json_text(j, NULL, name(a, r->chosen[k]));
    json_end_array(j);
    json_number(j, "gain", r->chosen_gain.value);
    json_number(j, "gain_se", r->chosen_gain.se);
    json_number(j, "intervals", exp(-0.5 * r->chosen_gain.value));
    json_number(j, "cost", total_cost(a));
    half_json(j, "half95", r->n, r->chosen_se);
    json_end_object(j);
}

void plan_answer_json(const struct plan_answer *a)
{
    const struct imp_plan_result *r = a->result;
    struct json j = cli_json();
    char text[600];
    json_seed(&j, "seed", a->run->seed);
    json_integer(&j, "spp", cli_spp(a->run));
    json_text(&j, "criterion", a->options->criterion == IMP_PLAN_A ? "A" : "D");
    json_array(&j, "parameters");
    for (size_t i = 0; i < r->n; i++) {
        json_object(&j, NULL);
        json_text(&j, "name", plan_number_name(a->numbers, i, text, sizeof text));
        json_text(&j, "unit", plan_number_block(a->numbers, i)->info.unit);
        json_number(&j, "prior", r->prior[i]);
        json_end_object(&j);
    }
    json_end_array(&j);
    half_json(&j, "half95_today", r->n, r->today);
    json_array(&j, "have");
    for (size_t k = 0; k < a->candidates->n_have; k++) json_text(&j, NULL, name(a, k));
    json_end_array(&j);
    rows_json(&j, a);
    chosen_json(&j, a);
    if (a->improved) {
        json_object(&j, "improved");
        json_numbers(&j, "origin", 3, a->origin);
        json_number(&j, "gain", a->gain.value);
        json_number(&j, "gain_se", a->gain.se);
        json_end_object(&j);
    }
    json_array(&j, "not_determined");
    for (size_t k = 0; k < r->n_loose; k++) {
        json_array(&j, NULL);
        for (size_t i = 0; i < r->n; i++) json_number(&j, NULL, r->loose[k * r->n + i]);
        json_end_array(&j);
    }
    json_end_array(&j);
    cli_json_end(&j);
}
