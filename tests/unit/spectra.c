/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra: upsampling of colours against their colour under daylight, against Mitsuba's
 * table and against differences; every form's derivatives; wavelengths of walks. */
#include "base/pool.h"
#include "color/cie.h"
#include "color/color_tables.h"
#include "color/convert.h"
#include "color/rgb.h"
#include "color/rgb_basis.h"
#include "color/wavelength.h"
#include "imp_tap.h"
#include "kind/bsdf/presets.h"
#include "kind/texture/lifted_texels.h"
#include "math/rng.h"
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

static imp_context *ctx;
static struct imp_arena arena;

/* ---- Upsampling ---------------------------------------------------------------------- */

/* Colour of a reflectance under D65 by another quadrature: 1 nm, trapezoids. */
static void colour_of(const struct imp__lifted *l, double rgb[3])
{
    double xyz[3] = {0, 0, 0}, white[3] = {0, 0, 0}, w[3];
    for (int nm = 360; nm <= 830; nm++)
        for (int c = 0; c < 3; c++) {
            const double a =
                imp__cie_lookup(imp__cie_xyz[c], nm) * imp__cie_lookup(imp__cie_d65, nm);
            xyz[c] += a * imp__lifted_value(l, nm);
            white[c] += a;
        }
    imp__xyz_to_rgb(xyz, rgb);
    imp__xyz_to_rgb(white, w);
    for (int c = 0; c < 3; c++) rgb[c] /= w[c];
}

static void upsampling(void)
{
    double worst = 0, saturated = 0, derivative = 0;
    int n = 0, missed = 0;
    for (int i = 0; i <= 10; i++)
        for (int j = 0; j <= 10; j++)
            for (int k = 0; k <= 10; k++) {
                const double rgb[3] = {i / 10., j / 10., k / 10.};
                struct imp__lifted l;
                double is[3], error = 0;
                imp__lift_reflectance(rgb, &l);
                colour_of(&l, is);
                for (int c = 0; c < 3; c++) error = fmax(error, fabs(is[c] - rgb[c]));
                const bool edge = !(i && j && k) || i == 10 || j == 10 || k == 10;
                if (edge) saturated = fmax(saturated, error);
                else worst = fmax(worst, error);
                n++;
                missed += error > 1e-3;
                if (edge) continue;
                for (int c = 0; c < 3; c++) {
                    const double h = 1e-5;
                    struct imp__lifted a, b;
                    double up[3], down[3];
                    memcpy(up, rgb, sizeof up);
                    memcpy(down, rgb, sizeof down);
                    up[c] += h, down[c] -= h;
                    imp__lift_reflectance(up, &a);
                    imp__lift_reflectance(down, &b);
                    for (double nm = 380; nm < 800; nm += 60) {
                        double d[3];
                        imp__lifted_value_d(&l, nm, d);
                        const double q =
                            (imp__lifted_value(&a, nm) - imp__lifted_value(&b, nm)) /
                            (2 * h);
                        derivative = fmax(derivative, fabs(d[c] - q) / (1 + fabs(q)));
                    }
                }
            }
    tap_ok(worst < 2e-4, "colours inside the cube are met under D65 # %.1e", worst);
    tap_ok(saturated < 0.01, "and on its faces # %.1e, %d of %d off by 1e-3", saturated,
           missed, n);
    tap_ok(derivative < 1e-4, "derivatives by r, g, b # %.1e", derivative);
}

/* Extinctions: a reflectance's spectra up to 1, without a step there, and derivatives beyond
 * by differences. */
