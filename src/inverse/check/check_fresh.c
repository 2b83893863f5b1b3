/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients against differences of pictures that share no random number with them: what a
 * frozen walk cannot see (wrong densities, missing terms) shows here as z.
 *
 * How far the formula of lower order is from the difference bounds the error of the
 * latter (check_difference.c). A row's limit of |z| is Z_LIMIT plus that bound in
 * standard errors; where the bound is large (a kink within the step) nothing is decided.
 *
 * Rows whose standard error is too large to decide anything are repeated with more
 * samples, up to 16 times as many in all, which are added to those before. */
#include "check_difference.h"
#include "inverse/estimate/moved_gradient.h"
#include "scene/pose.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* 6e-5 by chance for normal numbers, 1e-3 with the 15 degrees of freedom of a difference.
 */
#define Z_LIMIT 4
/* With an SE above this part of the value, Z_LIMIT SE is 0.8 of it: such a row would pass
 * a gradient with a term missing, so it decides nothing. */
#define RESOLVED 0.2
/* A row that fails by its z is undecided if D(h) and D(h/2) differ by more than RESOLVED
 * of the value: at a kink no order of the formula holds. (4 D(h/2) - D(h))/3 differs from
 * D(h/2) by 1/3 of that difference, and (8 D(h/2) - D(h))/7 by 1/7, so KINK times the
 * correction is at least the difference. */
#define KINK 7
/* Samples of the three rounds: 1, 4 and 16 times the given number, in all. */
#define ROUNDS 3
static const int round_more[ROUNDS] = {1, 3, 12};

struct rows {
    struct imp__fresh fresh;
    double *gradient, *gradient_se; /* [n] of all samples so far */
    struct comparison *comparisons;
    size_t n, cap;
};

/* A row while rounds are added: its value or direction, and the samples so far. */
struct comparison {
    size_t param, row;
    int64_t element; /* -1: the parameter's only value, or a direction through all */
    bool noisy;
    struct imp_estimate mine; /* of a direction: the tangent; else r->gradient */
    struct imp__quotient fd;
    int batch; /* samples per pixel of each batch behind fd */
};

/* Mean of what `before` and `more` samples gave. */
static double pooled(int before, double a, int more, double b)
{
    return (before * a + more * b) / (before + more);
}
static struct imp_estimate pool(int before, struct imp_estimate a, int more,
                                struct imp_estimate b)
{
    return (struct imp_estimate){.value = pooled(before, a.value, more, b.value),
                                 .se =
                                     hypot(before * a.se, more * b.se) / (before + more)};
}

static void judge(struct comparison *m, struct imp_check_row *row)
{
    const struct imp_estimate mine = m->mine, fd = m->fd.mean;
    const double truncation = fabs(m->fd.coarse - fd.value);
    const double size = fmax(fabs(mine.value), fabs(fd.value));
    const double off = fabs(mine.value - fd.value);
    const double allowed = 1e-6 * size + m->fd.rounding + truncation;
    row->value = mine.value;
    row->reference = fd.value;
    row->se = hypot(mine.se, fd.se);
    if (row->se > 0) { /* z, and what the difference alone may add to it */
        row->error = isfinite(off) ? off / row->se : INFINITY;
        row->limit = Z_LIMIT + allowed / row->se;
    } else { /* without noise (a furnace) */
        row->error = off == 0 ? 0 : isfinite(off) ? off / size : INFINITY;
        row->limit = size > 0 ? allowed / size : 1e-6;
    }
    row->ok = !(row->error <= row->limit) ? 0 : 1;
    m->noisy = row->ok && row->se > RESOLVED * size && size > allowed;
    if (m->noisy || (!row->ok && KINK * truncation > RESOLVED * size)) row->ok = -1;
}

