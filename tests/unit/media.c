/* SPDX-License-Identifier: Apache-2.0
 *
 * Media: transmittances in closed form, as hit fractions and with derivatives; colours of
 * very different extinction; cameras inside; bounds that follow; what is refused. */
#include "color/upsample.h"
#include "media_kit.h"
#include "scene/majorants.h"
#include "vol_write.h"

static imp_context *ctx;

/* A cube from z = 0 to 1 before a lamp of radiance 1, seen along z. */
static imp_scene *column(const char *medium, const char *more, enum imp_color_mode mode)
{
    char text[4096];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'/>%s"
             "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/>"
             "<transform name='to_world'><scale x='0.5' y='0.5' z='0.5'/>"
             "<translate x='0.5' y='0.5' z='0.5'/></transform></shape>"
             "<shape type='rectangle' id='lamp'><emitter type='area'>"
             "<float name='radiance' value='1'/></emitter><transform name='to_world'>"
             "<rotate x='1' angle='180'/><translate x='0.5' y='0.5' z='2'/></transform>"
             "</shape><sensor type='orthographic'><transform name='to_world'>"
             "<scale value='0.01'/><lookat origin='0.5,0.5,-1' target='0.5,0.5,1' "
             "up='0,1,0'/></transform>"
             "<film type='hdrfilm'><integer name='width' value='8'/>"
             "<integer name='height' value='8'/><rfilter type='box'/></film>%s</sensor>"
             "</scene>",
             medium, more);
    return test_scene_text(ctx, text, mode);
}

/* A walk is absorbed or passes: the variance is that of a coin. */
static void transmittances(void)
{
    enum { N = 128 };
    char path[64], text[512];
    float value[N];
    double mean[3], se[3];
    static const struct {
        const char *what;
        double T;
    } cases[] = {{"T of extinction 1", .367879},
                 {"T of extinction 2 x", .367879},
                 {"T of a narrow peak", .285557}};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < N; i++) {
            const double x = (i + .5) / N;
            value[i] = (float)(k == 0   ? 1
                               : k == 1 ? 2 * x
                                        : 5 * exp(-(x - .5) * (x - .5) / .02));
        }
        vol_write(path, 1, 1, N, 1, value);
        snprintf(text, sizeof text,
                 "<medium type='heterogeneous' id='fog'><float name='albedo' value='0'/>"
                 "<volume name='sigma_t' type='gridvolume' id='grid'>"
                 "<string name='filename' value='%s'/></volume></medium>",
                 path);
        imp_scene *s = column(text, "", IMP_MONO);
        media_mean(ctx, s, 8192, mean, se);
        media_near(mean[0], se[0], cases[k].T, 1e-3, cases[k].what);
        tap_near(se[0], sqrt(cases[k].T * (1 - cases[k].T) / (64. * 8192)), .03, 0,
                 "... is a coin");

        /* dT = -T times the length in each cell. */
        imp_problem *p = test_problem(ctx, s, "grid.data");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate v;
        double g[N], g_se[N], sum = 0, sum_se = 0;
        run.spp = 2048;
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
        for (int i = 0; i < N; i++) sum += g[i], sum_se += g_se[i] * g_se[i];
        media_near(sum, 2 * sqrt(sum_se), -cases[k].T, 1e-2,
                   "sum of its derivatives is -T");
        imp_problem_destroy(p);
        imp_scene_destroy(s);
        remove(path);
    }
}

static void colours(void)
{
    static const double sigma[3] = {2, 6, 9};
    double mean[3], se[3];
    imp_scene *s = column("<medium type='homogeneous' id='fog'><rgb name='sigma_t' "
                          "value='2,6,9'/><float name='albedo' value='0'/></medium>",
                          "", IMP_RGB);
    media_mean(ctx, s, 16384, mean, se);
    for (int c = 0; c < 3; c++)
        media_near(mean[c], se[c], exp(-sigma[c]), .01 * exp(-sigma[c]),
                   "T of extinctions 2, 6, 9 from one set of walks");
    imp_scene_destroy(s);
    s = column("<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='0,1,3'/>"
               "<float name='albedo' value='0'/></medium>",
               "", IMP_RGB);
    media_mean(ctx, s, 4096, mean, se);
    media_near(mean[0], se[0] + 1e-12, 1, .01, "a colour without extinction");
    media_near(mean[2], se[2], exp(-3), .01, "beside one with");
    imp_scene_destroy(s);
}

