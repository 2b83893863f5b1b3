/* SPDX-License-Identifier: Apache-2.0
 *
 * What hide_emitters hides, and alpha (docs/scene-format.md 11): a ray straight down on a
 * stack of squares under an orthographic camera. A null square is no surface that was
 * seen: behind it path hides lights as before it, and what has alpha 0 has no radiance;
 * direct has the alpha of the first hit. Expected numbers are those that the rules give
 * by hand (and Mitsuba 3.9.1 gave the same). */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

#define SQUARE(z, inside)                                                                \
    "<shape type='rectangle'><transform name='to_world'><translate z='" z                \
    "'/></transform>" inside "</shape>"
#define VEIL  SQUARE("1", "<bsdf type='null'/>")
#define LAMP  SQUARE("0", "<emitter type='area'/>")
#define FLOOR SQUARE("-1", "<bsdf type='diffuse'/>")
#define SKY   "<emitter type='constant'/>"

static const struct {
    const char *what, *body;
    int max_depth; /* 0: direct */
    struct {
        double grey, alpha;
    } shown, hidden; /* grey -1: anything */
} cases[] = {
    {"sky", SKY, 1, {1, 1}, {0, 0}},
    {"lamp", LAMP, 1, {1, 1}, {0, 0}},
    {"lamp before the sky", LAMP SKY, 1, {1, 1}, {0, 0}},
    {"lamp before a floor", LAMP FLOOR, 2, {1, 1}, {-1, 1}},
    {"veil before the sky", VEIL SKY, 2, {1, 1}, {0, 0}},
    {"the same, longer", VEIL SKY, 3, {1, 1}, {0, 0}},
    {"veil before a lamp", VEIL LAMP, 2, {1, 1}, {0, 0}},
    {"the same, lit lamps being black surfaces", VEIL LAMP, 3, {1, 1}, {1, 1}},
    {"veil before lamp, floor and sky", VEIL LAMP FLOOR SKY, 2, {1, 1}, {0, 0}},
    {"veil before a floor in the dark", VEIL FLOOR, 3, {0, 1}, {0, 1}},
    {"direct, veil before the sky", VEIL SKY, 0, {1, 1}, {1, 1}},
    {"direct, veil before a lamp", VEIL LAMP, 0, {1, 1}, {1, 1}},
};

static imp_context *ctx;

static void look(const char *what, const char *body, int max_depth, bool hide,
                 double grey, double alpha)
{
    char depth[64] = "", xml[2048];
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    if (max_depth)
        snprintf(depth, sizeof depth, "<integer name='max_depth' value='%d'/>",
                 max_depth);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='%s'>%s<boolean "
             "name='hide_emitters' value='%s'/></integrator><sensor type='orthographic'>"
             "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' "
             "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
             "value='2'/><integer name='height' value='2'/><rfilter type='box'/><string "
             "name='pixel_format' value='rgba'/></film></sensor>%s</scene>",
             max_depth ? "path" : "direct", depth, hide ? "true" : "false", body);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    run.spp = 16;
    test_must(ctx, imp_render(scene, &run, &film));
    double worst = 0;
    for (int i = 0; i < 4; i++) {
        const float *p = imp_film_mean(film) + 4 * i;
        for (int c = 0; c < 3 && grey >= 0; c++) worst = fmax(worst, fabs(p[c] - grey));
        worst = fmax(worst, fabs(p[3] - alpha));
    }
    tap_ok(worst < 1e-6, "%s, %s # error %.2g", what, hide ? "hidden" : "shown", worst);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

/* Integrators without light take the property, and it changes nothing. */
static void depth_unchanged(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='depth'><boolean name='hide_emitters' "
        "value='true'/></integrator><sensor type='orthographic'><transform "
        "name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='2'/><integer name='height' "
        "value='2'/></film></sensor>" LAMP FLOOR "</scene>";
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    imp_film *film;
    run.spp = 4;
    test_must(ctx, imp_render(scene, &run, &film));
    tap_near(imp_film_mean(film)[0], 3.99, 1e-5, 0, "depth sees hidden lamps");
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        look(cases[i].what, cases[i].body, cases[i].max_depth, false, cases[i].shown.grey,
             cases[i].shown.alpha);
        look(cases[i].what, cases[i].body, cases[i].max_depth, true, cases[i].hidden.grey,
             cases[i].hidden.alpha);
    }
    depth_unchanged();
    imp_context_destroy(ctx);
    return tap_done();
}
