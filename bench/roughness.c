/* SPDX-License-Identifier: Apache-2.0
 *
 * What draws for a derivative do (docs/estimators.md 8.2), where a roughness or the weight of
 * a mixture is active: variance times processor time with them, over that without. A ball on
 * a matt ground under a lamp, or a lamp and a sky; direct light, and two bounces. One thread;
 * both take turns, with the same seeds, and variances are those of the spread over them.
 *
 *     roughness [ROUNDS [SPP [CASE [sobol]]]]
 *
 * In a cell: derivative of the pixels, summed over them; derivative of an l2 loss against the
 * picture of another number; each with its standard error, by the jackknife over eight groups
 * of rounds. Then the largest ratio of the variances of the value, and of the times. CASE: a
 * part of the name of a row. */
#include "../tests/imp_scene.h"
#include "walk/core/active.h"
#include <math.h>
#include <time.h>

/* Derivatives wanted as before: of inputs that no kind has. */
static bool without;
enum imp_status __real_imp__active_create(const struct imp_scene *scene,
                                          const uint8_t *chosen, struct imp_active *out);
enum imp_status __wrap_imp__active_create(const struct imp_scene *scene,
                                          const uint8_t *chosen, struct imp_active *out);
enum imp_status __wrap_imp__active_create(const struct imp_scene *scene,
                                          const uint8_t *chosen, struct imp_active *out)
{
    const enum imp_status st = __real_imp__active_create(scene, chosen, out);
    for (int b = 0; without && st == IMP_OK && b < scene->n_bsdfs; b++)
        if (out->inputs[b]) out->inputs[b] = UINT64_C(1) << 63;
    return st;
}

static imp_context *ctx;
static int rounds = 32, spp = 8;
static enum imp_points points = IMP_POINTS_INDEPENDENT;

static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* %g: the number. */
#define NUMBER(name)   "<float name='" name "' value='%g'/>"
#define GGX            "<string name='distribution' value='ggx'/>"
#define METAL(numbers) "<bsdf type='roughconductor' id='m'>" numbers "</bsdf>"
#define MATT           "<bsdf type='diffuse'/>"
static const struct {
    const char *group, *what, *bsdf, *param;
    double value[6];
} cases[] = {
    {"metal", "ggx", METAL(GGX NUMBER("alpha")), "m.alpha", {.02, .05, .1, .2, .35, .5}},
    {"metal", "beckmann", METAL(NUMBER("alpha")), "m.alpha", {.02, .05, .1, .2, .35, .5}},
    {"aniso",
     "ggx, alpha_u",
     METAL(GGX NUMBER("alpha_u") "<float name='alpha_v' value='0.2'/>"),
     "m.alpha_u",
     {.02, .05, .1, .2, .35, .5}},
    {"aniso",
     "beckmann, alpha_u",
     METAL(NUMBER("alpha_u") "<float name='alpha_v' value='0.2'/>"),
     "m.alpha_u",
     {.02, .05, .1, .2, .35, .5}},
    {"aniso",
     "ggx, both",
     METAL(GGX NUMBER("alpha_u") "<float name='alpha_v' value='0.2'/>"),
     "m.alpha_*",
     {.02, .05, .1, .2, .35, .5}},
    {"glass",
     "ggx",
     "<bsdf type='roughdielectric' id='m'>" GGX NUMBER("alpha") "</bsdf>",
     "m.alpha",
     {.02, .05, .1, .2, .35, .5}},
    {"plastic",
     "ggx",
     "<bsdf type='roughplastic' id='m'>" GGX NUMBER("alpha") "</bsdf>",
     "m.alpha",
     {.02, .05, .1, .2, .35, .5}},
    {"plastic",
     "beckmann",
     "<bsdf type='roughplastic' id='m'>" NUMBER("alpha") "</bsdf>",
     "m.alpha",
     {.02, .05, .1, .2, .35, .5}},
    {"principled",
     "roughness",
     "<bsdf type='principled' id='m'>" NUMBER("roughness") "</bsdf>",
     "m.roughness",
     {.14, .22, .32, .45, .6, .7}},
    {"principled",
     "of metal",
     "<bsdf type='principled' id='m'><float name='metallic' value='1'/>" NUMBER(
         "roughness") "</bsdf>",
     "m.roughness",
     {.14, .22, .32, .45, .6, .7}},
    {"principled",
     "anisotropic",
     "<bsdf type='principled' id='m'><float name='metallic' value='1'/><float "
     "name='roughness' value='.4'/>" NUMBER("anisotropic") "</bsdf>",
     "m.anisotropic",
     {.02, .1, .3, .5, .8, .95}},
    {"weights",
     "metallic",
     "<bsdf type='principled' id='m'><float name='roughness' value='.3'/>" NUMBER(
         "metallic") "</bsdf>",
     "m.metallic",
     {0, .02, .1, .3, .5, 1}},
    {"weights",
     "clearcoat",
     "<bsdf type='principled' id='m'><float name='roughness' value='.5'/>" NUMBER(
         "clearcoat") "</bsdf>",
     "m.clearcoat",
     {0, .02, .1, .3, .5, 1}},
    {"weights",
     "blendbsdf, matt and metal",
     "<bsdf type='blendbsdf' id='m'>" NUMBER("weight") MATT
     "<bsdf type='roughconductor'><float name='alpha' "
     "value='0.1'/></bsdf></bsdf>",
     "m.weight",
     {0, .02, .1, .3, .5, 1}},
    {"weights",
     "mask",
     "<bsdf type='mask' id='m'>" NUMBER("opacity") MATT "</bsdf>",
     "m.opacity",
     {0, .02, .1, .3, .5, 1}},
    {"weights",
     "plastic, tint",
     "<bsdf type='plastic' id='m'>" NUMBER("specular_reflectance") "</bsdf>",
     "m.specular_reflectance",
     {.02, .1, .3, .5, .8, 1}},
    {"weights",
     "rough plastic, tint",
     "<bsdf type='roughplastic' id='m'>" NUMBER("specular_reflectance") "</bsdf>",
     "m.specular_reflectance",
     {.02, .1, .3, .5, .8, 1}},
};

