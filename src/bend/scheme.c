/* SPDX-License-Identifier: Apache-2.0
 *
 * One step of a ray, forwards, backwards, along a tangent and with its rate in the step
 * length. A scheme is a list of drifts and kicks (docs/bent-rays.md 2.1, 2.2):
 *
 *     canonical    drift x += c t v        kick v += d t eta g,   path += d t eta^2
 *     arc length   drift x += c t v/|v|    kick v += d t g,       path += d t eta
 *
 * Each line below is one of these, its tangent or its transpose. Supplement (23), (24),
 * which has x' = v/eta(x) and no explicit inverse, is apart at the end. */
#include "bend_rays.h"

/* Yoshida 1990: w1 = 1/(2 - 2^(1/3)), w0 = 1 - 2 w1. */
#define W1 1.3512071919596578
#define W0 (-1.7024143839193153)
#define DRIFT(c)                                                                         \
    {                                                                                    \
        false, c                                                                         \
    }
#define KICK(d)                                                                          \
    {                                                                                    \
        true, d                                                                          \
    }

const struct imp__scheme imp__schemes[IMP_BEND_N_SCHEMES] = {
    [IMP_BEND_LEAPFROG] =
        {"leapfrog", 2, false, false, 3, {DRIFT(.5), KICK(1), DRIFT(.5)}},
    [IMP_BEND_EULER] = {"euler", 1, false, false, 2, {KICK(1), DRIFT(1)}},
    [IMP_BEND_VERLET] = {"verlet", 2, false, false, 3, {KICK(.5), DRIFT(1), KICK(.5)}},
    [IMP_BEND_YOSHIDA4] = {"yoshida4",
                           4,
                           false,
                           false,
                           7,
                           {DRIFT(W1 / 2), KICK(W1), DRIFT((W1 + W0) / 2), KICK(W0),
                            DRIFT((W1 + W0) / 2), KICK(W1), DRIFT(W1 / 2)}},
    [IMP_BEND_ARC] = {"arc", 2, true, false, 3, {DRIFT(.5), KICK(1), DRIFT(.5)}},
    [IMP_BEND_ARC_INDEX] = {"arc-index", 1, true, true, 0, {{0}}},
};

static void index_step(const imp_field *f, double t, int n, imp_v3 *x, imp_v3 *v,
                       double *path);
static void index_step_rate(const imp_field *f, double t, struct imp__state *s,
                            struct imp__state *rate);
static void index_step_tangent(const imp_field *f, double t, const double *theta_dot,
                               struct imp__state *s, struct imp__state *dot);
static void index_step_adjoint(const imp_field *f, double t, int n, struct imp__back *b,
                               const struct imp__state *const *before,
                               struct imp__bar *bar);

void imp__step(const struct imp__scheme *s, const imp_field *f, double t, int n,
               imp_v3 *x, imp_v3 *v, double *path)
{
    struct imp__jet jet[IMP_LANES];
    if (s->index_form) {
        index_step(f, t, n, x, v, path);
        return;
    }
    for (int k = 0; k < s->n_stages; k++) {
        const double dt = s->stage[k].part * t;
        if (s->stage[k].kick) {
            f->ops->eval(f, n, x, 1, jet);
            if (s->arc)
                for (int i = 0; i < n; i++)
                    v[i] += dt * jet[i].g, path[i] += dt * jet[i].eta;
            else
                for (int i = 0; i < n; i++) {
                    const double te = dt * jet[i].eta;
                    v[i] += te * jet[i].g;
                    path[i] += te * jet[i].eta;
                }
        } else if (s->arc) {
            for (int i = 0; i < n; i++) x[i] += v[i] * (dt / imp__length(v[i]));
        } else {
            for (int i = 0; i < n; i++) x[i] += dt * v[i];
        }
    }
}

/* The projection of d(v/|v|): (m - d (d.m)) / |v| */
static inline imp_v3 unit_dot(imp_v3 v, imp_v3 m)
{
    const double inv = 1 / imp__length(v);
    const imp_v3 d = v * inv;
    return (m - d * imp__dot(d, m)) * inv;
}

