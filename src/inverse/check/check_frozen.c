/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks evaluated at other parameters, with their vertices as they were: central
 * differences of their radiance against the gradient of the sweep. */
#include "base/arguments.h"
#include "check_walks.h"
#include "scene/pose.h"
#include <math.h>
#include <string.h>

#define SINGLE_MAX 12 /* parameters of up to so many values: each is a direction; */
#define DIRECTIONS 6  /* larger ones: random directions */
#define N_STEPS    4
/* Central differences leave an error of step^2 times the third derivative, and rounding
 * of 1e-16/step: 1e-8 to 1e-10 at the better steps. A wrong term is far above. */
#define FROZEN_LIMIT 1e-6
/* Relative to the larger of two values of a walk: products of up to some hundred factors, each
 * with a rounding of 1e-16. */
#define WALK_ROUNDING 5e-14
/* Errors are relative to the derivative, or to this part of the walk's L per relative
 * change of the parameter where the derivative is smaller: it is then a difference of
 * larger terms, and has their rounding. */
#define TINY 1e-3

static const double steps[N_STEPS] = {1e-3, 1e-4, 1e-5, 1e-6};

/* ---- Differences --------------------------------------------------------------- */

#define PER_ITEM 64

struct frozen_job {
    const struct imp__kept *keep;
    double *value;
};

static enum imp_status frozen_work(size_t item, int worker, int slot, void *payload)
{
    const struct frozen_job *j = payload;
    (void)worker, (void)slot;
    for (size_t i = item * PER_ITEM; i < imp_min((item + 1) * PER_ITEM, j->keep->n); i++)
        j->value[i] =
            imp__kept_fold(j->keep->check, imp__walk_frozen(&j->keep->check->tracer,
                                                            &j->keep->walks[i].walk));
    return IMP_OK;
}

/* All walks at the scene's present parameters. */
static enum imp_status evaluate(const struct imp__kept *k, double *value)
{
    imp__theta_announce(k->check->problem->scene);
    IMP_CHECKED(imp__poses_settle(k->check->problem->scene));
    struct frozen_job job = {k, value};
    const struct imp_loop loop = {.n_items = (k->n + PER_ITEM - 1) / PER_ITEM,
                                  .work = frozen_work,
                                  .payload = &job};
    return imp__parallel(k->check->ctx, &loop, NULL);
}

/* A direction inside one parameter: value `only`, or all of them, with random sizes. */
struct direction {
    const struct imp_param *param;
    size_t only; /* SIZE_MAX: all */
    uint64_t seed;
    double *old;   /* [count] values at the start */
    double *moved; /* [count] what a difference really moved, after rounding */
};

static double component(const struct direction *d, size_t e)
{
    if (d->only != SIZE_MAX) return e == d->only ? 1 : 0;
    return 2 * imp__u01(imp__key(d->seed, 1, 2), (uint32_t)e) - 1;
}

/* For floats, rounds the step so that both ends of a difference are representable at the
 * same distance from the start. The end of larger magnitude has the coarser spacing. */
static double representable(const struct imp_param *p, double old, double move)
{
    if (p->store != IMP_STORE_BULK) return move;
    const double far = (double)(float)(fabs(old) + fabs(move));
    return copysign(far - fabs(old), move);
}

static void place(struct direction *d, double step)
{
    struct imp_param param = *d->param;
    for (size_t e = 0; e < param.info.count; e++) {
        const double move = component(d, e) * step;
        imp__param_set(&param, e,
                       d->old[e]); /* the scale is the start's, wherever we are */
        if (move != 0)
            imp__param_set(&param, e,
                           d->old[e] + representable(&param, d->old[e],
                                                     move * imp__check_scale(&param, e)));
    }
}

/* moved += sign * (values now) */
static void note(struct direction *d, double sign)
{
    for (size_t e = 0; e < d->param->info.count; e++)
        d->moved[e] += sign * imp__param_get(d->param, e);
}

/* Is there room on both sides? A double at its bound is differenced one-sidedly, to
 * second order; floats (linear in everything they feed) may leave their bounds. */
