/* SPDX-License-Identifier: Apache-2.0
 *
 * Draws of the boundary, and what they bring as derivatives (boundary.h). */
#include "base/arguments.h"
#include "boundary_allowed.h"
#include "kind/emitter/ies.h"
#include "kind/sensor/receiver.h"
#include "moved_mirror.h"
#include "moved_sky.h"
#include "scene/camera_gain.h"
#include "scene/majorants.h"
#include "scene/pose.h"
#include "walk/core/lane_mis.h"
#include "walk/path/first_segment.h"

/* The mean of a picture, roughly; one that seems to be black may have light between. */
static void picture_mean(const struct imp_emitter *e, imp_spec *in)
{
    enum { SIDE = 8 };
    imp_spec sum = {0};
    for (int k = 0; k < SIDE * SIDE; k++) {
        const struct imp_texcoord at = {
            .uv = {(k % SIDE + 0.5) / SIDE, (k / SIDE + 0.5) / SIDE}};
        imp__inputs_eval(e->input, e->n_in, &at, in);
        sum += in[0] * (1. / (SIDE * SIDE));
    }
    in[0] = imp__is_zero(sum) ? imp__spec(1) : sum;
}

/* Power of a light, over pi: A Le, 4 I, or R^2 E of a scene within R; of a sky E is the integral of its
 * radiance over all directions. */
static double light_power(const struct imp__boundary *b, int k)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_emitter *e = scene->emitters[k];
    const struct imp_texcoord nowhere = {.shape = e->shape};
    const double across = imp__sqr(b->size) / 4;
    imp_spec in[IMP_INPUTS_MAX];
    if (e->ops->flags & IMP_EMITTER_ENVIRONMENT)
        return across * imp__sky_whole(b->tracer, k);
    if (e->input[0]->texture) picture_mean(e, in);
    else if (b->tracer->wavelengths)
        imp__input_most(e->input[0], &nowhere.p, &nowhere.p, &in[0]);
    else imp__inputs_eval(e->input, e->n_in, &nowhere, in);
    const bool table = e->ops == &imp__ies_light || e->ops == &imp__ies_area;
    const double size = table      ? imp__ies_flux(e->self) * IMP_INV_PI
                        : e->shape ? e->shape->area
                        : e->ops->flags & IMP_EMITTER_FAR ? across
                                                          : 4;
    return size * imp__max_used(in[0], scene->lanes == 4);
}

static enum imp_status lights_make(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    double sum = 0;
    b->light_cdf =
        imp__alloc(scene->ctx, (size_t)scene->n_emitters + 1, sizeof *b->light_cdf);
    b->drawn =
        imp__alloc(scene->ctx, 2 * (size_t)scene->n_emitters + 1, sizeof *b->drawn);
    if (!b->light_cdf || !b->drawn)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for lights");
    b->drawn_to_meter = b->drawn + scene->n_emitters;
    for (int k = 0; k < scene->n_emitters; k++) {
        const bool sky = scene->emitters[k]->ops->flags & IMP_EMITTER_ENVIRONMENT;
        b->drawn[k] = sky && imp__sky_has_draws(scene, k);
        b->drawn_to_meter[k] =
            b->drawn[k] && (imp__moves_shape(b->moves, IMP_MOVE_EMITTER(k), NULL) ||
                            imp__sky_is_narrow(b->tracer, k));
        if (!sky || b->drawn[k]) {
            sum += light_power(b, k);
            b->n_lights++;
        }
        b->light_cdf[k] = sum;
    }
    for (int k = 0; k < scene->n_emitters && sum > 0; k++) b->light_cdf[k] /= sum;
    if (!(sum > 0)) b->n_lights = 0;
    return IMP_OK;
}

/* As far as boxes of media are, which may be larger than the scene. */
static double outside_of(const struct imp_scene *scene, double size)
{
    const imp_v3 middle = (scene->lo + scene->hi) * 0.5;
    double far = 2 * size;
    for (int k = 0; k < scene->n_media; k++) {
        const struct imp_majorants *g = scene->media[k]->majorants;
        for (int i = 0; g && i < 8; i++) {
            const imp_v3 unit = imp__v3(i & 1, i >> 1 & 1, i >> 2);
            far = imp_max(
                far, 2 * (size + imp__length(imp__point(&g->to_world, unit) - middle)));
        }
    }
    return far;
}

