/* SPDX-License-Identifier: Apache-2.0
 *
 * What is kept of a flight, evaluated and differentiated: a product over its events. */
#include "tracking.h"

imp_spec imp__attenuation(imp_spec sigma, double t)
{
    imp_spec T;
    for (int c = 0; c < 4; c++)
        T[c] = c > 0 && sigma[c] == sigma[0] ? T[0]
               : sigma[c] > 0                ? exp(-sigma[c] * t)
                                             : 1;
    return T;
}

imp_spec imp__extinction_at(const struct imp_medium *m, imp_v3 p,
                            const struct imp_carried *carried, imp_spec *in)
{
    const struct imp_texcoord at = {.p = p, .carried = carried};
    struct imp_coefficients c;
    for (int j = 0; j < m->n_own; j++)
        if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)
            imp__inputs_eval(&m->input[j], 1, &at, &in[j]);
        else in[j] = (imp_spec){0};
    m->ops->eval(m, in, &c);
    return c.extinction;
}

/* An event's factor, and its derivative with respect to the extinction there. */
struct factor {
    imp_spec f, slope;
};

static imp_v3 event_place(const struct imp_track *track, const struct imp_event *e)
{
    const imp_v3 o = imp__decided_v3(track->o);
    return e->kind < IMP_NULL_AT ? o : o + imp__decided_v3(track->d) * (double)e->t;
}

static struct factor factor_of(const struct imp_event *e, imp_spec sigma, bool derivative)
{
    struct factor x = {{0}, {0}};
    if (e->kind == IMP_NULL_AT || e->kind == IMP_REAL_AT) {
        const double over = 1 / (double)e->bound, sign = e->kind == IMP_REAL_AT ? 1 : -1;
        x.f = sigma * over;
        if (e->kind == IMP_NULL_AT) x.f = 1 - x.f;
        x.slope = imp__spec(sign * over);
        return x;
    }
    const imp_spec T = imp__attenuation(sigma, e->t);
    x.f = e->kind == IMP_COLLIDES ? sigma * T : T;
    if (!derivative) return x;
    for (int c = 0; c < 4; c++) {
        const double t =
            isfinite(e->t) ? (double)e->t : 0; /* there T is 0, or no path is */
        x.slope[c] = e->kind == IMP_COLLIDES ? T[c] * (1 - sigma[c] * t) : -t * T[c];
    }
    return x;
}

imp_spec imp__track_eval(const struct imp_scene *scene, const struct imp_track *track,
                         const struct imp_carried *carried)
{
    imp_spec f = imp__spec(1), in[IMP_INPUTS_MAX];
    for (int i = 0; i < track->n; i++) {
        const struct imp_event *e = &track->event[i];
        const imp_spec sigma = imp__extinction_at(scene->media[e->medium],
                                                  event_place(track, e), carried, in);
        f *= factor_of(e, sigma, false).f;
    }
    return f;
}

/* Product of the factors that are not 0, and how many are. */
struct product {
    imp_spec rest;
    int zeros[4];
};

static struct product product_of(const struct imp_scene *scene,
                                 const struct imp_track *track,
                                 const struct imp_carried *carried)
{
    struct product p = {.rest = imp__spec(1)};
    imp_spec in[IMP_INPUTS_MAX];
    for (int i = 0; i < track->n; i++) {
        const struct imp_event *e = &track->event[i];
        const imp_spec sigma = imp__extinction_at(scene->media[e->medium],
                                                  event_place(track, e), carried, in);
        const imp_spec f = factor_of(e, sigma, false).f;
        for (int c = 0; c < 4; c++)
            if (f[c] == 0) p.zeros[c]++;
            else p.rest[c] *= f[c];
    }
    return p;
}
/* Of all factors but this one. */
static imp_spec others(const struct product *p, imp_spec f)
{
    imp_spec x;
    for (int c = 0; c < 4; c++)
        x[c] = p->zeros[c] == 0   ? p->rest[c] / f[c]
               : p->zeros[c] == 1 ? (f[c] == 0 ? p->rest[c] : 0)
                                  : 0;
    return x;
}

/* d f/d in[j] of event i, for all n_own inputs of its medium. False: it has none. */
static bool event_d(const struct imp_tracer *tracer, const struct imp_track *track, int i,
                    const struct imp_carried *carried, const struct product *p,
                    struct imp_texcoord *at, imp_spec *d)
{
    const struct imp_event *e = &track->event[i];
    const struct imp_medium *m = tracer->scene->media[e->medium];
    struct imp_coefficients dc[IMP_INPUTS_MAX];
    imp_spec in[IMP_INPUTS_MAX];
    if (!tracer->active->medium || !tracer->active->medium[e->medium]) return false;
    *at = (struct imp_texcoord){.p = event_place(track, e), .carried = carried};
    const imp_spec sigma = imp__extinction_at(m, at->p, carried, in);
    const struct factor x = factor_of(e, sigma, true);
    const imp_spec slope = x.slope * others(p, x.f);
    m->ops->eval_d(m, in, dc);
    for (int j = 0; j < m->n_own; j++)
        d[j] = m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION ? dc[j].extinction * slope
                                                              : (imp_spec){0};
    return true;
}

void imp__track_sweep(const struct imp_tracer *tracer, const struct imp_track *track,
                      const struct imp_carried *carried, imp_spec f_bar,
                      struct imp_sink *sink)
{
    if (!tracer->active->medium) return;
    const struct product p = product_of(tracer->scene, track, carried);
    for (int i = 0; i < track->n; i++) {
        const struct imp_medium *m = tracer->scene->media[track->event[i].medium];
        struct imp_texcoord at;
        imp_spec d[IMP_INPUTS_MAX];
        if (!event_d(tracer, track, i, carried, &p, &at, d)) continue;
        for (int j = 0; j < m->n_own; j++) {
            d[j] *= f_bar;
            if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)
                imp__inputs_scatter(&m->input[j], 1, &at, &d[j], sink);
        }
    }
}

imp_spec imp__track_tangent(const struct imp_tracer *tracer,
                            const struct imp_track *track,
                            const struct imp_carried *carried,
                            double (*dot)(const void *x_dot, int param, size_t element),
                            const void *x_dot)
{
    imp_spec f_dot = {0};
    if (!tracer->active->medium) return f_dot;
    const struct product p = product_of(tracer->scene, track, carried);
    for (int i = 0; i < track->n; i++) {
        const struct imp_medium *m = tracer->scene->media[track->event[i].medium];
        struct imp_texcoord at;
        imp_spec d[IMP_INPUTS_MAX], in_dot;
        if (!event_d(tracer, track, i, carried, &p, &at, d)) continue;
        for (int j = 0; j < m->n_own; j++) {
            if (!(m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)) continue;
            imp__inputs_tangent(&m->input[j], 1, &at, dot, x_dot, &in_dot);
            f_dot += d[j] * in_dot;
        }
    }
    return f_dot;
}
