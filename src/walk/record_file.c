/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of kept walks: a head, the walks, their vertices, what belongs to these, and a
 * checksum of all, as they are in memory. What is read is checked vertex by vertex against the scene, so that
 * evaluating it is safe whatever the bytes are. */
#include "math/hash.h"
#include "record.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>

#define MAGIC      "impwalks"
#define BYTE_ORDER 0x01020304u
#define VERSION    4

struct head {
    char magic[8];
    uint32_t byte_order, version;
    uint32_t walk_bytes, vertex_bytes, item_bytes, reserved;
    struct imp_record_of of;
    uint64_t n_walks, n_vertices, n_items;
};
_Static_assert(sizeof(struct head) == 88, "no padding: it is written");

/* ---- Writing --------------------------------------------------------------------- */

struct writing {
    imp_context *ctx;
    struct imp_file_writer *file; /* to a file, or */
    struct imp_bytes *bytes;      /* into memory, */
    bool full;                    /* of which there may be too little */
    uint64_t sum;
};
static void put(struct writing *w, const void *data, size_t n)
{
    w->sum = imp__hash(w->sum, data, n);
    if (w->file) imp__file_put(w->file, data, n);
    else w->full = w->full || !imp__bytes_add(w->ctx, w->bytes, data, n);
}
/* n elements in pages. */
static void pages_put(struct writing *w, void *const *pages, size_t n, size_t size)
{
    for (size_t at = 0; at < n; at += IMP_RECORD_PAGE)
        put(w, pages[at / IMP_RECORD_PAGE],
            imp_min(n - at, (size_t)IMP_RECORD_PAGE) * size);
}

static void record_put(struct writing *w, const struct imp_record *r)
{
    const struct head head = {.magic = MAGIC,
                              .byte_order = BYTE_ORDER,
                              .version = VERSION,
                              .walk_bytes = sizeof **r->walks,
                              .vertex_bytes = sizeof **r->vertices,
                              .item_bytes = sizeof **r->items,
                              .of = r->of,
                              .n_walks = r->n_walks,
                              .n_vertices = r->n_vertices,
                              .n_items = r->n_items};
    put(w, &head, sizeof head);
    pages_put(w, (void *const *)r->walks, r->n_walks, sizeof **r->walks);
    pages_put(w, (void *const *)r->vertices, r->n_vertices, sizeof **r->vertices);
    pages_put(w, (void *const *)r->items, r->n_items, sizeof **r->items);
    const uint64_t sum = w->sum;
    put(w, &sum, sizeof sum);
}

void imp__record_put(struct imp_file_writer *to, const struct imp_record *r)
{
    struct writing w = {.file = to};
    record_put(&w, r);
}
bool imp__record_bytes_put(const struct imp_record *r, struct imp_bytes *to)
{
    struct writing w = {.ctx = r->ctx, .bytes = to};
    record_put(&w, r);
    return !w.full;
}

static void record_fill(struct imp_file_writer *to, const void *payload)
{
    imp__record_put(to, payload);
}
enum imp_status imp__record_write(const struct imp_record *r, const char *path)
{
    return imp__file_write_by(r->ctx, path, record_fill, r);
}

/* ---- Are these decisions that the scene allows? ---------------------------------- */

static bool all_finite(const imp_decided *x, int n)
{
    for (int k = 0; k < n; k++)
        if (!isfinite(x[k])) return false;
    return true;
}
/* Components of a unit vector, as it was rounded. */
static bool unit(const imp_decided *x)
{
    const double l2 = (double)x[0] * x[0] + (double)x[1] * x[1] + (double)x[2] * x[2];
    return fabs(l2 - 1) < 1e-3;
}
static bool weight(imp_decided x) { return isfinite(x) && x >= 0; }

static bool met_fits(const struct imp_scene *scene, const struct imp_decision *d)
{
    const struct imp_met *m = &d->met;
    if (m->emitter < 0) return m->emitter == -1;
    if (m->emitter >= scene->n_emitters) return false;
    const bool here =
        d->shape < 0 ? scene->emitters[m->emitter]->ops->flags & IMP_EMITTER_ENVIRONMENT
                     : m->emitter == scene->shapes[d->shape]->emitter;
    return here && weight(m->weight) && m->dist >= 0 && isfinite(m->cos_light) &&
           unit(m->d);
}

static bool light_fits(const struct imp_scene *scene, const struct imp_bsdf *b,
                       const struct imp_decision *d)
{
    const struct imp_light *l = &d->light;
    if (d->connection == IMP_NOT_CONNECTED) return true;
    return d->connection <= IMP_CONNECTED && (b->flags & IMP_BSDF_SMOOTH) &&
           l->emitter >= 0 && l->emitter < scene->n_emitters && weight(l->weight) &&
           all_finite(l->uv, 2) && all_finite(l->p, 3) && l->dist >= 0 &&
           isfinite(l->cos_light) && unit(l->d) && unit(l->wi);
}