enum imp_status imp__boundary_begin(const struct imp_tracer *tracer,
                                    const struct imp__moves *moves,
                                    const struct imp__edges *edges,
                                    struct imp__boundary *out)
{
    const struct imp_scene *scene = tracer->scene;
    *out = (struct imp__boundary){.tracer = tracer, .moves = moves, .edges = edges};
    out->plain = *tracer;
    out->plain.value_only = true;
    out->plain.active = NULL;
    out->size = imp__length(scene->hi - scene->lo);
    out->through = imp__segment_first(tracer)->through;
    imp_spec extinction;
    out->outside = outside_of(scene, out->size);
    out->media = moves->borders.any;
    if (!out->media && imp__fog(tracer, NULL, &extinction))
        out->fog = tracer->sensor->medium;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_bsdf *bsdf = imp__shape_bsdf(scene, scene->shapes[k]);
        out->passes |= bsdf->straight != 0;
        const struct imp_shape *s = scene->shapes[k];
        out->one_sided |= s->geometry == IMP_CURVES;
        const bool mirrors = imp__mirror_lobes(bsdf) != 0;
        out->mirrors |= mirrors;
        out->bends |= imp__is_glass(bsdf) || (mirrors && s->geometry != IMP_TRIANGLES &&
                                              !(s->ops->flags & IMP_SHAPE_FLAT));
    }
    enum imp_status st = imp__moved_allowed(tracer);
    if (tracer->sensor->shape) /* by which edges are chosen: the middle of a meter */
        out->camera = (tracer->sensor->shape->lo + tracer->sensor->shape->hi) * 0.5;
    else imp__lens_middle(tracer->sensor, &out->camera);
    imp_v3 point;
    struct imp_sensor_ray ray;
    out->rays = imp__sees_rays(tracer->sensor, &point);
    out->parallel = !out->rays && tracer->sensor->ops->flags & IMP_SENSOR_PARALLEL;
    out->wide = out->rays || (!out->parallel && !imp__pinhole(tracer->sensor, &point));
    if (out->rays) imp__ray_looked_at(out, &out->camera);
    if (out->parallel) {
        tracer->sensor->ops->ray(tracer->sensor, 0, 0, (const double[2]){0.5, 0.5}, &ray);
        out->camera = ray.d;
    }
    if (st == IMP_OK) st = imp__boundary_allowed(out);
    if (st == IMP_OK) st = imp__mirrors_find(out);
    if (st == IMP_OK) st = lights_make(out);
    if (st == IMP_OK) st = imp__boundary_choices_make(out);
    return st;
}

void imp__boundary_free(struct imp__boundary *b)
{
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->light_cdf);
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->drawn);
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->plane);
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->plane_of);
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->bender);
    for (int k = 0; k < IMP_BOUNDARY_KINDS; k++) {
        imp__edge_choice_free(&b->choice[k]);
        if (b->tracer) imp__release(b->tracer->scene->ctx, b->part[k]);
    }
    for (int k = 0; k < b->n_items; k++)
        imp__edge_item_free(b->tracer->scene->ctx, &b->item[k]);
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->item);
    imp__edge_tree_free(&b->tree);
    *b = (struct imp__boundary){0};
}

struct imp__flux *imp__flux_add(struct imp__edge_draw *d, int n)
{
    struct imp__flux *f = imp__arena_take(d->arena, 1, sizeof *f);
    struct imp__flux_end *end = imp__arena_take(d->arena, (size_t)n, sizeof *end);
    if (!f || !end) {
        d->no_memory = true;
        return NULL;
    }
    *f = (struct imp__flux){.end = end};
    *d->end = f;
    d->end = &f->next;
    return f;
}