void imp__step_rate(const struct imp__scheme *s, const imp_field *f, double t,
                    struct imp__state *a, struct imp__state *r)
{
    *r = (struct imp__state){0};
    if (s->index_form) {
        index_step_rate(f, t, a, r);
        return;
    }
    for (int k = 0; k < s->n_stages; k++) {
        const double c = s->stage[k].part, dt = c * t;
        if (s->stage[k].kick) {
            struct imp__jet j;
            imp__field_eval1(f, &a->x, 2, &j);
            const imp_v3 hx = imp__jet_times(&j, r->x);
            const double eta_dot = imp__dot(j.g, r->x);
            if (s->arc) {
                r->v += c * j.g + dt * hx;
                r->path += c * j.eta + dt * eta_dot;
                a->v += dt * j.g;
                a->path += dt * j.eta;
            } else {
                r->v += (c * j.eta + dt * eta_dot) * j.g + (dt * j.eta) * hx;
                r->path += c * j.eta * j.eta + 2 * dt * j.eta * eta_dot;
                const double te = dt * j.eta;
                a->v += te * j.g;
                a->path += te * j.eta;
            }
        } else if (s->arc) {
            const double inv = 1 / imp__length(a->v);
            r->x += a->v * (c * inv) + dt * unit_dot(a->v, r->v);
            a->x += a->v * (dt / imp__length(a->v));
        } else {
            r->x += c * a->v + dt * r->v;
            a->x += dt * a->v;
        }
    }
}

void imp__step_tangent(const struct imp__scheme *s, const imp_field *f, double t,
                       const double *theta_dot, struct imp__state *a,
                       struct imp__state *r)
{
    if (s->index_form) {
        index_step_tangent(f, t, theta_dot, a, r);
        return;
    }
    for (int k = 0; k < s->n_stages; k++) {
        const double dt = s->stage[k].part * t;
        if (s->stage[k].kick) {
            struct imp__jet j;
            double eta_dot = 0;
            imp_v3 g_dot = {0};
            imp__field_eval1(f, &a->x, 2, &j);
            if (theta_dot) f->ops->tangent(f, &a->x, theta_dot, &eta_dot, &g_dot);
            eta_dot += imp__dot(j.g, r->x);
            g_dot += imp__jet_times(&j, r->x);
            if (s->arc) {
                r->v += dt * g_dot;
                r->path += dt * eta_dot;
                a->v += dt * j.g;
                a->path += dt * j.eta;
            } else {
                r->v += dt * (eta_dot * j.g + j.eta * g_dot);
                r->path += 2 * dt * j.eta * eta_dot;
                const double te = dt * j.eta;
                a->v += te * j.g;
                a->path += te * j.eta;
            }
        } else if (s->arc) {
            r->x += dt * unit_dot(a->v, r->v);
            a->x += a->v * (dt / imp__length(a->v));
        } else {
            r->x += dt * r->v;
            a->x += dt * a->v;
        }
    }
}

/* kick_adj and drift_adj of docs/bent-rays.md 2.2, stages from the last to the first. */
void imp__step_adjoint(const struct imp__scheme *s, const imp_field *f, double t, int n,
                       struct imp__back *b, const struct imp__state *const *before,
                       struct imp__bar *bar)
{
    struct imp__jet jet[IMP_LANES];
    if (s->index_form) {
        index_step_adjoint(f, t, n, b, before, bar);
        return;
    }
    for (int k = s->n_stages - 1; k >= 0; k--) {
        const double dt = s->stage[k].part * t;
        if (!s->stage[k].kick) {
            if (s->arc)
                for (int i = 0; i < n; i++) {
                    b->x[i] -= b->v[i] * (dt / imp__length(b->v[i]));
                    b->mu[i] += dt * unit_dot(b->v[i], b->lam[i]);
                }
            else
                for (int i = 0; i < n; i++) {
                    b->x[i] -= dt * b->v[i];
                    b->mu[i] += dt * b->lam[i];
                }
            continue;
        }
        if (f->ops->kick_back) {
            f->ops->kick_back(f, s->arc, dt, n, b, bar);
            continue;
        }
        f->ops->eval(f, n, b->x, 2, jet);
        for (int i = 0; i < n; i++) {
            double value;
            imp_v3 slope;
            imp__kick_back(s->arc, dt, &jet[i], b, i, &value, &slope);
            if (bar) f->ops->splat(f, &b->x[i], value, &slope, bar);
        }
    }
}

