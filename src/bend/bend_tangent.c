/* SPDX-License-Identifier: Apache-2.0
 *
 * Forward derivatives of rays: the tangent of every line of the tracer, in the same
 * order. They give Gauss-Newton products, and the dot-product test of the adjoint. */
#include "bend_rays.h"
#include <string.h>

#define CHUNK 128

struct job {
    const struct imp__plan *plan;
    const struct imp_bend_rays *rays;
    const double *theta_dot;
    const double (*x_dot)[3], (*d_dot)[3];
    struct imp_bend_cotangent *dots, *tap_dots;
    struct imp__track *tracks; /* [slots] */
};

static void cotangent_store(const struct imp__state *s, struct imp_bend_cotangent *out)
{
    imp__v3_store(s->x, out->x);
    imp__v3_store(s->v, out->v);
    out->path = s->path;
}

/* dn of n = G_x/|G_x| when x moves by x_dot */
static imp_v3 normal_dot(const struct imp__surface *s, imp_v3 x, imp_v3 gx, imp_v3 x_dot)
{
    imp_v3 h;
    const double length = imp__length(gx);
    const imp_v3 n = gx * (1 / length);
    imp__surface_hess(s, &x, &x_dot, &h);
    return (h - n * imp__dot(n, h)) * (1 / length);
}

/* Tangent of a fractional step, whose length changes by d tau = -dG / (dG/d tau). */
static void land_dot(const struct imp__plan *p, const struct imp__surface *s,
                     const struct imp__state *from, const struct imp__state *from_dot,
                     double tau, const double *theta_dot, struct imp__state *at,
                     struct imp__state *dot)
{
    struct imp__state rate;
    struct imp__surface_at sa;
    *at = *from;
    imp__step_rate(p->scheme, p->field, tau, at, &rate);
    *at = *from;
    *dot = *from_dot;
    imp__step_tangent(p->scheme, p->field, tau, theta_dot, at, dot);
    imp__surface_eval(s, &at->x, &at->v, &sa);
    const double below = imp__dot(sa.gx, rate.x) + imp__dot(sa.gv, rate.v);
    const double above = imp__dot(sa.gx, dot->x) + imp__dot(sa.gv, dot->v);
    const double tau_dot = below != 0 ? -above / below : 0;
    dot->x += tau_dot * rate.x;
    dot->v += tau_dot * rate.v;
    dot->path += tau_dot * rate.path;
}

static void start_dot(const struct job *job, size_t i, const struct imp__start *s,
                      struct imp__state *dot)
{
    const struct imp__plan *p = job->plan;
    const imp_v3 xd = job->x_dot ? imp__v3_load(job->x_dot[i]) : (imp_v3){0};
    imp_v3 dd = job->d_dot ? imp__v3_load(job->d_dot[i]) : (imp_v3){0};
    dd = (dd - s->d0 * imp__dot(dd, s->d0)) * (1 / s->length);
    *dot = (struct imp__state){.x = xd};
    if (s->entry) {
        const struct imp__surface *entry = imp__start_entry(s);
        struct imp__surface_at sa;
        const imp_v3 v0 = p->outside_index * s->d0, vd = p->outside_index * dd;
        imp__surface_eval(entry, &s->at.x, &v0, &sa);
        dot->x = xd + s->tau * vd;
        dot->v = vd;
        const double tau_dot = -imp__dot(sa.gx, dot->x) / imp__dot(sa.gx, v0);
        dot->x += tau_dot * v0;
        dot->path = p->outside_index * p->outside_index * tau_dot;
        if (entry->event != IMP_BEND_REFRACT) return;
        struct imp__bend_turn turn;
        const imp_v3 n = imp__normalize(sa.gx);
        const imp_v3 n_dot = normal_dot(entry, s->at.x, sa.gx, dot->x);
        double eta_dot = 0;
        imp_v3 g_dot;
        if (job->theta_dot)
            p->field->ops->tangent(p->field, &s->at.x, job->theta_dot, &eta_dot, &g_dot);
        eta_dot += imp__dot(s->jet.g, dot->x);
        imp__bend_turn(&n, &v0, s->jet.eta, false, &turn);
        imp__bend_turn_jvp(&turn, &n, &v0, s->jet.eta, &vd, &n_dot, eta_dot, &dot->v);
        return;
    }
    double eta_dot = 0;
    imp_v3 g_dot;
    if (job->theta_dot)
        p->field->ops->tangent(p->field, &s->at.x, job->theta_dot, &eta_dot, &g_dot);
    eta_dot += imp__dot(s->jet.g, xd);
    dot->v = eta_dot * s->d0 + s->jet.eta * dd;
}

