/* SPDX-License-Identifier: Apache-2.0
 *
 * Small scenes for tests of problems and fits. */
#ifndef INVERSE_SCENES_H
#define INVERSE_SCENES_H

#include <importon/importon.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A diffuse ball under a constant sky, filling the picture: every pixel is rho E. */
static const char ball_xml[] =
    "<scene version='3.0.0'>"
    "<integrator type='path'><integer name='max_depth' value='2'/></integrator>"
    "<sensor type='orthographic' id='camera'>"
    "  <transform name='to_world'><scale value='.5'/>"
    "    <lookat origin='0,0,3' target='0,0,0' up='0,1,0'/></transform>"
    "  <sampler type='independent'><integer name='sample_count' value='16'/></sampler>"
    "  <film type='hdrfilm'><integer name='width' value='12'/><integer name='height' "
    "value='10'/>"
    "    <rfilter type='box'/></film></sensor>"
    "<emitter type='constant' id='sky'><rgb name='radiance' value='2'/></emitter>"
    "<bsdf type='diffuse' id='ball'><rgb name='reflectance' value='.3,.5,.7'/></bsdf>"
    "<bsdf type='dielectric' id='glass'/>"
    "<shape type='sphere'><ref id='ball'/></shape>"
    "<shape type='sphere'><transform name='to_world'><translate z='-50'/></transform>"
    "  <ref id='glass'/></shape>"
    "</scene>";

#define BOX_SENSOR(id, origin, target)                                                   \
    "<sensor type='perspective' id='" id "'><float name='fov' value='50'/>"              \
    "  <transform name='to_world'><lookat origin='" origin "' target='" target           \
    "' up='0,1,0'/></transform>"                                                         \
    "  <sampler type='independent'><integer name='sample_count' value='64'/></sampler>"  \
    "  <film type='hdrfilm'><integer name='width' value='24'/>"                          \
    "    <integer name='height' value='16'/><rfilter type='box'/></film></sensor>"

/* A floor and two walls under two lamps, which no sensor sees; the second sensor sees the
 * right wall alone. */
static const char box_xml[] =
    "<scene version='3.0.0'>"
    "<integrator type='path'><integer name='max_depth' "
    "value='4'/></integrator>" BOX_SENSOR("front", "0,1,4", "0,.4,0") BOX_SENSOR(
        "side", "-.5,.8,0",
        "1,.8,0") "<bsdf type='diffuse' id='white'><rgb name='reflectance' "
                  "value='.7'/></bsdf>"
                  "<bsdf type='diffuse' id='red'><rgb name='reflectance' "
                  "value='.6,.1,.05'/></bsdf>"
                  "<bsdf type='diffuse' id='green'><rgb name='reflectance' "
                  "value='.1,.5,.15'/></bsdf>"
                  "<shape type='rectangle'><transform name='to_world'><rotate x='1' "
                  "angle='-90'/></transform>"
                  "  <ref id='white'/></shape>"
                  "<shape type='rectangle'><transform name='to_world'><rotate y='1' "
                  "angle='90'/>"
                  "  <translate x='-1' y='1'/></transform><ref id='red'/></shape>"
                  "<shape type='rectangle'><transform name='to_world'><rotate y='1' "
                  "angle='-90'/>"
                  "  <translate x='1' y='1'/></transform><ref id='green'/></shape>"
                  "<shape type='rectangle'><transform name='to_world'><scale value='.2'/>"
                  "  <rotate x='1' angle='90'/><translate x='-.6' y='2.2'/></transform>"
                  "  <emitter type='area' id='lamp1'><rgb name='radiance' "
                  "value='9,7,5'/></emitter></shape>"
                  "<shape type='rectangle'><transform name='to_world'><scale value='.2'/>"
                  "  <rotate x='1' angle='90'/><translate x='.6' y='2.2'/></transform>"
                  "  <emitter type='area' id='lamp2'><rgb name='radiance' "
                  "value='4,6,8'/></emitter></shape>"
                  "</scene>";

static inline imp_scene *scene_open(imp_context *ctx, const char *xml,
                                    enum imp_color_mode mode)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *scene = NULL;
    o.mode = mode;
    if (imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &scene) != IMP_OK) {
        printf("Bail out! %s\n", imp_last_error(ctx));
        exit(1);
    }
    return scene;
}

/* A picture of the scene as it is, as a target of the sensor; pixels belong to *film. */
static inline struct imp_target target_of(imp_context *ctx, const imp_scene *scene,
                                          int sensor, int spp, uint64_t seed,
                                          imp_film **film)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_film_info info = {.size = sizeof info};
    run.sensor = sensor;
    run.spp = spp;
    run.seed = seed;
    if (imp_render(scene, &run, film) != IMP_OK) {
        printf("Bail out! %s\n", imp_last_error(ctx));
        exit(1);
    }
    imp_film_get_info(*film, &info);
    t.sensor = sensor;
    t.width = info.width;
    t.height = info.height;
    t.channels = info.channels;
    t.pixels = imp_film_mean(*film);
    t.noise_se = imp_film_se(*film);
    return t;
}

#endif
