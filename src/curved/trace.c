/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays forwards. IMP_LANES rays take whole steps side by side; a ray that has passed a
 * surface lands on it with a fractional step (curved-rays 2.3), and ends or turns there.
 */
#include "curved.h"
#include <string.h>

#define CHUNK 512 /* rays of one work item */

/* ---- Starts -------------------------------------------------------------------- */

/* Straight line x + s d against a surface: *s_in where it enters, *s_out where it leaves.
 * false: it never gets inside. */
static bool straight(const struct imp__surface *s, imp_v3 x, imp_v3 d, double *s_in,
                     double *s_out)
{
    *s_in = -INFINITY;
    *s_out = INFINITY;
    switch (s->kind) {
    case IMP__PLANE: {
        const double g = imp__dot(s->n, x) - s->offset, slope = imp__dot(s->n, d);
        if (slope < 0) *s_in = -g / slope;
        else if (slope > 0) *s_out = -g / slope;
        else return g <= 0;
        return true;
    }
    case IMP__SPHERE:
    case IMP__CYLINDER: {
        imp_v3 y = x - s->c, e = d;
        if (s->kind == IMP__CYLINDER)
            y -= s->n * imp__dot(y, s->n), e -= s->n * imp__dot(e, s->n);
        const double a = imp__dot(e, e), b = imp__dot(y, e);
        const double c = imp__dot(y, y) - s->radius * s->radius;
        if (a < 1e-30) return c <= 0;
        const double disc = b * b - a * c;
        if (!(disc > 0)) return false;
        const double q = -(b + copysign(sqrt(disc), b)), s1 = q / a, s2 = c / q;
        *s_in = fmin(s1, s2);
        *s_out = fmax(s1, s2);
        return true;
    }
    case IMP__SDF: { /* sphere tracing inside the distance field's box */
        imp_v3 lo = s->sdf->lo, hi = s->sdf->hi;
        double a = 0, b = INFINITY;
        for (int k = 0; k < 3; k++) {
            if (!isfinite(lo[k]) || !isfinite(hi[k])) continue;
            double p = (lo[k] - x[k]) / d[k], q = (hi[k] - x[k]) / d[k];
            if (d[k] == 0) p = x[k] >= lo[k] ? -INFINITY : INFINITY, q = INFINITY;
            a = fmax(a, fmin(p, q));
            b = fmin(b, fmax(p, q));
        }
        double at = a;
        for (int i = 0; i < 1000 && at < b; i++) {
            struct imp__jet j;
            const imp_v3 y = x + d * at;
            imp__field_eval1(s->sdf, &y, 1, &j);
            const double slope = imp__dot(j.g, d);
            if (j.eta < 1e-3 && slope < 0) { /* near: Newton */
                const double ds = -j.eta / slope;
                at += ds;
                if (fabs(ds) < 1e-15 * (1 + fabs(at))) {
                    *s_in = at;
                    return true;
                }
            } else {
                at += fmax(j.eta, 1e-6);
            }
        }
        return false;
    }
    case IMP__DISC:
    case IMP__APPROACH:
    case IMP__MESH: return true;
    }
    return true;
}

static bool starts_inside(const struct imp__plan *p, const struct imp__domain *d,
                          const struct imp__state *a)
{
    if (!imp__inside(&a->x, &p->lo, &p->hi)) return false;
    for (int i = 0; i < d->n; i++) {
        struct imp__surface_at at;
        if (d->surface[i].kind == IMP__DISC || d->surface[i].kind == IMP__APPROACH ||
            d->surface[i].kind == IMP__MESH)
            continue;
        imp__surface_eval(&d->surface[i], &a->x, &a->v, &at);
        if (!(at.g <= 1e-9 * p->size * imp__length(at.gx))) return false;
    }
    return true;
}

/* Inside: v = eta d. From outside: straight to the surface that is entered last, then
 * refracted there, or as it is if the surface is matched. */
