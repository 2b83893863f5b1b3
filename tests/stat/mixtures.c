/* SPDX-License-Identifier: Apache-2.0
 *
 * Directions drawn from mixtures of densities (walk/core/direction.c): every member's density
 * is the one it draws with, means and gradients do not depend on the weights, and walks
 * that split have the same means. Negative control: the density of the member that drew,
 * alone, is caught. */
#include "math/warp.h"
#include "photon_walks.h"

static imp_context *ctx;
static int more = 1; /* times as many samples, with the argument "long" */

/* Diffuse and glossy things, of one and of two sides, under lamps of all kinds of shapes
 * and a sky; proxies around a lamp and beside it. */
#define SCENE_HEAD                                                                       \
    "<scene version='3.0.0'><integrator type='%s'><string name='weights' value='%s'/>"   \
    "<boolean name='hide_emitters' value='true'/><integer name='split' "                 \
    "value='%d'/><integer name='max_depth' "                                             \
    "value='4'/></integrator>"                                                           \
    "<sensor type='perspective'><float name='fov' value='30'/><transform "               \
    "name='to_world'><lookat origin='0,3,6' target='0,.3,0' up='0,1,0'/></transform>"    \
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "      \
    "value='4'/><rfilter type='box'/></film></sensor>"
#define SCENE_BODY                                                                       \
    "<emitter type='constant' id='sky'><rgb name='radiance' "                            \
    "value='.3,.2,.4'/></emitter>"                                                       \
    "<bsdf type='diffuse' id='floor'>%s<rgb name='reflectance' "                         \
    "value='.6,.5,.2'/></bsdf>"                                                          \
    "<bsdf type='twosided' id='both'><bsdf type='phong' id='gloss'>%s<float "            \
    "name='exponent' value='20'/></bsdf></bsdf>"                                         \
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/>"     \
    "<scale value='4'/></transform><ref id='floor'/></shape>"                            \
    "<shape type='sphere'><point name='center' x='0' y='.4' z='0'/><float "              \
    "name='radius' value='.4'/><ref id='both'/></shape>"                                 \
    "<shape type='sphere'><point name='center' x='1' y='1.5' z='0'/><float "             \
    "name='radius' value='.2'/><emitter type='area' id='ball'><rgb name='radiance' "     \
    "value='9,8,7'/></emitter></shape>"                                                  \
    "<shape type='rectangle'><transform name='to_world'><scale value='.3'/><rotate "     \
    "x='1' angle='90'/><translate x='-1' y='2'/></transform><emitter type='area' "       \
    "id='panel'><rgb name='radiance' value='5,8,7'/><shape type='disk' name='proxy'>"    \
    "<transform name='to_world'><scale value='.5'/><rotate x='1' angle='90'/>"           \
    "<translate x='-1' y='1.9'/></transform></shape></emitter></shape>"                  \
    "<shape type='cube'><transform name='to_world'><scale value='.1'/><translate "       \
    "x='-1.2' y='.3' z='1'/></transform><emitter type='area' id='box'><float "           \
    "name='sampling_weight' value='.5'/><rgb name='radiance' value='5,4,7'/></emitter>"  \
    "</shape><shape type='cylinder' name='proxy'><float name='radius' value='.3'/>"      \
    "<point name='p0' x='1' y='1.1' z='0'/><point name='p1' x='1' y='1.9' z='0'/>"       \
    "</shape><shape type='cube' name='proxy2'><float name='sampling_weight' value='2'/>" \
    "<transform name='to_world'><scale value='.3'/><rotate y='1' "                       \
    "angle='30'/><translate "                                                            \
    "x='-1.2' y='.3' z='1'/></transform></shape></scene>"

