/* SPDX-License-Identifier: Apache-2.0
 *
 * Dispersion. Walks through a prism of N-BK7 leave it along the directions that Snell's
 * law and Sellmeier's formula give; a slab of glass between diffuse walls of light has the
 * same colour by one wavelength a walk and by four, three of which end where light bends;
 * so have rough facets whose roughness depends on the wavelength. */
#include "color/color_tables.h"
#include "color/spectrum.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/core/segment.h"
#include "walk/core/walk.h"
#include "walk/core/walk_integrator.h"
#include <math.h>

static imp_context *ctx;

#define PI 3.14159265358979323846
#define PRISM                                                                            \
    "<integrator type='path'><integer name='max_depth' value='8'/></integrator>"         \
    "<emitter type='constant'/>"                                                         \
    "<bsdf type='dielectric' id='glass'>%s<float name='ext_ior' value='1'/></bsdf>"      \
    "<sensor type='orthographic'><transform name='to_world'>"                            \
    "<scale x='1e-4' y='1e-4'/><lookat origin='%.17g,%.17g,0' target='0,0,0' "           \
    "up='0,0,1'/>"                                                                       \
    "</transform><film type='hdrfilm'><integer name='width' value='1'/>"                 \
    "<integer name='height' value='1'/><rfilter type='box'/></film></sensor>"

/* An edge along z at the top, the base below: apex angle 60 degrees. */
static imp_scene *prism(const char *index, const double from[2], enum imp_color_mode mode)
{
    static const float p[18] = {-.5f, -.28867513f, -1, .5f,  -.28867513f, -1,
                                0,    .57735027f,  -1, -.5f, -.28867513f, 1,
                                .5f,  -.28867513f, 1,  0,    .57735027f,  1};
    static const uint32_t t[24] = {0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3,
                                   1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5};
    char text[2048];
    snprintf(text, sizeof text, PRISM, index, from[0], from[1]);
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s;
    o.mode = mode;
    FILE *f = fopen("prism_test.ply", "w");
    if (!f) exit(99);
    fprintf(f,
            "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float "
            "y\nproperty float z\nelement face 8\nproperty list uchar int "
            "vertex_indices\nend_header\n");
    for (int k = 0; k < 6; k++)
        fprintf(f, "%.9g %.9g %.9g\n", p[3 * k], p[3 * k + 1], p[3 * k + 2]);
    for (int k = 0; k < 8; k++)
        fprintf(f, "3 %u %u %u\n", t[3 * k], t[3 * k + 1], t[3 * k + 2]);
    fclose(f);
    char scene[4096];
    snprintf(scene, sizeof scene,
             "<scene version='3.0.0'>%s<shape type='ply'><string name='filename' "
             "value='prism_test.ply'/><boolean name='face_normals' value='true'/>"
             "<ref id='glass'/></shape></scene>",
             text);
    test_must(ctx, imp_scene_load_string(ctx, scene, strlen(scene), "prism", &o, &s));
    remove("prism_test.ply");
    return s;
}

static double index_of(const char *glass, double nm)
{
    const struct imp__glass *g = imp__glass_find(glass);
    const double l2 = nm * nm * 1e-6;
    double n2 = 1;
    for (int k = 0; k < g->n; k++) n2 += g->number[k] * l2 / (l2 - g->number[g->n + k]);
    return sqrt(n2);
}

/* Largest error of the angle by which walks that pass the prism are turned. */
static double turned(enum imp_color_mode mode, double nm, double published, int *passed)
{
    const double n = index_of("N-BK7", nm), least = 2 * asin(n / 2) - PI / 3;
    const double incidence = (least + PI / 3) / 2;
    /* the normal of the left face points to 150 degrees; the ray comes from below it */
    const double from[2] = {3 * cos(5 * PI / 6 + incidence),
                            3 * sin(5 * PI / 6 + incidence)};
    imp_scene *s = prism("<string name='int_ior' value='N-BK7'/>", from, mode);
    struct imp_wavelengths w = s->wavelengths[0];
    w.lo = nm - 1e-9;
    w.hi = nm + 1e-9;
    const struct imp_tracer tracer = {.scene = s,
                                      .integrator = imp__walk_integrator(s),
                                      .sensor = s->sensors[0],
                                      .wavelengths = &w};
    struct imp_arena arena;
    double worst = fabs(least * 180 / PI - published) < 6e-5 ? 0 : INFINITY;
    imp__arena_init(&arena, ctx);
    for (int i = 0; i < 400; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_walk walk;
        imp__walk_trace(&tracer, &arena, 0, 0, i, &walk);
        const struct imp_vertex *a = walk.first, *b = a ? a->next : NULL,
                                *sky = b ? b->next : NULL;
        if (sky && !sky->shape && a->d.lobe == 1 && b->d.lobe == 1) {
            const imp_v3 in = walk.ray.d, out = imp__normalize(imp__decided_v3(sky->d.p));
            const double angle =
                atan2(imp__length(imp__cross(in, out)), imp__dot(in, out));
            worst = fmax(worst, fabs(angle - least));
            ++*passed;
        }
        imp__arena_rewind(&arena, mark);
    }
    imp__arena_free(&arena);
    imp_scene_destroy(s);
    return worst;
}