void imp__start_ray(const struct imp__plan *p, const struct imp_bend_rays *rays, size_t i,
                    struct imp__start *s)
{
    const struct imp__domain *dom = imp__plan_domain(p, imp__ray_group(rays, i));
    *s = (struct imp__start){.x0 = imp__v3_load(rays->x[i]),
                             .d0 = imp__v3_load(rays->d[i])};
    s->length = imp__length(s->d0);
    s->d0 *= 1 / s->length;
    s->at.x = s->x0;
    if (!(s->length > 0) || !imp__is_finite(s->x0) || !imp__is_finite(s->d0)) {
        s->flags = IMP_BEND_BROKEN;
        s->at.v = s->d0;
        return;
    }
    if (p->options.outside) {
        double in = -INFINITY, out = INFINITY;
        for (int k = 0; k < dom->n; k++) {
            double a, b;
            if (dom->surface[k].kind == IMP__MESH) {
                const imp_v3 end = s->x0 + s->d0 * (1e3 * p->size);
                if (!imp__facet(&dom->surface[k], &s->x0, &end, true, 1e-6 * p->size,
                                &s->facet)) {
                    s->flags = IMP_BEND_MISSED;
                    return;
                }
                a = (s->facet.offset - imp__dot(s->facet.n, s->x0)) /
                    imp__dot(s->facet.n, s->d0);
                if (a > in) in = a, s->entry = &dom->surface[k];
                continue;
            }
            if (!straight(&dom->surface[k], s->x0, s->d0, &a, &b)) {
                s->flags = IMP_BEND_MISSED;
                return;
            }
            if (a > in) in = a, s->entry = &dom->surface[k];
            out = fmin(out, b);
        }
        if (!s->entry || !(in >= 0) || !(in < out)) {
            s->flags = in >= 0 ? IMP_BEND_MISSED : IMP_BEND_STARTED_OUT;
            s->entry = NULL;
            return;
        }
        s->tau = in / p->outside_index;
        s->at.v = p->outside_index * s->d0;
        s->at.x = s->x0 + s->tau * s->at.v;
        s->at.path = p->outside_index * p->outside_index * s->tau;
        imp__field_eval1(p->field, &s->at.x, 1, &s->jet);
        if (s->entry->event == IMP_BEND_REFRACT) {
            struct imp__surface_at at;
            struct imp__turn turn;
            imp__surface_eval(imp__start_entry(s), &s->at.x, &s->at.v, &at);
            const imp_v3 n = imp__normalize(at.gx);
            if (fabs(imp__dot(n, s->d0)) < p->grazing) s->flags = IMP_BEND_GRAZING;
            imp__turn(&n, &s->at.v, s->jet.eta, false, &turn);
            if (turn.reflected) s->flags = IMP_BEND_MISSED;
            s->at.v = turn.v;
        }
    } else {
        imp__field_eval1(p->field, &s->at.x, 1, &s->jet);
        s->at.v = s->jet.eta * s->d0;
    }
    if (!(s->jet.eta > 0) || !isfinite(s->jet.eta) || !imp__is_finite(s->jet.g))
        s->flags = IMP_BEND_BROKEN;
    else if (!s->flags && !starts_inside(p, dom, &s->at)) s->flags = IMP_BEND_STARTED_OUT;
}

/* ---- Landing ------------------------------------------------------------------- */

/* Solve G(Phi_tau(from)) = 0 on (0, t]: Newton with dG/dtau, kept inside a bracket. */
double imp__land_on(const struct imp__plan *p, const struct imp__surface *s,
                    const struct imp__state *from, double t, double g0, double g1,
                    struct imp__state *at)
{
    double lo = 0, hi = t, tau = t * g0 / (g0 - g1);
    struct imp__state rate;
    struct imp__surface_at sa;
    if (!(g0 < 0)) { /* begins on the surface: look for the inside first */
        for (tau = t / 2; tau > 1e-9 * t; tau /= 2) {
            *at = *from;
            imp__step(p->scheme, p->field, tau, 1, &at->x, &at->v, &at->path);
            imp__surface_eval(s, &at->x, &at->v, &sa);
            if (sa.g < 0) break;
            hi = tau;
        }
        if (!(tau > 1e-9 * t)) {
            *at = *from;
            return 0;
        }
        lo = tau;
        tau = (lo + hi) / 2;
    }
    for (int i = 0; i < 100; i++) {
        *at = *from;
        imp__step_rate(p->scheme, p->field, tau, at, &rate);
        imp__surface_eval(s, &at->x, &at->v, &sa);
        const double slope = imp__dot(sa.gx, rate.x) + imp__dot(sa.gv, rate.v);
        const double newton = sa.g / slope;
        if (sa.g == 0) break;
        if (slope > 0 && fabs(newton) <= 1e-15 * t) {
            tau = imp_clamp(tau - newton, 0.0, t);
            break;
        }
        if (sa.g > 0) hi = tau;
        else lo = tau;
        const double next = tau - newton;
        tau = next > lo && next < hi ? next : (lo + hi) / 2;
        if (!(hi - lo > 1e-16 * t)) break;
    }
    *at = *from;
    imp__step(p->scheme, p->field, tau, 1, &at->x, &at->v, &at->path);
    return tau;
}

