/* SPDX-License-Identifier: Apache-2.0 */
#include "record.h"
#include "bend/inside.h"
#include "math/hash.h"
#include "scene/fingerprint.h"
#include "segment.h"
#include <string.h>

_Static_assert(sizeof(struct imp_decision) <= 160, "a kept vertex");
_Static_assert(sizeof(struct imp_record_walk) == 56, "no padding: it is written");
_Static_assert(IMP_WALK_MAX <= UINT16_MAX, "imp_record_walk.n");

/* ---- Making ---------------------------------------------------------------------- */

static struct imp_record_of made_with(const struct imp_tracer *t)
{
    struct imp_record_of of = {
        imp__fingerprint_objects(t->scene), imp__fingerprint_sensor(t->sensor),
        imp__walk_integrator_hash(t->integrator), imp__fingerprint_rays(t->scene)};
    for (int m = 0; m < t->scene->n_bodies; m++)
        of.rays = imp__graded_hash(of.rays, t->scene->bodies[m]);
    if (t->wavelengths)
        of.integrator = imp__wavelengths_hash(of.integrator, t->wavelengths);
    return of;
}

enum imp_status imp__record_create(const struct imp_tracer *tracer, size_t budget,
                                   struct imp_record *out)
{
    imp_context *ctx = tracer->scene->ctx;
    if (tracer->integrator->alpha_gradient != IMP_ALPHA_DETACHED)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "walks are kept for detached derivatives only: "
                          "alpha_gradient moves their directions");
    if (tracer->split > 1 || tracer->integrator->split > 0)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "walks that split are not kept: of a walk and those that hang "
                          "on it, a record has the first");
    *out = (struct imp_record){.ctx = ctx, .of = made_with(tracer), .budget = budget};
    return IMP_OK;
}

void imp__record_destroy(struct imp_record *r)
{
    if (!r->ctx) return;
    for (size_t k = 0; k < r->n_walk_pages; k++) imp__release(r->ctx, r->walks[k]);
    for (size_t k = 0; k < r->n_vertex_pages; k++) imp__release(r->ctx, r->vertices[k]);
    imp__release(r->ctx, r->walks);
    imp__release(r->ctx, r->vertices);
    *r = (struct imp_record){.ctx = NULL};
}

static size_t bytes_of(size_t walks, size_t vertices)
{
    return walks * sizeof(struct imp_record_walk) +
           vertices * sizeof(struct imp_decision);
}
size_t imp__record_bytes(const struct imp_record *r)
{
    return bytes_of(r->n_walks, r->n_vertices);
}

/* Pages for n elements in all. False: no memory. */
static bool pages_add(imp_context *ctx, void ***pages, size_t *n_pages, size_t *cap,
                      size_t n, size_t size)
{
    const size_t wanted = n / IMP_RECORD_PAGE + (n % IMP_RECORD_PAGE != 0);
    while (*n_pages < wanted) {
        void **grown = imp__grow(ctx, *pages, cap, *n_pages + 1, sizeof *grown);
        if (!grown) return false;
        *pages = grown;
        grown[*n_pages] = imp__alloc_raw(ctx, IMP_RECORD_PAGE, size);
        if (!grown[*n_pages]) return false;
        ++*n_pages;
    }
    return true;
}

enum imp_status imp__record_reserve(struct imp_record *r, size_t walks, size_t vertices)
{
    const size_t n_walks = r->n_walks + walks, n_vertices = r->n_vertices + vertices;
    const size_t needed = bytes_of(n_walks, n_vertices);
    if (needed > r->budget)
        return imp__error(r->ctx, IMP_E_NOMEM,
                          "%zu kept walks of %zu vertices need %zu bytes; "
                          "the budget is %zu",
                          n_walks, n_vertices, needed, r->budget);
    if (!pages_add(r->ctx, (void ***)&r->walks, &r->n_walk_pages, &r->cap_walk_pages,
                   n_walks, sizeof **r->walks) ||
        !pages_add(r->ctx, (void ***)&r->vertices, &r->n_vertex_pages,
                   &r->cap_vertex_pages, n_vertices, sizeof **r->vertices))
        return imp__error(r->ctx, IMP_E_NOMEM, "no memory for %zu bytes of kept walks",
                          needed);
    return IMP_OK;
}

/* What was never decided is 0. */
static struct imp_decision decided(const struct imp_decision *d)
{
    struct imp_decision k;
    memset(&k, 0, sizeof k);
    k.shape = d->shape;
    k.scatterer = d->scatterer;
    k.connection = d->connection;
    k.glows = d->glows;
    k.goes_on = d->goes_on;
    k.drawn = d->goes_on ? d->drawn : 0;
    memcpy(k.uv, d->uv, sizeof k.uv);
    memcpy(k.p, d->p, sizeof k.p);
    if (d->scatterer != IMP_AT_SKY) memcpy(k.wo, d->wo, sizeof k.wo);
    k.passes = d->passes;
    k.glow_weight = d->glow_weight;
    k.met.emitter = k.light.emitter = -1;
    if (d->goes_on) {
        memcpy(k.wi, d->wi, sizeof k.wi);
        k.lobe = d->lobe;
        k.pdf = d->pdf;
        k.survive = d->survive;
    }
    if (d->met.emitter >= 0) k.met = d->met;
    if (d->connection != IMP_NOT_CONNECTED) k.light = d->light;
    return k;
}

