/* SPDX-License-Identifier: Apache-2.0
 *
 * Slopes of what lights send (moved_sent.h): of spots, and of tables of luminaires. */
#include "moved_sent.h"
#include "kind/emitter/ies.h"
#include "math/warp.h"

#define TURN 1e-6

imp_v3 imp__sent_slope(const struct imp_emitter *e, imp_v3 d, int lanes,
                       const struct imp_carried *carried)
{
    const struct imp_frame f = imp__frame_from_normal(d);
    const struct imp_texcoord nowhere = {.carried = carried};
    const imp_v3 across[2] = {f.s, f.t};
    imp_spec in[IMP_INPUTS_MAX];
    imp_v3 slope = {0};
    imp__inputs_eval(e->input, e->n_in, &nowhere, in);
    for (int k = 0; k < 2; k++) {
        double value[2];
        for (int j = 0; j < 2; j++) {
            const struct imp_emission x = {
                .dist = 1,
                .cos_light = 1,
                .d = imp__normalize(d + across[k] * (j ? TURN : -TURN))};
            imp_spec le;
            e->ops->eval(e, in, &x, &le);
            value[j] = imp__sum_used(le, lanes);
        }
        const double middle = 0.5 * (value[0] + value[1]);
        if (middle > 0)
            slope += across[k] * ((value[1] - value[0]) / (2 * TURN * middle));
    }
    return slope;
}

imp_v3 imp__table_bar(const struct imp__moves *moves, const struct imp_emitter *e,
                      const struct imp__glued *y, imp_v3 d, double bar, int lanes,
                      const struct imp_carried *carried, double *theta_bar)
{
    if (imp_likely(e->ops != &imp__ies_area) || bar == 0) return (imp_v3){0};
    const imp_v3 slope = imp__sent_slope(e, d, lanes, carried) * bar;
    const imp_v3 by_frame = imp__cross(slope, d);
    const struct imp__velocity turn = {.n = imp__cross(by_frame, y->n),
                                       .turn = imp__dot(by_frame, y->n)};
    imp__velocity_bar(moves, y, &turn, theta_bar);
    return slope;
}