static void extinctions(void)
{
    static const double hue[][3] = {{1, .2, .9}, {.1, .97, .3}, {.9, .95, 1}};
    double same = 0, step = 0, derivative = 0;
    for (int q = 0; q < 3; q++)
        for (int size = 0; size < 6; size++) {
            const double m = (double[]){.4, .95, 1 - 1e-9, 1 + 1e-9, 1.6, 7}[size];
            double rgb[3], d[3];
            struct imp__lifted l, other;
            for (int c = 0; c < 3; c++) rgb[c] = m * hue[q][c] / (q == 1 ? .97 : 1);
            imp__lift_extinction(rgb, &l);
            imp__lift_reflectance(rgb, &other);
            for (double nm = 380; nm < 800; nm += 30) {
                const double apart =
                    fabs(imp__lifted_value(&l, nm) - imp__lifted_value(&other, nm));
                if (m < 1) same = fmax(same, apart);
                else if (m < 1.1) step = fmax(step, apart);
            }
            if (m > .96 && m < 1.1) continue; /* spectra are too steep for differences */
            for (int c = 0; c < 3; c++) {
                const double h = 1e-5 * m;
                struct imp__lifted a, b;
                double up[3], down[3];
                memcpy(up, rgb, sizeof up);
                memcpy(down, rgb, sizeof down);
                up[c] += h, down[c] -= h;
                imp__lift_extinction(up, &a);
                imp__lift_extinction(down, &b);
                for (double nm = 380; nm < 800; nm += 60) {
                    imp__lifted_value_d(&l, nm, d);
                    const double by =
                        (imp__lifted_value(&a, nm) - imp__lifted_value(&b, nm)) / (2 * h);
                    derivative = fmax(derivative, fabs(d[c] - by) / (1 + fabs(by)));
                }
            }
        }
    tap_ok(same < 1e-12, "extinctions up to 1 are lifted as reflectances # %.1e", same);
    tap_ok(step < 1e-4, "and there is no step beyond # %.1e", step);
    tap_ok(derivative < 1e-4, "derivatives of extinctions # %.1e", derivative);
}

/* The linear basis: nowhere negative, of sum 1, with the colours of the axes; derivatives;
 * and bounds of both kinds of spectra. */
static void linear(void)
{
    double least = 1, sum = 0, colour = 0, slope = 0, above = 0, tight = 0;
    for (double nm = 350; nm <= 840; nm += 0.5) {
        double b[3];
        imp__rgb_basis(nm, b);
        for (int c = 0; c < 3; c++) least = fmin(least, b[c]);
        sum = fmax(sum, fabs(b[0] + b[1] + b[2] - 1));
    }
    for (int k = 0; k < 200; k++) {
        double rgb[3], is[3], d[3];
        for (int c = 0; c < 3; c++) {
            rgb[c] = imp__u01(imp__key(1, 2, 3), (uint32_t)(3 * k + c));
            if (k < 8) rgb[c] = k >> c & 1;
        }
        for (int form = 0; form < 4; form++) {
            struct imp__lifted l;
            double most = 0;
            if (form == 0) imp__lift_linear(rgb, true, &l);
            else if (form == 1) imp__lift_reflectance(rgb, &l);
            else if (form == 2) imp__lift_extinction(rgb, &l);
            else imp__lift_unbounded(rgb, &l);
            for (double nm = 360; nm <= 830; nm += 0.5)
                most = fmax(most, imp__lifted_value(&l, nm));
            above = fmax(above, most - imp__lifted_most(&l));
            if (form > 0) tight = fmax(tight, imp__lifted_most(&l) - most - 1e-3 * most);
            if (form > 0) continue;
            colour_of(&l, is);
            for (int c = 0; c < 3; c++) colour = fmax(colour, fabs(is[c] - rgb[c]));
            for (double nm = 380; nm < 800; nm += 37) {
                const double v = imp__lifted_value_d(&l, nm, d);
                slope =
                    fmax(slope, fabs(v - rgb[0] * d[0] - rgb[1] * d[1] - rgb[2] * d[2]));
            }
        }
    }
    tap_ok(least >= 0 && sum < 1e-11, "the linear basis is a partition of 1 # %.1e", sum);
    tap_ok(colour < 1e-4, "its colours are met under D65 # %.1e", colour);
    tap_ok(slope < 1e-14, "and it is linear in them # %.1e", slope);
    tap_ok(above <= 1e-12 && tight < 1e-3, "bounds hold, and are met # %.1e, %.1e", above,
           tight);
}

