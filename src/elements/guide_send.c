/* SPDX-License-Identifier: Apache-2.0
 *
 * Where a guide begins light walks. They carry radiance, and are guided by its adjoint,
 * the importance of the elements (Christensen et al. 1993): flux that arrives at x from w
 * contributes g(x->w) to the reading.
 *
 *     light k           what it gives the sensor over links and rays of the eye,
 *                       sum of emission x importance
 *     point, direction  Le cos g(w) where the ray from the light ends, in bins of the
 *                       uniform numbers that the light makes point and direction of
 *
 * so that any light that can be sampled can be guided, with the density that it has itself
 * times that of the bin. What the sensor sees of the light itself is in the first only: the
 * point is connected to the sensor, whatever direction is drawn. Walks that have to meet
 * the sensor have that in the second, too. */
#include "elements_guide.h"
#include "kind/cleared.h"
#include "math/offset.h"
#include "math/rng.h"

#define SPREAD_BASE 0.2 /* of points and directions, without a guide */
#define SIDE_MAX    16
#define ACROSS_MAX  4
#define PER_BIN     2                 /* rays */
#define RAYS_MAX    ((size_t)1 << 18) /* of all lights */

const struct imp_shape *imp__guide_meter(const imp_elements *e)
{
    return e->has_importance && e->scene->n_sensors > 0
               ? e->scene->sensors[e->opt.sensor]->shape
               : NULL;
}

/* ---- Lights ---------------------------------------------------------------------- */

/* What the eye sees of the lights of a root themselves. */
static double seen(const imp_elements *e, const struct imp__el_root *r)
{
    const uint32_t *range = e->elements[r->element].hit;
    double sum = 0;
    for (uint32_t k = range[0]; k < range[1]; k++) {
        const double lobe = imp__el_lobe(r, e->hits[k].w) * e->hits[k].weight;
        for (int c = 0; c < e->ch && lobe != 0; c++)
            sum += e->eye[c] * r->radiance[c] * lobe;
    }
    return sum;
}

static void lights_fill(struct imp__guide *g)
{
    const imp_elements *e = g->e;
    double sum = 0, run = 0;
    for (size_t i = 0; i < e->n_roots; i++) {
        const int light = imp__guide_emitter(e, &e->roots[i]);
        if (light >= 0) g->send[light] += seen(e, &e->roots[i]);
    }
    for (size_t j = 0; j < e->n_elements; j++) {
        const int light = imp__guide_emitter(e, imp__el_root_of(e, &e->elements[j]));
        if (light < 0) continue;
        double given = 0;
        imp__el_given_add(e, j, &given);
        g->send[light] += given;
    }
    for (int k = 0; k < g->n_lights; k++) {
        /* Lobes ring below zero; a light of weight 0 sends nothing. */
        g->send[k] = g->pmf[k] > 0 ? fmax(g->send[k], 0) : 0;
        sum += g->send[k];
    }
    for (int k = 0; k < g->n_lights; k++) {
        const double p = sum > 0 ? g->send[k] / sum : g->pmf[k];
        run += g->light_base * g->pmf[k] + (1 - g->light_base) * p;
        g->send[k] = run;
    }
    if (g->n_lights > 0) g->send[g->n_lights - 1] = 1;
}

/* ---- Points and directions ------------------------------------------------------- */

/* Reading of light `le` that arrives where the ray ends, by reflection; *met: by meeting
 * the sensor. */