static imp_scene *scene_make(const char *type, const char *weights, int split,
                             const char *floor, const char *gloss)
{
    char xml[8192];
    snprintf(xml, sizeof xml, SCENE_HEAD SCENE_BODY, type, weights, split, floor, gloss);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* ---- Densities ------------------------------------------------------------------- */

static double aimed_pdf(const imp_scene *s, int group, const double sum[2], imp_v3 from,
                        imp_v3 w)
{
    double p[2];
    imp__aims_pdf(&s->aims, sum, from, w, p);
    return p[group];
}

/* With q uniform over the sphere, E_p[q/(q + p')] = E_q[p'/(q + p')] if p' is the density
 * that is drawn with (src/inverse/check/check_directions.c). */
static void density(const imp_scene *s, int group, imp_v3 from, const char *where)
{
    const struct imp_aims *a = &s->aims;
    const int first = group ? a->n_lights : 0, end = group ? a->n : a->n_lights;
    const double q = IMP_INV_PI / 4, sum[2] = {imp__aims_sum(a, 0, a->n_lights, from),
                                               imp__aims_sum(a, a->n_lights, a->n, from)};
    struct tap_stat drawn = {0}, given = {0};
    char what[96];
    for (uint32_t k = 0; k < 200000; k++) {
        const struct imp_key key = imp__key(31, (uint64_t)group, k);
        double u[5], chance;
        for (uint32_t j = 0; j < 5; j++) u[j] = imp__u01(key, j);
        struct imp_light_sample ls;
        const int i = imp__aim_choose(a, first, end, sum[group], from, u[0], &chance);
        const struct imp_shape *shape = a->list[i].shape;
        double value = 0;
        if (shape->ops->sample_toward(shape, &from, u + 1, &ls))
            value = q / (q + aimed_pdf(s, group, sum, from, ls.wi));
        tap_add(&drawn, value);
        const double p = aimed_pdf(s, group, sum, from, imp__uniform_sphere(u + 3));
        tap_add(&given, p / (q + p));
    }
    snprintf(what, sizeof what, "density towards %s, %s", group ? "proxies" : "lights",
             where);
    tap_same(&drawn, &given, what);
}

/* Its integral over a Fibonacci lattice of directions is 1, as "long" within 1e-4. Where
 * faces are seen at grazing angles densities go up like 1/cos, and the lattice gives
 * 3e-3. */
static void integral(const imp_scene *s, int group, imp_v3 from, bool fine,
                     const char *where)
{
    const struct imp_aims *a = &s->aims;
    const double sum[2] = {imp__aims_sum(a, 0, a->n_lights, from),
                           imp__aims_sum(a, a->n_lights, a->n, from)};
    const int n = more > 1 ? 4000000 : 60000;
    const double limit = more == 1 ? 5e-3 : fine ? 1e-4 : 3e-3;
    double total = 0;
    for (int k = 0; k < n; k++) {
        const double turn = 0.6180339887498949 * k;
        total += aimed_pdf(
            s, group, sum, from,
            imp__uniform_sphere((const double[2]){(k + .5) / n, turn - floor(turn)}));
    }
    total *= 2 * IMP_2PI / n;
    tap_ok(fabs(total - 1) < limit, "integral of the density towards %s, %s # %.6f",
           group ? "proxies" : "lights", where, total);
}

static void densities(void)
{
    static const struct {
        imp_v3 at;
        const char *name;
        int integral[2]; /* towards lights, proxies: 2 fine, 1 coarse, 0: part of the
                            draws fail, in the plane of a face */
    } from[] = {{{0, 0, 0, 0}, "from the floor", {1, 0}},
                {{1, 1.5, 0.25, 0}, "beside the lamp, inside its proxy", {2, 1}},
                {{1, 1.5, 0.05, 0}, "inside the lamp", {2, 2}},
                {{-1.2, 0.3, 1.15, 0}, "between the box and its proxy", {2, 1}},
                {{-1, 1.95, 0, 0}, "between the panel and its proxy", {1, 1}},
                {{1, 3, -2, 0}, "from above", {1, 1}}};
    imp_scene *s = scene_make("path", "kernel=1,emitters=1,proxies=1", 0, "", "");
    tap_ok(s->aims.n_lights == 3 && s->aims.n == 5, "three lights, two proxies");
    for (size_t k = 0; k < sizeof from / sizeof *from; k++)
        for (int group = 0; group < 2; group++) {
            density(s, group, from[k].at, from[k].name);
            if (from[k].integral[group] == 2 ||
                (more > 1 && from[k].integral[group] == 1))
                integral(s, group, from[k].at, from[k].integral[group] == 2,
                         from[k].name);
        }
    imp_scene_destroy(s);
}

/* ---- Weights --------------------------------------------------------------------- */

enum { N_PARAMS_MAX = 32 };
struct result {
    double f, f_se, g[N_PARAMS_MAX], g_se[N_PARAMS_MAX];
    size_t n;
};

static struct result functional(imp_scene *s, int spp, uint64_t seed)
{
    struct result r = {.n = 0};
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate value = {0};
    imp_problem *p = test_problem(ctx, s, "*");
    run.spp = spp;
    run.seed = seed;
    r.n = imp_problem_n_variables(p);
    if (r.n > N_PARAMS_MAX) {
        printf("Bail out! too many parameters\n");
        exit(99);
    }
    test_must(ctx, imp_problem_functional(p, NULL, &run, &value, r.g, r.g_se));
    r.f = value.value;
    r.f_se = value.se;
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    return r;
}

static void compare(const struct result *a, const struct result *b, double limit,
                    const char *what)
{
    const double z = (a->f - b->f) / hypot(a->f_se, b->f_se);
    double worst = 0, square = 0;
    size_t n = 0;
    for (size_t k = 0; k < a->n; k++) {
        const double se = hypot(a->g_se[k], b->g_se[k]);
        if (!(se > 0)) continue;
        const double zk = (a->g[k] - b->g[k]) / se;
        worst = fmax(worst, fabs(zk));
        square += zk * zk;
        n++;
    }
    /* Of n numbers, chi-square within 5 of its standard deviations. */
    tap_ok(fabs(z) <= 4 && a->f_se < limit * a->f,
           "%s: mean # %.6g se %.2g, kernel %.6g se %.2g, z %.2f, variance %.2f of its",
           what, a->f, a->f_se, b->f, b->f_se, z, pow(a->f_se / b->f_se, 2));
    tap_ok(n > 8 && worst < 5 && square < (double)n + 5 * sqrt(2. * (double)n),
           "%s: gradient # %zu numbers, largest z %.2f, chi-square %.1f", what, n, worst,
           square);
}

static void weights(void)
{
    static const char floor_weights[] =
        "<string name='weights' value='kernel=1,proxies=3'/>";
    static const char gloss_weights[] = "<string name='weights' value='kernel=1'/>";
    static const struct {
        const char *type, *weights;
        int split;
        const char *floor, *gloss;
    } row[] = {
        {"path", "kernel=.75,environment=.25", 0, "", ""},
        {"path", "kernel=.5,environment=.5", 0, "", ""},
        {"path", "kernel=.25,environment=.75", 0, "", ""},
        {"path", "kernel=1,emitters=1", 0, "", ""},
        {"path", "kernel=1, proxies=2, uniform=.5", 0, "", ""},
        {"path", "uniform=1", 0, "", ""},
        {"path", "kernel=1,emitters=1,environment=1,proxies=1,uniform=1", 2, "", ""},
        {"path", "kernel=0,emitters=2,uniform=1", 0, floor_weights, gloss_weights},
        {"photons", "kernel=1", 0, "", ""},
        {"photons", "kernel=1,emitters=1", 0, "", ""},
        {"photons", "kernel=2,emitters=1,environment=1,proxies=1,uniform=1", 0, "", ""},
        {"photons", "kernel=1,emitters=1,proxies=1", 2, "", gloss_weights},
    };
    const struct result kernel =
        functional(scene_make("path", "kernel=1", 0, "", ""), 6000 * more, 1);
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        char what[128];
        const bool photons = strcmp(row[k].type, "photons") == 0;
        const struct result r =
            functional(scene_make(row[k].type, row[k].weights, row[k].split, row[k].floor,
                                  row[k].gloss),
                       more * (row[k].split ? 800
                               : photons    ? 6000
                                            : 3000),
                       2 + k);
        snprintf(what, sizeof what, "%s, %s%s%s", row[k].type, row[k].weights,
                 row[k].split ? ", split" : "", *row[k].floor ? ", materials" : "");
        compare(&r, &kernel, (photons ? 0.02 : 0.01) / sqrt(more), what);
    }
}