/* At four wavelengths at once as one by one, to the bit, beyond the ends too. */
static void lanes(void)
{
    static const double even[] = {400, 450, 500, 550}, odd[] = {400, 410, 500, 550},
                        v[] = {.1, .7, .2, .9}, rgb[] = {.7, .3, .05},
                        sellmeier[] = {1.0396, .2318, 1.0105, .006, .02, 103.56},
                        cauchy[] = {1.5, .0042, 0}, kelvin = 3000;
    struct imp_spectrum *s[] = {
        imp__spectrum_make(&arena, IMP_SPECTRUM_POINTS, 4, even, v),
        imp__spectrum_make(&arena, IMP_SPECTRUM_POINTS, 4, odd, v),
        imp__spectrum_make(&arena, IMP_SPECTRUM_POINTS, 2, even, v),
        imp__spectrum_make(&arena, IMP_SPECTRUM_NUMBER, 1, NULL, v),
        imp__spectrum_make(&arena, IMP_SPECTRUM_NUMBER, 1, NULL, v),
        imp__spectrum_make(&arena, IMP_SPECTRUM_COLOR, 3, NULL, rgb),
        imp__spectrum_make(&arena, IMP_SPECTRUM_COLOR, 3, NULL, rgb),
        imp__spectrum_make(&arena, IMP_SPECTRUM_SELLMEIER, 6, NULL, sellmeier),
        imp__spectrum_make(&arena, IMP_SPECTRUM_CAUCHY, 3, NULL, cauchy),
        imp__spectrum_make(&arena, IMP_SPECTRUM_BLACKBODY, 1, NULL, &kelvin),
        imp__spectrum_make(&arena, IMP_SPECTRUM_POINTS, 4, even, v)};
    const size_t n = sizeof s / sizeof *s;
    s[4]->lo = 420, s[4]->hi = 470;
    s[6]->linear = true;
    s[n - 1]->times = &imp__daylight;
    size_t differ = 0, nonzero = 0;
    for (size_t k = 0; k < n; k++) {
        imp__spectrum_update(s[k]);
        for (double at = 380; at <= 570; at += .5) {
            const double nm[4] = {at, 780 - at, at + .125, at < 475 ? 400 : 550};
            imp_spec value;
            imp__spectrum_lanes(s[k], nm, &value);
            for (int j = 0; j < 4; j++) {
                differ += value[j] != imp__spectrum_value(s[k], nm[j]);
                nonzero += value[j] != 0;
            }
        }
    }
    tap_ok(differ == 0 && nonzero > 1000 * n,
           "four wavelengths at once # %zu of %zu differ", differ, nonzero);
}

/* Bounds of spectra, against a close look. */
static void bounds(void)
{
    static const double nm[4] = {360, 500, 510, 830}, v[4] = {.1, .2, 7, .3}, T = 4000,
                        B[6] = {1.04, .23, 1.01, .006, .02, 103.6};
    const struct imp_spectrum *s[3] = {
        imp__spectrum_make(&arena, IMP_SPECTRUM_POINTS, 4, nm, v),
        imp__spectrum_make(&arena, IMP_SPECTRUM_BLACKBODY, 1, NULL, &T),
        imp__spectrum_make(&arena, IMP_SPECTRUM_SELLMEIER, 6, NULL, B)};
    int held = 0;
    for (int k = 0; k < 3; k++) {
        double most = 0;
        for (double l = 360; l <= 830; l += 0.01)
            most = fmax(most, imp__spectrum_value(s[k], l));
        held += imp__spectrum_most(s[k]) >= most;
    }
    struct imp_spectrum lit = *s[0];
    lit.times = &imp__daylight;
    double most = 0;
    for (double l = 360; l <= 830; l += 0.01)
        most = fmax(most, imp__spectrum_value(&lit, l));
    tap_ok(held == 3 && imp__spectrum_most(&lit) >= most, "bounds of spectra");
}

/* ---- Texels --------------------------------------------------------------------------- */

#define SIDE     120
#define TEXELS   (SIDE * SIDE)
#define DISTINCT 700

static bool lifted_alike(const struct imp__lifted_texels *t, enum imp__lift_rule rule)
{
    struct imp__lifter by;
    imp__lifter_make(&by);
    for (size_t i = 0; i < t->n; i++) {
        struct imp__lifted own;
        const struct imp__lifted *is = imp__lifted_texel(t, i, &own);
        if (t->n > 4096 && i % 8) continue; /* to find is 1000 times as fast as to lift */
        const double rgb[3] = {t->data[3 * i], t->data[3 * i + 1], t->data[3 * i + 2]};
        const bool beyond = rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1;
        struct imp__lifted l;
        if (rule == IMP__LIFT_ANY_SIZE || (rule == IMP__LIFT_BY_SIZE && beyond))
            imp__lift_unbounded_by(&by, rgb, &l);
        else imp__lift_reflectance_by(&by, rgb, &l);
        if (l.scale != is->scale || memcmp(l.c, is->c, sizeof l.c) != 0 ||
            memcmp(l.d_c, is->d_c, sizeof l.d_c) != 0)
            return false;
    }
    return true;
}