/* By wavelengths: the colour of exp(-S), S the spectrum of a reflectance of that colour, as
 * Mitsuba has it. */
static void wavelengths(void)
{
    static const double sigma[2][3] = {{1, .2, .95}, {.1, .99, .1}};
    struct imp__lifter by;
    imp__lifter_make(&by);
    for (int k = 0; k < 2; k++) {
        char text[256];
        double mean[3], se[3], T[3] = {0, 0, 0};
        struct imp__lifted S;
        imp__lift_reflectance_by(&by, sigma[k], &S);
        for (int q = 0; q < IMP__LIFT_POINTS; q++)
            for (int c = 0; c < 3; c++)
                T[c] +=
                    by.weight[q][c] * exp(-imp__lifted_value(&S, 360 + 470 * by.x[q]));
        snprintf(text, sizeof text,
                 "<medium type='homogeneous' id='fog'><rgb name='sigma_t' "
                 "value='%g,%g,%g'/><float name='albedo' value='0'/></medium>",
                 sigma[k][0], sigma[k][1], sigma[k][2]);
        imp_scene *s = column(text, "", IMP_SPECTRAL);
        media_mean(ctx, s, 4096, mean, se);
        for (int c = 0; c < 3; c++)
            media_near(mean[c], se[c], T[c], .004, "T by wavelengths of a colour");
        imp_scene_destroy(s);
    }
}

/* In an absorbing fog without an end: exp(-3 sigma), and its derivative. */
static void inside(void)
{
    double mean[3], se[3], g[4], g_se[4];
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    const char *fog = "<medium type='homogeneous' id='fog'><float name='sigma_t' "
                      "value='0.5'/><float name='albedo' value='0'/></medium>";
    char text[2048];
    snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='volpath'/>%s"
        "<shape type='rectangle'><emitter type='area'>"
        "<float name='radiance' value='1'/></emitter><transform name='to_world'>"
        "<rotate x='1' angle='180'/><translate z='3'/></transform></shape>"
        "<sensor type='orthographic'><transform name='to_world'><scale value='0.01'/>"
        "</transform><float name='near_clip' value='1e-6'/><ref id='fog'/>"
        "<film type='hdrfilm'><integer name='width' value='8'/>"
        "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"
        "</scene>",
        fog);
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    media_mean(ctx, s, 4096, mean, se);
    media_near(mean[0], se[0], exp(-1.5), .01, "a camera in fog");
    imp_problem *p = test_problem(ctx, s, "fog.sigma_t.value");
    run.spp = 4096;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
    media_near(g[0], g_se[0], -3 * exp(-1.5), .01, "its derivative");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A floor under a lamp, seen from between it and a black pane of which `part` goes
 * straight on: that is no bounce, and light samples pass it, of points too. */
static imp_scene *under_pane(const char *pane, const char *lamp)
{
    char text[2048];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'>"
             "<integer name='max_depth' value='2'/></integrator>%s"
             "<shape type='rectangle'><bsdf type='diffuse'/></shape>"
             "<shape type='rectangle'>%s<transform name='to_world'><scale value='9'/>"
             "<translate z='2'/></transform></shape>"
             "<sensor type='orthographic'><transform name='to_world'>"
             "<scale value='0.001'/><lookat origin='0,0,1' target='0,0,0' up='0,1,0'/>"
             "</transform><film type='hdrfilm'><integer name='width' value='4'/>"
             "<integer name='height' value='4'/><rfilter type='box'/></film></sensor>"
             "</scene>",
             lamp, pane);
    return test_scene_text(ctx, text, IMP_MONO);
}

/* A box of nothing, 1 high, on the way to the lamp: the derivative is there all the same,
 * where bounds of the extinction are 0 and no tentative collision ever is. */