static bool continuation_fits(const struct imp_bsdf *b, const struct imp_decision *d)
{
    if (!d->goes_on) return true;
    const unsigned needs = d->lobe == IMP_SMOOTH ? IMP_BSDF_SMOOTH : IMP_BSDF_DELTA;
    return d->lobe >= IMP_SMOOTH && (b->flags & (needs | IMP_BSDF_NULL)) && unit(d->wi) &&
           isfinite(d->pdf) && d->pdf > 0 && isfinite(d->kernel) && d->kernel >= 0 &&
           isfinite(d->survive) && d->survive > 0;
}

static bool goes_straight(const struct imp_decision *d)
{
    return d->goes_on && d->lobe == IMP_SMOOTH && unit(d->wi) && d->pdf == 1 &&
           d->survive == 1;
}
/* Where the camera is, if the first segment crosses media. */
static bool sensor_fits(const struct imp_decision *d)
{
    return goes_straight(d) && !d->glows && d->met.emitter == -1 &&
           d->connection == IMP_NOT_CONNECTED;
}
/* Past an environment the walk comes to the next one. */
static bool sky_fits(const struct imp_scene *scene, const struct imp_decision *d,
                     bool last)
{
    return (last ? !d->goes_on : goes_straight(d)) && !d->glows &&
           d->connection == IMP_NOT_CONNECTED && d->met.emitter >= 0 &&
           met_fits(scene, d);
}

static bool vertex_fits(const struct imp_scene *scene, const struct imp_decision *d,
                        bool first, bool last)
{
    if (!all_finite(d->uv, 2) || !all_finite(d->p, 3) || !isfinite(d->passes) ||
        !weight(d->glow_weight) || (!d->goes_on && !last))
        return false;
    if (d->shape == -1 && d->scatterer == IMP_AT_SENSOR) return first && sensor_fits(d);
    if (d->shape == -1) return d->scatterer == IMP_AT_SKY && sky_fits(scene, d, last);
    const bool inside = d->scatterer == IMP_IN_MEDIUM;
    if (d->shape < 0 || d->shape >= (inside ? scene->n_media : scene->n_all_shapes))
        return false;
    const struct imp_bsdf *b = inside ? scene->media[d->shape]->scatterer
                                      : imp__shape_bsdf(scene, scene->shapes[d->shape]);
    const bool null = b->flags & IMP_BSDF_NULL;
    return (inside || d->scatterer == (null ? IMP_AT_BOUNDARY : IMP_AT_SURFACE)) &&
           unit(d->wo) && (!d->glows || (b->flags & IMP_BSDF_EMIT)) &&
           (inside ? d->met.emitter == -1 : met_fits(scene, d)) &&
           light_fits(scene, b, d) && continuation_fits(b, d);
}

/* `before`: kind of the event before it, -1: none. A surface that is passed has two. */
static bool event_fits(const struct imp_scene *scene, const struct imp_event *e,
                       int before)
{
    if ((e->kind == IMP_PASSES_UV) != (before == IMP_PASSES)) return false;
    if ((e->kind == IMP_RESIDUAL_OF) != (before == IMP_RESIDUAL_AT)) return false;
    if (e->kind == IMP_PASSES_UV) return isfinite(e->t) && isfinite(e->bound);
    if (e->kind == IMP_RESIDUAL_OF || e->kind == IMP_CONTROL)
        return isfinite(e->t) && e->t >= 0;
    if (e->kind == IMP_PASSES)
        return e->medium >= 0 && e->medium < scene->n_all_shapes && isfinite(e->t) &&
               isfinite(e->bound);
    if (e->medium < 0 || e->medium >= scene->n_media || !(e->t >= 0)) return false;
    if (e->kind == IMP_CROSSES || e->kind == IMP_COLLIDES)
        return !scene->media[e->medium]->majorants;
    return (e->kind == IMP_NULL_AT || e->kind == IMP_REAL_AT ||
            e->kind == IMP_RESIDUAL_AT) &&
           isfinite(e->t) && isfinite(e->bound) && e->bound > 0;
}

/* A walk while its items are looked at: the walks that the item at hand may belong to,
 * each of which hangs on the one before it. */
struct fitting {
    const struct imp_scene *scene;
    const struct imp_record *record;
    const struct imp_record_walk *walk;
    uint32_t item, end; /* vertices that items before this one speak of */
    struct {
        uint32_t first, n;
    } of[IMP_RECORD_NESTS + 1];
    int nest;
};

