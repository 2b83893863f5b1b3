/* SPDX-License-Identifier: Apache-2.0
 *
 * The sun of a sky, whose place and width may change (scene/pose.h). A sky is what it has around its sun,
 * whose radiance along directions at rest depends on where the sun is, and the sun's disc, which goes
 * with it. */
#ifndef IMP_KIND_EMITTER_SKY_SUN_H
#define IMP_KIND_EMITTER_SKY_SUN_H

#include "kind/build.h"
#include "math/vec.h"

struct imp__sky_sun {
    imp_v3 towards; /* unit, world */
    double radius;  /* of its disc, radians; 0: there is none */
    bool power;     /* a wider disc is darker, and sends as much */
    bool alone;     /* nothing is around it */
};
/* sunsky whose sun is above the horizon, ciesky and perezsky that depend on it, and sun. False: another
 * light. */
bool imp__sky_sun_read(const struct imp_emitter *e, struct imp__sky_sun *out);
/* Puts it there, with `towards` and `radius`; the sampling of directions follows by ops->changed. NULL,
 * or what is wrong with it. */
const char *imp__sky_sun_set(struct imp_emitter *e, const struct imp__sky_sun *sun);
/* The radius of a `sun`, where it is kept: its input's number. NULL: another light. */
double *imp__sun_radius_at(const struct imp_emitter *e);

/* Is its disc above the horizon in whole, by an angle that no difference crosses? */
bool imp__sky_sun_is_clear(const struct imp_emitter *e);

enum imp__sky_part { IMP_SKY_WHOLE, IMP_SKY_AROUND, IMP_SKY_DISC };
/* Changes values of the sky's inputs to those of one part of it. */
void imp__sky_part(const struct imp_emitter *e, enum imp__sky_part part, imp_spec *in);

/* ---- sunsky.c, sun.c for sky_sun.c ---- */
bool imp__sunsky_sun_read(const struct imp_emitter *e, struct imp__sky_sun *out);
bool imp__sunsky_sun_set(struct imp_emitter *e, const struct imp__sky_sun *sun);
void imp__sunsky_part(bool disc, imp_spec *in);
void imp__sun_radius_set(struct imp_emitter *e, double radius);
double *imp__sun_radius_number(const struct imp_emitter *e);

#endif
