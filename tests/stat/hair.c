/* SPDX-License-Identifier: Apache-2.0
 *
 * Fibres: without absorption every draw weighs 1, and the lobes' integral is the sum of
 * their parts (white furnace, by quadrature as by draws); the Bessel function against its
 * integral; absorption written as pigments and as sigma_a; a lock of curves, lit from all
 * around, that reflects what arrives; messages; derivatives of all numbers on curves.
 * (bsdf_sampling has the density, bsdf_derivatives the derivatives by direction,
 * render/drawn_values Mitsuba's values.) */
#include "imp_check_rows.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/bessel.h"
#include "math/rng.h"
#include "math/sphere_cells.h"
#include "math/warp.h"
#include "scene/scene.h"
#include <unistd.h>

static imp_context *ctx;
static char curves[64];

/* I_0(x) e^-x = 1/pi Int_0^pi e^(x (cos t - 1)) dt; the trapezoid rule converges faster than
 * any power of its step. */
static void bessel(void)
{
    enum { N = 4000 };
    double worst = 0;
    for (double x = 0; x < 3000; x = 1.17 * x + 0.01) {
        double i0 = 0, i1 = 0, ratio;
        for (int k = 0; k <= N; k++) {
            const double t = IMP_PI * k / N, w = k % N ? 1.0 : 0.5;
            i0 += w * exp(x * (cos(t) - 1)) / N;
            i1 += w * cos(t) * exp(x * (cos(t) - 1)) / N;
        }
        worst = fmax(worst, fabs(imp__bessel_i0(x, &ratio) / i0 - 1));
        worst = fmax(worst, fabs(ratio - i1 / i0));
    }
    tap_ok(worst < 1e-13, "the Bessel function is its integral # %.1e", worst);
}

static imp_scene *scene_of(const char *material, enum imp_color_mode mode)
{
    char xml[2500];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='-1'/></integrator><sensor type='perspective'><float name='fov' "
             "value='30'/><transform name='to_world'><lookat origin='0,-4,.7' "
             "target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'><integer "
             "name='width' value='8'/><integer name='height' value='8'/><rfilter "
             "type='box'/></film></sensor><emitter type='constant' id='sky'/><shape "
             "type='bsplinecurve'><string name='filename' value='%s'/>%s</shape></scene>",
             curves, material);
    return test_scene_text(ctx, xml, mode);
}

struct point {
    const struct imp_bsdf *b;
    const imp_spec *in;
    imp_v3 wo;
};
static double value(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {p->wo, wi, IMP_SMOOTH, 0};
    imp_spec f;
    p->b->ops->eval(p->b, p->in, &d, &f);
    return f[1];
}

static void furnace(double m, double n, double sigma)
{
    char material[400];
    snprintf(material, sizeof material,
             "<bsdf type='hair' id='h'><float name='longitudinal_roughness' value='%g'/>"
             "<float name='azimuthal_roughness' value='%g'/><rgb name='sigma_a' "
             "value='0,%g,1'/></bsdf>",
             m, n, sigma);
    imp_scene *s = scene_of(material, IMP_RGB);
    const struct imp_bsdf *b = s->bsdfs[0];
    imp_spec in[IMP_INPUTS_MAX], f, albedo;
    double apart = 0, white = 0, weight = 0;
    for (int j = 0; j < b->n_in; j++) in[j] = b->input[j]->value;
    for (int k = 0; k < 4; k++) {
        const imp_v3 wo = imp__normalize(
            imp__v3(0.4 * k - 0.8, 0.31 * k - 0.7, k == 3 ? -0.5 : 0.2 + 0.2 * k));
        struct point p = {b, in, wo};
        b->ops->directional_albedo(b, in, &wo, &albedo);
        const double exact =
            imp__sphere_integral(value, &p, -1, 1, 1e-4, IMP_SPHERE_SMOOTH);
        apart = fmax(apart, fabs(exact - albedo[1]));
        white = fmax(white, fabs(albedo[0] - 1));
        for (uint32_t i = 0; i < 500 && sigma == 0; i++) {
            const struct imp_key key = imp__key(7, (uint64_t)k, i);
            const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
            struct imp_dirs d = {wo, {0}, IMP_SMOOTH, 0};
            if (!b->ops->sample(b, in, u, &d)) weight = INFINITY;
            b->ops->eval(b, in, &d, &f);
            in[4] = imp__spec(0); /* of all lanes: chances are the lobes' parts */
            b->ops->eval(b, in, &d, &f);
            weight = fmax(weight, fabs(f[1] / b->ops->pdf(b, in, &d) - 1));
            in[4] = b->input[4]->value;
        }
    }
    tap_ok(apart < 1e-4 && white < 1e-14 && weight < 1e-10,
           "roughness %g and %g, sigma_a %g: what is not absorbed leaves # quadrature "
           "%.1e, white %.1e, weights %.1e",
           m, n, sigma, apart, white, weight);
    imp_scene_destroy(s);
}

