/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses of light walks and from both ends, and of linear functions of their
 * pictures: values and gradients against those of walks from the sensor, whose adjoints
 * leave out one walk at a time, and standard errors against the spread of fresh seeds; at
 * the optimum and away from it, through a box and through filters that share walks. */
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

enum { W = 6, H = 4, N = 6, SEEDS = 160, SPP = 32 };

static imp_context *ctx;

/* clang-format off: literals are broken where the markup is */
#define ROOM                                                                             \
    "<scene version='3.0.0'><integrator type='%s'><integer name='max_depth' value='4'/>" \
    "</integrator><shape type='cube'>" AT(                                               \
        "<scale value='2'/>") "<boolean name='flip_normals' value='true'/><bsdf "        \
                              "type='diffuse' id='wall'><rgb "                           \
                              "name='reflectance' "                                      \
                              "value='.6,.5,.4'/></bsdf></shape><shape "                 \
                              "type='rectangle'>" AT(                                    \
                                  "<scale x='.6' y='.6'/><rotate x='1' "                 \
                                  "angle='90'/><translate y='1.95'/>") "<emitter "       \
                                                                       "type='area' "    \
                                                                       "id='lamp'><rgb " \
                                                                       "name='radiance'" \
                                                                       " value='5,4,3'/" \
                                                                       "></emitter>"     \
                                                                       "</"              \
                                                                       "shape><sensor "  \
                                                                       "type='"          \
                                                                       "perspective'><"  \
                                                                       "float "          \
                                                                       "name='fov' "     \
                                                                       "value='50'/"     \
                                                                       ">" AT(           \
                                                                           "<lookat "    \
                                                                           "origin='0,"  \
                                                                           "0,1.9' "     \
                                                                           "target='0,"  \
                                                                           "0,0' "       \
                                                                           "up='0,1,0'/" \
                                                                           ">") "<film " \
                                                                                "type='" \
                                                                                "hdrfil" \
                                                                                "m'><"   \
                                                                                "intege" \
                                                                                "r "     \
                                                                                "name='" \
                                                                                "width'" \
                                                                                " value" \
                                                                                "='6'/"  \
                                                                                "><"     \
                                                                                "intege" \
                                                                                "r "     \
                                                                                "name='" \
                                                                                "height" \
                                                                                "' "     \
                                                                                "value=" \
                                                                                "'4'/"   \
                                                                                "><"     \
                                                                                "rfilte" \
                                                                                "r "     \
                                                                                "type='" \
                                                                                "%s'/"   \
                                                                                "></"    \
                                                                                "film><" \
                                                                                "/senso" \
                                                                                "r></"   \
                                                                                "scene>"
/* clang-format on */

