/* SPDX-License-Identifier: Apache-2.0
 *
 * The unified glare rating of CIE 117, from numbers. */
#include "base/arguments.h"
#include <importon/rooms.h>
#include <math.h>

double imp_guth_position(double a, double b)
{
    if (!(a >= 0 && a <= 90 && b >= 0 && b <= 90)) return NAN;
    const double first = 35.2 - 0.31889 * a - 1.22 * exp(-2 * a / 9);
    const double second = 21 + 0.26667 * a - 0.002963 * a * a;
    return exp(first * 1e-3 * b + second * 1e-5 * b * b);
}

enum imp_status imp_ugr(imp_context *context, double background, size_t n,
                        const struct imp_glare_source *source, double *ugr)
{
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, ugr, "ugr");
    if (n > 0) IMP_REQUIRE(context, source, "source");
    IMP_FINITE(context, background, "background");
    if (!(background > 0))
        return imp__error(context, IMP_E_ARG, "background = %g is not above 0",
                          background);
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        const struct imp_glare_source *s = &source[i];
        IMP_FINITE_ALL(context, &s->luminance, 1, "source.luminance");
        IMP_FINITE_ALL(context, &s->solid_angle, 1, "source.solid_angle");
        IMP_FINITE_ALL(context, &s->position, 1, "source.position");
        if (!(s->luminance >= 0 && s->solid_angle >= 0 && s->position > 0))
            return imp__error(context, IMP_E_ARG,
                              "source %zu: luminance %g, solid angle %g, position %g", i,
                              s->luminance, s->solid_angle, s->position);
        sum += s->luminance * s->luminance * s->solid_angle / (s->position * s->position);
    }
    *ugr = 8 * log10(0.25 / background * sum);
    return IMP_OK;
}
