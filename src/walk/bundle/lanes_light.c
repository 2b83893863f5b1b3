/* SPDX-License-Identifier: Apache-2.0
 *
 * Light samples in lanes (core/light.c, of walks alone). */
#include "kind/shape/shape.h"
#include "lanes_leave.h"
#include "lanes_record.h"
#include "scene/light_lanes.h"
#include "swept.h"
#include "walk/core/emitted.h"
#include "walk/core/light_point.h"

/* So many lights are chosen by comparing with all. */
enum { FEW_LIGHTS = 8 };

static void truth_set(imp_wide_truth *m, int k, bool value) { (*m)[k] = -(int64_t)value; }

static void record_lanes(int light, imp_wide_truth here, const struct imp_wide_light *own,
                         struct imp_lanes_light *out)
{
    out->at.cos_light = imp__wide_choose(here, own->cos_light, out->at.cos_light);
    out->at.dist = imp__wide_choose(here, own->dist, out->at.dist);
    for (int j = 0; j < 2; j++) {
        out->at.uv[j] = imp__wide_choose(here, own->uv[j], out->at.uv[j]);
        out->at.located[j] = imp__wide_choose(here, own->located[j], out->at.located[j]);
    }
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        if (!here[k]) continue;
        out->light[k] = light;
        out->at.prim[k] = own->prim[k];
    }
}

/* What the points of a light send, in spectra, for the lanes with bits. */
static struct imp_wide_color radiance_alone(const struct imp_bundle *b,
                                            const struct imp_lanes_vertices *v, int light,
                                            bool far, const struct imp_wide_light *own,
                                            unsigned bits)
{
    imp_spec rows[IMP_WIDE_LANES] = {{0}};
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const struct imp_emission x = {.dist = far ? INFINITY : 1,
                                       .cos_light = imp__decide1(own->cos_light[k]),
                                       .d = imp__decide(-imp__wide3_lane(&own->wi, k))};
        rows[k] = imp__emitter_radiance(b->tracer->scene, light, &x, (imp_v3){0},
                                        imp__lanes_carried(b, v, k));
    }
    return imp__color_of_rows(rows);
}

/* The points of one light for the lanes with bits. */
static void draw_lanes(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                       int light, const struct imp_emitter_lanes *lanes,
                       const imp_wide3 *ref, const imp_wide u[2], imp_wide_truth here,
                       struct imp_lanes_light *out)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_emitter *e = scene->emitters[light];
    const imp_wide zero = imp__wide(0);
    struct imp_wide_color le;
    struct imp_wide_light own;
    own.recorded = out->at.recorded;
    own.drawn = here;
    lanes->sample(e, ref, u, &own);
    const imp_wide_truth lit = imp__wide_decide(own.cos_light) > zero;
    own.drawn &= own.pdf > zero;
    if (e->ops->flags & IMP_EMITTER_AREA) own.drawn &= own.cos_light > zero;
    out->at.wi = imp__wide3_choose(here, own.wi, out->at.wi);
    out->at.p = imp__wide3_choose(here, own.p, out->at.p);
    out->at.pdf = imp__wide_choose(here, own.pdf, out->at.pdf);
    out->at.drawn = (out->at.drawn & ~here) | (own.drawn & here);
    if (b->colors > 3) {
        /* At each walk's wavelengths: of even light its side alone counts. */
        const struct imp_input *i = e->input[0];
        const unsigned wanted = imp__wide_bits(own.drawn & here);
        if (imp_likely(!lanes->radiance && i->plain && i->spectrum)) {
            imp__lanes_spectrum(b, i->spectrum, v, wanted & imp__wide_bits(lit), &le);
            for (int c = 0; c < 4; c++) le.c[c] = imp__wide_choose(lit, le.c[c], zero);
        } else {
            le = radiance_alone(b, v, light, lanes->far, &own, wanted);
        }
        for (int c = 0; c < 4; c++)
            out->radiance.c[c] = imp__wide_choose(here, le.c[c], out->radiance.c[c]);
    } else if (lanes->radiance) {
        const imp_wide3 wi = imp__wide3_decide(own.wi);
        lanes->radiance(e, &wi, &le);
        for (int c = 0; c < 3; c++)
            out->radiance.c[c] = imp__wide_choose(here, le.c[c], out->radiance.c[c]);
    } else {
        le = imp__wide_color(e->input[0]->value);
        for (int c = 0; c < 3; c++)
            out->radiance.c[c] = imp__wide_choose(
                here, imp__wide_choose(lit, le.c[c], zero), out->radiance.c[c]);
    }
    if (lanes->far) out->far |= here;
    else out->far &= ~here;
    out->delta &= ~here;
    if (own.recorded) record_lanes(light, here, &own, out);
}