static void empty_shadow(void)
{
    enum { N = 16, CELLS = N * N * N };
    static float none[CELLS];
    static double g[CELLS], g_se[CELLS];
    char path[64], text[1024];
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    double sum = 0, square = 0;
    vol_write(path, N, N, N, 1, none);
    snprintf(text, sizeof text,
             "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
             "type='gridvolume' id='grid'><string name='filename' value='%s'/>"
             "<transform name='to_world'><translate x='-0.5' y='-0.5' z='1.5'/>"
             "</transform></volume></medium><shape type='cube'><bsdf type='null'/>"
             "<ref id='fog' name='interior'/><transform name='to_world'>"
             "<scale value='0.5'/><translate z='2'/></transform></shape>"
             "<emitter type='point'><point name='position' x='0' y='0' z='3'/></emitter>",
             path);
    imp_scene *s = under_pane("<bsdf type='null'/>", text);
    imp_problem *p = test_problem(ctx, s, "grid.data");
    run.spp = 1024;
    run.seed = 3;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
    for (int i = 0; i < CELLS; i++) sum += g[i], square += g_se[i] * g_se[i];
    media_near(sum, sqrt(square) + 1e-7, -v.value, .02 * v.value,
               "the shadow of an empty box has its derivative");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    remove(path);
}

static void panes(void)
{
    static const char point[] = "<emitter type='point'><point name='position' x='0' "
                                "y='0' z='3'/></emitter>",
                      area[] = "<shape type='rectangle'><emitter type='area'/>"
                               "<transform name='to_world'><rotate x='1' angle='180'/>"
                               "<translate z='3'/></transform></shape>";
    static const struct {
        const char *what, *pane, *param;
        double part, slope; /* d part/d param */
    } cases[] = {
        {"a mask",
         "<bsdf type='mask' id='m'><float name='opacity' value='0.25'/>"
         "<bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf></bsdf>",
         "m.opacity.value", .75, -1},
        {"a mask that lets nothing pass",
         "<bsdf type='mask' id='m'><float name='opacity' value='1'/>"
         "<bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf></bsdf>",
         "m.opacity.value", 0, -1},
        {"a thin sheet of index 1.5",
         "<bsdf type='thindielectric' id='m'><float name='int_ior' value='1.5'/>"
         "<float name='ext_ior' value='1'/>"
         "<float name='specular_transmittance' value='0.5'/></bsdf>",
         "m.specular_transmittance.value", .5 * 12 / 13, 12. / 13},
        {"a hole in a mask in a blend",
         "<bsdf type='blendbsdf' id='m'><float name='weight' value='0.5'/>"
         "<bsdf type='null'/><bsdf type='mask'><float name='opacity' value='0.5'/>"
         "<bsdf type='diffuse'><float name='reflectance' "
         "value='0'/></bsdf></bsdf></bsdf>",
         "m.weight.value", .75, -.5},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (int broad = 0; broad < 2; broad++) {
            const char *lamp = broad ? area : point;
            double open[3], open_se[3], mean[3], se[3], g[8], g_se[8];
            struct imp_run run = IMP_RUN_INIT;
            struct imp_estimate v;
            imp_scene *s = under_pane("<bsdf type='null'/>", lamp);
            media_mean(ctx, s, 4096, open, open_se);
            imp_scene_destroy(s);
            s = under_pane(cases[k].pane, lamp);
            media_mean(ctx, s, 4096, mean, se);
            /* Light from all over the lamp meets the sheet at an angle. */
            const double part = cases[k].part, slack = broad && k == 2 ? .003 : 1e-6;
            media_near(mean[0], hypot(se[0], part * open_se[0]) + slack * open[0],
                       part * open[0], .006 * open[0], cases[k].what);
            imp_problem *p = test_problem(ctx, s, cases[k].param);
            run.spp = 4096;
            run.seed = 9;
            test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
            media_near(g[0], hypot(g_se[0], open_se[0]) + slack * open[0],
                       cases[k].slope * open[0], .02 * open[0], cases[k].param);
            imp_problem_destroy(p);
            imp_scene_destroy(s);
        }
}

/* A box of extinction 1, 1 high, on the way to the lamp, under bounds b: ratio tracking has
 * the mean exp(-1) whatever b, and the variance T^2 (exp(int sigma^2/b) - 1). A bound that
 * is too low is told. */
static void bounds_do_not_matter(void)
{
    static const struct {
        double bound, variance;
    } cases[] = {{1, .232544}, {2, .087795}, {10, .014233}, {.5, 0}};
    static const float one[1] = {1};
    char path[64], text[1024];
    double open[3], open_se[3], mean[3], se[3];
    imp_scene *s = under_pane("<bsdf type='null'/>",
                              "<emitter type='point'><point name='position' x='0' y='0' "
                              "z='3'/></emitter>");
    media_mean(ctx, s, 2, open, open_se);
    imp_scene_destroy(s);
    vol_write(path, 1, 1, 1, 1, one);
    snprintf(text, sizeof text,
             "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
             "type='gridvolume'><string name='filename' value='%s'/>"
             "<transform name='to_world'><translate x='-0.5' y='-0.5' z='1.5'/>"
             "</transform></volume></medium><shape type='cube'><bsdf type='null'/>"
             "<ref id='fog' name='interior'/><transform name='to_world'>"
             "<scale value='0.5'/><translate z='2'/></transform></shape>"
             "<emitter type='point'><point name='position' x='0' y='0' z='3'/></emitter>",
             path);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        enum { SPP = 4096 };
        s = under_pane("<bsdf type='null'/>", text);
        struct imp_majorants *g = (struct imp_majorants *)s->media[0]->majorants;
        g->bound[0] = (float)(cases[k].bound * (1 + 1e-6));
        if (cases[k].variance == 0) {
            struct imp_run run = IMP_RUN_INIT;
            imp_film *film = NULL;
            run.spp = 4;
            tap_ok(imp_render(s, &run, &film) == IMP_E_PATHS &&
                       strstr(imp_last_error(ctx), "above its bound"),
                   "a bound that is too low is told # %s", imp_last_error(ctx));
            imp_film_destroy(film);
        } else {
            media_mean(ctx, s, SPP, mean, se);
            media_near(mean[0] / open[0], se[0] / open[0], exp(-1), .003,
                       "T by ratio tracking, whatever the bound");
            tap_near(se[0] * se[0] * 16 * SPP / (open[0] * open[0]), cases[k].variance,
                     .06, 0, "... and its variance");
        }
        imp_scene_destroy(s);
    }
    remove(path);
}

