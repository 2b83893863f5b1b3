/* SPDX-License-Identifier: Apache-2.0
 *
 * lanczos: sinc(x) sinc(x/lobes) up to |x| = lobes, sinc(x) = sin(pi x)/(pi x). */
#include "filter.h"
#include "math/vec.h"
#include <math.h>

struct lanczos {
    double lobes;
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_filter *f)
{
    struct lanczos *l = self;
    int64_t lobes;
    const enum imp_status st =
        imp_build_int(b, "lobes", 3, 1, (int64_t)IMP_FILTER_RADIUS_MAX, &lobes);
    if (st != IMP_OK) return st;
    f->radius = l->lobes = (double)lobes;
    return IMP_OK;
}
static double sinc(double x)
{
    x *= IMP_PI;
    return fabs(x) < 1e-4 ? 1 - x * x / 6 : sin(x) / x;
}
static double eval(const struct imp_filter *f, double x)
{
    const struct lanczos *l = f->self;
    return fabs(x) < l->lobes ? sinc(x) * sinc(x / l->lobes) : 0;
}

const struct imp_filter_ops imp__lanczos = {.size = sizeof(struct imp_filter_ops),
                                            .name = "lanczos",
                                            .object_size = sizeof(struct lanczos),
                                            .build = build,
                                            .eval = eval};