/* The first surface passed by the step from `from` to (x1, v1); NULL: none. `facet` is
 * room for the one of a mesh. */
static const struct imp__surface *land(const struct imp__plan *p,
                                       const struct imp__domain *d,
                                       const struct imp__state *from, const imp_v3 *x1,
                                       const imp_v3 *v1, double *tau,
                                       struct imp__state *at, struct imp__surface *facet)
{
    const struct imp__surface *hit = NULL;
    for (int i = 0; i < d->n; i++) {
        const struct imp__surface *s = &d->surface[i];
        struct imp__surface_at a0, a1;
        struct imp__state there;
        if (s->kind == IMP__MESH) {
            if (!imp__facet(s, &from->x, x1, false, 1e-6 * p->size, facet)) continue;
            s = facet;
        }
        imp__surface_eval(s, x1, v1, &a1);
        if (!(a1.g > 0)) continue;
        imp__surface_eval(s, &from->x, &from->v, &a0);
        const bool once = s->kind == IMP__DISC || s->kind == IMP__APPROACH;
        if (a0.g > 0 && (once || a1.g <= a0.g)) continue; /* was outside, or comes in */
        const double t = imp__land_on(p, s, from, p->t, a0.g, a1.g, &there);
        if (!imp__surface_covers(s, &there.x)) continue;
        if (!hit || t < *tau) hit = s, *tau = t, *at = there;
    }
    return hit;
}

/* ---- Many rays ----------------------------------------------------------------- */

struct lane {
    size_t ray;
    const struct imp__domain *domain;
    uint32_t steps, total;   /* whole steps of this segment, of the ray */
    unsigned flags, pending; /* pending: taps not met yet, as bits */
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

/* Taps crossed on the way from `from` to `to`, `t` long. */
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
        here.total = l->steps; /* of this segment: the adjoint meets it there */
        exit_write(&at, tau, &here, 0, k, &taps[k]);
    }
}

/* What happens at a surface: true if the ray ends, with its exit; false: `at` goes on. */
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
        struct imp__turn turn;
        imp__turn(&n, &at->v, s->index, s->event == IMP_BEND_MIRROR, &turn);
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
                hit = land(p, l->domain, &from[i], &x[i], &v[i], &tau, &at, &facet);
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

void imp__count(const struct imp__plan *p, size_t n, const struct imp_bend_exit *exits,
                const struct imp_bend_exit *taps, struct imp_bend_stats *out)
{
    struct imp_bend_stats s = IMP_BEND_STATS_INIT;
    if (!out) return;
    s.rays = n;
    for (size_t i = 0; i < n; i++) {
        const struct imp_bend_exit *e = &exits[i];
        s.steps += e->steps + 1u;
        s.truncated += (e->flags & IMP_BEND_TRUNCATED) != 0;
        s.missed += (e->flags & IMP_BEND_MISSED) != 0;
        s.started_out += (e->flags & IMP_BEND_STARTED_OUT) != 0;
        s.grazing += (e->flags & IMP_BEND_GRAZING) != 0;
        s.broken += (e->flags & IMP_BEND_BROKEN) != 0;
        s.energy += (e->flags & IMP_BEND_ENERGY) != 0;
        s.reflected += (e->flags & IMP_BEND_REFLECTED) != 0;
        for (int k = 0; taps && k < p->n_taps; k++)
            s.taps_missed +=
                (taps[i * (size_t)p->n_taps + k].flags & IMP_BEND_TAP_MISSED) != 0;
        if (e->flags & IMP_BEND_DROPPED) continue;
        s.traced++;
        struct imp__jet j;
        const imp_v3 x = imp__v3_load(e->x);
        imp__field_eval1(p->field, &x, 1, &j);
        s.worst_energy = fmax(s.worst_energy, fabs(e->norm2 / (j.eta * j.eta) - 1));
    }
    *out = s;
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
    struct imp__plan plan;
    enum imp_status st = imp__plan_create(field, options, rays, &plan);
    if (st != IMP_OK) return st;
    if (plan.n_taps > 0 && !taps)
        IMP_TRY(imp__error(plan.ctx, IMP_E_ARG, "taps are asked for and have no room"));
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
    imp__count(&plan, rays->n, exits, taps, stats);
out:
    imp__plan_destroy(&plan);
    return st;
}
