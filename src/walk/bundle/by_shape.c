/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a depth in an order that fills lanes: those on one shape together; those on shapes
 * that few rays meet by their materials; the rest, and what has no form in lanes, one by one. */
#include "by_shape.h"
#include "in_media.h"
#include "lanes_light.h"
#include "swept.h"

#define TAKE(p) ((p) = imp__arena_take(arena, n + IMP_COLUMN_SLACK, sizeof *(p)))

bool imp__by_shape_create(const struct imp_tracer *tracer, struct imp_arena *arena,
                          size_t n, struct imp_by_shape *s)
{
    const struct imp_scene *scene = tracer->scene;
    s->lanes = imp__lanes_fit(tracer);
    s->sky = s->lanes && imp__lanes_sky_fits(tracer);
    s->count = imp__arena_array(arena, (size_t)scene->n_shapes, sizeof *s->count);
    s->materials =
        imp__arena_array(arena, (size_t)scene->n_bsdfs + 2, sizeof *s->materials);
    return s->count && s->materials && TAKE(s->shape) && TAKE(s->order) && TAKE(s->few) &&
           TAKE(s->by_material);
}

int imp__by_shape_count(struct imp_by_shape *s, const struct imp_hit_columns *hits, int n)
{
    int missed = 0;
    s->n = 0;
    for (int i = 0; i < n; i++) {
        const int shape = hits->shape[i];
        if (shape == -1) s->order[missed++] = i;
        else if (shape >= 0 && s->count[shape]++ == 0) s->shape[s->n++] = shape;
    }
    return missed;
}

void imp__by_shape_order(struct imp_by_shape *s, const struct imp_hit_columns *hits,
                         int n)
{
    int from = 0;
    for (int k = 0; k < s->n; k++) {
        const int count = s->count[s->shape[k]];
        s->count[s->shape[k]] = from;
        from += count;
    }
    for (int i = 0; i < n; i++)
        if (hits->shape[i] >= 0) s->order[s->count[hits->shape[i]]++] = i;
}

/* Sorts the rays that meet something; the sky goes to the others. */
static void sort(struct imp_depth *d, double *const beyond[4], struct imp_by_shape *s)
{
    const int n = d->rays->ray.n, missed = imp__by_shape_count(s, d->hits, n);
    if (s->sky) imp__lanes_sky_meet(d, s->order, missed, beyond);
    else if (d->bundle->tracer->scene->n_environments > 0)
        for (int k = 0; k < missed; k++) imp__sky_alone(d, s->order[k], beyond);
    imp__by_shape_order(s, d->hits, n);
}

static void alone(struct imp_depth *d, const int32_t *order, int n)
{
    for (int i = 0; i < n; i++) imp__vertex_alone(d, order[i], d->values->n++);
}

static void in_lanes(struct imp_depth *d, const struct imp_bin *bin, const int32_t *order,
                     int n)
{
    imp__vertices_in_lanes(d, bin, order, n, d->values->n);
    d->values->n += n;
}

/* Nothing is met there, and nothing leaves. */
static void ends(struct imp_depth *d, const int32_t *order, int n)
{
    const struct imp_swept *s = d->bundle->swept;
    for (int i = 0; s && i < n; i++) s->count[d->rays->walk[order[i]]]++;
}

/* As they come: shapes of groups have numbers of their own. */
static void all_alone(struct imp_depth *d, double *const beyond[4])
{
    const bool sky = d->bundle->tracer->scene->n_environments > 0;
    for (int32_t i = 0; i < d->rays->ray.n; i++)
        if (d->hits->shape[i] >= 0) alone(d, &i, 1);
        else if (d->hits->shape[i] == IMP_HIT_COLLISION)
            imp__collision_alone(d, i, d->values->n++);
        else if (sky && d->hits->shape[i] == -1) imp__sky_alone(d, i, beyond);
}

static int material_of(const struct imp_depth *d, int ray)
{
    const struct imp_scene *scene = d->bundle->tracer->scene;
    return scene->shapes[d->hits->shape[ray]]->bsdf + 2;
}

