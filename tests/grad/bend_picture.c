/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of pictures with respect to an index field: against differences on frozen
 * walks and of other seeds, forward against reverse, lane by lane, thread by thread; and
 * the scenes where they would be incomplete are refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdarg.h>

static imp_context *ctx;

#define LOOK(fov, depth)                                                                 \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='" depth                                                                      \
    "'/></integrator><sensor type='perspective'><float name='fov' value='" fov           \
    "'/><transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/>"   \
    "</transform><film type='hdrfilm'><integer name='width' value='16'/><integer "       \
    "name='height' value='16'/><rfilter type='box'/></film></sensor>"
#define GRID(kind)                                                                       \
    "<volume type='grid'><integer name='cells' value='4'/>" kind                         \
    "<volume type='plume' name='start'><float name='n0' value='1.2'/><float name='b' "   \
    "value='0.3'/><float name='width' value='0.5'/></volume></volume>"
#define PLUME                                                                            \
    "<volume type='plume'><float name='n0' value='1.2'/><float name='b' value='0.3'/>"   \
    "<float name='width' value='0.5'/></volume><float name='step' value='0.05'/>"
#define BALL(bsdf, volume)                                                               \
    "<shape type='sphere' id='lens'><bsdf type='" bsdf "'/><medium type='graded' "       \
    "name='interior'>" volume "</medium></shape>"
#define PICTURE                                                                          \
    "<emitter type='area'><texture type='bitmap' name='radiance' id='map'><string "      \
    "name='filename' value='" IMP_SCENES "/textured/waves.png'/>%s</texture></emitter>"
#define SCREEN(size)                                                                     \
    "<shape type='rectangle' id='screen'><transform name='to_world'><scale value='" size \
    "'/><translate z='-3'/></transform>" PICTURE "</shape>"
#define SKY                                                                              \
    "<shape type='sphere' id='screen'><float name='radius' value='9'/><boolean "         \
    "name='flip_normals' value='true'/><transform name='to_world'><rotate x='1' "        \
    "angle='70'/><rotate y='1' angle='50'/></transform>" PICTURE "</shape>"

static imp_scene *make(imp_context *c, const char *body)
{
    char text[8192], *at = text;
    const char *gap = strstr(body, "%s"); /* a property of the texture could stand here */
    at += snprintf(at, sizeof text, "%.*s", (int)(gap ? gap - body : (long)strlen(body)),
                   body);
    snprintf(at, sizeof text - (size_t)(at - text), "%s</scene>", gap ? gap + 2 : "");
    imp_scene *s = test_scene_text(c, text, IMP_RGB);
    /* Colours that vary linearly, each its own way: no kinks between texels. */
    size_t k;
    if (imp_scene_find_param(s, "map.data", &k) == IMP_OK) {
        static double texel[64 * 64 * 3];
        for (int i = 0; i < 64 * 64; i++) {
            const double u = (i % 64 + 0.5) / 64, v = (i / 64 + 0.5) / 64;
            texel[3 * i] = 0.5 + u + 0.5 * v;
            texel[3 * i + 1] = 2 - u;
            texel[3 * i + 2] = 0.3 + v;
        }
        test_must(c, imp_scene_set_values(s, k, 64 * 64 * 3, texel));
    }
    return s;
}

/* spp: of fresh differences, whose noisy rows take up to 16 times as many by themselves. */
static void checked(const char *what, const char *body, const char *glob, int spp)
{
    imp_scene *s = make(ctx, body);
    imp_problem *p = test_problem(ctx, s, glob);
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    size_t n;
    int failed = 0, seen = 0;
    double frozen = 0, dot = 0, z = 0;
    o.draws_s = 0.02;
    o.paths = 200;
    o.fresh_spp = spp;
    run.seed = 7;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = &rows[i];
        failed += !r->ok;
        if (!r->ok)
            printf("# %s %s step %g: %.9g, %.9g, error %.3g\n", r->method, r->param,
                   r->step, r->value, r->reference, r->error);
        if (!strcmp(r->method, "frozen") && r->limit > 0)
            frozen = fmax(frozen, r->error), seen++;
        if (!strcmp(r->method, "dot")) dot = r->error;
        if (!strcmp(r->method, "fresh")) z = fmax(z, r->error);
    }
    tap_ok(!failed && seen, "%s # frozen %.1e, forward-reverse %.1e, worst z %.2f", what,
           frozen, dot, z);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Channels of the Jacobian, summed, are the reverse gradient of the picture's sum. */
