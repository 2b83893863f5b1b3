/* SPDX-License-Identifier: Apache-2.0
 *
 * A ground with a block on it under many lamps, as text, for tests and benchmarks: squares
 * turned every way, or points; their radiances lie within two decades. */
#ifndef IMP_TEST_LAMPS_H
#define IMP_TEST_LAMPS_H

#include "math/rng.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct lamps {
    int n;
    const char *choice; /* of the integrator: "weights", "tree" */
    int points;         /* or squares */
    int res, depth;
    const char *more; /* XML; "" */
};

/* To be freed. */
static inline char *lamps_text(const struct lamps *l)
{
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (!f) abort();
    const double half = sqrt(l->n); /* four square metres a lamp */
    fprintf(
        f,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='%d'/><boolean name='hide_emitters' value='true'/><string "
        "name='light_choice' value='%s'/></integrator><sensor type='perspective' "
        "id='eye'><float name='fov' value='60'/><transform name='to_world'><lookat "
        "origin='0,4,-10' target='2,0,5' up='0,1,0'/></transform><film type='hdrfilm'>"
        "<integer name='width' value='%d'/><integer name='height' value='%d'/><rfilter "
        "type='box'/></film></sensor><bsdf type='diffuse' id='ground'><rgb "
        "name='reflectance' value='0.5,0.4,0.3'/></bsdf><shape type='rectangle' "
        "id='floor'><transform name='to_world'><scale x='%g' y='%g'/><rotate x='1' "
        "angle='-90'/></transform><ref id='ground'/></shape><shape type='cube' "
        "id='block'><transform name='to_world'><translate x='2' y='0.5' "
        "z='4'/></transform><ref id='ground'/></shape>",
        l->depth, l->choice, l->res, l->res, 2 * half, 2 * half);
    for (int i = 0; i < l->n; i++) {
        const struct imp_key key = imp__key(77, 0, (uint64_t)i);
        double u[9];
        for (int k = 0; k < 9; k++) u[k] = imp__u01(key, (uint32_t)k);
        const double x = (2 * u[0] - 1) * half, y = 2.5 + 3 * u[1],
                     z = (2 * u[2] - 1) * half, e = pow(100, u[3]);
        const double rgb[3] = {e * (0.5 + u[4]), e * (0.5 + u[5]), e * (0.5 + u[6])};
        if (l->points)
            fprintf(f,
                    "<emitter type='point' id='lamp%d'><point name='position' x='%.6g' "
                    "y='%.6g' z='%.6g'/><rgb name='intensity' "
                    "value='%.6g,%.6g,%.6g'/></emitter>",
                    i, x, y, z, rgb[0], rgb[1], rgb[2]);
        else
            fprintf(f,
                    "<shape type='rectangle'><transform name='to_world'><scale "
                    "value='0.1'/><rotate x='1' angle='%.6g'/><rotate y='1' "
                    "angle='%.6g'/><translate x='%.6g' y='%.6g' z='%.6g'/></transform>"
                    "<emitter type='area' id='lamp%d'><rgb name='radiance' "
                    "value='%.6g,%.6g,%.6g'/></emitter></shape>",
                    30 + 120 * u[7], 360 * u[8], x, y, z, i, rgb[0], rgb[1], rgb[2]);
    }
    fprintf(f, "%s</scene>", l->more);
    fclose(f);
    return text;
}

#endif
