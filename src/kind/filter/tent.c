/* SPDX-License-Identifier: Apache-2.0
 *
 * tent: max(0, 1 - |x|/r). */
#include "filter.h"
#include <math.h>

static enum imp_status build(const struct imp_build *b, void *self, struct imp_filter *f)
{
    (void)self;
    return imp__filter_size(b, "radius", 1, IMP_FILTER_RADIUS_MAX, &f->radius);
}
static double eval(const struct imp_filter *f, double x)
{
    return imp_max(1 - fabs(x) / f->radius, 0.0);
}

const struct imp_filter_ops imp__tent = {
    .size = sizeof(struct imp_filter_ops), .name = "tent", .build = build, .eval = eval};
