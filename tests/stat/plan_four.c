/* SPDX-License-Identifier: Apache-2.0
 *
 * What planning is worth. In scenes drawn at random four pictures are chosen among 48 places on two
 * hemispheres, near and far, and compared with ten that are evenly spread over the far one, each set by
 * a plan of its own random numbers: in the median of the scenes four know the numbers as well, and they
 * know them better than four that are drawn at random.
 *
 * Argument long, or a number: 100 cases in place of one. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <importon/plan.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 48, EVEN = 10, TAKE = 4, SPP = 128 };
#define FAR   3.
#define NEAR  1.6
#define NOISE 0.05 /* of white, where a lamp's light on white paint is about 1 */

static imp_context *ctx;

/* ---- Scenes ---------------------------------------------------------------------------- */

/* Metal, plastic and paint on a floor, one lamp of unknown radiance, and a sky. */
static imp_scene *scene_make(struct imp_key key)
{
    static char xml[4096];
    const double a = 6.283185307179586 * imp__u01(key, 1),
                 d = 0.6 + 0.3 * imp__u01(key, 2);
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='5'/></integrator><sensor type='perspective' id='eye'><float name='fov' "
        "value='40'/><transform name='to_world'><lookat origin='0,1,3' target='0,.3,0' "
        "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='16'/>"
        "<integer name='height' value='12'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><scale value='1.5'/><rotate "
        "x='1' angle='-90'/></transform><bsdf type='diffuse' id='floor'><spectrum "
        "name='reflectance' value='%g'/></bsdf></shape>"
        "<shape type='sphere'><point name='center' x='%g' y='.35' z='%g'/><float "
        "name='radius' value='.35'/><bsdf type='roughconductor' id='metal'><float "
        "name='alpha' value='%g'/><string name='material' value='none'/><spectrum "
        "name='specular_reflectance' value='%g'/></bsdf></shape>"
        "<shape type='cube'><transform name='to_world'><scale value='.25'/><rotate y='1' "
        "angle='%g'/><translate x='%g' y='.25' z='%g'/></transform><bsdf "
        "type='roughplastic' id='plastic'><float name='alpha' value='%g'/><spectrum "
        "name='diffuse_reflectance' value='%g'/></bsdf></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='.3'/><rotate "
        "x='1' angle='90'/><translate x='%g' y='2.5' z='%g'/></transform><emitter "
        "type='area' id='lamp'><spectrum name='radiance' value='%g'/></emitter></shape>"
        "<emitter type='constant' id='sky'><spectrum name='radiance' value='%g'/>"
        "</emitter></scene>",
        0.3 + 0.5 * imp__u01(key, 3), d * cos(a), d * sin(a),
        0.1 + 0.3 * imp__u01(key, 4), 0.5 + 0.4 * imp__u01(key, 5), 90 * imp__u01(key, 6),
        -d * cos(a), -d * sin(a), 0.1 + 0.2 * imp__u01(key, 7),
        0.2 + 0.6 * imp__u01(key, 8), 1.6 * imp__u01(key, 9) - 0.8,
        1.6 * imp__u01(key, 10) - 0.8, 8 + 6 * imp__u01(key, 11),
        0.1 + 0.3 * imp__u01(key, 12));
    return test_scene_text(ctx, xml, IMP_MONO);
}

static imp_problem *problem_make(imp_scene *s)
{
    static const char *const globs[] = {"floor.reflectance.value",
                                        "metal.alpha.value",
                                        "metal.specular_reflectance.value",
                                        "plastic.alpha.value",
                                        "plastic.diffuse_reflectance.value",
                                        "lamp.radiance.value",
                                        "sky.radiance.value"};
    imp_problem *p;
    test_must(ctx, imp_problem_create(s, &p));
    for (size_t k = 0; k < sizeof globs / sizeof *globs; k++)
        test_must(ctx, imp_problem_activate(p, globs[k]));
    return p;
}

/* ---- Places ---------------------------------------------------------------------------- */

