/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks on walks that are kept: vertices, directions, densities and decisions are
 * frozen, so nothing here has noise.
 *
 *   frozen  sweep against central differences of the same product at other parameters
 *   dot     <J v, w> = <v, J^T w>: tangent against sweep
 *   euler   sum theta dL/dtheta = L over all emission; on Stam's walks
 *           sum theta dL/dtheta = n L over the reflectances of one material met n times
 *
 * Colours are folded to one number with weights that differ, so that a derivative in the
 * wrong lane shows. */
#include "check.h"
#include "walk/picture.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MEMORY_MAX    ((size_t)512 << 20) /* of kept walks */
#define TRIES         50                  /* walks traced for one that is kept */
#define SINGLE_MAX    12 /* numbers of a parameter looked at one by one; more: */
#define DIRECTIONS    6  /* random directions */
#define N_STEPS       4
#define FROZEN_LIMIT  1e-6
#define EXACT_LIMIT   1e-12
#define NOTHING       1e-200 /* below it products lose digits to underflow */
#define WALK_ROUNDING 5e-14  /* of L, of a walk evaluated twice */
#define TINY          1e-3 /* of the walk's L: logarithmic derivatives below it count as 0 */

static const double steps[N_STEPS] = {1e-3, 1e-4, 1e-5, 1e-6};
static const double lane[3] = {1, 0.7, 1.3};

struct entry {
    size_t i; /* in x */
    double g;
};

struct kept {
    struct imp_walk walk;
    struct entry *gradient; /* of the folded value; may name a number twice */
    size_t n;
    double L;
};

struct keep {
    struct imp__check *check;
    struct imp_arena arena;
    struct kept *walks;
    size_t n;
    double *value[3]; /* [n] frozen values at up to three places */
};

static double fold(const struct imp__check *c, imp_spec L)
{
    double sum = 0;
    for (int k = 0; k < c->problem->scene->channels; k++) sum += lane[k] * L[k];
    return sum;
}
static imp_spec fold_bar(const struct imp__check *c)
{
    return c->problem->scene->channels == 3 ? (imp_spec){lane[0], lane[1], lane[2], 0}
                                            : (imp_spec){lane[0]};
}

/* ---- Keeping walks ------------------------------------------------------------- */

struct list {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    imp_context *ctx;
    int lanes;
    struct entry *at;
    size_t n, cap;
    bool failed;
};

static void list_add(struct imp_sink *sink, int param, size_t element, int channels,
                     const imp_spec *bar)
{
    struct list *l = (struct list *)sink;
    const int64_t base = l->active->base[param];
    if (base < 0) return;
    struct entry *grown = imp__grow(l->ctx, l->at, &l->cap, l->n + 3, sizeof *grown);
    if (!grown) {
        l->failed = true;
        return;
    }
    l->at = grown;
    if (channels == 3) {
        for (int k = 0; k < l->lanes; k++)
            l->at[l->n++] = (struct entry){(size_t)base + element + (size_t)k, (*bar)[k]};
        return;
    }
    double sum = 0;
    for (int k = 0; k < l->lanes; k++) sum += (*bar)[k];
    l->at[l->n++] = (struct entry){(size_t)base + element, sum};
}

static enum imp_status no_memory(const struct imp__check *c)
{
    return imp__error(c->ctx, IMP_E_NOMEM, "no memory to keep %d walks",
                      c->options.paths);
}

static enum imp_status keep_walks(struct keep *k)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const uint64_t pixels = (uint64_t)film->crop_w * (uint64_t)film->crop_h;
    const size_t wanted = (size_t)c->options.paths;
    struct list list = {{.add = list_add},
                        c->tracer.active,
                        c->ctx,
                        c->problem->scene->channels,
                        NULL,
                        0,
                        0,
                        false};

    k->walks = imp__alloc(c->ctx, wanted, sizeof *k->walks);
    for (int i = 0; i < 3; i++) k->value[i] = imp__alloc(c->ctx, wanted, sizeof(double));
    if (!k->walks || !k->value[0] || !k->value[1] || !k->value[2]) IMP_TRY(no_memory(c));
    for (size_t t = 0; t < TRIES * wanted && k->n < wanted && k->arena.total < MEMORY_MAX;
         t++) {
        const uint64_t pixel = imp__mix64(t + 0x51ed270b) % pixels;
        const struct imp_arena_mark mark = imp__arena_mark(&k->arena);
        struct kept *w = &k->walks[k->n];
        imp__walk_trace(&c->tracer, &k->arena, (int)(pixel % (uint64_t)film->crop_w),
                        (int)(pixel / (uint64_t)film->crop_w), (int64_t)t, &w->walk);
        if (w->walk.dropped == IMP_DROP_MEMORY) IMP_TRY(no_memory(c));
        list.n = 0;
        if (w->walk.dropped == IMP_DROP_NONE)
            imp__walk_sweep(&c->tracer, &w->walk, fold_bar(c), &list.sink);
        bool any = false;
        for (size_t i = 0; i < list.n; i++) any |= fabs(list.at[i].g) > NOTHING;
        w->L = fold(c, w->walk.L);
        w->n = list.n;
        if (!any && fabs(w->L) <= NOTHING) { /* nothing to compare */
            imp__arena_rewind(&k->arena, mark);
            continue;
        }
        w->gradient = imp__arena_take(&k->arena, list.n + 1, sizeof *w->gradient);
        if (!w->gradient || list.failed) IMP_TRY(no_memory(c));
        if (list.n > 0) memcpy(w->gradient, list.at, list.n * sizeof *list.at);
        k->n++;
    }
