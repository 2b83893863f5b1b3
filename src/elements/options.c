/* SPDX-License-Identifier: Apache-2.0
 *
 * Options: defaults, those of the scene's integrator, bounds, and copies of what the
 * host may free. */
#include "elements.h"
#include "elements_integrator.h"
#include <string.h>

/* At least 384 rays across the picture, 3 to 24 a side of a pixel: the edges of lamps in
 * view are then as well resolved in small pictures as in large ones (0.1 % of their
 * light; with 3 a pixel 8 % at 16 pixels across). A meter's rays have directions to cover,
 * too: up to 64 (0.3 %). */
static int rays_by_default(const struct imp_scene *scene, int sensor)
{
    if (sensor < 0 || sensor >= scene->n_sensors) return 3;
    const struct imp_film_desc *f = &scene->sensors[sensor]->film;
    const int across = imp_max(imp_min(f->crop_w, f->crop_h), 1);
    return imp_clamp((384 + across - 1) / across, 3,
                     scene->sensors[sensor]->shape ? 64 : 24);
}

enum imp_status imp__el_sensor_check(const imp_elements *e, int sensor)
{
    const int n = e->scene->n_sensors;
    if (n == 0)
        return imp__node_error(e->ctx, e->scene->root, IMP_E_SCENE,
                               "there is no sensor in it");
    if (sensor < 0 || sensor >= n)
        return imp__error(e->ctx, IMP_E_ARG, "there is no sensor %d; the scene has %d",
                          sensor, n);
    return IMP_OK;
}

/* What the host leaves at 0 comes from the scene's integrator. */
static void integrator_take(const struct imp_elements_integrator *s,
                            struct imp_elements_options *o)
{
    if (!s) return;
    o->no_importance |= s->no_importance;
    if (o->order == 0) o->order = s->order;
    if (o->rays == 0) o->rays = s->rays;
    if (o->stop == 0) o->stop = s->stop;
    if (o->eps_last == 0) o->eps_last = s->eps;
    if (o->max_level == 0) o->max_level = s->max_level;
    if (o->max_links == 0) o->max_links = s->max_links;
    if (o->max_bytes == 0) o->max_bytes = s->max_bytes;
}

static void defaults_take(const struct imp_scene *scene, struct imp_elements_options *o)
{
    if (o->rays == 0) o->rays = rays_by_default(scene, o->sensor);
    if (o->stop == 0) o->stop = 0.01;
    if (o->eps_first == 0) o->eps_first = 0.05;
    if (o->eps_last == 0) o->eps_last = 5e-6;
    if (o->sweeps == 0) o->sweeps = 4;
    if (o->final_sweeps == 0) o->final_sweeps = 12;
    if (o->max_level == 0) o->max_level = 9;
    if (o->max_links == 0) o->max_links = 20000000;
    if (o->max_bytes == 0) o->max_bytes = (size_t)4 << 30;
    o->max_links = imp_min(o->max_links, (size_t)UINT32_MAX - 1);
}

static enum imp_status numbers_check(imp_context *ctx,
                                     const struct imp_elements_options *o)
{
    if (o->order != 0 && (o->order < 2 || o->order > EL_ORDER_MAX))
        return imp__error(ctx, IMP_E_ARG, "directional order %d is outside 2..%d",
                          o->order, EL_ORDER_MAX);
    if (o->rays < 1 || o->rays > 64 || o->sweeps < 1 || o->final_sweeps < 0 ||
        o->max_level < 0 || o->max_level > EL_LEVEL_MAX)
        return imp__error(ctx, IMP_E_ARG,
                          "an option of the finite elements is outside its "
                          "range (rays 1..64, sweeps >= 1, level 0..%d)",
                          EL_LEVEL_MAX);
    if (!(o->eps_first > 0) || !(o->eps_last > 0) || !isfinite(o->eps_first) ||
        !isfinite(o->eps_last) || !isfinite(o->stop))
        return imp__error(
            ctx, IMP_E_ARG,
            "eps_first %g and eps_last %g must be positive, stop %g a number",
            o->eps_first, o->eps_last, o->stop);
    if (!(o->time_limit_s >= 0) || !isfinite(o->time_limit_s))
        return imp__error(ctx, IMP_E_ARG, "time_limit_s %g is not a number >= 0",
                          o->time_limit_s);
    return IMP_OK;
}

static enum imp_status arrays_check(imp_context *ctx,
                                    const struct imp_elements_options *o)
{
    const char *missing = o->n_sources && !o->sources ? "sources"
                          : o->n_phong && !o->phong   ? "phong"
                          : o->n_beams && !o->beams   ? "beams"
                                                      : NULL;
    return missing ? imp__error(ctx, IMP_E_ARG, "%s is NULL", missing) : IMP_OK;
}

/* ---- Copies: the host's arrays may go -------------------------------------------- */

static enum imp_status phong_copy(imp_elements *e, size_t i, struct imp_elements_phong *p)
{
    IMP_CHECKED(
        imp__element_take(e->ctx, "elements", "phong", e->opt.phong, i, p, sizeof *p));
    if (!p->shape || !(p->shape = imp__arena_strdup(&e->arena, p->shape)))
        return imp__error(e->ctx, IMP_E_ARG, "a Phong material needs a shape");
    for (int c = 0; c < 3; c++)
        if (!(p->kd[c] >= 0) || !(p->ks[c] >= 0) || !(p->kd[c] + p->ks[c] <= 1 + 1e-12))
            return imp__error(e->ctx, IMP_E_ARG,
                              "shape '%s': Phong coefficients must be "
                              ">= 0 with kd + ks <= 1",
                              p->shape);
    if (!(p->exponent >= 0) || p->exponent > 1e4)
        return imp__error(e->ctx, IMP_E_ARG, "shape '%s': Phong exponent %g", p->shape,
                          p->exponent);
    return IMP_OK;
}

