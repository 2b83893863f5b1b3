/* SPDX-License-Identifier: Apache-2.0
 *
 * Records of walks made, kept and read back in memory (record.h). */
#include "record.h"
#include "bend/inside.h"
#include "math/hash.h"
#include "scene/fingerprint.h"
#include "walk/core/segment.h"
#include <string.h>

_Static_assert(sizeof(struct imp_record_walk) == 80, "no padding: it is written");
_Static_assert(sizeof(union imp_kept) == 16, "a kept event");
_Static_assert(IMP_WALK_MAX <= UINT16_MAX, "imp_record_walk.n");

/* ---- Making ---------------------------------------------------------------------- */

struct imp_record_of imp__record_made_with(const struct imp_tracer *t)
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
    *out = (struct imp_record){
        .ctx = ctx, .of = imp__record_made_with(tracer), .budget = budget};
    return IMP_OK;
}

static void page_release(imp_context *ctx, struct imp_record_page *page)
{
    if (!page) return;
    imp__release(ctx, page->words);
    imp__release(ctx, page->start);
    imp__release(ctx, page);
}

static struct imp_record_page *page_make(imp_context *ctx)
{
    struct imp_record_page *page = imp__alloc(ctx, 1, sizeof *page);
    if (!page) return NULL;
    page->words = imp__alloc_raw(ctx, (size_t)IMP_RECORD_PAGE * IMP_PACKED_MOST,
                                 sizeof *page->words);
    page->start = imp__alloc_raw(ctx, IMP_RECORD_PAGE, sizeof *page->start);
    if (page->words && page->start) return page;
    page_release(ctx, page);
    return NULL;
}

void imp__record_destroy(struct imp_record *r)
{
    if (!r->ctx) return;
    for (size_t k = 0; k < r->n_walk_pages; k++) imp__release(r->ctx, r->walks[k]);
    for (size_t k = 0; k < r->n_vertex_pages; k++) page_release(r->ctx, r->vertices[k]);
    for (size_t k = 0; k < r->n_item_pages; k++) imp__release(r->ctx, r->items[k]);
    imp__release(r->ctx, r->walks);
    imp__release(r->ctx, r->vertices);
    imp__release(r->ctx, r->items);
    *r = (struct imp_record){.ctx = NULL};
}

static size_t bytes_of(size_t walks, size_t vertices, size_t words, size_t items)
{
    return walks * sizeof(struct imp_record_walk) + vertices * sizeof(uint16_t) +
           words * sizeof(uint32_t) + items * sizeof(union imp_kept);
}
size_t imp__record_bytes(const struct imp_record *r)
{
    return bytes_of(r->n_walks, r->n_vertices, r->n_words, r->n_items);
}

static size_t pages_of(size_t n)
{
    return n / IMP_RECORD_PAGE + (n % IMP_RECORD_PAGE != 0);
}

/* Pages for n elements in all. False: no memory. */
static bool pages_add(imp_context *ctx, void ***pages, size_t *n_pages, size_t *cap,
                      size_t n, size_t size)
{
    while (*n_pages < pages_of(n)) {
        void **grown = imp__grow(ctx, *pages, cap, *n_pages + 1, sizeof *grown);
        if (!grown) return false;
        *pages = grown;
        grown[*n_pages] = imp__alloc_raw(ctx, IMP_RECORD_PAGE, size);
        if (!grown[*n_pages]) return false;
        ++*n_pages;
    }
    return true;
}
static bool vertex_pages_add(struct imp_record *r, size_t n)
{
    while (r->n_vertex_pages < pages_of(n)) {
        void **grown = imp__grow(r->ctx, (void **)r->vertices, &r->cap_vertex_pages,
                                 r->n_vertex_pages + 1, sizeof *grown);
        if (!grown) return false;
        r->vertices = (struct imp_record_page **)grown;
        struct imp_record_page *page = page_make(r->ctx);
        if (!page) return false;
        r->vertices[r->n_vertex_pages++] = page;
    }
    return true;
}