out:
    imp__release(c->ctx, list.at);
    return st;
}

static void keep_destroy(struct keep *k)
{
    imp__arena_free(&k->arena);
    imp__release(k->check->ctx, k->walks);
    for (int i = 0; i < 3; i++) imp__release(k->check->ctx, k->value[i]);
}

/* ---- Differences --------------------------------------------------------------- */

#define PER_ITEM 64

struct frozen_job {
    const struct keep *keep;
    double *value;
};

static enum imp_status frozen_work(size_t item, int worker, int slot, void *payload)
{
    const struct frozen_job *j = payload;
    (void)worker, (void)slot;
    for (size_t i = item * PER_ITEM; i < imp_min((item + 1) * PER_ITEM, j->keep->n); i++)
        j->value[i] = fold(j->keep->check, imp__walk_frozen(&j->keep->check->tracer,
                                                            &j->keep->walks[i].walk));
    return IMP_OK;
}

/* All walks at the scene's present parameters. */
static enum imp_status evaluate(const struct keep *k, double *value)
{
    struct frozen_job job = {k, value};
    const struct imp_loop loop = {.n_items = (k->n + PER_ITEM - 1) / PER_ITEM,
                                  .work = frozen_work,
                                  .payload = &job};
    return imp__parallel(k->check->ctx, &loop, NULL);
}

/* A direction inside one parameter: number `only`, or all of them, with random sizes. */
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

static void place(struct direction *d, double step)
{
    struct imp_param param = *d->param;
    for (size_t e = 0; e < param.info.count; e++) {
        const double move = component(d, e) * step;
        imp__param_set(&param, e,
                       d->old[e]); /* the scale is the start's, wherever we are */
        if (move != 0)
            imp__param_set(&param, e, d->old[e] + move * imp__check_scale(&param, e));
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

/* Differences of all walks along d: value[0] becomes the difference, d->moved the motion.
 */
static enum imp_status difference(struct keep *k, struct direction *d, double step)
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
        for (size_t i = 0; i < k->n; i++) k->value[0][i] -= k->value[1][i];
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
        for (size_t i = 0; i < k->n; i++)
            k->value[0][i] =
                s * (-3 * k->value[0][i] + 4 * k->value[1][i] - k->value[2][i]);
    }
out:
    place(d, 0);
    return st;
}

static double along(const struct kept *w, size_t base, const double *moved, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < w->n; i++)
        if (w->gradient[i].i >= base && w->gradient[i].i < base + count)
            sum += w->gradient[i].g * moved[w->gradient[i].i - base];
    return sum;
}

/* The walks' verdict. A walk is judged by the step at which its difference quotient
 * changed least from the step before, and only by what is beyond that change and its
 * rounding: near a kink (total reflection by a metal with k = 0) no quotient settles.
 * f, a [N_STEPS][n]: quotients of one direction and what they should be; worst so far in
 * *row. */
static void judge(const struct keep *k, const double *f, const double *a,
                  struct imp_check_row *row)
{
    for (size_t i = 0; i < k->n; i++) {
        const double L = fabs(k->walks[i].L);
        double settled = INFINITY;
        size_t best = i;
        int step = 0;
        for (int s = 1; s < N_STEPS; s++) {
            const size_t here = (size_t)s * k->n + i, before = here - k->n;
            const double change = fabs((f[here] - a[here]) - (f[before] - a[before]));
            if (!(change < settled)) continue;
            settled = change;
            best = here;
            step = s;
        }
        const double allowed = settled + WALK_ROUNDING * L / (2 * steps[step]);
        const double off = fabs(a[best] - f[best]);
        const double error = off <= allowed ? 0
                             : isfinite(settled)
                                 ? (off - allowed) / fmax(fabs(a[best]), TINY * L)
                                 : INFINITY;
        if (!(error > row->error) && row->step > 0) continue;
        *row = (struct imp_check_row){
            .step = steps[step], .value = a[best], .reference = f[best], .error = error};
    }
}