/* Numbers are set beyond the bounds that were made first. */
static void bounds_follow(void)
{
    const float value[8] = {1, 0, 0, 0, 0, 0, 0, 0};
    const double more[8] = {0, 0, 0, 5, 0, 0, 9, 0};
    char path[64], text[512];
    double mean[3], se[3];
    size_t param;
    vol_write(path, 1, 1, 8, 1, value);
    snprintf(text, sizeof text,
             "<medium type='heterogeneous' id='fog'><float name='albedo' value='0'/>"
             "<volume name='sigma_t' type='gridvolume' id='grid'>"
             "<string name='filter_type' value='nearest'/>"
             "<string name='filename' value='%s'/></volume></medium>",
             path);
    imp_scene *s = column(text, "", IMP_MONO);
    test_must(ctx, imp_scene_find_param(s, "grid.data", &param));
    test_must(ctx, imp_scene_set_values(s, param, 8, more));
    media_mean(ctx, s, 4096, mean, se);
    media_near(mean[0], se[0], exp(-14. / 8), .01, "bounds follow what is set");
    imp_scene_destroy(s);
    remove(path);
}

/* A ball of glass filled with what absorbs nothing, under uniform light: invisible, with
 * refraction and its factor n^2. No walk leaves it through a hole. */
static void furnace(void)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_film *film;
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='volpath'>"
        "<integer name='rr_depth' value='1000'/></integrator>"
        "<medium type='homogeneous' id='milk'><float name='sigma_t' value='3'/>"
        "<float name='albedo' value='1'/></medium><shape type='sphere'>"
        "<bsdf type='dielectric'><float name='int_ior' value='1.3'/>"
        "<float name='ext_ior' value='1'/></bsdf><ref id='milk' name='interior'/></shape>"
        "<emitter type='constant'/><sensor type='perspective'>"
        "<float name='fov' value='25'/><transform name='to_world'>"
        "<lookat origin='0,0,5' target='0,0,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='16'/>"
        "<integer name='height' value='16'/><rfilter type='box'/></film></sensor>"
        "</scene>",
        IMP_MONO);
    run.spp = 1024;
    test_must(ctx, imp_render(s, &run, &film));
    test_must(ctx, imp_film_get_info(film, &info));
    double worst = 0;
    for (int k = 0; k < info.width * info.height; k++)
        worst = fmax(worst, fabs(imp_film_mean(film)[k] - 1.));
    tap_near(worst, 0, 0, 2e-6, "a ball of glass and milk is invisible, on every walk");
    tap_ok(info.dropped == 0, "no walk leaves through a hole # %llu of 262144",
           (unsigned long long)info.dropped);
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

