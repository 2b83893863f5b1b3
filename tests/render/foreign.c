/* SPDX-License-Identifier: Apache-2.0
 *
 * Mitsuba's own test scenes against Mitsuba's own references, with the z-test that
 * `importon compare --variance` makes: the orthographic sensor, also in spectra, and
 * spheres of many materials and media, in rgb and, in the long run, in mono and spectra. The
 * pictures are not ours to copy: IMP_SHARED names the folder that holds `mitsuba-scenes`; without it the test is skipped. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

#define REFERENCE_SPP 32000

static void agrees(imp_context *ctx, const char *folder, const char *scene_file,
                   const char *reference_stem, enum imp_color_mode mode, double brighter)
{
    const char *suffix = mode == IMP_MONO       ? "mono"
                         : mode == IMP_SPECTRAL ? "spectral"
                                                : "rgb";
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    struct imp_compare_options options = IMP_COMPARE_OPTIONS_INIT;
    struct imp_compare_result r = {.size = sizeof r};
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene;
    imp_film *film, *reference, *variance;
    char path[1024];

    load.mode = mode;
    snprintf(path, sizeof path, "%s/%s", folder, scene_file);
    test_must(ctx, imp_scene_load(ctx, path, &load, &scene));
    snprintf(path, sizeof path, "%s/refs/%s_ref_%s.exr", folder, reference_stem, suffix);
    test_must(ctx, imp_film_read(ctx, path, &reference));
    snprintf(path, sizeof path, "%s/refs/%s_ref_%s_var.exr", folder, reference_stem,
             suffix);
    test_must(ctx, imp_film_read(ctx, path, &variance));
    imp_film_get_info(reference, &info);
    run.spp = (int)(2e6 / (info.width * info.height)); /* docs/scene-format.md 14 */
    run.seed = 11;
    test_must(ctx, imp_render(scene, &run, &film));
    options.variance = variance;
    options.n_test = run.spp;
    options.n_reference = REFERENCE_SPP;
    options.xyz = 1;
    test_must(ctx, imp_compare(ctx, film, reference, &options, &r));
    tap_ok(r.agree, "%s, %s # means %.6g and %.6g, z %.2f, failing %.4f, |z| > 2 %.4f",
           scene_file, suffix, r.mean_a, r.mean_b, r.mean_z, r.p_fail_fraction, r.over2);

    /* The test can fail: a brighter picture does not agree. */
    imp_film_get_info(film, &info);
    for (long k = 0; k < (long)info.width * info.height * info.channels; k++)
        imp_film_mean(film)[k] *= (float)brighter;
    test_must(ctx, imp_compare(ctx, film, reference, &options, &r));
    tap_ok(!r.agree, "%g times as bright is caught # z %.2f", brighter, r.mean_z);
    imp_film_destroy(film);
    imp_film_destroy(reference);
    imp_film_destroy(variance);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool lengthy = argc > 1 && strcmp(argv[1], "long") == 0;
    const char *shared = getenv("IMP_SHARED");
    char folder[900];
    if (!shared) {
        tap_skip("Mitsuba's test scenes", "IMP_SHARED is not set");
        return tap_done();
    }
    imp_context *ctx = test_context(0);
    snprintf(folder, sizeof folder, "%s/mitsuba-scenes/tests/scenes/orthographic_sensor",
             shared);
    agrees(ctx, folder, "test_orthographic_path.xml", "test_orthographic", IMP_RGB,
           1.005);
    agrees(ctx, folder, "test_orthographic_path.xml", "test_orthographic", IMP_MONO,
           1.005);
    agrees(ctx, folder, "test_orthographic_path.xml", "test_orthographic", IMP_SPECTRAL,
           1.005);
    snprintf(folder, sizeof folder, "%s/mitsuba-scenes/tests/scenes/bsdf_spheres",
             shared);
    static const char *const spheres[] = {"roughplastic_linear", "textured_diffuse",
                                          "arealight", "constant"};
    for (size_t k = 0; k < sizeof spheres / sizeof *spheres; k++) {
        char scene_file[64], stem[64];
        snprintf(scene_file, sizeof scene_file, "test_%s_path.xml", spheres[k]);
        snprintf(stem, sizeof stem, "test_%s", spheres[k]);
        /* Diamonds under a small lamp are noisy. */
        const double brighter = strcmp(spheres[k], "arealight") ? 1.02 : 1.06;
        agrees(ctx, folder, scene_file, stem, IMP_RGB, brighter);
        if (lengthy) agrees(ctx, folder, scene_file, stem, IMP_MONO, brighter);
        if (lengthy) agrees(ctx, folder, scene_file, stem, IMP_SPECTRAL, brighter);
    }
    snprintf(folder, sizeof folder, "%s/mitsuba-scenes/tests/scenes/participating_media",
             shared);
    agrees(ctx, folder, "test_hetero_sigmat_volpath.xml", "test_hetero_sigmat", IMP_RGB,
           1.005);
    agrees(ctx, folder, "test_homo_area_light_volpath.xml", "test_homo_area_light",
           IMP_RGB, 1.03);
    if (lengthy) { /* the first by wavelengths: docs/mitsuba.md says why it differs */
        agrees(ctx, folder, "test_hetero_sigmat_volpath.xml", "test_hetero_sigmat",
               IMP_MONO, 1.005);
        agrees(ctx, folder, "test_homo_area_light_volpath.xml", "test_homo_area_light",
               IMP_MONO, 1.03);
        agrees(ctx, folder, "test_homo_area_light_volpath.xml", "test_homo_area_light",
               IMP_SPECTRAL, 1.03);
    }
    imp_context_destroy(ctx);
    return tap_done();
}