static const union imp_kept *item_at(struct fitting *f)
{
    return f->item == f->walk->n_items
               ? NULL
               : imp__record_item(f->record, f->walk->first_item + f->item++);
}

/* Vertices that follow those before, of which each but the last goes on. */
static bool chain_fits(struct fitting *f, uint32_t first, uint32_t n, bool side)
{
    if (first != f->end || n == 0 || n > IMP_WALK_MAX || n > f->walk->n_vertices - first)
        return false;
    bool sky = false;
    for (uint32_t k = 0; k < n; k++) {
        const struct imp_decision *d =
            imp__record_vertex(f->record, f->walk->first + first + k);
        if (!vertex_fits(f->scene, d, k == 0 && !side, k + 1 == n)) return false;
        if (sky && d->scatterer != IMP_AT_SKY) return false;
        sky = d->scatterer == IMP_AT_SKY;
    }
    f->end = first + n;
    return true;
}

static bool track_fits(struct fitting *f, const union imp_kept *head)
{
    const union imp_kept *way = item_at(f);
    if (!way || !all_finite(head->head.o, 3) || !unit(way->way.d) ||
        way->way.n > INT32_MAX || way->way.n > f->walk->n_items - f->item)
        return false;
    int before = -1;
    for (uint32_t i = 0; i < way->way.n; i++) {
        const struct imp_event *e = &item_at(f)->event;
        if (!event_fits(f->scene, e, before)) return false;
        before = e->kind;
    }
    return before != IMP_PASSES && before != IMP_RESIDUAL_AT;
}

static bool items_fit(struct fitting *f)
{
    const union imp_kept *head;
    while ((head = item_at(f)) != NULL) {
        const uint32_t at = head->head.at;
        while (at < f->of[f->nest].first || at - f->of[f->nest].first >= f->of[f->nest].n)
            if (f->nest-- == 0) return false;
        if (head->head.kind != IMP_KEPT_SIDE) {
            if (head->head.kind > IMP_KEPT_SIDE || !track_fits(f, head)) return false;
            continue;
        }
        const uint32_t first = head->head.side.first, n = head->head.side.n;
        if (f->nest == IMP_RECORD_NESTS || head->head.side.depth < 0 ||
            head->head.side.depth > IMP_WALK_MAX || !chain_fits(f, first, n, true))
            return false;
        f->nest++;
        f->of[f->nest].first = first;
        f->of[f->nest].n = n;
    }
    return f->end == f->walk->n_vertices;
}

static bool walk_fits(const struct imp_scene *scene, const struct imp_record *r,
                      const struct imp_record_walk *w, uint64_t first,
                      uint64_t first_item)
{
    const bool counts = w->valid == 1 && w->dropped == IMP_DROP_NONE;
    struct fitting f = {.scene = scene, .record = r, .walk = w, .of = {{0, w->n}}};
    if (w->first != first || w->n_vertices > r->n_vertices - first ||
        w->first_item != first_item || w->n_items > r->n_items - first_item ||
        w->valid > 1 || w->absorbed > 1 || w->dropped >= IMP_DROP_CAUSES ||
        (w->n_vertices > 0 && !counts) || (w->n == 0 && w->n_vertices > 0) ||
        !isfinite(w->px) || !isfinite(w->py) || !(w->wave >= 0 && w->wave < 1))
        return false;
    if (w->n > 0 && !chain_fits(&f, 0, w->n, false)) return false;
    return items_fit(&f);
}

/* ---- Reading --------------------------------------------------------------------- */

static enum imp_status damaged(const struct imp_record_source *s, const char *what)
{
    return imp__error(s->ctx, IMP_E_SCENE, "%s: damaged file of kept walks (%s)", s->path,
                      what);
}

static enum imp_status take(struct imp_record_source *s, void *data, size_t size)
{
    if (fread(data, 1, size, s->f) != size)
        return ferror(s->f)
                   ? imp__error(s->ctx, IMP_E_IO, "%s: %s", s->path, strerror(errno))
                   : damaged(s, "it ends early");
    s->sum = imp__hash(s->sum, data, size);
    return IMP_OK;
}

static enum imp_status head_take(struct imp_record_source *s, struct head *h)
{
    *h = (struct head){.magic = ""};
    if (fread(h, 1, sizeof *h, s->f) != sizeof *h &&
        memcmp(h->magic, MAGIC, sizeof h->magic) == 0)
        return damaged(s, "it ends early");
    if (memcmp(h->magic, MAGIC, sizeof h->magic) != 0)
        return imp__error(s->ctx, IMP_E_SCENE, "%s: not a file of kept walks", s->path);
    if (h->byte_order != BYTE_ORDER)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: kept walks of a machine with another byte order", s->path);
    if (h->version != VERSION)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: kept walks of version %u; this program reads %d", s->path,
                          h->version, VERSION);
    if (h->walk_bytes != sizeof(struct imp_record_walk) ||
        h->vertex_bytes != sizeof(struct imp_decision) ||
        h->item_bytes != sizeof(union imp_kept) || h->reserved != 0)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: kept walks of another build: %u bytes a vertex, here %zu",
                          s->path, h->vertex_bytes, sizeof(struct imp_decision));
    s->sum = imp__hash(0, h, sizeof *h);
    return IMP_OK;
}

