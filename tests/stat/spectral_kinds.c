/* SPDX-License-Identifier: Apache-2.0
 *
 * Kinds that were told in three numbers, where walks carry wavelengths. A white ball under
 * a picture of the sky, and coloured materials under a white sky, look as in the mode rgb:
 * with one bounce radiance is linear in the spectra, whose colours are the numbers. Media
 * whose extinction is a spectrum against Beer's law, wavelength by wavelength; asymmetries
 * and roughnesses that are spectra against scenes that have one of their values. */
#include "color/wavelength.h"
#include "imp_merl.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/stat.h"
#include "scene/scene.h"
#include "vol_write.h"
#include "walk/core/walk.h"
#include <unistd.h>

static imp_context *ctx;

static const char *const mode_names[] = {"rgb", "mono", "spectral", "single"};

/* Mean over the picture and its standard error, channel by channel. */
static void means(imp_scene *s, int spp, int channels, struct imp_estimate *out)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_film *f;
    run.spp = spp;
    run.seed = 11;
    run.drop_budget = 1e-12;
    test_must(ctx, imp_render(s, &run, &f));
    imp_film_get_info(f, &info);
    const int pixels = info.width * info.height;
    const float *mean = imp_film_mean(f), *se = imp_film_se(f);
    for (int c = 0; c < channels; c++) {
        double sum = 0, square = 0;
        for (int p = 0; p < pixels; p++) {
            sum += (double)mean[p * channels + c] / pixels;
            square += imp__sqr((double)se[p * channels + c] / pixels);
        }
        out[c] = (struct imp_estimate){.value = sum, .se = sqrt(square)};
    }
    imp_film_destroy(f);
}

/* ---- One bounce: the colours of the mode rgb ------------------------------------------- */

enum subject { SKY, SKY_EQUAL_AREA, GREY_SKY, MERL, PRINCIPLED, THIN, N_SUBJECTS };
static const char *const subject_names[N_SUBJECTS] = {"envmap",      "envmap, equal area",
                                                      "grey envmap", "merl",
                                                      "principled",  "principledthin"};
static char measured[64];

static void sky(imp_scene *s, enum subject what)
{
    enum { W = 6, H = 5 };
    float p[3 * W * H];
    const int channels = what == GREY_SKY ? 1 : 3;
    if (what > GREY_SKY) {
        imp_scene_begin(s, "emitter", "constant", NULL, NULL);
        imp_scene_end(s);
        return;
    }
    for (int k = 0; k < 3 * W * H; k++)
        p[k] = (float)(4 * imp__u01(imp__key(3, 1, 4), (uint32_t)k));
    imp_scene_begin(s, "emitter", "envmap", NULL, NULL);
    imp_scene_image(s, W, H, channels, p);
    imp_scene_float(s, "scale", 0.7);
    imp_scene_float(s, "rotation", 35);
    if (what == SKY_EQUAL_AREA) imp_scene_string(s, "projection", "equal_area");
    imp_scene_end(s);
}

static void ball(imp_scene *s, enum subject what)
{
    static const double base[3] = {.8, .35, .2};
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    switch (what) {
    case MERL:
        imp_scene_begin(s, "bsdf", "merl", NULL, NULL);
        imp_scene_string(s, "filename", measured);
        break;
    case PRINCIPLED:
        imp_scene_begin(s, "bsdf", "principled", NULL, NULL);
        imp_scene_rgb(s, "base_color", base);
        imp_scene_float(s, "metallic", .3);
        imp_scene_float(s, "spec_tint", .7);
        imp_scene_float(s, "sheen", .8);
        imp_scene_float(s, "sheen_tint", .6);
        imp_scene_float(s, "clearcoat", .5);
        imp_scene_float(s, "clearcoat_gloss", .4);
        break;
    case THIN:
        imp_scene_begin(s, "bsdf", "principledthin", NULL, NULL);
        imp_scene_rgb(s, "base_color", base);
        imp_scene_float(s, "spec_trans", .4);
        imp_scene_float(s, "diff_trans", .8);
        imp_scene_float(s, "spec_tint", .7);
        imp_scene_float(s, "sheen", .8);
        imp_scene_float(s, "sheen_tint", .6);
        break;
    case SKY:
    case SKY_EQUAL_AREA:
    case GREY_SKY:
    case N_SUBJECTS:
        imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
        imp_scene_float(s, "reflectance", 1);
    }
    imp_scene_end(s);
    imp_scene_end(s);
}

