/* SPDX-License-Identifier: Apache-2.0
 *
 * Forward tracing. IMP_LANES rays take whole steps side by side. A step that crosses a
 * surface is shortened to end on it (landing.c); there the ray ends or is reflected. */
#include "bend_rays.h"
#include <string.h>

#define CHUNK 512 /* rays of one work item */

struct lane {
    size_t ray;
    const struct imp__domain *domain;
    uint32_t steps, total;   /* whole steps of this segment, of the ray */
    unsigned flags, pending; /* pending: bit mask of taps not crossed yet */
    int segments;
};

static void exit_write(const struct imp__state *a, double tau, const struct lane *l,
                       unsigned flags, int surface, struct imp_bend_exit *e)
{
    memset(e, 0, sizeof *e);
    imp__v3_store(a->x, e->x);
    imp__v3_store(a->v, e->v);
    e->path = a->path;
    e->tau = tau;
    e->norm2 = imp__dot(a->v, a->v);
    e->steps = l->total;
    e->surface = (uint16_t)surface;
    e->flags = (uint8_t)flags;
    e->segments = (uint8_t)imp_min(l->segments, 255);
}

/* Record the taps crossed by the step from `from` to `to`, of length t. */
static void taps_look(const struct imp__plan *p, struct lane *l,
                      const struct imp__state *from, const struct imp__state *to,
                      double t, struct imp_bend_exit *taps)
{
    for (int k = 0; k < p->n_taps; k++) {
        struct imp__surface s = p->taps[k];
        struct imp__surface_at a0, a1;
        if (!(l->pending >> k & 1)) continue;
        imp__surface_eval(&s, &from->x, &from->v, &a0);
        imp__surface_eval(&s, &to->x, &to->v, &a1);
        if (!((a0.g <= 0 && a1.g > 0) || (a0.g >= 0 && a1.g < 0))) continue;
        if (a1.g < 0) s.n = -s.n, s.offset = -s.offset, a0.g = -a0.g, a1.g = -a1.g;
        struct imp__state at;
        const double tau = imp__land_on(p, &s, from, t, a0.g, a1.g, &at);
        l->pending &= ~(1u << k);
        struct lane here = *l;
        here.total = l->steps; /* steps of this segment, which the adjoint counts down */
        exit_write(&at, tau, &here, 0, k, &taps[k]);
    }
}

/* Apply a surface's event. True: the ray ends, and its exit is written. False: it was
 * reflected and goes on from `at`. */
static bool event(const struct imp__plan *p, struct lane *l, const struct imp__surface *s,
                  struct imp__state *at, double tau, struct imp_bend_exit *e)
{
    struct imp__surface_at sa;
    struct imp__jet j;
    const imp_v3 v_in = at->v;
    imp__surface_eval(s, &at->x, &at->v, &sa);
    const imp_v3 n = imp__normalize(sa.gx);
    const double speed = imp__length(at->v);

    imp__field_eval1(p->field, &at->x, 1, &j);
    const double energy = fabs(speed * speed - j.eta * j.eta) / (j.eta * j.eta);
    if (!(energy <= 0.1)) l->flags |= IMP_BEND_BROKEN;
    else if (energy > 0.01) l->flags |= IMP_BEND_ENERGY;
    if (s->event == IMP_BEND_STOP) l->flags |= IMP_BEND_MISSED;
    if (s->kind != IMP__APPROACH && s->event != IMP_BEND_MIRROR &&
        fabs(imp__dot(n, at->v)) < p->grazing * speed)
        l->flags |= IMP_BEND_GRAZING;
    if (s->event == IMP_BEND_REFRACT || s->event == IMP_BEND_MIRROR) {
        struct imp__bend_turn turn;
        imp__bend_turn(&n, &at->v, s->index, s->event == IMP_BEND_MIRROR, &turn);
        at->v = turn.v;
        if (turn.reflected && !(l->flags & IMP_BEND_DROPPED)) {
            l->flags |= IMP_BEND_REFLECTED;
            l->steps = 0;
            if (l->segments++ < IMP_BEND_SEGMENTS_MAX - 1) return false;
            l->flags |= IMP_BEND_TRUNCATED;
        }
    }
    exit_write(at, tau, l, l->flags, s->id, e);
    e->norm2 = imp__dot(v_in, v_in);
    return true;
}