static enum imp_status ray_tangent(const struct job *job, size_t i,
                                   struct imp__track *track)
{
    const struct imp__plan *p = job->plan;
    const size_t n_taps = (size_t)p->n_taps;
    struct imp_bend_cotangent *out = &job->dots[i];
    struct imp__start start;
    struct imp__state dot;

    memset(out, 0, sizeof *out);
    if (job->tap_dots)
        memset(&job->tap_dots[i * n_taps], 0, n_taps * sizeof *job->tap_dots);
    track->states = false;
    const enum imp_status st = imp__track_ray(p, job->rays, i, track);
    if (st != IMP_OK || (track->exit.flags & IMP_BEND_DROPPED)) return st;
    imp__start_ray(p, job->rays, i, &start);
    start_dot(job, i, &start, &dot);

    struct imp__state s = start.at;
    for (int k = 0; k < track->n_segments; k++) {
        const struct imp__segment *g = &track->segment[k];
        struct imp__surface_at sa;
        for (uint32_t n = 0; n <= g->steps; n++) {
            for (size_t t = 0; job->tap_dots && t < n_taps; t++) {
                const struct imp_bend_exit *e = &track->tap[t];
                struct imp__state at, tap_dot;
                if ((e->flags & IMP_BEND_TAP_MISSED) || e->steps != n ||
                    e->segments != k + 1)
                    continue;
                land_dot(p, &p->taps[t], &s, &dot, e->tau, job->theta_dot, &at, &tap_dot);
                cotangent_store(&tap_dot, &job->tap_dots[i * n_taps + t]);
            }
            if (n < g->steps)
                imp__step_tangent(p->scheme, p->field, p->t, job->theta_dot, &s, &dot);
        }
        struct imp__state at, end;
        land_dot(p, g->surface, &s, &dot, g->tau, job->theta_dot, &at, &end);
        s = at, dot = end;
        imp__surface_eval(g->surface, &s.x, &s.v, &sa);
        if (g->surface->event == IMP_BEND_REFRACT ||
            g->surface->event == IMP_BEND_MIRROR) {
            struct imp__bend_turn turn;
            const imp_v3 n = imp__normalize(sa.gx), vd = dot.v;
            const imp_v3 n_dot = normal_dot(g->surface, s.x, sa.gx, dot.x);
            imp__bend_turn(&n, &s.v, g->surface->index,
                           g->surface->event == IMP_BEND_MIRROR, &turn);
            imp__bend_turn_jvp(&turn, &n, &s.v, g->surface->index, &vd, &n_dot, 0,
                               &dot.v);
            s.v = turn.v;
        }
    }
    cotangent_store(&dot, out);
    return IMP_OK;
}

