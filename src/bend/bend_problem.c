/* SPDX-License-Identifier: Apache-2.0
 *
 * Making a problem of bent rays. */
#include "bend_problem.h"
#include <string.h>

#define RAYS_MAX   ((size_t)1 << 31)
#define PIXELS_MAX ((size_t)1 << 26)

enum imp_status imp_bend_create(imp_context *ctx, imp_field *field, imp_bend **out)
{
    if (!ctx || !field || !out) {
        imp_field_destroy(field);
        return imp__argument_missing(ctx, __func__,
                                     !ctx     ? "context"
                                     : !field ? "field"
                                              : "out");
    }
    imp_bend *b = imp__alloc(ctx, 1, sizeof *b);
    if (!b) {
        imp_field_destroy(field);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for a problem of bent rays");
    }
    b->ctx = ctx;
    imp__context_hold(ctx);
    b->field = field;
    b->options = (struct imp_bend_options)IMP_BEND_OPTIONS_INIT;
    b->lo = 1, b->hi = INFINITY;
    const uint32_t *number;
    const struct imp__grid *g = imp__field_nodes(field, &number);
    b->step_cells = g && g->desc.interp == IMP_FIELD_TRILINEAR ? 0.5 : 1;
    *out = b;
    return IMP_OK;
}

void imp_bend_destroy(imp_bend *b)
{
    if (!b) return;
    imp_context *ctx = b->ctx;
    for (size_t i = 0; i < b->n_targets; i++) {
        imp__release(ctx, b->targets[i].data);
        imp__release(ctx, b->targets[i].pixels);
    }
    for (size_t i = 0; i < b->n_sdfs; i++) imp_field_destroy(b->sdfs[i]);
    for (size_t i = 0; i < b->n_scenes; i++) imp_scene_destroy(b->scenes[i]);
    void *const owned[] = {
        b->surfaces,     b->taps,    b->x,          b->d,       b->power, b->group,
        b->bundle_first, b->targets, b->holds,      b->smooths, b->sdfs,  b->scenes,
        b->history,      b->rows,    b->dispersion, b->um};
    for (size_t i = 0; i < imp_count(owned); i++) imp__release(ctx, owned[i]);
    imp_field_destroy(b->field);
    imp__release(ctx, b);
    imp__context_drop(ctx);
}

imp_field *imp_bend_field(imp_bend *b) { return b ? b->field : NULL; }
size_t imp_bend_n_rays(const imp_bend *b) { return b ? b->n : 0; }
int imp_bend_n_bundles(const imp_bend *b) { return b ? b->n_bundles : 0; }
size_t imp_bend_n_targets(const imp_bend *b) { return b ? b->n_targets : 0; }
enum imp_status imp_bend_get_rays(const imp_bend *b, struct imp_bend_rays *r)
{
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, r, "rays");
    const struct imp_bend_rays all = imp__bend_rays(b);
    IMP_GIVE(b->ctx, r, all, "rays");
    return IMP_OK;
}

enum imp_status imp_bend_get_target(const imp_bend *b, size_t i,
                                    struct imp_bend_target *t)
{
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, t, "target");
    if (i >= b->n_targets) return imp__error(b->ctx, IMP_E_ARG, "no target %zu", i);
    IMP_GIVE(b->ctx, t, b->targets[i].desc, "target");
    return IMP_OK;
}

enum imp_status imp_bend_set_options(imp_bend *b, const struct imp_bend_options *options)
{
    struct imp_bend_options own = IMP_BEND_OPTIONS_INIT, *const o = &own;
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, b, "bend");
    imp_context *ctx = b->ctx;
    IMP_REQUIRE(ctx, options, "o");
    IMP_CHECKED(imp__bend_options_take(ctx, __func__, "o", options, o));
    struct imp_bend_surface *s = imp__alloc(ctx, o->n_surfaces + 1, sizeof *s);
    struct imp_bend_tap *t = imp__alloc(ctx, o->n_taps + 1, sizeof *t);
    if (!s || !t) {
        imp__release(ctx, s), imp__release(ctx, t);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for surfaces");
    }
    for (size_t i = 0; i < o->n_surfaces; i++) {
        s[i] = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
        IMP_TRY(imp__element_take(ctx, __func__, "surfaces", o->surfaces, i, &s[i],
                                  sizeof *s));
    }
    for (size_t i = 0; i < o->n_taps; i++) {
        t[i] = (struct imp_bend_tap)IMP_BEND_TAP_INIT;
        IMP_TRY(imp__element_take(ctx, __func__, "taps", o->taps, i, &t[i], sizeof *t));
    }
    imp__release(ctx, b->surfaces), imp__release(ctx, b->taps);
    b->surfaces = s, b->taps = t;
    b->options = *o;
    b->options.surfaces = s, b->options.taps = t;
    return IMP_OK;
