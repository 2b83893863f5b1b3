/* SPDX-License-Identifier: Apache-2.0
 *
 * How much each wavelength of a spectrum matters. Inside a glowing sphere of reflectance
 * rho and radiance e,  L = e/(1 - rho)  at every wavelength, so a channel with response r
 * and its derivatives by samples with hat functions h_k are
 *
 *     R = int r e/(1 - rho),   dR/drho_k = int r e h_k/(1 - rho)^2,
 *     dR/de_k = int r h_k/(1 - rho),
 *
 * and Euler's identities are  sum_k e_k dR/de_k = R  and  sum_k rho_k dR/drho_k = the mean
 * number of bounces, weighted by what walks bring. All from one set of walks, with errors.
 *
 * Losses over films with 1, 2 and 5 response curves and their gradients, by the same
 * formulas; a fit through 8 curves, whose 8 samples come back. */
#include "color/wavelength.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include <math.h>

#define N 8 /* samples, 360 to 830 nm */

static const double rho[N] = {.2, .5, .6, .3, .1, .55, .4, .2};
static const double e[N] = {1, 2, 1.5, 3, 2.5, 1, .5, .2};

static double node(int k) { return 360 + 470. * k / (N - 1); }
static double hat(int k, double nm)
{
    return fmax(0, 1 - fabs(nm - node(k)) / (470. / (N - 1)));
}
static double at(const double *v, double nm)
{
    double sum = 0;
    for (int k = 0; k < N; k++) sum += v[k] * hat(k, nm);
    return sum;
}

static void list(const double *v, char *text, size_t size)
{
    for (int k = 0, used = 0; k < N; k++)
        used += snprintf(text + used, size - (size_t)used, "%s%.17g:%g", k ? "," : "",
                         node(k), v[k]);
}

static imp_scene *scene_make(imp_context *ctx, enum imp_color_mode mode, const char *film)
{
    char text[8192], r[512], l[512];
    list(rho, r, sizeof r);
    list(e, l, sizeof l);
    snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='path'><integer name='rr_depth' "
        "value='20'/></integrator><sensor type='perspective'><float name='fov' "
        "value='60'/>%s</sensor><shape type='sphere'><boolean name='flip_normals' "
        "value='true'/><bsdf type='diffuse' id='wall'><spectrum name='reflectance' "
        "value='%s'/></bsdf><emitter type='area' id='glow'><spectrum name='radiance' "
        "value='%s'/></emitter></shape></scene>",
        film, r, l);
    return test_scene_text(ctx, text, mode);
}

/* A factor of all channels: `srf` of the sensor. */
static const double srf[N] = {0, .2, 1, .5, .8, 1, .3, 0};

/* Response c without the scene's own product. */
static double response(const imp_scene *s, int c, bool factor, double nm)
{
    struct imp_spectrum r = s->wavelengths[0].response[c];
    if (factor) r.times = NULL;
    return imp__spectrum_value(&r, nm) * (factor ? at(srf, nm) : 1);
}

/* Pictures however their wavelengths are drawn. */
static void pictures(imp_context *ctx, const imp_scene *s, enum imp_color_mode mode)
{
    static const enum imp_wavelength_sampling how[] = {IMP_WAVELENGTHS_STRATIFIED,
                                                       IMP_WAVELENGTHS_INDEPENDENT,
                                                       IMP_WAVELENGTHS_IMPORTANCE};
    double want[3] = {0};
    for (double nm = 360.05; nm < 830; nm += 0.1)
        for (int c = 0; c < 3; c++)
            want[c] += 0.1 * response(s, c, true, nm) * at(e, nm) / (1 - at(rho, nm));
    for (int k = 0; k < 3; k++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film;
        double mean[3] = {0}, var[3] = {0}, z = 0, relative = 0;
        run.spp = 256;
        run.seed = 11;
        run.wavelengths = how[k];
        test_must(ctx, imp_render(s, &run, &film));
        for (int i = 0; i < 64 * 3; i++) {
            mean[i % 3] += (double)imp_film_mean(film)[i] / 64;
            var[i % 3] += imp__sqr((double)imp_film_se(film)[i] / 64);
        }
        imp_film_destroy(film);
        for (int c = 0; c < 3; c++) {
            z = fmax(z, fabs(mean[c] - want[c]) / sqrt(var[c]));
            relative = fmax(relative, sqrt(var[c]) / fabs(want[c]));
        }
        tap_ok(z < 4 && relative < 0.04, "srf, %s, way %d # z %.2f, se %.1e",
               mode == IMP_SINGLE ? "one wavelength" : "four", k, z, relative);
    }
}