/* Along the fibre, at the horizon, at total reflection, with extreme numbers: all is finite,
 * not negative, and the density of a draw is not 0. */
static void edges(void)
{
    static const double at[] = {-1, -1e-9, 0, 1e-300, 1e-9, 0.3, 1};
    static const double eta[] = {0.1, 0.7, 1 - 1e-12, 1, 1 + 1e-9, 1.5, 10},
                        rough[] = {0, 0.02, 0.3, 1}, sigma[] = {0, 1e-9, 1, 1e6};
    enum { N = 7 };
    imp_scene *s = scene_of("<bsdf type='hair'/>", IMP_RGB);
    const struct imp_bsdf *b = s->bsdfs[0];
    long bad = 0, lost = 0, n = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        const struct imp_key key = imp__key(11, 0, i);
        double u[12];
        imp_spec in[IMP_INPUTS_MAX], f, df[IMP_INPUTS_MAX];
        for (uint32_t k = 0; k < 12; k++) u[k] = imp__u01(key, k);
        imp_v3 w[2];
        for (int k = 0; k < 2; k++) {
            const int c = (int)(u[k] * N * N * N);
            w[k] = imp__v3(at[c % N], at[c / N % N], at[c / N / N]);
            if (!(imp__length(w[k]) > 1e-200)) w[k] = imp__v3(0, 1, 0);
            w[k] = imp__normalize(w[k]);
        }
        for (int j = 0; j < b->n_in; j++) in[j] = imp__spec(0);
        in[0] = imp__spec(rough[(int)(u[2] * 4)]);
        in[1] = imp__spec(rough[(int)(u[3] * 4)]);
        in[2] = imp__spec(90 * u[4] - 45);
        in[3] = imp__spec(eta[(int)(u[5] * N)]);
        in[4] = imp__spec(sigma[(int)(u[6] * 4)]);
        in[5] = imp__spec(1);
        struct imp_dirs d = {w[0], w[1], IMP_SMOOTH, true};
        double p = b->ops->pdf_eval(b, in, &d, &f);
        bool good = p >= 0 && isfinite(p);
        b->ops->eval_d(b, in, &d, df);
        for (int j = 0; j < b->n_in; j++)
            for (int c = 0; c < 3; c++) good &= isfinite(df[j][c]);
        if (b->ops->sample(b, in, u + 7, &d)) {
            p = b->ops->pdf_eval(b, in, &d, &f);
            good &= p > 0 && fabs(imp__length(d.wi) - 1) < 1e-12;
        } else {
            lost++;
        }
        for (int c = 0; c < 3; c++) good &= f[c] >= 0 && isfinite(f[c]);
        bad += !good;
        n++;
    }
    tap_ok(bad == 0 && lost == 0,
           "edges: finite, and never without a density # %ld of %ld", bad, n);
    imp_scene_destroy(s);
}

