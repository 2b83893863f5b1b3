/* SPDX-License-Identifier: Apache-2.0
 *
 * Measurements converge by themselves, whatever the camera sees: direct light of facing
 * and of perpendicular rectangles against closed forms, near and far, and a furnace whose
 * camera looks away. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"

/* The camera looks at nothing. `desk` is the unit square at z = 0, facing +z; its lamp is
 * placed by `lamp`. */
static const char *const text =
    "<scene version='3.0.0'>"
    "<sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,0,-4' target='0,0,-9' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/></film></sensor>"
    "<shape type='rectangle' id='desk'><transform name='to_world'><scale value='0.5'/>"
    "</transform><bsdf type='diffuse'><float name='reflectance' value='%g'/></bsdf>"
    "</shape>"
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale value='0.5'/>"
    "%s</transform><bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf>"
    "<emitter type='area'><float name='radiance' value='1'/></emitter></shape></scene>";

/* Form factor of two equal, parallel, directly opposed squares of side 1 at distance d,
 * and of two that share an edge at a right angle (Hottel 1931; Howell, catalogue of view
 * factors, C-11 and C-14). */
static double opposed(double d)
{
    const double x = 1 / d, q = sqrt(1 + x * x);
    return 2 / (IMP_PI * x * x) *
           (log(sqrt(q * q * q * q / (1 + 2 * x * x))) + 2 * x * q * atan(x / q) -
            2 * x * atan(x));
}
static double adjacent(void)
{
    const double s = sqrt(2);
    return (2 * atan(1) - s * atan(1 / s) + log(0.75) / 4) / IMP_PI;
}

static double lux(imp_context *ctx, const char *lamp, double rho, double eps,
                  struct imp_elements_info *info)
{
    const struct imp_elements_source desk = {
        .size = sizeof desk, .kind = IMP_ELEMENTS_SHAPE, .shape = "desk"};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    char xml[2048];
    imp_elements *e;
    snprintf(xml, sizeof xml, text, rho, lamp);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    o.sources = &desk, o.n_sources = 1;
    o.stop = 1e-8, o.eps_last = eps;
    o.picture = rho > 0; /* a black picture stands still at once */
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    info->size = sizeof *info;
    test_must(ctx, imp_elements_get_info(e, info));
    const double measure = info->measure;
    imp_elements_destroy(e);
    imp_scene_destroy(s);
    return measure;
}

static void closed_forms(imp_context *ctx)
{
    static const double distance[] = {0.05, 0.25, 1, 4, 30};
    struct imp_elements_info info;
    char lamp[256], name[128];
    for (size_t k = 0; k < imp_count(distance); k++) {
        const double d = distance[k];
        snprintf(lamp, sizeof lamp, "<rotate x='1' angle='180'/><translate z='%.17g'/>",
                 d);
        snprintf(name, sizeof name, "facing squares at distance %g", d);
        tap_near(lux(ctx, lamp, 0, 1e-5, &info), IMP_PI * opposed(d), 1e-5, 0, name);
        printf("# %zu links: %s\n", info.links, info.reason);
    }
    snprintf(lamp, sizeof lamp,
             "<rotate y='1' angle='90'/><translate x='-0.5' z='0.5'/>");
    tap_near(lux(ctx, lamp, 0, 1e-5, &info), IMP_PI * adjacent(), 1e-4, 0,
             "squares that share an edge");
    printf("# %zu links: %s\n", info.links, info.reason);
    snprintf(lamp, sizeof lamp, "<rotate x='1' angle='180'/><translate z='1'/>");
    tap_near(lux(ctx, lamp, 0.7, 1e-4, &info), IMP_PI * opposed(1), 1e-5, 0,
             "a camera that looks away does not stop it");
    printf("# %zu links: %s\n", info.links, info.reason);
}

/* ---- The mean of a picture ------------------------------------------------------ */

/* In rgb a camera measures the mean of the channels, as `gradient` does, and luminance by
 * its name; each source is told by itself. The flat picture has the same rays. */
static void means(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    struct imp_elements_info info = {.size = sizeof info};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e;
    imp_film *f;
    double mean = 0, luminance = 0;
    o.eps_last = 5e-3;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_get_info(e, &info));
    test_must(ctx, imp_elements_image(e, 0, IMP_ELEMENTS_FLAT, 0, &f));
    for (size_t k = 0; k < 256; k++)
        for (size_t c = 0; c < 3; c++) {
            mean += (double)f->mean[3 * k + c] / 3 / 256;
            luminance += e->lum[c] * (double)f->mean[3 * k + c] / 256;
        }
    tap_near(info.measure, mean, 1e-6, 0, "the measure is the picture's mean");
    tap_near(info.luminance, luminance, 1e-6, 0, "its luminance, by name");
    tap_near(info.measure_adjoint, mean, 1e-5, 0, "the mean from the lights");
    imp_film_destroy(f);
    imp_elements_destroy(e);

    const struct imp_elements_source three[3] = {
        {.size = sizeof *three,
         .weight = 2,
         .kind = IMP_ELEMENTS_SHAPE,
         .shape = "floor"},
        {.size = sizeof *three, .region = {2, 3, 9, 12}},
        {.size = sizeof *three,
         .kind = IMP_ELEMENTS_PLANE,
         .weight = -0.5,
         .origin = {100, 100, 100},
         .edge_u = {0, 0, 200},
         .edge_v = {300, 0, 0}}};
    o.sources = three, o.n_sources = 3;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_get_info(e, &info));
    const double *J = info.measures;
    tap_ok(info.n_measures == 3 &&
               fabs(2 * J[0] + J[1] - 0.5 * J[2] - info.measure) < 1e-12 * info.measure,
           "measurements by themselves # %g, %g, %g: %g", J[0], J[1], J[2], info.measure);
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* ---- Through a meter --------------------------------------------------------------- */