/* Wavelengths of a draw, each on its own. False: no memory. */
static bool waves_draw(struct imp__edge_draw *d)
{
    const struct imp_wavelengths *all = d->b->tracer->wavelengths;
    if (imp_likely(!all)) return true;
    struct imp_waves *waves = imp__arena_take(d->arena, 1, sizeof *waves);
    if (!waves) {
        d->no_memory = true;
        return false;
    }
    imp__waves_make(all, imp__u01(d->key, IMP_EDGE_WAVE), waves);
    waves->drew = imp__lane_drawn(d->key, all->lanes);
    d->waves = waves;
    return true;
}

/* The point through which the draw is seen. */
static void eye_draw(struct imp__edge_draw *d)
{
    const struct imp_sensor *s = d->b->tracer->sensor;
    for (unsigned k = 0; k < 4; k++)
        d->lens[k] = d->b->wide ? imp__u01(d->key, IMP_EDGE_SENSOR + k) : 0;
    d->eye = d->b->camera;
    if (imp_unlikely(d->b->rays)) imp__ray_draw(d);
    else if (d->b->wide && !s->shape) imp__lens_point(s, d->lens, &d->eye);
    if (imp_unlikely(s->shape && d->b->n_planes + d->b->n_benders > 0)) {
        struct imp_surface at = {.uv = {0}};
        imp__meter_draw(s, d->lens, &at);
        d->eye = at.p;
    }
}

/* An edge as the sensor sees it, and in mirrors. */
static void film_work(struct imp__edge_draw *d)
{
    const double u = d->u, chance = d->chance;
    if (d->b->tracer->sensor->shape) imp__draw_meter(d);
    else if (d->b->rays) imp__draw_ray(d);
    else imp__draw_film(d);
    for (int bent = 0; bent < 2; bent++) {
        if (imp_likely((bent ? d->b->n_benders : d->b->n_planes) == 0)) continue;
        d->u = u;
        d->chance = chance;
        d->rim = d->touches = false;
        imp__draw_mirrored(d, bent);
    }
}

static void kind_work(struct imp__edge_draw *d, enum imp__boundary_kind kind)
{
    const enum imp__edge_item_kind item = d->item ? d->item->kind : IMP_ITEM_ROUND;
    switch (kind) {
    case IMP_BOUNDARY_FILM:
        if (item == IMP_ITEM_ROUND || item == IMP_ITEM_ARC) film_work(d);
        if (item == IMP_ITEM_SHADING) {
            if (d->b->rays) imp__draw_shading_ray(d);
            else imp__draw_shading_film(d);
            if (imp_unlikely(d->b->n_planes > 0)) imp__draw_shading_mirrored(d);
        }
        if (item == IMP_ITEM_SKY) {
            imp__draw_sky_film(d);
            if (imp_unlikely(d->b->n_planes > 0)) imp__draw_sky_mirrored(d);
            if (imp_unlikely(d->b->n_benders > 0)) imp__draw_sky_bent(d);
        }
        if (item == IMP_ITEM_MEDIUM) imp__draw_border_film(d);
        break;
    case IMP_BOUNDARY_LIGHT:
        if (item == IMP_ITEM_BORDER) imp__draw_border(d);
        else if (item == IMP_ITEM_MEDIUM) imp__draw_border_light(d);
        else imp__draw_light(d);
        break;
    case IMP_BOUNDARY_SCATTER:
        if (item == IMP_ITEM_ROUND || item == IMP_ITEM_ARC) imp__draw_scatter(d);
        if (item == IMP_ITEM_SHADING) imp__draw_shading_scatter(d);
        if (item == IMP_ITEM_HORIZON) imp__draw_horizon(d);
        if (item == IMP_ITEM_MEDIUM) imp__draw_border_scatter(d);
        if (item == IMP_ITEM_SKY && d->b->n_benders > 0) imp__draw_sky_scatter(d);
        break;
    }
}

