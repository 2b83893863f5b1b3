/* SPDX-License-Identifier: Apache-2.0
 *
 * Plans whose answer is known by hand: cameras that see nothing but a lamp, so that every pixel is
 * its radiance and J is 1. Information adds, criteria are logarithms, and what no camera sees is
 * named. Bad input is refused by name, and the scene is as before. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/plan.h>
#include <math.h>

#define CAMERA(id, x, side, film)                                                        \
    "<sensor type='perspective' id='" id "'><float name='fov' value='20'/>"              \
    "<transform name='to_world'><lookat origin='" x ",0,2' target='" x                   \
    ",0,0' up='0,1,0'/></transform>"                                                     \
    "<film type='hdrfilm'><integer name='width' value='" side                            \
    "'/><integer name='height' value='" side "'/><rfilter type='box'/>" film             \
    "</film></sensor>"
#define LAMP(id, x, radiance)                                                            \
    "<shape type='rectangle'><transform name='to_world'><translate x='" x                \
    "'/></transform><emitter type='area' id='" id                                        \
    "'><spectrum name='radiance' value='" radiance "'/></emitter></shape>"

static const char xml[] = "<scene version='3.0.0'><integrator type='path'/>" CAMERA(
    "first", "0", "4", "") CAMERA("second", "10", "3", "") CAMERA("beside", "30", "4", "")
    CAMERA("exposed", "0", "5", "<float name='exposure' value='.5'/>")
        CAMERA("photo", "0", "4",
               "<float name='exposure' value='.25'/><float name='gamma' value='2.2'/>")
            LAMP("one", "0", "3") LAMP("two", "10", "5") "</scene>";

enum { FIRST, SECOND, BESIDE, EXPOSED, PHOTO };

static imp_context *ctx;
static imp_scene *scene;

static struct imp_plan_candidate view(int sensor)
{
    struct imp_plan_candidate c = IMP_PLAN_CANDIDATE_INIT;
    c.sensor = sensor;
    return c;
}

static const struct imp_plan_result *planned(imp_problem *p,
                                             const struct imp_plan_candidate *c, size_t n,
                                             const struct imp_plan_options *o)
{
    const struct imp_plan_result *r = NULL;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 16;
    test_must(ctx, imp_plan(p, c, n, o, &run, &r));
    return r;
}

static void information(void)
{
    imp_problem *p = test_problem(ctx, scene, "*.radiance.value");
    struct imp_plan_candidate c[3] = {view(FIRST), view(SECOND), view(SECOND)};
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    c[2].time = 2;
    o.read = 0.1;
    const struct imp_plan_result *r = planned(p, c, 3, &o);
    /* Priors: the numbers' sizes, 3 and 5. */
    const double I[3] = {16 / 0.01, 9 / 0.01, 9 * 4 / 0.01};
    const double gain[3] = {log(1 + 9 * I[0]) / 2, log(1 + 25 * I[1]) / 2,
                            log(1 + 25 * I[2]) / 2};
    const size_t order[3] = {2, 1, 0};
    for (size_t k = 0; k < 3; k++) {
        const struct imp_plan_row *row = IMP_ROW(imp_plan_row, r->rows, k);
        const size_t i = order[k], sees = i > 0;
        tap_ok(row->candidate == i && row->group == k, "rank %zu # candidate %zu", k + 1,
               row->candidate);
        tap_near(row->information[sees * 2 + sees], I[i], 1e-6, 0, "information");
        tap_ok(row->information[1] == 0 && row->information_se[sees * 3] < 1e-6 * I[i],
               "nothing on the other lamp, and no error");
        tap_near(row->gain.value, gain[i], 1e-6, 0, "gain");
        tap_near(row->se[sees], 1 / sqrt(I[i] + 1 / (sees ? 25. : 9.)), 1e-6, 0, "sigma");
        tap_ok(isinf(row->se[!sees]), "the other one is not determined");
        tap_ok(row->lit == 1, "all pixels count");
    }
    tap_ok(isinf(r->today[0]) && isinf(r->today[1]), "nothing is known today");
    tap_ok(r->n_loose == 0, "all together determine both");
    tap_ok(r->n_chosen == 1 && r->chosen[0] == 2, "the best one is chosen");

    c[0].have = true;
    o.take = 2;
    r = planned(p, c, 3, &o);
    tap_near(r->today[0], 1 / sqrt(I[0] + 1 / 9.), 1e-6, 0, "known today");
    tap_ok(r->n_rows == 2 && r->n_chosen == 2, "what we have is not ranked");
    tap_near(r->chosen_se[1], 1 / sqrt(I[1] + I[2] + 1 / 25.), 1e-6, 0,
             "informations of the chosen add");
    tap_near(r->chosen_gain.value, log(1 + 25 * (I[1] + I[2])) / 2, 1e-6, 0,
             "and the gain is the determinant's");
    imp_problem_destroy(p);
}

