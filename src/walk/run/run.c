/* SPDX-License-Identifier: Apache-2.0
 *
 * A run as the host gives it, checked and copied (run.h). */
#include "run.h"
#include "walk/kept/store.h"
#include <math.h>

enum imp_status imp__run_take_picture(imp_context *ctx, const char *function,
                                      const struct imp_run *run, struct imp_run *own)
{
    struct imp_run r = IMP_RUN_INIT;
    IMP_CHECKED(imp__options_take(ctx, function, "run", run, &r, sizeof r));
    if (r.spp < 0)
        return imp__error(ctx, IMP_E_ARG, "%s: run->spp %d is negative", function, r.spp);
    if (!(r.time_limit_s >= 0) || !isfinite(r.time_limit_s))
        return imp__error(ctx, IMP_E_ARG, "%s: run->time_limit_s %g is not a number >= 0",
                          function, r.time_limit_s);
    if (!(r.drop_budget >= 0 && r.drop_budget <= 1))
        return imp__error(ctx, IMP_E_ARG, "%s: run->drop_budget %g is outside [0, 1]",
                          function, r.drop_budget);
    if ((int)r.wavelengths < 0 || r.wavelengths > IMP_WAVELENGTHS_IMPORTANCE)
        return imp__error(ctx, IMP_E_ARG, "%s: run->wavelengths %d is not known",
                          function, (int)r.wavelengths);
    if (r.wavelength_set < 0)
        return imp__error(ctx, IMP_E_ARG, "%s: run->wavelength_set %d is negative",
                          function, r.wavelength_set);
    if ((int)r.from < 0 || r.from > IMP_FROM_LIGHTS)
        return imp__error(ctx, IMP_E_ARG, "%s: run->from %d is not known", function,
                          (int)r.from);
    if ((int)r.points < 0 || r.points > IMP_POINTS_WHOLE)
        return imp__error(ctx, IMP_E_ARG, "%s: run->points %d is not known", function,
                          (int)r.points);
    if (r.points == IMP_POINTS_WHOLE && (r.time_limit_s > 0 || r.walks))
        return imp__error(ctx, IMP_E_ARG,
                          "%s: run->points: whole pixels want a number of samples, and "
                          "walks that are traced: not with %s",
                          function, r.walks ? "recorded walks" : "a time limit");
    if (r.walks) IMP_CHECKED(imp__walks_run(ctx, function, &r));
    *own = r;
    return IMP_OK;
}

enum imp_status imp__run_take(imp_context *ctx, const char *function,
                              const struct imp_run *run, struct imp_run *own)
{
    IMP_CHECKED(imp__run_take_picture(ctx, function, run, own));
    if (own->points != IMP_POINTS_WHOLE) return IMP_OK;
    return imp__error(
        ctx, IMP_E_ARG,
        "%s: run->points: whole pixels have no standard errors: they are for "
        "pictures alone",
        function);
}

enum imp_status imp__run_traces(imp_context *ctx, const char *function,
                                const struct imp_run *run)
{
    if (!run->walks) return IMP_OK;
    return imp__error(
        ctx, IMP_E_ARG,
        "%s: run->walks: this traces walks of its own, and evaluates no kept "
        "ones",
        function);
}