enum imp_status imp__record_reserve(struct imp_record *r, size_t walks, size_t vertices,
                                    size_t words, size_t items)
{
    const size_t n_walks = r->n_walks + walks, n_vertices = r->n_vertices + vertices,
                 n_items = r->n_items + items;
    const size_t needed = bytes_of(n_walks, n_vertices, r->n_words + words, n_items);
    if (needed > r->budget)
        return imp__error(r->ctx, IMP_E_NOMEM,
                          "%zu recorded walks of %zu vertices need %zu bytes; "
                          "the budget is %zu",
                          n_walks, n_vertices, needed, r->budget);
    if (!pages_add(r->ctx, (void ***)&r->walks, &r->n_walk_pages, &r->cap_walk_pages,
                   n_walks, sizeof **r->walks) ||
        !vertex_pages_add(r, n_vertices) ||
        !pages_add(r->ctx, (void ***)&r->items, &r->n_item_pages, &r->cap_item_pages,
                   n_items, sizeof **r->items))
        return imp__error(r->ctx, IMP_E_NOMEM,
                          "no memory for %zu bytes of recorded walks", needed);
    return IMP_OK;
}

/* Vertices, their words, and items of a walk and what hangs on it. */
struct extent {
    size_t vertices, words, items;
};

static enum imp_status walk_measure(imp_context *ctx, const struct imp_walk *walk,
                                    int nest, struct extent *extent)
{
    enum imp_status st = IMP_OK;
    if (walk->entry)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "a walk whose light enters at its vertices cannot be kept");
    if (nest > IMP_RECORD_NESTS)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "walks that hang on each other %d times cannot be kept", nest);
    extent->vertices += (size_t)walk->n;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        if (v->probe)
            return imp__error(ctx, IMP_E_UNSUPPORTED,
                              "a walk with a probe of an extinction cannot be kept: its "
                              "derivative is not that of its collisions");
        const struct imp_packed_head head = imp__packed_head(&v->d);
        extent->words += imp__packed_words(&head);
        if (v->on) extent->items += 2 + (size_t)v->on->n;
        if (v->to_light) extent->items += 2 + (size_t)v->to_light->n;
        for (const struct imp_side *s = v->side; s && st == IMP_OK; s = s->next) {
            extent->items++;
            st = walk_measure(ctx, &s->walk, nest + 1, extent);
        }
        if (st != IMP_OK) return st;
    }
    return st;
}

static union imp_kept *item_put(struct imp_record *r)
{
    union imp_kept *item = imp__record_item(r, r->n_items++);
    memset(item, 0, sizeof *item);
    return item;
}

static void track_put(struct imp_record *r, const struct imp_track *track,
                      enum imp_kept_kind kind, uint32_t at)
{
    if (!track) return;
    union imp_kept *item = item_put(r);
    memcpy(item->head.o, track->o, sizeof track->o);
    item->head.at = at & 0x3fffffff;
    item->head.kind = kind & 3;
    item = item_put(r);
    memcpy(item->way.d, track->d, sizeof track->d);
    item->way.n = (uint32_t)track->n;
    for (int i = 0; i < track->n; i++) item_put(r)->event = track->event[i];
}

bool imp__record_page_trim(imp_context *ctx, struct imp_record_page *page)
{
    uint32_t *small = imp__alloc_raw(ctx, imp_max(page->n_words, 1u), sizeof *small);
    if (!small) return false;
    memcpy(small, page->words, page->n_words * sizeof *small);
    imp__release(ctx, page->words);
    page->words = small;
    return true;
}

static void vertex_put(struct imp_record *r, const struct imp_decision *d)
{
    struct imp_record_page *page = r->vertices[r->n_vertices / IMP_RECORD_PAGE];
    const size_t n = imp__packed_put(d, page->words + page->n_words);
    page->start[r->n_vertices % IMP_RECORD_PAGE] = (uint16_t)page->n_words;
    page->n_words += (uint32_t)n;
    r->n_words += n;
    /* A full page stays as it is where there is no memory for a smaller one. */
    if (++r->n_vertices % IMP_RECORD_PAGE == 0) (void)imp__record_page_trim(r->ctx, page);
}

