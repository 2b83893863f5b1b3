/* SPDX-License-Identifier: Apache-2.0
 *
 * The adjoint of a ray apart from its whole steps: exit, taps, reflections and start
 * (docs/bent-rays.md 2.3). */
#include "bend_adjoint.h"

/* ---- Events -------------------------------------------------------------------- */

/* Gradient of a surface's parameters: through the point where the ray crosses it (rho)
 * and through its normal (n_bar). [0-2] normal or centre, [3] offset or radius, [4] index
 * outside. */
static void surface_bar(struct imp__adjoint_slot *slot, const struct imp__surface *s,
                        imp_v3 x, double rho, imp_v3 n_bar, imp_v3 x_curved,
                        double e2_bar)
{
    if (!slot->surfaces) return;
    double *bar = slot->surfaces[s->id];
    imp_v3 c = {0};
    bar[4] += e2_bar;
    switch (s->kind) {
    case IMP__PLANE: /* G = n.x - p, tangent to the unit sphere of n */
        c = n_bar - rho * x;
        c -= s->n * imp__dot(c, s->n);
        bar[3] += rho;
        break;
    case IMP__SPHERE: /* G = (|x - c|^2 - R^2)/2; the normal moves with the centre */
    case IMP__CYLINDER: {
        imp_v3 y = x - s->c;
        if (s->kind == IMP__CYLINDER) y -= s->n * imp__dot(y, s->n);
        c = rho * y - x_curved;
        bar[3] += rho * s->radius;
        break;
    }
    case IMP__APPROACH:
    case IMP__DISC:
    case IMP__SDF:
    case IMP__MESH: return;
    }
    for (int k = 0; k < 3; k++) bar[k] += c[k];
}

/* Adjoint of refraction or reflection: cotangents after it -> before it. */
static void turn_back(struct imp__adjoint_slot *slot, const struct imp__surface *s,
                      imp_v3 x, imp_v3 v_in, imp_v3 gx, bool mirror, double e2,
                      imp_v3 *lam, imp_v3 *mu, double *field_bar)
{
    const double length = imp__length(gx);
    const imp_v3 n = gx * (1 / length);
    struct imp__bend_turn turn;
    imp_v3 v_bar, n_bar, m, curved;
    double e2_bar;
    imp__bend_turn(&n, &v_in, e2, mirror, &turn);
    imp__bend_turn_vjp(&turn, &n, &v_in, e2, mu, &v_bar, &n_bar, &e2_bar);
    m = (n_bar - n * imp__dot(n, n_bar)) * (1 / length);
    imp__surface_hess(s, &x, &m, &curved);
    *lam += curved;
    *mu = v_bar;
    if (field_bar) *field_bar = e2_bar, e2_bar = 0;
    surface_bar(slot, s, x, 0, n_bar, curved, e2_bar);
}

/* A fractional step of length tau that ends on a surface: the state at its start, the place
 * and the momentum at its end. */
struct landing {
    const struct imp__surface *surface;
    struct imp__state from;
    double tau;
    imp_v3 x, v_in;
};

/* Adjoint of a fractional step: (lam, mu, path_bar) at its end -> at its start. */
static void land_back(const struct imp__plan *p, struct imp__adjoint_slot *slot,
                      const struct landing *l, imp_v3 *lam, imp_v3 *mu, double path_bar,
                      struct imp__bar *theta_bar)
{
    const struct imp__surface *s = l->surface;
    struct imp__state at = l->from, rate;
    struct imp__surface_at sa;
    imp__step_rate(p->scheme, p->field, l->tau, &at, &rate);
    imp__surface_eval(s, &l->x, &l->v_in, &sa);
    const double below = imp__dot(sa.gx, rate.x) + imp__dot(sa.gv, rate.v);
    const double above =
        imp__dot(*lam, rate.x) + imp__dot(*mu, rate.v) + path_bar * rate.path;
    const double rho = below != 0 ? above / below : 0;
    struct imp__back b;
    b.x[0] = l->x, b.v[0] = l->v_in;
    b.lam[0] = *lam - rho * sa.gx;
    b.mu[0] = *mu - rho * sa.gv;
    b.path_bar[0] = path_bar;
    if (slot) surface_bar(slot, s, l->x, rho, (imp_v3){0}, (imp_v3){0}, 0);
    const bool stored = p->options.way == IMP_BEND_STORED;
    const struct imp__state *before[1] = {stored ? &l->from : NULL};
    imp__step_adjoint(p->scheme, p->field, l->tau, 1, &b, before, theta_bar);
    *lam = b.lam[0];
    *mu = b.mu[0];
}

/* ---- Lanes --------------------------------------------------------------------- */