static void sphere(imp_context *ctx, enum imp_color_mode mode, const char *film,
                   bool factor)
{
    imp_scene *s = scene_make(ctx, mode, film);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[2 * N], se[2 * N], R = 0, bounces = 0;
    struct imp_estimate value;
    run.spp = mode == IMP_SINGLE ? 1024 : 256;
    run.seed = 3;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    test_must(ctx, imp_problem_functional(p, NULL, &run, &value, g, se));

    double want[2 * N] = {0}, sum[2] = {0, 0}, size[2] = {0, 0};
    for (double nm = 360.05; nm < 830; nm += 0.1)
        for (int c = 0; c < 3; c++) { /* the mean of three channels */
            const double a = 0.1 * response(s, c, factor, nm) / 3;
            const double q = 1 / (1 - at(rho, nm)), E = at(e, nm);
            R += a * E * q;
            bounces += a * E * q * q * at(rho, nm);
            for (int k = 0; k < N; k++) {
                want[k] += a * E * q * q * hat(k, nm);
                want[N + k] += a * q * hat(k, nm);
            }
        }
    double worst = 0, relative = 0;
    for (int k = 0; k < 2 * N; k++) {
        worst = fmax(worst, fabs(g[k] - want[k]) / (se[k] + 1e-7));
        if (fabs(want[k]) > 0.1 * R) relative = fmax(relative, se[k] / fabs(want[k]));
        sum[k / N] += g[k] * (k < N ? rho[k] : e[k - N]);
        size[k / N] += se[k] * (k < N ? rho[k] : e[k - N]);
    }
    tap_ok(fabs(value.value - R) < 4 * value.se, "%s: R # %.5f +- %.5f, %.5f",
           mode == IMP_SINGLE ? "one wavelength" : "four", value.value, value.se, R);
    tap_ok(worst < 4.2 && relative < 0.1,
           "derivatives by %d samples # z %.2f, largest error %.3f", 2 * N, worst,
           relative);
    tap_ok(fabs(sum[1] - R) < 4 * size[1] && fabs(sum[0] - bounces) < 4 * size[0],
           "Euler: %.5f is R %.5f, %.5f bounces %.5f", sum[1], R, sum[0], bounces);
    if (factor) pictures(ctx, s, mode);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- Losses ------------------------------------------------------------------------- */

#define SIDE 4

/* Triangles over [400, 800]. */
static const char *curves(int n, char *film, size_t size)
{
    const double step = 400. / (n + 1);
    int used =
        snprintf(film, size,
                 "<film type='specfilm'><integer name='width' value='%d'/><integer "
                 "name='height' value='%d'/><rfilter type='box'/>",
                 SIDE, SIDE);
    for (int c = 0; c < n; c++)
        used += snprintf(film + used, size - (size_t)used,
                         "<spectrum name='c%d' value='%.17g:0,%.17g:.01,%.17g:0'/>", c,
                         400 + step * c, 400 + step * (c + 1), 400 + step * (c + 2));
    snprintf(film + used, size - (size_t)used, "</film>");
    return film;
}
static double curve_at(int n, int c, double nm)
{
    const double step = 400. / (n + 1);
    return .01 * fmax(0, 1 - fabs(nm - 400 - step * (c + 1)) / step);
}

/* All pixels see the same. */
static void loss(imp_context *ctx, int n, enum imp_color_mode mode)
{
    char film[4096];
    float target[SIDE * SIDE * 16];
    double R[16] = {0}, dR[16][N] = {{0}}, want = 0, slope[N] = {0}, g[N], se[N];
    for (double nm = 400.05; nm < 800; nm += 0.1)
        for (int c = 0; c < n; c++) {
            const double a = 0.1 * curve_at(n, c, nm), q = 1 / (1 - at(rho, nm));
            R[c] += a * at(e, nm) * q;
            for (int k = 0; k < N; k++) dR[c][k] += a * at(e, nm) * q * q * hat(k, nm);
        }
    for (int c = 0; c < n; c++) {
        const float T = (float)(R[c] * (0.6 + 0.1 * c));
        for (int i = 0; i < SIDE * SIDE; i++) target[i * n + c] = T;
        want += SIDE * SIDE * 0.5 * (R[c] - T) * (R[c] - T);
        for (int k = 0; k < N; k++) slope[k] += SIDE * SIDE * (R[c] - T) * dR[c][k];
    }
    imp_scene *s = scene_make(ctx, mode, curves(n, film, sizeof film));
    imp_problem *p = test_problem(ctx, s, "wall.*");
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate value;
    t.width = t.height = SIDE;
    t.channels = n;
    t.pixels = target;
    run.spp = mode == IMP_SINGLE ? 4096 : 1024;
    run.seed = 8;
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_objective(p, NULL, &run, &value, g, se));
    double z = 0, relative = 0, size = 0;
    for (int k = 0; k < N; k++) size = fmax(size, fabs(slope[k]));
    for (int k = 0; k < N; k++) {
        z = fmax(z, fabs(g[k] - slope[k]) / (se[k] + 1e-6 * size));
        relative = fmax(relative, se[k] / size);
    }
    tap_ok(fabs(value.value - want) < 4 * value.se && value.se < 0.1 * want && z < 4.2 &&
               relative < 0.1,
           "loss over %d curves, %s # %.5f +- %.5f, %.5f; gradient z %.2f, se %.3f", n,
           mode == IMP_SINGLE ? "one wavelength" : "four", value.value, value.se, want, z,
           relative);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void fit(imp_context *ctx)
{
    char film[4096];
    imp_scene *s = scene_make(ctx, IMP_SPECTRAL, curves(12, film, sizeof film));
    imp_problem *p = test_problem(ctx, s, "wall.*");
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    double start[N];
    imp_film *seen;
    run.spp = 2048;
    run.seed = 77;
    test_must(ctx, imp_render(s, &run, &seen));
    t.width = t.height = SIDE;
    t.channels = 12;
    t.pixels = imp_film_mean(seen);
    t.noise_se = imp_film_se(seen);
    test_must(ctx, imp_problem_add_target(p, &t));
    for (int k = 0; k < N; k++) start[k] = 0.35;
    test_must(ctx, imp_problem_set_x(p, start));
    o.optimizer = IMP_LM;
    o.intervals = 1;
    run.spp = 256;
    run.seed = 5;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    double z = 0, worst = 0;
    int open = 0;
    for (int k = 0; k < N; k++) {
        const struct imp_fit_variable *v = &r->variables[k];
        open += !v->determined;
        if (!v->determined) continue;
        z = fmax(z, fabs(v->value - rho[k]) / v->se);
        if (k > 0 && k < N - 1) worst = fmax(worst, v->se);
    }
    tap_ok(z < 4 && worst < 0.05 && open <= 1,
           "a fit through 12 curves # z %.2f, se up to %.3f, %d not determined", z, worst,
           open);
    imp_film_destroy(seen);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(0);
    const char *rgb = "<film type='hdrfilm'><integer name='width' value='8'/><integer "
                      "name='height' value='8'/><rfilter type='box'/></film>",
               *three =
                   "<film type='specfilm'><integer name='width' value='8'/><integer "
                   "name='height' value='8'/><rfilter type='box'/><spectrum name='a' "
                   "value='400:0,500:.01,600:0'/><spectrum name='b' "
                   "value='500:0,600:.01,700:0'/><spectrum name='c' "
                   "value='600:0,700:.01,800:0'/></film>";
    char curve[512], both[1024];
    list(srf, curve, sizeof curve);
    snprintf(both, sizeof both, "%s<spectrum name='srf' value='%s'/>", rgb, curve);
    sphere(ctx, IMP_SPECTRAL, rgb, false);
    sphere(ctx, IMP_SINGLE, rgb, false);
    sphere(ctx, IMP_SPECTRAL, three, false);
    sphere(ctx, IMP_SPECTRAL, both, true);
    sphere(ctx, IMP_SINGLE, both, true);
    loss(ctx, 1, IMP_SPECTRAL);
    loss(ctx, 2, IMP_SPECTRAL);
    loss(ctx, 5, IMP_SPECTRAL);
    loss(ctx, 5, IMP_SINGLE);
    fit(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
