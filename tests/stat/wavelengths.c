/* SPDX-License-Identifier: Apache-2.0
 *
 * Wavelengths of walks against quadrature: white in equal energy and in daylight, the
 * noise of one sample, and how fast a colour chart converges by independent, stratified,
 * importance-drawn and hero wavelengths (the numbers are of an independent quadrature in
 * double precision). Errors of pictures against the spread of seeds. */
#include "color/cie.h"
#include "color/wavelength.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "macbeth.h"
#include "math/stat.h"
#include "walk/core/walk.h"

static imp_context *ctx;
static struct imp_arena arena;

/* Responses x, y, z, such that daylight has luminance 1. */
static const struct imp_spectrum *observer(void)
{
    double nm[IMP_CIE_N], v[IMP_CIE_N];
    struct imp_spectrum *s = imp__arena_take(&arena, 3, sizeof *s);
    for (int c = 0; c < 3; c++) {
        for (int q = 0; q < IMP_CIE_N; q++) {
            nm[q] = 360 + 5 * q;
            v[q] = imp__cie_xyz[c][q] / IMP_CIE_Y_INTEGRAL;
        }
        s[c] = *imp__spectrum_make(&arena, IMP_SPECTRUM_POINTS, IMP_CIE_N, nm, v);
    }
    return s;
}

static double patch_at(int p, double nm)
{
    const double at = fmin(fmax((nm - 380) / 10, 0), 35);
    const int k = (int)fmin(at, 34);
    return macbeth[p].rho[k] + (at - k) * (macbeth[p].rho[k + 1] - macbeth[p].rho[k]);
}
static double light_at(double nm) { return imp__spectrum_value(&imp__daylight, nm); }

/* ---- Means by quadrature ------------------------------------------------------------- */

static void quadrature(const struct imp_spectrum *xyz, bool daylight, double lo,
                       double hi, int patch, double out[3])
{
    double white = 0;
    out[0] = out[1] = out[2] = 0;
    for (double nm = lo; nm <= hi; nm += 0.5) {
        const double w = nm == lo || nm == hi ? 0.25 : 0.5;
        const double e = daylight ? light_at(nm) : 1;
        for (int c = 0; c < 3; c++)
            out[c] += w * e * (patch < 0 ? 1 : patch_at(patch, nm)) *
                      imp__spectrum_value(&xyz[c], nm);
        white += w * e * imp__spectrum_value(&xyz[1], nm);
    }
    for (int c = 0; c < 3; c++) out[c] /= white;
}

static void white(const struct imp_spectrum *xyz)
{
    double E[3], D[3];
    quadrature(xyz, false, 360, 830, -1, E);
    quadrature(xyz, true, 360, 830, -1, D);
    const double se = E[0] + E[1] + E[2], sd = D[0] + D[1] + D[2];
    tap_ok(fabs(E[0] / se - .33331) < 1e-4 && fabs(E[1] / se - .33329) < 1e-4,
           "equal energy: x %.5f, y %.5f", E[0] / se, E[1] / se);
    tap_ok(fabs(D[0] / sd - .31274) < 1e-4 && fabs(D[1] / sd - .32904) < 1e-4 &&
               fabs(D[0] / D[1] - .95047) < 1e-4 && fabs(D[2] / D[1] - 1.08867) < 3e-4,
           "daylight: x %.5f, y %.5f, X/Y %.5f, Z/Y %.5f", D[0] / sd, D[1] / sd,
           D[0] / D[1], D[2] / D[1]);
    double worst = 0, narrow = 0;
    for (int p = 0; p < 24; p++) {
        double w = 0, ww = 0, www = 0;
        for (double nm = 360; nm <= 830; nm += 0.5) {
            const double y =
                light_at(nm) * patch_at(p, nm) * imp__spectrum_value(&xyz[1], nm);
            w += y;
            ww += nm >= 380 && nm <= 780 ? y : 0;
            www += nm >= 400 && nm <= 700 ? y : 0;
        }
        worst = fmax(worst, 1 - ww / w);
        narrow = fmax(narrow, 1 - www / w);
    }
    tap_ok(worst < 1.9e-5 && narrow < 3.6e-3 && narrow > 1e-3,
           "range: 380-780 nm loses %.1e of Y, 400-700 nm %.1e", worst, narrow);
}

