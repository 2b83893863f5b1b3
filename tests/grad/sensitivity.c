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
 * number of bounces, weighted by what walks bring. All from one set of walks, with errors. */
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

static void sphere(imp_context *ctx, enum imp_color_mode mode, const char *film)
{
    char text[4096], r[512], l[512];
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
    imp_scene *s = test_scene_text(ctx, text, mode);
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
    const struct imp_wavelengths *w = &s->wavelengths[0];
    for (double nm = 360.05; nm < 830; nm += 0.1)
        for (int c = 0; c < 3; c++) { /* the mean of three channels */
            const double a = 0.1 * imp__spectrum_value(&w->response[c], nm) / 3;
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
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(0);
    const char *rgb = "<film type='hdrfilm'><integer name='width' value='8'/><integer "
                      "name='height' value='8'/><rfilter type='box'/></film>",
               *curves =
                   "<film type='specfilm'><integer name='width' value='8'/><integer "
                   "name='height' value='8'/><rfilter type='box'/><spectrum name='a' "
                   "value='400:0,500:.01,600:0'/><spectrum name='b' "
                   "value='500:0,600:.01,700:0'/><spectrum name='c' "
                   "value='600:0,700:.01,800:0'/></film>";
    sphere(ctx, IMP_SPECTRAL, rgb);
    sphere(ctx, IMP_SINGLE, rgb);
    sphere(ctx, IMP_SPECTRAL, curves);
    imp_context_destroy(ctx);
    return tap_done();
}
