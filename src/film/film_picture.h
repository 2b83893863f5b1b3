/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of anything that can be sampled: radiance, derivatives, first hits. */
#ifndef IMP_FILM_PICTURE_H
#define IMP_FILM_PICTURE_H

#include "base/film.h"
#include "film_filter.h"
#include "walk/bundle/supply.h"
#include "walk/kept/store.h"

/* A sample of a pixel: which one, and what comes of it. */
struct imp_sample {
    int x, y;                /* pixel, from the crop's corner */
    int64_t index;           /* number of the sample in its pixel */
    struct imp_arena *arena; /* rewound afterwards */
    struct imp_supply
        *supply; /* gives its walk, if it is one; NULL: it is traced alone */
    /* Set by whoever takes the sample: */
    double *value; /* [n]; 0 if dropped */
    double px, py; /* film position */
    enum imp_drop dropped;
};

struct imp_picture {
    const struct imp_sensor *sensor;
    const char *stage; /* for progress */
    const char *names; /* channels of each film, "R,G,B" */
    int n;             /* values of a sample: channels of all films */
    /* Called by many threads at once. */
    void (*sample)(const void *payload, struct imp_sample *s);
    const void *payload;
    int64_t first;   /* number of a pixel's first sample */
    int step;        /* from a sample's number to that of the next; 0: 1 */
    int n_films;     /* the values are cut into so many films of equal size; 0: one */
    double *weights; /* [height][width] sums of filter weights; NULL: not wanted */
    /* Consecutive samples of a pixel that depend on each other, from the first on: errors
     * come from the spread of such sets. 0: none do. */
    int set;
    const struct imp_tracer
        *walks; /* a sample is one walk of it, and walks can be bundled
                                       (walk/bundle/); NULL: not so */
    const bool
        *only; /* [height][width] pixels that are sampled, the others stay 0, where a
                         pixel's samples are its own; NULL: all */
    bool
        points; /* these sets are sets of points: samples are numbered by imp__set_number,
                    and `first` and `step` are not used */
};

/* out [n_films]. A value that is not finite or beyond float is a dropped walk
 * (IMP_DROP_INFINITE, IMP_DROP_NAN).
 * @return IMP_OK; IMP_CANCELLED with a valid picture, or NULL from the first pass of a
 * large one; IMP_E_PATHS; IMP_E_NOMEM, before
 * the first sample; IMP_E_NUMERIC if a pixel is not finite. */
enum imp_status imp__picture_make(imp_context *ctx, const struct imp_picture *picture,
                                  const struct imp_run *run, imp_film **out);

/* Walks of a pixel that a picture takes; 0: until its time is up. */
static inline int64_t imp__walks_of(const struct imp_run *run,
                                    const struct imp_sensor *sensor)
{
    const struct imp_store *kept =
        imp_unlikely(run->walks != NULL) ? imp__walks_store(run->walks, sensor) : NULL;
    if (imp_unlikely(kept != NULL)) return (int64_t)kept->n;
    return run->spp > 0 ? run->spp : run->time_limit_s > 0 ? 0 : sensor->spp;
}

/* The walk of a sample, which gets its film position, and the cause if it was dropped. */
static inline void imp__sample_walk(struct imp_sample *s, const struct imp_tracer *tracer,
                                    struct imp_walk *walk)
{
    if (s->supply) imp__supply_take(s->supply, s->x, s->y, s->index, walk);
    else if (imp_likely(!tracer->kept))
        imp__walk_trace(tracer, s->arena, s->x, s->y, s->index, walk);
    else imp__store_walk_at(tracer, s->arena, s->x, s->y, s->index, walk);
    s->px = walk->px;
    s->py = walk->py;
    s->dropped = walk->dropped;
}

#endif
