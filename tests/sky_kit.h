/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of skies: meters below them, and what is refused. */
#ifndef IMP_TEST_SKY_KIT_H
#define IMP_TEST_SKY_KIT_H

#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>

#define METER(facing)                                                                    \
    "<shape type='rectangle'><transform name='to_world'><scale value='.1'/></transform>" \
    "<sensor type='irradiancemeter'><boolean name='virtual' value='true'/>" facing       \
    "<string name='units' value='photometric'/><film type='hdrfilm'><integer "           \
    "name='width' value='1'/><integer name='height' value='1'/></film></sensor></shape>"
#define HEAD "<scene version='3.0.0'><integrator type='path'/>"

static inline struct imp_estimate read_meter(imp_context *ctx, imp_scene *s, int sensor,
                                             enum imp_from from)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    double value, se;
    run.spp = from == IMP_FROM_LIGHTS ? 200000 : 40000;
    run.sensor = sensor;
    run.from = from;
    test_must(ctx, imp_grid_read(s, &run, &value, &se, &e, NULL));
    return e;
}

/* An emitter with these properties is an error that has this word. */
static inline void sky_refused(imp_context *ctx, const char *kind, const char *properties,
                               const char *word)
{
    char xml[1024];
    imp_scene *s = NULL;
    snprintf(xml, sizeof xml, HEAD "<emitter type='%s'>%s</emitter></scene>", kind,
             properties);
    const enum imp_status st =
        imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), word), "%s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

#endif
