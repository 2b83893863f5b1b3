/* SPDX-License-Identifier: Apache-2.0
 *
 * Shapes that overlap, by priority: transmittances in closed form along walks and to light
 * samples, with derivatives, of walks from the sensor, the lights and both ends; a liquid
 * that reaches into the walls of its glass; cameras and instances inside; what is refused. */
#include "media_kit.h"
#include "vol_write.h"

static imp_context *ctx;

#define CUBE(z0, z1, inner)                                                              \
    "<shape type='cube'>" inner "<transform name='to_world'>"                            \
    "<translate z='1'/><scale x='30' y='30' z='0.5'/><scale z='" #z1 "'/>"               \
    "<translate z='" #z0 "'/></transform></shape>"
#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='4'/>"                             \
    "<integer name='height' value='4'/><rfilter type='box'/></film>"
#define EYE(z)                                                                           \
    "<sensor type='orthographic'><float name='near_clip' value='1e-6'/>"                 \
    "<transform name='to_world'><scale value='0.9'/>"                                    \
    "<lookat origin='0,0," #z "' target='0,0,10' up='0,1,0'/></transform>" FILM          \
    "</sensor>"
#define LAMP                                                                             \
    "<shape type='rectangle'><emitter type='area'><float name='radiance' value='1'/>"    \
    "</emitter><transform name='to_world'><rotate x='1' angle='180'/>"                   \
    "<translate z='4'/></transform></shape>"
#define MEDIUM(name, sigma)                                                              \
    "<medium type='homogeneous' id='" name "'><float name='sigma_t' value='" #sigma      \
    "'/><float name='albedo' value='0'/></medium>"
#define FOG(name, rank)                                                                  \
    "<integer name='priority' value='" #rank "'/><bsdf type='null'/><ref id='" name      \
    "' name='interior'/>"
#define SCENE(...) "<scene version='3.0.0'>" __VA_ARGS__ "</scene>"

#define VOLPATH "<integrator type='volpath'/>"
/* Where walks begin: at the sensor, the lights, both ends. */
static const char *const ends[] = {"volpath", "ptracer", "bdpt"};

static imp_scene *scene_from(const char *integrator, const char *text)
{
    static const char head[] = "<scene version='3.0.0'>";
    char all[16384];
    snprintf(all, sizeof all, "%s<integrator type='%s'/>%s", head, integrator,
             text + sizeof head - 1);
    return test_scene_text(ctx, all, IMP_MONO);
}

/* Mean of the picture and its derivatives by sigma_t of media a and b, at -length times it. */
static void lengths_from(const char *integrator, const char *text, double T, double la,
                         double lb, const char *what)
{
    imp_scene *s = scene_from(integrator, text);
    double mean[3], se[3], g[2], g_se[2];
    struct imp_estimate v;
    struct imp_run run = IMP_RUN_INIT;
    const int spp = strcmp(integrator, "volpath") == 0 ? 8192 : 4096;
    media_mean(ctx, s, spp, mean, se);
    media_near(mean[0], se[0] + 1e-9, T, .01 * T, what);
    imp_problem *p = test_problem(ctx, s, "*.sigma_t.value");
    run.spp = spp / 2;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
    media_near(g[0], g_se[0] + 1e-9, -la * T, .03 * T, "... its derivative by the first");
    if (imp_problem_n_variables(p) > 1)
        media_near(g[1], g_se[1] + 1e-9, -lb * T, .03 * T, "... and by the second");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}
static void lengths(const char *text, double T, double la, double lb, const char *what)
{
    for (int k = 0; k < 3; k++) {
        printf("# %s\n", ends[k]);
        lengths_from(ends[k], text, T, la, lb, what);
    }
}