/* Each texel has the spectrum of its colour to the bit, on any number of threads, also
 * where another rule or other colours follow. */
static void texels(int threads)
{
    static float data[3 * TEXELS];
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_arena own;
    struct imp__lifted_texels t;
    options.threads = threads;
    imp_context *with = NULL;
    if (imp_context_create(&options, &with) != IMP_OK) return;
    imp__arena_init(&own, with);
    const struct imp_build b = {.ctx = with, .arena = &own};
    for (uint32_t i = 0; i < TEXELS; i++)
        for (uint32_t c = 0; c < 3; c++) {
            const struct imp_key key =
                imp__key(5, (uint64_t)(imp__u01(imp__key(6, i, 0), 0) * DISTINCT), c);
            data[3 * i + c] = (float)(1.5 * imp__u01(key, 1));
        }
    bool good = imp__lifted_texels_make(&b, data, TEXELS, &t) == IMP_OK;
    for (int rule = 0; good && rule < 3; rule++) {
        imp__lifted_texels_update(&t, (enum imp__lift_rule)rule);
        good = lifted_alike(&t, (enum imp__lift_rule)rule);
    }
    /* Few colours have few spectra, though threads may lift one at the same time. */
    const uint32_t spectra = good ? *t.used : 0;
    good = good && spectra >= DISTINCT - 10 && spectra <= (uint32_t)threads * DISTINCT;
    for (size_t k = 0; good && k < TEXELS; k += 7) data[3 * k] = 0.25f;
    if (good) imp__lifted_texels_update(&t, IMP__LIFT_ANY_SIZE);
    good = good && lifted_alike(&t, IMP__LIFT_ANY_SIZE);
    tap_ok(good, "texels have the spectra of their colours on %d threads", threads);
    imp__arena_free(&own);
    imp_context_destroy(with);
}

/* Texels that differ all are lifted by the walks that look them up. Threads look
 * up the same ones at the same time, and each finds its colour's spectrum. */
struct racing {
    const struct imp__lifted_texels *t;
    _Atomic int wrong;
};
static enum imp_status race(size_t first, size_t end, void *payload)
{
    struct racing *r = payload;
    struct imp__lifter by;
    (void)first, (void)end;
    imp__lifter_make(&by);
    for (size_t i = 0; i < r->t->n; i++) {
        const double rgb[3] = {r->t->data[3 * i], r->t->data[3 * i + 1],
                               r->t->data[3 * i + 2]};
        struct imp__lifted own, l;
        const struct imp__lifted *is = imp__lifted_texel(r->t, i, &own);
        if (i % 64) continue; /* to find is 1000 times as fast as to lift */
        imp__lift_reflectance_by(&by, rgb, &l);
        if (memcmp(l.c, is->c, sizeof l.c) != 0 ||
            memcmp(l.d_c, is->d_c, sizeof l.d_c) != 0)
            r->wrong++;
    }
    return IMP_OK;
}

static size_t there(const struct imp__lifted_texels *t)
{
    size_t n = 0;
    for (size_t i = 0; i < t->n; i++) n += t->spectrum_of[i] != 0;
    return n;
}

static void texels_of_many_colours(void)
{
    enum { N = 100000 };
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_arena own;
    struct imp__lifted_texels t, same;
    options.threads = 4;
    imp_context *with = NULL;
    float *data = malloc(3 * N * sizeof *data);
    if (!data || imp_context_create(&options, &with) != IMP_OK) return;
    imp__arena_init(&own, with);
    const struct imp_build b = {.ctx = with, .arena = &own};
    for (uint32_t i = 0; i < 3 * N; i++) data[i] = (float)imp__u01(imp__key(9, i, 0), 0);
    bool good = imp__lifted_texels_make(&b, data, N, &t) == IMP_OK &&
                imp__lifted_texels_make(&b, data, N, &same) == IMP_OK;
    if (good) imp__lifted_texels_update(&t, IMP__LIFT_REFLECTANCE);
    const size_t before = good ? there(&t) : 0;
    struct racing r = {&t, 0};
    good = good && before == 0 && imp__parallel_ranges(with, 4, 1, race, &r) == IMP_OK;
    tap_ok(good && r.wrong == 0 && there(&t) == N,
           "texels of 100,000 colours are lifted when looked up");
    same.whole = true;
    if (good) imp__lifted_texels_update(&same, IMP__LIFT_REFLECTANCE);
    tap_ok(good && there(&same) == N, "or all at once");
    /* A colour that changes is lifted anew. */
    data[0] = 0.75f;
    if (good) imp__lifted_texels_update(&t, IMP__LIFT_REFLECTANCE);
    tap_ok(good && race(0, 0, &r) == IMP_OK && r.wrong == 0, "and anew when they change");
    imp__arena_free(&own);
    imp_context_destroy(with);
    free(data);
}

