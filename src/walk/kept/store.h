/* SPDX-License-Identifier: Apache-2.0
 *
 * All recorded walks of one sensor: a record for each tile of its film, made by one thread
 * each, so that walks and their order do not depend on the number of threads. A tracer
 * with `kept` set evaluates them where it would trace. */
#ifndef IMP_WALK_STORE_H
#define IMP_WALK_STORE_H

#include "reduced.h"
#include <importon/walks.h>
#include <stdatomic.h>

#define IMP_STORE_SIDE    8 /* pixels of a tile */
#define IMP_HEADROOM_MOST 64
#define IMP_WALKS_ASKED   1024 /* that say what all are worth (store_subset.c) */

/* Steps from materials of class a to class b, of those that roulette looked at. */
#define IMP_STORE_CLASSES 32

struct imp_store {
    struct imp_walk_source source;
    imp_context *ctx;
    const struct imp_sensor *sensor;
    int index;         /* of the sensor */
    int width, height; /* of the film's crop, and pixels sampled beyond it: */
    int margin;
    int across, down; /* tiles */
    size_t n;         /* walks of a pixel */
    bool stratified;  /* wavelengths of a picture's walks depend on each other */
    int64_t *sample;  /* [n] their numbers, ascending */
    struct imp_record *records;  /* [across down] */
    struct imp_reduced *reduced; /* [across down] the same walks, those that reduce; one
                                     without `of`: none of them does */
    const struct imp_reduction *reduction; /* NULL: walks are not reduced */
    size_t budget;
    int left;         /* remaining sensors that share the budget, this one included */
    uint64_t **meets; /* [across down][walks] store_subset.c */
    atomic_size_t met[64];       /* walks that meet each of its bits */
    atomic_size_t bytes;         /* of records so far, and of `meets` */
    atomic_size_t reduced_bytes; /* and of what they are reduced to */
    atomic_bool roulette;        /* some step had a survival below 1 */
};

/* Empty. samples [n], ascending, are copied; IMP_E_UNSUPPORTED as of imp__record_create.
 * reduction, which outlives it: how walks are reduced; NULL: they are not. */
enum imp_status imp__store_create(const struct imp_tracer *tracer, int index, int margin,
                                  const int64_t *samples, size_t n, size_t budget,
                                  const struct imp_reduction *reduction,
                                  struct imp_store *out);
void imp__store_destroy(struct imp_store *store);
static inline size_t imp__store_tiles(const struct imp_store *s)
{
    return (size_t)s->across * (size_t)s->down;
}

/* Trace and keep the walks of a tile. Tiles may be made by several threads at once.
 * IMP_E_NOMEM beyond the budget, with an estimate of what all of them need. */
enum imp_status imp__store_fill(struct imp_store *store, const struct imp_tracer *tracer,
                                struct imp_arena *arena, size_t tile);

/* Bytes of the walks of a tile, and of what they meet. */
static inline size_t imp__store_bytes(const struct imp_store *s, size_t tile)
{
    return imp__record_bytes(&s->records[tile]) +
           s->records[tile].n_walks * sizeof(uint64_t);
}

/* All tiles are made: walks stay reduced if they fit into the budget with the records. */
void imp__store_settle(struct imp_store *store);

/* Place of a walk with this number in its pixel; -1: it was not kept. */
int64_t imp__store_find(const struct imp_store *store, int64_t sample);

/* As imp__walk_trace, of the tracer's recorded walks: with that number, or the k-th of its
 * pixel. */
void imp__store_walk(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk);
void imp__store_walk_at(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                        int y, int64_t k, struct imp_walk *walk);

/* The tiles of this process, of `ranks` that share them. */
static inline size_t imp__store_share(const struct imp_store *s, int rank, int ranks)
{
    return imp__store_tiles(s) * (size_t)rank / (size_t)ranks;
}

/* In a file, from tile `first` to before `end`. What is read is what this store would
 * trace: as many walks of every pixel, at their places. `of`: as of imp__record_take. */
void imp__store_put(struct imp_file_writer *to, const struct imp_store *store,
                    size_t first, size_t end);
enum imp_status imp__store_take(struct imp_record_source *from, struct imp_store *store,
                                const struct imp_tracer *tracer,
                                const struct imp_record_of *of);

/* ---- Densities (densities.c, store_weight.c) --------------------------------------- */

/* What the densities of walks depend on. */
struct imp_densities {
    const struct imp_scene *scene;
    const struct imp_walk_integrator *integrator;
    double survival;  /* of the tracer they were drawn with */
    double least;     /* probability of a real collision; 0: there is no headroom */
    bool guided;      /* their survival was decided by a guide */
    uint64_t *wanted; /* [n_bsdfs] imp_dirs.derivative that they were drawn with */
    uint64_t *inputs; /* [n_bsdfs] bit j: the density depends on input j */
    uint8_t *moved;   /* [n_bsdfs] it has changed */
    bool any;         /* of moved */
    bool flights;     /* an extinction has changed */
    bool weights;     /* some value that roulette looks at has changed */
    uint64_t matters; /* bits of imp_store.meets: for those that changed */
    uint64_t rolled;  /* and for those whose values did, which matter to roulette */
};
enum imp_status imp__densities_create(const struct imp_scene *scene,
                                      const struct imp_walk_integrator *integrator,
                                      const uint8_t *chosen, double survival,
                                      struct imp_densities *out);