static void criteria(void)
{
    imp_problem *p = test_problem(ctx, scene, "*.radiance.value");
    struct imp_plan_candidate c[2] = {view(FIRST), view(SECOND)};
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    const double prior[2] = {0.02, 0.5}, I[2] = {1600, 900};
    const size_t of[1] = {0};
    o.read = 0.1;
    o.prior = prior;
    o.criterion = IMP_PLAN_A;
    const struct imp_plan_result *r = planned(p, c, 2, &o);
    for (size_t k = 0; k < 2; k++) {
        const struct imp_plan_row *row = IMP_ROW(imp_plan_row, r->rows, k);
        const size_t i = row->candidate;
        const double left = 1 / (1 + prior[i] * prior[i] * I[i]);
        tap_near(row->gain.value, log(2 / (1 + left)), 1e-6, 0, "A: traces");
    }
    tap_near(r->today[0], 0.02, 1e-12, 0, "a prior is known today");
    o.criterion = IMP_PLAN_D;
    o.of = of;
    o.n_of = 1;
    r = planned(p, c, 2, &o);
    tap_ok(r->rows[0].candidate == 0, "one wanted number: the camera that sees it");
    tap_near(r->rows[0].gain.value, log(1 + 4e-4 * I[0]), 1e-6, 0, "c: its variance");
    tap_near(IMP_ROW(imp_plan_row, r->rows, 1)->gain.value, 0, 0, 1e-12,
             "the other brings nothing");
    c[1].cost = 100;
    o.of = NULL;
    o.n_of = 0;
    r = planned(p, c, 2, &o);
    tap_ok(r->rows[0].candidate == 0, "costs weigh");
    tap_near(r->rows[0].worth.value, log(1 + 4e-4 * I[0]) / 2, 1e-6, 0, "worth");
    o.budget = 50;
    r = planned(p, c, 2, &o);
    tap_ok(r->n_chosen == 1 && r->chosen[0] == 0, "a budget");
    imp_problem_destroy(p);
}

/* D = read^2/t^2 + shot v/t + (relative v)^2, saturation, and repeated candidates. */
static void noise(void)
{
    imp_problem *p = test_problem(ctx, scene, "one.radiance.value");
    struct imp_plan_candidate c[2] = {view(FIRST), view(FIRST)};
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    o.read = 0.3;
    o.shot = 0.02;
    o.relative = 0.01;
    o.white = 10;
    c[0].time = 2;
    c[1].time = 4; /* 4 times 3 is saturated */
    const struct imp_plan_result *r = planned(p, c, 2, &o);
    const double D = 0.09 / 4 + 0.02 * 3 / 2 + 9e-4;
    tap_near(r->rows[0].information[0], 16 / D, 1e-6, 0, "noise of an exposure");
    tap_ok(IMP_ROW(imp_plan_row, r->rows, 1)->lit == 0, "a saturated one tells nothing");
    imp_problem_destroy(p);
}