static void refused(const char *medium, const char *more, const char *why)
{
    char text[48000];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'/>%s"
             "<shape type='sphere'><bsdf type='null'/><ref id='fog' name='interior'/>%s"
             "</shape></scene>",
             medium, more);
    media_refused(ctx, text, why);
}

/* A volume of value 2 whose bound says 1, as a host program might write it. */
static void careless_eval(const struct imp_texture *t, const struct imp_texcoord *at,
                          bool scalar, imp_spec *value)
{
    (void)t, (void)at, (void)scalar;
    imp_spec_fill(value, 2);
}
static void careless_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                             bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    (void)t, (void)at, (void)scalar, (void)bar, (void)sink;
}
static void careless_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                             bool scalar, imp_dot_fn *dot, const void *x_dot,
                             imp_spec *value_dot)
{
    (void)t, (void)at, (void)scalar, (void)dot, (void)x_dot;
    imp_spec_fill(value_dot, 0);
}
static void careless_bound(const struct imp_texture *t, const imp_v3 *lo,
                           const imp_v3 *hi, bool scalar, imp_spec *most)
{
    (void)t, (void)lo, (void)hi, (void)scalar;
    imp_spec_fill(most, 1);
}
static void careless_extent(const struct imp_texture *t, double to_unit[12], int cells[3])
{
    (void)t;
    for (int k = 0; k < 12; k++) to_unit[k] = k % 4 == 3 ? .5 : k % 5 == 0 ? .5 : 0;
    cells[0] = cells[1] = cells[2] = 1;
}

/* Walks that a scene of bad numbers drops: by which cause, and that a run without leave to
 * drop fails and says so. */
static void counted(imp_context *c, imp_scene *s, int cause, const char *what)
{
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = 64;
    run.drop_budget = 1;
    test_must(c, imp_render(s, &run, &film));
    test_must(c, imp_film_get_info(film, &info));
    tap_ok(info.dropped > 0 && info.dropped_by_cause[cause] == info.dropped,
           "%s: %llu of %d walks are dropped and counted", what,
           (unsigned long long)info.dropped, 64 * info.width * info.height);
    imp_film_destroy(film);
    film = NULL;
    run.drop_budget = 0;
    const enum imp_status st = imp_render(s, &run, &film);
    tap_ok(st == IMP_E_PATHS, "... and the run fails # %s", imp_last_error(c));
    imp_film_destroy(film);
}

#define SEEN                                                                             \
    "<emitter type='constant'/><sensor type='orthographic'><transform name='to_world'>"  \
    "<scale value='0.2'/><lookat origin='0,0,-3' target='0,0,0' "                        \
    "up='0,1,0'/></transform>"                                                           \
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "      \
    "value='4'/><rfilter type='box'/></film></sensor></scene>"

static void low_bound(void)
{
    static const struct imp_texture_ops careless = {.size = sizeof careless,
                                                    .name = "careless",
                                                    .object_size = 1,
                                                    .eval = careless_eval,
                                                    .scatter = careless_scatter,
                                                    .tangent = careless_tangent,
                                                    .bound = careless_bound,
                                                    .extent = careless_extent};
    imp_context *c = test_context(1);
    test_must(c, imp_register_volume(c, &careless));
    imp_scene *s = test_scene_text(
        c,
        "<scene version='3.0.0'><integrator type='volpath'/><medium type='heterogeneous' "
        "id='fog'><volume name='sigma_t' type='careless'/></medium><shape type='cube'>"
        "<bsdf type='null'/><ref id='fog' name='interior'/></shape>" SEEN,
        IMP_MONO);
    counted(c, s, IMP_DROP_MAJORANT, "an extinction above its bound");
    imp_scene_destroy(s);
    imp_context_destroy(c);
}

