/* SPDX-License-Identifier: Apache-2.0
 *
 * Several wavelengths in one problem. The field is one material of varying density; at
 * wavelength lambda the index is
 *     eta_lambda(x) = 1 + k (eta(x) - 1),  k = (n(lambda) - 1)/(n(reference) - 1)
 * with n of the material's formula. Gases follow this exactly (n - 1 is proportional to
 * density, Gladstone and Dale 1863), polymers and glasses of one family nearly. It is
 * linear in the numbers of the field, so value, gradient, Hessian and transposes are k
 * times those of the field. */
#include "base/arguments.h"
#include "bend_problem.h"

double imp_dispersion_index(const struct imp_dispersion *dispersion, double um)
{
    struct imp_dispersion own = IMP_DISPERSION_INIT, *const d = &own;
    if (!dispersion || imp__options_take(NULL, __func__, "d", dispersion, d, sizeof own))
        return NAN;
    const double l2 = um * um, *c = d->coefficient;
    double n2 = 1;
    if (d->model == IMP_CAUCHY) return c[0] + c[1] / l2 + c[2] / (l2 * l2);
    for (int k = 0; k < 3; k++) n2 += c[k] * l2 / (l2 - c[3 + k]);
    return n2 > 0 ? sqrt(n2) : NAN;
}

/* ---- A field at another wavelength --------------------------------------------- */

static const imp_field *inner(const imp_field *f)
{
    return ((const struct imp__scaled *)f)->of;
}
static double factor(const imp_field *f) { return ((const struct imp__scaled *)f)->k; }

static void scaled_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                        struct imp__jet *jet)
{
    const double k = factor(f);
    inner(f)->ops->eval(inner(f), n, x, order, jet);
    for (int i = 0; i < n; i++) {
        jet[i].eta = 1 + k * (jet[i].eta - 1);
        jet[i].g *= k;
        if (order > 1)
            for (int a = 0; a < 3; a++) jet[i].h[a] *= k;
    }
}
static void scaled_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                         struct imp__bar *bar)
{
    const imp_v3 kb = factor(f) * *b;
    inner(f)->ops->splat(inner(f), x, factor(f) * a, &kb, bar);
}
static void scaled_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                           double *eta_dot, imp_v3 *g_dot)
{
    inner(f)->ops->tangent(inner(f), x, theta_dot, eta_dot, g_dot);
    *eta_dot *= factor(f);
    *g_dot *= factor(f);
}
static void scaled_changed(imp_field *f)
{
    imp_field *of = ((struct imp__scaled *)f)->of;
    if (of->ops->changed) of->ops->changed(of);
}
static void scaled_moved(imp_field *f)
{
    imp_field *of = ((struct imp__scaled *)f)->of;
    of->theta = f->theta;
    if (of->ops->moved) of->ops->moved(of);
}
static void scaled_destroy(imp_field *f)
{
    imp_field *of = ((struct imp__scaled *)f)->of;
    of->borrowed = true; /* its theta is released with the scaled field */
    imp_field_destroy(of);
}
static const char *scaled_param_name(const imp_field *f, size_t i)
{
    return imp_field_param_name(inner(f), i);
}

static const struct imp__field_ops scaled_ops = {.name = "scaled",
                                                 .eval = scaled_eval,
                                                 .splat = scaled_splat,
                                                 .tangent = scaled_tangent,
                                                 .changed = scaled_changed,
                                                 .destroy = scaled_destroy,
                                                 .moved = scaled_moved,
                                                 .param_name = scaled_param_name};

void imp__scaled_init(struct imp__scaled *s, imp_field *of, double k)
{
    *s = (struct imp__scaled){.base = *of, .of = of, .k = k};
    s->base.ops = &scaled_ops;
    s->base.borrowed = true;
}

enum imp_status imp_field_scaled_create(imp_context *ctx, imp_field *of, double k,
                                        imp_field **out)
{
    struct imp__scaled *s = NULL;
    if (!ctx || !of || !out) {
        imp_field_destroy(of);
        return imp__argument_missing(ctx, __func__,
                                     !ctx  ? "context"
                                     : !of ? "field"
                                           : "out");
    }
    if (k > 0 && isfinite(k)) s = imp__alloc(ctx, 1, sizeof *s);
    if (!s) {
        imp_field_destroy(of);
        return k > 0 && isfinite(k)
                   ? imp__error(ctx, IMP_E_NOMEM, "no memory for an index field")
                   : imp__error(ctx, IMP_E_ARG, "a field scaled by k = %g", k);
    }
    imp__scaled_init(s, of, k);
    imp__context_hold(ctx);
    s->base.borrowed = of->borrowed;
    *out = &s->base;
    return IMP_OK;
}