static void lamps(void)
{
    imp_problem *p = test_problem(ctx, scene, "*.radiance.value");
    struct imp_plan_candidate c[2] = {view(FIRST), view(SECOND)};
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    o.read = 0.1;
    c[0].lamps = "one";
    c[1].lamps = "o*,none";
    const struct imp_plan_result *r = planned(p, c, 2, &o);
    tap_ok(r->rows[0].candidate == 0, "a lamp that is on");
    tap_near(r->rows[0].information[0], 1600, 1e-6, 0, "tells of itself");
    const struct imp_plan_row *off = IMP_ROW(imp_plan_row, r->rows, 1);
    tap_ok(off->information[3] == 0 && off->lit == 0, "one that is off is black");
    tap_ok(r->n_loose == 1 && fabs(fabs(r->loose[1]) - 1) < 1e-9,
           "and stays undetermined, by name");
    tap_ok(imp_plan_lamp(scene, 1) && !strcmp(imp_plan_lamp(scene, 1), "two") &&
               !imp_plan_lamp(scene, 2) && !imp_plan_lamp(scene, -1),
           "names of lamps");
    imp_problem_destroy(p);
}

/* exposure e times radiance L: along e dL + L de = 0 nothing changes. */
static void product(void)
{
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "one.radiance.value"));
    test_must(ctx, imp_problem_activate(p, "exposed.exposure.value"));
    const struct imp_plan_candidate c = view(EXPOSED);
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    o.read = 0.01;
    const struct imp_plan_result *r = planned(p, &c, 1, &o);
    tap_ok(r->n == 2 && r->n_loose == 1, "a product leaves one direction");
    const size_t lamp = test_variable(p, scene, ctx, "one.radiance.value"), e = 1 - lamp;
    const double dL = r->loose[lamp] * r->span[lamp], de = r->loose[e] * r->span[e];
    tap_near(0.5 * dL + 3 * de, 0, 0, 1e-6 * fabs(dL), "that leaves the product");
    tap_near(r->rows[0].information[lamp * 2 + e], 25 / 1e-4 * 0.5 * 3, 1e-5, 0,
             "information of both");
    imp_problem_destroy(p);
}

/* A photograph M = g L = V^gamma tells of L and of gamma what its linear values do:
 * dM/dgamma = M log V. */
static void photograph(void)
{
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "one.radiance.value"));
    test_must(ctx, imp_problem_activate(p, "photo.gamma.value"));
    const struct imp_plan_candidate c = view(PHOTO);
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    o.read = 0.01;
    o.shot = 0.001;
    const struct imp_plan_result *r = planned(p, &c, 1, &o);
    const size_t lamp = test_variable(p, scene, ctx, "one.radiance.value"), g = 1 - lamp;
    const double M = 0.75, D = 1e-4 + 0.001 * M, slope = M * log(M) / 2.2;
    const double *I = r->rows[0].information;
    tap_near(I[lamp * 2 + lamp], 16 * 0.0625 / D, 1e-5, 0, "a photograph and a lamp");
    tap_near(I[g * 2 + g], 16 * slope * slope / D, 1e-5, 0, "and its gamma");
    tap_near(fabs(I[1]), fabs(16 * 0.25 * slope / D), 1e-5, 0, "and both");
    imp_problem_destroy(p);
}