static void lanes(void)
{
    imp_scene *s = make(ctx, LOOK("18", "-1") BALL("null", PLUME) SCREEN("3"));
    imp_problem *p = test_problem(ctx, s, "lens*");
    const size_t n = imp_problem_n_variables(p);
    imp_film *film[16];
    struct imp_run run = IMP_RUN_INIT;
    float seed[16 * 16 * 3];
    double g[16], worst = 0, channel[3] = {0};
    run.spp = 8;
    run.points = IMP_POINTS_INDEPENDENT; /* the same walks in both */
    for (int i = 0; i < 16 * 16 * 3; i++) seed[i] = 1;
    test_must(ctx, imp_problem_reverse(p, seed, &run, g, NULL));
    test_must(ctx, imp_problem_jacobian(p, &run, NULL, film));
    for (size_t k = 0; k < n; k++) {
        double sum = 0, size = 0;
        for (int i = 0; i < 16 * 16 * 3; i++) {
            const double v = imp_film_mean(film[k])[i];
            sum += v;
            size += fabs(v);
            if (k == 1) channel[i % 3] += v;
        }
        worst = fmax(worst, fabs(sum - g[k]) / fmax(size, 1e-3));
        imp_film_destroy(film[k]);
    }
    tap_ok(worst < 1e-6, "jacobian and reverse gradient agree # %.1e", worst);
    tap_ok(fabs(channel[0] - channel[1]) > 1e-3, "and keep channels apart");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void threads(void)
{
    double g[3][8];
    for (int k = 0; k < 3; k++) {
        imp_context *c = test_context(k + 1);
        imp_scene *s = make(c, LOOK("18", "3") BALL("dielectric", PLUME) SCREEN("8"));
        imp_problem *p = test_problem(c, s, "lens*");
        float seed[16 * 16 * 3];
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 8;
        for (int i = 0; i < 16 * 16 * 3; i++) seed[i] = (float)i;
        memset(g[k], 0, sizeof g[k]);
        test_must(c, imp_problem_reverse(p, seed, &run, g[k], NULL));
        imp_problem_destroy(p);
        imp_scene_destroy(s);
        imp_context_destroy(c);
    }
    tap_ok(g[0][0] != 0 && !memcmp(g[0], g[1], sizeof g[0]) &&
               !memcmp(g[0], g[2], sizeof g[0]),
           "same bits at 1, 2, 3 threads");
}

static void refused(const char *body, const char *message)
{
    imp_scene *s = make(ctx, body);
    imp_problem *p;
    float seed[16 * 16 * 3] = {1};
    double *g = calloc(100000, sizeof *g);
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 4;
    test_must(ctx, imp_problem_create(s, &p));
    size_t k = 0;
    struct imp_param_info info = {.size = sizeof info};
    while (imp_scene_get_param(s, k, &info) == IMP_OK && !strstr(info.name, "field")) k++;
    enum imp_status st = imp_problem_activate(p, info.name);
    const int at_once = st != IMP_OK;
    if (st == IMP_OK) st = imp_problem_reverse(p, seed, &run, g, NULL);
    const char *said = st == IMP_OK ? "" : imp_last_error(ctx);
    tap_ok(st == IMP_E_BIAS && strstr(said, message) && at_once == (info.why != NULL),
           "refused: %s", message);
    if (st != IMP_E_BIAS || !strstr(said, message))
        printf("# %s: %s\n", imp_status_text(st), said);
    free(g);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void dark_frame(void)
{
    imp_scene *s = make(ctx, LOOK("18", "-1") BALL("null", PLUME) SCREEN("0.3"));
    imp_problem *p = test_problem(ctx, s, "lens*");
    size_t k;
    static double texel[64 * 64 * 3];
    float seed[16 * 16 * 3] = {1};
    double g[8];
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 8;
    tap_ok(imp_problem_reverse(p, seed, &run, g, NULL) == IMP_E_BIAS,
           "a bright border beside nothing is an edge");
    test_must(ctx, imp_scene_find_param(s, "map.data", &k));
    for (int i = 0; i < 64 * 64 * 3; i++) {
        const double u = (i / 3 % 64) / 63.0, v = (i / 192) / 63.0;
        texel[i] = 16 * u * (1 - u) * v * (1 - v);
    }
    test_must(ctx, imp_scene_set_values(s, k, 64 * 64 * 3, texel));
    tap_ok(imp_problem_reverse(p, seed, &run, g, NULL) == IMP_OK,
           "a dark one in the dark is none");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(2);
    checked("null boundary, grid, and what is seen",
            LOOK("18", "-1") BALL("null", GRID("")) SCREEN("3"), "*", 6);
    checked("eta^2 grid",
            LOOK("18", "-1") BALL("null", GRID("<string name='parameter' value='eta2'/>"))
                SCREEN("3"),
            "lens*", 8);
    checked("dielectric, lit all around", LOOK("18", "-1") BALL("dielectric", PLUME) SKY,
            "*", 8);
    checked(
        "a glass ball behind",
        LOOK("14", "-1") BALL(
            "null",
            PLUME) "<shape type='sphere'><float name='radius' value='0.8'/><point "
                   "name='center' "
                   "value='0.1,0.1,-2.2'/><bsdf type='dielectric'><float name='int_ior' "
                   "value='1.2'/></bsdf></shape>" SKY,
        "lens*", 8);
    checked(
        "a rod of three shapes, a sum of fields",
        LOOK("8",
             "3") "<medium type='graded' id='lens'><volume type='radial'><boolean "
                  "name='cylinder' value='true'/><integer name='cells' value='4'/><float "
                  "name='index' value='1.5'/></volume><volume type='rod-vendor'><float "
                  "name='n0' value='0.2'/><float name='a' value='1'/></volume><float "
                  "name='step' value='0.05'/></medium><bsdf type='dielectric' id='face'/>"
                  "<shape type='cylinder'><point name='p0' value='0,0,-1'/><ref "
                  "id='face'/>"
                  "<ref id='lens' name='interior'/></shape><shape type='disk'><transform "
                  "name='to_world'><translate z='1'/></transform><ref id='face'/><ref "
                  "id='lens' name='interior'/></shape><shape type='disk'><transform "
                  "name='to_world'><rotate y='1' angle='180'/><translate "
                  "z='-1'/></transform>"
                  "<ref id='face'/><ref id='lens' name='interior'/></shape>" SCREEN("8"),
        "lens*", 8);
    lanes();
    threads();
    dark_frame();
    refused(LOOK("18", "-1") BALL("dielectric", PLUME) SCREEN("3"), "beside it");
    refused(
        LOOK("18", "-1") BALL(
            "null",
            PLUME) "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
                   "value='9'/><translate z='-3'/></transform></shape><emitter "
                   "type='constant'/>",
        "'floor', which scatters light");
    refused(LOOK("18", "-1")
                BALL("null", PLUME) "<shape type='rectangle' id='mirror'><transform "
                                    "name='to_world'><scale "
                                    "value='9'/><translate z='-3'/></transform><bsdf "
                                    "type='conductor'/></shape>"
                                    "<emitter type='constant'/>",
            "'mirror', which is a mirror");
    refused(LOOK("18", "-1") BALL(
                "null", PLUME) "<shape type='rectangle' id='chequers'><transform "
                               "name='to_world'><scale "
                               "value='9'/><translate z='-3'/></transform><emitter "
                               "type='area'><texture "
                               "type='checkerboard' name='radiance'/></emitter></shape>",
            "'chequers', which has a texture that jumps");
    refused(LOOK("18", "-1")
                BALL("null", GRID("<string name='interpolation' value='trilinear'/>"))
                    SCREEN("3"),
            "jumps at cell faces");
    refused(LOOK("18", "-1") BALL("null", "<volume type='luneburg'><float name='radius' "
                                          "value='1'/></volume>") SCREEN("3"),
            "jumps at its radius");
    refused(LOOK("18", "-1")
                BALL("null",
                     PLUME) "<shape type='sphere' id='lamp'><float "
                            "name='radius' value='0.2'/><emitter type='area'/></shape>",
            "'lamp'");
    refused(
        LOOK("18", "-1") BALL(
            "null",
            PLUME) "<shape type='sphere' id='behind'><float name='radius' "
                   "value='3'/><point "
                   "name='center' value='0,0,-6'/><bsdf type='dielectric'/></shape>"
                   "<shape type='rectangle' id='lamp'><transform name='to_world'><scale "
                   "value='0.2'/><translate z='-2'/></transform><emitter "
                   "type='area'/></shape>",
        "'lamp'");
    imp_context_destroy(ctx);
    return tap_done();
}