/* a from 0 to 1, b from .5 to 1.5. */
static void overlaps(void)
{
#define BOTH(ra, rb)                                                                     \
    MEDIUM("a", 1) MEDIUM("b", 0.5) CUBE(0, 1, FOG("a", ra)) CUBE(0.5, 1, FOG("b", rb))
    lengths(SCENE(BOTH(2, 1) LAMP EYE(-1)), exp(-1.25), 1, .5, "the first is above");
    lengths(SCENE(BOTH(1, 2) LAMP EYE(-1)), exp(-1.), .5, 1, "the second is above");
    lengths(SCENE(BOTH(3, 3) LAMP EYE(-1)), exp(-1.), .5, 1, "equals: the later one");
    lengths(SCENE(BOTH(2, 1) LAMP EYE(0.7)), exp(-.55), .3, .5, "a camera in both");
    lengths(SCENE(BOTH(2, 1) LAMP EYE(1.2)), exp(-.15), 0, .3, "a camera in the lower");

    /* A ray down through both to a white floor, which a lamp at z = 3 lights from above. */
#define FLOOR                                                                            \
    "<shape type='rectangle'><bsdf type='diffuse'><float name='reflectance' value='1'/>" \
    "</bsdf><transform name='to_world'><translate z='-1'/></transform></shape>"          \
    "<emitter type='point'><point name='position' x='0' y='0' z='3'/>"                   \
    "<float name='intensity' value='1'/></emitter><sensor type='orthographic'>"          \
    "<transform name='to_world'><scale value='0.001'/><lookat origin='0,0,2' "           \
    "target='0,0,0' up='0,1,0'/></transform>" FILM "</sensor>"
    for (int k = 0; k < 3; k += 2) /* few walks of the lamp meet what is seen */
        lengths_from(ends[k], SCENE(BOTH(2, 1) FLOOR), exp(-2.5) / 16 / M_PI, 2, 1,
                     "to a light sample");

    /* The lower one varies: 2 (z - .5). */
    float value[64];
    char path[64], text[8192];
    for (int i = 0; i < 64; i++) value[i] = (float)(2 * (i + .5) / 64);
    vol_write(path, 1, 1, 64, 1, value);
    snprintf(text, sizeof text,
             SCENE(MEDIUM("a", 1) "<medium type='heterogeneous' id='b'>"
                                  "<float name='albedo' value='0'/><volume "
                                  "name='sigma_t' type='gridvolume'><string "
                                  "name='filename' value='%s'/><transform "
                                  "name='to_world'><translate x='-0.5' y='-0.5' z='0.5'/>"
                                  "</transform></volume></medium>" CUBE(0, 1, FOG("a", 2))
                                      CUBE(0.5, 1, FOG("b", 1)) "%s"),
             path, FLOOR);
    /* From the lights, derivatives by extinctions that vary are refused. */
    lengths_from("volpath", text, exp(-2 * (1 + .75)) / 16 / M_PI, 2, 0,
                 "... by ratio tracking");
    remove(path);
}

/* Two copies of a fog, the second shifted by half: a fog of length 1.5. */
static void copies(void)
{
#define COPY(z)                                                                          \
    "<shape type='instance'><ref id='group'/><transform name='to_world'>"                \
    "<translate z='" #z "'/></transform></shape>"
    lengths(SCENE(MEDIUM("a", 1) "<shape type='shapegroup' id='group'>" CUBE(
                0, 1, FOG("a", 1)) "</shape>" COPY(0) COPY(0.5) LAMP EYE(-1)),
            exp(-1.5), 1.5, 0, "instances that overlap");
    lengths(SCENE(MEDIUM("a", 1) "<shape type='shapegroup' id='group'>" CUBE(
                0, 1, FOG("a", 1)) "</shape>" COPY(0) COPY(0.5) LAMP EYE(0.7)),
            exp(-.8), .8, 0, "a camera in both");
}

#define RANK(n) "<integer name='priority' value='" #n "'/>"
/* A liquid between two panes, lit by a sky that is brighter above. */
#define LIQUID                                                                           \
    "<medium type='homogeneous' id='a'><float name='sigma_t' value='2'/>"                \
    "<float name='albedo' value='0.8'/></medium>"
#define CLEAR(n, out)                                                                    \
    "<bsdf type='dielectric'><float name='int_ior' value='" #n                           \
    "'/><float name='ext_ior' value='" #out "'/></bsdf>"
#define FACE(z, inner)                                                                   \
    "<shape type='rectangle'>" inner                                                     \
    "<transform name='to_world'><scale x='30' y='30' z='1'/><translate z='" #z           \
    "'/></transform></shape>"
#define BACK(z, inner)                                                                   \
    "<shape type='rectangle'>" inner                                                     \
    "<transform name='to_world'><scale x='30' y='30' z='1'/><rotate x='1' angle='180'/>" \
    "<translate z='" #z "'/></transform></shape>"
#define SKIES                                                                            \
    "<emitter type='constant'><float name='radiance' value='0.3'/></emitter>"            \
    "<shape type='rectangle'><emitter type='area'><float name='radiance' value='2'/>"    \
    "</emitter><transform name='to_world'><scale value='3'/><rotate x='1' angle='180'/>" \
    "<translate z='3'/></transform></shape>"