out:
    imp__release(ctx, s), imp__release(ctx, t);
    return st;
}

void imp_bend_set_progress(imp_bend *b, imp_progress_fn progress, void *payload)
{
    IMP_REQUIRE_OR(NULL, b, "bend", );
    b->options.progress = progress;
    b->options.progress_payload = payload;
}

enum imp_status imp_bend_set_step(imp_bend *b, double cells, double most)
{
    IMP_REQUIRE(NULL, b, "bend");
    if (!(cells >= 0) || !(most >= 0) || !isfinite(cells) || !isfinite(most))
        return imp__error(b->ctx, IMP_E_ARG,
                          "%s: cells %g and most %g must be numbers >= 0", __func__,
                          cells, most);
    b->step_cells = cells;
    b->step_max = most;
    return IMP_OK;
}

void imp__bend_options(const imp_bend *b, struct imp_bend_options *o)
{
    *o = b->options;
    if (o->step > 0) return;
    const double cells = b->field->spacing > 0 ? b->step_cells * b->field->spacing : 0;
    o->step = cells > 0 && b->step_max > 0 ? fmin(cells, b->step_max)
              : b->step_max > 0            ? b->step_max
                                           : cells;
}

enum imp_status imp_bend_get_options(const imp_bend *b, struct imp_bend_options *o)
{
    struct imp_bend_options all;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, o, "o");
    IMP_CHECKED(imp__bend_options_ready(b, &all));
    IMP_GIVE(b->ctx, o, all, "o");
    return IMP_OK;
}

enum imp_status imp__bend_options_ready(const imp_bend *b, struct imp_bend_options *o)
{
    imp__bend_options(b, o);
    return o->step > 0 ? IMP_OK
                       : imp__error(b->ctx, IMP_E_ARG,
                                    "a %s field has no cells to choose a "
                                    "step by: give one",
                                    b->field->ops->name);
}

static bool room(imp_context *ctx, void *array, size_t *capacity, size_t n, size_t size)
{
    void **p = array;
    void *grown = imp__grow(ctx, *p, capacity, n, size);
    if (grown) *p = grown;
    return grown != NULL;
}

enum imp_status imp_bend_add_rays(imp_bend *b, size_t n, const double (*x)[3],
                                  const double (*d)[3], const double *power, int *bundle)
{
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, x, "x");
    IMP_REQUIRE(b->ctx, d, "d");
    const size_t total = b->n + n;
    if (n == 0 || n > RAYS_MAX || total > RAYS_MAX)
        return imp__error(b->ctx, IMP_E_ARG, "a bundle of %zu rays", n);
    if (b->n_bundles >= 60000)
        return imp__error(b->ctx, IMP_E_ARG, "more than 60000 bundles of rays");
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(x[i][k]) || !isfinite(d[i][k]))
                return imp__error(b->ctx, IMP_E_ARG,
                                  "ray %zu of the bundle is not finite: %s[%zu][%d]", i,
                                  isfinite(x[i][k]) ? "d" : "x", i, k);
    for (size_t i = 0; power && i < n; i++)
        if (!(power[i] >= 0) || !isfinite(power[i]))
            return imp__error(b->ctx, IMP_E_ARG, "ray %zu of the bundle has power %g", i,
                              power[i]);
    if (!room(b->ctx, &b->x, &b->cap_x, total, sizeof *b->x) ||
        !room(b->ctx, &b->d, &b->cap_d, total, sizeof *b->d) ||
        !room(b->ctx, &b->group, &b->cap_group, total, sizeof *b->group) ||
        !room(b->ctx, &b->power, &b->cap_power, total, sizeof *b->power) ||
        !room(b->ctx, &b->bundle_first, &b->cap_bundles, (size_t)b->n_bundles + 2,
              sizeof *b->bundle_first))
        return imp__error(b->ctx, IMP_E_NOMEM, "no memory for %zu rays", n);
    memcpy(b->x + b->n, x, n * sizeof *x);
    memcpy(b->d + b->n, d, n * sizeof *d);
    for (size_t i = 0; i < n; i++) {
        b->group[b->n + i] = (uint16_t)b->n_bundles;
        b->power[b->n + i] = power ? power[i] : 1 / (double)n;
    }
    b->bundle_first[b->n_bundles] = b->n;
    if (bundle) *bundle = b->n_bundles;
    b->n_bundles++;
    b->n = total;
    b->bundle_first[b->n_bundles] = total;
    return IMP_OK;
}