static enum imp_status track_state(struct imp__track *k, const struct imp__state *s)
{
    if (k->n >= k->capacity) {
        void *grown =
            imp__grow(k->ctx, k->state, &k->capacity, k->n + 1, sizeof *k->state);
        if (!grown)
            return imp__error(k->ctx, IMP_E_NOMEM, "no memory for a ray's trajectory");
        k->state = grown;
    }
    k->state[k->n++] = *s;
    return IMP_OK;
}

static enum imp_status trace(const struct imp__plan *p, const struct imp_bend_rays *rays,
                             size_t first, size_t last, struct imp_bend_exit *exits,
                             struct imp_bend_exit *taps, struct imp__track *track)
{
    const int lanes = track ? 1 : IMP_LANES;
    imp_v3 x[IMP_LANES], v[IMP_LANES];
    double path[IMP_LANES];
    struct imp__state from[IMP_LANES];
    struct lane lane[IMP_LANES];
    size_t next = first;
    int n = 0;
    const size_t n_taps = (size_t)p->n_taps;

    for (;;) {
        while (n < lanes && next < last) {
            struct imp__start s;
            const size_t i = next++, out = i - first;
            const int group = imp__ray_group(rays, i);
            imp__start_ray(p, rays, i, &s);
            lane[n] = (struct lane){.ray = out,
                                    .domain = imp__plan_domain(p, group),
                                    .flags = s.flags,
                                    .segments = 1};
            for (size_t k = 0; k < n_taps; k++) {
                if (p->tap_group[k] < 0 || p->tap_group[k] == group)
                    lane[n].pending |= 1u << k;
                memset(&taps[out * n_taps + k], 0, sizeof *taps);
                taps[out * n_taps + k].flags = IMP_BEND_TAP_MISSED;
            }
            if (s.flags) {
                exit_write(&s.at, 0, &lane[n], s.flags, 0, &exits[out]);
                continue;
            }
            x[n] = s.at.x, v[n] = s.at.v, path[n] = s.at.path;
            n++;
        }
        if (n == 0) return IMP_OK;
        for (int i = 0; i < n; i++) from[i] = (struct imp__state){x[i], v[i], path[i]};
        if (track && track->states) {
            const enum imp_status st = track_state(track, &from[0]);
            if (st != IMP_OK) return st;
        }
        imp__step(p->scheme, p->field, p->t, n, x, v, path);

        for (int i = 0; i < n; i++) {
            struct lane *l = &lane[i];
            struct imp__state at;
            struct imp__surface facet;
            const struct imp__surface *hit = NULL;
            const bool inside = imp__inside(&x[i], &l->domain->lo, &l->domain->hi);
            bool ended = false;
            double tau = p->t;
            if (!inside || l->domain->n_general > 0)
                hit = imp__land_first(p, l->domain, &from[i], &x[i], &v[i], &tau, &at,
                                      &facet);
            if (imp_unlikely(l->pending)) {
                const struct imp__state to =
                    hit ? at : (struct imp__state){x[i], v[i], 0};
                taps_look(p, l, &from[i], &to, tau, taps + l->ray * n_taps);
            }
            if (hit) {
                if (track) {
                    struct imp__segment *g = &track->segment[track->n_segments++];
                    *g = (struct imp__segment){.at = at,
                                               .from = from[i],
                                               .surface = hit,
                                               .tau = tau,
                                               .steps = l->steps};
                    if (hit == &facet) g->facet = facet, g->surface = &g->facet;
                }
                ended = event(p, l, hit, &at, tau, &exits[l->ray]);
                x[i] = at.x, v[i] = at.v, path[i] = at.path;
            } else {
                l->steps++;
                l->total++;
                unsigned lost = 0;
                if (imp_unlikely(!inside)) {
                    if (!imp__is_finite(x[i]) || !imp__is_finite(v[i]))
                        lost = IMP_BEND_BROKEN;
                    else if (!imp__inside(&x[i], &p->lo, &p->hi)) lost = IMP_BEND_MISSED;
                }
                if (imp_unlikely(l->total >= p->max_steps)) lost |= IMP_BEND_TRUNCATED;
                if (imp_unlikely(lost)) {
                    const struct imp__state here = {x[i], v[i], path[i]};
                    exit_write(&here, 0, l, l->flags | lost, 0, &exits[l->ray]);
                    ended = true;
                }
            }
            if (ended) {
                n--;
                x[i] = x[n], v[i] = v[n], path[i] = path[n];
                from[i] = from[n];
                lane[i] = lane[n];
                i--;
            }
        }
    }
}

