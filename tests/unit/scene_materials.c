/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials and textures in a scene built by calls: which parameters they make, with
 * which counts, values and bounds. */
#include "imp_tap.h"
#include <importon/importon.h>

static imp_scene *scene;

static void param(const char *name, size_t count, const double *values, double lo,
                  double hi)
{
    size_t index;
    struct imp_param_info info = {.size = sizeof info};
    double v[64];
    if (imp_scene_find_param(scene, name, &index) != IMP_OK ||
        imp_scene_get_param(scene, index, &info) != IMP_OK || info.count > 64 ||
        imp_scene_get_values(scene, index, v) != IMP_OK) {
        tap_ok(0, "%s is a parameter", name);
        return;
    }
    double error = 0;
    for (size_t i = 0; i < count && i < info.count; i++)
        error = fmax(error, fabs(v[i] - values[i]));
    tap_ok(info.count == count && error < 1e-7 && info.lo == lo && info.hi == hi &&
               (info.flags & IMP_PARAM_DIFFERENTIABLE),
           "%s # %zu numbers in [%g, %g], error %.1e", name, info.count, info.lo, info.hi,
           error);
}
static void absent(const char *name)
{
    size_t index;
    tap_ok(imp_scene_find_param(scene, name, &index) == IMP_E_ARG, "%s is no parameter",
           name);
}

int main(void)
{
    imp_context *ctx;
    const struct imp_context_options options = {.size = sizeof options, .threads = 1};
    static const double green[3] = {0.1, 0.7, 0.2};
    static const float texels[8] = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.7f, 0.8f};
    static const double texel_values[8] = {0.1f, 0.2f, 0.3f, 0.4f,
                                           0.5f, 0.6f, 0.7f, 0.8f};

    if (imp_context_create(&options, &ctx) != IMP_OK ||
        imp_scene_create(ctx, NULL, &scene) != IMP_OK)
        return 1;
    imp_scene_begin(scene, "bsdf", "diffuse", "number", NULL);
    imp_scene_float(scene, "reflectance", 0.4);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "diffuse", "color", NULL);
    imp_scene_rgb(scene, "reflectance", green);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "diffuse", "standard", NULL);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "conductor", "copper", NULL);
    imp_scene_string(scene, "material", "Cu");
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "roughconductor", "rough", NULL);
    imp_scene_begin(scene, "texture", "bitmap", NULL, "alpha");
    imp_scene_image(scene, 4, 2, 1, texels);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "roughconductor", "plain", NULL);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "dielectric", "glass", NULL);
    imp_scene_float(scene, "specular_transmittance", 0.9);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "twosided", "sheet", NULL);
    imp_scene_begin(scene, "bsdf", "stam_m2", NULL, NULL);
    imp_scene_float(scene, "exponent", 12);
    imp_scene_end(scene);
    imp_scene_begin(scene, "bsdf", "diffuse", NULL, NULL);
    imp_scene_begin(scene, "texture", "checkerboard", NULL, "reflectance");
    imp_scene_rgb(scene, "color1", green);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_begin(scene, "texture", "checkerboard", "lamps", NULL);
    imp_scene_float(scene, "color0", 5);
    imp_scene_end(scene);
    const enum imp_status st = imp_scene_commit(scene);
    tap_ok(st == IMP_OK, "the scene is made # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));

    param("number.reflectance.value", 1, (double[]){0.4}, 0, 1);
    param("color.reflectance.value", 3, green, 0, 1);
    param("standard.reflectance.value", 1, (double[]){0.5}, 0, 1);
    param("copper.eta.value", 3, (double[]){0.20101, 0.92375, 1.1022}, 0, INFINITY);
    param("copper.k.value", 3, (double[]){3.9133, 2.453, 2.1421}, 0, INFINITY);
    absent("copper.specular_reflectance.value");
    param("rough.eta.value", 1, (double[]){0}, 0, INFINITY);
    param("rough.alpha.data", 8, texel_values, 1e-4, INFINITY);
    absent("rough.alpha_u.value");
    param("plain.alpha.value", 1, (double[]){0.1}, 1e-4, INFINITY);
    param("glass.specular_transmittance.value", 1, (double[]){0.9}, 0, 1);
    absent("glass.specular_reflectance.value");
    param("sheet.brdf_0.exponent.value", 1, (double[]){12}, 0, INFINITY);
    param("sheet.brdf_0.ambient.value", 3, (double[]){0, 0, 0}, 0, INFINITY);
    param("sheet.brdf_1.reflectance.color0.value", 1, (double[]){0.4}, 0, 1);
    param("sheet.brdf_1.reflectance.color1.value", 3, green, 0, 1);
    param("lamps.color0.value", 1, (double[]){5}, 0,
          INFINITY); /* light may be brighter */
    param("lamps.color1.value", 1, (double[]){0.2}, 0, 1);

    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
