/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks that are kept: their decisions, without values, outlive the arena they were
 * traced in, and can be written to a file. Evaluated at other parameters of the same
 * scene they give L and its derivative with densities, directions and visibility as they
 * were drawn; at the parameters they were drawn at, what tracing gave, to the bit
 * (docs/estimators.md 17). */
#ifndef IMP_WALK_RECORD_H
#define IMP_WALK_RECORD_H

#include "base/file.h"
#include "packed.h"
#include "walk/media/tracking.h"

/* ---- What is kept ---------------------------------------------------------------- */

/* A walk and all that hangs on it: its own vertices, then those of its side walks. A walk
 * that is dropped or not valid has none. */
struct imp_record_walk {
    double px, py; /* film position */
    double wave;   /* number from which its wavelengths were drawn; 0: it has none */
    double time;   /* when its light reaches the sensor */
    struct imp_key key;
    int64_t sample;
    uint64_t first, first_item; /* of all in the record */
    uint32_t n_vertices, n_items;
    uint16_t n; /* vertices of its own */
    uint8_t valid, absorbed, dropped;
    uint8_t reserved[3]; /* 0 */
};

/* What belongs to a vertex besides its decisions is a row of items of 16 bytes, in the
 * order of vertices: a track (imp_track) is a head, its direction and its events; a side
 * walk is a head, behind which the items of its own vertices follow. */
enum imp_kept_kind {
    IMP_KEPT_ON,       /* the track of the segment that goes on */
    IMP_KEPT_TO_LIGHT, /* of the way to the light sample */
    IMP_KEPT_SIDE      /* a walk that hangs on the vertex */
};
union imp_kept {
    struct {
        union {
            imp_decided o[3]; /* where the track starts */
            struct {
                uint32_t first, n; /* vertices of the side walk, in those of the walk */
                int32_t depth;
            } side;
        };
        uint32_t at : 30, kind : 2; /* vertex, in those of the walk; enum imp_kept_kind */
    } head;
    struct {
        imp_decided d[3];
        uint32_t n; /* events that follow */
    } way;
    struct imp_event event;
};
/* Side walks hang on side walks this often at most: reading a walk is recursive. */
#define IMP_RECORD_NESTS 64

/* What the walks were made with: evaluated with anything else they mean nothing. */
struct imp_record_of {
    uint64_t objects, sensor, integrator, rays; /* hashes: scene/fingerprint.h */
};

#define IMP_RECORD_PAGE 1024 /* walks, vertices, or items */

/* Vertices of a page, packed (packed.h). The last page, to which some are added, has room for
 * any. */
struct imp_record_page {
    uint32_t *words;
    uint16_t *start; /* [IMP_RECORD_PAGE] of each, in words */
    uint32_t n_words;
};
_Static_assert(IMP_RECORD_PAGE *IMP_PACKED_MOST <= UINT16_MAX, "imp_record_page.start");

/* Not for sharing between threads while walks are added. */
struct imp_record {
    imp_context *ctx;
    struct imp_record_of of;
    size_t budget; /* bytes that walks, vertices and items may take */
    size_t n_walks, n_vertices, n_items;
    size_t n_words;                 /* of all vertices */
    struct imp_record_walk **walks; /* pages, which never move */
    struct imp_record_page **vertices;
    union imp_kept **items;
    size_t n_walk_pages, cap_walk_pages, n_vertex_pages, cap_vertex_pages, n_item_pages,
        cap_item_pages;
};

/* An empty record for walks of this tracer, whose scene outlives it. `budget`: bytes of
 * walks, vertices and items; memory exceeds it by a page of each at most.
 * IMP_E_UNSUPPORTED if derivatives follow directions (alpha_gradient), since
 * recorded directions are fixed. */
enum imp_status imp__record_create(const struct imp_tracer *tracer, size_t budget,
                                   struct imp_record *out);
void imp__record_destroy(struct imp_record *record);
size_t imp__record_bytes(const struct imp_record *record);

/* Append a walk that was traced with a record (not value_only), with what hangs on it;
 * `sample` is its number. IMP_E_UNSUPPORTED if its vertices move with a field, if an
 * extinction has a probe (probe.h), which is no decision of the walk's value: trace with
 * `collisions_fixed`; or if light enters at its vertices (imp_walk.entry). IMP_E_NOMEM
 * beyond the budget, with the size needed in the message. Then nothing is appended. A
 * guide decides as anything else does, and is not needed again. */
enum imp_status imp__record_keep(struct imp_record *record, const struct imp_walk *walk,
                                 int64_t sample);

