/* SPDX-License-Identifier: Apache-2.0
 *
 * Measurements converge by themselves, whatever the camera sees: direct light of facing
 * and of perpendicular rectangles against closed forms, near and far, and a furnace whose
 * camera looks away. */
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

int main(void)
{
    imp_context *ctx = test_context(2);
    closed_forms(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
