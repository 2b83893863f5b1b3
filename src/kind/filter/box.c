/* SPDX-License-Identifier: Apache-2.0
 *
 * box: a sample counts for its own pixel, and fully. */
#include "kind/build.h"

static enum imp_status build(const struct imp_build *b, void *self, struct imp_filter *f)
{
    (void)b, (void)self;
    f->radius = 0.5;
    return IMP_OK;
}
static double eval(const struct imp_filter *f, double x)
{
    return x >= -f->radius && x < f->radius;
}

const struct imp_filter_ops imp__box = {
    .size = sizeof(struct imp_filter_ops), .name = "box", .build = build, .eval = eval};