/* One more round of samples for a row, at the parameter's present values `old`. */
static enum imp_status compare(struct rows *r, struct comparison *c,
                               const struct imp__motion *m, bool linear, int before,
                               struct imp_estimate mine)
{
    enum imp_status st = IMP_OK;
    struct imp_check_row row = {0};
    struct imp__quotient q;
    IMP_TRY(imp__fresh_difference(&r->fresh, m, linear, &row.step, &q));
    c->mine = mine;
    const int more = imp__fresh_batch(&r->fresh);
    q.mean = pool(c->batch, c->fd.mean, more, q.mean);
    q.coarse = pooled(c->batch, c->fd.coarse, more, q.coarse);
    c->batch += more;
    c->fd = q;
    judge(c, &row);
    if (before) {
        struct imp_check_row *out = &r->fresh.check->rows[c->row];
        row.size = out->size;
        row.method = out->method;
        row.param = out->param;
        *out = row;
        return IMP_OK;
    }
    c->row = r->fresh.check->n_rows;
    st = imp__check_row(r->fresh.check, "fresh", m->param->info.name, c->element, &row);
out:
    return st;
}

/* Does F depend on this parameter through emission alone? */
static bool is_emission(const struct imp_scene *s, size_t param)
{
    bool emission = false, other = false;
    for (int i = 0; i < s->n_emitters; i++)
        for (int j = 0; j < s->emitters[i]->n_in; j++)
            if (s->emitters[i]->input[j]->param == (int)param &&
                !s->emitters[i]->input[j]->texture) {
                if (s->emitters[i]->ops->inputs[j].role == IMP_EMISSION) emission = true;
                else other = true;
            }
    for (int i = 0; i < s->n_bsdfs; i++)
        for (int j = 0; j < s->bsdfs[i]->n_own; j++)
            if (s->bsdfs[i]->input[j]->param == (int)param &&
                !s->bsdfs[i]->input[j]->texture) {
                if (s->bsdfs[i]->ops->inputs[j].role == IMP_EMISSION) emission = true;
                else other = true;
            }
    return emission && !other;
}

/* Has every number a row? */
static bool is_singly(const struct imp_problem *p, size_t param)
{
    return p->scene->params[param].info.count <= IMP_CHECK_SINGLY ||
           imp__pose_of(p->scene, param);
}

extern const struct imp_emitter_ops imp__spot_light;

/* Between the beam of a spot and its cutoff, where light falls off, differences are smooth; a step
 * across it has a kink. 0: the parameter is no angle of a spot. */
static double spot_scale(const struct imp_problem *p, size_t param)
{
    for (int k = 0; k < p->scene->n_emitters; k++) {
        const struct imp_emitter *e = p->scene->emitters[k];
        const struct imp_texcoord nowhere = {.shape = NULL};
        double cutoff = 0, beam = 0;
        bool own = false;
        for (int j = 0; e->ops == &imp__spot_light && j < e->n_in; j++) {
            const char *name = e->ops->inputs[j].name;
            imp_spec value;
            if (strcmp(name, "cutoff_angle") != 0 && strcmp(name, "beam_width") != 0)
                continue;
            imp__inputs_eval(&e->input[j], 1, &nowhere, &value);
            if (name[0] == 'c') cutoff = value[0];
            else beam = value[0];
            own |= e->input[j]->param == (int)param;
        }
        if (own)
            return fmin(imp__check_scale(&p->scene->params[param], 0),
                        fmax(cutoff - beam, 0.01));
    }
    return 0;
}

/* A large change of a number of a pose, or a spot's angle; 0: it is none. */
static double own_scale(const struct imp_problem *p, const struct comparison *c)
{
    const struct imp_pose *pose = imp__pose_of(p->scene, c->param);
    return pose ? 0.2 * imp__pose_large(pose, c->element) : spot_scale(p, c->param);
}

/* The last error as a reason, without what all of them begin with. */
static enum imp_status reason_keep(struct imp_problem *p, int side, const char **why)
{
    static const char prefix[] = "derivatives by what moves: ";
    const char *text = imp_last_error(p->ctx);
    char line[600];
    if (strncmp(text, prefix, sizeof prefix - 1) == 0) text += sizeof prefix - 1;
    snprintf(line, sizeof line, "a step %s it: %s", side < 0 ? "below" : "above", text);
    *why = imp__arena_strdup(&p->check_arena, line);
    return *why ? IMP_OK : imp__error(p->ctx, IMP_E_NOMEM, "no memory for a check");
}