/* Fog in a box without a lid on the far side: rays come in through it, and leave a medium
 * by a wall from its inside that they have never entered. */
static void no_outside(void)
{
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='volpath'/><medium type='homogeneous' "
        "id='fog'><float name='sigma_t' value='1'/><float name='albedo' value='1'/>"
        "</medium><shape type='rectangle'><transform name='to_world'><scale value='3'/>"
        "<rotate y='1' angle='180'/></transform><bsdf type='null'/><ref id='fog' "
        "name='interior'/></shape><shape type='rectangle'><transform name='to_world'>"
        "<scale value='0.5'/><translate z='1'/></transform><bsdf type='null'/><ref "
        "id='fog' name='interior'/></shape>" SEEN,
        IMP_MONO);
    counted(ctx, s, IMP_DROP_MEDIUM, "a medium without an outside");
    imp_scene_destroy(s);
}

/* An extinction of 1e12 in one of eight cells: a walk that has had a million tentative
 * collisions ends. */
static void immense(void)
{
    float value[8] = {1e12F};
    char path[64], text[2048];
    vol_write(path, 2, 2, 2, 1, value);
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'/><medium "
             "type='heterogeneous' id='fog'><float name='albedo' value='1'/><volume "
             "name='sigma_t' type='gridvolume'><string name='filename' value='%s'/>"
             "<string name='filter_type' value='nearest'/><transform name='to_world'>"
             "<scale value='2'/><translate x='-1' y='-1' z='-1'/></transform></volume>"
             "</medium><shape type='cube'><bsdf type='null'/><ref id='fog' "
             "name='interior'/></shape>" SEEN,
             path);
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 1;
    run.drop_budget = 1;
    test_must(ctx, imp_render(s, &run, &film));
    test_must(ctx, imp_film_get_info(film, &info));
    int finite = 1;
    for (int k = 0; k < info.width * info.height; k++)
        finite &= isfinite(imp_film_mean(film)[k]);
    tap_ok(finite, "an extinction of 1e12: %llu of 16 walks dropped",
           (unsigned long long)info.dropped);
    imp_film_destroy(film);
    imp_scene_destroy(s);
    remove(path);
}