static imp_scene *one_bounce(enum subject what, enum imp_color_mode mode,
                             enum imp_upsampling upsampling)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    imp_scene *s;
    o.mode = mode;
    o.upsampling = upsampling;
    test_must(ctx, imp_scene_create(ctx, &o, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 2);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", 35);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 8);
    imp_scene_integer(s, "height", 8);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    sky(s, what);
    ball(s, what);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static void like_rgb(enum subject what)
{
    struct imp_estimate rgb[3], seen[3];
    imp_scene *s = one_bounce(what, IMP_RGB, IMP_UPSAMPLING_SIGMOID);
    means(s, 1024, 3, rgb);
    imp_scene_destroy(s);
    for (int k = 0; k < 3; k++) {
        const enum imp_color_mode mode = k == 1 ? IMP_SINGLE : IMP_SPECTRAL;
        double z = 0, relative = 0;
        s = one_bounce(what, mode,
                       k == 2 ? IMP_UPSAMPLING_LINEAR : IMP_UPSAMPLING_SIGMOID);
        means(s, mode == IMP_SINGLE ? 4096 : 1024, 3, seen);
        imp_scene_destroy(s);
        for (int c = 0; c < 3; c++) {
            z = fmax(z,
                     fabs(seen[c].value - rgb[c].value) / hypot(seen[c].se, rgb[c].se));
            relative = fmax(relative, seen[c].se / seen[c].value);
        }
        tap_ok(z < 4 && relative < 0.01, "%s, %s%s: as in rgb # z %.2f, se %.1e",
               subject_names[what], mode_names[mode], k == 2 ? " linear" : "", z,
               relative);
    }
}

/* A map of one colour is that colour of a constant sky, wavelength by wavelength. */
static void constant_map(void)
{
    static const double c[3] = {.3, 2, .7};
    const struct imp_carried carried = {4, {405, 495.5, 580, 700}};
    const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = {.6, 0, -.8}};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    for (int linear = 0; linear < 2; linear++) {
        imp_spec le[2];
        for (int k = 0; k < 2; k++) {
            imp_scene *s;
            float p[3 * 12];
            o.mode = IMP_SPECTRAL;
            o.upsampling = linear ? IMP_UPSAMPLING_LINEAR : IMP_UPSAMPLING_SIGMOID;
            for (int i = 0; i < 36; i++) p[i] = (float)c[i % 3];
            test_must(ctx, imp_scene_create(ctx, &o, &s));
            test_camera(s, 3, 30, 2, 2);
            imp_scene_begin(s, "emitter", k ? "envmap" : "constant", NULL, NULL);
            if (k) imp_scene_image(s, 4, 3, 3, p);
            else imp_scene_rgb(s, "radiance", c);
            imp_scene_end(s);
            test_must(ctx, imp_scene_commit(s));
            le[k] = imp__emitter_radiance(s, 0, &x, (imp_v3){0}, &carried);
            imp_scene_destroy(s);
        }
        double worst = 0;
        for (int j = 0; j < 4; j++) worst = fmax(worst, fabs(le[1][j] / le[0][j] - 1));
        tap_ok(worst < 1e-6, "a map of one colour, %s # %.1e",
               linear ? "linear" : "sigmoid", worst); /* texels are floats */
    }
}

/* ---- Extinction by wavelength --------------------------------------------------------- */