void imp__boundary_work(struct imp__edge_draw *d, enum imp__boundary_kind kind)
{
    d->part = d->b->part[kind];
    d->end = &d->first;
    d->edges = d->b->edges;
    d->time = imp__sensor_time(d->b->tracer->sensor, imp__u01(d->key, IMP_EDGE_TIME));
    eye_draw(d);
    if (!waves_draw(d)) return;
    if (imp_unlikely(d->b->fog != NULL))
        imp__fog(d->b->tracer, imp__edge_waves(d), &d->extinction);
    if (!imp__edge_item_choose(d)) return;
    kind_work(d, kind);
    for (struct imp__flux *f = d->waves ? d->first : NULL; f; f = f->next)
        f->L = imp__waves_channels(d->waves, f->L);
}

struct imp__flux *imp__boundary_draw(const struct imp__boundary *b,
                                     struct imp_arena *arena,
                                     enum imp__boundary_kind kind, int64_t index,
                                     struct imp__stratum stratum, bool *no_memory)
{
    struct imp__edge_draw d = {.b = b, .arena = arena, .choice = &b->choice[kind]};
    if (b->edges->n == 0 && b->n_items == 0) return NULL;
    /* Walks of pictures have smaller numbers in the place of the kind. */
    d.key = imp__key(b->tracer->seed, UINT64_MAX - (uint64_t)kind, (uint64_t)index);
    d.u = ((double)stratum.k + imp__u01(d.key, IMP_EDGE_WHICH)) / (double)stratum.n;
    d.u = imp_min(d.u, 1 - 0x1p-53);
    imp__boundary_work(&d, kind);
    *no_memory |= d.no_memory;
    const struct imp_camera_gain *gain = b->tracer->sensor->gain;
    for (struct imp__flux *f = gain ? d.first : NULL; f; f = f->next)
        f->L *= imp__gain_at(gain, b->tracer->photograph, f->px, f->py, NULL);
    return d.first;
}

/* What a velocity counts. */
static double velocity_times(const struct imp__glued *x, const struct imp__velocity *bar,
                             const struct imp__velocity *v)
{
    const double sum = imp__dot(bar->v, v->v) + imp__dot(bar->n, v->n);
    return x->smooth ? sum + imp__dot(bar->shade, v->shade) : sum;
}

double imp__flux_velocity(const struct imp__moves *moves, const struct imp__flux *flux,
                          const double *theta_dot)
{
    double sum = 0;
    for (int k = 0; k < flux->n_ends; k++) {
        const struct imp__flux_end *e = &flux->end[k];
        struct imp__velocity v = {.area = 0};
        if (e->camera) v.v = imp__camera_velocity(moves, e->eye, e->x.p, theta_dot);
        else if (e->light)
            v.v = imp__light_velocity(moves, e->light - 1, e->x.p, theta_dot) +
                  imp__cross(imp__light_turn(moves, e->light - 1, theta_dot), e->eye) +
                  imp__light_spread(moves, e->light - 1, e->eye, theta_dot);
        else v = imp__velocity_of(moves, &e->x, theta_dot);
        sum += velocity_times(&e->x, &e->bar, &v);
    }
    return sum;
}

static void light_bar(const struct imp__moves *moves, const struct imp__flux_end *e,
                      imp_v3 bar, double *theta_bar)
{
    imp__light_velocity_bar(moves, e->light - 1, e->x.p, bar, theta_bar);
    if (!imp__is_zero(e->eye))
        imp__light_turn_bar(moves, e->light - 1, imp__cross(e->eye, bar), theta_bar);
    imp__light_spread_bar(moves, e->light - 1, e->eye, bar, theta_bar);
}

void imp__flux_bar(const struct imp__moves *moves, const struct imp__flux *flux,
                   double bar, double *theta_bar)
{
    for (int k = 0; k < flux->n_ends; k++) {
        const struct imp__flux_end *e = &flux->end[k];
        const struct imp__velocity v = {
            .v = e->bar.v * bar, .n = e->bar.n * bar, .shade = e->bar.shade * bar};
        if (e->camera) imp__camera_velocity_bar(moves, e->eye, e->x.p, v.v, theta_bar);
        else if (e->light) light_bar(moves, e, v.v, theta_bar);
        else imp__velocity_bar(moves, &e->x, &v, theta_bar);
    }
}