int main(void)
{
    ctx = test_context(0);
    transmittances();
    colours();
    wavelengths();
    inside();
    panes();
    empty_shadow();
    bounds_do_not_matter();
    bounds_follow();
    furnace();
    low_bound();
    no_outside();
    immense();

#define FOG(inner) "<medium type='homogeneous' id='fog'>" inner "</medium>"
    refused(FOG("<float name='sigma_t' value='-1'/>"), "", "outside [0, inf]");
    refused(FOG("<rgb name='albedo' value='0.5,1.5,0.5'/>"), "", "albedo");
    refused(FOG("<phase type='hg'><float name='g' value='1'/></phase>"), "", "g = 1");
    refused(FOG("<phase type='hg'><float name='g' value='-1'/></phase>"), "", "g = -1");
    refused(FOG("<phase type='hg'><rgb name='g' value='0.5,1.5,0.5'/></phase>"), "", "g");
    refused(FOG("<float name='scale' value='-2'/>"), "", "scale");
    refused(FOG("<float name='sigma_t' value='nan'/>"), "", "finite");
    refused(FOG("<float name='sigma_t' value='inf'/>"), "", "finite");
#define AIR(inner)                                                                       \
    "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "                      \
    "type='expvolume'>" inner "</volume></medium>"
    refused(AIR("<float name='top' value='1'/>"), "", "'scale_height' is missing");
    refused(AIR("<float name='scale_height' value='1'/>"), "", "top");
    refused(AIR("<float name='scale_height' value='0'/><float name='top' value='1'/>"),
            "", "scale_height = 0");
    refused(AIR("<float name='scale_height' value='1'/><float name='top' value='1'/>"
                "<float name='value' value='-1'/>"),
            "", "value = -1");
    refused(AIR("<float name='scale_height' value='1'/><float name='top' value='1'/>"
                "<float name='radius' value='-1'/>"),
            "", "radius = -1");
    refused(FOG("") "<emitter type='sun'><float name='radius' value='2'/></emitter>", "",
            "radius");
    refused(FOG("<float name='sigma_s' value='1'/><float name='sigma_t' value='1'/>"), "",
            "the one pair");
    refused(FOG("<phase type='hg'/><phase type='rayleigh'/>"), "", "blendphase");
#define TABLE(values)                                                                    \
    FOG("<phase type='tabphase'><string name='values' value='" values "'/></phase>")
    refused(FOG("<phase type='tabphase'/>"), "", "'values' is missing");
    refused(TABLE("1"), "", "not a row");
    refused(TABLE("1, x"), "", "not a row");
    refused(TABLE("1, -1, 2"), "", "value 1, -1, is negative");
    refused(TABLE("1, nan"), "", "not finite");
    refused(TABLE("0 0 0"), "", "integral");
    refused(TABLE("1e308 1e308"), "", "integral");
    refused(FOG("<phase type='blendphase'><float name='weight' value='0.5'/>"
                "<phase type='hg'/></phase>"),
            "", "missing");
    refused(FOG(""), "<ref id='fog' name='around'/>", "interior or exterior");
    refused(FOG(""), "<emitter type='area'/>", "cannot emit");
    refused("<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
            "type='gridvolume'/></medium>",
            "", "filename");
    refused(FOG("") "<sensor type='perspective'/>", "", "is inside shape");
    refused(FOG("") "<sensor type='perspective'><transform name='to_world'>"
                    "<translate z='-5'/></transform><ref id='fog'/></sensor>",
            "", "is in medium fog");
    /* Whatever stands before the border. */
    char panes[40000] = FOG("") "<sensor type='perspective'/>";
    for (int k = 0; k < 300; k++)
        snprintf(panes + strlen(panes), sizeof panes - strlen(panes),
                 "<shape type='rectangle'><transform name='to_world'><translate "
                 "z='%g'/></transform></shape>",
                 .1 + .002 * k);
    refused(panes, "", "is inside shape");
    float bad[2] = {1, -1};
    char path[64], text[512];
    vol_write(path, 1, 1, 2, 1, bad);
    snprintf(text, sizeof text,
             "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
             "type='gridvolume'><string name='filename' value='%s'/></volume></medium>",
             path);
    refused(text, "", "value 1, -1");
    remove(path);
    bad[1] = NAN;
    vol_write(path, 1, 1, 2, 1, bad);
    snprintf(text, sizeof text,
             "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
             "type='gridvolume'><string name='filename' value='%s'/></volume></medium>",
             path);
    refused(text, "", "cell (0, 0, 1) is not finite");
    remove(path);
    bad[1] = 3;
    vol_write(path, 1, 1, 2, 1, bad);
    snprintf(text, sizeof text,
             "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
             "type='gridvolume'><string name='filename' value='%s'/>"
             "<float name='max_value' value='2'/></volume></medium>",
             path);
    refused(text, "", "max_value = 2 is outside [3, inf]");
    snprintf(
        text, sizeof text,
        "<medium type='heterogeneous' id='fog'><float name='sigma_t' value='1'/>"
        "<volume name='albedo' type='gridvolume'><string name='filename' value='%s'/>"
        "</volume></medium>",
        path);
    refused(text, "", "value 1, 3");
    FILE *f = fopen(path, "r+b");
    const int32_t huge[3] = {1 << 20, 1 << 20, 1 << 20};
    if (f && fseek(f, 8, SEEK_SET) == 0 && fwrite(huge, 4, 3, f) == 3 && fclose(f) == 0)
        refused(text, "", "56 bytes for 1048576 x 1048576 x 1048576 cells");
    remove(path);
    imp_context_destroy(ctx);
    return tap_done();
}
