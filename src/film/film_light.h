/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures by light walks, each of which may reach any pixel. A pixel is
 *
 *     I_p = 1/N sum_i c_ip,    c_ip = sum over the reaches of walk i of h(x - x_p) L / H_p
 *
 * with the filter h and its integral H_p over the part of the film that is sampled. Walks
 * are independent, c_ip is 0 in most pixels, and se^2 = (sum c^2 - (sum c)^2/N)/(N (N-1)).
 *
 * A bidirectional sample (walk/both/both.h) adds the contribution of its walk from the
 * sensor, which begins in a pixel, with N the samples of the pixel, not of the picture.
 * The samples are cut into groups with equal numbers for each pixel, and the spread of
 * the groups' pictures is the standard error.
 *
 * Walks that are strata of sweeps (imp_light_picture.sweep) are cut into groups, too.
 *
 * Order of the sums: the walks are cut into a fixed number of items, each adds its walks up
 * one by one in a film of its own, and items are added in a fixed binary tree. */
#ifndef IMP_FILM_LIGHT_H
#define IMP_FILM_LIGHT_H

#include "base/drops.h"
#include "film_filter.h"
#include "walk/lights/light_walk.h"

/* 1/H_p along both axes of a film; a filter no wider than a pixel (box) has 1. */
struct imp_splat_scale {
    int margin;            /* sampled beyond the picture on every side */
    double *across, *down; /* [crop_w], [crop_h]; NULL: box */
};
enum imp_status imp__splat_scale_create(imp_context *ctx,
                                        const struct imp_film_desc *film,
                                        struct imp_splat_scale *out);
void imp__splat_scale_destroy(imp_context *ctx, struct imp_splat_scale *s);

/* The pixels that a film position reaches, with weights h/H. */
struct imp_splat_taps {
    struct imp_taps across, down; /* n 0: none */
};
void imp__splat_taps(const struct imp_film_desc *film,
                     const struct imp_splat_scale *scale, double px, double py,
                     struct imp_splat_taps *out);

/* The walks of a picture with the spp of the run; all of them, not of a pixel. */
static inline int64_t imp__light_walks_of(const struct imp_run *run,
                                          const struct imp_sensor *sensor)
{
    const int64_t spp = run->spp > 0 ? run->spp : sensor->spp;
    return spp * sensor->film.crop_w * sensor->film.crop_h;
}

/* What a reach adds to a picture: n values. */
typedef void imp__reach_values(const void *payload, const struct imp_light_walk *walk,
                               const struct imp_reach *reach, double *value);

struct imp_light_picture {
    const struct imp_tracer *tracer;
    const struct imp_run *run;
    const char *stage;
    int n; /* values of a pixel */
    imp__reach_values *values;
    /* In place of a picture: n values of a whole walk, whose mean is one pixel. */
    void (*whole)(const void *payload, const struct imp_light_walk *walk, double *value);
    /* In place of a light walk: sample `index`, with what it reaches, in the arena. */
    void (*trace)(const void *payload, struct imp_arena *arena, int64_t index,
                  struct imp_light_walk *out);
    const void *payload;
    int64_t first, walks; /* of the light walks: these numbers */
    /* So many walks, one behind the other, are strata of one sweep, and sweeps are independent: the
     * error is the spread of groups of sweeps. Divides walks; 0: walks are independent. */
    int64_t sweep;
    double lo, hi; /* part of the progress; hi 0: all */
};

/* mean, se [height][width][n]; se may be NULL. The budget of dropped walks is checked.
 * @return IMP_OK; IMP_CANCELLED, with nothing; IMP_E_PATHS; IMP_E_NOMEM. */
enum imp_status imp__light_picture_make(const struct imp_light_picture *picture,
                                        double *mean, double *se,
                                        struct imp_drops *drops);

/* The values of a pixel as films of as many channels each, out [n_films]. The caller destroys
 * them; none after an error.
 * @return as imp__light_picture_make; IMP_E_UNSUPPORTED for a time limit alone;
 *         IMP_E_NUMERIC if a pixel is not finite; IMP_PART. */
enum imp_status imp__light_films_make(const struct imp_light_picture *picture,
                                      const char *names, int n_films, imp_film **out);

/* The picture of a run (film_from_lights.c). */
struct imp_measure;
enum imp_status imp__render_from_lights(const struct imp_measure *measure,
                                        const struct imp_run *run, imp_film **out);

#endif