/* An irradiancemeter on one of two facing squares looks in all directions: its reading is
 * pi times the form factor to the lamp, plus what goes to and fro between them. */
static void meter(imp_context *ctx)
{
    static const char *const facing =
        "<scene version='3.0.0'><shape type='rectangle' id='desk'><transform "
        "name='to_world'><scale value='0.5'/></transform><bsdf type='diffuse'>"
        "<float name='reflectance' value='%g'/></bsdf><sensor type='irradiancemeter'>"
        "<film type='hdrfilm'><integer name='width' value='%d'/>"
        "<integer name='height' value='1'/><rfilter type='box'/></film></sensor></shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'>"
        "<scale value='0.5'/><rotate x='1' angle='180'/><translate z='1'/></transform>"
        "<bsdf type='diffuse'><float name='reflectance' value='%g'/></bsdf>"
        "<emitter type='area'><float name='radiance' value='1'/></emitter></shape>"
        "</scene>";
    const double F = opposed(1);
    for (int pixels = 1; pixels <= 4; pixels += 3)
        for (int k = 0; k < 2; k++) {
            const double rho = k ? 0.8 : 0;
            const struct imp_elements_source desk = {
                .size = sizeof desk, .kind = IMP_ELEMENTS_SHAPE, .shape = "desk"};
            struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
            struct imp_elements_info info = {.size = sizeof info};
            double lux = 0, mean = 0;
            char xml[2048];
            snprintf(xml, sizeof xml, facing, rho, pixels, rho);
            imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
            for (int by = 0; by < 2; by++) {
                imp_elements *e;
                imp_film *f;
                o.sources = by ? &desk : NULL, o.n_sources = by ? 1 : 0;
                o.eps_last = 1e-4, o.stop = 1e-4;
                test_must(ctx, imp_elements_create(s, &o, &e));
                test_must(ctx, imp_elements_solve(e));
                test_must(ctx, imp_elements_get_info(e, &info));
                if (by) lux = info.measure;
                if (!by) {
                    mean = info.measure;
                    test_must(ctx, imp_elements_image(e, 0, IMP_ELEMENTS_FLAT, 0, &f));
                    double sum = 0;
                    for (int p = 0; p < pixels; p++) sum += (double)f->mean[p] / pixels;
                    tap_near(sum, mean, 1e-6, 0, "the meter's picture has its reading");
                    tap_near(info.measure_adjoint, mean, 1e-5, 0, "... from the lights");
                    imp_film_destroy(f);
                }
                imp_elements_destroy(e);
            }
            tap_near(mean, lux, 5e-3, 0, "a meter reads the illuminance of its shape");
            if (k == 0) tap_near(mean, IMP_PI * F, 5e-3, 0, "... which is known");
            imp_scene_destroy(s);
        }
}

/* ---- Errors of shares ----------------------------------------------------------- */

/* Scene d: the lamp behind the eye comes by the glossy walls alone, and its share swings
 * with the directional order. */
static void shares(imp_context *ctx)
{
    static const struct imp_elements_phong glossy = {
        sizeof glossy, "*", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15};
    static const struct imp_elements_beam beams[4] = {
        {sizeof *beams, "light_left", {0}, 20},
        {sizeof *beams, "light_right", {0}, 20},
        {sizeof *beams, "light_ceiling", {0}, 20},
        {sizeof *beams, "light_back", {0}, 20}};
    imp_scene *s = test_scene(ctx, "elements/d.xml", IMP_MONO, "res=16");
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    const struct imp_elements_row *rows;
    double share[2][4] = {{0}}, error[4] = {0}, sum = 0;
    size_t n;
    o.stop = -1, o.eps_last = 1e-3;
    o.phong = &glossy, o.n_phong = 1;
    o.beams = beams, o.n_beams = 4;
    for (int k = 0; k < 2; k++) {
        imp_elements *e;
        o.order = k ? 6 : 8;
        test_must(ctx, imp_elements_create(s, &o, &e));
        test_must(ctx, imp_elements_solve(e));
        test_must(ctx, k ? imp_elements_sensitivity(e, &rows, &n)
                         : imp_elements_share_errors(e, &rows, &n));
        for (size_t i = 0; i < n; i++)
            for (int b = 0; b < 4; b++) {
                const size_t m = strlen(beams[b].shape);
                if (!rows[i].emission || strncmp(rows[i].name, beams[b].shape, m) != 0)
                    continue;
                share[k][b] = rows[i].share;
                if (k == 0) error[b] = rows[i].share_error;
            }
        imp_elements_destroy(e);
    }
    for (int b = 0; b < 4; b++) {
        printf("# %s: order 8 %.5f, 6 %.5f, error %.5f\n", beams[b].shape, share[0][b],
               share[1][b], error[b]);
        sum += fabs(fabs(share[0][b] - share[1][b]) - error[b]);
    }
    tap_ok(error[3] > 0.05 * share[0][3], "the back lamp's share has an error # %g of %g",
           error[3], share[0][3]);
    /* Those were refined by themselves, the errors are on one mesh. */
    tap_ok(sum < 0.01, "as two solutions differ # by %.1e", sum);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(2);
    closed_forms(ctx);
    means(ctx);
    meter(ctx);
    shares(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