enum imp_status imp__trace_some(const struct imp__plan *p,
                                const struct imp_bend_rays *rays, size_t first,
                                size_t last, struct imp_bend_exit *exits,
                                struct imp_bend_exit *taps)
{
    return trace(p, rays, first, last, exits + first,
                 taps ? taps + first * (size_t)p->n_taps : NULL, NULL);
}

enum imp_status imp__track_ray(const struct imp__plan *p,
                               const struct imp_bend_rays *rays, size_t i,
                               struct imp__track *track)
{
    track->ctx = p->ctx;
    track->n = 0;
    track->n_segments = 0;
    return trace(p, rays, i, i + 1, &track->exit, track->tap, track);
}

void imp__track_free(struct imp__track *track)
{
    if (track->ctx) imp__release(track->ctx, track->state);
    *track = (struct imp__track){0};
}

const struct imp__surface *imp__exit_surface(const struct imp__plan *p, int group,
                                             const struct imp_bend_exit *e)
{
    const struct imp__domain *d = imp__plan_domain(p, group);
    const struct imp__surface *best = NULL;
    double least = INFINITY;
    const imp_v3 x = imp__v3_load(e->x), v = imp__v3_load(e->v);
    for (int i = 0; i < d->n; i++) {
        struct imp__surface_at at;
        if (d->surface[i].id != e->surface) continue;
        if (d->surface[i].kind == IMP__MESH) return &d->surface[i];
        imp__surface_eval(&d->surface[i], &x, &v, &at);
        if (!best || fabs(at.g) < least) best = &d->surface[i], least = fabs(at.g);
    }
    return best;
}

/* ---- The call ------------------------------------------------------------------ */

struct count_job {
    const struct imp__plan *plan;
    size_t n;
    const struct imp_bend_exit *exits, *taps;
    struct imp_bend_stats *slots, *sum;
};

static enum imp_status count_work(size_t item, int worker, int slot, void *payload)
{
    const struct count_job *j = payload;
    const struct imp__plan *p = j->plan;
    struct imp_bend_stats s = IMP_BEND_STATS_INIT;
    (void)worker;
    for (size_t i = item * CHUNK; i < imp_min((item + 1) * CHUNK, j->n); i++) {
        const struct imp_bend_exit *e = &j->exits[i];
        s.steps += e->steps + 1u;
        s.truncated += (e->flags & IMP_BEND_TRUNCATED) != 0;
        s.missed += (e->flags & IMP_BEND_MISSED) != 0;
        s.started_out += (e->flags & IMP_BEND_STARTED_OUT) != 0;
        s.grazing += (e->flags & IMP_BEND_GRAZING) != 0;
        s.broken += (e->flags & IMP_BEND_BROKEN) != 0;
        s.energy += (e->flags & IMP_BEND_ENERGY) != 0;
        s.reflected += (e->flags & IMP_BEND_REFLECTED) != 0;
        for (int k = 0; j->taps && k < p->n_taps; k++)
            s.taps_missed +=
                (j->taps[i * (size_t)p->n_taps + k].flags & IMP_BEND_TAP_MISSED) != 0;
        if (e->flags & IMP_BEND_DROPPED) continue;
        s.traced++;
        struct imp__jet jet;
        const imp_v3 x = imp__v3_load(e->x);
        imp__field_eval1(p->field, &x, 1, &jet);
        s.worst_energy = fmax(s.worst_energy, fabs(e->norm2 / (jet.eta * jet.eta) - 1));
    }
    j->slots[slot] = s;
    return IMP_OK;
}

