/* SPDX-License-Identifier: Apache-2.0
 *
 * What is kept of a flight, evaluated and differentiated: a product over its events. */
#include "math/exp.h"
#include "tracking.h"

imp_spec imp__attenuation(imp_spec sigma, double t)
{
    return imp__choose_4(sigma > 0, imp__exp_4(-sigma * t), imp__spec(1));
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

void imp__seen_inputs(const struct imp_tracer *tracer, const struct imp_medium *m,
                      const struct imp_texcoord *at, imp_spec *in)
{
    const uint64_t unseen = tracer->active->unseen[m->index];
    for (int j = 0; j < m->n_own; j++)
        if (unseen >> j & 1) in[j] = (imp_spec){0};
        else imp__inputs_eval(&m->input[j], 1, at, &in[j]);
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
    if (e->kind == IMP_RESIDUAL_AT) {
        x.f = imp__residual(sigma, e);
        x.slope = imp__spec(-1 / (double)e->bound);
        return x;
    }
    if (e->kind == IMP_DELTA_AT) {
        const double over = 1 / (double)e->bound;
        x.f = (1 - sigma * over) * imp__delta_weight(e);
        x.slope = -over * imp__delta_weight(e);
        return x;
    }
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

/* ---- Surfaces that light samples pass ------------------------------------------------ */

/* Where the surface was passed. */
static struct imp_texcoord passed_at(const struct imp_shape *shape,
                                     const struct imp_track *track,
                                     const struct imp_event *e,
                                     const struct imp_carried *carried)
{
    return (struct imp_texcoord){.uv = {e[1].t, e[1].bound},
                                 .p = event_place(track, e),
                                 .carried = carried,
                                 .shape = shape,
                                 .prim = e[1].medium};
}
/* Lobe by lobe, directions in its frame, about the normal as one likes. */
static struct imp_dirs passed_dirs(const struct imp_event *e, int lobe)
{
    const double c = imp_clamp((double)e->bound, -1.0, 1.0);
    const imp_v3 wo = {sqrt(1 - c * c), 0, c, 0};
    return (struct imp_dirs){.wo = wo, .wi = -wo, .lobe = lobe};
}

imp_spec imp__passes_eval(const struct imp_scene *scene, const struct imp_track *track,
                          const struct imp_event *e, const struct imp_carried *carried)
{
    const struct imp_shape *shape = scene->shapes[e->medium];
    const struct imp_bsdf *b = imp__shape_bsdf(scene, shape);
    const struct imp_texcoord at = passed_at(shape, track, e, carried);
    imp_spec in[IMP_INPUTS_MAX], f, sum = {0};
    imp__evaluate_inputs(b, shape, &at, in);
    for (int l = 0; l < 64; l++) {
        if (!(b->straight >> l & 1)) continue;
        const struct imp_dirs dirs = passed_dirs(e, l);
        imp__bsdf_eval(b, carried, in, &dirs, &f);
        sum += f;
    }
    return sum;
}

/* Its derivatives with respect to the inputs of the material, d [n_in]. NULL: nobody wants
 * them. */
static const struct imp_bsdf *passes_d(const struct imp_tracer *tracer,
                                       const struct imp_event *e,
                                       const struct imp_texcoord *at, imp_spec *d)
{
    const struct imp_shape *shape = tracer->scene->shapes[e->medium];
    const struct imp_bsdf *b = imp__shape_bsdf(tracer->scene, shape);
    imp_spec in[IMP_INPUTS_MAX], of_lobe[IMP_INPUTS_MAX];
    if (b->index < 0 || !tracer->active->bsdf[b->index]) return NULL;
    imp__evaluate_inputs(b, shape, at, in);
    for (int j = 0; j < b->n_in; j++) d[j] = (imp_spec){0};
    for (int l = 0; l < 64; l++) {
        if (!(b->straight >> l & 1)) continue;
        const struct imp_dirs dirs = passed_dirs(e, l);
        imp__bsdf_eval_d(b, at->carried, in, &dirs, of_lobe);
        for (int j = 0; j < b->n_in; j++) d[j] += of_lobe[j];
    }
    return b;
}

/* ---- Products over the events --------------------------------------------------------- */

static imp_spec event_factor(const struct imp_scene *scene, const struct imp_track *track,
                             const struct imp_event *e, const struct imp_carried *carried)
{
    imp_spec in[IMP_INPUTS_MAX];
    if (e->kind == IMP_PASSES) return imp__passes_eval(scene, track, e, carried);
    if (e->kind == IMP_CONTROL) return imp__spec(exp(-(double)e->t));
    if (e->kind == IMP_PASSES_UV || e->kind == IMP_RESIDUAL_OF ||
        e->kind == IMP_DELTA_OF || e->kind == IMP_LINE_AT)
        return imp__spec(1);
    const imp_spec sigma =
        imp__extinction_at(scene->media[e->medium], event_place(track, e), carried, in);
    return factor_of(e, sigma, false).f;
}

imp_spec imp__track_eval(const struct imp_scene *scene, const struct imp_track *track,
                         const struct imp_carried *carried)
{
    imp_spec f = imp__spec(1);
    for (int i = 0; i < track->n; i++)
        f *= event_factor(scene, track, &track->event[i], carried);
    return f;
}

imp_spec imp__track_depth(const struct imp_scene *scene, const struct imp_track *track,
                          const struct imp_carried *carried)
{
    imp_spec depth = {0}, in[IMP_INPUTS_MAX];
    for (int i = 0; i < track->n; i++) {
        const struct imp_event *e = &track->event[i];
        if (e->kind == IMP_CROSSES)
            depth += imp__extinction_at(scene->media[e->medium], event_place(track, e),
                                        carried, in) *
                     (double)e->t;
    }
    return depth;
}

imp_spec imp__track_density(const struct imp_scene *scene, const struct imp_track *track,
                            const struct imp_carried *carried, double least)
{
    imp_spec p = imp__spec(1);
    for (int i = 0; i < track->n; i++) {
        const struct imp_event *e = &track->event[i];
        imp_spec f = event_factor(scene, track, e, carried);
        for (int c = 0; least > 0 && c < 4; c++) {
            if (e->kind == IMP_REAL_AT) f[c] = imp_max(least, f[c]);
            else if (e->kind == IMP_NULL_AT) f[c] = imp_min(1 - least, f[c]);
        }
        p *= f;
    }
    return p;
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
    for (int i = 0; i < track->n; i++) {
        const imp_spec f = event_factor(scene, track, &track->event[i], carried);
        for (int c = 0; c < 4; c++)
            if (f[c] == 0) p.zeros[c]++;
            else p.rest[c] *= f[c];
    }
    return p;
}
/* The product of all factors but this one. */
static imp_spec others(const struct product *p, imp_spec f)
{
    imp_spec x;
    for (int c = 0; c < 4; c++)
        x[c] = p->zeros[c] == 0   ? p->rest[c] / f[c]
               : p->zeros[c] == 1 ? (f[c] == 0 ? p->rest[c] : 0)
                                  : 0;
    return x;
}

/* How the product is differentiated. */
struct derived {
    const struct imp_tracer *tracer;
    const struct imp_track *track;
    const struct imp_carried *carried;
    const imp_spec *value; /* the product, of the way to a light sample; else NULL */
    bool apart;            /* `p` is set: factors may be 0 */
    struct product p;
};

/* Is the factor of an event in a medium differentiated as it is? To a light sample it does
 * not matter for uniform media: nothing is drawn. */
static bool fixed(const struct derived *x, const struct imp_event *e)
{
    return (e->kind <= IMP_REAL_AT || e->kind == IMP_RESIDUAL_AT ||
            e->kind == IMP_DELTA_AT) &&
           (x->tracer->collisions_fixed || (e->kind <= IMP_COLLIDES && e->bound > 0));
}

/* Factors of the events that surfaces have are differentiated as they are, and those of
 * tentative collisions where these are fixed; else IMP_LINE_AT takes their place. */
static bool apart(const struct derived *x)
{
    if (x->tracer->collisions_fixed) return true;
    for (int i = 0; i < x->track->n; i++)
        if (x->track->event[i].kind == IMP_PASSES || fixed(x, &x->track->event[i]))
            return true;
    return false;
}

bool imp__track_counts(const struct imp_tracer *tracer, const struct imp_track *track)
{
    const struct derived x = {.tracer = tracer, .track = track};
    return apart(&x);
}

static bool derived_of(const struct imp_tracer *tracer, const struct imp_track *track,
                       const struct imp_carried *carried, const imp_spec *value,
                       struct derived *x)
{
    *x = (struct derived){
        .tracer = tracer, .track = track, .carried = carried, .value = value};
    x->apart = apart(x);
    if (!x->apart) return tracer->active->medium && value;
    x->p = product_of(tracer->scene, track, carried);
    return true;
}

/* d product/d extinction of event i; in: its medium's inputs there. False: it is 0. */
static bool extinction_slope(const struct derived *x, const struct imp_event *e,
                             const struct imp_texcoord *at, imp_spec *in, imp_spec *slope)
{
    const struct imp_medium *m = x->tracer->scene->media[e->medium];
    const bool as_is = fixed(x, e);
    if (!as_is && e->kind != IMP_LINE_AT && (e->kind != IMP_CROSSES || !x->value))
        return false;
    if (as_is) {
        const imp_spec sigma = imp__extinction_at(m, at->p, x->carried, in);
        const struct factor f = factor_of(e, sigma, true);
        *slope = f.slope * others(&x->p, f.f);
    } else {
        const double l = e->kind == IMP_LINE_AT ? e->bound : e->t;
        imp__seen_inputs(x->tracer, m, at, in);
        *slope = *x->value * (isfinite(l) ? -l : 0); /* there T is 0, or no path is */
    }
    return true;
}

/* Inputs that the factor of event i depends on, how many, and d product/d each of them.
 * NULL: nobody wants these. */
static const struct imp_input *const *
event_d(const struct derived *x, int i, struct imp_texcoord *at, int *n, imp_spec *d)
{
    const struct imp_active *active = x->tracer->active;
    const struct imp_event *e = &x->track->event[i];
    if (e->kind == IMP_PASSES_UV || e->kind == IMP_RESIDUAL_OF ||
        e->kind == IMP_DELTA_OF || e->kind == IMP_CONTROL)
        return NULL;
    if (!x->apart && e->kind != IMP_LINE_AT && e->kind != IMP_CROSSES) return NULL;
    if (e->kind == IMP_PASSES) {
        *at = passed_at(x->tracer->scene->shapes[e->medium], x->track, e, x->carried);
        const struct imp_bsdf *b = passes_d(x->tracer, e, at, d);
        if (!b) return NULL;
        const imp_spec rest =
            others(&x->p, imp__passes_eval(x->tracer->scene, x->track, e, x->carried));
        for (int j = 0; j < b->n_in; j++) d[j] *= rest;
        *n = b->n_in;
        return b->input;
    }
    const struct imp_medium *m = x->tracer->scene->media[e->medium];
    struct imp_coefficients dc[IMP_INPUTS_MAX];
    imp_spec in[IMP_INPUTS_MAX], slope;
    if (!active->medium || !active->medium[e->medium]) return NULL;
    *at = (struct imp_texcoord){.p = event_place(x->track, e), .carried = x->carried};
    if (!extinction_slope(x, e, at, in, &slope)) return NULL;
    m->ops->eval_d(m, in, dc);
    for (int j = 0; j < m->n_own; j++)
        d[j] = m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION ? dc[j].extinction * slope
                                                              : (imp_spec){0};
    *n = m->n_own;
    return m->input;
}

void imp__track_sweep(const struct imp_tracer *tracer, const struct imp_track *track,
                      const struct imp_carried *carried, const imp_spec *value,
                      imp_spec f_bar, struct imp_sink *sink)
{
    struct derived x;
    if (!derived_of(tracer, track, carried, value, &x)) return;
    for (int i = 0; i < track->n; i++) {
        struct imp_texcoord at;
        imp_spec d[IMP_INPUTS_MAX];
        int n;
        const struct imp_input *const *input = event_d(&x, i, &at, &n, d);
        if (!input) continue;
        for (int j = 0; j < n; j++) {
            d[j] *= f_bar;
            if (!imp__is_zero_used(d[j], true))
                imp__inputs_scatter(&input[j], 1, &at, &d[j], sink);
        }
    }
}

imp_spec imp__track_tangent(const struct imp_tracer *tracer,
                            const struct imp_track *track,
                            const struct imp_carried *carried, const imp_spec *value,
                            double (*dot)(const void *x_dot, int param, size_t element),
                            const void *x_dot)
{
    imp_spec f_dot = {0};
    struct derived x;
    if (!derived_of(tracer, track, carried, value, &x)) return f_dot;
    for (int i = 0; i < track->n; i++) {
        struct imp_texcoord at;
        imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX];
        int n;
        const struct imp_input *const *input = event_d(&x, i, &at, &n, d);
        if (!input) continue;
        imp__inputs_tangent(input, n, &at, dot, x_dot, in_dot);
        for (int j = 0; j < n; j++) f_dot += d[j] * in_dot[j];
    }
    return f_dot;
}
