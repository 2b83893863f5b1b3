/* SPDX-License-Identifier: Apache-2.0
 *
 * Direction to the sun, from a date, a time and a place on earth or from `sun_direction`: shared by
 * the kinds `sun`, `sky` and `sunsky`. */
#ifndef IMP_KIND_EMITTER_SUN_POSITION_H
#define IMP_KIND_EMITTER_SUN_POSITION_H

#include "kind/build.h"
#include "math/vec.h"

struct imp__sun_date {
    double latitude, longitude; /* degrees, north and east positive */
    double timezone;            /* hours east of Greenwich */
    int year, month, day;
    double hour, minute, second; /* of that zone's clock */
};

/* Direction to the sun: z is up, x points south, y west. To .5 arc minutes from 1999 to
 * 2015 (Blanco-Muriel, Alarcon-Padilla, Lopez-Moratalla and Lara-Coira 2001, "Computing the
 * solar vector"). */
imp_v3 imp__sun_direction(const struct imp__sun_date *d);

/* From the properties of a scene: sun_direction, which is of the world (*of_world), or a
 * place and a time. *sun is unit. */
enum imp_status imp__sun_read(const struct imp_build *b, imp_v3 *sun, bool *of_world);

#endif