/* ---- A furnace in a picture ------------------------------------------------------------ */

static void furnace(enum imp_color_mode mode, const char *light, const double xyz[3])
{
    char text[2048];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='12'/></integrator><emitter type='constant'>%s</emitter>"
             "<sensor type='perspective'><float name='fov' value='20'/><transform "
             "name='to_world'><lookat origin='0,0,5' target='0,0,0' up='0,1,0'/>"
             "</transform><film type='hdrfilm'><integer name='width' value='4'/><integer "
             "name='height' value='4'/><string name='pixel_format' value='xyz'/><rfilter "
             "type='box'/></film></sensor><shape type='sphere'><bsdf type='diffuse'>"
             "<float name='reflectance' value='1'/></bsdf></shape></scene>",
             light);
    imp_scene *s = test_scene_text(ctx, text, mode);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f;
    run.spp = 16384;
    run.points = IMP_POINTS_INDEPENDENT;
    test_must(ctx, imp_render(s, &run, &f));
    double z = 0, worst = 0;
    const float *mean = imp_film_mean(f), *se = imp_film_se(f);
    for (int c = 0; c < 3; c++) {
        double sum = 0, square = 0;
        for (int p = 0; p < 16; p++) {
            sum += (double)mean[3 * p + c] / 16;
            square += (double)se[3 * p + c] * (double)se[3 * p + c] / 256;
        }
        z = fmax(z, fabs(sum - xyz[c]) / sqrt(square + 1e-12));
        worst = fmax(worst, sqrt(square) / xyz[c]);
    }
    tap_ok(z < 4 && worst < 2e-3, "furnace, %s # z %.2f, se %.1e",
           mode == IMP_SINGLE ? "one wavelength" : "four", z, worst);
    imp_film_destroy(f);
    imp_scene_destroy(s);
}

/* ---- Noise of one sample ----------------------------------------------------------------- */

static void noise_of_one(const struct imp_spectrum *xyz)
{
    static const struct {
        int patch;
        double mean[3], cv[3];
    } row[4] = {{0, {.1115, .1008, .0680}, {1.384, 1.293, 1.998}},
                {12, {.0796, .0615, .2818}, {1.413, 1.139, 2.252}},
                {14, {.1963, .1177, .0503}, {1.751, 1.351, 2.021}},
                {18, {.8621, .9123, .9527}, {1.211, 1.324, 2.037}}};
    const struct imp_wavelengths w = {
        .lanes = 1, .lo = 380, .hi = 780, .n_channels = 3, .response = xyz};
    double white_xyz[3];
    quadrature(xyz, true, 380, 780, -1, white_xyz);
    double Y = 0;
    for (double nm = 380; nm <= 780; nm += 0.5)
        Y += 0.5 * light_at(nm) * imp__spectrum_value(&xyz[1], nm);
    for (int k = 0; k < 4; k++) {
        struct tap_stat s[3] = {{0}};
        double worst = 0, off = 0;
        for (int i = 0; i < 1000000; i++) {
            struct imp_waves waves;
            const struct imp_key key = imp__key(5, (uint64_t)k, (uint64_t)i);
            imp__waves_make(&w, imp__u01(key, 0), &waves);
            const double nm = waves.carried.nm[0];
            const imp_spec L = imp__spec(light_at(nm) * patch_at(row[k].patch, nm) / Y);
            const imp_spec c = imp__waves_channels(&waves, L);
            for (int j = 0; j < 3; j++) tap_add(&s[j], c[j]);
        }
        for (int j = 0; j < 3; j++) {
            const double cv = tap_se(&s[j]) * sqrt(s[j].n) / s[j].mean;
            worst = fmax(worst, fabs(cv / row[k].cv[j] - 1));
            off = fmax(off, fabs(s[j].mean - row[k].mean[j]) / (tap_se(&s[j]) + 5e-5));
        }
        tap_ok(worst < 0.02 && off < 4,
               "%s: deviation of one sample # %.4f, means z %.2f",
               macbeth[row[k].patch].name, worst, off);
    }
}

/* ---- A colour chart ---------------------------------------------------------------------- */