/* Point ls of a light, for lane k. */
static void lane_put(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                     int light, bool drawn, const struct imp_light_sample *ls, int k,
                     struct imp_lanes_light *out)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_emitter *e = scene->emitters[light];
    drawn = drawn && ls->pdf > 0 &&
            !((e->ops->flags & IMP_EMITTER_AREA) && !(ls->cos_light > 0));
    truth_set(&out->at.drawn, k, drawn);
    if (!drawn) return;
    const imp_spec le =
        imp__light_point_radiance(scene, imp__lanes_carried(b, v, k), light, ls);
    imp__wide3_set(&out->at.wi, k, ls->wi);
    imp__wide3_set(&out->at.p, k, ls->p);
    out->at.pdf[k] = ls->pdf;
    for (int c = 0; c < 4; c++) out->radiance.c[c][k] = le[c];
    truth_set(&out->far, k, !isfinite(ls->dist));
    truth_set(&out->delta, k, (e->ops->flags & IMP_EMITTER_DELTA) != 0);
    if (!out->at.recorded) return;
    const struct imp_located located = imp__located_drawn(e->shape, &ls->located, ls->uv);
    out->light[k] = light;
    out->at.cos_light[k] = ls->cos_light;
    out->at.dist[k] = ls->dist;
    out->at.prim[k] = located.prim;
    for (int j = 0; j < 2; j++) {
        out->at.uv[j][k] = ls->uv[j];
        out->at.located[j][k] = located.at[j];
    }
}

static void draw_alone(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                       int light, int prim, const imp_wide3 *ref, const imp_wide u[2],
                       int k, struct imp_lanes_light *out)
{
    const struct imp_emitter *e = b->tracer->scene->emitters[light];
    const imp_v3 p = imp__wide3_lane(ref, k);
    const double own[2] = {u[0][k], u[1][k]};
    struct imp_light_sample ls = {.located = {.prim = -1}};
    const bool drawn = prim >= 0
                           ? e->shape->ops->sample_triangle(e->shape, prim, &p, own, &ls)
                           : e->ops->sample(e, &p, own, &ls);
    lane_put(b, v, light, drawn, &ls, k, out);
}

/* A form in lanes that serves: even radiance has no inputs to look up. */
static const struct imp_emitter_lanes *lanes_of(const struct imp_emitter *e)
{
    const struct imp_emitter_lanes *lanes = imp__emitter_lanes(e);
    return lanes && (lanes->radiance || imp__emitter_even(e, NULL)) ? lanes : NULL;
}

/* Points of the lights chosen in the lanes with bits: of one light together. */
static void draw_chosen(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                        const imp_wide3 *ref, const imp_wide u[2],
                        const struct imp_lights_chosen *c, unsigned bits,
                        struct imp_lanes_light *out)
{
    const struct imp_scene *scene = b->tracer->scene;
    imp_wide_truth light;
    for (int k = 0; k < IMP_WIDE_LANES; k++) light[k] = bits >> k & 1 ? c->light[k] : -1;
    while (bits) {
        const int first = __builtin_ctz(bits), one = c->light[first];
        const struct imp_emitter_lanes *lanes =
            c->prim[first] < 0 ? lanes_of(scene->emitters[one]) : NULL;
        const imp_wide_truth here = light == (imp_wide_truth){0} + one;
        unsigned same = imp__wide_bits(here);
        bits &= ~same;
        if (lanes && (same & (same - 1))) {
            draw_lanes(b, v, one, lanes, ref, u, here, out);
            continue;
        }
        for (; same; same &= same - 1) {
            const int k = __builtin_ctz(same);
            draw_alone(b, v, one, c->prim[k], ref, u, k, out);
        }
    }
}

