/* SPDX-License-Identifier: Apache-2.0
 *
 * Two pictures of one scene with different seeds as one: means and errors by hand, the
 * truth within the errors, and what does not go together. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <string.h>

/* A diffuse ball under a sky of 2: reflectance .5 sends back 1. The square of the film is
 * filled by the ball. */
static const char *const ball =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='2'/>"
    "</integrator><sensor type='perspective'><float name='fov' value='20'/>"
    "<film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"
    "<shape type='sphere'><point name='center' x='0' y='0' z='4'/>"
    "<float name='radius' value='2'/>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='.5'/></bsdf></shape>"
    "<emitter type='constant'><float name='radiance' value='2'/></emitter></scene>";

static imp_film *render(imp_context *ctx, imp_scene *s, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_render(s, &run, &film));
    return film;
}

int main(void)
{
    enum { N = 8 * 8 * 3 };
    imp_context *ctx = test_context(2);
    imp_scene *s = test_scene_text(ctx, ball, IMP_RGB);
    imp_film *a = render(ctx, s, 64, 1), *b = render(ctx, s, 192, 2), *one = NULL,
             *small = NULL;
    struct imp_film_info info = {.size = sizeof info};
    float mean[N], se[N];
    memcpy(mean, imp_film_mean(a), sizeof mean);
    memcpy(se, imp_film_se(a), sizeof se);
    test_must(ctx, imp_film_merge(a, b));
    test_must(ctx, imp_film_get_info(a, &info));
    double worst = 0, worst_se = 0, sum = 0, variance = 0;
    for (int i = 0; i < N; i++) {
        const double m = 0.25 * mean[i] + 0.75 * imp_film_mean(b)[i];
        const double e = hypot(0.25 * se[i], 0.75 * imp_film_se(b)[i]);
        worst = fmax(worst, fabs(imp_film_mean(a)[i] - m));
        worst_se = fmax(worst_se, fabs(imp_film_se(a)[i] - e));
        if (i % 3) continue; /* all channels have the same walks */
        sum += imp_film_mean(a)[i] / 64;
        variance += imp_film_se(a)[i] * imp_film_se(a)[i] / 64 / 64;
    }
    tap_ok(info.spp == 256 && worst < 1e-6 && worst_se < 1e-7,
           "a quarter of one, three quarters of the other # %.1e, errors %.1e", worst,
           worst_se);
    tap_ok(fabs(sum - 1) <= 4.5 * sqrt(variance) + 1e-6 && sqrt(variance) < 0.01,
           "and the truth # %.5f +- %.5f", sum, sqrt(variance));

    /* Errors that one of them does not have are nobody's. */
    test_must(ctx, imp_film_create(ctx, 8, 8, "R,G,B", &one));
    tap_ok(imp_film_merge(a, one) == IMP_E_ARG && imp_film_merge(one, a) == IMP_E_ARG,
           "without samples # %s", imp_last_error(ctx));
    test_must(ctx, imp_film_create(ctx, 8, 7, "R,G,B", &small));
    tap_ok(imp_film_merge(a, small) == IMP_E_ARG, "another size # %s",
           imp_last_error(ctx));
    imp_film_destroy(small);
    test_must(ctx, imp_film_create(ctx, 8, 8, "R,G,Z", &small));
    tap_ok(imp_film_merge(a, small) == IMP_E_ARG, "other channels # %s",
           imp_last_error(ctx));
    imp_film_destroy(small);
    imp_film_destroy(one);
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
