/* SPDX-License-Identifier: Apache-2.0
 *
 * A set of pictures: one after the other by what each adds (Wynn 1970), then exchanges of one that is
 * chosen for one that is not, as long as they improve the set (Fedorov 1972). With costs, what is
 * improved is the gain over the cost of the set, or within a budget the gain. */
#include "planning.h"
#include <math.h>
#include <string.h>

#define ROUNDS_MAX 50 /* of exchanges; each improves the set */

struct search {
    const struct imp__plan_choice *c;
    const struct imp__plan_data **set; /* [n_have + n], those that we have first */
    size_t *chosen, n_chosen;
    bool *in; /* [n] */
    double today;
    struct imp__plan_known *known;
};

/* What is to be improved, with these chosen ones; -INFINITY: they cost too much. */
static enum imp_status score(struct search *s, double *out)
{
    const struct imp__plan_choice *c = s->c;
    double cost = 0;
    for (size_t i = 0; i < s->n_chosen; i++) {
        s->set[c->n_have + i] = c->items[s->chosen[i]];
        cost += c->cost[s->chosen[i]];
    }
    *out = -INFINITY;
    if (c->budget > 0 && cost > c->budget * (1 + 1e-12)) return IMP_OK;
    const enum imp_status st =
        imp__plan_evaluate(c->model, s->set, c->n_have + s->n_chosen, s->known);
    if (st == IMP_OK) *out = (s->known->phi - s->today) / (c->budget > 0 ? 1 : cost);
    return st;
}

/* Adds the one that is worth most; *added false: none fits in. */
static enum imp_status add_one(struct search *s, double before, bool *added)
{
    const struct imp__plan_choice *c = s->c;
    double best = -INFINITY;
    size_t at = 0;
    const size_t k = s->n_chosen++;
    for (size_t i = 0; i < c->n; i++) {
        double value;
        if (s->in[i]) continue;
        s->chosen[k] = i;
        const enum imp_status st = score(s, &value);
        if (st != IMP_OK) return st;
        if (c->budget > 0) value = (value - before) / c->cost[i];
        if (value > best) best = value, at = i;
    }
    *added = best > -INFINITY;
    if (*added) {
        s->chosen[k] = at;
        s->in[at] = true;
    } else s->n_chosen--;
    return IMP_OK;
}

/* The best exchange, if it improves the set. */
static enum imp_status exchange(struct search *s, double *now, bool *improved)
{
    const struct imp__plan_choice *c = s->c;
    double best = *now + 1e-9 * fabs(*now);
    size_t out = 0, in = 0;
    *improved = false;
    for (size_t k = 0; k < s->n_chosen; k++) {
        const size_t was = s->chosen[k];
        for (size_t i = 0; i < c->n; i++) {
            double value;
            if (s->in[i]) continue;
            s->chosen[k] = i;
            const enum imp_status st = score(s, &value);
            if (st != IMP_OK) return st;
            if (value > best) best = value, out = k, in = i, *improved = true;
        }
        s->chosen[k] = was;
    }
    if (!*improved) return IMP_OK;
    s->in[s->chosen[out]] = false;
    s->in[in] = true;
    s->chosen[out] = in;
    *now = best;
    return IMP_OK;
}

/* The gain's error: changes of what we have move today's, too. */
static void error_of(const struct search *s, const double *pull_today,
                     double hidden_today, struct imp_estimate *gain)
{
    const struct imp__plan_choice *c = s->c;
    const size_t n = c->model->n;
    double square = s->known->hidden * s->known->hidden + hidden_today * hidden_today;
    for (size_t i = 0; i < c->n_have + s->n_chosen; i++) {
        double after[IMP_DEVIATIONS], before[IMP_DEVIATIONS] = {0};
        imp__plan_deviations(n, s->known->pull, s->set[i], after);
        if (i < c->n_have) imp__plan_deviations(n, pull_today, s->set[i], before);
        for (int g = 0; g < IMP_DEVIATIONS; g++) square += pow(after[g] - before[g], 2);
    }
    gain->se = sqrt(square);
}

enum imp_status imp__plan_choose(const struct imp__plan_choice *c, size_t *chosen,
                                 size_t *n_chosen, struct imp__plan_known *known,
                                 struct imp_estimate *gain)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = c->model->ctx;
    const size_t n = c->model->n;
    struct search s = {.c = c, .chosen = chosen, .known = known};
    double *today = imp__alloc(ctx, n * n, sizeof *today), now, hidden;
    bool more = true;
    s.set = imp__alloc(ctx, c->n_have + c->n + 1, sizeof *s.set);
    s.in = imp__alloc(ctx, c->n + 1, sizeof *s.in);
    if (!s.set || !s.in || !today)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a plan"));
    for (size_t i = 0; i < c->n_have; i++) s.set[i] = c->have[i];
    IMP_TRY(imp__plan_evaluate(c->model, s.set, c->n_have, known));
    s.today = known->phi;
    hidden = known->hidden;
    memcpy(today, known->pull, n * n * sizeof *today);
    now = 0;
    while (more && s.n_chosen < c->take) {
        IMP_TRY(add_one(&s, now, &more));
        if (more) IMP_TRY(score(&s, &now));
    }
    for (int round = 0; s.n_chosen > 0 && round < ROUNDS_MAX; round++) {
        bool improved;
        IMP_TRY(exchange(&s, &now, &improved));
        if (!improved) break;
    }
    if (s.n_chosen > 0) IMP_TRY(score(&s, &now));
    else IMP_TRY(imp__plan_evaluate(c->model, s.set, c->n_have, known));
    *gain =
        (struct imp_estimate){.value = known->phi - s.today, .se = 0, .bias_order = 1};
    error_of(&s, today, hidden, gain);
    *n_chosen = s.n_chosen;
out:
    imp__release(ctx, s.set);
    imp__release(ctx, s.in);
    imp__release(ctx, today);
    return st;
}
