/* SPDX-License-Identifier: Apache-2.0
 *
 * Normals that a material gives instead of its surface: a `rawconstant` or `srgb` is a map of one
 * normal, in every colour mode. On a diffuse floor under a directional light of irradiance
 * E along the ray to the light w, radiance is
 *
 *     rho/pi E (n' . w) g,    g = 2/(1 + sqrt(1 + A tan^2 w)),   A = min(1, tan^2 n'/8) */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdbool.h>

#define EYE                                                                              \
    "<scene version='3.0.0'><integrator type='path'/>"                                   \
    "<sensor type='orthographic'><transform name='to_world'>"                            \
    "<lookat origin='0,0,2' target='0,0,0' up='0,1,0'/></transform>"                     \
    "<film type='hdrfilm'><integer name='width' value='2'/>"                             \
    "<integer name='height' value='2'/><rfilter type='box'/></film></sensor>"            \
    "<emitter type='directional'><vector name='direction' value='-.48, -.36, -.8'/>"     \
    "<rgb name='irradiance' value='2'/></emitter>"                                       \
    "<shape type='rectangle'><transform name='to_world'><scale value='4'/></transform>"  \
    "<bsdf type='normalmap' id='bent'>%s<bsdf type='diffuse'>"                           \
    "<spectrum name='reflectance' value='.5'/></bsdf></bsdf></shape></scene>"

static const double to_light[3] = {.48, .36, .8};

static double expected(const double c[3])
{
    double n[3], length = 0, cosine = 0;
    for (int k = 0; k < 3; k++) {
        n[k] = 2 * c[k] - 1;
        length += n[k] * n[k];
    }
    for (int k = 0; k < 3; k++) {
        n[k] /= sqrt(length);
        cosine += n[k] * to_light[k];
    }
    const double A = fmin(1, (1 - n[2] * n[2]) / (n[2] * n[2]) / 8);
    const double tan2 = (1 - .64) / .64;
    return .5 / acos(-1) * 2 * cosine * 2 / (1 + sqrt(1 + A * tan2));
}

static imp_scene *scene_of(imp_context *ctx, const char *map, enum imp_color_mode mode)
{
    char xml[4096];
    snprintf(xml, sizeof xml, EYE, map);
    return test_scene_text(ctx, xml, mode);
}

/* In spectral modes a picture of white light is that of its wavelengths, in XYZ: with the same
 * spectra everywhere, pictures are in the ratio of their values. */
static double middle(imp_context *ctx, const char *map, enum imp_color_mode mode)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    imp_scene *scene = scene_of(ctx, map, mode);
    run.spp = 16;
    test_must(ctx, imp_render(scene, &run, &film));
    const double value = imp_film_mean(film)[0];
    imp_film_destroy(film);
    imp_scene_destroy(scene);
    return value;
}

int main(void)
{
    static const struct {
        const char *map;
        double c[3];
    } maps[] = {
        {"<spectrum type='rawconstant' name='normalmap'>"
         "<vector name='value' value='.6, .4, .9'/></spectrum>",
         {.6, .4, .9}},
        {"<spectrum type='rawconstant' name='normalmap'>"
         "<float name='value' value='.8'/></spectrum>",
         {.8, .8, .8}},
        {"<spectrum type='srgb' name='normalmap'>"
         "<rgb name='color' value='.3, .55, .9'/></spectrum>",
         {.3, .55, .9}},
    };
    static const char *const flat = "<spectrum type='rawconstant' name='normalmap'>"
                                    "<vector name='value' value='.5, .5, 1'/></spectrum>";
    static const double up[3] = {.5, .5, 1};
    static const enum imp_color_mode modes[] = {IMP_RGB, IMP_MONO, IMP_SPECTRAL,
                                                IMP_SINGLE};
    imp_context *ctx = test_context(1);
    for (size_t m = 0; m < sizeof modes / sizeof *modes; m++) {
        const double one = middle(ctx, flat, modes[m]) / expected(up);
        if (modes[m] == IMP_RGB || modes[m] == IMP_MONO)
            tap_ok(fabs(one - 1) < 1e-6, "mode %d: up # %.9g", (int)modes[m], one);
        for (size_t k = 0; k < sizeof maps / sizeof *maps; k++) {
            const double v = middle(ctx, maps[k].map, modes[m]) / one;
            const double want = expected(maps[k].c);
            tap_ok(fabs(v - want) < 1e-6 * want, "mode %d: normal %zu # %.9g, %.9g",
                   (int)modes[m], k, v, want);
        }
    }
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char xml[4096];
    imp_scene *scene = NULL;
    snprintf(xml, sizeof xml, EYE, "<rgb name='normalmap' value='.5, .5, 1'/>");
    const enum imp_status st =
        imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &scene);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), "a rawconstant or srgb"),
           "a colour is no normal # %s", imp_last_error(ctx));
    imp_context_destroy(ctx);
    return tap_done();
}