static enum imp_status work(size_t item, int worker, int slot, void *payload)
{
    const struct job *job = payload;
    (void)worker;
    const size_t first = item * CHUNK, last = imp_min(first + CHUNK, job->rays->n);
    for (size_t i = first; i < last; i++) {
        const enum imp_status st = ray_tangent(job, i, &job->tracks[slot]);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

enum imp_status
imp_bend_tangent(const imp_field *field, const struct imp_bend_options *options,
                 const struct imp_bend_rays *rays, const double *theta_dot,
                 const double (*x_dot)[3], const double (*d_dot)[3],
                 struct imp_bend_cotangent *dots, struct imp_bend_cotangent *tap_dots)
{
    IMP_REQUIRE(NULL, field, "field");
    IMP_REQUIRE(field->ctx, rays, "rays");
    struct imp_bend_rays own_rays = IMP_BEND_RAYS_INIT;
    IMP_OPTIONS(field->ctx, own_rays, rays, "rays");
    rays = &own_rays;
    IMP_REQUIRE(field->ctx, dots, "dots");
    if (theta_dot) IMP_FINITE_ALL(field->ctx, theta_dot, field->n_theta, "theta_dot");
    if (x_dot) IMP_FINITE_ALL(field->ctx, x_dot[0], 3 * rays->n, "x_dot");
    if (d_dot) IMP_FINITE_ALL(field->ctx, d_dot[0], 3 * rays->n, "d_dot");
    IMP_FLOAT_MODE;
    struct imp__plan plan;
    enum imp_status st = imp__plan_create(field, options, rays, &plan);
    if (st != IMP_OK) return st;
    const int n_slots = imp__pool_slots(plan.ctx);
    struct job job = {
        &plan, rays, theta_dot, x_dot, d_dot, dots, plan.n_taps > 0 ? tap_dots : NULL,
        NULL};
    job.tracks = imp__alloc(plan.ctx, (size_t)n_slots, sizeof *job.tracks);
    if (!job.tracks) IMP_TRY(imp__error(plan.ctx, IMP_E_NOMEM, "no memory for tangents"));
    const struct imp_loop loop = {
        .n_items = (rays->n + CHUNK - 1) / CHUNK, .work = work, .payload = &job};
    IMP_TRY(imp__parallel(plan.ctx, &loop, NULL));
out:
    for (int i = 0; job.tracks && i < n_slots; i++) imp__track_free(&job.tracks[i]);
    imp__release(plan.ctx, job.tracks);
    imp__plan_destroy(&plan);
    return st;
}

enum imp_status imp_bend_path(const imp_field *field,
                              const struct imp_bend_options *options,
                              const struct imp_bend_rays *rays, size_t ray,
                              double (**points)[4], size_t *n_points,
                              struct imp_bend_exit *exit)
{
    IMP_REQUIRE(NULL, field, "field");
    IMP_REQUIRE(field->ctx, rays, "rays");
    struct imp_bend_rays own_rays = IMP_BEND_RAYS_INIT;
    IMP_OPTIONS(field->ctx, own_rays, rays, "rays");
    rays = &own_rays;
    IMP_REQUIRE(field->ctx, points, "points");
    IMP_REQUIRE(field->ctx, n_points, "n_points");
    IMP_FLOAT_MODE;
    struct imp__plan plan;
    struct imp__track track = {.states = true};
    double(*list)[4] = NULL;
    enum imp_status st = imp__plan_create(field, options, rays, &plan);
    if (st != IMP_OK) return st;
    if (ray >= rays->n) IMP_TRY(imp__error(plan.ctx, IMP_E_ARG, "no ray %zu", ray));
    IMP_TRY(imp__track_ray(&plan, rays, ray, &track));
    list = imp__alloc(plan.ctx, track.n + 2, sizeof *list);
    if (!list) IMP_TRY(imp__error(plan.ctx, IMP_E_NOMEM, "no memory for a path"));
    size_t n = 0;
    if (plan.options.outside) memcpy(list[n++], rays->x[ray], 3 * sizeof(double));
    for (size_t i = 0; i < track.n; i++) {
        imp__v3_store(track.state[i].x, list[n]);
        list[n++][3] = track.state[i].path;
    }
    memcpy(list[n], track.exit.x, 3 * sizeof(double));
    list[n++][3] = track.exit.path;
    if (exit) *exit = track.exit;
    *points = list;
    *n_points = n;
out:
    imp__track_free(&track);
    imp__plan_destroy(&plan);
    return st;
}