static bool two_sided(const struct direction *d, double step)
{
    if (d->param->store == IMP_STORE_BULK || d->only == SIZE_MAX) return true;
    const double h = step * imp__check_scale(d->param, d->only), x = d->old[d->only];
    return x - h >= d->param->info.lo && x + h <= d->param->info.hi;
}

/* Differences of all walks along d: value[0] becomes the difference, value[1] the largest
 * of the values that are subtracted, d->moved the motion; bend[]: the slope above the
 * start less that below, with this step (0 where there is one side only). */
static enum imp_status difference(struct imp__kept *k, struct direction *d, double step,
                                  const double *start, double *bend)
{
    enum imp_status st = IMP_OK;
    memset(d->moved, 0, d->param->info.count * sizeof *d->moved);
    if (two_sided(d, step)) {
        place(d, step);
        note(d, 1);
        IMP_TRY(evaluate(k, k->value[0]));
        place(d, -step);
        note(d, -1);
        IMP_TRY(evaluate(k, k->value[1]));
        for (size_t i = 0; i < k->n; i++) {
            const double above = k->value[0][i], below = k->value[1][i];
            bend[i] = (above - start[i]) - (start[i] - below);
            k->value[0][i] = above - below;
            k->value[1][i] = fmax(fabs(above), fabs(below));
        }
    } else { /* (-3 f0 + 4 f1 - f2) = 2 h f' + O(h^3) */
        const double x = d->old[d->only], h = step * imp__check_scale(d->param, d->only);
        const double s = x + 2 * h <= d->param->info.hi ? 1 : -1;
        place(d, 0);
        IMP_TRY(evaluate(k, k->value[0]));
        place(d, s * step);
        note(d, 2 * s);
        IMP_TRY(evaluate(k, k->value[1]));
        place(d, s * 2 * step);
        IMP_TRY(evaluate(k, k->value[2]));
        place(d, 0);
        note(d, -2 * s);
        for (size_t i = 0; i < k->n; i++) {
            const double f0 = 3 * k->value[0][i], f1 = 4 * k->value[1][i],
                         f2 = k->value[2][i];
            k->value[0][i] = s * (f1 - f0 - f2);
            k->value[1][i] = fmax(fmax(fabs(f0), fabs(f1)), fabs(f2));
            bend[i] = 0;
        }
    }
out:
    place(d, 0);
    imp__theta_announce(k->check->problem->scene);
    const enum imp_status back = imp__poses_settle(k->check->problem->scene);
    return st == IMP_OK ? back : st;
}

static double along(const struct imp__kept_walk *w, size_t base, const double *moved,
                    size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < w->n; i++)
        if (w->gradient[i].i >= base && w->gradient[i].i < base + count)
            sum += w->gradient[i].g * moved[w->gradient[i].i - base];
    return sum;
}

/* Differences of all walks along one direction, [N_STEPS][n] each. */
struct quotients {
    const double *f;    /* difference quotients */
    const double *a;    /* the same from the sweeps' gradients */
    const double *size; /* largest number that f is a difference of */
    const double *bend; /* slope above the parameter's value less the slope below */
};

static double beyond(double off, double rounding, double worth)
{
    return off <= rounding ? 0 : isfinite(off) ? (off - rounding) / worth : INFINITY;
}

/* Relative error of a walk: the smaller of two estimates. The first takes the step whose
 * quotient changed least from the previous step, and subtracts that change and the
 * rounding; near a kink no quotient converges. The second takes the step that agrees
 * best, and subtracts the rounding only: a kink at some distance is crossed by the larger
 * steps alone. */
static double judge_walk(const struct imp__kept *k, const struct quotients *q, size_t i,
                         int *step)
{
    const double L = fabs(k->walks[i].L);
    double error[N_STEPS], settled = INFINITY;
    int calm = 0;
    *step = 0;
    for (int s = 0; s < N_STEPS; s++) {
        const size_t here = (size_t)s * k->n + i, before = here - k->n;
        const double off = q->f[here] - q->a[here];
        error[s] =
            beyond(fabs(off), WALK_ROUNDING * fmax(L, q->size[here]) / (2 * steps[s]),
                   fmax(fabs(q->a[here]), TINY * L));
        if (s == 0) continue;
        const double change = fabs(off - (q->f[before] - q->a[before]));
        if (change < settled) settled = change, calm = s;
    }
    if (isfinite(settled)) {
        const double a = q->a[(size_t)calm * k->n + i];
        error[calm] = fmax(error[calm] - settled / fmax(fabs(a), TINY * L), 0);
    }
    for (int s = 1; s < N_STEPS; s++)
        if (error[s] < error[*step]) *step = s;
    return error[*step];
}

