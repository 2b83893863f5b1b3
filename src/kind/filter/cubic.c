/* SPDX-License-Identifier: Apache-2.0
 *
 * mitchell and catmullrom: the cubic splines of Mitchell and Netravali (1988),
 *
 *     6 k(x) = (12 - 9 B - 6 C) x^3 + (-18 + 12 B + 6 C) x^2 + 6 - 2 B               x < 1
 *     6 k(x) = (-B - 6 C) x^3 + (6 B + 30 C) x^2 + (-12 B - 48 C) x + 8 B + 24 C     x < 2
 *
 * B = C = 1/3 by default; Catmull and Rom have B = 0, C = 1/2. */
#include "filter.h"
#include <math.h>

struct cubic {
    double inner[4], outer[4]; /* from the constant up */
};

static void coefficients(struct cubic *k, double B, double C)
{
    *k = (struct cubic){
        {(6 - 2 * B) / 6, 0, (-18 + 12 * B + 6 * C) / 6, (12 - 9 * B - 6 * C) / 6},
        {(8 * B + 24 * C) / 6, (-12 * B - 48 * C) / 6, (6 * B + 30 * C) / 6,
         (-B - 6 * C) / 6}};
}
static enum imp_status mitchell_build(const struct imp_build *b, void *self,
                                      struct imp_filter *f)
{
    enum imp_status st = IMP_OK;
    static const char *const names[2] = {"B", "C"};
    double value[2];
    for (int k = 0; k < 2; k++) {
        IMP_TRY(imp__props_float_in(b->ctx, b->node, names[k], 1. / 3,
                                    (struct imp_interval){0, 1, IMP_CLOSED}, &value[k]));
    }
    f->radius = 2;
    coefficients(self, value[0], value[1]);
out:
    return st;
}
static enum imp_status catmullrom_build(const struct imp_build *b, void *self,
                                        struct imp_filter *f)
{
    (void)b;
    f->radius = 2;
    coefficients(self, 0, 0.5);
    return IMP_OK;
}
static double eval(const struct imp_filter *f, double x)
{
    const struct cubic *k = f->self;
    x = fabs(x);
    const double *c = x < 1 ? k->inner : k->outer;
    return x < 2 ? c[0] + x * (c[1] + x * (c[2] + x * c[3])) : 0;
}

const struct imp_filter_ops imp__mitchell = {.size = sizeof(struct imp_filter_ops),
                                             .name = "mitchell",
                                             .object_size = sizeof(struct cubic),
                                             .build = mitchell_build,
                                             .eval = eval};
const struct imp_filter_ops imp__catmullrom = {.size = sizeof(struct imp_filter_ops),
                                               .name = "catmullrom",
                                               .object_size = sizeof(struct cubic),
                                               .build = catmullrom_build,
                                               .eval = eval};