/* ---- Negative control ------------------------------------------------------------ */

/* A white floor under a sky and a lamp: one bounce, from the record, with the density of
 * the member that drew in place of the mixture's. Both members find the lamp; the second
 * cannot find the sky. */
static void drawing_member_only(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><integrator type='photons'><string name='weights' "
        "value='kernel=1,emitters=1'/><integer name='max_depth' value='2'/></integrator>"
        "<sensor type='perspective'><float name='fov' value='1'/><transform "
        "name='to_world'><lookat origin='0,3,.1' target='0,0,0' up='0,0,1'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='1'/><integer name='height' "
        "value='1'/><rfilter type='box'/></film></sensor><emitter type='constant'/>"
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/>"
        "</transform><bsdf type='diffuse'><rgb name='reflectance' value='1'/></bsdf>"
        "</shape><shape type='sphere'><point name='center' x='2' y='1' z='0'/><float "
        "name='radius' value='.5'/><emitter type='area'><float name='radiance' "
        "value='6'/></emitter></shape></scene>";
    struct photons p = photons_open(ctx, test_scene_text(ctx, xml, IMP_RGB), 4);
    struct tap_stat right = {0}, alone = {0};
    /* E/pi = 1 + (6 - 1) sin^2(cone) cos(tilt): the whole ball is above the floor. */
    const double d2 = 5, truth = 1 + 5 * (0.25 / d2) * (1 / sqrt(d2));
    for (int64_t k = 0; k < 200000; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&p.arena);
        const struct imp_walk walk = photons_trace(&p, k);
        const struct imp_vertex *v = walk.first;
        double L = 0;
        if (v && v->d.goes_on && v->next) {
            const double kernel = v->d.wi[2] / IMP_PI, S2 = 0.25 / d2;
            const double ball = 1 / (IMP_2PI * (1 - sqrt(1 - S2)));
            const double own = v->d.drawn == IMP_DENSITY_KERNEL ? kernel : ball;
            L = v->next->e[0] * kernel / own / v->d.survive;
        }
        tap_add(&right, walk.L[0]);
        tap_add(&alone, L);
        imp__arena_rewind(&p.arena, mark);
    }
    tap_z(&right, truth, 0.01, "a floor under a sky and a lamp");
    const double z = (alone.mean - truth) / tap_se(&alone);
    tap_ok(fabs(z) > 20,
           "density of the member that drew is caught # %.5f se %.5f, truth "
           "%.5f, z %.0f",
           alone.mean, tap_se(&alone), truth, z);
    photons_close(&p);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "long") == 0) more = 40;
    ctx = test_context(2);
    densities();
    weights();
    drawing_member_only();
    imp_context_destroy(ctx);
    return tap_done();
}