/* Its vertices, then what belongs to each; `first`: of the walk that it hangs on. */
static void walk_put(struct imp_record *r, const struct imp_walk *walk, uint64_t first)
{
    uint32_t at = (uint32_t)(r->n_vertices - first);
    for (const struct imp_vertex *v = walk->first; v; v = v->next) vertex_put(r, &v->d);
    for (const struct imp_vertex *v = walk->first; v; v = v->next, at++) {
        track_put(r, v->on, IMP_KEPT_ON, at);
        track_put(r, v->to_light, IMP_KEPT_TO_LIGHT, at);
        for (const struct imp_side *s = v->side; s; s = s->next) {
            union imp_kept *item = item_put(r);
            item->head.side.first = (uint32_t)(r->n_vertices - first);
            item->head.side.n = (uint32_t)s->walk.n;
            item->head.side.depth = s->walk.depth;
            item->head.at = at & 0x3fffffff;
            item->head.kind = IMP_KEPT_SIDE;
            walk_put(r, &s->walk, first);
        }
    }
}

enum imp_status imp__record_keep(struct imp_record *r, const struct imp_walk *walk,
                                 int64_t sample)
{
    enum imp_status st;
    struct extent extent = {0, 0, 0};
    if (walk->moving)
        return imp__error(r->ctx, IMP_E_UNSUPPORTED,
                          "a walk through a medium whose numbers are active cannot be "
                          "kept: its vertices move with them");
    st = walk_measure(r->ctx, walk, 0, &extent);
    if (st != IMP_OK) return st;
    const bool counts = walk->valid && walk->dropped == IMP_DROP_NONE;
    if (!counts) extent = (struct extent){0, 0, 0};
    if (extent.vertices >= 1u << 30 || extent.items > UINT32_MAX)
        return imp__error(r->ctx, IMP_E_UNSUPPORTED,
                          "a walk of %zu vertices cannot be kept", extent.vertices);
    st = imp__record_reserve(r, 1, extent.vertices, extent.words, extent.items);
    if (st != IMP_OK) return st;
    *imp__record_at(r, r->n_walks++) =
        (struct imp_record_walk){.px = walk->px,
                                 .py = walk->py,
                                 .wave = walk->wave,
                                 .time = walk->time,
                                 .key = walk->key,
                                 .sample = sample,
                                 .first = r->n_vertices,
                                 .first_item = r->n_items,
                                 .n_vertices = (uint32_t)extent.vertices,
                                 .n_items = (uint32_t)extent.items,
                                 .n = counts ? (uint16_t)walk->n : 0,
                                 .valid = walk->valid,
                                 .absorbed = walk->absorbed,
                                 .dropped = (uint8_t)walk->dropped};
    if (counts) walk_put(r, walk, r->n_vertices);
    return IMP_OK;
}

/* The last page shrinks to what it holds. */
static bool page_trim(imp_context *ctx, void **pages, size_t n_pages, size_t n,
                      size_t size)
{
    const size_t last = n % IMP_RECORD_PAGE;
    if (n_pages == 0 || last == 0) return true;
    void *small = imp__alloc_raw(ctx, last, size);
    if (!small) return false;
    memcpy(small, pages[n_pages - 1], last * size);
    imp__release(ctx, pages[n_pages - 1]);
    pages[n_pages - 1] = small;
    return true;
}

static bool vertices_trim(imp_context *ctx, struct imp_record_page *page, size_t n)
{
    return imp__record_page_trim(ctx, page) &&
           page_trim(ctx, (void **)&page->start, 1, n, sizeof *page->start);
}

enum imp_status imp__record_trim(struct imp_record *r)
{
    const bool open = r->n_vertex_pages > 0 && r->n_vertices % IMP_RECORD_PAGE != 0;
    if (page_trim(r->ctx, (void **)r->walks, r->n_walk_pages, r->n_walks,
                  sizeof **r->walks) &&
        (!open || vertices_trim(r->ctx, r->vertices[r->n_vertex_pages - 1],
                                r->n_vertices % IMP_RECORD_PAGE)) &&
        page_trim(r->ctx, (void **)r->items, r->n_item_pages, r->n_items,
                  sizeof **r->items))
        return IMP_OK;
    return imp__error(r->ctx, IMP_E_NOMEM, "no memory for recorded walks");
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
    const struct imp_record_of of = imp__record_made_with(tracer);
    return imp__record_same(r->ctx, "recorded walks", &r->of, &of);
}