#define CURVES                                                                           \
    "<spectrum name='a' value='410:0,450:.01,490:0'/>"                                   \
    "<spectrum name='b' value='500:0,550:.01,600:0'/>"                                   \
    "<spectrum name='c' value='605:0,650:.01,695:0'/>"                                   \
    "<spectrum name='d' value='380:0,560:.005,760:0'/>"
static const double curve[4][4] = {{410, 450, 490, .01},
                                   {500, 550, 600, .01},
                                   {605, 650, 695, .01},
                                   {380, 560, 760, .005}};

static double curve_at(int c, double nm)
{
    const double *k = curve[c];
    if (nm < k[0] || nm > k[2]) return 0;
    return k[3] * (nm < k[1] ? (nm - k[0]) / (k[1] - k[0]) : (k[2] - nm) / (k[2] - k[1]));
}

static imp_scene *box_scene(const char *medium, const char *light, const char *bsdf,
                            enum imp_color_mode mode, int depth)
{
    char text[4096];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'><integer "
             "name='max_depth' value='%d'/></integrator>%s<sensor type='perspective'>"
             "<float name='fov' value='4'/><transform name='to_world'><lookat "
             "origin='0,0,6' target='0,0,0' up='0,1,0'/></transform><film "
             "type='specfilm'><integer name='width' value='4'/><integer name='height' "
             "value='4'/><rfilter type='box'/>%s</film></sensor><shape type='cube'>"
             "<transform name='to_world'><scale value='.5'/></transform>%s%s</shape>"
             "</scene>",
             depth, light, CURVES, bsdf, medium);
    return test_scene_text(ctx, text, mode);
}

/* T(nm) = exp(-sigma) through the box of length 1. */
static void beer(const char *what, const char *medium, double (*sigma)(double nm))
{
    static const char light[] = "<emitter type='constant'><spectrum name='radiance' "
                                "value='300:1,900:3'/></emitter>";
    double want[4] = {0};
    for (double nm = 380.025; nm < 760; nm += 0.05)
        for (int c = 0; c < 4; c++)
            want[c] +=
                0.05 * curve_at(c, nm) * (1 + 2 * (nm - 300) / 600) * exp(-sigma(nm));
    for (int mode = IMP_SPECTRAL; mode <= IMP_SINGLE; mode++) {
        struct imp_estimate seen[4];
        double z = 0, relative = 0;
        imp_scene *s =
            box_scene(medium, light, "<bsdf type='null'/>", (enum imp_color_mode)mode, 8);
        means(s, 16384, 4, seen);
        imp_scene_destroy(s);
        for (int c = 0; c < 4; c++) {
            z = fmax(z, fabs(seen[c].value - want[c]) / seen[c].se);
            relative = fmax(relative, seen[c].se / want[c]);
        }
        tap_ok(z < 4 && relative < 0.03, "%s, %s: Beer's law # z %.2f, se %.1e", what,
               mode_names[mode], z, relative);
    }
}

/* A line that no colour in rgb shows the height of. */
#define LINE "300:.2,520:.2,530:6,540:.2,900:.2"
static double line(double nm)
{
    const double off = fabs(nm - 530);
    return off < 10 ? 6 - off * .58 : .2;
}
static const float cell[3] = {.2f, 1.5f, .4f};
static double lifted(double nm)
{
    static struct imp__lifted l;
    const double rgb[3] = {cell[0], cell[1], cell[2]};
    if (l.scale == 0) imp__lift_unbounded(rgb, &l);
    return imp__lifted_value(&l, nm);
}