static void deviation(void)
{
    static const struct {
        double nm, degrees;
    } line[3] = {{486.13, 39.1381}, {587.56, 38.6467}, {656.27, 38.4291}};
    tap_ok(fabs(index_of("N-BK7", 587.56) - 1.516800) < 5e-7 &&
               fabs((index_of("N-BK7", 587.56) - 1) /
                        (index_of("N-BK7", 486.13) - index_of("N-BK7", 656.27)) -
                    64.17) < 5e-3,
           "N-BK7: n_d %.6f, V_d %.2f", index_of("N-BK7", 587.56),
           (index_of("N-BK7", 587.56) - 1) /
               (index_of("N-BK7", 486.13) - index_of("N-BK7", 656.27)));
    for (int k = 0; k < 3; k++) {
        int one = 0, four = 0;
        const double a = turned(IMP_SINGLE, line[k].nm, line[k].degrees, &one),
                     b = turned(IMP_SPECTRAL, line[k].nm, line[k].degrees, &four);
        tap_ok(
            a < 1e-6 && b < 1e-6 && one > 300 && four > 300,
            "prism at %.2f nm: least deviation %.4f degrees # %.1e, %.1e rad, %d of 400",
            line[k].nm, line[k].degrees, a, b, one);
    }
}

/* ---- The same mean by one wavelength and by four ---------------------------------------- */

#define BOX                                                                              \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='8'/></integrator><sensor type='perspective'><float name='fov' value='40'/>"  \
    "<transform name='to_world'><lookat origin='0,0,6' target='0,0,0' up='0,1,0'/>"      \
    "</transform><film type='hdrfilm'><integer name='width' value='4'/>"                 \
    "<integer name='height' value='4'/><rfilter type='box'/></film></sensor>"            \
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/>"              \
    "<translate z='-2'/></transform><emitter type='area'><spectrum name='radiance' "     \
    "value='360:.2,500:2,830:.5'/></emitter></shape>"                                    \
    "<emitter type='point'><point name='position' x='1' y='2' z='5'/>"                   \
    "<spectrum name='intensity' value='360:3,830:9'/></emitter>"                         \
    "<shape type='sphere'>%s</shape></scene>"

static struct imp_estimate mean_of(const char *bsdf, enum imp_color_mode mode, int seed)
{
    char text[4096];
    snprintf(text, sizeof text, BOX, bsdf);
    imp_scene *s = test_scene_text(ctx, text, mode);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    run.spp = mode == IMP_SINGLE ? 12000 : 6000;
    run.seed = (uint64_t)seed;
    run.wavelengths = IMP_WAVELENGTHS_INDEPENDENT;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    return e;
}

static void same_mean(const char *name, const char *bsdf)
{
    const struct imp_estimate one = mean_of(bsdf, IMP_SINGLE, 3),
                              four = mean_of(bsdf, IMP_SPECTRAL, 4);
    const double z = (one.value - four.value) / hypot(one.se, four.se);
    tap_ok(fabs(z) < 4 && four.se < 0.01 * four.value,
           "%s: one wavelength, four # %.5f +- %.5f, %.5f +- %.5f, z %.2f", name,
           one.value, one.se, four.value, four.se, z);
}

int main(void)
{
    ctx = test_context(1);
    deviation();
    same_mean("dispersive glass", "<bsdf type='dielectric'><string name='int_ior' "
                                  "value='N-SF11'/></bsdf>");
    same_mean("glass of strong dispersion",
              "<bsdf type='dielectric'><spectrum type='cauchy' name='int_ior'><string "
              "name='coefficients' value='1.2, 0.09'/></spectrum></bsdf>");
    same_mean("facets rougher in the red",
              "<bsdf type='roughconductor'><string name='material' value='Au'/>"
              "<string name='distribution' value='ggx'/>"
              "<spectrum name='alpha' value='360:.02,830:.5'/></bsdf>");
    same_mean("rough glass", "<bsdf type='roughdielectric'><string name='int_ior' "
                             "value='N-SF11'/><spectrum name='alpha' "
                             "value='360:.4,830:.05'/></bsdf>");
    imp_context_destroy(ctx);
    return tap_done();
}
