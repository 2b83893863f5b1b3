/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights that are made some at a time, beside the same walks alone (light_kit.h): lights,
 * sensors, limits. */
#include "light_kit.h"

#define DEPTH(n) "<integer name='max_depth' value='" n "'/>"
#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='8'/>"                             \
    "<integer name='height' value='6'/><rfilter type='tent'/></film>"
#define VIEW                                                                             \
    "<transform name='to_world'><lookat origin='0.3,0.4,3.4' target='0,0,0' "            \
    "up='0,1,0'/></transform>"
#define CAMERA                                                                           \
    "<sensor type='perspective'><float name='fov' value='60'/>" VIEW FILM "</sensor>"
#define DIFFUSE "<bsdf type='diffuse'><rgb name='reflectance' value='.7,.5,.3'/></bsdf>"
#define FLOOR                                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"              \
    "<rotate x='1' angle='-90'/><translate y='-1'/></transform>" DIFFUSE "</shape>"
#define LAMP(at)                                                                         \
    "<shape type='rectangle'><transform name='to_world'><scale value='.3'/>"             \
    "<rotate x='1' angle='70'/><translate " at "/></transform><emitter type='area'>"     \
    "<rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define GLASS                                                                            \
    "<shape type='sphere'><float name='radius' value='.5'/>"                             \
    "<bsdf type='dielectric'/></shape>"
#define METAL                                                                            \
    "<shape type='cube'><transform name='to_world'><scale value='.3'/>"                  \
    "<translate x='-1' y='-.7'/></transform><bsdf type='roughconductor'/></shape>"
#define BULB                                                                             \
    "<shape type='sphere'><float name='radius' value='.2'/>"                             \
    "<point name='center' x='1' y='.5' z='0'/><emitter type='area'>"                     \
    "<rgb name='radiance' value='3,4,5'/></emitter></shape>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.2,.3,.4'/></emitter>"
#define SEEN(kind)                                                                       \
    "<shape type='rectangle'><transform name='to_world'><scale value='.4'/><rotate "     \
    "x='1' angle='-20'/></transform><emitter type='" kind                                \
    "'><rgb name='radiance' value='2,1,3'/></emitter></shape>"
#define POINT                                                                            \
    "<emitter type='point'><point name='position' x='.5' y='1' z='1'/></emitter>"

int main(void)
{
    ctx = test_context(1);
    compare("a lamp over glass", IMP_RGB, true, DEPTH("7"),
            CAMERA FLOOR LAMP("y='1.5'") GLASS METAL);
    compare("a lamp in spectra", IMP_SPECTRAL, true, DEPTH("7"),
            CAMERA FLOOR LAMP("y='1.5'") GLASS METAL);
    compare("in grey", IMP_MONO, true, DEPTH("7"), CAMERA FLOOR LAMP("y='1.5'"));
    compare("a bulb", IMP_RGB, true, DEPTH("7"), CAMERA FLOOR BULB METAL);
    compare("lamps, a point and a sky", IMP_RGB, true, DEPTH("7"),
            CAMERA FLOOR LAMP("y='1.5'") LAMP("x='1' y='1.2'") BULB POINT SKY GLASS);
    compare("a thin lens", IMP_RGB, true, DEPTH("7"),
            "<sensor type='thinlens'><float name='aperture_radius' value='.1'/><float "
            "name='focus_distance' value='3'/>" VIEW FILM
            "</sensor>" FLOOR LAMP("y='1.5'") GLASS);
    compare("a meter", IMP_RGB, false, DEPTH("7"),
            FLOOR LAMP("y='1.5'") GLASS
            "<shape type='rectangle'><transform name='to_world'><rotate x='1' "
            "angle='-90'/><translate y='-.9'/></transform><sensor "
            "type='irradiancemeter'>" FILM "</sensor></shape>");
    compare("a lamp that the camera sees", IMP_RGB, true, DEPTH("3"),
            CAMERA FLOOR METAL SEEN("area"));
    compare("a lamp that the camera sees, and nothing else", IMP_RGB, true, DEPTH("1"),
            CAMERA FLOOR SEEN("area"));
    compare("a lamp that the camera sees in spectra", IMP_SPECTRAL, true, DEPTH("4"),
            CAMERA FLOOR METAL SEEN("area"));
    compare("one bounce", IMP_RGB, true, DEPTH("2"), CAMERA FLOOR LAMP("y='1.5'") METAL);
    compare("as long as roulette lets it", IMP_RGB, true,
            DEPTH("-1") "<integer name='rr_depth' value='1'/>",
            CAMERA FLOOR LAMP("y='1.5'") GLASS METAL);
    compare(
        "an open shutter, and a lens that distorts", IMP_RGB, true, DEPTH("7"),
        "<sensor type='perspective'><float name='shutter_open' value='.2'/><float "
        "name='shutter_close' value='.9'/><float name='opencv_k1' value='-.1'/><float "
        "name='fov' value='60'/>" VIEW FILM "</sensor>" FLOOR LAMP("y='1.5'") GLASS);
    compare("an orthographic camera", IMP_RGB, true, DEPTH("6"),
            "<sensor type='orthographic'><transform name='to_world'><scale value='3'/>"
            "<lookat origin='0.3,2,3.4' target='0,0,0' up='0,1,0'/></transform>" FILM
            "</sensor>" FLOOR LAMP("y='1.5'") GLASS METAL);
    compare("a mask", IMP_RGB, false, DEPTH("6"),
            CAMERA FLOOR LAMP("y='1.5'") "<shape type='sphere'><bsdf type='mask'><float "
                                         "name='opacity' value='.5'/>" DIFFUSE
                                         "</bsdf></shape>");
    imp_context_destroy(ctx);
    return tap_done();
}
