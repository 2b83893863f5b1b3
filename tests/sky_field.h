/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of what moves under skies: a block above a floor before a camera that sees the sky, and
 * skies: a map of a few texels, a CIE sky, a clear sky with its sun, a sun. The test has a context, ctx. */
#ifndef IMP_TEST_SKY_FIELD_H
#define IMP_TEST_SKY_FIELD_H

#include "imp_scene.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define SKY_MAP "moved_skies_map.pfm"

enum { SKY_COLUMNS = 12, SKY_ROWS = 7 };
static inline double sky_texel(int i, int j, int c) /* row, column, channel */
{
    const double light = .4 + .3 * cos(1.3 * i + c) * sin(.9 * j + .3 * c);
    return light + (i == 1 && j == 4 ? 12 : 0);
}
static inline void sky_map_write(void)
{
    FILE *f = fopen(SKY_MAP, "wb");
    if (!f) exit(99);
    fprintf(f, "PF\n%d %d\n-1\n", SKY_COLUMNS, SKY_ROWS);
    for (int i = SKY_ROWS - 1; i >= 0; i--)
        for (int j = 0; j < SKY_COLUMNS; j++)
            for (int c = 0; c < 3; c++) {
                const float x = (float)sky_texel(i, j, c);
                fwrite(&x, sizeof x, 1, f);
            }
    fclose(f);
}

#define SKY_DIRECT "<integrator type='direct'/>"
#define SKY_PATH                                                                         \
    "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define SKY_UP "<transform name='to_world'><rotate x='1' angle='90'/></transform>"
#define SKY_ENVMAP                                                                       \
    "<emitter type='envmap' id='sky'><string name='filename' value='" SKY_MAP            \
    "'/>" SKY_UP "</emitter>"
#define SKY_CIE                                                                          \
    "<emitter type='ciesky' id='sky'><integer name='sky' value='12'/><vector "           \
    "name='sun_direction' value='.5,-.6,.7'/></emitter>"
#define SKY_CLEAR                                                                        \
    "<emitter type='sunsky' id='sky'><vector name='sun_direction' value='-.5,1.2,.4'/>"  \
    "<float name='sun_aperture' value='12'/><float name='sun_scale' value='.004'/>"      \
    "<float name='sky_scale' value='20'/></emitter>"
#define SKY_SUN                                                                          \
    "<emitter type='sun' id='sun'><vector name='direction' value='.5,-1.2,-.5'/>"        \
    "<float name='radius' value='.15'/><rgb name='radiance' value='9,8,7'/></emitter>"

/* It looks a little up, over the block to the horizon. */
static inline imp_scene *sky_field(const char *rest)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s<bsdf type='diffuse' id='grey'><rgb "
             "name='reflectance' value='.6,.5,.4'/></bsdf>"
             "<sensor type='perspective' id='camera'><float name='fov' value='60'/>"
             "<transform name='to_world'><lookat origin='.4,-5.5,1.6' target='.1,0,1.5' "
             "up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' "
             "value='24'/><integer name='height' value='16'/><rfilter type='box'/></film>"
             "</sensor>"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><ref id='grey'/></shape>"
             "<shape type='cube' id='block'><transform name='to_world'><scale x='.6' "
             "y='.5' z='.4'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' "
             "z='.7'/></transform><ref id='grey'/></shape></scene>",
             rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}

#endif
