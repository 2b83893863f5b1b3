/* SPDX-License-Identifier: Apache-2.0
 *
 * Connections of points to the sensor, in lanes (light_reach.c: of one walk). Sensors without a form in
 * lanes, and those that take random numbers, are evaluated one point at a time. */
#include "kind/cleared.h"
#include "light_bundle.h"

static void see_alone(const struct imp_sensor *sensor,
                      const struct imp_wide_block *numbers, int depth, const imp_wide3 *p,
                      unsigned bits, struct imp_light_seen *out)
{
    imp_wide u[4] = {imp__wide(0), imp__wide(0), imp__wide(0), imp__wide(0)};
    if (!(sensor->ops->flags & IMP_SENSOR_PINHOLE)) {
        u[0] = imp__wide_number(numbers, imp__dim(depth, IMP_DIM_LIGHT_U));
        u[1] = imp__wide_number(numbers, imp__dim(depth, IMP_DIM_LIGHT_V));
        u[2] = imp__wide_number(numbers, imp__dim(depth, IMP_DIM_LIGHT));
        u[3] = imp__wide_number(numbers, imp__dim(depth, IMP_DIM_SPARE));
    }
    out->at.drawn = (imp_wide_truth){0};
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const double own[4] = {u[0][k], u[1][k], u[2][k], u[3][k]};
        const imp_v3 ref = imp__wide3_lane(p, k);
        struct imp_sensor_sample to;
        if (!imp__sensor_connect(sensor, &ref, false, own, &to)) continue;
        out->at.drawn[k] = -1;
        imp__wide3_set(&out->at.p, k, to.p);
        imp__wide3_set(&out->at.wo, k, to.wo);
        out->at.px[k] = to.px;
        out->at.py[k] = to.py;
        out->at.weight[k] = to.weight;
        out->reach[k] = imp__light_shadow_reach(&to);
    }
}

unsigned imp__light_bundle_see(const struct imp_sensor *sensor,
                               const struct imp_wide_block *numbers, int depth,
                               const imp_wide3 *p, unsigned bits,
                               struct imp_light_seen *out)
{
    const struct imp_sensor_lanes *lanes = imp__sensor_lanes(sensor);
    if (lanes && lanes->connect) {
        lanes->connect(sensor, p, &out->at);
        out->reach = imp__wide(1);
    } else {
        see_alone(sensor, numbers, depth, p, bits, out);
    }
    bits &= imp__wide_bits(out->at.drawn);
    if (!bits) return 0;
    const struct imp_film_bounds film = imp__light_film(sensor);
    const imp_wide x = out->at.px - film.x, y = out->at.py - film.y;
    return bits & imp__wide_bits((x >= imp__wide(-film.margin)) &
                                 (x < imp__wide(film.width + film.margin)) &
                                 (y >= imp__wide(-film.margin)) &
                                 (y < imp__wide(film.height + film.margin)));
}