/* Page by page: a size that the file does not have takes no memory. */
static enum imp_status body_take(struct imp_record_source *s, struct imp_record *r,
                                 const struct head *h)
{
    enum imp_status st = IMP_OK;
    const size_t page = IMP_RECORD_PAGE;
    while (r->n_walks < h->n_walks) {
        const size_t n = (size_t)imp_min(h->n_walks - r->n_walks, (uint64_t)page);
        IMP_TRY(imp__record_reserve(r, n, 0, 0));
        IMP_TRY(take(s, r->walks[r->n_walks / page], n * sizeof **r->walks));
        r->n_walks += n;
    }
    while (r->n_vertices < h->n_vertices) {
        const size_t n = (size_t)imp_min(h->n_vertices - r->n_vertices, (uint64_t)page);
        IMP_TRY(imp__record_reserve(r, 0, n, 0));
        IMP_TRY(take(s, r->vertices[r->n_vertices / page], n * sizeof **r->vertices));
        r->n_vertices += n;
    }
    while (r->n_items < h->n_items) {
        const size_t n = (size_t)imp_min(h->n_items - r->n_items, (uint64_t)page);
        IMP_TRY(imp__record_reserve(r, 0, 0, n));
        IMP_TRY(take(s, r->items[r->n_items / page], n * sizeof **r->items));
        r->n_items += n;
    }
    const uint64_t sum = s->sum;
    uint64_t end;
    IMP_TRY(take(s, &end, sizeof end));
    if (end != sum) IMP_TRY(damaged(s, "checksum"));
out:
    return st;
}

enum imp_status imp__record_take(struct imp_record_source *s,
                                 const struct imp_tracer *tracer,
                                 const struct imp_record_of *of, size_t budget,
                                 struct imp_record *out)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = tracer->scene;
    struct imp_record r = {.ctx = NULL};
    struct head head;
    uint64_t needed, vertices, items, first = 0, first_item = 0;

    IMP_TRY(imp__record_create(tracer, budget, &r));
    IMP_TRY(head_take(s, &head));
    IMP_TRY(imp__record_same(s->ctx, s->path, &head.of, of ? of : &r.of));
    if (__builtin_mul_overflow(head.n_walks, sizeof **r.walks, &needed) ||
        __builtin_mul_overflow(head.n_vertices, sizeof **r.vertices, &vertices) ||
        __builtin_mul_overflow(head.n_items, sizeof **r.items, &items) ||
        __builtin_add_overflow(needed, vertices, &needed) ||
        __builtin_add_overflow(needed, items, &needed))
        IMP_TRY(damaged(s, "absurd size"));
    if (needed > budget)
        IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM,
                           "%s: its walks need %llu bytes; the budget is %zu", s->path,
                           (unsigned long long)needed, budget));
    IMP_TRY(body_take(s, &r, &head));
    for (size_t i = 0; i < r.n_walks; i++) {
        const struct imp_record_walk *w = imp__record_at(&r, i);
        if (!walk_fits(scene, &r, w, first, first_item))
            IMP_TRY(damaged(s, "a walk that this scene cannot have"));
        first += w->n_vertices;
        first_item += w->n_items;
    }
    if (first != r.n_vertices || first_item != r.n_items)
        IMP_TRY(damaged(s, "vertices of no walk"));
    *out = r;
    r = (struct imp_record){.ctx = NULL};
out:
    imp__record_destroy(&r);
    return st;
}

enum imp_status imp__record_read(const struct imp_tracer *tracer, const char *path,
                                 size_t budget, struct imp_record *out)
{
    struct imp_record_source s = {
        .ctx = tracer->scene->ctx, .path = path, .f = fopen(path, "rbe")};
    struct imp_record r;
    if (!s.f) return imp__error(s.ctx, IMP_E_IO, "%s: %s", path, strerror(errno));
    enum imp_status st = imp__record_take(&s, tracer, NULL, budget, &r);
    if (st == IMP_OK && fgetc(s.f) != EOF) {
        st = damaged(&s, "it goes on behind its end");
        imp__record_destroy(&r);
    }
    if (st == IMP_OK) *out = r;
    fclose(s.f);
    return st;
}