/* Worst walk over the parameter's directions, for every step: rows. */
static enum imp_status check_param(struct keep *k, size_t param)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_param *p = &c->problem->scene->params[param];
    const size_t count = p->info.count, base = (size_t)c->tracer.active->base[param];
    struct direction d = {.param = p};
    struct imp_check_row row[N_STEPS] = {{0}}, verdict = {0};
    double *buffer = imp__alloc(c->ctx, 2 * count, sizeof *buffer);
    double *q = imp__alloc(c->ctx, imp_max(k->n, (size_t)1),
                           2 * N_STEPS * sizeof *q); /* see judge */
    double *want = q ? q + N_STEPS * k->n : NULL;

    if (!buffer || !q) IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    d.old = buffer;
    d.moved = buffer + count;
    for (size_t e = 0; e < count; e++) d.old[e] = imp__param_get(p, e);
    const size_t n_directions = count <= SINGLE_MAX ? count : DIRECTIONS;
    for (size_t r = 0; r < n_directions; r++) {
        d.only = count <= SINGLE_MAX ? r : SIZE_MAX;
        d.seed = r;
        for (int s = 0; s < N_STEPS; s++) {
            IMP_TRY(difference(k, &d, steps[s]));
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
                if (!(error > row[s].error) && row[s].step > 0) continue;
                row[s] = (struct imp_check_row){.step = steps[s],
                                                .value = a / size,
                                                .reference = f / size,
                                                .error = error};
            }
        }
        judge(k, q, want, &verdict);
    }
    int best = 0;
    for (int s = 1; s < N_STEPS; s++)
        if (row[s].error < row[best].error) best = s;
    if (row[best].error > FROZEN_LIMIT && k->n > 0) {
        const double scale = imp__check_scale(p, 0);
        row[best].value = verdict.value / scale;
        row[best].reference = verdict.reference / scale;
        row[best].error = verdict.error;
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
    return st;
}

/* ---- Dot product --------------------------------------------------------------- */

static enum imp_status check_dot(struct keep *k)
{
    struct imp__check *c = k->check;
    const size_t n = c->problem->n;
    struct imp_check_row row = {.limit = EXACT_LIMIT, .ok = 1};
    double *v = imp__alloc(c->ctx, n, sizeof *v);

    if (!v) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    for (size_t i = 0; i < n; i++)
        v[i] = 2 * imp__u01(imp__key(3, i >> 31, 3), (uint32_t)i) - 1;
    for (size_t i = 0; i < k->n; i++) {
        const struct kept *w = &k->walks[i];
        const double forward = fold(c, imp__walk_tangent(&c->tracer, &w->walk, v));
        double reverse = 0, size = 0;
        for (size_t q = 0; q < w->n; q++) {
            reverse += w->gradient[q].g * v[w->gradient[q].i];
            size += fabs(w->gradient[q].g * v[w->gradient[q].i]);
        }
        const double error = forward == reverse ? 0 : fabs(forward - reverse) / size;
        if (error <= row.error) continue;
        row.error = error;
        row.value = reverse;
        row.reference = forward;
    }
    row.ok = row.error <= row.limit;
    imp__release(c->ctx, v);
    return imp__check_row(c, "dot", NULL, -1, &row);
}

/* ---- Euler --------------------------------------------------------------------- */

/* Mark the parameters behind an input. */
static void mark(const struct imp_scene *s, const struct imp_input *in, uint8_t *chosen)
{
    if (!in->texture) {
        if (in->param >= 0) chosen[in->param] = 1;
        return;
    }
    if (in->texture->param >= 0) chosen[in->texture->param] = 1;
    for (int j = 0; j < in->texture->n_in; j++) mark(s, in->texture->input[j], chosen);
}

static bool any_chosen(const struct imp_scene *s, const uint8_t *chosen)
{
    for (size_t k = 0; k < s->n_params; k++)
        if (chosen[k]) return true;
    return false;
}

/* Sum of theta dL/dtheta over the chosen parameters against n(walk) L, worst walk.
 * Numbers without a parameter (fixed inputs) make the identity fail, so `chosen` must be
 * complete. */
