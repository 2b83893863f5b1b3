/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured materials: analytic ones written as MERL files and read again, value by value
 * and by albedo; draws against uniform ones and against the cosine's; files that are
 * refused; a scale back from a picture. (bsdf_sampling has the density, bsdf_derivatives
 * the derivative.) */
#include "imp_check_rows.h"
#include "imp_merl.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/bsdf/merl.h"
#include "math/rng.h"
#include "math/sphere_cells.h"
#include "math/warp.h"
#include "scene/scene.h"
#include <unistd.h>

static imp_context *ctx;
static char file[64];

static imp_scene *scene_of(enum imp_color_mode mode, const char *integrator)
{
    char xml[1500];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='%s'/>"
             "<sensor type='perspective'><float name='fov' value='30'/>"
             "<transform name='to_world'><lookat origin='0,-2,4' target='0,0,0' "
             "up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' "
             "value='8'/><integer name='height' value='8'/><rfilter type='box'/></film>"
             "</sensor><emitter type='constant'/><shape type='sphere'>"
             "<bsdf type='merl' id='m'><string name='filename' value='%s'/></bsdf>"
             "</shape></scene>",
             integrator, file);
    return test_scene_text(ctx, xml, mode);
}

static const struct merl_model models[] = {
    {0, 1, {0.7, 0.5, 0.2}}, {0.1, 0, {0.9, 0.8, 0.7}}, {0.3, 0.5, {0.6, 0.4, 0.9}}};
static const char *const names[] = {"Lambert", "GGX 0.1", "GGX 0.3 and Lambert"};

static imp_v3 upwards(uint64_t seed, uint32_t k)
{
    const struct imp_key key = imp__key(seed, 1, k);
    return imp__cosine_hemisphere((double[2]){imp__u01(key, 0), imp__u01(key, 1)});
}

/* The cell in which two directions are, and how far the model goes in it. */
static double range_in_cell(const struct imp_merl_data *t, const struct merl_model *m,
                            imp_v3 wo, imp_v3 wi)
{
    const imp_v3 h = imp__normalize(wo + wi);
    const double theta_d = acos(fmin(1, imp__dot(h, wi)));
    const imp_v3 n = imp__v3(0, 0, 1), across = imp__normalize(imp__cross(n, h)),
                 along = imp__cross(across, h);
    double phi = atan2(imp__dot(wi, across), imp__dot(wi, along));
    if (phi < 0) phi += IMP_PI;
    const double i = floor(t->n_half * sqrt(acos(h[2]) / (IMP_PI / 2))),
                 j = floor(t->n_difference * theta_d / (IMP_PI / 2)),
                 k = floor(t->n_azimuth * phi / IMP_PI);
    double lo = INFINITY, hi = 0;
    for (int c = 0; c < 125; c++) {
        const double x = (i + 0.25 * (c % 5)) / t->n_half;
        imp_v3 a, b;
        double rho[3] = {0};
        merl_directions(x * x * IMP_PI / 2,
                        (j + 0.25 * (c / 5 % 5)) / t->n_difference * IMP_PI / 2,
                        (k + 0.25 * (c / 25)) / t->n_azimuth * IMP_PI, &a, &b);
        if (a[2] > 0 && b[2] > 0) merl_model_rho(m, a, b, rho);
        lo = fmin(lo, rho[0]);
        hi = fmax(hi, rho[0]);
    }
    return hi - lo;
}

struct point {
    const struct imp_bsdf *b;
    const struct merl_model *m;
    const imp_spec *in;
    imp_v3 wo;
};
static double table_value(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {p->wo, wi, IMP_SMOOTH, 0};
    imp_spec f;
    p->b->ops->eval(p->b, p->in, &d, &f);
    return f[0];
}
static double model_value(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    double rho[3];
    if (!(wi[2] > 0)) return 0;
    merl_model_rho(p->m, p->wo, wi, rho);
    return rho[0] * wi[2];
}