void imp__densities_destroy(imp_context *ctx, struct imp_densities *d);
/* changed [n_params]: parameters whose numbers are not those that walks were drawn at. */
void imp__densities_move(struct imp_densities *d, const uint8_t *changed);

/* Sums over walks of the ratio of densities w = p(theta')/p(theta), and over steps that
 * roulette looked at of what they add to the second moment. */
struct imp_moments {
    double n, w, w2;
    double moved,
        seen; /* walks with a direction whose density has changed, and the sum of
                           its ratios alone */
    double steps[IMP_STORE_CLASSES];                        /* from class a */
    double growth[IMP_STORE_CLASSES][IMP_STORE_CLASSES][4]; /* from a to b, by lane */
    /* Tentative collisions whose weight at the present extinction is not valid, by media modulo
     * IMP_STORE_CLASSES. */
    double
        passed[IMP_STORE_CLASSES]; /* it is above the bound that they were drawn under */
    double certain[IMP_STORE_CLASSES]; /* it is below a bound that it had reached, so that
                                          no null collision was drawn */
};
/* ---- The subset that is weighed (store_subset.c) --------------------------------------- */

static inline int imp__store_class(const struct imp_bsdf *b)
{
    return b->index >= 0 ? b->index % IMP_STORE_CLASSES : 0;
}
/* What the walks of a tile meet; once a tile, by any thread. */
enum imp_status imp__store_look(struct imp_store *store, const struct imp_scene *scene,
                                size_t tile);
struct imp_asking {
    size_t every;  /* walk is weighed; 1: all of them are */
    uint64_t rare; /* but of those that meet one of these bits, more */
};
/* About `most` walks, and enough of those that meet what matters now. 0: all; and all
 * where collisions are weighed. */
struct imp_asking imp__store_asking(const struct imp_store *store,
                                    const struct imp_densities *d, size_t most);
/* The next walk of the subset in a tile, from i on; n_walks: there is none. It counts as
 * `weight` walks. */
size_t imp__store_next(const struct imp_store *store, const struct imp_asking *asking,
                       size_t tile, size_t i, double *weight);

/* Adds the walks of the subset in a tile; mask [height][width]: pixels with 0 are left
 * out; NULL: none are. */
enum imp_status imp__store_moments(const struct imp_store *store,
                                   const struct imp_densities *d,
                                   const struct imp_tracer *tracer,
                                   struct imp_arena *arena, size_t tile,
                                   const float *mask, const struct imp_asking *asking,
                                   struct imp_moments *sum);
/* ---- All of a scene (kept_use.c) -------------------------------------------------- */

struct imp_walks {
    imp_context *ctx;
    imp_scene *scene; /* that they are evaluated in */
    bool owns_scene;  /* it was read with them */
    bool guided;      /* a guide decided how they go on */
    bool spread;      /* over ranks: this one has a share of the tiles */
    struct imp_run
        run;     /* seed, samples, points and wavelengths that they were drawn with */
    bool losses; /* numbers of samples are those of losses */
    double survival, headroom; /* of the tracer that drew them */
    double ess;                /* < 0: imp__walks_use does not look at it */
    const struct imp_walk_integrator *integrator;
    struct imp_reduction *reduction; /* NULL: walks are not reduced */
    double *theta;                   /* [n_theta] where they were drawn */
    uint8_t *chosen;  /* [n_params] parameters that may change and have a derivative */
    uint8_t *flights; /* [n_params] those that may change, and by which collisions were
                         drawn: they have none */
    int n_stores;
    struct imp_store *stores;
    struct imp_densities densities; /* its `moved` is of nobody: see imp__walks_weigh */
};
void imp__walks_destroy(struct imp_walks *walks);
/* The walks of a sensor; NULL: there are none. */
const struct imp_store *imp__walks_store(const struct imp_walks *walks,
                                         const struct imp_sensor *sensor);
/* A run of these walks: its seed, samples, points and wavelengths are theirs. */
enum imp_status imp__walks_run(imp_context *ctx, const char *function,
                               struct imp_run *run);
/* tracer->kept, where run->walks is set. IMP_E_ARG: they are another scene's, or none of
 * this sensor. IMP_E_UNSUPPORTED: a parameter has changed, or is active, of which they
 * have no weight. IMP_E_NUMERIC: too few of them count now, or their variance is infinite. */
enum imp_status imp__walks_use(const struct imp_run *run, struct imp_tracer *tracer);
/* What they are worth at the scene's present parameters; mask as of imp__store_moments,
 * `most` as of imp__store_asking. all: were all of them weighed? May be NULL. */
enum imp_status imp__walks_weigh(const struct imp_walks *walks,
                                 const struct imp_store *store, const float *mask,
                                 size_t most, struct imp_walks_weight *out, bool *all);
/* Is their variance, as far as roulette makes it? */
bool imp__walks_finite(const struct imp_walks *walks, const struct imp_walks_weight *x);
/* The parameters whose numbers have changed, [n_params]; IMP_E_UNSUPPORTED as above. */
enum imp_status imp__walks_changed(const struct imp_walks *walks, uint8_t *changed);

/* Spectral radius of the growth of the second moment from step to step: 1 and more, and
 * the variance of walks of any length is infinite. 0: roulette looked at no step. */
double imp__moments_radius(const struct imp_moments *sum);

#endif
