/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights: samples agree with eval and pdf; lights with an area and skies give the same
 * light by their own draws and by directions drawn without them. */
#include "math/warp.h"
#include "selftest.h"
#include "walk/core/walk.h"

struct light {
    const struct imp_scene *scene;
    const struct imp_emitter *e;
    int channels;
    imp_v3 ref;
    const struct imp_carried *carried; /* in spectral modes: four wavelengths */
};
#define SKY_PLACES 3
#define DERIVED    4000 /* directions at a place where derivatives are compared */
static const struct imp_carried waves = {4, {460, 530, 600, 670}};

static double brightness(const struct light *l, imp_spec le)
{
    double sum = 0;
    for (int c = 0; c < l->channels; c++) sum += le[c];
    return sum / l->channels;
}

/* A point of the scene, or of the unit cube where nothing is. */
static imp_v3 reference(const struct imp_scene *s, struct imp_key key)
{
    imp_v3 p = {0};
    for (int c = 0; c < 3; c++) {
        const double u = imp__u01(key, (uint32_t)c);
        const bool there = s->n_shapes > 0;
        const double lo = there ? s->lo[c] : -1, hi = there ? s->hi[c] : 1;
        p[c] = lo + u * (hi - lo);
    }
    return p;
}

/* ---- A ray towards a light of area ------------------------------------------------ */

/* The nearest hit of the ray, if it is the light's own shape, seen from its front. */
static bool light_hit(const struct light *l, imp_v3 d, struct imp_hit *hit,
                      struct imp_surface *at, struct imp_emission *x)
{
    if (!imp__intersect(l->scene, &l->ref, &d, 0, INFINITY, hit)) return false;
    const struct imp_shape *s = l->scene->shapes[hit->shape];
    if (s != l->e->shape) return false;
    s->ops->surface(s, hit, &l->ref, &d, at);
    *x = (struct imp_emission){{at->uv[0], at->uv[1]}, hit->t, -imp__dot(at->n, d), -d};
    return x->cos_light > 0;
}

static double radiance(const struct light *l, const struct imp_emission *x, imp_v3 p)
{
    return brightness(l, imp__emitter_radiance(l->scene, l->e->index, x, p, l->carried));
}

/* Directions that can meet the light: a cone around its shape, or all. For a sky, half of
 * them are drawn from a cone about its brightest spot, which may be as small as the sun. */
struct cone {
    struct imp_frame frame;
    double height; /* 1 - cosine of its angle */
    bool spot;
};
#define SPOT_HEIGHT 2e-4 /* of an angle of 1.15 degrees */
static struct cone cone_of(const struct light *l)
{
    const struct imp_shape *s = l->e->shape;
    struct cone c = {imp__frame_from_normal(imp__v3(0, 0, 1)), 2, false};
    if (!s) return c;
    const imp_v3 to = (s->lo + s->hi) * 0.5 - l->ref;
    const double d = imp__length(to), r = 0.5001 * imp__length(s->hi - s->lo);
    if (d <= r) return c;
    c.frame = imp__frame_from_normal(to * (1 / d));
    c.height = 1 - sqrt(1 - imp__sqr(r / d));
    return c;
}

/* A sky's brightest direction of some that it draws. */
static void spot_set(const struct light *l, uint64_t seed, struct cone *c)
{
    double most = -1;
    for (uint32_t k = 0; k < 1000; k++) {
        const struct imp_key key = imp__key(seed, 399, k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_light_sample s;
        if (!l->e->ops->sample(l->e, &l->ref, u, &s) || !(s.pdf > 0)) continue;
        const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -s.wi};
        const double value = radiance(l, &x, (imp_v3){0});
        if (!(value > most)) continue;
        most = value;
        c->frame = imp__frame_from_normal(s.wi);
        c->spot = true;
    }
}

/* ---- What is measured -------------------------------------------------------------- */

struct found {
    double n, bad, uncovered, density; /* the last: worst relative difference */
    double error;                      /* of derivatives */
    struct imp__scores light;          /* by own draws and by a cone */
    struct imp__chances chances;       /* of a sky */
    struct imp__scores total;          /* of its density */
    double seen;                       /* by the chi-squares together */
};

/* eval_d against central differences: exact, as light is linear in most inputs. */
static double derivative_error(const struct light *l, const struct imp_emission *x,
                               imp_v3 p)
{
    const struct imp_emitter *e = l->e;
    struct imp_texcoord at = {
        .uv = {x->uv[0], x->uv[1]}, .p = p, .carried = l->carried, .shape = l->e->shape};
    imp_spec in[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX], f, up, down;
    double worst = 0;
    imp__emitter_place(e, x, &at);
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval(e, in, x, &f);
    e->ops->eval_d(e, in, x, d);
    for (int j = 0; j < e->n_in; j++) {
        if (e->ops->inputs[j].flags & IMP_INPUT_WAVELENGTH) continue;
        const imp_spec was = in[j];
        for (int c = 0; c < l->channels; c++) {
            const double h = 1e-4 * fmax(fabs(was[c]), 0.1);
            double step[2]; /* slopes of h and h/2: extrapolated, for corners */
            for (int k = 0; k < 2; k++) {
                const double half = k ? 0.5 * h : h;
                in[j] = was + half;
                e->ops->eval(e, in, x, &up);
                in[j] = was - half;
                e->ops->eval(e, in, x, &down);
                step[k] = (up[c] - down[c]) / (2 * half);
            }
            in[j] = was;
            const double slope = 2 * step[1] - step[0];
            const double error =
                fabs(slope - d[j][c]) / (fabs(d[j][c]) + 1e-3 * fabs(f[c]) + 1e-12);
            worst = fmax(worst, isfinite(error) ? error : INFINITY);
        }
    }
    return worst;
}

