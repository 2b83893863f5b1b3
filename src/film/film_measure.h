/* SPDX-License-Identifier: Apache-2.0
 *
 * What one sample contributes to each channel of a picture: the integrator's radiance in
 * the film's pixel format, first-hit quantities, moments. */
#ifndef IMP_FILM_MEASURE_H
#define IMP_FILM_MEASURE_H

#include "film_picture.h"

#define IMP_MEASURE_MAX 128 /* channels */

struct imp_measure {
    const struct imp_scene *scene;
    const struct imp_sensor *sensor;
    uint64_t seed;
    const struct imp_guide *guide;
    const struct imp_run *run;    /* outlives the measure */
    const struct imp_store *kept; /* walks that are evaluated; NULL: they are traced */
    int spp;
    int set; /* of samples that depend on each other (imp_picture) */
    const struct imp_walk_integrator *integrator; /* of the scene, from the run's end */
    struct imp_walk_integrator own;               /* of a grid, where it has its own */
    bool from_lights;
    struct imp_tracer tracer; /* of that integrator, for values */
    int n;                    /* channels */
    bool
        together; /* points of a grid share; the second half of the channels is without that */
    uint8_t *more; /* of such points (walk/bundle/near_walls.h) */
    char *names;   /* "R,G,B,..." for imp__film_create */
};

/* IMP_E_SCENE without a sensor or integrator; names are released by measure_destroy. */
enum imp_status imp__measure_create(const struct imp_scene *scene,
                                    const struct imp_run *run, struct imp_measure *out);
void imp__measure_destroy(struct imp_measure *m);
/* Points of a grid share what their walks meet, where they can (walk/bundle/reuse.h). Then pixels
 * depend on each other, but their sum is what it is if they do not share. Behind the channels there
 * are as many again, of independent pixels that do not. IMP_E_NOMEM. */
enum imp_status imp__measure_together(struct imp_measure *m);
/* The tracer whose walks can be bundled where a sample is one walk; else NULL. */
const struct imp_tracer *imp__measure_bundles(const struct imp_measure *m);
/* Takes the sample (payload: the measure). */
void imp__measure_sample(const void *measure, struct imp_sample *sample);

/* Albedo and normal of the first surface, in the scene's colours: [6]. */
void imp__measure_features(const void *measure, struct imp_sample *sample);

/* Radiance and alpha in the film's pixel format; how many values. */
int imp__measure_base(const struct imp_measure *m, imp_spec L, double alpha,
                      double *value);

/* The sensor of a run, or an error with the number of sensors. */
enum imp_status imp__run_sensor(const struct imp_scene *scene, const struct imp_run *run,
                                const struct imp_sensor **out);

#endif