/* White fibres in a white room are not seen. */
static void lock(void)
{
    imp_scene *s = scene_of("<bsdf type='hair' id='h'><float name='sigma_a' value='0'/>"
                            "</bsdf>",
                            IMP_RGB);
    imp_film *film;
    struct tap_stat z = {0};
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 24;
    test_must(ctx, imp_render(s, &run, &film));
    const float *mean = imp_film_mean(film);
    for (size_t k = 0; k < 64; k++) tap_add(&z, (double)mean[3 * k]);
    tap_z(&z, 1, 0.02, "a white lock in a white room is not seen");
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

static void pigments(void)
{
    static const char *const materials[] = {
        "<bsdf type='hair'/>",
        "<bsdf type='hair'><rgb name='sigma_a' value='.5821,.9861,1.991'/></bsdf>",
        "<bsdf type='hair'><rgb name='sigma_a' value='.29105,.49305,.9955'/><float "
        "name='scale' value='2'/><string name='int_ior' value='amber'/></bsdf>"};
    imp_spec f[3];
    const struct imp_dirs d = {imp__normalize(imp__v3(0.3, 0.2, 0.8)),
                               imp__normalize(imp__v3(-0.4, 0.1, 0.2)), IMP_SMOOTH,
                               false};
    for (int k = 0; k < 3; k++) {
        imp_scene *s = scene_of(materials[k], IMP_RGB);
        imp_spec in[IMP_INPUTS_MAX];
        for (int j = 0; j < s->bsdfs[0]->n_in; j++) in[j] = s->bsdfs[0]->input[j]->value;
        s->bsdfs[0]->ops->eval(s->bsdfs[0], in, &d, &f[k]);
        imp_scene_destroy(s);
    }
    for (int c = 0; c < 3; c++)
        tap_ok(fabs(f[0][c] / f[1][c] - 1) < 1e-12 && fabs(f[2][c] / f[1][c] - 1) < 1e-12,
               "pigments are their absorption # %g", f[0][c]);
}

static void gradients(const char *material, enum imp_color_mode mode, size_t numbers)
{
    imp_scene *s = scene_of(material, mode);
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    o.paths = 40;
    o.fresh_spp = 32;
    test_check(ctx, p, &o, "gradients on curves");
    tap_ok(imp_problem_n_variables(p) == numbers, "all numbers # %zu",
           imp_problem_n_variables(p));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A walk from a light does not enter a fibre at its back. */
static void from_lights(void)
{
    imp_scene *s = scene_of("<bsdf type='hair'/>", IMP_RGB);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = 1;
    run.from = IMP_FROM_LIGHTS;
    const enum imp_status st = imp_render(s, &run, &film);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "fibre"),
           "light walks are refused # %s", imp_last_error(ctx));
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

static void messages(void)
{
    static const char *const cases[][2] = {
        {"<float name='eumelanin' value='1'/><float name='sigma_a' value='1'/>",
         "it can be one of the two"},
        {"<float name='longitudinal_roughness' value='1.5'/>", "[0.02, 1]"},
        {"<float name='int_ior' value='1'/><float name='ext_ior' value='1'/>", "ior"},
        {"<float name='sigma_a' value='-1'/>", "sigma_a"},
        {"<float name='melanin' value='1'/>", "melanin"}};
    for (size_t k = 0; k < imp_count(cases); k++) {
        char xml[500];
        imp_scene *s = NULL;
        snprintf(xml, sizeof xml,
                 "<scene version='3.0.0'><shape type='sphere'><bsdf type='hair'>%s</bsdf>"
                 "</shape></scene>",
                 cases[k][0]);
        const enum imp_status st =
            imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s);
        tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), "test:1:") &&
                   strstr(imp_last_error(ctx), cases[k][1]),
               "refused # %s", st ? imp_last_error(ctx) : "nothing");
        imp_scene_destroy(s);
    }
}

int main(void)
{
    ctx = test_context(1);
    snprintf(curves, sizeof curves, "hair_%d.txt", (int)getpid());
    FILE *f = fopen(curves, "w");
    if (!f) return 99;
    for (int k = 0; k < 12; k++) {
        for (int j = 0; j < 5; j++)
            fprintf(f, "%g %g %g %g\n", 0.15 * (k - 5.5) + 0.1 * sin(k + j),
                    0.1 * cos(k + j), 0.5 * j - 1.2, 0.06);
        fprintf(f, "\n");
    }
    if (fclose(f) != 0) return 99;
    bessel();
    furnace(0.3, 0.3, 0);
    furnace(0.9, 0.6, 0);
    furnace(0.25, 0.8, 0.7);
    edges();
    lock();
    pigments();
    gradients("<bsdf type='hair' id='h'/>", IMP_RGB, 9);
    gradients("<bsdf type='hair' id='h'><rgb name='sigma_a' value='.2,.5,.9'/></bsdf>",
              IMP_SPECTRAL, 8);
    from_lights();
    messages();
    remove(curves);
    imp_context_destroy(ctx);
    return tap_done();
}