void imp__lanes_tree_draw(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                          const imp_wide3 *n, const imp_wide u_drawn[2], imp_wide which,
                          struct imp_lanes_light *out)
{
    imp_wide u[2] = {u_drawn[0], u_drawn[1]};
    struct imp_lights_chosen c;
    out->at.drawn = out->far = out->delta = (imp_wide_truth){0};
    const unsigned lit = imp__light_lanes_choose(b->tracer->scene->light_tree, &v->x.p, n,
                                                 v->on, &which, &c);
    if (v->points) u[0] = which;
    out->pmf = c.chance;
    draw_chosen(b, v, &v->x.p, u, &c, lit, out);
}

/* imp__light_pick, and imp__light_part if `one`, of a few lights. A bit for each lane that has a
 * light. */
static unsigned few_pick(const struct imp_scene *scene, imp_wide which, bool one,
                         imp_wide u[2], imp_wide *pmf, struct imp_lights_chosen *out)
{
    const double *cdf = scene->light_cdf;
    const imp_wide zero = imp__wide(0);
    imp_wide below = zero, above = imp__wide(cdf[0]);
    imp_wide_truth light = {0};
    for (int k = 0; k + 1 < scene->n_emitters; k++) {
        const imp_wide_truth past = ~(which < imp__wide(cdf[k]));
        below = imp__wide_choose(past, imp__wide(cdf[k]), below);
        above = imp__wide_choose(past, imp__wide(cdf[k + 1]), above);
        light -= past;
    }
    *pmf = above - below;
    if (one && scene->n_emitters > 1)
        u[0] = imp__wide_larger(
            imp__wide_lesser((which - below) / *pmf, imp__wide(0x1.fffffffffffffp-1)),
            zero);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        out->light[k] = (int)light[k];
        out->prim[k] = -1;
    }
    return imp__wide_bits(*pmf > zero);
}

void imp__lanes_light_draw(const struct imp_bundle *b, const struct imp_lanes_vertices *v,
                           const imp_wide u_drawn[2], imp_wide which,
                           struct imp_lanes_light *out)
{
    const struct imp_scene *scene = b->tracer->scene;
    const bool one = v->points;
    imp_wide u[2] = {u_drawn[0], u_drawn[1]};
    const imp_wide_truth all = ~(imp_wide_truth){0};
    struct imp_lights_chosen c;
    unsigned lit = 0, bits = v->on;
    out->at.drawn = out->far = out->delta = (imp_wide_truth){0};
    if (scene->n_emitters == 1) {
        const struct imp_emitter_lanes *lanes = lanes_of(scene->emitters[0]);
        out->pmf = imp__wide(scene->light_cdf[0]);
        if (!(scene->light_cdf[0] > 0)) return;
        if (lanes) {
            draw_lanes(b, v, 0, lanes, &v->x.p, u, all, out);
            return;
        }
    }
    if (scene->n_emitters <= FEW_LIGHTS) {
        lit = few_pick(scene, which, one, u, &out->pmf, &c) & bits;
        bits = 0;
    }
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        double pmf;
        c.light[k] = imp__light_pick(scene, which[k], &pmf);
        c.prim[k] = -1;
        if (one) u[0][k] = imp__light_part(scene, c.light[k], which[k], pmf);
        out->pmf[k] = pmf;
        lit |= (unsigned)(pmf > 0) << k;
    }
    draw_chosen(b, v, &v->x.p, u, &c, lit, out);
}

/* ---- The sky that is met ----------------------------------------------------------------- */

bool imp__lanes_sky_fits(const struct imp_tracer *tracer)
{
    const struct imp_scene *scene = tracer->scene;
    return scene->n_environments == 1 && !tracer->wavelengths &&
           !tracer->integrator->hide_emitters;
}

/* Densities of points of the sky along wi, seen from `from`: by lanes, or one by one. */
static imp_wide sky_pdf(const struct imp_emitter *e,
                        const struct imp_emitter_lanes *lanes, const imp_wide3 *from,
                        const imp_wide3 *wi)
{
    if (lanes) return lanes->pdf(e, from, wi);
    imp_wide pdf;
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const imp_v3 ref = imp__wide3_lane(from, k), w = imp__wide3_lane(wi, k);
        pdf[k] = e->ops->pdf(e, &ref, &w, NULL, NULL);
    }
    return pdf;
}