static double worth(const imp_elements *e, imp_v3 o, imp_v3 d, imp_spec le, double *met)
{
    const struct imp_sensor_ray ray = {.o = o, .d = d, .t_near = 0, .t_far = INFINITY};
    const struct imp_shape *meter = imp__guide_meter(e);
    struct imp_hit at;
    struct imp__el_hit hit;
    double h[EL_N_MAX], sum = 0, mean = 0;
    *met = 0;
    if (meter && imp__intersect(e->scene, &o, &d, 0, INFINITY, &at) &&
        e->scene->shapes[at.shape] == meter)
        for (int c = 0; c < e->ch; c++)
            *met += e->eye[c] * le[c] * e->scene->sensors[e->opt.sensor]->scale *
                    IMP_INV_PI / meter->area;
    if (!imp__el_trace(e, &ray, &hit)) return 0;
    const struct imp__el_root *r = &e->roots[hit.root];
    const int n = imp__el_n(e, r);
    if (n == 0) return 0;
    const struct imp__element *x =
        &e->elements[imp__el_find(e, hit.root, hit.u, hit.v, NULL)];
    h[0] = e->basis.lead[0];
    if (n > 1) imp__basis_eval(&e->basis, imp__to_local(&r->frame, hit.w), h);
    for (int c = 0; c < e->ch; c++) {
        const double *g = imp__el_at(e, e->g, x) + c * n;
        for (int q = 0; q < n; q++) sum += le[c] * g[q] * h[q];
        mean += le[c] * g[0] * e->basis.lead[0];
    }
    return fmax(sum, 0.1 * fmax(mean, 0)); /* lobes ring below zero */
}

/* Sums of one bin of points, by direction [side side]; met likewise. */
static void bin_fill(const struct imp__guide *g, int light, int place, double *reflected,
                     double *met)
{
    const imp_elements *e = g->e;
    const struct imp_scene *scene = e->scene;
    const struct imp_emitter *em = scene->emitters[light];
    const struct imp__guide_emission *m = &g->emission[IMP_GUIDE_CONNECTED];
    imp_spec in[IMP_INPUTS_MAX];
    imp__inputs_eval(em->input, em->n_in, &(struct imp_texcoord){.uv = {0.5, 0.5}}, in);
    for (int k = 0; k < m->side * m->side; k++) {
        reflected[k] = met[k] = 0;
        for (uint32_t i = 0; i < PER_BIN; i++) {
            const struct imp_key key =
                imp__key(e->opt.seed + 5, (uint64_t)light,
                         ((uint32_t)place << 8 | (uint32_t)k) * PER_BIN + i);
            const double u[4] = {(place / m->across + imp__u01(key, 0)) / m->across,
                                 (place % m->across + imp__u01(key, 1)) / m->across,
                                 (k / m->side + imp__u01(key, 2)) / m->side,
                                 (k % m->side + (i + imp__u01(key, 3)) / PER_BIN) /
                                     m->side};
            struct imp_emission_sample s;
            double meets;
            if (!imp__emission_sample(em, &scene->ball, u, &s) || !(s.cos_p > 0))
                continue;
            const double per = s.pdf_p * s.pdf_d / s.cos_p;
            if (!(per > 0)) continue;
            const struct imp_emission x = {{s.uv[0], s.uv[1]}, 1, s.cos_light, s.d};
            imp_spec le;
            em->ops->eval(em, in, &x, &le);
            const bool surface = imp__dot(s.ng, s.ng) > 0;
            const double by = worth(e, surface ? imp__offset(s.p, s.ng, s.d) : s.p, s.d,
                                    le * (1 / per), &meets);
            reflected[k] += by;
            met[k] += by + meets;
        }
    }
}

static enum imp_status light_work(size_t item, int worker, int slot, void *payload)
{
    const struct imp__guide *g = payload;
    double bins[2][SIDE_MAX * SIDE_MAX], soft[SIDE_MAX * SIDE_MAX];
    double point[2][ACROSS_MAX * ACROSS_MAX] = {{0}};
    const struct imp__guide_emission *m = &g->emission[IMP_GUIDE_CONNECTED];
    const int places = m->across * m->across, n = m->side * m->side;
    (void)worker, (void)slot;
    for (int p = 0; p < places; p++) {
        bin_fill(g, (int)item, p, bins[0], bins[1]);
        for (int k = 0; k < 2; k++) {
            const struct imp__guide_emission *to = &g->emission[IMP_GUIDE_CONNECTED + k];
            if (!to->point) continue;
            imp__guide_smooth(m->side, bins[k], soft);
            for (int i = 0; i < n; i++) point[k][p] += soft[i];
            imp__guide_cumulate(soft, n, SPREAD_BASE,
                                to->direction +
                                    (item * (size_t)places + (size_t)p) * (size_t)n);
        }
    }
    for (int k = 0; k < 2; k++)
        if (g->emission[IMP_GUIDE_CONNECTED + k].point)
            imp__guide_cumulate(point[k], places, SPREAD_BASE,
                                g->emission[IMP_GUIDE_CONNECTED + k].point +
                                    item * (size_t)places);
    return IMP_OK;
}

