/* SPDX-License-Identifier: Apache-2.0
 *
 * A sky: a shell of air that scatters, traced, and a sun. The plane-parallel limit, by adding
 * and doubling, with derivatives; the sun's disc through air; single scattering by quadrature and all orders on a grid (shell_orders.h), for the sun
 * at 60, 15 and 2 degrees; colours of the zenith; nothing without scattering. */
#include "adding_doubling.h"
#include "imp_check_rows.h"
#include "media_kit.h"
#include "scene/scene.h"
#include "shell_orders.h"

static imp_context *ctx;

/* ---- A shell ---------------------------------------------------------------------------- */

struct setting {
    struct shell of;
    const char *light, *integrator;
    double camera; /* height */
    int n_rays;
    double ray[8][3]; /* directions, from the camera */
    double to;        /* 1: from the camera at `camera`; -1: from there downwards */
};

/* A black ball in air, whose sea-level extinction is sigma [3]; a radiancemeter for each
 * ray, at the height `camera` over the origin. */
static imp_scene *shell_scene(const struct setting *x, const double sigma[3],
                              enum imp_color_mode mode)
{
    static char text[16384];
    const bool outside = x->camera > x->of.top;
    int n = snprintf(
        text, sizeof text,
        "<scene version='3.0.0'>%s%s<medium type='heterogeneous' id='air'><volume "
        "type='expvolume' name='sigma_t' id='density'><rgb name='value' "
        "value='%.17g,%.17g,%.17g'/><float name='scale_height' value='%.17g'/><point "
        "name='center' x='0' y='%.17g' z='0'/><float name='radius' value='%.17g'/><float "
        "name='top' value='%.17g'/></volume><float name='albedo' value='1'/><phase "
        "type='rayleigh'/></medium><shape type='sphere'><point name='center' x='0' "
        "y='%.17g' z='0'/><float name='radius' value='%.17g'/><bsdf type='null'/><ref "
        "id='air' name='interior'/></shape><shape type='sphere'><point name='center' "
        "x='0' y='%.17g' z='0'/><float name='radius' value='%.17g'/><bsdf "
        "type='diffuse'><float name='reflectance' value='0'/></bsdf><ref id='air' "
        "name='exterior'/></shape>",
        x->integrator, x->light, sigma[0], sigma[1], sigma[2], x->of.H, -x->of.R, x->of.R,
        x->of.top, -x->of.R, x->of.R + x->of.top, -x->of.R, x->of.R);
    for (int k = 0; k < x->n_rays; k++)
        n += snprintf(text + n, sizeof text - (size_t)n,
                      "<sensor type='radiancemeter'><point name='origin' x='0' y='%.17g' "
                      "z='0'/><vector name='direction' x='%.17g' y='%.17g' z='%.17g'/>"
                      "<film type='hdrfilm'><integer name='width' value='1'/><integer "
                      "name='height' value='1'/></film>%s</sensor>",
                      x->camera, x->ray[k][0], x->ray[k][1], x->ray[k][2],
                      outside ? "" : "<ref id='air'/>");
    snprintf(text + n, sizeof text - (size_t)n, "</scene>");
    return test_scene_text(ctx, text, mode);
}

#define VOLPATH "<integrator type='volpath'/>"

/* Air of optical depth .1 over a ball without end, under a white sky: what it reflects and
 * transmits, and d/d tau of both, by the extinction and by the scale height. */
