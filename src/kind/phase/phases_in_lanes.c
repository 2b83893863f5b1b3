/* SPDX-License-Identifier: Apache-2.0
 *
 * Phase functions in lanes: hg of one mean cosine for all colours, and isotropic. */
#include "kind/kind_lanes.h"
#include "math/trig.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "math/warp_text.h"
#include "math/lane_text.h"
#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/phase/turn_text.h"
#include "math/lane_text.h"

extern const struct imp_phase_ops imp__hg, imp__isotropic;

static imp_wide3 turn(const imp_wide3 *wo, imp_wide cosine, imp_wide u)
{
    imp_wide sin_u, cos_u;
    IMP_WIDE_OF(imp__sincos_turns)(u, &sin_u, &cos_u);
    return IMP_WIDE_OF(imp__turned)(*wo, cosine, sin_u, cos_u);
}

/* ---- hg ---------------------------------------------------------------------------------- */

static bool hg_covers(const struct imp_phase *p)
{
    const struct imp_input *g = p->input[0];
    return g->plain && g->value[0] == g->value[1] && g->value[0] == g->value[2];
}
static imp_wide hg_g(const struct imp_phase *p)
{
    return imp__wide(p->input[0]->value[0]);
}
static imp_wide3 hg_sample(const struct imp_phase *p, const imp_wide3 *wo,
                           const imp_wide u[3])
{
    return turn(wo, IMP_WIDE_OF(imp__hg_cosine)(hg_g(p), u[1]), u[2]);
}
static imp_wide hg_value(const struct imp_phase *p, const imp_wide3 *wo,
                         const imp_wide3 *wi)
{
    return IMP_WIDE_OF(imp__hg_value)(hg_g(p), IMP_WIDE_OF(imp__turn_cosines)(*wo, *wi));
}

/* ---- isotropic --------------------------------------------------------------------------- */

static imp_wide3 isotropic_sample(const struct imp_phase *p, const imp_wide3 *wo,
                                  const imp_wide u[3])
{
    (void)p;
    return turn(wo, 1 - 2 * u[1], u[2]);
}
static imp_wide isotropic_value(const struct imp_phase *p, const imp_wide3 *wo,
                                const imp_wide3 *wi)
{
    (void)p, (void)wo, (void)wi;
    return imp__wide(IMP_INV_PI / 4);
}

/* ---- All --------------------------------------------------------------------------------- */

const struct imp_phase_lanes *imp__phase_lanes(const struct imp_phase *p)
{
    static const struct imp_phase_lanes hg = {.sample = hg_sample, .value = hg_value},
                                        isotropic = {.sample = isotropic_sample,
                                                     .value = isotropic_value};
    if (p->ops == &imp__hg && hg_covers(p)) return &hg;
    return p->ops == &imp__isotropic ? &isotropic : NULL;
}
