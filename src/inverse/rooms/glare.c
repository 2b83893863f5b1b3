/* SPDX-License-Identifier: Apache-2.0
 *
 * The unified glare rating of CIE 117 and the daylight glare probability, from numbers. */
#include "base/arguments.h"
#include "dgp.h"
#include "math/vec.h"
#include <importon/rooms.h>
#include <math.h>

double imp_iwata_position(double b)
{
    if (!(b >= 0 && b <= 90)) return NAN;
    const double r = b < 89 ? fmin(tan(b * IMP_PI / 180), 3) : 3;
    return 1 + (r > 0.6 ? 1.2 : 0.8) * r;
}

/* sum L^2 w/p^2 */
static enum imp_status sources_add(imp_context *context, const char *function, size_t n,
                                   const struct imp_glare_source *source, double *sum)
{
    *sum = 0;
    for (size_t i = 0; i < n; i++) {
        const struct imp_glare_source *s = &source[i];
        const double all[] = {s->luminance, s->solid_angle, s->position};
        IMP_CHECKED(imp__finite_check(context, function, "source", all, 3));
        if (!(s->luminance >= 0 && s->solid_angle >= 0 && s->position > 0))
            return imp__error(context, IMP_E_ARG,
                              "source %zu: luminance %g, solid angle %g, position %g", i,
                              s->luminance, s->solid_angle, s->position);
        *sum +=
            s->luminance * s->luminance * s->solid_angle / (s->position * s->position);
    }
    return IMP_OK;
}

enum imp_status imp_ugr(imp_context *context, double background, size_t n,
                        const struct imp_glare_source *source, double *ugr)
{
    double sum;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, ugr, "ugr");
    if (n > 0) IMP_REQUIRE(context, source, "source");
    IMP_FINITE(context, background, "background");
    if (!(background > 0))
        return imp__error(context, IMP_E_ARG, "background = %g is not above 0",
                          background);
    IMP_CHECKED(sources_add(context, __func__, n, source, &sum));
    *ugr = 8 * log10(0.25 / background * sum);
    return IMP_OK;
}

double imp__dgp_of(double illuminance, double sum)
{
    const double contrast = sum > 0 ? sum / pow(illuminance, 1.87) : 0;
    return 5.87e-5 * illuminance + 0.0918 * log10(1 + contrast) + 0.16;
}

enum imp_status imp_dgp(imp_context *context, double illuminance, size_t n,
                        const struct imp_glare_source *source, double *dgp)
{
    double sum;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, dgp, "dgp");
    if (n > 0) IMP_REQUIRE(context, source, "source");
    IMP_FINITE(context, illuminance, "illuminance");
    IMP_CHECKED(sources_add(context, __func__, n, source, &sum));
    if (!(illuminance >= 0) || (illuminance == 0 && sum > 0))
        return imp__error(context, IMP_E_ARG,
                          "illuminance = %g lx: it is not above 0, or at least 0 without "
                          "a source",
                          illuminance);
    *dgp = imp__dgp_of(illuminance, sum);
    return IMP_OK;
}