static void plane(int spp)
{
    static const double mu[2] = {1, .5};
    static struct ad_slab ad, more, less;
    const double tau = .1, h = 1e-3, H = 8, top = 100, full = 1 - exp(-top / H);
    ad_make(&ad, tau, 1, ad_rayleigh, 0, 2, mu);
    ad_make(&more, tau + h, 1, ad_rayleigh, 0, 2, mu);
    ad_make(&less, tau - h, 1, ad_rayleigh, 0, 2, mu);
    tap_near(ad_row(&ad, ad.R, AD_GAUSS), .04768, 0, 5e-6, "the truth's reflectance");
    tap_near(ad_row(&ad, ad.T, AD_GAUSS), .95232, 0, 5e-6, "the truth's transmittance");
    for (int k = 0; k < 4; k++) {
        const bool up = k % 2;
        const int node = AD_GAUSS + k / 2;
        const double m = mu[k / 2], side = sqrt(1 - m * m);
        const struct setting x = {.of = {1e6, H, top, 0},
                                  .light = "<emitter type='constant'/>",
                                  .integrator = VOLPATH,
                                  .camera = up ? 1e-3 : top + 1,
                                  .n_rays = 1,
                                  .ray = {{side, up ? m : -m, 0}}};
        const double sigma = tau / H / full;
        imp_scene *s = shell_scene(&x, (double[3]){sigma, sigma, sigma}, IMP_MONO);
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate v;
        double g[8], g_se[8];
        run.spp = spp;
        run.seed = 7;
        imp_problem *p = test_problem(ctx, s, "density.value.value");
        test_must(ctx, imp_problem_activate(p, "density.scale_height.value"));
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
        const double truth = ad_row(&ad, up ? ad.T : ad.R, node),
                     slope = (ad_row(&more, up ? more.T : more.R, node) -
                              ad_row(&less, up ? less.T : less.R, node)) /
                             (2 * h);
        const size_t value = test_variable(p, s, ctx, "density.value.value"),
                     height = test_variable(p, s, ctx, "density.scale_height.value");
        const char *names[4] = {"reflected, straight", "transmitted, straight",
                                "reflected at mu .5", "transmitted at mu .5"};
        /* tau = sigma H (1 - exp(-top/H)) */
        const double by_height = slope * sigma * (full - top / H * exp(-top / H));
        char what[96];
        media_near(v.value, v.se, truth, .03 * truth, names[k]);
        snprintf(what, sizeof what, "%s, by the extinction", names[k]);
        media_near(g[value], g_se[value], slope * H * full, .06 * fabs(slope * H), what);
        snprintf(what, sizeof what, "%s, by the scale height", names[k]);
        media_near(g[height], g_se[height], by_height, .06 * fabs(by_height), what);
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
}

static const double elevations[3] = {60, 15, 2};

static const char *sun_at(double elevation)
{
    static char text[256];
    const double e = elevation * M_PI / 180, a = .004675;
    snprintf(text, sizeof text,
             "<emitter type='sun'><vector name='direction' x='%.17g' y='%.17g' z='0'/>"
             "<rgb name='radiance' value='%.17g,%.17g,%.17g'/></emitter>",
             -cos(e), -sin(e), 1 / (M_PI * a * a), 1 / (M_PI * a * a),
             1 / (M_PI * a * a));
    return text;
}

/* The disc at 450, 550 and 650 nm: exp(-m tau), with m the air mass of the shell. */
static void disc(int spp)
{
    static const double tau[3] = {.22129, .09728, .04932};
    struct setting x = {.of = {6360, 8, 80, 1. / 8},
                        .integrator = "<integrator type='volpath'><integer "
                                      "name='max_depth' value='1'/></integrator>",
                        .camera = .01,
                        .n_rays = 1};
    const double a = .004675, sigma[3] = {tau[0] / 8, tau[1] / 8, tau[2] / 8};
    for (int k = 0; k < 3; k++) {
        const double e = elevations[k] * M_PI / 180;
        /* From the place of the meter, the sun along y. */
        const double r = x.of.R + x.camera;
        const struct shell_v3 o = {r * cos(e), r * sin(e), 0}, s = {0, 1, 0};
        int ground;
        enum { N = 20000 };
        double mass = 0, dt, mean[3], se[3];
        const double reach = shell_reach(&x.of, o, s, &ground);
        for (int i = 0; i < N; i++) {
            const double t = shell_step(reach, i, N, &dt);
            mass += dt / x.of.H * exp(-shell_height(&x.of, shell_on(o, s, t)) / x.of.H);
        }
        x.light = sun_at(elevations[k]);
        x.ray[0][0] = cos(e);
        x.ray[0][1] = sin(e);
        imp_scene *scene = shell_scene(&x, sigma, IMP_RGB);
        struct imp_run run = IMP_RUN_INIT;
        run.spp = k == 2 ? 4 * spp : spp;
        media_mean_run(ctx, scene, &run, mean, se, IMP_DROP_NONE);
        const double full = M_PI * a * a;
        for (int c = 0; c < 3; c++)
            media_near(mean[c] * full, se[c] * full, exp(-mass * tau[c]),
                       .03 * exp(-mass * tau[c]), "the sun's disc through air");
        const double ratio = mean[0] / mean[2],
                     ratio_se = ratio * hypot(se[0] / mean[0], se[2] / mean[2]),
                     truth = exp(-mass * (tau[0] - tau[2]));
        printf("# %g degrees: air mass %.3f\n", elevations[k], mass);
        media_near(ratio, ratio_se, truth, (k == 2 ? .025 : .01) * truth,
                   "450 nm over 650 nm");
        imp_scene_destroy(scene);
    }
}

/* Radiance of the dome in the sun's plane and across it. */
static void dome(int spp, bool fine)
{
    static const double up[8] = {4, 20, 45, 80, 110, 150, 30, 60};
    static struct shell_light truth;
    const double sigma = .22129 / 8;
    truth.of = (struct shell){6360, 8, 80, sigma};
    shell_solve(&truth, fine ? 6 : 4);
    for (int k = 0; k < 3; k++)
        for (int once = 0; once < 2; once++) {
            struct setting x = {.of = truth.of,
                                .light = sun_at(elevations[k]),
                                .integrator = once
                                                  ? "<integrator type='volpath'><integer "
                                                    "name='max_depth' value='2'/>"
                                                    "<boolean name='hide_emitters' "
                                                    "value='true'/></integrator>"
                                                  : VOLPATH,
                                .camera = .1,
                                .n_rays = 8};
            const double e = elevations[k] * M_PI / 180, r = x.of.R + x.camera;
            double square = 0, noise = 0, worst = 0, ref[8];
            for (int j = 0; j < 8; j++) {
                const double b = up[j] * M_PI / 180;
                const double side = j < 6 ? 0 : cos(b);
                x.ray[j][0] = j < 6 ? cos(b) : 0;
                x.ray[j][1] = sin(b);
                x.ray[j][2] = side;
                /* x' = (cos e, sin e) r in the truth's plane: up, and towards the sun */
                const struct shell_v3 o = {r * cos(e), r * sin(e), 0};
                const double upward = sin(b), sun = x.ray[j][0];
                const struct shell_v3 d = {upward * cos(e) - sun * sin(e),
                                           upward * sin(e) + sun * cos(e), side};
                ref[j] = shell_radiance(&truth.of, NULL, o, d, 2000);
                if (!once) ref[j] += shell_radiance(&truth.of, truth.sum, o, d, 2000);
            }
            imp_scene *s = shell_scene(&x, (double[3]){sigma, sigma, sigma}, IMP_MONO);
            for (int j = 0; j < 8; j++) {
                struct imp_run run = IMP_RUN_INIT;
                double mean[3], se[3];
                run.spp = spp;
                run.sensor = j;
                run.seed = 3 + (uint64_t)j;
                media_mean_run(ctx, s, &run, mean, se, IMP_DROP_NONE);
                square += pow(mean[0] / ref[j] - 1, 2) / 8;
                noise += pow(se[0] / ref[j], 2) / 8;
                worst = fmax(worst, fabs(mean[0] - ref[j]) / se[0]);
                printf("# sun at %g, %g degrees up%s: %.5f se %.5f, truth %.5f\n",
                       elevations[k], up[j], once ? ", single" : "", mean[0], se[0],
                       ref[j]);
            }
            if (once) {
                tap_ok(worst <= 4,
                       "sun at %g degrees: light scattered once # worst z %.2f",
                       elevations[k], worst);
            } else {
                const double off = sqrt(fmax(square - noise, 0));
                tap_ok(off < .05 && sqrt(square) < .06,
                       "sun at %g degrees: all light, rms over the dome # %.2f %% with "
                       "noise of %.2f %%",
                       elevations[k], 100 * sqrt(square), 100 * sqrt(noise));
            }
            imp_scene_destroy(s);
        }
}

/* Linear sRGB to chromaticity. */
static void chromaticity(const double rgb[3], double xy[2])
{
    const double X = .4124 * rgb[0] + .3576 * rgb[1] + .1805 * rgb[2],
                 Y = .2126 * rgb[0] + .7152 * rgb[1] + .0722 * rgb[2],
                 Z = .0193 * rgb[0] + .1192 * rgb[1] + .9505 * rgb[2];
    xy[0] = X / (X + Y + Z);
    xy[1] = Y / (X + Y + Z);
}
static void zenith(int spp)
{
    for (int k = 0; k < 2; k++) {
        char defines[160];
        double mean[3], se[3], xy[2];
        struct imp_run run = IMP_RUN_INIT;
        snprintf(defines, sizeof defines, "elevation=%g width=8 height=8 tilt=90 fov=20",
                 elevations[k]);
        imp_scene *s = test_scene(ctx, "sky.xml", IMP_SPECTRAL, defines);
        run.spp = spp;
        media_mean_run(ctx, s, &run, mean, se, IMP_DROP_NONE);
        chromaticity(mean, xy);
        /* 4 standard errors of the ratios to either side. */
        const double slack = 4 * hypot(se[0] / mean[0], se[2] / mean[2]);
        tap_ok(xy[0] + slack * .1 < .3127 && xy[1] + slack * .1 < .3290,
               "sun at %g degrees: the zenith is bluer than daylight # x %.4f y %.4f",
               elevations[k], xy[0], xy[1]);
        imp_scene_destroy(s);
    }
    double mean[3], se[3];
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 8;
    imp_scene *s = test_scene(ctx, "sky.xml", IMP_SPECTRAL,
                              "width=8 height=8 tilt=90 fov=20 albedo=0");
    media_mean_run(ctx, s, &run, mean, se, IMP_DROP_NONE);
    tap_ok(mean[0] == 0 && mean[1] == 0 && mean[2] == 0,
           "without scattering the sky is black");
    imp_scene_destroy(s);
}

/* Small, so that all of it is seen: frozen and fresh differences, forward and reverse. */
static void checked(void)
{
    const struct setting x = {.of = {3, .5, 2, 0},
                              .light = sun_at(40),
                              .integrator = VOLPATH,
                              .camera = .2,
                              .n_rays = 1,
                              .ray = {{-.4, .9, .2}}};
    imp_scene *s = shell_scene(&x, (double[3]){.5, 1, 2}, IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    o.paths = 400;
    o.fresh_spp = 16384;
    test_check(ctx, p, &o, "all numbers");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool fine = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(0);
    plane(fine ? 1 << 20 : 1 << 15);
    disc(fine ? 1 << 19 : 1 << 15);
    dome(fine ? 1 << 18 : 1 << 12, fine);
    zenith(fine ? 4096 : 256);
    checked();
    imp_context_destroy(ctx);
    return tap_done();
}