/* A film of luminances in a scene of colours. */
static void luminance(void)
{
    static const char colours[] =
        "<scene version='3.0.0'><integrator type='path'/><sensor "
        "type='perspective'><float "
        "name='fov' value='20'/><transform name='to_world'><lookat origin='0,0,2' "
        "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
        "name='width' "
        "value='4'/><integer name='height' value='2'/><string name='pixel_format' "
        "value='luminance'/><rfilter type='box'/></film></sensor><shape type='rectangle'>"
        "<emitter type='area' id='one'><rgb name='radiance' value='1,2,3'/></emitter>"
        "</shape></scene>";
    imp_scene *s = test_scene_text(ctx, colours, IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "one.radiance.value");
    const struct imp_plan_candidate c = view(0);
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    const double w[3] = {0.212671, 0.715160, 0.072169};
    double worst = 0;
    o.read = 0.1;
    const struct imp_plan_result *r = planned(p, &c, 1, &o);
    for (size_t k = 0; k < 9; k++)
        worst = fmax(worst,
                     fabs(r->rows[0].information[k] / (800 * w[k / 3] * w[k % 3]) - 1));
    tap_near(worst, 0, 0, 1e-5, "luminances of three colours");
    tap_ok(r->n_loose == 2, "leave two combinations open");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A camera that is placed sees what one that stands there sees. */
static void places(void)
{
    imp_problem *p = test_problem(ctx, scene, "*.radiance.value");
    struct imp_plan_candidate c[2] = {view(FIRST), view(BESIDE)};
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *before, *after;
    o.read = 0.1;
    c[0].placed = true;
    c[0].origin[0] = c[0].target[0] = 10;
    c[0].origin[2] = 2;
    c[0].up[1] = 1;
    c[0].lamps = "two";
    run.spp = 4;
    test_must(ctx, imp_render(scene, &run, &before));
    const struct imp_plan_result *r = planned(p, c, 2, &o);
    test_must(ctx, imp_render(scene, &run, &after));
    tap_ok(r->rows[0].candidate == 0, "a placed camera");
    tap_near(r->rows[0].information[3], 1600, 1e-6, 0, "sees the other lamp");
    tap_ok(!memcmp(imp_film_mean(before), imp_film_mean(after), 16 * sizeof(float)),
           "the scene is as before");
    imp_film *maps[3];
    double sum = 0, criterion = 0;
    test_must(ctx, imp_plan_map(p, &c[0], &o, &run, r->rows[0].pull, maps));
    for (int i = 0; i < 16; i++) {
        sum += (double)imp_film_mean(maps[1])[i];
        criterion += (double)imp_film_mean(maps[2])[i];
    }
    tap_near(sum, 1600, 1e-5, 0, "a map adds up to the information");
    tap_near(criterion, r->rows[0].pull[3] * 1600, 1e-5, 0, "and to its pull");
    for (int i = 0; i < 3; i++) imp_film_destroy(maps[i]);
    imp_film_destroy(before);
    imp_film_destroy(after);
    imp_problem_destroy(p);
}

/* A lamp in the dark covers most pixels as seen from its front: a camera at 60 degrees, moved along
 * the derivative, comes near to it. */
static void improved(void)
{
    static const char lamp[] =
        "<scene version='3.0.0'><integrator type='path'/><sensor "
        "type='perspective'><float "
        "name='fov' value='60'/><film type='hdrfilm'><integer name='width' value='12'/>"
        "<integer name='height' value='12'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><scale "
        "value='.5'/></transform>"
        "<emitter type='area' id='one'><spectrum name='radiance' value='1'/></emitter>"
        "</shape></scene>";
    imp_scene *s = test_scene_text(ctx, lamp, IMP_MONO);
    imp_problem *p = test_problem(ctx, s, "one.radiance.value");
    struct imp_plan_candidate c = IMP_PLAN_CANDIDATE_INIT;
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate gain;
    double origin[3];
    o.read = 0.1;
    run.spp = 256;
    c.placed = true;
    c.origin[0] = 2 * sin(1.05);
    c.origin[2] = 2 * cos(1.05);
    c.up[1] = 1;
    const struct imp_plan_result *r;
    test_must(ctx, imp_plan(p, &c, 1, &o, &run, &r));
    const struct imp_estimate before = r->rows[0].gain;
    test_must(ctx, imp_plan_improve(p, &c, 1, &o, &run, 20, origin, &gain));
    const double length =
        sqrt(origin[0] * origin[0] + origin[1] * origin[1] + origin[2] * origin[2]);
    tap_near(length, 2, 1e-9, 0, "an improved camera keeps its distance");
    tap_ok(acos(origin[2] / length) < 0.5 &&
               gain.value - before.value > 5 * hypot(gain.se, before.se),
           "and comes to where it sees more # %.2f rad, gain %.3f +- %.3f, before %.3f",
           acos(origin[2] / length), gain.value, gain.se, before.value);
    c.placed = false;
    tap_ok(imp_plan_improve(p, &c, 1, &o, &run, 20, origin, &gain) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "placed"),
           "what is not placed cannot be moved # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void refused(imp_problem *p, const struct imp_plan_candidate *c, size_t n,
                    const struct imp_plan_options *o, enum imp_status expected,
                    const char *part)
{
    const struct imp_plan_result *r = NULL;
    const enum imp_status st = imp_plan(p, c, n, o, NULL, &r);
    tap_ok(st == expected && !r && strstr(imp_last_error(ctx), part), "refused: %s # %s",
           part, imp_last_error(ctx));
}

static void errors(void)
{
    imp_problem *p = test_problem(ctx, scene, "*.radiance.value");
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    struct imp_plan_candidate c = view(FIRST);
    const size_t far[1] = {7};
    c.name = "mine";
    refused(p, &c, 0, &o, IMP_E_ARG, "0 candidates");
    o.take = 2;
    refused(p, &c, 1, &o, IMP_E_ARG, "2 of 1 candidates");
    o.take = 0;
    o.of = far;
    o.n_of = 1;
    refused(p, &c, 1, &o, IMP_E_ARG, "of[0] = 7");
    o.n_of = 0;
    o.read = NAN;
    refused(p, &c, 1, &o, IMP_E_ARG, "read");
    o.read = 0.1;
    c.cost = -1;
    refused(p, &c, 1, &o, IMP_E_ARG, "mine): cost");
    c.cost = 0;
    c.time = NAN;
    refused(p, &c, 1, &o, IMP_E_ARG, "mine): time");
    c.time = 0;
    c.lamps = "three";
    refused(p, &c, 1, &o, IMP_E_ARG, "mine: there is no lamp 'three'");
    c.lamps = NULL;
    c.have = true;
    refused(p, &c, 1, &o, IMP_E_ARG, "none to be ranked");
    c.have = false;
    c.placed = true;
    refused(p, &c, 1, &o, IMP_E_ARG, "mine: origin and target are equal");
    c.placed = false;
    c.sensor = 9;
    refused(p, &c, 1, &o, IMP_E_ARG, "no sensor 9");
    c.sensor = BESIDE;
    refused(p, &c, 1, &o, IMP_E_ARG, "all values of all of them, mine");
    imp_problem_destroy(p);
    test_must(ctx, imp_problem_create(scene, &p));
    refused(p, &c, 1, &o, IMP_E_ARG, "0 numbers are active");
    imp_problem_destroy(p);
}

/* Every allocation fails in turn: nothing leaks, and the scene stands as before. */
static imp_problem *fragile;
static enum imp_status plan_and_map(imp_context *unused)
{
    const struct imp_plan_result *r;
    struct imp_plan_options o = IMP_PLAN_OPTIONS_INIT;
    struct imp_plan_candidate c[2] = {view(FIRST), view(SECOND)};
    struct imp_run run = IMP_RUN_INIT;
    const double pull[4] = {1, 0, 0, 1};
    imp_film *maps[3];
    (void)unused;
    run.spp = 4;
    c[0].placed = true;
    c[0].origin[2] = 1.9;
    c[0].lamps = "one";
    c[1].have = true;
    enum imp_status st = imp_plan(fragile, c, 2, &o, &run, &r);
    if (st == IMP_OK) st = imp_plan_map(fragile, c, &o, &run, pull, maps);
    for (int k = 0; st == IMP_OK && k < 3; k++) imp_film_destroy(maps[k]);
    return st;
}
static void memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *own = fail_alloc_context(&heap);
    imp_scene *s = test_scene_text(own, xml, IMP_MONO);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *before, *after;
    run.spp = 4;
    test_must(own, imp_render(s, &run, &before));
    fragile = test_problem(own, s, "*.radiance.value");
    const int n = fail_alloc_in_turn(&heap, plan_and_map, own);
    tap_ok(n > 50, "every allocation failed once # %d", n);
    test_must(own, imp_render(s, &run, &after));
    tap_ok(!memcmp(imp_film_mean(before), imp_film_mean(after), 16 * sizeof(float)),
           "and the scene is as before");
    imp_film_destroy(before);
    imp_film_destroy(after);
    imp_problem_destroy(fragile);
    imp_scene_destroy(s);
    imp_context_destroy(own);
    tap_ok(heap.live == 0, "nothing leaks # %ld blocks", heap.live);
}

int main(void)
{
    ctx = test_context(2);
    scene = test_scene_text(ctx, xml, IMP_MONO);
    information();
    criteria();
    noise();
    lamps();
    product();
    photograph();
    luminance();
    places();
    improved();
    errors();
    memory();
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