static void extinctions(void)
{
    char grid[64], medium[1024];
    beer("homogeneous",
         "<medium type='homogeneous' name='interior'><spectrum name='sigma_t' "
         "value='" LINE "'/><float name='albedo' value='0'/></medium>",
         line);
#define PLACE                                                                            \
    "<transform name='to_world'><translate x='-.5' y='-.5' z='-.5'/></transform>"
    beer("heterogeneous, constvolume",
         "<medium type='heterogeneous' name='interior'><volume type='constvolume' "
         "name='sigma_t'><spectrum name='value' value='" LINE "'/>" PLACE
         "</volume><float name='albedo' value='0'/></medium>",
         line);
    vol_write(grid, 1, 1, 1, 3, cell);
    snprintf(medium, sizeof medium,
             "<medium type='heterogeneous' name='interior'><volume type='gridvolume' "
             "name='sigma_t'><string name='filename' value='%s'/>" PLACE
             "</volume><float name='albedo' value='0'/></medium>",
             grid);
    beer("heterogeneous, three channels", medium, lifted);
    unlink(grid);
}

/* ---- Shapes by wavelength ------------------------------------------------------------- */

/* One value below 495 nm, another above 600 nm. */
static void shapes(const char *what, const char *format, const char *values,
                   const char *first, const char *second, bool medium)
{
    static const char light[] = "<emitter type='point'><point name='position' "
                                "value='1.5,.8,2.5'/><spectrum name='intensity' "
                                "value='300:1,900:1'/></emitter>";
    char text[1024], value[256];
    struct imp_estimate seen[3][4];
    for (int mode = IMP_SPECTRAL; mode <= IMP_SINGLE; mode++) {
        for (int k = 0; k < 3; k++) {
            if (k == 0)
                snprintf(value, sizeof value, "<spectrum name='%s' value='%s'/>", "%s",
                         values);
            else
                snprintf(value, sizeof value, "<float name='%s' value='%s'/>", "%s",
                         k == 1 ? first : second);
            char property[256];
            const char *hole = strstr(value, "%s");
            snprintf(property, sizeof property, "%.*s%s%s", (int)(hole - value), value,
                     medium ? "g" : "alpha", hole + 2);
            snprintf(text, sizeof text, format, property);
            imp_scene *s = box_scene(medium ? text : "", light,
                                     medium ? "<bsdf type='null'/>" : text,
                                     (enum imp_color_mode)mode, 6);
            means(s, mode == IMP_SINGLE ? 16384 : 4096, 4, seen[k]);
            imp_scene_destroy(s);
        }
        const double z[2] = {
            (seen[0][0].value - seen[1][0].value) / hypot(seen[0][0].se, seen[1][0].se),
            (seen[0][2].value - seen[2][2].value) / hypot(seen[0][2].se, seen[2][2].se)};
        const double apart = fabs(seen[1][0].value / seen[2][0].value - 1);
        tap_ok(fabs(z[0]) < 4 && fabs(z[1]) < 4 && apart > 0.2 &&
                   seen[0][0].se < 0.03 * seen[0][0].value,
               "%s, %s # z %.2f, %.2f; the two values differ by %.0f %%", what,
               mode_names[mode], z[0], z[1], 100 * apart);
    }
}

int main(void)
{
    ctx = test_context(0);
    snprintf(measured, sizeof measured, "spectral_kinds_%d.binary", (int)getpid());
    if (!merl_write(measured, 20, 10, 12,
                    &(struct merl_model){0.4, 0.6, {0.8, 0.4, 0.3}}))
        return 1;
    for (int what = 0; what < N_SUBJECTS; what++) like_rgb((enum subject)what);
    remove(measured);
    constant_map();
    extinctions();
    shapes("asymmetry g",
           "<medium type='homogeneous' name='interior'><float name='sigma_t' value='1'/>"
           "<float name='albedo' value='.9'/><phase type='hg'>%s</phase></medium>",
           "300:.7,495:.7,600:-.4,900:-.4", ".7", "-.4", true);
    shapes("roughness",
           "<bsdf type='roughconductor'><string name='material' value='Al'/>%s</bsdf>",
           "300:.5,495:.5,600:.25,900:.25", ".5", ".25", false);
    imp_context_destroy(ctx);
    return tap_done();
}
