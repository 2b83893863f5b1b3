/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks read back: vertices, tracks and side walks from their decisions, and the
 * values that the scene's present parameters give them. */
#include "record.h"
#include <string.h>

#define AHEAD 6  /* vertices that are fetched ahead */
#define SHORT 64 /* vertices of walks of which none are made for their value alone */

static struct imp_vertex *vertex_add(const struct imp_scene *scene,
                                     struct imp_arena *arena, struct imp_walk *walk,
                                     const uint32_t *kept)
{
    const struct imp_bsdf *bsdf = imp__packed_bsdf(scene, kept);
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
    imp__packed_get(kept, &v->d);
    v->shape = bsdf && v->d.scatterer != IMP_IN_MEDIUM ? scene->shapes[v->d.shape] : NULL;
    v->side = NULL;
    v->carried = walk->waves ? &walk->waves->carried : NULL;
    v->t = 0;
    v->ng = (imp_v3){0};
    v->segment = &imp__straight;
    v->on = v->to_light = NULL;
    v->probe = NULL;
    v->in = (imp_spec *)(v + 1);
    return v;
}

/* A walk while it is read back. */
struct reading {
    const struct imp_record *record;
    const struct imp_scene *scene;
    struct imp_arena *arena;
    struct imp_walk *walk;
    const struct imp_record_walk *kept;
    struct {
        struct imp_vertex *v;
        struct imp_side **end; /* of the list of those that hang on it */
    } * vertex;                /* [kept->n_vertices]; NULL where there are no items */
    uint32_t item;
};

/* Vertices [first, first + n) of the recorded walk become those of `walk`. */
static bool vertices_get(struct reading *g, struct imp_walk *walk, uint32_t first,
                         uint32_t n)
{
    for (uint32_t k = first; k < first + n; k++) {
        struct imp_vertex *v = vertex_add(
            g->scene, g->arena, walk, imp__record_words(g->record, g->kept->first + k));
        if (imp_unlikely(!v)) return false;
        if (imp_likely(g->vertex == NULL)) continue;
        g->vertex[k].v = v;
        g->vertex[k].end = &v->side;
    }
    return true;
}

static const union imp_kept *item_get(struct reading *g)
{
    return imp__record_item(g->record, g->kept->first_item + g->item++);
}

static struct imp_track *track_get(struct reading *g, const union imp_kept *head)
{
    const union imp_kept *way = item_get(g);
    const int n = (int)way->way.n;
    struct imp_track *track = imp__arena_take(g->arena, 1, sizeof *track);
    if (!track) return NULL;
    *track = (struct imp_track){.n = n, .cap = n};
    memcpy(track->o, head->head.o, sizeof track->o);
    memcpy(track->d, way->way.d, sizeof track->d);
    track->event =
        n == 0 ? NULL : imp__arena_take(g->arena, (size_t)n, sizeof *track->event);
    if (n > 0 && !track->event) return NULL;
    for (int i = 0; i < n; i++) track->event[i] = item_get(g)->event;
    return track;
}

/* Behind those that hang on the vertex already, as tracing had them. */
static struct imp_side *side_add(struct reading *g, struct imp_side ***end)
{
    struct imp_side *side = imp__arena_take(g->arena, 1, sizeof *side);
    if (!side) return NULL;
    *side = (struct imp_side){.walk = {.px = g->walk->px,
                                       .py = g->walk->py,
                                       .time = g->walk->time,
                                       .waves = g->walk->waves,
                                       .wave = g->walk->wave,
                                       .valid = true}};
    **end = side;
    *end = &side->next;
    return side;
}

