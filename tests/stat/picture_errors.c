/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard errors of pixels against the spread of pictures with other seeds, beside a
 * lamp whose edge runs through the picture: there a pixel's samples differ by where they
 * fall, and only what is drawn at random is noise. A pixel of a wide filter is a ratio of
 * sums over samples of several pixels, and each sends the same number. */
#include "imp_scene.h"
#include "imp_tap.h"

enum { RES = 12, SEEDS = 200 };

static imp_context *ctx;

static imp_scene *scene_of(const char *filter)
{
    char xml[2048];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
        "<float name='fov' value='40'/><transform name='to_world'><lookat "
        "origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='%d'/><integer "
        "name='height' value='%d'/>%s</film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"
        "<translate z='-1'/></transform><bsdf type='diffuse' id='wall'><float "
        "name='reflectance' value='.5'/></bsdf></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"
        "<rotate z='1' angle='20'/></transform><emitter type='area' id='lamp'><float "
        "name='radiance' value='8'/></emitter></shape>"
        "<emitter type='constant' id='sky'><float name='radiance' "
        "value='.2'/></emitter></scene>",
        RES, RES, filter);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* Sum over pixels of the variance, as seen over the seeds and as stated. */
static void errors(const char *filter, int spp)
{
    imp_scene *scene = scene_of(filter);
    static struct tap_stat pixel[RES * RES];
    double stated = 0, seen = 0, worst = 1;
    memset(pixel, 0, sizeof pixel);
    static double stated_of[RES * RES];
    memset(stated_of, 0, sizeof stated_of);
    for (int k = 0; k < SEEDS; k++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film;
        run.spp = spp;
        run.seed = 1000 + (uint64_t)k;
        test_must(ctx, imp_render(scene, &run, &film));
        for (int p = 0; p < RES * RES; p++) {
            tap_add(&pixel[p], imp_film_mean(film)[p]);
            stated_of[p] += pow(imp_film_se(film)[p], 2) / SEEDS;
        }
        imp_film_destroy(film);
    }
    for (int p = 0; p < RES * RES; p++) {
        const double var = pixel[p].m2 / (pixel[p].n - 1);
        stated += stated_of[p];
        seen += var;
        if (var > 1e-4) worst = fmax(worst, fmax(stated_of[p] / var, var / stated_of[p]));
    }
    /* A variance from 200 pictures is known to 10 %, and pixels share samples. */
    tap_ok(fabs(stated / seen - 1) < 0.06, "%s, %d spp: variance # stated/seen %.3f",
           filter, spp, stated / seen);
    tap_ok(worst < 1.5, "%s, %d spp: of every pixel # worst ratio %.2f", filter, spp,
           worst);
    imp_scene_destroy(scene);
}

/* At the truth, against a picture without noise, a quadratic loss without its variance is
 * zero on the average: as many values above as below. */
static void loss_at_truth(const char *filter, int spp)
{
    imp_scene *scene = scene_of(filter);
    imp_problem *p = test_problem(ctx, scene, "lamp.*");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    struct tap_stat J = {0};
    double se = 0;
    imp_film *film;
    run.spp = 1 << 13;
    run.seed = 7;
    test_must(ctx, imp_render(scene, &run, &film));
    target.width = target.height = RES;
    target.channels = 1;
    target.pixels = imp_film_mean(film);
    test_must(ctx, imp_problem_add_target(p, &target));
    for (int p_ = 0; p_ < RES * RES; p_++) se += pow(imp_film_se(film)[p_], 2) / 2;
    for (int k = 0; k < SEEDS; k++) {
        struct imp_estimate value;
        run.spp = spp;
        run.seed = 5000 + (uint64_t)k;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &value, NULL, NULL));
        tap_add(&J, value.value);
    }
    const double noise = hypot(tap_se(&J), se);
    tap_ok(fabs(J.mean) < 4 * noise, "%s, %d spp: loss at the truth # %.3g +- %.2g",
           filter, spp, J.mean, noise);
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

int main(void)
{
    static const char *const filters[] = {
        "<rfilter type='box'/>", "<rfilter type='gaussian'/>", "<rfilter type='tent'/>",
        "<rfilter type='mitchell'/>", "<rfilter type='lanczos'/>"};
    ctx = test_context(0);
    for (size_t k = 0; k < sizeof filters / sizeof *filters; k++) {
        errors(filters[k], 8);
        loss_at_truth(filters[k], 16);
    }
    errors(filters[1], 67); /* two passes */
    imp_context_destroy(ctx);
    return tap_done();
}