/* One draw: its density against pdf, and its light over its density. */
static double draw_take(const struct light *l, const double u[2], struct found *r)
{
    const struct imp_emitter_ops *ops = l->e->ops;
    struct imp_light_sample s;
    r->n++;
    if (!ops->sample(l->e, &l->ref, u, &s)) return 0;
    const struct imp_emission x = {{s.uv[0], s.uv[1]}, s.dist, s.cos_light, -s.wi};
    bool sane = fabs(imp__length(s.wi) - 1) < 1e-9 && s.dist > 0 && s.pdf >= 0 &&
                isfinite(s.pdf) && isfinite(s.cos_light);
    const bool front = !(ops->flags & IMP_EMITTER_AREA) || s.cos_light > 0;
    const double value = sane && front ? radiance(l, &x, s.p) : 0;
    sane &= isfinite(value) && value >= 0;
    r->bad += !sane;
    if (!sane || !front || !(s.pdf > 0)) return 0;
    if (ops->flags & IMP_EMITTER_DELTA) {
        r->bad += s.pdf != 1;
        return 0;
    }
    if (ops->flags & IMP_EMITTER_AREA) {
        struct imp_hit hit;
        struct imp_surface at;
        struct imp_emission met;
        if (!light_hit(l, s.wi, &hit, &at, &met) || fabs(hit.t / s.dist - 1) > 1e-3)
            return 0; /* something is in its way */
        if (s.cos_light > 0.05)
            r->density = fmax(
                r->density, fabs(ops->pdf(l->e, &l->ref, &s.wi, &hit, &at) / s.pdf - 1));
        return value / s.pdf;
    }
    r->density =
        fmax(r->density, fabs(ops->pdf(l->e, &l->ref, &s.wi, NULL, NULL) / s.pdf - 1));
    return value / s.pdf;
}

/* One direction drawn without the light. */
static double cone_take(const struct light *l, const struct cone *c, const double u[2],
                        bool derives, struct found *r)
{
    const bool inside = c->spot && u[0] < 0.5;
    const double first = c->spot ? 2 * u[0] - !inside : u[0];
    const double away = (inside ? SPOT_HEIGHT : c->height) * first;
    const double z = 1 - away, s = sqrt(fmax(0, away * (2 - away)));
    const double share = /* density of the direction times 2 pi */
        c->spot ? 0.5 / c->height + (away < SPOT_HEIGHT ? 0.5 / SPOT_HEIGHT : 0)
                : 1 / c->height;
    const imp_v3 d = imp__to_world(
        &c->frame, imp__v3(s * cos(IMP_2PI * u[1]), s * sin(IMP_2PI * u[1]), z));
    struct imp_hit hit;
    struct imp_surface at;
    struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -d};
    const bool area = l->e->ops->flags & IMP_EMITTER_AREA;
    r->n++;
    if (area && !light_hit(l, d, &hit, &at, &x)) return 0;
    const imp_v3 p = area ? at.p : (imp_v3){0};
    const double value = radiance(l, &x, p);
    const double pdf =
        l->e->ops->pdf(l->e, &l->ref, &d, area ? &hit : NULL, area ? &at : NULL);
    const bool sane = isfinite(value) && value >= 0 && isfinite(pdf) && pdf >= 0;
    r->bad += !sane;
    if (!sane) return 0;
    r->uncovered += value > 0 && !(pdf > 0);
    if (derives) r->error = fmax(r->error, derivative_error(l, &x, p));
    return value * IMP_2PI / share;
}

/* ---- A sky ------------------------------------------------------------------------- */

static double sky_density(imp_v3 w, void *payload)
{
    const struct light *l = payload;
    return l->e->ops->pdf(l->e, &l->ref, &w, NULL, NULL);
}
static bool sky_draw(void *payload, const double u[3], imp_v3 *w, int *lobe)
{
    const struct light *l = payload;
    struct imp_light_sample s;
    (void)lobe;
    if (!l->e->ops->sample(l->e, &l->ref, u, &s) || !(s.pdf > 0)) return false;
    *w = s.wi;
    return true;
}