/* State at the start of the fractional step, by reversal. */
static void reverse_landing(const struct imp__plan *p, double tau, struct imp__state *a)
{
    if (p->scheme->index_form) { /* pseudo-reverse, as in its adjoint */
        struct imp__jet j;
        imp__field_eval1(p->field, &a->x, 1, &j);
        a->x -= a->v * (tau / j.eta);
        imp__field_eval1(p->field, &a->x, 1, &j);
        a->v -= tau * j.g;
        return;
    }
    double path = 0; /* all other schemes: time-reversed order of the same stages */
    if (p->options.scheme == IMP_BEND_EULER) {
        struct imp__jet j;
        a->x -= tau * a->v;
        imp__field_eval1(p->field, &a->x, 1, &j);
        a->v -= (tau * j.eta) * j.g;
        return;
    }
    imp__step(p->scheme, p->field, -tau, 1, &a->x, &a->v, &path);
}

/* Begin the lane's current segment: from the cotangents at its end. */
static void segment_begin(const struct imp__plan *p, struct imp__adjoint_slot *slot,
                          struct imp__lane *l, struct imp__back *b, int i,
                          struct imp__bar *theta_bar)
{
    const struct imp__segment *g = &l->track->segment[l->segment];
    const struct landing landing = {g->surface, g->from, g->tau, g->at.x, g->at.v};
    land_back(p, slot, &landing, &b->lam[i], &b->mu[i], b->path_bar[i], theta_bar);
    b->x[i] = g->from.x;
    b->v[i] = g->from.v;
    l->left = g->steps;
    l->base = 0;
    for (int k = 0; k < l->segment; k++) l->base += l->track->segment[k].steps + 1u;
}

enum imp_status imp__lane_begin(const struct imp__adjoint *job,
                                struct imp__adjoint_slot *slot, size_t ray,
                                struct imp__track *track, struct imp__lane *l,
                                struct imp__back *b, int i, struct imp__bar *theta_bar)
{
    const struct imp__plan *p = job->plan;
    const struct imp_bend_exit *e = &job->exits[ray];
    static const struct imp_bend_cotangent none;
    const struct imp_bend_cotangent *bar = job->bars ? &job->bars[ray] : &none;
    const int group = imp__ray_group(job->rays, ray);
    const bool stored = p->options.way == IMP_BEND_STORED;
    const struct imp__surface *s;
    imp_v3 x, v_in;

    *l = (struct imp__lane){.ray = ray, .taps = job->tap_bars != NULL};
    imp__start_ray(p, job->rays, ray, &l->start);
    b->lam[i] = imp__v3_load(bar->x);
    b->mu[i] = imp__v3_load(bar->v);
    b->path_bar[i] = bar->path;
    s = imp__exit_surface(p, group, e);
    /* An exit holds neither the reflections of its ray nor the facet of a mesh: such a
     * ray is traced again. */
    if (stored || e->segments > 1 || s->kind == IMP__MESH) {
        track->states = stored;
        const enum imp_status st = imp__track_ray(p, job->rays, ray, track);
        if (st != IMP_OK) return st;
        l->track = track;
        l->segment = track->n_segments - 1;
        s = track->segment[l->segment].surface;
        x = track->segment[l->segment].at.x;
        v_in = track->segment[l->segment].at.v;
    } else {
        x = imp__v3_load(e->x);
        v_in = imp__v3_load(e->v);
    }
    if (s->event == IMP_BEND_REFRACT) {
        struct imp__surface_at sa;
        imp__surface_eval(s, &x, &v_in, &sa);
        if (!l->track) { /* the exit has v after refraction, and |v|^2 before it */
            const imp_v3 n = imp__normalize(sa.gx);
            const imp_v3 along = v_in - n * imp__dot(n, v_in);
            const double q2 = e->norm2 - imp__dot(along, along);
            v_in = along + n * copysign(sqrt(fmax(q2, 0)), imp__dot(n, v_in));
        }
        turn_back(slot, s, x, v_in, sa.gx, false, s->index, &b->lam[i], &b->mu[i], NULL);
    }
    if (l->track) {
        segment_begin(p, slot, l, b, i, theta_bar);
        return IMP_OK;
    }
    struct landing landing = {s, {x, v_in, 0}, e->tau, x, v_in};
    reverse_landing(p, e->tau, &landing.from);
    land_back(p, slot, &landing, &b->lam[i], &b->mu[i], b->path_bar[i], theta_bar);
    b->x[i] = landing.from.x;
    b->v[i] = landing.from.v;
    l->left = e->steps;
    return IMP_OK;
}