static enum imp_status target_check(const imp_bend *b, const struct imp_bend_target *t)
{
    const bool image = t->type == IMP_BEND_IMAGE || t->type == IMP_BEND_FARFIELD;
    if ((int)t->type < 0 || t->type >= IMP_BEND_N_TARGETS)
        return imp__error(b->ctx, IMP_E_ARG, "no such target");
    if (t->bundle >= b->n_bundles || b->n == 0)
        return imp__error(b->ctx, IMP_E_ARG, "target of bundle %d: there are %d",
                          t->bundle, b->n_bundles);
    if (t->tap >= (int)b->options.n_taps)
        return imp__error(b->ctx, IMP_E_ARG, "target at tap %d: there are %zu", t->tap,
                          b->options.n_taps);
    if (!(t->weight >= 0) || !isfinite(t->weight))
        return imp__error(b->ctx, IMP_E_ARG, "target of weight %g", t->weight);
    IMP_FINITE_ALL(b->ctx, t->normal, 3, "t->normal");
    IMP_FINITE(b->ctx, t->offset, "t->offset");
    IMP_FINITE(b->ctx, t->outside, "t->outside");
    IMP_FINITE_ALL(b->ctx, t->point, 3, "t->point");
    IMP_FINITE_ALL(b->ctx, t->origin, 3, "t->origin");
    IMP_FINITE_ALL(b->ctx, t->u, 3, "t->u");
    IMP_FINITE_ALL(b->ctx, t->v, 3, "t->v");
    const imp_v3 n = imp__v3_load(t->normal);
    if (t->at_plane && (!(imp__length(n) > 0) || !imp__is_finite(n) ||
                        !isfinite(t->offset) || !(t->outside > 0)))
        return imp__error(b->ctx, IMP_E_ARG, "target: no such plane");
    if ((t->type == IMP_BEND_POINTS || t->type == IMP_BEND_DIRECTIONS) && !t->data)
        return imp__error(b->ctx, IMP_E_ARG, "target without its data");
    if (t->type == IMP_BEND_SHAPE && !t->sdf)
        return imp__error(b->ctx, IMP_E_ARG, "target without its distance field");
    if (image && (!t->pixels || t->width < 4 || t->height < 4 ||
                  (size_t)t->width * (size_t)t->height > PIXELS_MAX ||
                  !(imp__length(imp__v3_load(t->u)) > 0) ||
                  !(imp__length(imp__v3_load(t->v)) > 0)))
        return imp__error(b->ctx, IMP_E_ARG,
                          "image target: no picture, %d x %d, or no extent", t->width,
                          t->height);
    const imp_v3 u = imp__v3_load(t->u), v = imp__v3_load(t->v);
    if (image && !(fabs(imp__dot(u, v)) <= 1e-6 * imp__length(u) * imp__length(v)))
        return imp__error(b->ctx, IMP_E_ARG,
                          "image target: its sides u and v are not orthogonal");
    return IMP_OK;
}

size_t imp__target_numbers(enum imp_bend_target_type type)
{
    switch (type) {
    case IMP_BEND_POINTS:
    case IMP_BEND_DIRECTIONS:
    case IMP_BEND_DEFLECTION: return 3;
    case IMP_BEND_PATH: return 1;
    case IMP_BEND_FOCUS:
    case IMP_BEND_SPOT:
    case IMP_BEND_DIRECTION:
    case IMP_BEND_WAVEFRONT:
    case IMP_BEND_IMAGE:
    case IMP_BEND_FARFIELD:
    case IMP_BEND_SHAPE: break;
    }
    return 0;
}