static void lab(const double xyz[3], const double w[3], double out[3])
{
    double f[3];
    for (int c = 0; c < 3; c++) {
        const double t = xyz[c] / w[c];
        f[c] = t > 216. / 24389 ? cbrt(t) : (24389. / 27 * t + 16) / 116;
    }
    out[0] = 116 * f[1] - 16;
    out[1] = 500 * (f[0] - f[1]);
    out[2] = 200 * (f[1] - f[2]);
}

/* Distribution proportional to (x + y + z) times daylight, in bins of 1 nm. */
static const double *importance(const struct imp_spectrum *xyz, int n)
{
    double *cdf = imp__arena_array(&arena, (size_t)n + 1, sizeof *cdf);
    for (int k = 0; k < n; k++) {
        const double nm = 380 + (k + .5) * 400. / n;
        double sum = 0;
        for (int c = 0; c < 3; c++) sum += imp__spectrum_value(&xyz[c], nm);
        cdf[k + 1] = cdf[k] + sum * light_at(nm);
    }
    for (int k = 0; k <= n; k++) cdf[k] /= cdf[n] > 0 && k < n ? cdf[n] : 1;
    cdf[n] = 1;
    return cdf;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* RMS colour difference of a pixel, averaged over the patches, and the median deviation of
 * Y, of N walks. */
static void chart(const struct imp_wavelengths *w, const struct imp_spectrum *xyz, int N,
                  int set, double *delta, double *deviation)
{
    const int repeats = N <= 4 ? 4000 : N <= 16 ? 2000 : 1000;
    const struct imp_tracer tracer = {.wavelengths = w, .set = set, .period = N};
    double white_xyz[3], cv[24], Y = 0;
    quadrature(xyz, true, 380, 780, -1, white_xyz);
    for (double nm = 380; nm <= 780; nm += 0.5)
        Y += 0.5 * light_at(nm) * imp__spectrum_value(&xyz[1], nm);
    *delta = 0;
    for (int p = 0; p < 24; p++) {
        double truth[3], is[3], sum = 0;
        struct tap_stat y = {0};
        quadrature(xyz, true, 380, 780, p, is);
        lab(is, white_xyz, truth);
        for (int r = 0; r < repeats; r++) {
            double pixel[3] = {0, 0, 0}, here[3];
            for (int i = 0; i < N; i++) {
                struct imp_waves waves;
                imp_spec L = {0};
                const struct imp_walk walk = {
                    .key = imp__key(77, (uint64_t)(24 * r + p), (uint64_t)i)};
                imp__waves_make(w, imp__wave_draw(&tracer, &walk, i), &waves);
                for (int j = 0; j < waves.carried.n; j++) {
                    const double nm = waves.carried.nm[j];
                    L[j] = light_at(nm) * patch_at(p, nm) / Y;
                }
                const imp_spec c = imp__waves_channels(&waves, L);
                for (int k = 0; k < 3; k++) pixel[k] += c[k] / N;
            }
            lab(pixel, white_xyz, here);
            for (int k = 0; k < 3; k++)
                sum += (here[k] - truth[k]) * (here[k] - truth[k]);
            tap_add(&y, pixel[1]);
        }
        *delta += sqrt(sum / repeats) / 24;
        cv[p] = tap_se(&y) * sqrt(y.n) / y.mean;
    }
    qsort(cv, 24, sizeof *cv, by_size);
    *deviation = (cv[11] + cv[12]) / 2;
}

static void charts(const struct imp_spectrum *xyz)
{
    static const int N[4] = {4, 16, 49, 256};
    static const double table[4][4][2] = {
        {{96.3, .661}, {43.6, .332}, {23.8, .189}, {10.3, .083}},
        {{61.1, .374}, {10.2, .053}, {1.94, .010}, {.16, .0009}},
        {{16.2, .058}, {7.9, .029}, {4.5, .016}, {2.0, .007}},
        {{39.6, .254}, {5.6, .034}, {1.15, .007}, {.11, .0006}}};
    static const char *const name[4] = {"independent", "stratified", "hero and three",
                                        "importance, stratified"};
    struct imp_wavelengths w[4];
    for (int k = 0; k < 4; k++)
        w[k] = (struct imp_wavelengths){.lanes = k == 2 ? 4 : 1,
                                        .lo = 380,
                                        .hi = 780,
                                        .n_channels = 3,
                                        .response = xyz};
    w[3].n_bins = 3200;
    w[3].cdf = importance(xyz, 3200);
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 4; i++) {
            double delta, cv;
            chart(&w[k], xyz, N[i], k == 0 || k == 2 ? 1 : N[i], &delta, &cv);
            /* Half a unit of the last digit that is printed. */
            const double round_cv = table[k][i][1] < .002  ? .00005
                                    : table[k][i][1] < .02 ? .0005
                                                           : 0;
            const double round_delta = table[k][i][0] < .2 ? .005 : 0;
            tap_ok(fabs(delta - table[k][i][0]) < 0.1 * table[k][i][0] + round_delta &&
                       fabs(cv - table[k][i][1]) < 0.1 * table[k][i][1] + round_cv,
                   "%s, %d paths # colour difference %.2f (%.2f), deviation %.4f (%.3f)",
                   name[k], N[i], delta, table[k][i][0], cv, table[k][i][1]);
        }
}

