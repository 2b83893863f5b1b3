/* SPDX-License-Identifier: Apache-2.0
 *
 * Draws of the boundary, and what they bring as derivatives (boundary.h). */
#include "base/context.h"
#include "boundary_parts.h"
#include "scene/camera_gain.h"
#include "scene/pose.h"

/* Area lights by area times radiance. */
static enum imp_status lights_make(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    double sum = 0;
    b->light_cdf =
        imp__alloc(scene->ctx, (size_t)scene->n_emitters + 1, sizeof *b->light_cdf);
    if (!b->light_cdf) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for lights");
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        const struct imp_texcoord nowhere = {.shape = e->shape};
        imp_spec in[IMP_INPUTS_MAX];
        if (e->shape) {
            imp__inputs_eval(e->input, e->n_in, &nowhere, in);
            sum += e->shape->area * imp__max_used(in[0], scene->lanes == 4);
            b->n_lights++;
        }
        b->light_cdf[k] = sum;
    }
    for (int k = 0; k < scene->n_emitters && sum > 0; k++) b->light_cdf[k] /= sum;
    if (!(sum > 0)) b->n_lights = 0;
    return IMP_OK;
}

static enum imp_status edges_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp__edge *torn = imp__edges_torn(b->edges, b->moves);
    if (torn)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: an edge of shape '%s' at (%g, %g, %g) "
            "lies on another one, which moves differently",
            scene->shapes[b->edges->face[torn->first].shape]->name, torn->a[0],
            torn->a[1], torn->a[2]);
    int other = -1;
    const int pierced = imp__edges_pierced(b->edges, scene, &other);
    if (pierced >= 0)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: shape '%s' passes through shape '%s', "
            "and where they meet is no edge",
            scene->shapes[other]->name, scene->shapes[pierced]->name);
    return IMP_OK;
}

enum imp_status imp__boundary_begin(const struct imp_tracer *tracer,
                                    const struct imp__moves *moves,
                                    const struct imp__edges *edges,
                                    struct imp__boundary *out)
{
    const struct imp_scene *scene = tracer->scene;
    *out = (struct imp__boundary){.tracer = tracer, .moves = moves, .edges = edges};
    out->size = imp__length(scene->hi - scene->lo);
    enum imp_status st = imp__moved_allowed(tracer);
    if (st == IMP_OK) st = edges_allowed(out);
    imp__pinhole(tracer->sensor, &out->camera);
    if (st == IMP_OK) st = lights_make(out);
    return st;
}

void imp__boundary_free(struct imp__boundary *b)
{
    if (b->tracer) imp__release(b->tracer->scene->ctx, b->light_cdf);
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

struct imp__flux *imp__boundary_draw(const struct imp__boundary *b,
                                     struct imp_arena *arena,
                                     enum imp__boundary_kind kind, int64_t index,
                                     bool *no_memory)
{
    struct imp__edge_draw d = {.b = b, .arena = arena};
    if (b->edges->n == 0) return NULL;
    /* Walks of pictures have smaller numbers in the place of the kind. */
    d.key = imp__key(b->tracer->seed, UINT64_MAX - (uint64_t)kind, (uint64_t)index);
    d.edge = imp__edges_draw(b->edges, imp__u01(d.key, IMP_EDGE_WHICH), &d.p);
    d.along = imp__normalize(d.edge->b - d.edge->a);
    d.inv_pdf = b->edges->until[b->edges->n - 1];
    d.end = &d.first;
    switch (kind) {
    case IMP_BOUNDARY_FILM: imp__draw_film(&d); break;
    case IMP_BOUNDARY_LIGHT: imp__draw_light(&d); break;
    case IMP_BOUNDARY_SCATTER: imp__draw_scatter(&d); break;
    }
    *no_memory |= d.no_memory;
    const struct imp_camera_gain *gain = b->tracer->sensor->gain;
    for (struct imp__flux *f = gain ? d.first : NULL; f; f = f->next)
        f->L *= imp__gain_at(gain, b->tracer->photograph, f->px, f->py, NULL);
    return d.first;
}

double imp__flux_velocity(const struct imp__moves *moves, const struct imp__flux *flux,
                          const double *theta_dot)
{
    double sum = 0;
    for (int k = 0; k < flux->n_ends; k++) {
        const struct imp__flux_end *e = &flux->end[k];
        const imp_v3 v = e->camera ? imp__camera_velocity(moves, e->x.p, theta_dot)
                                   : imp__velocity_of(moves, &e->x, theta_dot).v;
        sum += imp__dot(e->bar, v);
    }
    return sum;
}

void imp__flux_bar(const struct imp__moves *moves, const struct imp__flux *flux,
                   double bar, double *theta_bar)
{
    for (int k = 0; k < flux->n_ends; k++) {
        const struct imp__flux_end *e = &flux->end[k];
        const struct imp__velocity v = {e->bar * bar, {0}, 0};
        if (e->camera) imp__camera_velocity_bar(moves, e->x.p, v.v, theta_bar);
        else imp__velocity_bar(moves, &e->x, &v, theta_bar);
    }
}