/* A place from which the light is looked at. */
static struct light light_at(const struct imp__selftest *t, const struct imp_emitter *e,
                             int i)
{
    const bool spectral = t->scene->mode == IMP_SPECTRAL || t->scene->mode == IMP_SINGLE;
    return (struct light){
        .scene = t->scene,
        .e = e,
        .channels = t->scene->channels,
        .carried = spectral ? &waves : NULL,
        .ref = reference(t->scene, imp__key(t->options.seed, 31, (uint64_t)i))};
}

/* Light by n draws of its own at each place, and by directions drawn without it. */
static void light_take(struct imp__selftest *t, const struct imp_emitter *e, int n,
                       struct found *r)
{
    const bool delta = e->ops->flags & IMP_EMITTER_DELTA;
    r->n = 0;
    r->light = (struct imp__scores){0};
    for (int i = 0; i < t->options.directions; i++) {
        const struct light l = light_at(t, e, i);
        struct imp__mean own = {0}, other = {0};
        struct cone cone = cone_of(&l);
        if (e->ops->flags & IMP_EMITTER_ENVIRONMENT) spot_set(&l, t->options.seed, &cone);
        for (int k = 0; k < n; k++) {
            if (k % 1000 == 0 && imp__selftest_stopped(t)) return;
            const struct imp_key key =
                imp__key(t->options.seed, 400 + (uint64_t)i, (uint64_t)k);
            const double u[4] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2),
                                 imp__u01(key, 3)};
            imp__mean_add(&own, draw_take(&l, u, r));
            if (!delta)
                imp__mean_add(&other, cone_take(&l, &cone, &u[2], k < DERIVED, r));
        }
        const double se = sqrt(imp__mean_variance(&own) + imp__mean_variance(&other)) +
                          1e-5 * fabs(own.mean) + 1e-300;
        if (!delta) imp__scores_add(&r->light, own.mean, other.mean, se);
    }
    imp__scores_end(&r->light);
}

/* A sky is the same from everywhere. */
static void sky_take(struct imp__selftest *t, const struct imp_emitter *e, int n,
                     struct found *r)
{
    r->chances = (struct imp__chances)IMP_CHANCES_INIT;
    r->total = (struct imp__scores){0};
    for (int i = 0; i < SKY_PLACES; i++) {
        struct light l = light_at(t, e, i);
        const struct imp__drawn d = {sky_draw, sky_density,         NULL, &l,
                                     0,        imp__selftest_watch, t};
        const struct imp__draws test = imp__draws_test(
            &d, n, t->options.seed + (uint64_t)i, IMP_SPHERE_STEPS, t->tree);
        imp__chances_add(&r->chances, &test, n);
        imp__scores_add(&r->total, test.total, 1, 1e-3);
    }
    r->seen = imp__chances_end(&r->chances, t->level);
    imp__scores_end(&r->total);
}

static enum imp_status light(struct imp__selftest *t, const struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct found r = {0};
    const char *name = e->name, *kind = e->ops->name;
    const bool delta = e->ops->flags & IMP_EMITTER_DELTA,
               sky = e->ops->flags & IMP_EMITTER_ENVIRONMENT;
    const int n = t->options.samples / t->options.directions + 1;
    for (int m = n; m > 0 && r.bad == 0; m = imp__selftest_more(t, m, r.light.sees))
        light_take(t, e, m, &r);
    for (int m = t->options.samples / SKY_PLACES + 1; m > 0 && sky && r.bad == 0;
         m = imp__selftest_more(t, m, r.seen))
        sky_take(t, e, m, &r);
    IMP_TRY(imp__selftest_count(t, name, kind, "finite", r.bad, r.n));
    if (r.bad > 0) return IMP_OK;
    if (delta) return IMP_OK;
    IMP_TRY(imp__selftest_count(t, name, kind, "covers", r.uncovered, r.n));
    IMP_TRY(imp__selftest_row(t, &(struct imp_selftest_row){.object = name,
                                                            .kind = kind,
                                                            .contract = "density",
                                                            .value = r.density,
                                                            .error = r.density,
                                                            .limit = 0.01,
                                                            .chance = -1}));
    if (sky) {
        IMP_TRY(imp__selftest_z(t, name, kind, "normalised", &r.total));
        IMP_TRY(imp__selftest_draws(t, name, kind, r.chances.least, r.seen));
    }
    IMP_TRY(imp__selftest_z(t, name, kind, "light", &r.light));
    IMP_TRY(imp__selftest_row(t, &(struct imp_selftest_row){.object = name,
                                                            .kind = kind,
                                                            .contract = "derivative",
                                                            .value = r.error,
                                                            .error = r.error,
                                                            .limit = 1e-5,
                                                            .chance = -1}));
out:
    return st;
}

enum imp_status imp__selftest_lights(struct imp__selftest *t)
{
    enum imp_status st = IMP_OK;
    t->level = imp__sidak(0.01, SKY_PLACES + 1);
    for (int k = 0; k < t->scene->n_emitters; k++) {
        t->part = (double)k / t->scene->n_emitters;
        IMP_TRY(light(t, t->scene->emitters[k]));
    }
out:
    return st;
}