/* ---- Supplement (23), (24): v1 = v + s g(x), x1 = x + s v1/eta(x) -------------- */

static void index_step(const imp_field *f, double t, int n, imp_v3 *x, imp_v3 *v,
                       double *path)
{
    struct imp__jet jet[IMP_LANES];
    f->ops->eval(f, n, x, 1, jet);
    for (int i = 0; i < n; i++) {
        v[i] += t * jet[i].g;
        x[i] += v[i] * (t / jet[i].eta);
        path[i] += t * jet[i].eta;
    }
}

static void index_step_rate(const imp_field *f, double t, struct imp__state *s,
                            struct imp__state *rate)
{
    struct imp__jet j;
    imp__field_eval1(f, &s->x, 1, &j);
    s->v += t * j.g;
    s->x += s->v * (t / j.eta);
    s->path += t * j.eta;
    rate->v = j.g;
    rate->x = (s->v + t * j.g) * (1 / j.eta);
    rate->path = j.eta;
}

static void index_step_tangent(const imp_field *f, double t, const double *theta_dot,
                               struct imp__state *s, struct imp__state *r)
{
    struct imp__jet j;
    double eta_dot = 0;
    imp_v3 g_dot = {0};
    imp__field_eval1(f, &s->x, 2, &j);
    if (theta_dot) f->ops->tangent(f, &s->x, theta_dot, &eta_dot, &g_dot);
    eta_dot += imp__dot(j.g, r->x);
    g_dot += imp__jet_times(&j, r->x);
    s->v += t * j.g;
    r->v += t * g_dot;
    const double k = t / j.eta;
    s->x += s->v * k;
    r->x += r->v * k - s->v * (k * eta_dot / j.eta);
    s->path += t * j.eta;
    r->path += t * eta_dot;
}

/* Exact where the states before the step are stored. Without them it is (25), (26) of the
 * supplement, with eta and g taken at the nearest point that is known explicitly; its
 * bias is O(s) (docs/bent-rays.md 1.3). */
static void index_step_adjoint(const imp_field *f, double t, int n, struct imp__back *b,
                               const struct imp__state *const *before,
                               struct imp__bar *bar)
{
    struct imp__jet jet[IMP_LANES];
    imp_v3 v1[IMP_LANES];
    for (int i = 0; i < n; i++) v1[i] = b->v[i];
    if (before && before[0]) {
        for (int i = 0; i < n; i++) b->x[i] = before[i]->x;
    } else {
        f->ops->eval(f, n, b->x, 1, jet);
        for (int i = 0; i < n; i++) b->x[i] -= v1[i] * (t / jet[i].eta);
    }
    f->ops->eval(f, n, b->x, 2, jet);
    for (int i = 0; i < n; i++) {
        const struct imp__jet *j = &jet[i];
        const double k = t / j->eta;
        const imp_v3 mu = b->mu[i] + k * b->lam[i];
        const double value = t * b->path_bar[i] - k / j->eta * imp__dot(b->lam[i], v1[i]);
        const imp_v3 slope = t * mu;
        b->v[i] = before && before[0] ? before[i]->v : v1[i] - t * j->g;
        if (bar) f->ops->splat(f, &b->x[i], value, &slope, bar);
        b->lam[i] += value * j->g + imp__jet_times(j, slope);
        b->mu[i] = mu;
    }
}