/* Place k of n on the upper hemisphere, evenly by Fibonacci's spiral, turned by `turn`. */
static struct imp_plan_candidate place(int k, int n, double radius, double turn)
{
    struct imp_plan_candidate c = IMP_PLAN_CANDIDATE_INIT;
    const double y = 0.15 + 0.8 * (k + 0.5) / n, r = sqrt(1 - y * y),
                 angle = turn + k * 2.399963229728653;
    c.placed = true;
    c.origin[0] = radius * r * cos(angle);
    c.origin[1] = radius * y;
    c.origin[2] = radius * r * sin(angle);
    c.target[1] = 0.3;
    c.up[1] = 1;
    return c;
}

static const struct imp_plan_result *planned(imp_problem *p, struct imp_plan_candidate *c,
                                             size_t n, size_t take, uint64_t seed)
{
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_plan_result *r;
    o.read = NOISE;
    o.take = take;
    run.spp = SPP;
    run.seed = seed;
    test_must(ctx, imp_plan(p, c, n, &o, &run, &r));
    return r;
}

/* Mean logarithm of the standard deviations of all numbers after the pictures of a set. */
static double known(imp_problem *p, const struct imp_plan_candidate *set, int n,
                    uint64_t seed)
{
    struct imp_plan_candidate c[EVEN + 1];
    for (int k = 0; k < n; k++) {
        c[k] = set[k];
        c[k].have = true;
    }
    c[n] = place(0, PLACES, FAR, 0); /* a plan ranks something */
    const struct imp_plan_result *r = planned(p, c, (size_t)n + 1, 1, seed);
    double sum = 0;
    for (size_t i = 0; i < r->n; i++)
        sum += log(isfinite(r->today[i]) ? r->today[i] : 10) / (double)r->n;
    return sum;
}

static void one_case(int k, double *four_ten, double *four_drawn)
{
    const struct imp_key key = imp__key(91, 1, (uint64_t)k);
    const uint64_t seed = 5000 + 10 * (uint64_t)k;
    const double turn = 6.283185307179586 * imp__u01(key, 20);
    imp_scene *s = scene_make(key);
    imp_problem *p = problem_make(s);
    struct imp_plan_candidate all[PLACES], four[TAKE], ten[EVEN], drawn[TAKE];
    for (int i = 0; i < PLACES; i++)
        all[i] = place(i / 2, PLACES / 2, i % 2 ? NEAR : FAR, turn);
    for (int i = 0; i < EVEN; i++) ten[i] = place(i, EVEN, FAR, turn);
    for (uint32_t i = 0; i < TAKE; i++)
        drawn[i] =
            all[(int)(imp__u01(key, 30 + i) * PLACES / TAKE) + (int)i * PLACES / TAKE];
    const struct imp_plan_result *r = planned(p, all, PLACES, TAKE, seed);
    for (size_t i = 0; i < TAKE; i++) four[i] = all[r->chosen[i]];
    const double by_four = known(p, four, TAKE, seed + 1);
    *four_ten = exp(by_four - known(p, ten, EVEN, seed + 2));
    *four_drawn = exp(by_four - known(p, drawn, TAKE, seed + 3));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
    const int given = argc > 1 ? atoi(argv[1]) : 0;
    const int cases = argc > 1 && !strcmp(argv[1], "long") ? 100 : given > 0 ? given : 1;
    double *ten = calloc(2 * (size_t)cases, sizeof *ten), *drawn = ten + cases;
    ctx = test_context(2);
    if (!ten) return 99;
    int better = 0;
    for (int k = 0; k < cases; k++) {
        one_case(k, &ten[k], &drawn[k]);
        printf("# case %d: four chosen over ten even %.3f, over four drawn %.3f\n", k,
               ten[k], drawn[k]);
        fflush(stdout);
        better += drawn[k] < 1;
    }
    qsort(ten, (size_t)cases, sizeof *ten, by_size);
    qsort(drawn, (size_t)cases, sizeof *drawn, by_size);
    tap_ok(ten[cases / 2] <= 1, "four know as much as ten # median of intervals %.3f",
           ten[cases / 2]);
    tap_ok(better >= cases - cases / 20 && drawn[cases / 2] < 0.9,
           "and more than four that are drawn # in %d of %d, median %.3f", better, cases,
           drawn[cases / 2]);
    free(ten);
    imp_context_destroy(ctx);
    return tap_done();
}