/* A walk may be at a kink, for example at the border of two texels. The slopes below and
 * above the parameter's value then differ, a central difference is their mean, and the
 * sweep must agree with one of them. The one-sided slope is taken at the two smallest
 * steps, and extrapolated to step 0 from each and the step before, which removes the
 * error proportional to the step. At a kink the difference of the two slopes does not
 * change as the step shrinks; at a jump it grows with 1/step, and no side is right (1.5
 * is between 1 and 10). @return the relative error of the side that agrees better;
 * INFINITY at a jump. */
static double judge_sides(const struct imp__kept *k, const struct quotients *q, size_t i,
                          double *slope)
{
    const double L = fabs(k->walks[i].L);
    const size_t last = (N_STEPS - 1) * k->n + i;
    const double round_last = WALK_ROUNDING * fmax(L, q->size[last]) / steps[N_STEPS - 1];
    double best = INFINITY;
    if (!(fabs(q->bend[last]) <= 1.5 * fabs(q->bend[last - k->n]) + 4 * round_last))
        return INFINITY;
    for (int side = -1; side <= 1; side += 2) {
        double worst = 0, at = 0;
        for (int s = N_STEPS - 2; s < N_STEPS; s++) {
            const size_t here = (size_t)s * k->n + i, before = here - k->n;
            const double one = q->f[here] + side * q->bend[here] / 2;
            const double two = q->f[before] + side * q->bend[before] / 2;
            at = one + (one - two) * steps[s] / (steps[s - 1] - steps[s]);
            /* Rounding of the extrapolated slope: 10/9 of one, 1/90 of the other. */
            const double error =
                beyond(fabs(at - q->a[here]),
                       1.25 * WALK_ROUNDING * fmax(L, q->size[here]) / steps[s],
                       fmax(fabs(q->a[here]), TINY * L));
            /* What is left is of third order, 100 times larger at the larger step. */
            worst = fmax(worst, s < N_STEPS - 1 ? error / 10 : error);
        }
        if (worst < best) best = worst, *slope = at;
    }
    return best;
}

/* Puts the worst walk so far into *row. kinked [n]: walks that were counted as being at a
 * kink. */
static void judge(const struct imp__kept *k, const struct quotients *q, uint8_t *kinked,
                  struct imp_check_row *row)
{
    for (size_t i = 0; i < k->n; i++) {
        int step;
        double slope = 0, error = judge_walk(k, q, i, &step);
        double f = q->f[(size_t)step * k->n + i];
        const double one_side =
            error > FROZEN_LIMIT ? judge_sides(k, q, i, &slope) : INFINITY;
        if (one_side <= FROZEN_LIMIT) {
            error = one_side, f = slope, step = N_STEPS - 1;
            if (!kinked[i]) kinked[i] = 1, row->kinks++;
        }
        if (!(error > row->error) && row->step > 0) continue;
        row->step = steps[step];
        row->value = q->a[(size_t)step * k->n + i];
        row->reference = f;
        row->error = error;
    }
}