/* Is there room for a pose on both sides? What touches another object has a derivative on one. *why:
 * what stands in the way, in the check's arena; NULL: nothing. */
static enum imp_status has_room(struct rows *r, const struct imp__motion *m, size_t e,
                                const char **why)
{
    enum imp_status st = IMP_OK;
    struct imp_problem *p = r->fresh.check->problem;
    struct imp_param param = *m->param;
    *why = NULL;
    for (int side = -1; side <= 1 && !*why && m->scale > 0; side += 2) {
        imp__param_set(&param, e, m->old[e] + side * IMP_FRESH_STEP * m->scale);
        imp__theta_announce(p->scene);
        st = imp__poses_settle(p->scene); /* a place that the object cannot have */
        if (st == IMP_OK && imp__problem_moves(p))
            st = imp__moved_possible(p, &r->fresh.check->run);
        if (st != IMP_E_UNSUPPORTED && st != IMP_E_NUMERIC) IMP_TRY(st);
        else IMP_TRY(reason_keep(p, side, why));
    }
    st = IMP_OK;
out:
    imp__param_set(&param, e, m->old[e]);
    imp__theta_announce(p->scene);
    const enum imp_status back = imp__poses_settle(p->scene);
    return st == IMP_OK ? back : st;
}

/* `before`: samples that the row has had, in multiples of the given number. */
static enum imp_status comparison_round(struct rows *r, struct comparison *c, int before)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = r->fresh.check->problem;
    const struct imp_param *q = &p->scene->params[c->param];
    const size_t count = q->info.count, base = (size_t)p->active.base[c->param];
    const bool linear = is_emission(p->scene, c->param) &&
                        p->scene->params[c->param].degree == IMP_DEGREE_LINEAR;
    double *buffer = imp__alloc(r->fresh.check->ctx, 2 * count + p->n, sizeof *buffer);
    if (!buffer)
        return imp__error(r->fresh.check->ctx, IMP_E_NOMEM, "no memory for a check");
    double *old = buffer, *weight = buffer + count, *x_dot = buffer + 2 * count;
    struct imp_estimate mine;
    for (size_t e = 0; e < count; e++) old[e] = imp__param_get(q, e);
    const struct imp__motion m = {q, old, weight, own_scale(p, c)};
    if (is_singly(p, c->param)) {
        const size_t e = c->element < 0 ? 0 : (size_t)c->element;
        const char *why = NULL;
        weight[e] = 1;
        mine = (struct imp_estimate){.value = r->gradient[base + e],
                                     .se = r->gradient_se[base + e]};
        if (imp__pose_of(p->scene, c->param)) IMP_TRY(has_room(r, &m, e, &why));
        if (why) { /* nothing is decided */
            const struct imp_check_row row = {.step = IMP_FRESH_STEP * m.scale,
                                              .value = mine.value,
                                              .reference = NAN,
                                              .se = mine.se,
                                              .error = NAN,
                                              .limit = Z_LIMIT,
                                              .ok = -1,
                                              .why = why};
            c->mine = mine;
            c->noisy = false;
            st = imp__check_row(r->fresh.check, "fresh", q->info.name, c->element, &row);
            goto out;
        }
    } else { /* one direction through all of them */
        imp__check_direction(q, weight);
        memcpy(x_dot + base, weight, count * sizeof *weight);
        IMP_TRY(imp__fresh_slope(&r->fresh, x_dot, &mine));
        if (before) mine = pool(before, c->mine, r->fresh.more, mine);
    }
    IMP_TRY(compare(r, c, &m, linear, before, mine));
out:
    imp__release(r->fresh.check->ctx, buffer);
    return st;
}