static enum imp_status euler(struct keep *k, const uint8_t *chosen,
                             const struct imp_bsdf *counted, const char *name)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = k->check;
    const struct imp_scene *s = c->problem->scene;
    struct imp_active active = {0};
    struct imp_tracer tracer = c->tracer;
    struct list list = {
        {.add = list_add}, &active, c->ctx, s->channels, NULL, 0, 0, false};
    struct imp_check_row row = {.limit = EXACT_LIMIT, .ok = 1};
    double *theta = NULL;

    IMP_TRY(imp__active_create(s, chosen, &active));
    theta = imp__alloc(c->ctx, imp_max(active.n, (size_t)1), sizeof *theta);
    if (!theta) IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    for (size_t p = 0; p < s->n_params; p++)
        for (size_t e = 0; active.base[p] >= 0 && e < s->params[p].info.count; e++)
            theta[(size_t)active.base[p] + e] = imp__param_get(&s->params[p], e);
    tracer.active = &active;
    for (size_t i = 0; i < k->n; i++) {
        const struct kept *w = &k->walks[i];
        double n = 1, sum = 0;
        if (counted) {
            n = 0;
            for (const struct imp_vertex *v = w->walk.first; v && v->next; v = v->next)
                /* Light collected on the way, where nothing absorbs: L is no product. */
                n = imp__is_zero(v->e) ? n + (v->bsdf == counted) : -INFINITY;
        }
        if (fabs(w->L) <= NOTHING || n <= 0) continue;
        list.n = 0;
        imp__walk_sweep(&tracer, &w->walk, fold_bar(c), &list.sink);
        if (list.failed)
            IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
        for (size_t q = 0; q < list.n; q++) sum += theta[list.at[q].i] * list.at[q].g;
        const double error = fabs(sum - n * w->L) / (n * w->L);
        if (error <= row.error && row.reference != 0) continue;
        row.error = error;
        row.value = sum;
        row.reference = n * w->L;
    }
    row.ok = row.error <= row.limit;
    if (row.reference != 0) IMP_TRY(imp__check_row(c, "euler", name, -1, &row));
out:
    imp__active_destroy(c->ctx, &active);
    imp__release(c->ctx, list.at);
    imp__release(c->ctx, theta);
    return st;
}

static enum imp_status check_emission(struct keep *k, uint8_t *chosen)
{
    const struct imp_scene *s = k->check->problem->scene;
    memset(chosen, 0, s->n_params);
    for (int i = 0; i < s->n_emitters; i++)
        for (int j = 0; j < s->emitters[i]->n_in; j++)
            if (s->emitters[i]->ops->inputs[j].role == IMP_EMISSION)
                mark(s, s->emitters[i]->input[j], chosen);
    for (int i = 0; i < s->n_bsdfs; i++)
        for (int j = 0; j < s->bsdfs[i]->n_own; j++)
            if (s->bsdfs[i]->ops->inputs[j].role == IMP_EMISSION)
                mark(s, s->bsdfs[i]->input[j], chosen);
    return any_chosen(s, chosen) ? euler(k, chosen, NULL, "all emission") : IMP_OK;
}

/* Stam's integrator collects light at the end only, so L is a product over the vertices.
 */
static enum imp_status check_reflectance(struct keep *k, uint8_t *chosen)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *s = k->check->problem->scene;
    if (k->check->tracer.integrator->kind != IMP_INTEGRATOR_STAM) return IMP_OK;
    for (int i = 0; i < s->n_bsdfs; i++) {
        const struct imp_bsdf *b = s->bsdfs[i];
        if (strncmp(b->ops->name, "stam_m", 6) != 0) continue;
        memset(chosen, 0, s->n_params);
        for (int j = 0; j < b->n_own; j++)
            if (b->ops->inputs[j].role == IMP_REFLECTANCE) mark(s, b->input[j], chosen);
        char name[256];
        snprintf(name, sizeof name, "%s: reflectances", b->name ? b->name : b->ops->name);
        if (any_chosen(s, chosen)) IMP_TRY(euler(k, chosen, b, name));
    }
out:
    return st;
}

enum imp_status imp__check_frozen(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *s = c->problem->scene;
    struct keep k = {.check = c};
    uint8_t *chosen = imp__alloc(c->ctx, imp_max(s->n_params, (size_t)1), 1);

    imp__arena_init(&k.arena, c->ctx);
    if (!chosen) IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    IMP_TRY(keep_walks(&k));
    if (k.n == 0)
        IMP_TRY(imp__error(c->ctx, IMP_E_NUMERIC,
                           "no walk of %d carries light or a derivative",
                           TRIES * c->options.paths));
    /* The attached form differentiates the sampling too: nothing is frozen then. */
    const bool frozen = c->tracer.integrator->alpha_gradient != IMP_ALPHA_ATTACHED;
    for (size_t q = 0; frozen && q < s->n_params; q++)
        if (c->tracer.active->base[q] >= 0) {
            IMP_TRY(check_param(&k, q));
            IMP_TRY(imp__check_progress(c, 0));
        }
    IMP_TRY(check_dot(&k));
    IMP_TRY(check_emission(&k, chosen));
    IMP_TRY(check_reflectance(&k, chosen));
out:
    keep_destroy(&k);
    imp__release(c->ctx, chosen);
    return st;
}