void imp__by_shape_few(struct imp_depth *d, struct imp_by_shape *s, int n,
                       imp__few_make *make)
{
    const int materials = d->bundle->tracer->scene->n_bsdfs + 2;
    for (int i = 0; i < n; i++) s->materials[material_of(d, s->few[i])]++;
    for (int m = 0, from = 0; m < materials; m++) {
        const int count = s->materials[m];
        s->materials[m] = from;
        from += count;
    }
    for (int i = 0; i < n; i++)
        s->by_material[s->materials[material_of(d, s->few[i])]++] = s->few[i];
    for (int m = 0, from = 0; m < materials; m++) {
        const int count = s->materials[m] - from;
        if (count > 0) make(d, s->by_material + from, count);
        from += count;
        s->materials[m] = 0;
    }
}

void imp__few_bin(const struct imp_depth *d, const int32_t *order, int n,
                  struct imp_bin *bin)
{
    const struct imp_tracer *tracer = d->bundle->tracer;
    imp__shape_bin(tracer, d->hits->shape[order[0]], bin);
    bin->surface = NULL;        /* they are on several shapes, */
    for (int i = 0; i < n; i++) /* of which some have textures by triangle */
        bin->texels &= !tracer->scene->shapes[d->hits->shape[order[i]]]->by_triangle;
}

static void few_vertices(struct imp_depth *d, const int32_t *order, int n)
{
    struct imp_bin bin;
    if (n < IMP_LANES_FEW) {
        alone(d, order, n);
        return;
    }
    imp__few_bin(d, order, n, &bin);
    in_lanes(d, &bin, order, n);
}

/* Those in media, medium by medium. s->few is free. */
static void collisions(struct imp_depth *d, struct imp_by_shape *s)
{
    int n = 0;
    for (int i = 0; i < d->rays->ray.n; i++)
        if (d->hits->shape[i] == IMP_HIT_COLLISION) s->few[n++] = i;
    for (int i = 0; d->last && i < n; i++)
        d->bundle->valid[d->rays->walk[s->few[i]]] = true;
    while (n > 0 && !d->last) {
        const int medium = d->media->here[s->few[0]];
        struct imp_bin bin;
        int here = 0, rest = 0;
        for (int i = 0; i < n; i++) {
            const int32_t ray = s->few[i];
            if (d->media->here[ray] == medium) s->order[here++] = ray;
            else s->few[rest++] = ray;
        }
        n = rest;
        if (here >= IMP_LANES_FEW && imp__collision_bin(d->bundle->tracer, medium, &bin))
            in_lanes(d, &bin, s->order, here);
        else
            for (int i = 0; i < here; i++)
                imp__collision_alone(d, s->order[i], d->values->n++);
    }
}

void imp__vertices(struct imp_depth *d, double *const beyond[4], struct imp_by_shape *s)
{
    const struct imp_tracer *tracer = d->bundle->tracer;
    d->values->n = 0;
    if (!s->lanes || d->depth + d->bundle->before >= IMP_WALK_MAX) {
        all_alone(d, beyond);
        return;
    }
    const int max_depth = tracer->integrator->max_depth;
    int few = 0;
    d->last = max_depth >= 0 && d->depth + 1 >= max_depth;
    sort(d, beyond, s);
    for (int k = 0, from = 0; k < s->n; k++) {
        const int shape = s->shape[k], n = s->count[shape] - from;
        const int32_t *order = s->order + from;
        struct imp_bin bin;
        from += n;
        s->count[shape] = 0;
        if (!imp__shape_in_lanes(tracer, shape)) {
            alone(d, order, n);
        } else if (d->last && !d->bundle->walks) {
            ends(d, order, n);
        } else if (n >= IMP_LANES_FEW) {
            imp__shape_bin(tracer, shape, &bin);
            in_lanes(d, &bin, order, n);
        } else {
            for (int i = 0; i < n; i++) s->few[few++] = order[i];
        }
    }
    if (few > 0) imp__by_shape_few(d, s, few, few_vertices);
    if (d->media) collisions(d, s);
}
