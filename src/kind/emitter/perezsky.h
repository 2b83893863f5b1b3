/* SPDX-License-Identifier: Apache-2.0
 *
 * The models of Perez by themselves, for those who make many skies of weather data. */
#ifndef IMP_KIND_EMITTER_PEREZSKY_H
#define IMP_KIND_EMITTER_PEREZSKY_H

#include "sky_shape.h"

#define IMP__SOLAR_CONSTANT 1367 /* W m^-2, with which the model was fitted */

/* a to e and h, from the weather and from s->sun and s->axis; the sun counts as on the
 * horizon where it is below. The factor is left as it is. */
void imp__perez_shape(struct imp__sky_shape *s, const struct imp__perez_weather *w);
/* Luminous efficacies, lm/W, of diffuse and direct light (Perez, Ineichen, Seals, Michalsky and
 * Stewart, "Modeling daylight availability and irradiance components from direct and global
 * irradiance", Solar Energy 44, 1990, eqs 7 and 8, table 4). up: cosine of the sun's angle
 * to the zenith; dew: dew point, degrees Celsius. Not below 0. */
void imp__perez_efficacy(const struct imp__perez_weather *w, double up, double dew,
                         double *diffuse, double *direct);

#endif