static void sky_radiance(const struct imp_scene *scene, int light,
                         const struct imp_emitter_lanes *lanes, const imp_wide3 *wi,
                         struct imp_wide_color *le)
{
    const struct imp_emitter *e = scene->emitters[light];
    const imp_wide3 decided = imp__wide3_decide(*wi);
    if (imp__emitter_even(e, NULL)) {
        *le = imp__wide_color(e->input[0]->value);
        return;
    }
    if (lanes) {
        lanes->radiance(e, &decided, le);
        return;
    }
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const imp_v3 w = imp__wide3_lane(&decided, k);
        const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -w};
        const imp_spec own = imp__emitter_radiance(scene, light, &x, w, NULL);
        for (int c = 0; c < 3; c++) le->c[c][k] = own[c];
    }
}

/* Probabilities of the sky among the lights, where the rays order[lanes] left. */
static imp_wide sky_chance(const struct imp_depth *d, const int32_t *order, int light)
{
    const struct imp_scene *scene = d->bundle->tracer->scene;
    imp_wide chance =
        imp__wide(scene->light_cdf[light] - (light ? scene->light_cdf[light - 1] : 0));
    for (int k = 0; d->rays->left && k < IMP_WIDE_LANES; k++)
        chance[k] = imp__light_tree_factor(scene->light_tree, &d->rays->left[order[k]],
                                           light, -1);
    return chance;
}

static imp_wide power_heuristic(imp_wide a, imp_wide b)
{
    const imp_wide a2 = a * a, b2 = b * b;
    return imp__wide_choose(a2 > imp__wide(0), a2 / (a2 + b2), imp__wide(0));
}

/* As a vertex, of walks that are swept. */
static void sky_keep(struct imp_depth *d, const int32_t *order, int n, int light,
                     const imp_wide3 *wi, const imp_wide *weight,
                     const struct imp_wide_color *met)
{
    struct imp_bundle_values *values = d->values;
    imp__lanes_keep_sky(d, order, n, values->n, light, wi, weight);
    for (int k = 0; k < n; k++) {
        const int at = values->n++;
        imp__color_put(values->e, 3, at, imp__color_lane(met, 3, k));
        imp__color_put(values->b, 3, at, imp__spec(0));
        imp__color_put(values->w, 3, at, imp__spec(0));
        imp__color_put(values->beyond, 3, at, imp__spec(0));
        values->up[at] = d->rays->up[order[k]];
        d->bundle->valid[d->rays->walk[order[k]]] = true;
    }
}

static inline void sky_work(struct imp_depth *d, const int32_t *order, int n,
                            double *const beyond[4])
{
    const struct imp_tracer *t = d->bundle->tracer;
    const int light = t->scene->environments[0];
    const struct imp_emitter *e = t->scene->emitters[light];
    const imp_wide3 from = imp__wide3_taken(d->rays->from, order),
                    wi = imp__wide3_taken(d->rays->ray.d, order);
    const imp_wide pdf = imp__wide_taken(d->rays->pdf, order), one = imp__wide(1);
    const struct imp_emitter_lanes *lanes = lanes_of(e);
    const imp_wide_truth weighed = pdf > imp__wide(0);
    imp_wide weight = one;
    if (t->integrator->lights && imp__wide_bits(weighed))
        weight = imp__wide_choose(
            weighed,
            imp__wide_decide(power_heuristic(pdf, sky_chance(d, order, light) *
                                                      sky_pdf(e, lanes, &from, &wi))),
            one);
    struct imp_wide_color met;
    sky_radiance(t->scene, light, lanes, &wi, &met);
    for (int c = 0; c < 3; c++) met.c[c] *= weight;
    if (d->bundle->walks) {
        imp__lanes_record_sky(d, order, n, light, &wi, &weight, &met);
        return;
    }
    if (d->bundle->swept) {
        sky_keep(d, order, n, light, &wi, &weight, &met);
        return;
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < n; k++) beyond[c][d->rays->up[order[k]]] = met.c[c][k];
    for (int k = 0; k < n; k++) d->bundle->valid[d->rays->walk[order[k]]] = true;
}

void imp__lanes_sky_meet(struct imp_depth *d, const int32_t *order, int n,
                         double *const beyond[4])
{
    const int max_depth = d->bundle->tracer->integrator->max_depth;
    if (max_depth >= 0 && d->depth >= max_depth) return;
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        int32_t rest[IMP_WIDE_LANES];
        const int left = imp_min(n - i, IMP_WIDE_LANES);
        sky_work(d, imp__lanes_filled(order + i, left, rest), left, beyond);
    }
}