static void glass(void)
{
    /* A pane to a face, and one boundary between the liquid and each pane. */
    const char *exact =
        SCENE(LIQUID FACE(1, CLEAR(1.5, 1))
                  FACE(0.8, CLEAR(1.33, 1.5) "<ref id='a' name='interior'/>")
                      BACK(0.2, CLEAR(1.33, 1.5) "<ref id='a' name='interior'/>")
                          BACK(0, CLEAR(1.5, 1)) SKIES EYE(-1));
    const char *overlapping = SCENE(
        LIQUID CUBE(0, 0.2, RANK(2) CLEAR(1.5, 1)) CUBE(0.8, 0.2, RANK(2) CLEAR(1.5, 1))
            CUBE(0.1, 0.8, RANK(1) CLEAR(1.33, 1) "<ref id='a' name='interior'/>")
                SKIES EYE(-1));
    double mean[2][3], se[2][3], g[2][3], g_se[2][3];
    for (int k = 0; k < 2; k++) {
        imp_scene *s = scene_from("volpath", k ? overlapping : exact);
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate v;
        run.spp = 8192;
        run.seed = 2;
        tap_ok(media_mean_run(ctx, s, &run, mean[k], se[k], IMP_DROP_MEDIUM) == 0,
               "no walk leaves by a hole");
        imp_problem *p = test_problem(ctx, s, "a.*.value");
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g[k], g_se[k]));
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
    /* Hidden boundaries are no vertices, so the walks are the same but for rounding. */
    tap_near(mean[1][0], mean[0][0], 1e-4, 0, "a liquid that reaches into its glass");
    for (int j = 0; j < 3; j++)
        tap_near(g[1][j], g[0][j], 1e-4, 0, "... and its derivative");
}

/* The same from the lights: an irradiance meter in air, behind a liquid that reaches into its
 * panes and scatters, under a lamp. */
#define LAMP_OF(size)                                                                    \
    "<shape type='rectangle'><emitter type='area'><float name='radiance' value='2'/>"    \
    "</emitter><transform name='to_world'><scale value='" #size                          \
    "'/><rotate x='1' angle='180'/><translate z='2'/></transform></shape>"
#define METER                                                                            \
    "<shape type='rectangle'><bsdf type='diffuse'><float name='reflectance' "            \
    "value='0'/></bsdf><transform name='to_world'><translate z='-0.5'/></transform>"     \
    "<sensor type='irradiancemeter'><film type='hdrfilm'><integer name='width' "         \
    "value='1'/><integer name='height' value='1'/><rfilter type='box'/></film>"          \
    "</sensor></shape>"
static void meter(void)
{
    const char *text = SCENE(
        LIQUID CUBE(0, 0.2, RANK(2) CLEAR(1.5, 1)) CUBE(0.8, 0.2, RANK(2) CLEAR(1.5, 1))
            CUBE(0.1, 0.8, RANK(1) CLEAR(1.33, 1) "<ref id='a' name='interior'/>")
                LAMP_OF(2) METER);
    double mean[3], se[3], g[3][3], g_se[3][3];
    for (int k = 0; k < 3; k++) {
        imp_scene *s = scene_from(ends[k], text);
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate v;
        run.spp = 1 << 16;
        run.seed = 3;
        imp_problem *p = test_problem(ctx, s, "a.*.value");
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g[k], g_se[k]));
        mean[k] = v.value;
        se[k] = v.se;
        tap_ok(v.se < .03 * v.value, "%s: a meter below a liquid # %.5f +- %.5f", ends[k],
               v.value, v.se);
        imp_problem_destroy(p);
        imp_scene_destroy(s);
        if (k == 0) continue;
        media_near(mean[k], hypot(se[0], se[k]), mean[0], .02 * mean[0],
                   "from the sensor");
        for (int j = 0; j < 2; j++)
            media_near(g[k][j], hypot(g_se[0][j], g_se[k][j]), g[0][j], .08 * mean[0],
                       "... a derivative");
    }
}

static void refused(const char *text, const char *why) { media_refused(ctx, text, why); }

int main(void)
{
    ctx = test_context(0);
    overlaps();
    copies();
    glass();
    meter();
    refused(SCENE(VOLPATH "<shape type='sphere'>" RANK(-1) "</shape>" EYE(-5)),
            "outside [0,");
    refused(SCENE(VOLPATH "<shape type='sphere'>" RANK(
                1) "<emitter type='area'/></shape>" EYE(-5)),
            "can be no light");
    refused(SCENE(VOLPATH MEDIUM("a", 1) "<shape type='sphere'>" RANK(
                1) "<bsdf type='null'/><ref id='a' name='exterior'/></shape>" EYE(-5)),
            "a priority and an exterior");
    refused(SCENE(VOLPATH "<shape type='sphere'>" RANK(
                1) "<bsdf type='roughdielectric'/></shape>" EYE(-5)),
            "is null or dielectric");
    refused("<scene version='3.0.0'><integrator type='path'/><shape type='sphere'>" RANK(
                1) "</shape></scene>",
            "does not support: volpath");
    refused(SCENE(VOLPATH MEDIUM("a", 1) CUBE(
                0, 1, FOG("a", 1)) "<sensor type='perspective'><transform "
                                   "name='to_world'><translate z='0.5'/></transform>"
                                   "<ref id='a'/></sensor>"),
            "whose priority settles");
    /* The integrator asks for priorities, so they are built before it is ready. */
    refused("<scene version='3.0.0'><integrator type='volpath'><integer name='split' "
            "value='2'/></integrator><shape type='sphere'>" RANK(1)
                CLEAR(1.5, 1) "</shape></scene>",
            "walks through media do not split");
    imp_context_destroy(ctx);
    return tap_done();
}