#define LAMP                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"             \
    "<lookat origin='1,3,2' target='0,0,0' up='0,1,0'/></transform>"                     \
    "<emitter type='area'><float name='radiance' value='12'/></emitter></shape>"
#define SKY "<emitter type='constant'><float name='radiance' value='%g'/></emitter>"
static const struct {
    const char *what, *lights;
    double sky;
} lights[] = {{"lamp", LAMP, 0}, {"lamp and sky", LAMP SKY, .4}};

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='path'>"
    "<integer name='max_depth' value='%d'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='35'/><transform name='to_world'>"
    "<lookat origin='0,1.2,5' target='0,0,0' up='0,1,0'/></transform><film "
    "type='hdrfilm'><integer name='width' value='32'/><integer name='height' "
    "value='32'/><rfilter type='box'/></film></sensor>"
    "<shape type='sphere'>%s</shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='5'/>"
    "<rotate x='1' angle='-90'/><translate y='-1'/></transform><bsdf type='diffuse'>"
    "<texture type='checkerboard' name='reflectance'/></bsdf></shape>%s</scene>";

static imp_scene *scene_of(size_t c, int l, int depth, double value)
{
    char bsdf[1024], light[1024], text[sizeof scene_text + 2048];
    snprintf(bsdf, sizeof bsdf, cases[c].bsdf, value);
    snprintf(light, sizeof light, lights[l].lights, lights[l].sky);
    snprintf(text, sizeof text, scene_text, depth, bsdf, light);
    return test_scene_text(ctx, text, IMP_MONO);
}

static void target_add(size_t c, int l, int depth, double value, imp_problem *p)
{
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *s = scene_of(c, l, depth, value);
    imp_film *f;
    run.seed = 12345;
    run.spp = 256;
    test_must(ctx, imp_render(s, &run, &f));
    test_must(ctx, imp_film_get_info(f, &info));
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    target.pixels = imp_film_mean(f);
    test_must(ctx, imp_problem_add_target(p, &target));
    imp_film_destroy(f);
    imp_scene_destroy(s);
}

enum { PIXELS = 32 * 32, NUMBERS = 2, GROUPS = 8 };

struct moments {
    double n, sum, squares;
};
static void moment_add(struct moments *m, double x)
{
    m->n++;
    m->sum += x;
    m->squares += x * x;
}
/* Of one problem; rounds r and r + GROUPS are in one group. */
struct seen {
    struct moments I[GROUPS][PIXELS], dI[GROUPS][NUMBERS][PIXELS], dJ[GROUPS][NUMBERS];
    double seconds;
};

/* Sums over the pixels of the variances of the value and of the derivatives, from the spread
 * over seeds; variance of the derivatives of the loss. */
struct spread {
    double value, derivative, loss;
};

/* Without one of the groups; -1: of all. The groups' moments are `stride` apart. */
static double variance(const struct moments *m, size_t stride, int without_group)
{
    struct moments all = {0};
    for (int i = 0; i < GROUPS; i++) {
        if (i == without_group) continue;
        all.n += m[(size_t)i * stride].n;
        all.sum += m[(size_t)i * stride].sum;
        all.squares += m[(size_t)i * stride].squares;
    }
    return (all.squares - all.sum * all.sum / all.n) / (all.n - 1);
}

static struct spread spread_of(const struct seen *s, size_t n, int without_group)
{
    struct spread out = {0};
    for (size_t j = 0; j < n; j++) {
        out.loss += variance(&s->dJ[0][j], NUMBERS, without_group);
        for (int i = 0; i < PIXELS; i++) {
            if (j == 0) out.value += variance(&s->I[0][i], PIXELS, without_group);
            out.derivative +=
                variance(&s->dI[0][j][i], (size_t)NUMBERS * PIXELS, without_group);
        }
    }
    return out;
}