static enum imp_status comparisons_list(struct rows *r)
{
    const struct imp_problem *p = r->fresh.check->problem;
    for (size_t k = 0; k < p->scene->n_params; k++) {
        if (p->active.base[k] < 0) continue;
        const size_t n = is_singly(p, k) ? p->scene->params[k].info.count : 1;
        for (size_t e = 0; e < n; e++) {
            struct comparison *grown = imp__grow(r->fresh.check->ctx, r->comparisons,
                                                 &r->cap, r->n + 1, sizeof *grown);
            if (!grown)
                return imp__error(r->fresh.check->ctx, IMP_E_NOMEM,
                                  "no memory for a check");
            r->comparisons = grown;
            r->comparisons[r->n++] =
                (struct comparison){.param = k, .element = n > 1 ? (int64_t)e : -1};
        }
    }
    return IMP_OK;
}

/* The gradient by the samples of this round, added to those before. */
static enum imp_status gradient_round(struct rows *r, int before)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = r->fresh.check;
    const size_t n = c->problem->n;
    struct imp_run run = c->run;
    double *g = imp__alloc(c->ctx, 2 * n, sizeof *g);
    if (!g) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    run.seed = imp__fresh_seed(&r->fresh);
    run.spp = (int)fmin(
        (double)(run.spp > 0 ? run.spp : c->tracer.sensor->spp) * r->fresh.more, 1 << 26);
    IMP_TRY(imp_problem_reverse(c->problem, r->fresh.pattern, &run, g, g + n));
    for (size_t k = 0; k < n; k++) {
        const struct imp_estimate sum =
            pool(before,
                 (struct imp_estimate){.value = r->gradient[k], .se = r->gradient_se[k]},
                 r->fresh.more, (struct imp_estimate){.value = g[k], .se = g[n + k]});
        r->gradient[k] = sum.value;
        r->gradient_se[k] = sum.se;
    }
    st = imp__check_progress(c, r->fresh.more);
out:
    imp__release(c->ctx, g);
    return st;
}

/* What ends compare (check_ends.c). */
static enum imp_status slopes_keep(const struct rows *r)
{
    struct imp__check *c = r->fresh.check;
    if (c->slopes) return IMP_OK; /* those of poses are not compared */
    c->slopes = imp__alloc(c->ctx, r->n + 1, sizeof *c->slopes);
    if (!c->slopes) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    for (size_t k = 0; k < r->n; k++)
        c->slopes[c->n_slopes++] = (struct imp__slope){
            r->comparisons[k].param, r->comparisons[k].element, r->comparisons[k].mine};
    return IMP_OK;
}

/* Work of a round in pictures: a difference takes 2 to 6, counted as 4. */
static double round_work(const struct rows *r)
{
    double work = 1;
    for (size_t k = 0; k < r->n; k++) work += 4 * r->comparisons[k].noisy;
    return work * r->fresh.more;
}

enum imp_status imp__check_fresh(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = c->problem;
    struct rows r = {0};

    IMP_TRY(imp__fresh_begin(&r.fresh, c));
    r.gradient = imp__alloc(c->ctx, 2 * p->n, sizeof *r.gradient);
    if (!r.gradient) IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    r.gradient_se = r.gradient + p->n;
    IMP_TRY(comparisons_list(&r));
    for (int round = 0, before = 0; round < ROUNDS; before += r.fresh.more, round++) {
        size_t open = 0;
        r.fresh.more = round_more[round];
        for (size_t k = 0; k < r.n; k++) {
            if (round == 0) r.comparisons[k].noisy = true; /* all rows take part */
            open += r.comparisons[k].noisy;
        }
        if (open == 0) break;
        c->total = c->done + round_work(&r);
        IMP_TRY(gradient_round(&r, before));
        for (size_t k = 0; k < r.n; k++)
            if (r.comparisons[k].noisy)
                IMP_TRY(comparison_round(&r, &r.comparisons[k], before));
    }
    st = slopes_keep(&r);
out:
    imp__fresh_end(&r.fresh);
    imp__release(c->ctx, r.gradient);
    imp__release(c->ctx, r.comparisons);
    return st;
}
