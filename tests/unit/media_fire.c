/* SPDX-License-Identifier: Apache-2.0
 *
 * Media that emit: slabs in closed form and by quadrature, uniform and in volumes, with
 * derivatives; what absorbs emits as much under light of its own radiance (Kirchhoff). */
#include "imp_check_rows.h"
#include "media_kit.h"
#include "vol_write.h"

static imp_context *ctx;

#define SCENE(...)                                                                       \
    "<scene version='3.0.0'><integrator type='volpath'/>" __VA_ARGS__                    \
    "<shape type='cube'><bsdf type='null'/><ref id='fire' name='interior'/>"             \
    "<transform name='to_world'><scale value='0.5'/><translate x='0.5' y='0.5' "         \
    "z='0.5'/></transform></shape><sensor type='orthographic'><transform "               \
    "name='to_world'><scale value='0.01'/><lookat origin='0.5,0.5,-1' "                  \
    "target='0.5,0.5,1' up='0,1,0'/></transform><film type='hdrfilm'><integer "          \
    "name='width' value='4'/><integer name='height' value='4'/><rfilter type='box'/>"    \
    "</film></sensor></scene>"

static void checked(imp_problem *p, const char *what)
{
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    o.paths = 100;
    o.fresh_spp = 2048;
    test_check(ctx, p, &o, what);
}

/* Le (1 - exp(-sigma)) */
static void slab(void)
{
    static const double Le[3] = {2, .5, .1};
    const double T = exp(-1.5);
    double mean[3], se[3], g[3], g_se[3];
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    imp_scene *s = test_scene_text(
        ctx,
        SCENE("<medium type='homogeneous' id='fire'><float name='sigma_t' value='1.5'/>"
              "<float name='albedo' value='0'/><rgb name='emission' value='2,0.5,0.1'/>"
              "</medium>"),
        IMP_RGB);
    media_mean(ctx, s, 4096, mean, se);
    for (int c = 0; c < 3; c++)
        media_near(mean[c], se[c], Le[c] * (1 - T), .005 * Le[c], "a slab that glows");
    run.spp = 4096;
    imp_problem *p = test_problem(ctx, s, "fire.emission.value");
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
    for (int c = 0; c < 3; c++)
        media_near(g[c], g_se[c], (1 - T) / 3, 2e-3, "... by its emission");
    checked(p, "emission");
    imp_problem_destroy(p);
    p = test_problem(ctx, s, "fire.sigma_t.value");
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
    media_near(g[0], g_se[0], T * (2 + .5 + .1) / 3, 5e-3, "... by its extinction");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Extinction 3 z and emission 1 - z/2 along the ray, each of 32 numbers. */
enum { N = 32 };
static double between(const float *value, double z)
{
    const double x = z * N - .5;
    const int i = (int)fmin(fmax(floor(x), 0), N - 2);
    const double w = fmin(fmax(x - i, 0), 1);
    return (1 - w) * (double)value[i] + w * (double)value[i + 1];
}
static double quadrature(const float *sigma, const float *Le, double scale)
{
    enum { STEPS = 20000 };
    double sum = 0, depth = 0;
    for (int i = 0; i < STEPS; i++) { /* with half of each step before its light */
        const double z = (i + .5) / STEPS, k = scale * between(sigma, z) / STEPS;
        sum += between(Le, z) * k * exp(-depth - k / 2);
        depth += k;
    }
    return sum;
}
static void volumes(void)
{
    float sigma[N], Le[N];
    char path[2][64], text[2048];
    double mean[3], se[3], g[N], g_se[N], sum, sum_se;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    for (int i = 0; i < N; i++) {
        sigma[i] = (float)(3 * (i + .5) / N);
        Le[i] = (float)(1 - .5 * (i + .5) / N);
    }
    vol_write(path[0], 1, 1, N, 1, sigma);
    vol_write(path[1], 1, 1, N, 1, Le);
    snprintf(text, sizeof text,
             SCENE("<medium type='heterogeneous' id='fire'><float name='albedo' "
                   "value='0'/><volume name='sigma_t' type='gridvolume' id='density'>"
                   "<string name='filename' value='%s'/></volume><volume "
                   "name='emission' type='gridvolume' id='glow'><string name='filename' "
                   "value='%s'/></volume></medium>"),
             path[0], path[1]);
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    const double L = quadrature(sigma, Le, 1);
    media_mean(ctx, s, 8192, mean, se);
    media_near(mean[0], se[0], L, 3e-3, "a fire of two volumes");
    run.spp = 8192;
    for (int k = 0; k < 2; k++) {
        imp_problem *p = test_problem(ctx, s, k ? "density.data" : "glow.data");
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
        sum = sum_se = 0;
        for (int i = 0; i < N; i++) {
            sum += g[i] * (double)(k ? sigma : Le)[i];
            sum_se += pow(g_se[i] * (double)(k ? sigma : Le)[i], 2);
        }
        const double h = 1e-3,
                     d = (quadrature(sigma, Le, 1 + h) - quadrature(sigma, Le, 1 - h)) /
                         (2 * h);
        media_near(sum, 2 * sqrt(sum_se), k ? d : L, 2e-2,
                   k ? "scaled in density" : "scaled in emission");
        imp_problem_destroy(p);
    }
    for (int k = 0; k < 2; k++) remove(path[k]);
    imp_scene_destroy(s);
}

/* Under a sky of its own radiance nothing is darker or brighter, whatever is scattered. */
static void furnace(void)
{
    double mean[3], se[3];
    imp_scene *s = test_scene_text(
        ctx,
        SCENE("<medium type='homogeneous' id='fire'><float name='sigma_t' value='3'/>"
              "<rgb name='albedo' value='0.9,0.5,0.2'/><rgb name='emission' "
              "value='1,1,1'/><phase type='hg'><float name='g' value='0.4'/></phase>"
              "</medium><emitter type='constant'><float name='radiance' value='1'/>"
              "</emitter>"),
        IMP_RGB);
    media_mean(ctx, s, 2048, mean, se);
    for (int c = 0; c < 3; c++)
        media_near(mean[c], se[c] + 1e-6, 1, .01, "a fire as bright as the sky");
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    slab();
    volumes();
    furnace();
    imp_context_destroy(ctx);
    return tap_done();
}
