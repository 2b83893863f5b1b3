/* SPDX-License-Identifier: Apache-2.0
 *
 * One replicate of a pixel: its walks are traced and folded, and swept with their adjoints. Where
 * these are made of the other walks' mean, all walks are kept until it is known. */
#include "film/film_sums.h"
#include "gradient_job.h"
#include "inverse/estimate/adjoint.h"
#include "inverse/estimate/moved_gradient.h"
#include "light_gradient.h"

struct replicate {
    struct imp__gradient_job *job;
    struct imp__replicates plan;
    struct imp_tile_worker *worker;
    struct imp_tally *tally;
    struct imp__tile_walks *walks;
    int x, y, b;
    size_t pixel;
};

static void trace(const struct replicate *r, int set, int i, struct imp_walk *walk)
{
    const int64_t sample = imp__replicates_first(r->plan, r->b, set) + i;
    imp__tile_walk(r->walks, r->x, r->y, sample, walk);
    imp__tile_drop(r->worker, walk->dropped, r->x, r->y, sample);
    r->tally->rays += imp_max(2 * walk->n - 1, 1);
}

/* ---- Adjoints that are known before ------------------------------------------------ */

static imp_spec adjoint_of(const struct replicate *r, int set, const struct imp_walk *w)
{
    const struct imp__gradient_job *j = r->job;
    imp_spec P = {0};
    if (j->splat) return imp__splat_adjoint(j->splat, r->b, set, w->px, w->py, w->L);
    const float *seed = j->seed + r->pixel * (size_t)j->channels;
    for (int c = 0; c < j->channels; c++) P[c] = seed[c] / (double)r->plan.n;
    return P;
}

/* Where poses are active: room for what walks give to velocities, and behind it for draws, all 0. */
static double *inside_begin(const struct replicate *r)
{
    const struct imp__moved_gradient *m = r->job->moved;
    if (imp_likely(!m)) return NULL;
    const size_t n = IMP_MOVED_BARS * m->moves.n;
    if (r->job->item_bars) return r->job->item_bars + (size_t)r->worker->index * n;
    double *inside = imp__arena_array(&r->worker->arena, n, sizeof *inside);
    r->worker->no_memory |= !inside;
    return inside;
}

static void inside_end(const struct replicate *r, double *inside)
{
    const struct imp__gradient_job *j = r->job;
    if (!j->bars_of_replicates && j->of == IMP_JOB_OF_WALKS) return;
    if (!j->bars_of_replicates) {
        r->worker->no_memory |=
            !imp__moved_draws(j->moved, &r->worker->arena, r->plan, r->x, r->y, r->b,
                              inside, inside + j->moved->moves.n);
        return;
    }
    const size_t n = imp__moved_contrasts(j->moved);
    double *contrasts = n ? j->item_contrasts + (size_t)r->worker->index * n : NULL;
    r->worker->no_memory |= !imp__moved_replicate(
        j->moved, &r->worker->arena, r->plan, r->x, r->y, r->b, j->of != IMP_JOB_OF_WALKS,
        inside, contrasts, &r->tally->sink);
}

/* A walk of a set, by its adjoint. */
static void sweep_one(const struct replicate *r, int set, const struct imp_walk *walk,
                      double *inside)
{
    const struct imp__gradient_job *j = r->job;
    const bool moves = imp_unlikely(inside != NULL) && imp__moved_touched(j->moved, walk),
               sweeps = imp_likely(!inside) || !j->moved->alone;
    if (!moves && !sweeps) return;
    const imp_spec P = adjoint_of(r, set, walk);
    if (sweeps) imp__walk_sweep(&j->tracer, walk, P, &r->tally->sink);
    if (moves)
        r->worker->no_memory |=
            !imp__moved_walk(j->moved, &r->worker->arena, walk, P, inside);
}

static int set_size(const struct replicate *r, int set)
{
    return imp__replicates_set(r->plan, set + 1) - imp__replicates_set(r->plan, set);
}

static void sweep_each(const struct replicate *r)
{
    const struct imp__gradient_job *j = r->job;
    double *inside = inside_begin(r);
    for (int s = 0; s < r->plan.m && j->of != IMP_JOB_OF_DRAWS; s++)
        for (int i = 0; i < set_size(r, s); i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&r->worker->arena);
            struct imp_walk walk;
            trace(r, s, i, &walk);
            sweep_one(r, s, &walk, inside);
            imp__arena_rewind(&r->worker->arena, mark);
        }
    if (imp_unlikely(inside != NULL)) inside_end(r, inside);
}

/* The same of walks that are kept until the pictures have their pixel. */
static void sweep_pictures(const struct replicate *r)
{
    const struct imp__splat *splat = r->job->splat;
    double *inside = inside_begin(r);
    struct imp_walk *walks =
        imp__arena_take(&r->worker->arena, (size_t)r->plan.n, sizeof *walks);
    if (!walks) {
        r->worker->no_memory = true;
        return;
    }
    for (int s = 0, k = 0; s < r->plan.m; s++)
        for (int i = 0; i < set_size(r, s); i++) trace(r, s, i, &walks[k++]);
    for (int s = 0; splat->m > 1 && s < r->plan.m; s++)
        imp__splat_take(splat, r->b, s, r->pixel, set_size(r, s),
                        walks + imp__replicates_set(r->plan, s));
    if (splat->m == 1) imp__splat_take(splat, r->b, 0, r->pixel, r->plan.n, walks);
    for (int s = 0; s < r->plan.m; s++)
        for (int i = 0; i < set_size(r, s); i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&r->worker->arena);
            sweep_one(r, s, &walks[imp__replicates_set(r->plan, s) + i], inside);
            imp__arena_rewind(&r->worker->arena, mark);
        }
    if (inside) inside_end(r, inside);
}

