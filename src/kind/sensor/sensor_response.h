/* SPDX-License-Identifier: Apache-2.0
 *
 * What a sensor sees of each wavelength: the response curves of a specfilm, and `srf`, a
 * factor of all channels of another film. */
#ifndef IMP_KIND_SENSOR_RESPONSE_H
#define IMP_KIND_SENSOR_RESPONSE_H

#include "kind/build.h"

/* Every spectrum in the film b->node is a channel of that name. */
enum imp_status imp__responses_read(const struct imp_build *b, struct imp_film_desc *f);

/* `srf` of the sensor b->node, whose film has been read. */
enum imp_status imp__srf_read(const struct imp_build *b, struct imp_film_desc *f);

#endif
