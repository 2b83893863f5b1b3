/* SPDX-License-Identifier: Apache-2.0
 *
 * gaussian: exp(-x^2 / 2 sigma^2), lowered so that it is zero at its radius of 4 sigma.
 */
#include "filter.h"
#include <math.h>

struct gaussian {
    double inv_2_sigma2, at_radius;
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_filter *f)
{
    struct gaussian *g = self;
    double sigma;
    const enum imp_status st =
        imp__filter_size(b, "stddev", 0.5, IMP_FILTER_RADIUS_MAX / 4, &sigma);
    if (st != IMP_OK) return st;
    f->radius = 4 * sigma;
    g->inv_2_sigma2 = 1 / (2 * sigma * sigma);
    g->at_radius = exp(-8);
    return IMP_OK;
}
static double eval(const struct imp_filter *f, double x)
{
    const struct gaussian *g = f->self;
    return imp_max(exp(-x * x * g->inv_2_sigma2) - g->at_radius, 0.0);
}

const struct imp_filter_ops imp__gaussian = {.size = sizeof(struct imp_filter_ops),
                                             .name = "gaussian",
                                             .object_size = sizeof(struct gaussian),
                                             .build = build,
                                             .eval = eval};