static enum imp_status beam_copy(imp_elements *e, size_t i, struct imp_elements_beam *b)
{
    IMP_CHECKED(
        imp__element_take(e->ctx, "elements", "beams", e->opt.beams, i, b, sizeof *b));
    if (!b->shape || !(b->shape = imp__arena_strdup(&e->arena, b->shape)))
        return imp__error(e->ctx, IMP_E_ARG, "a beam needs a shape");
    if (!(b->exponent >= 0) || b->exponent > 1e6 || !isfinite(b->axis[0]) ||
        !isfinite(b->axis[1]) || !isfinite(b->axis[2]))
        return imp__error(e->ctx, IMP_E_ARG, "shape '%s': beam exponent %g or its axis",
                          b->shape, b->exponent);
    return IMP_OK;
}

/* Region of a camera's picture; all 0: the whole of it. */
static enum imp_status region_take(const imp_elements *e, struct imp_elements_source *s)
{
    IMP_CHECKED(imp__el_sensor_check(e, s->sensor));
    const struct imp_film_desc *f = &e->scene->sensors[s->sensor]->film;
    int *r = s->region;
    if (!r[0] && !r[1] && !r[2] && !r[3]) r[2] = f->crop_w, r[3] = f->crop_h;
    if (r[0] < 0 || r[1] < 0 || r[2] > f->crop_w || r[3] > f->crop_h || r[0] >= r[2] ||
        r[1] >= r[3])
        return imp__error(e->ctx, IMP_E_ARG,
                          "region %d,%d,%d,%d is not inside the "
                          "picture of %d x %d",
                          r[0], r[1], r[2], r[3], f->crop_w, f->crop_h);
    return IMP_OK;
}

/* Measurement i; without any, one of the whole picture. */
static enum imp_status source_copy(imp_elements *e, size_t i,
                                   struct imp_elements_source *s)
{
    const struct imp_elements_options *o = &e->opt;
    *s = (struct imp_elements_source){.size = sizeof *s, .sensor = o->sensor};
    if (o->n_sources)
        IMP_CHECKED(imp__element_take(e->ctx, "elements", "sources", o->sources, i, s,
                                      sizeof *s));
    if (s->weight == 0) s->weight = 1;
    if (!isfinite(s->weight))
        return imp__error(e->ctx, IMP_E_ARG, "weight %g of sources[%zu] is not finite",
                          s->weight, i);
    switch (s->kind) {
    case IMP_ELEMENTS_PLANE:
        for (int k = 0; k < 3; k++)
            if (!isfinite(s->origin[k]) || !isfinite(s->edge_u[k]) ||
                !isfinite(s->edge_v[k]))
                return imp__error(e->ctx, IMP_E_ARG,
                                  "a measuring plane's numbers are not finite");
        return IMP_OK;
    case IMP_ELEMENTS_SHAPE:
        if (!s->shape || !(s->shape = imp__arena_strdup(&e->arena, s->shape)))
            return imp__error(e->ctx, IMP_E_ARG, "a measurement has no shape");
        return IMP_OK;
    case IMP_ELEMENTS_CAMERA: return region_take(e, s);
    }
    return imp__error(e->ctx, IMP_E_ARG, "unknown kind of measurement %d", (int)s->kind);
}

static enum imp_status arrays_copy(imp_elements *e)
{
    struct imp_elements_options *o = &e->opt;
    struct imp_elements_phong *phong =
        imp__arena_array(&e->arena, o->n_phong + 1, sizeof *phong);
    struct imp_elements_beam *beams =
        imp__arena_array(&e->arena, o->n_beams + 1, sizeof *beams);
    e->n_sources = o->n_sources ? o->n_sources : 1;
    e->sources = imp__arena_array(&e->arena, e->n_sources, sizeof *e->sources);
    e->weight = imp__arena_array(&e->arena, e->n_sources, sizeof *e->weight);
    e->each = imp__arena_array(&e->arena, e->n_sources, sizeof *e->each);
    e->first_ray = imp__arena_array(&e->arena, e->n_sources, sizeof *e->first_ray);
    if (!phong || !beams || !e->sources || !e->weight || !e->each || !e->first_ray)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for options");
    for (size_t i = 0; i < o->n_phong; i++) IMP_CHECKED(phong_copy(e, i, &phong[i]));
    for (size_t i = 0; i < o->n_beams; i++) IMP_CHECKED(beam_copy(e, i, &beams[i]));
    for (size_t i = 0; i < e->n_sources; i++)
        IMP_CHECKED(source_copy(e, i, &e->sources[i]));
    o->phong = phong;
    o->beams = beams;
    o->sources = e->sources;
    return IMP_OK;
}

enum imp_status imp__el_options(imp_elements *e,
                                const struct imp_elements_options *options)
{
    struct imp_elements_options *o = &e->opt;
    IMP_CHECKED(imp__options_take(e->ctx, "elements", "options", options, o, sizeof *o));
    o->size = sizeof *o;
    integrator_take(imp__elements_integrator(e->scene->integrator), o);
    defaults_take(e->scene, o);
    IMP_CHECKED(numbers_check(e->ctx, o));
    IMP_CHECKED(arrays_check(e->ctx, o));
    if (e->scene->n_sensors > 0) IMP_CHECKED(imp__el_sensor_check(e, o->sensor));
    return arrays_copy(e);
}
