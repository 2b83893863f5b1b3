/* SPDX-License-Identifier: Apache-2.0
 *
 * A scene whose lamps are dimmed or off for a while: each has a factor over time (math/course.h),
 * so that with 0 its light and the derivatives with respect to its numbers are 0, whatever
 * these are, and no light samples. */
#ifndef IMP_INVERSE_LAMP_LEVELS_H
#define IMP_INVERSE_LAMP_LEVELS_H

#include "math/course.h"
#include "scene/scene.h"

struct imp__lamp_levels {
    struct imp_scene *scene;          /* NULL: nothing is to be undone */
    const struct imp_course **before; /* [n_emitters] what they were */
    struct imp_course *now;           /* [n_emitters] */
    double *numbers;                  /* times and values of `now`, the chances before */
    bool timed;                       /* did lights of the scene vary in time before? */
};

/* level [n_emitters]: of each emitter in the scene's order, not negative; NAN: as it is. The
 * chances of light samples follow. To be ended by imp__lamp_levels_end, also after a failure.
 * Nothing else may use the scene in between. */
enum imp_status imp__lamp_levels_begin(struct imp_scene *scene, const double *level,
                                       struct imp__lamp_levels *out);
void imp__lamp_levels_end(struct imp__lamp_levels *l);

#endif