static double emit(const struct imp_guide *base, enum imp_guide_field field, int light,
                   double u[4], double *point)
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const struct imp__guide_emission *m = &g->emission[field];
    const int places = m->across * m->across, n = m->side * m->side;
    int bin, to;
    double rest;
    if (!m->point) return *point = 1;
    *point = places * imp__guide_pick(m->point + (size_t)light * (size_t)places, places,
                                      u[0], &bin, &rest);
    u[0] = (bin / m->across + rest) / m->across;
    u[1] = (bin % m->across + u[1]) / m->across;
    const float *direction =
        m->direction + ((size_t)light * (size_t)places + (size_t)bin) * (size_t)n;
    const double density = n * imp__guide_pick(direction, n, u[2], &to, &rest);
    u[2] = (to / m->side + rest) / m->side;
    u[3] = (to % m->side + u[3]) / m->side;
    return density;
}

static int bin_at(int side, const double u[2])
{
    const int a = imp_clamp((int)(u[0] * side), 0, side - 1);
    return a * side + imp_clamp((int)(u[1] * side), 0, side - 1);
}

static double emit_pdf(const struct imp_guide *base, enum imp_guide_field field,
                       int light, const double u[4])
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const struct imp__guide_emission *m = &g->emission[field];
    const int places = m->across * m->across, n = m->side * m->side;
    if (!m->point) return 1;
    const int k = bin_at(m->side, u + 2);
    const float *c =
        m->direction +
        ((size_t)light * (size_t)places + (size_t)bin_at(m->across, u)) * (size_t)n;
    return n * ((double)c[k] - (k ? (double)c[k - 1] : 0));
}

static enum imp_status emission_make(struct imp__guide *g)
{
    imp_context *ctx = g->e->ctx;
    const size_t lights = (size_t)g->n_lights;
    int across = ACROSS_MAX, side = SIDE_MAX;
    while (across > 1 &&
           lights * (size_t)(across * across * side * side) * PER_BIN > RAYS_MAX)
        across /= 2;
    while (side > 4 && lights * (size_t)(side * side) * PER_BIN > RAYS_MAX) side /= 2;
    const size_t places = lights * (size_t)(across * across);
    for (int k = IMP_GUIDE_CONNECTED; k <= IMP_GUIDE_MET; k++) {
        struct imp__guide_emission *m = &g->emission[k];
        m->across = across;
        m->side = side;
        if (k == IMP_GUIDE_MET && !imp__guide_meter(g->e)) break;
        m->point = imp__alloc(ctx, places + 1, sizeof *m->point);
        m->direction =
            imp__alloc(ctx, places * (size_t)(side * side) + 1, sizeof *m->direction);
        if (!m->point || !m->direction)
            return imp__error(ctx, IMP_E_NOMEM, "out of memory for a guide");
    }
    const struct imp_loop loop = {.n_items = lights, .work = light_work, .payload = g};
    return imp__parallel(ctx, &loop, NULL);
}

enum imp_status imp__guide_send(struct imp__guide *g)
{
    imp_context *ctx = g->e->ctx;
    enum imp_status st = IMP_OK;
    g->send = imp__alloc(ctx, (size_t)g->n_lights + 1, sizeof *g->send);
    if (!g->send) return imp__error(ctx, IMP_E_NOMEM, "out of memory for a guide");
    lights_fill(g);
    IMP_TRY(emission_make(g));
    g->base.send = g->send;
    g->base.emit = emit;
    g->base.emit_pdf = emit_pdf;
out:
    return st;
}
