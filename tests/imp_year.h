/* SPDX-License-Identifier: Apache-2.0
 *
 * Hours of a few days, a room that they light, and a scene of it, for tests of daylight. */
#ifndef IMP_YEAR_H
#define IMP_YEAR_H

#include "imp_scene.h"
#include "math/rng.h"
#include <importon/rooms.h>
#include <math.h>

enum { HOURS = 240, POINTS = 6 };
/* A few days' worth of hours with suns all over the upper half of the sky, some of them set. */
static struct imp_weather_hour hours[HOURS];

static inline void weather_make(void)
{
    const struct imp_key key = imp__key(3, 1, 4);
    for (int i = 0; i < HOURS; i++) {
        struct imp_weather_hour *h = &hours[i];
        const double z = -.1 + 1.0 * imp__u01(key, 5 * (uint32_t)i),
                     phi = 2 * M_PI * imp__u01(key, 5 * (uint32_t)i + 1);
        const double r = sqrt(1 - z * z), clear = imp__u01(key, 5 * (uint32_t)i + 2);
        *h = (struct imp_weather_hour){.year = 2021, .month = 1, .day = 1 + i / 24};
        h->hour = i % 24 + .5;
        h->sun[0] = r * cos(phi), h->sun[1] = r * sin(phi), h->sun[2] = z;
        h->diffuse =
            z > -.05 ? 20 + 250 * imp__u01(key, 5 * (uint32_t)i + 3) * fmax(z, .1) : 0;
        h->direct = z > 0 && clear > .4 ? 900 * clear * sqrt(z) : 0;
        h->diffuse_illuminance = 120 * h->diffuse;
        h->direct_illuminance = 95 * h->direct;
    }
}

#define SKY "<emitter type='ciesky'/>"
#define GRID(film)                                                                       \
    "<shape type='rectangle'><transform name='to_world'><scale value='.1'/></transform>" \
    "<sensor type='irradiancemeter'><boolean name='virtual' value='true'/><string "      \
    "name='at' value='points'/>" film "<string name='units' value='photometric'/>"       \
    "</sensor></shape>"
#define FILM(w, h)                                                                       \
    "<film type='hdrfilm'><integer name='width' value='" #w "'/><integer name='height' " \
    "value='" #h "'/><rfilter type='box'/></film>"

static inline imp_scene *scene_of(imp_context *ctx, const char *integrator,
                                  const char *inside)
{
    static char xml[16384];
    snprintf(xml, sizeof xml, "<scene version='3.0.0'><integrator type='%s'/>%s</scene>",
             integrator, inside);
    return test_scene_text(ctx, xml, IMP_MONO);
}

#define WALL(turn, at)                                                                   \
    "<shape type='rectangle'><transform name='to_world'>" turn "<translate " at          \
    "/></transform><bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "  \
    "value='.5'/></bsdf></bsdf></shape>"
/* A box of 2 x 2 x 2 without the half of its roof, and without the wall at y = -1. */
#define ROOM                                                                             \
    WALL("<scale value='1'/>", "z='0'")                                                  \
    WALL("<scale x='.5'/>", "x='-.5' z='2'")                                             \
    WALL("<rotate y='1' angle='90'/>", "x='-1' z='1'")                                   \
    WALL("<rotate y='1' angle='90'/>", "x='1' z='1'")                                    \
    WALL("<rotate x='1' angle='90'/>", "y='1' z='1'")
#define DESK                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='.8'/><translate "  \
    "z='.4'/></transform><sensor type='irradiancemeter'><boolean name='virtual' "        \
    "value='true'/><string name='at' value='points'/>" FILM(                             \
        3, 2) "<string name='units' value='photometric'/></sensor></shape>"

#endif