static imp_scene *room(const char *integrator, const char *filter)
{
    char xml[4096];
    snprintf(xml, sizeof xml, ROOM, integrator, filter);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* The mean picture. */
static void picture(const char *filter, float *pixels)
{
    imp_scene *scene = room("path", filter);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 8192;
    run.seed = 77;
    test_must(ctx, imp_render(scene, &run, &film));
    memcpy(pixels, imp_film_mean(film), sizeof(float) * 3 * W * H);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

static imp_problem *problem_of(imp_scene *scene, const float *target)
{
    imp_problem *p = test_problem(ctx, scene, "*.reflectance.value");
    test_must(ctx, imp_problem_activate(p, "*.radiance.value"));
    if (target) {
        struct imp_target t = IMP_TARGET_INIT;
        t.width = W;
        t.height = H;
        t.channels = 3;
        t.pixels = target;
        test_must(ctx, imp_problem_add_target(p, &t));
    }
    return p;
}

struct answer {
    struct imp_estimate value;
    double g[N], se[N];
};

static void ask(imp_problem *p, const float *adjoint, int spp, uint64_t seed,
                struct answer *a)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = seed;
    run.points = IMP_POINTS_INDEPENDENT;
    test_must(ctx, adjoint
                       ? imp_problem_functional(p, adjoint, &run, &a->value, a->g, a->se)
                       : imp_problem_objective(p, NULL, &run, &a->value, a->g, a->se));
}

static double ratio(const struct tap_stat *s, double told)
{
    return sqrt(s->m2 / (s->n - 1) / (told / s->n));
}

static void compare(const char *integrator, const char *filter, const float *target,
                    const float *adjoint, const char *what)
{
    imp_scene *scene = room(integrator, filter), *eye = room("path", filter);
    imp_problem *p = problem_of(scene, target), *q = problem_of(eye, target);
    struct answer truth, a;
    struct tap_stat value = {0}, g[N] = {{0}};
    double told = 0, told_g[N] = {0}, worst = 0, least = 9, most = 0;
    if (imp_problem_n_variables(p) != N) test_must(ctx, IMP_E_ARG);
    ask(q, adjoint, 4096, 5, &truth);
    for (int i = 0; i < SEEDS; i++) {
        ask(p, adjoint, SPP, 1000 + (uint64_t)i, &a);
        tap_add(&value, a.value.value);
        told += a.value.se * a.value.se;
        for (int k = 0; k < N; k++) {
            tap_add(&g[k], a.g[k]);
            told_g[k] += a.se[k] * a.se[k];
        }
    }
    const double z =
        (value.mean - truth.value.value) / hypot(tap_se(&value), truth.value.se);
    for (int k = 0; k < N; k++) {
        const double r = ratio(&g[k], told_g[k]);
        worst =
            fmax(worst, fabs(g[k].mean - truth.g[k]) / hypot(tap_se(&g[k]), truth.se[k]));
        least = fmin(least, r);
        most = fmax(most, r);
    }
    tap_ok(fabs(z) < 4 && worst < 4.5,
           "%s, %s, %s: %.6g +- %.1g, by the sensor %.6g # z %.2f, of %d gradients %.2f",
           integrator, filter, what, value.mean, tap_se(&value), truth.value.value, z, N,
           worst);
    const double r = ratio(&value, told);
    tap_ok(r > .85 && r < 1.2 && least > .85 && most < 1.2,
           "%s, %s, %s: spread of %d seeds over error # %.3f, of gradients %.3f to %.3f",
           integrator, filter, what, SEEDS, r, least, most);
    imp_problem_destroy(p);
    imp_problem_destroy(q);
    imp_scene_destroy(scene);
    imp_scene_destroy(eye);
}

/* ---- Films of any number of response curves ------------------------------------------ */

/* clang-format off */
static const char meter[] =
    "<scene version='3.0.0'><integrator type='bdpt'><integer name='max_depth' value='4'/>"
    "</integrator><shape type='cube'>" AT("<scale value='2'/>")
    "<boolean name='flip_normals' value='true'/><bsdf type='diffuse' id='wall'><spectrum "
    "name='reflectance' value='400:.3,700:.7'/></bsdf></shape><shape type='sphere'><point "
    "name='center' value='.4,.9,0'/><float name='radius' value='.3'/><emitter type='area' "
    "id='lamp'><spectrum name='radiance' value='400:3,700:6'/></emitter></shape><shape "
    "type='rectangle'>"
    AT("<scale value='.8'/><rotate x='1' angle='-90'/><translate y='-1.9'/>")
    "<sensor type='irradiancemeter'><film type='specfilm'><integer name='width' "
    "value='1'/><integer name='height' value='1'/>%s</film></sensor></shape></scene>";
/* clang-format on */

/* A reading of n curves as the target: its loss and gradient, and what lm finds of the
 * lamp from it. */
static void curves(int n, enum imp_from from, const char *name)
{
    char xml[4096], list[1024] = "";
    float target[8];
    for (int k = 0; k < n; k++)
        snprintf(list + strlen(list), sizeof list - strlen(list),
                 "<spectrum name='c%d' value='%d:0,%d:.01,%d:0'/>", k, 400 + 300 * k / n,
                 400 + 300 * k / n + 150 / n, 400 + 300 * (k + 1) / n);
    snprintf(xml, sizeof xml, meter, list);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_SPECTRAL);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 100000;
    run.from = IMP_FROM_SENSOR;
    test_must(ctx, imp_render(scene, &run, &film));
    for (int k = 0; k < n; k++) target[k] = imp_film_mean(film)[k] * 1.3f;
    imp_film_destroy(film);
    imp_problem *p = test_problem(ctx, scene, "wall.*");
    test_must(ctx, imp_problem_activate(p, "lamp.*"));
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = 1;
    t.channels = n;
    t.pixels = target;
    test_must(ctx, imp_problem_add_target(p, &t));
    struct answer eye, other;
    double worst = 0, resolved = 0;
    run.spp = 20000;
    run.seed = 3;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &eye.value, eye.g, eye.se));
    run.from = from;
    run.seed = 4;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &other.value, other.g, other.se));
    for (size_t k = 0; k < imp_problem_n_variables(p); k++) {
        const double se = hypot(eye.se[k], other.se[k]);
        worst = fmax(worst, fabs(eye.g[k] - other.g[k]) / se);
        resolved += fabs(eye.g[k]) > 10 * se;
    }
    const double z =
        (eye.value.value - other.value.value) / hypot(eye.value.se, other.value.se);
    /* Errors from 8 groups: t of 7 degrees of freedom, of which 1 in 10^4 is beyond 7.9. */
    tap_ok(fabs(z) < 7.9 && worst < 7.9 && resolved > 0,
           "%d curves from %s: loss %.5g and %.5g, %zu derivatives # z %.2f, worst %.2f",
           n, name, eye.value.value, other.value.value, imp_problem_n_variables(p), z,
           worst);
    imp_problem_destroy(p);

    p = test_problem(ctx, scene, "lamp.*");
    test_must(ctx, imp_problem_add_target(p, &t));
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    const double start[2] = {4.4, 5.5}, truth[2] = {3.9, 7.8};
    test_must(ctx, imp_problem_set_x(p, start));
    o.optimizer = IMP_LM;
    o.max_iterations = 6;
    run.spp = 10000;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    worst = 0;
    for (int k = 0; k < 2; k++)
        worst = fmax(worst, fabs(r->variables[k].value / truth[k] - 1));
    /* One curve does not tell two numbers. */
    if (n > 1)
        tap_ok(worst < .05, "%d curves from %s: lm finds the lamp # within %.2g", n, name,
               worst);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const char *const ends[] = {"ptracer", "bdpt"}, *const filters[] = {
                                                               "box", "gaussian"};
    float pixels[3 * W * H], away[3 * W * H], adjoint[3 * W * H];
    ctx = test_context(2);
    for (int f = 0; f < 2; f++) {
        picture(filters[f], pixels);
        for (int i = 0; i < 3 * W * H; i++) {
            away[i] = pixels[i] * (i % 2 ? 1.3f : .6f);
            adjoint[i] = (float)(i % 5) - 1;
        }
        for (int e = 0; e < 2; e++) {
            if (!is_long && e != f) continue; /* each end and each filter once */
            compare(ends[e], filters[f], away, NULL, "loss away from the optimum");
            compare(ends[e], filters[f], pixels, NULL, "loss at the optimum");
            compare(ends[e], filters[f], NULL, adjoint, "linear");
        }
    }
    curves(5, IMP_FROM_LIGHTS, "the lights");
    curves(5, IMP_FROM_SCENE, "both ends");
    if (is_long) curves(1, IMP_FROM_LIGHTS, "the lights");
    imp_context_destroy(ctx);
    return tap_done();
}