static void pictures(imp_problem *p, int seed, struct moments *I,
                     struct moments (*dI)[PIXELS])
{
    imp_film *primal, *films[NUMBERS];
    struct imp_run run = IMP_RUN_INIT;
    run.seed = (uint64_t)seed;
    run.spp = spp;
    run.points = points;
    test_must(ctx, imp_problem_jacobian(p, &run, &primal, films));
    for (int i = 0; i < PIXELS; i++) moment_add(&I[i], imp_film_mean(primal)[i]);
    imp_film_destroy(primal);
    for (size_t j = 0; j < imp_problem_n_variables(p); j++) {
        for (int i = 0; i < PIXELS; i++)
            moment_add(&dI[j][i], imp_film_mean(films[j])[i]);
        imp_film_destroy(films[j]);
    }
}
static void losses(imp_problem *p, int seed, struct moments *dJ)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate J;
    double g[NUMBERS];
    run.seed = (uint64_t)seed;
    run.spp = spp;
    run.points = points;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &J, g, NULL));
    for (size_t j = 0; j < imp_problem_n_variables(p); j++) moment_add(&dJ[j], g[j]);
}
/* With draws for the derivative, over without; and the jackknife's standard errors. */
static struct spread compare(imp_problem *const p[2], struct spread *se, double *slower)
{
    static struct seen seen[2];
    const size_t n = imp_problem_n_variables(p[0]);
    memset(seen, 0, sizeof seen);
    for (int r = 0; r < rounds; r++)
        for (int k = 0; k < 2; k++) {
            const int group = r % GROUPS;
            const double t = cpu();
            pictures(p[k], r + 1, seen[k].I[group], seen[k].dI[group]);
            seen[k].seconds += cpu() - t;
            for (int i = 0; i < 4; i++) losses(p[k], 1000 + 4 * r + i, seen[k].dJ[group]);
        }
    struct spread all = {0};
    *slower = seen[0].seconds / seen[1].seconds;
    *se = (struct spread){0};
    for (int out = -1; out < GROUPS; out++) {
        const struct spread a = spread_of(&seen[0], n, out),
                            b = spread_of(&seen[1], n, out);
        const struct spread x = {a.value / b.value, a.derivative / b.derivative * *slower,
                                 a.loss / b.loss * *slower};
        if (out < 0) all = x;
        const double f = (GROUPS - 1.) / GROUPS;
        se->derivative += f * pow(x.derivative - all.derivative, 2);
        se->loss += f * pow(x.loss - all.loss, 2);
    }
    se->derivative = sqrt(se->derivative);
    se->loss = sqrt(se->loss);
    return all;
}

static void row(size_t c, int l, int depth)
{
    printf("| %s, %s | %s, %d |", cases[c].group, cases[c].what, lights[l].what,
           depth - 1);
    double value_most = 0, time = 0;
    for (int i = 0; i < 6; i++) {
        const double value = cases[c].value[i];
        imp_scene *scene = scene_of(c, l, depth, value);
        imp_problem *p[2];
        struct spread se;
        double slower;
        for (int k = 0; k < 2; k++) {
            without = k;
            p[k] = test_problem(ctx, scene, cases[c].param);
            target_add(c, l, depth, value < .5 ? value * 1.3 + .05 : value * .8, p[k]);
        }
        const struct spread x = compare(p, &se, &slower);
        printf(" %.2f +- %.2f, %.2f +- %.2f |", x.derivative, se.derivative, x.loss,
               se.loss);
        fflush(stdout);
        value_most = fmax(value_most, x.value);
        time += slower / 6;
        for (int k = 0; k < 2; k++) imp_problem_destroy(p[k]);
        imp_scene_destroy(scene);
    }
    printf(" %.2f | %.2f |\n", value_most, time);
}

int main(int argc, char **argv)
{
    const char *which = argc > 3 ? argv[3] : "";
    if (argc > 1) rounds = atoi(argv[1]);
    if (argc > 2) spp = atoi(argv[2]);
    if (argc > 4 && strcmp(argv[4], "sobol") == 0) points = IMP_POINTS_SOBOL;
    if (rounds < 2 * GROUPS || spp < 4) {
        fprintf(stderr,
                "usage: roughness [ROUNDS [SPP [CASE [sobol]]]], 16 rounds or more\n");
        return 2;
    }
    ctx = test_context(1);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        char name[128];
        snprintf(name, sizeof name, "%s, %s", cases[c].group, cases[c].what);
        if (!strstr(name, which)) continue;
        for (int l = 0; l < 2; l++)
            for (int depth = 2; depth <= 3; depth++) row(c, l, depth);
    }
    imp_context_destroy(ctx);
    return 0;
}
