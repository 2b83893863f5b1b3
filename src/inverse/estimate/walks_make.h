/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks of sensors (imp_walks_keep): drawn, or filled from a file. */
#ifndef IMP_INVERSE_WALKS_MAKE_H
#define IMP_INVERSE_WALKS_MAKE_H

#include "walk/kept/store.h"

/* The walks of some sensors, marked [n_sensors], drawn at the scene's present parameters.
 * options have their defaults filled in; run->sensor is ignored. free [n_params]: those
 * that may change while they are kept; NULL: all that can. As of imp_walks_keep. */
enum imp_status imp__walks_make(imp_scene *scene, const struct imp_run *run,
                                const struct imp_walks_options *options,
                                const uint8_t *sensors, const uint8_t *free,
                                imp_walks **out);
/* Everything but walks: the parameters that may change, and densities. */
enum imp_status imp__walks_begin(imp_scene *scene, const struct imp_run *run,
                                 const struct imp_walks_options *options,
                                 const uint8_t *free, imp_walks **out);
/* The store of the next sensor, empty, and the tracer that fills it; active NULL: what is
 * read, not traced. */
enum imp_status imp__walks_sensor(struct imp_walks *walks,
                                  const struct imp_active *active, int index,
                                  size_t budget, struct imp_tracer *tracer);

#endif
