/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes on which gains are measured: the Cornell box, textured.xml, and an open one of a floor
 * of clay under sky and lamp, to which tests add objects. */
#ifndef IMP_GAIN_SCENES_H
#define IMP_GAIN_SCENES_H

#include "imp_scene.h"

/* side: about the root of the number of pixels. */
static inline imp_scene *gain_cornell(imp_context *ctx, int side)
{
    char size[64];
    snprintf(size, sizeof size, "res=%d", side);
    return test_scene(ctx, "cornell.xml", IMP_RGB, size);
}

static inline imp_scene *gain_textured(imp_context *ctx, int side)
{
    char size[64];
    snprintf(size, sizeof size, "width=%d height=%d", side * 7 / 6, side * 7 / 8);
    return test_scene(ctx, "textured.xml", IMP_RGB, size);
}

static inline imp_scene *gain_open(imp_context *ctx, int side, const char *objects)
{
    static const char frame[] =
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='5'/></integrator><sensor type='perspective'><float name='fov' "
        "value='40'/>"
        "<transform name='to_world'><lookat origin='0,2.4,5' target='0,.6,0' "
        "up='0,1,0'/></transform><sampler type='independent'/><film "
        "type='hdrfilm'><integer "
        "name='width' value='%d'/><integer name='height' value='%d'/><rfilter "
        "type='box'/></film></sensor>"
        "<emitter type='constant' id='sky'><rgb name='radiance' "
        "value='.3,.4,.6'/></emitter>"
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
        "<translate x='-1' y='3' z='1'/></transform><emitter type='area' id='lamp'><rgb "
        "name='radiance' value='6,5,4'/></emitter></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate "
        "x='1' "
        "angle='-90'/></transform><bsdf type='diffuse' id='clay'><rgb name='reflectance' "
        "value='.6,.4,.3'/></bsdf></shape>"
        "%s</scene>";
    char text[4096];
    snprintf(text, sizeof text, frame, side, side, objects);
    return test_scene_text(ctx, text, IMP_RGB);
}

#endif
