/* SPDX-License-Identifier: Apache-2.0
 *
 * The switches that show the errata (docs/estimators.md 2.3, T7): which of them is
 * refused where, what is warned about, and that the attached exponent, where it is
 * allowed, is the derivative (it lacks the gradient of what arrives and all boundary
 * terms: docs/estimators.md 4). */
#include "imp_scene.h"
#include "imp_tap.h"

static char last_warning[512];

static void keep_warning(enum imp_log_level level, const char *message, void *payload)
{
    (void)level, (void)payload;
    snprintf(last_warning, sizeof last_warning, "%s", message);
}

/* A ball of M2 under a white sky. */
static imp_scene *ball(imp_context *ctx, const char *variant, const char *sampling,
                       const char *alpha)
{
    char xml[2048];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='stam'>"
        "<string name='alpha_gradient' value='%s'/></integrator>"
        "<sensor type='perspective'><float name='fov' value='30'/>"
        "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='16'/>"
        "<integer name='height' value='16'/><rfilter type='box'/></film></sensor>"
        "<emitter type='constant'><float name='radiance' value='1'/></emitter>"
        "<shape type='sphere'><bsdf type='stam_m2' id='ball'>"
        "<string name='variant' value='%s'/><string name='sampling' value='%s'/>"
        "<float name='diffuse' value='.2'/><float name='specular' value='.7'/>"
        "<float name='exponent' value='5'/><float name='absorb' value='.3'/>"
        "</bsdf></shape></scene>",
        alpha, variant, sampling);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* d (mean of the picture)/d exponent. */
static enum imp_status slope(imp_context *ctx, imp_scene *scene, int spp, double *g,
                             double *se)
{
    imp_problem *p = test_problem(ctx, scene, "*.exponent.value");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_sensor_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_get_sensor(scene, 0, &info));
    const int pixels = info.width * info.height;
    float *ones = malloc((size_t)pixels * sizeof *ones);
    for (int k = 0; k < pixels; k++) ones[k] = 1.f / (float)pixels;
    run.spp = spp;
    run.seed = 3;
    const enum imp_status st = imp_problem_reverse(p, ones, &run, g, se);
    free(ones);
    imp_problem_destroy(p);
    return st;
}

static void attached(imp_context *ctx)
{
    static const char *const variants[] = {"reciprocal", "microfacet", "paper"};
    static const char *const samplings[] = {"mixture", "phong", "cosine"};
    for (int v = 0; v < 3; v++) {
        double d, d_se, a, a_se;
        imp_scene *s = ball(ctx, variants[v], "mixture", "detached");
        test_must(ctx, slope(ctx, s, 2000, &d, &d_se));
        imp_scene_destroy(s);
        for (int q = 0; q < 3; q++) {
            const int allowed = v == 0 || q == 2;
            s = ball(ctx, variants[v], samplings[q], "attached");
            const enum imp_status st = slope(ctx, s, 2000, &a, &a_se);
            if (!allowed)
                tap_ok(st == IMP_E_BIAS, "attached, %s, %s: refused # %s", variants[v],
                       samplings[q], imp_last_error(ctx));
            else
                tap_ok(st == IMP_OK && fabs(a - d) <= 4 * hypot(a_se, d_se) &&
                           a_se < .1 * fabs(d),
                       "attached, %s, %s: is the derivative # %.6f +- %.6f, detached "
                       "%.6f +- %.6f",
                       variants[v], samplings[q], a, a_se, d, d_se);
            imp_scene_destroy(s);
        }
    }
    double g, se;
    imp_scene *box = test_scene(ctx, "stam.xml", IMP_MONO,
                                "variant=reciprocal alpha_gradient=attached");
    tap_ok(slope(ctx, box, 2, &g, &se) == IMP_E_BIAS, "attached in the box: refused # %s",
           imp_last_error(ctx));
    imp_scene_destroy(box);
}

/* The horizon's part is what the refusal is about: the paper's term, which has neither it
 * nor the gradient of what arrives, is wrong even under a constant sky. */
static void horizon(imp_context *ctx)
{
    for (int v = 0; v < 2; v++) {
        const char *const variant = v ? "paper" : "microfacet";
        double d, d_se, a, a_se;
        imp_scene *s = ball(ctx, variant, "mixture", "detached");
        test_must(ctx, slope(ctx, s, 2000, &d, &d_se));
        imp_scene_destroy(s);
        s = ball(ctx, variant, "mixture", "paper");
        test_must(ctx, slope(ctx, s, 2000, &a, &a_se));
        imp_scene_destroy(s);
        tap_ok(fabs(a - d) > 20 * hypot(a_se, d_se),
               "first attached term alone, %s, under a constant sky: wrong # %.5f, truth "
               "%.5f",
               variant, a, d);
    }
}

static void words(imp_context *ctx)
{
    static const char *const bad[] = {"variant=phong", "sampling=uniform",
                                      "alpha_gradient=exact"};
    for (int k = 0; k < 3; k++) {
        struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
        char path[1024];
        imp_scene *scene = NULL;
        snprintf(path, sizeof path, "%s/stam.xml", IMP_SCENES);
        o.mode = IMP_MONO;
        o.defines = &bad[k];
        o.n_defines = 1;
        const enum imp_status st = imp_scene_load(ctx, path, &o, &scene);
        tap_ok(st == IMP_E_SCENE && scene == NULL, "%s: refused # %s", bad[k],
               strrchr(imp_last_error(ctx), '/'));
    }
    last_warning[0] = 0;
    imp_scene_destroy(test_scene(ctx, "stam.xml", IMP_MONO, "alpha_gradient=detached"));
    tap_ok(last_warning[0] == 0, "detached: nothing to warn about");
    imp_scene_destroy(test_scene(ctx, "stam.xml", IMP_MONO, "alpha_gradient=paper"));
    tap_ok(strstr(last_warning, "wrong") != NULL, "the paper's: announced # %s",
           last_warning);
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    o.log = keep_warning;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 1;
    attached(ctx);
    horizon(ctx);
    words(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