/* One colour that changes again and again fills the list of spectra, which is then begun anew. */
static void texels_that_change(void)
{
    enum { N = 1024, CHANGES = 500 };
    static float data[3 * N];
    struct imp_arena own;
    struct imp__lifted_texels t;
    imp__arena_init(&own, ctx);
    const struct imp_build b = {.ctx = ctx, .arena = &own};
    for (uint32_t i = 0; i < 3 * N; i++) data[i] = (float)imp__u01(imp__key(9, i, 0), 0);
    bool good = imp__lifted_texels_make(&b, data, N, &t) == IMP_OK;
    if (good) imp__lifted_texels_update(&t, IMP__LIFT_REFLECTANCE);
    good = good && lifted_alike(&t, IMP__LIFT_REFLECTANCE) && *t.used == N;
    int begun = 0;
    for (uint32_t i = 0; good && i < CHANGES; i++) {
        const uint32_t before = *t.used;
        data[3 * i] = (float)imp__u01(imp__key(10, i, 0), 0);
        imp__lifted_texels_update(&t, IMP__LIFT_REFLECTANCE);
        begun += *t.used < before;
        good = (begun || i % 100 == 0) ? lifted_alike(&t, IMP__LIFT_REFLECTANCE) : true;
        struct imp__lifted mine;
        good = good && imp__lifted_texel(&t, i, &mine) != &mine;
        if (begun) break;
    }
    tap_ok(good && begun == 1 && *t.used == N, "a full list of spectra is begun anew");
    imp__arena_free(&own);
}

/* ---- Metals by name -------------------------------------------------------------------- */

/* Amorphous carbon: its table by wavelengths, integrated against the observer without an
 * illuminant, is its colour in the mode rgb. */
static void carbon(void)
{
    const struct imp__metal *m = imp__metal_find("a-C");
    const struct imp__conductor *preset = imp__conductor_find("a-C");
    double worst = 0;
    for (int part = 0; part < 2; part++) {
        const double *value = part ? m->k : m->eta,
                     *want = part ? preset->k : preset->eta;
        double xyz[3] = {0, 0, 0}, y = 0, rgb[3];
        for (int nm = 365, i = 0; nm <= 830; nm++) {
            while (m->nm[i + 1] < nm) i++;
            const double t = (nm - m->nm[i]) / (m->nm[i + 1] - m->nm[i]);
            for (int c = 0; c < 3; c++)
                xyz[c] += imp__cie_lookup(imp__cie_xyz[c], nm) *
                          (value[i] + t * (value[i + 1] - value[i]));
            y += imp__cie_lookup(imp__cie_xyz[1], nm);
        }
        for (int c = 0; c < 3; c++) xyz[c] /= y;
        imp__xyz_to_rgb(xyz, rgb);
        for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(rgb[c] - want[c]));
    }
    tap_ok(worst < 2e-3, "a-C is its preset # within %.2g", worst);
}

int main(void)
{
    const struct imp_context_options options = {.size = sizeof options, .threads = 1};
    if (imp_context_create(&options, &ctx) != IMP_OK) return 1;
    imp__arena_init(&arena, ctx);
    upsampling();
    extinctions();
    linear();
    bounds();
    lanes();
    texels(1);
    texels(3);
    texels_of_many_colours();
    texels_that_change();
    carbon();
    for (int q = 0; q < 6; q++) {
        static const double rgb[6][3] = {{.2, .5, .9}, {.9, .05, .05}, {1, 0, 0},
                                         {.1, .8, .1}, {.5, .5, .1},   {.73, .72, .69}};
        struct imp__lifted l;
        imp__lift_reflectance(rgb[q], &l);
        printf("# ");
        for (int nm = 400; nm <= 700; nm += 50)
            printf(" %.4f", imp__lifted_value(&l, nm));
        printf("   %g %g %g\n", l.c[0], l.c[1], l.c[2]);
    }
    imp__arena_free(&arena);
    imp_context_destroy(ctx);
    return tap_done();
}