/* ---- Errors of pictures -------------------------------------------------------------------- */

static void errors(enum imp_color_mode mode, const char *filter, int spp)
{
    enum { SEEDS = 64, PIXELS = 16 };
    char text[2048];
    snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='direct'/><emitter type='point'>"
        "<point name='position' x='1' y='2' z='4'/><spectrum name='intensity' "
        "value='360:9,830:30'/></emitter><sensor type='perspective'><float name='fov' "
        "value='20'/><transform name='to_world'><lookat origin='0,0,5' "
        "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
        "name='width' value='4'/><integer name='height' value='4'/><string "
        "name='pixel_format' value='xyz'/><rfilter type='%s'/></film></sensor>"
        "<shape type='sphere'><bsdf type='diffuse'><spectrum name='reflectance' "
        "value='360:.2,500:.9,830:.1'/></bsdf></shape></scene>",
        filter);
    imp_scene *s = test_scene_text(ctx, text, mode);
    struct tap_stat v[3 * PIXELS] = {{0}};
    double claimed = 0, spread = 0;
    for (int seed = 0; seed < SEEDS; seed++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        run.spp = spp;
        run.seed = (uint64_t)seed + 1;
        test_must(ctx, imp_render(s, &run, &f));
        for (int k = 0; k < 3 * PIXELS; k++) {
            tap_add(&v[k], (double)imp_film_mean(f)[k]);
            claimed += (double)imp_film_se(f)[k] * (double)imp_film_se(f)[k] / SEEDS;
        }
        imp_film_destroy(f);
    }
    for (int k = 0; k < 3 * PIXELS; k++) spread += tap_se(&v[k]) * tap_se(&v[k]) * SEEDS;
    /* 48 numbers, a third of them independent, with 63 degrees of freedom each */
    tap_ok(fabs(claimed / spread - 1) < 0.25,
           "errors of %s, %s filter, %d samples # variance %.3f of the spread's",
           mode == IMP_SINGLE ? "one wavelength" : "four", filter, spp, claimed / spread);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(1);
    imp__arena_init(&arena, ctx);
    const struct imp_spectrum *xyz = observer();
    double E[3], D[3];
    white(xyz);
    quadrature(xyz, false, 360, 830, -1, E);
    quadrature(xyz, true, 360, 830, -1, D);
    furnace(IMP_SINGLE, "<spectrum name='radiance' value='1'/>", E);
    furnace(IMP_SPECTRAL, "<spectrum name='radiance' value='1'/>", E);
    furnace(IMP_SPECTRAL, "<float name='radiance' value='1'/>", D);
    noise_of_one(xyz);
    charts(xyz);
    errors(IMP_SINGLE, "box", 64);
    errors(IMP_SINGLE, "gaussian", 64);
    errors(IMP_SPECTRAL, "box", 64);
    errors(IMP_SPECTRAL, "tent", 128);
    errors(IMP_SINGLE, "box", 50);
    imp__arena_free(&arena);
    imp_context_destroy(ctx);
    return tap_done();
}