/* What belongs to the vertices. False: no memory. */
static bool items_get(struct reading *g)
{
    while (g->item < g->kept->n_items) {
        const union imp_kept *head = item_get(g);
        struct imp_vertex *v = g->vertex[head->head.at].v;
        if (head->head.kind == IMP_KEPT_SIDE) {
            struct imp_side *side = side_add(g, &g->vertex[head->head.at].end);
            if (!side) return false;
            side->walk.depth = head->head.side.depth;
            if (!vertices_get(g, &side->walk, head->head.side.first, head->head.side.n))
                return false;
        } else {
            struct imp_track *track = track_get(g, head);
            if (!track) return false;
            if (head->head.kind == IMP_KEPT_ON) v->on = track;
            else v->to_light = track;
        }
    }
    return true;
}

/* The value alone, without making vertices: what evaluate and fold give, to the bit. */
static void value_fold(const struct imp_record *r, const struct imp_record_walk *k,
                       const struct imp_tracer *tracer, struct imp_walk *walk)
{
    const struct imp_carried *carried = walk->waves ? &walk->waves->carried : NULL;
    struct imp_values v[SHORT];
    imp_spec L = {0};
    for (int j = 0; j < k->n; j++) { /* in the order of memory */
        struct imp_decision d;
        imp__record_vertex(r, k->first + (uint64_t)j, &d);
        imp__decided_values(tracer, &d, imp__decided_bsdf(tracer->scene, &d), carried,
                            &v[j]);
    }
    for (int j = k->n; j-- > 0;) L = v[j].e + v[j].w * L + v[j].b;
    imp__walk_value(tracer, walk, L);
}

/* What is read next lies behind what is read now, and has left the caches. */
static inline void fetch_ahead(const struct imp_record *r, size_t i,
                               const struct imp_record_walk *k)
{
    const uint64_t first = k->first + k->n_vertices;
    const uint64_t end = imp_min(first + AHEAD, (uint64_t)r->n_vertices);
    for (uint64_t j = first; j < end; j++) {
        const char *d = (const char *)imp__record_words(r, j);
        for (size_t b = 0; b < IMP_RECORD_FETCH; b += IMP_CACHE_LINE)
            __builtin_prefetch(d + b);
    }
    if (i + 2 < r->n_walks) __builtin_prefetch(imp__record_at(r, i + 2));
}

void imp__record_walk(const struct imp_record *r, size_t i,
                      const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk)
{
    const struct imp_record_walk *k = imp__record_at(r, i);
    fetch_ahead(r, i, k);
    struct reading g = {
        .record = r, .scene = tracer->scene, .arena = arena, .walk = walk, .kept = k};
    *walk = (struct imp_walk){.px = k->px,
                              .py = k->py,
                              .key = k->key,
                              .time = k->time,
                              .valid = k->valid,
                              .absorbed = k->absorbed,
                              .dropped = (enum imp_drop)k->dropped};
    if (tracer->wavelengths && !imp__walk_wave(tracer, arena, k->wave, walk)) return;
    bool whole = true;
    if ((tracer->value_only || !tracer->active) && k->n_items == 0 && k->n <= SHORT &&
        !tracer->integrator->first_hit) {
        value_fold(r, k, tracer, walk);
        return;
    }
    if (imp_unlikely(k->n_items > 0)) {
        g.vertex = imp__arena_take(arena, k->n_vertices, sizeof *g.vertex);
        whole = g.vertex != NULL;
    }
    whole = whole && vertices_get(&g, walk, 0, k->n) && items_get(&g);
    if (!whole) {
        walk->dropped = IMP_DROP_MEMORY;
        return;
    }
    if (k->n > 0 && walk->first->d.scatterer == IMP_AT_SENSOR) walk->depth = -1;
    imp__walk_evaluate(tracer, walk);
    imp__walk_close(tracer, walk);
    if (imp_unlikely(walk->dropped == IMP_DROP_NEGATIVE) && k->n_items > 0) {
        walk->dropped = IMP_DROP_NONE; /* 1 - sigma/b of a null collision */
        walk->values = imp__walk_fold(walk);
        walk->L = imp__walk_shown(tracer, walk, walk->values);
    }
}