void imp__lane_taps(const struct imp__adjoint *job, struct imp__lane *l,
                    struct imp__back *b, int i, struct imp__bar *theta_bar)
{
    const struct imp__plan *p = job->plan;
    const size_t first = l->ray * (size_t)p->n_taps;
    for (int k = 0; k < p->n_taps; k++) {
        const struct imp_bend_exit *t = &job->taps[first + (size_t)k];
        const struct imp_bend_cotangent *bar = &job->tap_bars[first + (size_t)k];
        if ((t->flags & IMP_BEND_TAP_MISSED) || t->steps != l->left ||
            t->segments != l->segment + 1)
            continue;
        const struct landing landing = {&p->taps[k],
                                        {b->x[i], b->v[i], 0},
                                        t->tau,
                                        imp__v3_load(t->x),
                                        imp__v3_load(t->v)};
        imp_v3 lam = imp__v3_load(bar->x), mu = imp__v3_load(bar->v);
        land_back(p, NULL, &landing, &lam, &mu, bar->path, theta_bar);
        b->lam[i] += lam;
        b->mu[i] += mu;
        b->path_bar[i] += bar->path;
    }
}

void imp__lane_end(const struct imp__adjoint *job, struct imp__adjoint_slot *slot,
                   struct imp__lane *l, struct imp__back *b, int i,
                   struct imp__bar *theta_bar)
{
    const struct imp__plan *p = job->plan;
    const struct imp__start *s = &l->start;
    const imp_v3 zero = {0};
    imp_v3 lam = b->lam[i], mu = b->mu[i], d_bar;
    const imp_v3 g = s->jet.g;
    const double eta = s->jet.eta;

    if (p->options.way == IMP_BEND_REVERSE) {
        const double off = imp__length(b->x[i] - s->at.x) / p->size;
        if (off > p->reversal || !isfinite(off)) slot->reversal++;
        slot->worst = fmax(slot->worst, off);
    }
    if (job->out->energy) { /* K of docs/bent-rays.md 1.2 at the start */
        const double speed = imp__length(s->at.v);
        job->out->energy[l->ray] =
            p->scheme->arc
                ? imp__dot(lam, s->at.v) / speed + imp__dot(mu, g) + b->path_bar[i] * eta
                : imp__dot(lam, s->at.v) + eta * imp__dot(mu, g) +
                      b->path_bar[i] * eta * eta;
    }
    if (s->entry) {
        const struct imp__surface *entry = imp__start_entry(s);
        struct imp__surface_at sa;
        const imp_v3 v0 = p->outside_index * s->d0;
        imp__surface_eval(entry, &s->at.x, &v0, &sa);
        if (entry->event == IMP_BEND_REFRACT) {
            double eta_bar;
            turn_back(slot, entry, s->at.x, v0, sa.gx, false, eta, &lam, &mu, &eta_bar);
            if (theta_bar)
                p->field->ops->splat(p->field, &s->at.x, eta_bar, &zero, theta_bar);
            lam += eta_bar * g;
        }
        /* x = x0 + tau v0, path = n^2 tau, tau from G(x) = 0 */
        const double n2 = p->outside_index * p->outside_index;
        const double rho =
            (imp__dot(lam, v0) + b->path_bar[i] * n2) / imp__dot(sa.gx, v0);
        lam -= rho * sa.gx;
        surface_bar(slot, entry, s->at.x, rho, zero, zero, 0);
        mu += s->tau * lam;
        d_bar = p->outside_index * mu;
    } else { /* v0 = eta(x0) d0: a term that (5), (6) of the paper's supplement lack
              */
        const double eta_bar = imp__dot(mu, s->d0);
        if (theta_bar)
            p->field->ops->splat(p->field, &s->at.x, eta_bar, &zero, theta_bar);
        lam += eta_bar * g;
        d_bar = eta * mu;
    }
    d_bar = (d_bar - s->d0 * imp__dot(d_bar, s->d0)) * (1 / s->length);
    if (job->out->x) imp__v3_store(lam, job->out->x[l->ray]);
    if (job->out->d) imp__v3_store(d_bar, job->out->d[l->ray]);
}

void imp__lane_turn(const struct imp__adjoint *job, struct imp__adjoint_slot *slot,
                    struct imp__lane *l, struct imp__back *b, int i,
                    struct imp__bar *theta_bar)
{
    const struct imp__segment *g = &l->track->segment[--l->segment];
    struct imp__surface_at sa;
    imp__surface_eval(g->surface, &g->at.x, &g->at.v, &sa);
    turn_back(slot, g->surface, g->at.x, g->at.v, sa.gx,
              g->surface->event == IMP_BEND_MIRROR, g->surface->index, &b->lam[i],
              &b->mu[i], NULL);
    segment_begin(job->plan, slot, l, b, i, theta_bar);
}
