/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of recorded walks: a head, the walks, their vertices, page by page with the number of
 * words before each, what belongs to these, and a checksum of all, as they are in memory.
 * What is read is checked vertex by vertex against the scene (record_fits.c). */
#include "math/hash.h"
#include "record.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>

#define MAGIC      "impwalks"
#define BYTE_ORDER 0x01020304u
#define VERSION    7 /* vertices name their primitives, and are packed */

#define VERTEX_BYTES (4 * IMP_PACKED_MOST)

struct head {
    char magic[8];
    uint32_t byte_order, version;
    uint32_t walk_bytes, vertex_bytes, item_bytes, reserved;
    struct imp_record_of of;
    uint64_t n_walks, n_vertices, n_words, n_items;
};
_Static_assert(sizeof(struct head) == 96, "no padding: it is written");

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
                              .vertex_bytes = VERTEX_BYTES,
                              .item_bytes = sizeof **r->items,
                              .of = r->of,
                              .n_walks = r->n_walks,
                              .n_vertices = r->n_vertices,
                              .n_words = r->n_words,
                              .n_items = r->n_items};
    put(w, &head, sizeof head);
    pages_put(w, (void *const *)r->walks, r->n_walks, sizeof **r->walks);
    for (size_t at = 0; at < r->n_vertices; at += IMP_RECORD_PAGE) {
        const struct imp_record_page *page = r->vertices[at / IMP_RECORD_PAGE];
        put(w, &page->n_words, sizeof page->n_words);
        put(w, page->words, page->n_words * sizeof *page->words);
    }
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

/* ---- Reading --------------------------------------------------------------------- */

static enum imp_status damaged(const struct imp_record_source *s, const char *what)
{
    return imp__error(s->ctx, IMP_E_IO, "%s: damaged file of recorded walks (%s)",
                      s->path, what);
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
        return imp__error(s->ctx, IMP_E_SCENE, "%s: not a file of recorded walks",
                          s->path);
    if (h->byte_order != BYTE_ORDER)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: recorded walks of a machine with another byte order",
                          s->path);
    if (h->version != VERSION)
        return imp__error(s->ctx, IMP_E_SCENE,
                          "%s: recorded walks of version %u; this program reads %d",
                          s->path, h->version, VERSION);
    if (h->walk_bytes != sizeof(struct imp_record_walk) ||
        h->vertex_bytes != VERTEX_BYTES || h->item_bytes != sizeof(union imp_kept) ||
        h->reserved != 0)
        return imp__error(
            s->ctx, IMP_E_SCENE,
            "%s: recorded walks of another build: %u bytes a vertex, here %d", s->path,
            h->vertex_bytes, VERTEX_BYTES);
    s->sum = imp__hash(0, h, sizeof *h);
    return IMP_OK;
}

/* Where each of n vertices begins. False: their words are no vertices. */
static bool starts_find(struct imp_record_page *page, size_t n)
{
    size_t at = 0;
    for (size_t k = 0; k < n; k++) {
        struct imp_packed_head h;
        if (page->n_words - at < 2) return false;
        memcpy(&h, page->words + at, sizeof h);
        page->start[k] = (uint16_t)at;
        at += imp__packed_words(&h);
        if (at > page->n_words) return false;
    }
    return at == page->n_words;
}

/* A page of n vertices. */
static enum imp_status page_take(struct imp_record_source *s, struct imp_record *r,
                                 size_t n)
{
    enum imp_status st = IMP_OK;
    uint32_t n_words;
    IMP_TRY(take(s, &n_words, sizeof n_words));
    if (n_words > n * IMP_PACKED_MOST) IMP_TRY(damaged(s, "vertices of another length"));
    IMP_TRY(imp__record_reserve(r, 0, n, n_words, 0));
    struct imp_record_page *page = r->vertices[r->n_vertices / IMP_RECORD_PAGE];
    IMP_TRY(take(s, page->words, n_words * sizeof *page->words));
    page->n_words = n_words;
    if (!starts_find(page, n)) IMP_TRY(damaged(s, "vertices of another length"));
    r->n_vertices += n;
    r->n_words += n_words;
    (void)imp__record_page_trim(s->ctx, page); /* or it stays as it is */
out:
    return st;
}

/* Page by page: a size that the file does not have takes no memory. */
static enum imp_status body_take(struct imp_record_source *s, struct imp_record *r,
                                 const struct head *h)
{
    enum imp_status st = IMP_OK;
    const size_t page = IMP_RECORD_PAGE;
    while (r->n_walks < h->n_walks) {
        const size_t n = (size_t)imp_min(h->n_walks - r->n_walks, (uint64_t)page);
        IMP_TRY(imp__record_reserve(r, n, 0, 0, 0));
        IMP_TRY(take(s, r->walks[r->n_walks / page], n * sizeof **r->walks));
        r->n_walks += n;
    }
    while (r->n_vertices < h->n_vertices) {
        const size_t n = (size_t)imp_min(h->n_vertices - r->n_vertices, (uint64_t)page);
        IMP_TRY(page_take(s, r, n));
    }
    if (r->n_words != h->n_words) IMP_TRY(damaged(s, "vertices of another length"));
    while (r->n_items < h->n_items) {
        const size_t n = (size_t)imp_min(h->n_items - r->n_items, (uint64_t)page);
        IMP_TRY(imp__record_reserve(r, 0, 0, 0, n));
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
    uint64_t needed, vertices, words, items, first = 0, first_item = 0;

    IMP_TRY(imp__record_create(tracer, budget, &r));
    IMP_TRY(head_take(s, &head));
    IMP_TRY(imp__record_same(s->ctx, s->path, &head.of, of ? of : &r.of));
    if (__builtin_mul_overflow(head.n_walks, sizeof **r.walks, &needed) ||
        __builtin_mul_overflow(head.n_vertices, sizeof(uint16_t), &vertices) ||
        __builtin_mul_overflow(head.n_words, sizeof(uint32_t), &words) ||
        __builtin_mul_overflow(head.n_items, sizeof **r.items, &items) ||
        __builtin_add_overflow(needed, vertices, &needed) ||
        __builtin_add_overflow(needed, words, &needed) ||
        __builtin_add_overflow(needed, items, &needed))
        IMP_TRY(damaged(s, "absurd size"));
    if (needed > budget)
        IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM,
                           "%s: its walks need %llu bytes; the budget is %zu", s->path,
                           (unsigned long long)needed, budget));
    IMP_TRY(body_take(s, &r, &head));
    for (size_t i = 0; i < r.n_walks; i++) {
        const struct imp_record_walk *w = imp__record_at(&r, i);
        if (!imp__record_walk_fits(scene, &r, w, first, first_item))
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