static void model(int k)
{
    const struct merl_model *m = &models[k];
    if (!merl_write(file, 90, 90, 180, m)) {
        tap_ok(0, "%s: written", names[k]);
        return;
    }
    struct stat_of {
        struct tap_stat own, cosine, uniform;
    } s;
    imp_scene *scene = scene_of(IMP_RGB, "path");
    const struct imp_bsdf *b = scene->bsdfs[0];
    imp_spec in[4], f;
    for (int j = 0; j < 4; j++) in[j] = b->input[j]->value;
    tap_ok(b->n_in == 4 && in[1][0] == 1 && in[1][1] == 0 && in[3][2] == 1,
           "%s: three planes of their own colours", names[k]);

    double worst = 0, middle = 0;
    const struct imp_merl_data *t = scene->root->children[0].node->merl;
    for (size_t i = 0; !t; i++) { /* of the shape's bsdf */
        const struct imp_node *shape = scene->root->children[i].node;
        for (size_t c = 0; c < shape->n_children && !t; c++)
            t = shape->children[c].node->merl;
    }
    for (uint32_t i = 0; i < 20000; i++) {
        const imp_v3 wo = upwards(1, i), wi = upwards(2, i);
        double rho[3];
        const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0};
        merl_model_rho(m, wo, wi, rho);
        b->ops->eval(b, in, &d, &f);
        const double range = range_in_cell(t, m, wo, wi);
        worst = fmax(worst, fabs(f[0] / wi[2] - rho[0]) / (range + 1e-6 * rho[0]));
    }
    for (int i = 0; i < 90; i += 3) { /* in the middle of cells: exactly */
        imp_v3 wo, wi;
        double rho[3];
        const double x = (i + 0.5) / 90;
        merl_directions(x * x * IMP_PI / 2, 20.5 / 180 * IMP_PI, 31.5 / 180 * IMP_PI, &wo,
                        &wi);
        if (!(wo[2] > 0 && wi[2] > 0)) continue;
        merl_model_rho(m, wo, wi, rho);
        const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0};
        b->ops->eval(b, in, &d, &f);
        for (int c = 0; c < 3; c++)
            middle = fmax(middle, fabs(f[c] / wi[2] / rho[c] - 1));
    }
    tap_ok(worst <= 1 && middle < 1e-6,
           "%s: read as written, within a cell # %.2f cells, %.1e in the middle",
           names[k], worst, middle);

    for (int angle = 0; angle <= 75; angle += 25) {
        const double theta = angle * IMP_PI / 180;
        struct point p = {b, m, in,
                          imp__v3(0.6 * sin(theta), 0.8 * sin(theta), cos(theta))};
        const double exact = imp__sphere_integral(model_value, &p, 0, 1, 1e-6, 3);
        const double albedo = imp__sphere_integral(table_value, &p, 0, 1, 1e-6, 3);
        tap_near(albedo, exact, 5e-3, 0, "albedo of the table and of the model");
        memset(&s, 0, sizeof s);
        for (uint32_t i = 0; i < 60000; i++) {
            const struct imp_key key = imp__key(7, (uint64_t)angle, i);
            const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
            struct imp_dirs d = {p.wo, {0}, IMP_SMOOTH, 0};
            double value = 0;
            if (b->ops->sample(b, in, u, &d)) {
                b->ops->eval(b, in, &d, &f);
                value = f[0] / b->ops->pdf(b, in, &d);
            }
            tap_add(&s.own, value);
            d.wi = imp__cosine_hemisphere(u);
            b->ops->eval(b, in, &d, &f);
            tap_add(&s.cosine, f[0] * IMP_PI / d.wi[2]);
            d.wi = imp__uniform_sphere(u);
            b->ops->eval(b, in, &d, &f);
            tap_add(&s.uniform, f[0] * 4 * IMP_PI);
        }
        tap_z(&s.own, albedo, 0.02, "albedo by its own draws");
        printf("# relative variance %.3g, of the cosine %.3g\n",
               s.own.m2 / s.own.n / (albedo * albedo),
               s.cosine.m2 / s.own.n / (albedo * albedo));
        tap_z(&s.uniform, albedo, 0.2, "and by uniform ones");
        if (k == 1)
            tap_ok(s.own.m2 < 0.5 * s.cosine.m2,
                   "%s at %d degrees: variance over the cosine's # %.4f", names[k], angle,
                   s.own.m2 / s.cosine.m2);
    }
    imp_scene_destroy(scene);
}

/* In mono the planes are luminances; a picture's scale has its derivative. */
static void modes(void)
{
    imp_scene *s = scene_of(IMP_MONO, "path");
    const struct imp_bsdf *b = s->bsdfs[0];
    double sum = 0;
    for (int j = 1; j < 4; j++) sum += b->input[j]->value[0];
    tap_near(sum, 1, 1e-12, 0, "mono: the planes' luminances");
    imp_scene_destroy(s);

    s = scene_of(IMP_RGB, "path");
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    o.paths = 200;
    o.fresh_spp = 256;
    test_check(ctx, p, &o, "gradients of scale and sky");
    tap_ok(imp_problem_n_variables(p) == 4, "all numbers # %zu",
           imp_problem_n_variables(p));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void refused(const void *bytes, size_t n, const char *message)
{
    char xml[400];
    imp_scene *s = NULL;
    FILE *f = fopen(file, "wb");
    fwrite(bytes, 1, n, f);
    fclose(f);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><shape type='sphere'><bsdf type='merl'>"
             "<string name='filename' value='%s'/></bsdf></shape></scene>",
             file);
    const enum imp_status st =
        imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), message) &&
               strstr(imp_last_error(ctx), "test:1:"),
           "refused: %s # %s", message, st ? imp_last_error(ctx) : "nothing");
    imp_scene_destroy(s);
}

static void refusals(void)
{
    struct {
        int32_t n[3];
        double number[24];
    } __attribute__((packed)) t = {{2, 2, 2}, {1}};
    refused("", 0, "no measured material");
    refused(&t, 11, "11 bytes");
    refused(&t, sizeof t - 1, "203 bytes");
    t.n[0] = -90;
    refused(&t, sizeof t, "-90 x 2 x 2");
    t.n[0] = 4000, t.n[1] = 4000, t.n[2] = 4000;
    refused(&t, sizeof t, "4000 x 4000 x 4000");
    t.n[0] = t.n[1] = t.n[2] = 2;
    t.number[13] = NAN;
    refused(&t, sizeof t, "number 5 of plane 1 is nan");
}

int main(void)
{
    ctx = test_context(1);
    snprintf(file, sizeof file, "measured_%d.binary", (int)getpid());
    for (int k = 0; k < 3; k++) model(k);
    modes();
    refusals();
    remove(file);
    imp_context_destroy(ctx);
    return tap_done();
}