static enum imp_status count_commit(size_t item, int slot, void *payload)
{
    const struct count_job *j = payload;
    const struct imp_bend_stats *s = &j->slots[slot];
    (void)item;
    j->sum->steps += s->steps;
    j->sum->truncated += s->truncated;
    j->sum->missed += s->missed;
    j->sum->started_out += s->started_out;
    j->sum->grazing += s->grazing;
    j->sum->broken += s->broken;
    j->sum->energy += s->energy;
    j->sum->reflected += s->reflected;
    j->sum->taps_missed += s->taps_missed;
    j->sum->traced += s->traced;
    j->sum->worst_energy = fmax(j->sum->worst_energy, s->worst_energy);
    return IMP_OK;
}

enum imp_status imp__count(const struct imp__plan *p, size_t n,
                           const struct imp_bend_exit *exits,
                           const struct imp_bend_exit *taps, struct imp_bend_stats *out)
{
    if (!out) return IMP_OK;
    struct imp_bend_stats sum = IMP_BEND_STATS_INIT;
    struct count_job job = {p, n, exits, taps, NULL, &sum};
    const struct imp_loop loop = {.n_items = (n + CHUNK - 1) / CHUNK,
                                  .work = count_work,
                                  .commit = count_commit,
                                  .payload = &job};
    job.slots = imp__alloc(p->ctx, (size_t)imp__pool_slots(p->ctx), sizeof *job.slots);
    if (!job.slots) return imp__error(p->ctx, IMP_E_NOMEM, "no memory to count rays");
    const enum imp_status st = imp__parallel(p->ctx, &loop, NULL);
    imp__release(p->ctx, job.slots);
    sum.rays = n;
    if (st == IMP_OK) *out = sum;
    return st;
}

struct job {
    const struct imp__plan *plan;
    const struct imp_bend_rays *rays;
    struct imp_bend_exit *exits, *taps;
};
static enum imp_status job_work(size_t i, int worker, int slot, void *payload)
{
    const struct job *j = payload;
    (void)worker, (void)slot;
    const size_t first = i * CHUNK;
    return imp__trace_some(j->plan, j->rays, first, imp_min(first + CHUNK, j->rays->n),
                           j->exits, j->taps);
}

enum imp_status imp_bend_trace(const imp_field *field,
                               const struct imp_bend_options *options,
                               const struct imp_bend_rays *rays,
                               struct imp_bend_exit *exits, struct imp_bend_exit *taps,
                               struct imp_bend_stats *stats)
{
    IMP_REQUIRE(NULL, field, "field");
    IMP_REQUIRE(field->ctx, rays, "rays");
    struct imp_bend_rays own_rays = IMP_BEND_RAYS_INIT;
    IMP_OPTIONS(field->ctx, own_rays, rays, "rays");
    rays = &own_rays;
    IMP_REQUIRE(field->ctx, exits, "exits");
    if (stats) IMP_SIZED(field->ctx, stats, "stats");
    IMP_FLOAT_MODE;
    struct imp_bend_stats all = IMP_BEND_STATS_INIT;
    struct imp__plan plan;
    enum imp_status st = imp__plan_create(field, options, rays, &plan);
    if (st != IMP_OK) return st;
    if (plan.n_taps > 0 && !taps)
        IMP_TRY(imp__error(plan.ctx, IMP_E_ARG, "taps are wanted and have no room"));
    struct job job = {&plan, rays, exits, taps};
    const struct imp_loop loop = {.n_items = (rays->n + CHUNK - 1) / CHUNK,
                                  .work = job_work,
                                  .payload = &job,
                                  .progress = plan.options.progress,
                                  .progress_payload = plan.options.progress_payload,
                                  .stage = "trace",
                                  .rate_unit = "rays",
                                  .units = (double)rays->n};
    IMP_TRY(imp__parallel(plan.ctx, &loop, NULL));
    IMP_TRY(imp__count(&plan, rays->n, exits, taps, stats ? &all : NULL));
    if (stats)
        IMP_TRY(imp__info_give(plan.ctx, __func__, "stats", stats, &all, sizeof all));
out:
    imp__plan_destroy(&plan);
    return st;
}