/* ---- Bundles with wavelengths -------------------------------------------------- */

enum imp_status imp_bend_set_wavelength(imp_bend *b, int bundle,
                                        const struct imp_dispersion *dispersion,
                                        double um)
{
    struct imp_dispersion own = IMP_DISPERSION_INIT, *const d = &own;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, dispersion, "d");
    IMP_OPTIONS(b->ctx, own, dispersion, "d");
    IMP_FINITE_ALL(b->ctx, own.coefficient, 6, "d->coefficient");
    IMP_FINITE(b->ctx, own.reference, "d->reference");
    IMP_FINITE(b->ctx, um, "um");
    IMP_FLOAT_MODE;
    if (bundle < 0 || bundle >= b->n_bundles)
        return imp__error(b->ctx, IMP_E_ARG, "bundle %d: there are %d", bundle,
                          b->n_bundles);
    const double n = um > 0 ? imp_dispersion_index(d, um) : NAN,
                 n0 = imp_dispersion_index(d, d->reference), k = (n - 1) / (n0 - 1);
    if (!(k > 0) || !isfinite(k))
        return imp__error(b->ctx, IMP_E_ARG,
                          "no dispersion: index %g at %g um, %g at the reference, %g um",
                          n, um, n0, d->reference);
    const size_t old = b->cap_dispersion, n_bundles = (size_t)b->n_bundles;
    double *grown =
        imp__grow(b->ctx, b->dispersion, &b->cap_dispersion, n_bundles, sizeof *grown);
    if (grown) {
        b->dispersion = grown;
        for (size_t i = old; i < b->cap_dispersion; i++) grown[i] = 1;
    }
    double *um_grown = imp__grow(b->ctx, b->um, &b->cap_um, n_bundles, sizeof *b->um);
    if (um_grown) b->um = um_grown;
    if (!grown || !um_grown)
        return imp__error(b->ctx, IMP_E_NOMEM, "no memory for wavelengths");
    grown[bundle] = k;
    b->um[bundle] = um;
    return IMP_OK;
}

double imp_bend_wavelength(const imp_bend *b, int bundle)
{
    IMP_REQUIRE_OR(NULL, b, "bend", 0);
    return bundle >= 0 && (size_t)bundle < b->cap_um ? b->um[bundle] : 0;
}

double imp__bend_factor(const imp_bend *b, const struct imp_bend_rays *rays, size_t i)
{
    const size_t group = (size_t)imp__ray_group(rays, i);
    return group < b->cap_dispersion ? b->dispersion[group] : 1;
}

/* One past the last of the rays from `first` on that have the same factor k. */
static size_t run_end(const imp_bend *b, const struct imp_bend_rays *rays, size_t first)
{
    if (!b->dispersion) return rays->n;
    const double k = imp__bend_factor(b, rays, first);
    size_t i = first + 1;
    while (i < rays->n && imp__bend_factor(b, rays, i) == k) i++;
    return i;
}
static struct imp_bend_rays run_rays(const struct imp_bend_rays *r, size_t first,
                                     size_t last)
{
    return (struct imp_bend_rays){.size = sizeof(struct imp_bend_rays),
                                  .n = last - first,
                                  .x = r->x + first,
                                  .d = r->d + first,
                                  .group = r->group ? r->group + first : NULL};
}
static void stats_add(struct imp_bend_stats *sum, const struct imp_bend_stats *s)
{
    sum->rays += s->rays, sum->traced += s->traced, sum->steps += s->steps;
    sum->truncated += s->truncated, sum->missed += s->missed;
    sum->started_out += s->started_out, sum->grazing += s->grazing;
    sum->broken += s->broken, sum->energy += s->energy;
    sum->reflected += s->reflected, sum->taps_missed += s->taps_missed;
    sum->reversal += s->reversal;
    sum->worst_energy = fmax(sum->worst_energy, s->worst_energy);
    sum->worst_reversal = fmax(sum->worst_reversal, s->worst_reversal);
}