/* ---- Adjoints made of residuals ----------------------------------------------------- */

/* The means of the sets' walks: L, and H at the previous parameters, where the variate
 * needs it. */
static void sets_trace(const struct replicate *r, struct imp_walk *walks, imp_spec *L,
                       imp_spec *H)
{
    const struct imp__gradient_job *j = r->job;
    const bool looks = j->variate && imp__variate_looks(j->variate, r->pixel);
    for (int s = 0; s < r->plan.m; s++) {
        const int first = imp__replicates_set(r->plan, s);
        const int n = imp__replicates_set(r->plan, s + 1) - first;
        L[s] = (imp_spec){0};
        if (j->variate) H[s] = (imp_spec){0};
        for (int i = 0; i < n; i++) {
            trace(r, s, i, &walks[first + i]);
            L[s] += walks[first + i].L;
            if (imp_unlikely(looks))
                H[s] += imp__walk_elsewhere(&j->there, &walks[first + i]);
        }
        if (n > 1) L[s] /= imp__spec(n);
        if (n > 1 && looks) H[s] /= imp__spec(n);
    }
}

/* E: adjoints of the errors of a replicate that has no other beside it; NULL: none are wanted. */
static void sets_sweep(const struct replicate *r, const struct imp_walk *walks,
                       const imp_spec *P, const imp_spec *E)
{
    const struct imp_tracer *tracer = &r->job->tracer;
    for (int s = 0; s < r->plan.m; s++) {
        const int first = imp__replicates_set(r->plan, s);
        const int end = imp__replicates_set(r->plan, s + 1);
        imp_spec mean = P[s], error = E ? E[s] : P[s];
        if (end - first > 1) {
            mean /= imp__spec(end - first);
            error /= imp__spec(end - first);
        }
        for (int i = first; i < end; i++)
            if (E) imp__walk_sweep_both(tracer, &walks[i], mean, error, &r->tally->both);
            else imp__walk_sweep(tracer, &walks[i], mean, &r->tally->sink);
    }
    if (E) imp__tally_error(r->tally);
}

static double sweep_residuals(const struct replicate *r, int part, double *moments,
                              double *variance)
{
    struct imp__gradient_job *j = r->job;
    struct imp_arena *arena = &r->worker->arena;
    const size_t m = (size_t)r->plan.m;
    struct imp_walk *walks = imp__arena_take(arena, (size_t)r->plan.n, sizeof *walks);
    imp_spec *L = imp__arena_take(arena, m, sizeof *L);
    imp_spec *P = imp__arena_take(arena, m, sizeof *P);
    imp_spec *H = j->variate ? imp__arena_take(arena, m, sizeof *H) : NULL;
    if (!walks || !L || !P || (j->variate && !H)) {
        r->worker->no_memory = true;
        return 0;
    }
    sets_trace(r, walks, L, H);
    if (j->variate) /* H becomes what residuals are taken from */
        imp__variate_replicate(j->variate, j->target, r->plan, part, r->pixel, L, H,
                               j->look ? NULL : moments);
    const double value = imp__replicate_adjoints(j->target, j->channels, r->pixel,
                                                 r->plan.m, L, j->variate ? H : L, P);
    imp_spec E[2];
    if (r->plan.lone)
        *variance = imp__replicate_errors(j->target, j->channels, r->pixel, L, P, E);
    if (j->want_gradient)
        sets_sweep(r, walks, P, r->plan.lone && j->want_errors ? E : NULL);
    return value;
}

/* ---- Either ------------------------------------------------------------------------- */

double imp__gradient_replicate(struct imp__gradient_job *j, struct imp__replicates plan,
                               struct imp_tile_worker *w, struct imp__tile_walks *walks,
                               int x, int y, int b, int part, double *moments,
                               double *variance)
{
    if (imp_unlikely(j->light != NULL)) {
        imp__light_replicate(j, w, x, y, b);
        return 0;
    }
    const struct replicate r = {
        .job = j,
        .plan = plan,
        .worker = w,
        .tally = &j->tallies[w->index],
        .walks = walks,
        .x = x,
        .y = y,
        .b = b,
        .pixel = (size_t)y * (size_t)j->width + (size_t)x,
    };
    if (j->of != IMP_JOB_OF_DRAWS) imp__tile_walks_ready(walks);
    const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
    double value = 0;
    if (j->target && !j->splat) value = sweep_residuals(&r, part, moments, variance);
    else if (j->splat && !j->splat_made) sweep_pictures(&r);
    else sweep_each(&r);
    imp__tally_batch(r.tally, b);
    imp__arena_rewind(&w->arena, mark);
    return value;
}