/* No more is appended: give back what the last pages do not hold. */
enum imp_status imp__record_trim(struct imp_record *record);

/* ---- Evaluated ------------------------------------------------------------------- */

/* Before walks are evaluated: IMP_E_ARG if the scene, sensor or integrator is another, or
 * a parameter has changed that moves or bends rays. Other parameters are free. */
enum imp_status imp__record_check(const struct imp_record *record,
                                  const struct imp_tracer *tracer);

static inline struct imp_record_walk *imp__record_at(const struct imp_record *r, size_t i)
{
    return &r->walks[i / IMP_RECORD_PAGE][i % IMP_RECORD_PAGE];
}
#define IMP_RECORD_FETCH                                                                 \
    128 /* bytes of a vertex that are fetched ahead: most have few more */

/* The words of vertex i, and its decisions. */
static inline uint32_t *imp__record_words(const struct imp_record *r, uint64_t i)
{
    const struct imp_record_page *page = r->vertices[i / IMP_RECORD_PAGE];
    return page->words + page->start[i % IMP_RECORD_PAGE];
}
static inline void imp__record_vertex(const struct imp_record *r, uint64_t i,
                                      struct imp_decision *out)
{
    imp__packed_get(imp__record_words(r, i), out);
}
static inline union imp_kept *imp__record_item(const struct imp_record *r, uint64_t i)
{
    return &r->items[i / IMP_RECORD_PAGE][i % IMP_RECORD_PAGE];
}

/* The scatterer of a packed vertex; NULL at the sky and the sensor. */
static inline const struct imp_bsdf *imp__packed_bsdf(const struct imp_scene *scene,
                                                      const uint32_t *words)
{
    struct imp_packed_head h;
    memcpy(&h, words, sizeof h);
    const struct imp_decision d = {.shape = h.shape, .scatterer = h.scatterer};
    return imp__decided_bsdf(scene, &d);
}

/* Walk i in the arena, with its values at the scene's present parameters, folded, to be
 * swept like any other; it has no camera ray, normals and lengths. The derivative with
 * respect to extinctions is that of frozen collisions: the tracer's `collisions_fixed` is
 * set. Where an extinction is now above the bound under which collisions were drawn, L may
 * be negative; it is right in the mean. Running out of memory drops it. With a tracer that
 * wants no derivatives, it may have no vertices. */
void imp__record_walk(const struct imp_record *record, size_t i,
                      const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk);

/* ---- Files (record_file.c) ------------------------------------------------------- */

/* Whole or not at all. */
enum imp_status imp__record_write(const struct imp_record *record, const char *path);
/* IMP_E_ARG: of another scene, sensor or integrator, or parameters that move rays have
 * other values; IMP_E_IO: damaged; IMP_E_SCENE: of another version, byte order or build;
 * IMP_E_NOMEM: more than the budget. */
enum imp_status imp__record_read(const struct imp_tracer *tracer, const char *path,
                                 size_t budget, struct imp_record *out);

/* The same inside of a file: what imp__record_write writes, checksum included. `of`: what
 * the walks were made with; NULL: with the tracer. */
void imp__record_put(struct imp_file_writer *to, const struct imp_record *record);
/* Into memory; false: there is too little. */
bool imp__record_bytes_put(const struct imp_record *record, struct imp_bytes *to);
struct imp_record_source {
    imp_context *ctx;
    const char *path; /* for messages */
    FILE *f;
    uint64_t sum;
};
enum imp_status imp__record_take(struct imp_record_source *from,
                                 const struct imp_tracer *tracer,
                                 const struct imp_record_of *of, size_t budget,
                                 struct imp_record *out);
/* Is this walk such as the scene allows (record_fits.c)? Its vertices and items begin at
 * `first` and `first_item`. */
bool imp__record_walk_fits(const struct imp_scene *scene, const struct imp_record *record,
                           const struct imp_record_walk *walk, uint64_t first,
                           uint64_t first_item);
struct imp_record_of imp__record_made_with(const struct imp_tracer *tracer);

/* Room for so many walks and items, and vertices of so many words, more. */
enum imp_status imp__record_reserve(struct imp_record *record, size_t walks,
                                    size_t vertices, size_t words, size_t items);
/* What a page has room for beyond its words is given back. False: no memory. */
bool imp__record_page_trim(imp_context *ctx, struct imp_record_page *page);
enum imp_status imp__record_same(imp_context *ctx, const char *what,
                                 const struct imp_record_of *is,
                                 const struct imp_record_of *of);

#endif
