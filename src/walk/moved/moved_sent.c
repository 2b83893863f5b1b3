/* SPDX-License-Identifier: Apache-2.0
 *
 * Slopes of what lights send (moved_sent.h): of spots, and of tables of luminaires. */
#include "moved_sent.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include "math/warp.h"
#include "walk/core/emitted.h"

extern const struct imp_emitter_ops imp__projector;

#define TURN 1e-6

bool imp__has_picture(const struct imp_emitter *e)
{
    bool any = e->ops == &imp__projector;
    for (int k = 0; k < e->n_in && imp__light_frame_of(e); k++)
        any |= e->input[k]->texture != NULL;
    return any;
}

/* What it sends along d, by lanes. */
static imp_spec sent(const struct imp_emitter *e, imp_v3 d,
                     const struct imp_carried *carried)
{
    const struct imp_emission x = {.dist = 1, .cos_light = 1, .d = d};
    struct imp_texcoord at = {.carried = carried};
    imp_spec in[IMP_INPUTS_MAX], le;
    imp__emitter_place(e, &x, &at);
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval(e, in, &x, &le);
    return le;
}

imp_v3 imp__picture_slope(const struct imp_emitter *e, imp_v3 d, imp_spec bar, int lanes,
                          const struct imp_carried *carried)
{
    const struct imp_frame f = imp__frame_from_normal(d);
    const imp_v3 across[2] = {f.s, f.t};
    const imp_spec middle = sent(e, d, carried);
    imp_v3 slope = {0};
    for (int c = 0; c < 4; c++) bar[c] = middle[c] > 0 ? bar[c] / middle[c] : 0;
    for (int k = 0; k < 2; k++) {
        imp_spec L[2];
        for (int j = 0; j < 2; j++)
            L[j] = sent(e, imp__normalize(d + across[k] * (j ? TURN : -TURN)), carried);
        if (imp__is_zero(L[0]) || imp__is_zero(L[1])) continue; /* its border */
        slope += across[k] * (imp__sum_used((L[1] - L[0]) * bar, lanes) / (2 * TURN));
    }
    return slope;
}

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