enum imp_status imp_bend_add_target(imp_bend *b, const struct imp_bend_target *target)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, b, "bend");
    imp_context *ctx = b->ctx;
    IMP_REQUIRE(ctx, target, "t");
    struct imp__target_of_rays t = {.desc = IMP_BEND_TARGET_INIT};
    const struct imp_bend_target *desc = &t.desc;
    IMP_OPTIONS(ctx, t.desc, target, "t");
    IMP_CHECKED(target_check(b, desc));
    t.first = desc->bundle < 0 ? 0 : b->bundle_first[desc->bundle];
    t.last = desc->bundle < 0 ? b->n : b->bundle_first[desc->bundle + 1];
    const size_t n = (t.last - t.first) * imp__target_numbers(desc->type);
    const size_t n_pixels = desc->pixels ? (size_t)desc->width * (size_t)desc->height : 0;
    if (t.desc.weight == 0) t.desc.weight = 1;
    imp_v3 normal = imp__v3_load(desc->normal);
    const double length = imp__length(normal);
    if (desc->at_plane) {
        double along = 0; /* the normal is turned along the rays' directions */
        for (size_t i = t.first; i < t.last; i++)
            along += imp__dot(normal, imp__normalize(imp__v3_load(b->d[i])));
        const double k = along < 0 ? -1 / length : 1 / length;
        imp__v3_store(normal * k, t.desc.normal);
        t.desc.offset *= k;
    }
    for (size_t i = t.first; i < t.last; i++) t.power += b->power[i];
    if (!(t.power > 0))
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "target of rays without power"));
    t.n_data = n;
    if (n > 0) {
        t.data = imp__alloc(ctx, n, sizeof *t.data);
        if (!t.data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a target"));
        if (desc->data) memcpy(t.data, desc->data, n * sizeof *t.data);
        for (size_t i = 0; i < n; i++)
            if (!isfinite(t.data[i]))
                IMP_TRY(imp__error(ctx, IMP_E_ARG, "number %zu of a target is not finite",
                                   i));
    }
    if (n_pixels > 0) {
        double mean = 0;
        t.pixels = imp__alloc(ctx, n_pixels, sizeof *t.pixels);
        if (!t.pixels) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a picture"));
        for (size_t i = 0; i < n_pixels; i++) {
            if (!isfinite(desc->pixels[i]) || desc->pixels[i] < 0)
                IMP_TRY(imp__error(ctx, IMP_E_ARG, "pixel %zu of a target is %g", i,
                                   (double)desc->pixels[i]));
            mean += desc->pixels[i] / (double)n_pixels;
        }
        if (!(mean > 0))
            IMP_TRY(imp__error(ctx, IMP_E_ARG, "a target picture that is black"));
        for (size_t i = 0; i < n_pixels; i++)
            t.pixels[i] = (float)(desc->pixels[i] / mean);
    }
    t.desc.data = t.data;
    t.desc.pixels = t.pixels;
    if (!room(ctx, &b->targets, &b->cap_targets, b->n_targets + 1, sizeof *b->targets))
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a target"));
    b->targets[b->n_targets++] = t;
    return IMP_OK;
out:
    imp__release(ctx, t.data);
    imp__release(ctx, t.pixels);
    return st;
}

enum imp_status imp_bend_add_smoothness(imp_bend *b, double weight, int order,
                                        double edge)
{
    IMP_REQUIRE(NULL, b, "bend");
    if (!(weight >= 0) || !isfinite(weight) || order < 1 || order > 2 || !(edge >= 0) ||
        !isfinite(edge))
        return imp__error(b->ctx, IMP_E_ARG, "smoothness of weight %g, order %d, edge %g",
                          weight, order, edge);
    if (!room(b->ctx, &b->smooths, &b->cap_smooths, b->n_smooths + 1, sizeof *b->smooths))
        return imp__error(b->ctx, IMP_E_NOMEM, "no memory for a regulariser");
    b->smooths[b->n_smooths++] = (struct imp__smooth){weight, edge, order};
    return IMP_OK;
}

enum imp_status imp_bend_set_bounds(imp_bend *b, double lo, double hi)
{
    IMP_REQUIRE(NULL, b, "bend");
    if (!(lo < hi)) return imp__error(b->ctx, IMP_E_ARG, "bounds lo %g to hi %g", lo, hi);
    b->lo = lo, b->hi = hi;
    b->bounds_set = true;
    return IMP_OK;
}
