/* SPDX-License-Identifier: Apache-2.0
 *
 * Pieces of scenes whose walks are made some at a time. */
#ifndef IMP_TESTS_BUNDLE_SCENES_H
#define IMP_TESTS_BUNDLE_SCENES_H

#include "imp_scene.h"
#include <stdio.h>
#include <unistd.h>

#define PATH(rest) "<integrator type='path'>" rest "</integrator>"
#define DEPTH(n)   "<integer name='max_depth' value='" n "'/>"
#define RR(n)      "<integer name='rr_depth' value='" n "'/>"
#define VIEW                                                                             \
    "<transform name='to_world'><lookat origin='0.3,0.2,3.4' target='0,0,0' "            \
    "up='0,1,0'/></transform><float name='fov' value='55'/>"
#define CAMERA "perspective'>" VIEW

#define AT(x, y, z, axis, angle, size)                                                   \
    "<transform name='to_world'><scale value='" size "'/><rotate " axis                  \
    "='1' angle='" angle "'/><translate x='" x "' y='" y "' z='" z "'/></transform>"
#define DIFFUSE(rgb)                                                                     \
    "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
#define WALL(x, y, z, axis, angle, bsdf)                                                 \
    "<shape type='rectangle'>" AT(x, y, z, axis, angle, "2") bsdf "</shape>"
#define ROOM                                                                             \
    WALL("0", "-2", "0", "x", "-90", DIFFUSE(".7,.6,.5"))                                \
    WALL("0", "2", "0", "x", "90", DIFFUSE(".6,.7,.8"))                                  \
    WALL("-2", "0", "0", "y", "90", DIFFUSE(".8,.1,.1"))                                 \
    WALL("2", "0", "0", "y", "-90", DIFFUSE(".1,.8,.2"))                                 \
    WALL("0", "0", "-2", "y", "0", DIFFUSE(".5,.5,.5"))
#define AREA(rgb) "<emitter type='area'><rgb name='radiance' value='" rgb "'/></emitter>"
#define LAMP(x, z, size)                                                                 \
    "<shape type='rectangle'>" AT(x, "1.9", z, "x", "90", size) AREA("9,8,7") "</shape>"
#define GOLD(more)                                                                       \
    "<bsdf type='roughconductor'><string name='material' value='Au'/><string "           \
    "name='distribution' value='ggx'/>" more "</bsdf>"
#define ALPHA(name, v) "<float name='" name "' value='" v "'/>"
#define BALL(x, y, bsdf)                                                                 \
    "<shape type='sphere'><point name='center' x='" x "' y='" y                          \
    "' z='0'/><float name='radius' value='.5'/>" bsdf "</shape>"
#define CUBE(x, y, bsdf)                                                                 \
    "<shape type='cube'>" AT(x, y, ".3", "y", "30", ".4") bsdf "</shape>"
#define CHECKERS                                                                         \
    "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'><transform "   \
    "name='to_uv'><scale value='7'/></transform></texture></bsdf>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.6,.8,1'/></emitter>"

/* What a meter lies on. */
#define WITHIN "<shape type='rectangle'>" AT("0", "-1", "0", "x", "-90", ".5")

/* A picture of 8 x 4 texels. */
static inline bool picture_write(char path[64])
{
    strcpy(path, "/tmp/imp_bundles_XXXXXX.ppm");
    const int fd = mkstemps(path, 4);
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!f) return false;
    fprintf(f, "P6 8 4 255\n");
    for (int k = 0; k < 96; k++) fputc(k * 37 % 256, f);
    return fclose(f) == 0;
}

#endif