enum imp_status
imp__bundles_trace(const imp_bend *b, imp_field *field, const struct imp_bend_options *o,
                   const struct imp_bend_rays *rays, struct imp_bend_exit *exits,
                   struct imp_bend_exit *taps, struct imp_bend_stats *stats)
{
    struct imp_bend_stats sum = IMP_BEND_STATS_INIT;
    enum imp_status st = IMP_OK;
    if (!b->dispersion) return imp_bend_trace(field, o, rays, exits, taps, stats);
    for (size_t first = 0, last; first < rays->n && st == IMP_OK; first = last) {
        struct imp__scaled at;
        struct imp_bend_stats s = IMP_BEND_STATS_INIT;
        last = run_end(b, rays, first);
        const struct imp_bend_rays r = run_rays(rays, first, last);
        imp__scaled_init(&at, field, imp__bend_factor(b, rays, first));
        st = imp_bend_trace(&at.base, o, &r, exits + first,
                            taps ? taps + first * o->n_taps : NULL, &s);
        stats_add(&sum, &s);
    }
    if (st == IMP_OK && stats) *stats = sum;
    return st;
}

enum imp_status imp__bundles_adjoint(const imp_bend *b, const struct imp_bend_options *o,
                                     const struct imp_bend_rays *rays,
                                     const struct imp_bend_exit *exits,
                                     const struct imp_bend_exit *taps,
                                     const struct imp_bend_cotangent *bars,
                                     const struct imp_bend_cotangent *tap_bars,
                                     double *theta, struct imp_bend_stats *stats)
{
    struct imp_bend_stats sum = IMP_BEND_STATS_INIT;
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    enum imp_status st = IMP_OK;
    const size_t n = b->field->n_theta;
    double *own = NULL;
    g.theta = theta;
    if (!b->dispersion)
        return imp_bend_adjoint(b->field, o, rays, exits, taps, bars, tap_bars, &g,
                                stats);
    own = imp__alloc(b->ctx, n + 1, sizeof *own);
    if (!own) return imp__error(b->ctx, IMP_E_NOMEM, "no memory for a gradient");
    g.theta = own;
    for (size_t i = 0; i < n; i++) theta[i] = 0;
    for (size_t first = 0, last; first < rays->n && st == IMP_OK; first = last) {
        struct imp__scaled at;
        struct imp_bend_stats s = IMP_BEND_STATS_INIT;
        last = run_end(b, rays, first);
        const struct imp_bend_rays r = run_rays(rays, first, last);
        imp__scaled_init(&at, b->field, imp__bend_factor(b, rays, first));
        st = imp_bend_adjoint(&at.base, o, &r, exits + first,
                              taps ? taps + first * o->n_taps : NULL, bars + first,
                              tap_bars ? tap_bars + first * o->n_taps : NULL, &g, &s);
        for (size_t i = 0; i < n; i++) theta[i] += own[i];
        stats_add(&sum, &s);
    }
    if (st == IMP_OK && stats) *stats = sum;
    imp__release(b->ctx, own);
    return st;
}

enum imp_status imp__bundles_tangent(const imp_bend *b, const struct imp_bend_options *o,
                                     const struct imp_bend_rays *rays,
                                     const double *theta_dot,
                                     struct imp_bend_cotangent *dots)
{
    enum imp_status st = IMP_OK;
    for (size_t first = 0, last; first < rays->n && st == IMP_OK; first = last) {
        struct imp__scaled at;
        last = run_end(b, rays, first);
        const struct imp_bend_rays r = run_rays(rays, first, last);
        imp__scaled_init(&at, b->field, imp__bend_factor(b, rays, first));
        st = imp_bend_tangent(b->dispersion ? &at.base : b->field, o, &r, theta_dot, NULL,
                              NULL, dots + first, NULL);
    }
    return st;
}

enum imp_status imp_bend_ray(imp_bend *b, size_t ray, double (**points)[4], size_t *n)
{
    struct imp_bend_options o;
    struct imp__scaled at;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, points, "points");
    IMP_REQUIRE(b->ctx, n, "n_points");
    const struct imp_bend_rays rays = imp__bend_rays(b);
    if (ray >= b->n) return imp__error(b->ctx, IMP_E_ARG, "no ray %zu", ray);
    const enum imp_status st = imp__bend_options_ready(b, &o);
    if (st != IMP_OK) return st;
    o.n_taps = 0;
    imp__scaled_init(&at, b->field, imp__bend_factor(b, &rays, ray));
    return imp_bend_path(b->dispersion ? &at.base : b->field, &o, &rays, ray, points, n,
                         NULL);
}