enum imp_status imp__record_keep(struct imp_record *r, const struct imp_walk *walk,
                                 int64_t sample)
{
    if (walk->moving)
        return imp__error(r->ctx, IMP_E_UNSUPPORTED,
                          "a walk through a medium whose numbers are active cannot be "
                          "kept: its vertices move with them");
    if (walk->entry)
        return imp__error(r->ctx, IMP_E_UNSUPPORTED,
                          "a walk whose light enters at its vertices cannot be kept");
    for (const struct imp_vertex *v = walk->first; v; v = v->next)
        if (v->side)
            return imp__error(r->ctx, IMP_E_UNSUPPORTED,
                              "a walk with others that hang on it cannot be kept");
        else if (v->on || v->to_light)
            return imp__error(r->ctx, IMP_E_UNSUPPORTED,
                              "a walk that crosses media cannot be kept: what collided "
                              "with it on its segments is not");
    const bool counts = walk->valid && walk->dropped == IMP_DROP_NONE;
    const int n = counts ? walk->n : 0;
    const enum imp_status st = imp__record_reserve(r, 1, (size_t)n);
    if (st != IMP_OK) return st;
    r->walks[r->n_walks / IMP_RECORD_PAGE][r->n_walks % IMP_RECORD_PAGE] =
        (struct imp_record_walk){.px = walk->px,
                                 .py = walk->py,
                                 .wave = walk->wave,
                                 .key = walk->key,
                                 .sample = sample,
                                 .first = r->n_vertices,
                                 .n = (uint16_t)n,
                                 .valid = walk->valid,
                                 .absorbed = walk->absorbed,
                                 .dropped = (uint8_t)walk->dropped};
    r->n_walks++;
    for (const struct imp_vertex *v = walk->first; n > 0 && v; v = v->next) {
        r->vertices[r->n_vertices / IMP_RECORD_PAGE][r->n_vertices % IMP_RECORD_PAGE] =
            decided(&v->d);
        r->n_vertices++;
    }
    return IMP_OK;
}

/* ---- Evaluating ------------------------------------------------------------------ */

enum imp_status imp__record_same(imp_context *ctx, const char *what,
                                 const struct imp_record_of *is,
                                 const struct imp_record_of *of)
{
    const char *differs =
        is->objects != of->objects         ? "its objects or parameters differ"
        : is->sensor != of->sensor         ? "its sensor or film differs"
        : is->integrator != of->integrator ? "the integrator's settings differ"
        : is->rays != of->rays ? "a parameter that moves rays has another value"
                               : NULL;
    if (!differs) return IMP_OK;
    return imp__error(ctx, IMP_E_ARG, "%s: walks of another scene: %s", what, differs);
}

enum imp_status imp__record_check(const struct imp_record *r,
                                  const struct imp_tracer *tracer)
{
    const struct imp_record_of of = made_with(tracer);
    return imp__record_same(r->ctx, "kept walks", &r->of, &of);
}

static struct imp_vertex *vertex_add(const struct imp_scene *scene,
                                     struct imp_arena *arena, struct imp_walk *walk,
                                     const struct imp_decision *d)
{
    const struct imp_shape *shape = d->shape < 0 ? NULL : scene->shapes[d->shape];
    const struct imp_bsdf *bsdf = shape ? imp__shape_bsdf(scene, shape) : NULL;
    const size_t n_in = bsdf ? (size_t)bsdf->n_in : 0;
    struct imp_vertex *v = imp__arena_take(arena, 1, sizeof *v + n_in * sizeof *v->in);
    if (imp_unlikely(!v)) return NULL;
    v->prev = walk->last;
    v->next = NULL;
    if (walk->last) walk->last->next = v;
    else walk->first = v;
    walk->last = v;
    walk->n++;
    v->bsdf = bsdf;
    v->shape = shape;
    v->side = NULL;
    v->carried = walk->waves ? &walk->waves->carried : NULL;
    v->t = 0;
    v->ng = (imp_v3){0};
    v->segment = &imp__straight;
    v->on = v->to_light = NULL;
    v->probe = NULL;
    v->in = (imp_spec *)(v + 1);
    v->d = *d;
    return v;
}

void imp__record_walk(const struct imp_record *r, size_t i,
                      const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk)
{
    const struct imp_record_walk *k = imp__record_at(r, i);
    *walk = (struct imp_walk){.px = k->px,
                              .py = k->py,
                              .key = k->key,
                              .valid = k->valid,
                              .absorbed = k->absorbed,
                              .dropped = (enum imp_drop)k->dropped};
    if (tracer->wavelengths && !imp__walk_wave(tracer, arena, k->wave, walk)) return;
    for (uint64_t j = k->first; j < k->first + k->n; j++)
        if (!vertex_add(tracer->scene, arena, walk,
                        &r->vertices[j / IMP_RECORD_PAGE][j % IMP_RECORD_PAGE])) {
            walk->dropped = IMP_DROP_MEMORY;
            return;
        }
    imp__walk_evaluate(tracer, walk);
    imp__walk_close(tracer, walk);
}