/* Worst walk over the parameter's directions, for every step: rows. */
static enum imp_status check_param(struct imp__kept *k, size_t param)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_param *p = &c->problem->scene->params[param];
    const size_t count = p->info.count, base = (size_t)c->tracer.active->base[param];
    struct direction d = {.param = p};
    struct imp_check_row row[N_STEPS] = {{0}}, verdict = {0};
    double *buffer = imp__alloc(c->ctx, 2 * count, sizeof *buffer);
    double *q = imp__alloc(c->ctx, imp_max(k->n, (size_t)1),
                           (4 * N_STEPS + 1) * sizeof *q); /* struct quotients */
    double *want = q ? q + N_STEPS * k->n : NULL;
    double *largest = q ? want + N_STEPS * k->n : NULL;
    double *bend = q ? largest + N_STEPS * k->n : NULL;
    double *start = q ? bend + N_STEPS * k->n : NULL;

    uint8_t *kinked = imp__alloc(c->ctx, imp_max(k->n, (size_t)1), 1);

    if (!buffer || !q || !kinked)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    d.old = buffer;
    d.moved = buffer + count;
    for (size_t e = 0; e < count; e++) d.old[e] = imp__param_get(p, e);
    IMP_TRY(evaluate(k, start));
    const size_t n_directions = count <= SINGLE_MAX ? count : DIRECTIONS;
    for (size_t r = 0; r < n_directions; r++) {
        d.only = count <= SINGLE_MAX ? r : SIZE_MAX;
        d.seed = r;
        for (int s = 0; s < N_STEPS; s++) {
            IMP_TRY(difference(k, &d, steps[s], start, bend + (size_t)s * k->n));
            const double size =
                2 * steps[s] * imp__check_scale(p, count <= SINGLE_MAX ? r : 0);
            for (size_t i = 0; i < k->n; i++) {
                const double a = along(&k->walks[i], base, d.moved, count);
                const double f = k->value[0][i];
                const double size_L = TINY * 2 * steps[s] * fabs(k->walks[i].L);
                const double error = a == f ? 0 : fabs(a - f) / fmax(fabs(a), size_L);
                /* In units of the scale: as large as the logarithmic derivative. */
                q[(size_t)s * k->n + i] = f / (2 * steps[s]);
                want[(size_t)s * k->n + i] = a / (2 * steps[s]);
                largest[(size_t)s * k->n + i] = k->value[1][i];
                bend[(size_t)s * k->n + i] /= steps[s];
                if (!(error > row[s].error) && row[s].step > 0) continue;
                row[s] = (struct imp_check_row){.step = steps[s],
                                                .value = a / size,
                                                .reference = f / size,
                                                .error = error};
            }
        }
        judge(k, &(struct quotients){q, want, largest, bend}, kinked, &verdict);
    }
    int best = 0;
    for (int s = 1; s < N_STEPS; s++)
        if (row[s].error < row[best].error) best = s;
    if (row[best].error > FROZEN_LIMIT && k->n > 0) {
        const double scale = imp__check_scale(p, 0);
        row[best].value = verdict.value / scale;
        row[best].reference = verdict.reference / scale;
        row[best].error = verdict.error;
        row[best].kinks = verdict.kinks;
    }
    for (int s = 0; s < N_STEPS; s++) {
        row[s].step = steps[s];
        row[s].limit = s == best ? FROZEN_LIMIT : 0; /* the others are for information */
        row[s].ok = s == best ? row[s].error <= FROZEN_LIMIT : 1;
        IMP_TRY(imp__check_row(c, "frozen", p->info.name, -1, &row[s]));
    }
out:
    imp__release(c->ctx, buffer);
    imp__release(c->ctx, q);
    imp__release(c->ctx, kinked);
    return st;
}

enum imp_status imp__check_frozen(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *s = c->problem->scene;
    struct imp__kept k = {.check = c};

    imp__arena_init(&k.arena, c->ctx);
    c->tracer.collisions_fixed = true; /* extinctions: with frozen collisions too */
    IMP_TRY(imp__kept_create(&k));
    if (k.n == 0)
        IMP_TRY(imp__error(c->ctx, IMP_E_NUMERIC,
                           "no walk of %d carries light or a derivative",
                           IMP_KEPT_TRIES * c->options.paths));
    /* The attached form differentiates the sampling too: nothing is frozen then. */
    const bool frozen = c->tracer.integrator->alpha_gradient != IMP_ALPHA_ATTACHED;
    for (size_t q = 0; frozen && q < s->n_params; q++)
        if (c->tracer.active->base[q] >= 0) {
            IMP_TRY(check_param(&k, q));
            IMP_TRY(imp__check_progress(c, 0));
        }
    IMP_TRY(imp__check_identities(&k));
out:
    c->tracer.collisions_fixed = false;
    imp__kept_destroy(&k);
    return st;
}
