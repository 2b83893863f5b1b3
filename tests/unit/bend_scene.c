/* SPDX-License-Identifier: Apache-2.0
 *
 * Graded media in scenes: rays against closed forms, a constant field against an ordinary
 * dielectric, radiance over n^2, and what is refused. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/graded/graded.h"
#include <math.h>
#include <stdarg.h>
#include <unistd.h>

#define tap_note(...) (printf("# " __VA_ARGS__), printf("\n"))

#define SENSOR                                                                           \
    "<sensor type='%s'><transform name='to_world'><lookat origin='%s' target='0,0,0' "   \
    "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='24'/>"    \
    "<integer name='height' value='24'/><rfilter type='box'/></film></sensor>"
#define SCENE(body)                                                                      \
    "<scene version='3.0.0'><integrator type='path'/>" SENSOR body "</scene>"

static imp_scene *scene_of(imp_context *ctx, const char *format, ...)
{
    char text[8192];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return test_scene_text(ctx, text, IMP_RGB);
}

static struct imp_tracer tracer_of(const imp_scene *s)
{
    return (struct imp_tracer){.scene = s,
                               .integrator = imp__walk_integrator(s),
                               .sensor = s->sensors[0],
                               .seed = 1};
}

/* A ball of Luneburg's profile: parallel rays meet at the opposite point. */
static void luneburg(imp_context *ctx)
{
    double worst[2] = {0};
    int n = 0;
    for (int fine = 0; fine < 2; fine++) {
        imp_scene *s = scene_of(
            ctx,
            SCENE("<shape type='sphere'><bsdf type='null'/><medium type='graded' "
                  "name='interior'><float name='step' value='%g'/><volume "
                  "type='luneburg'><float name='radius' value='1'/></volume></medium>"
                  "</shape><emitter type='constant'/>"),
            "orthographic", "0,0,3", fine ? 0.005 : 0.01);
        const struct imp_tracer t = tracer_of(s);
        struct imp_arena arena;
        imp__arena_init(&arena, ctx);
        for (int k = 0; k < 24 * 24; k++) {
            struct imp_walk w;
            imp__walk_trace(&t, &arena, k % 24, k / 24, 0, &w);
            if (w.n < 2) continue;
            n++;
            if (w.n != 3 || w.dropped) {
                worst[fine] = INFINITY;
                continue;
            }
            const imp_v3 off = imp__decided_v3(w.first->next->d.p) - imp__v3(0, 0, -1);
            worst[fine] = fmax(worst[fine], imp__length(off));
            worst[fine] = fmax(worst[fine], fabs(w.L[0] - 1));
        }
        imp__arena_free(&arena);
        imp_scene_destroy(s);
    }
    tap_note("furthest from the focus: %.3g and %.3g with half the step", worst[0],
             worst[1]);
    tap_ok(
        n > 600 && worst[0] < 6e-4 && worst[1] < 0.26 * worst[0],
        "parallel rays meet at the opposite point of a Luneburg lens, to second order");
}

/* n^2 = n0^2 (1 - g^2 r^2): x'' = -(n0 g)^2 x in the canonical parameter, v_z stays. */
static void rod(imp_context *ctx)
{
    const double n0 = 1.6, g = 0.7, length = 1.5;
    imp_scene *s = scene_of(
        ctx,
        SCENE("<medium type='graded' id='glass'><string name='scheme' value='yoshida4'/>"
              "<float name='step' value='0.01'/><volume type='rod'><float name='n0' "
              "value='1.6'/><float name='g' value='0.7'/></volume></medium>"
              "<bsdf type='dielectric' id='face'/>"
              "<shape type='disk'><transform name='to_world'><translate z='1.5'/>"
              "</transform><ref id='face'/><ref id='glass' name='interior'/></shape>"
              "<shape type='disk'><transform name='to_world'><rotate y='1' angle='180'/>"
              "</transform><ref id='face'/><ref id='glass' name='interior'/></shape>"
              "<shape type='cylinder'><point name='p1' value='0,0,1.5'/><ref id='face'/>"
              "<ref id='glass' name='interior'/></shape><emitter type='constant'/>"),
        "perspective", "0.2,0.1,4");
    const struct imp_tracer t = tracer_of(s);
    struct imp_arena arena;
    double worst = 0;
    int n = 0;
    imp__arena_init(&arena, ctx);
    for (int k = 0; k < 24 * 24; k++) {
        struct imp_walk w;
        imp__walk_trace(&t, &arena, k % 24, k / 24, 0, &w);
        if (w.n < 3 || w.first->shape != s->shapes[0] || w.first->d.lobe != 1 ||
            w.first->next->shape != s->shapes[1])
            continue;
        n++;
        /* Snell with the index at the point; then the harmonic motion. */
        const imp_v3 a = imp__decided_v3(w.first->d.p), d = w.ray.d;
        const double r2 = a[0] * a[0] + a[1] * a[1];
        const double eta2 = n0 * n0 * (1 - g * g * r2);
        const double vz = -sqrt(eta2 - d[0] * d[0] - d[1] * d[1]);
        const double sigma = length / -vz, k2 = n0 * g;
        const imp_v3 b = imp__decided_v3(w.first->next->d.p);
        for (int i = 0; i < 2; i++)
            worst = fmax(
                worst, fabs(a[i] * cos(k2 * sigma) + d[i] / k2 * sin(k2 * sigma) - b[i]));
        worst = fmax(worst, fabs(b[2]));
    }
    tap_note("%d rays, off by at most %.3g", n, worst);
    tap_ok(n > 100 && worst < 1e-6,
           "rays through a rod with flat ends follow cos and sin");
    imp__arena_free(&arena);
    imp_scene_destroy(s);
}

/* Mean of a picture weighted by a ramp, its standard error from pixels' own. */
static double functional(imp_context *ctx, imp_scene *s, uint64_t seed, int spp,
                         double *variance)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    struct imp_film_info info = {.size = sizeof info};
    double sum = 0;
    run.seed = seed;
    run.spp = spp;
    test_must(ctx, imp_render(s, &run, &film));
    imp_film_get_info(film, &info);
    *variance = 0;
    for (int i = 0; i < info.width * info.height; i++) {
        const double weight = 1 + (i % info.width) * 0.1;
        sum += weight * imp_film_mean(film)[info.channels * i];
        *variance += imp__sqr(weight * imp_film_se(film)[info.channels * i]);
    }
    imp_film_destroy(film);
    return sum;
}

static double gradient_of(imp_context *ctx, imp_scene *s, uint64_t seed, double *variance)
{
    imp_problem *p = test_problem(ctx, s, "wall.reflectance.value");
    struct imp_run run = IMP_RUN_INIT;
    float *ones = malloc(24 * 24 * 3 * sizeof *ones);
    double g[3], se[3];
    for (int i = 0; i < 24 * 24 * 3; i++) ones[i] = 1;
    run.seed = seed;
    run.spp = 32;
    test_must(ctx, imp_problem_reverse(p, ones, &run, g, se));
    free(ones);
    imp_problem_destroy(p);
    *variance = se[0] * se[0];
    return g[0];
}

#define WALL                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/><translate "   \
    "z='-2'/></transform><bsdf type='diffuse' id='wall'/></shape>"                       \
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"      \
    "<translate y='3'/></transform><emitter type='area'/></shape>"                       \
    "<emitter type='constant'><rgb name='radiance' value='0.3'/></emitter>"

/* An index that is the same everywhere is a dielectric like any other. */
static void constant(imp_context *ctx)
{
    static const char *const shapes[] = {"sphere", "cube"};
    for (int k = 0; k < 2; k++) {
        imp_scene *a = scene_of(
            ctx,
            SCENE("<shape type='%s'><bsdf type='dielectric'/><medium type='graded' "
                  "name='interior'><float name='step' value='0.05'/><volume "
                  "type='constant'><float name='n0' value='1.5'/></volume></medium>"
                  "</shape>" WALL),
            "perspective", "1,1,5", shapes[k]);
        imp_scene *b = scene_of(ctx,
                                SCENE("<shape type='%s'><bsdf type='dielectric'><float "
                                      "name='int_ior' value='1.5'/><float name='ext_ior' "
                                      "value='1'/></bsdf></shape>" WALL),
                                "perspective", "1,1,5", shapes[k]);
        double va, vb;
        const double fa = functional(ctx, a, 1, 128, &va);
        const double fb = functional(ctx, b, 2, 128, &vb);
        const double z = (fa - fb) / sqrt(va + vb);
        tap_note("%s: %.5g, %.5g, z = %.2f", shapes[k], fa, fb, z);
        tap_ok(fabs(z) < 4, "%s: the picture is that of a dielectric", shapes[k]);
        const double ga = gradient_of(ctx, a, 3, &va), gb = gradient_of(ctx, b, 4, &vb);
        const double zg = (ga - gb) / sqrt(va + vb);
        tap_note("gradient %.5g, %.5g, z = %.2f", ga, gb, zg);
        tap_ok(ga > 0 && fabs(zg) < 4, "%s: so is the gradient of what is behind it",
               shapes[k]);
        imp_scene_destroy(a);
        imp_scene_destroy(b);
    }
}

/* L/n^2 stays: a lamp of radiance 1 in the middle of a Luneburg lens, where n^2 = 2. */
static void radiance(imp_context *ctx)
{
    imp_scene *s = scene_of(
        ctx,
        SCENE("<shape type='sphere'><bsdf type='null'/><medium type='graded' "
              "name='interior'><float name='step' value='0.01'/><volume type='luneburg'>"
              "<float name='radius' value='1'/></volume></medium></shape>"
              "<shape type='sphere'><float name='radius' value='0.05'/><emitter "
              "type='area'/></shape>"),
        "orthographic", "0,0,3");
    const struct imp_tracer t = tracer_of(s);
    struct imp_arena arena;
    double worst = 0;
    int n = 0;
    imp__arena_init(&arena, ctx);
    const struct imp_arena_mark start = imp__arena_mark(&arena);
    for (int k = 0; k < 24 * 24 * 16; k++) {
        struct imp_walk w;
        imp__walk_trace(&t, &arena, k % 24, k / 24 % 24, k / 576, &w);
        if (!(w.L[0] > 0)) continue;
        n++;
        const imp_v3 p = imp__decided_v3(w.last->d.p);
        worst = fmax(worst, fabs(w.L[0] - 1 / (2 - imp__dot(p, p))));
        imp__arena_rewind(&arena, start);
    }
    tap_note("%d walks met it, off by at most %.3g", n, worst);
    tap_ok(n > 5 && worst < 1e-3,
           "radiance leaves a Luneburg lens divided by n^2 inside");
    imp__arena_free(&arena);
    imp_scene_destroy(s);
}

/* A body of index 1 changes nothing, whatever stands inside. */
static void embedded(imp_context *ctx)
{
    static const char inside[] =
        "<shape type='cube'><transform name='to_world'><scale value='0.4'/><rotate "
        "y='1' angle='30'/></transform><bsdf type='diffuse' id='wall'/></shape>"
        "<emitter type='constant'/>"
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
        "<translate y='2'/></transform><emitter type='area'><rgb name='radiance' "
        "value='3'/></emitter></shape>";
    imp_scene *a = scene_of(
        ctx,
        SCENE("<shape type='sphere'><bsdf type='null'/><medium type='graded' "
              "name='interior'><float name='step' value='0.1'/><volume type='constant'>"
              "<float name='n0' value='1'/></volume></medium></shape>%s"),
        "perspective", "1,1,5", inside);
    imp_scene *b = scene_of(ctx, SCENE("%s"), "perspective", "1,1,5", inside);
    double va, vb;
    const double fa = functional(ctx, a, 1, 128, &va),
                 fb = functional(ctx, b, 2, 128, &vb);
    const double z = (fa - fb) / sqrt(va + vb);
    tap_note("%.5g, %.5g, z = %.2f", fa, fb, z);
    tap_ok(fabs(z) < 4, "a body of index 1 around a diffuse cube is not seen");
    const double ga = gradient_of(ctx, a, 3, &va), gb = gradient_of(ctx, b, 4, &vb);
    tap_note("gradient %.5g, %.5g, z = %.2f", ga, gb, (ga - gb) / sqrt(va + vb));
    tap_ok(fabs(ga - gb) < 4 * sqrt(va + vb), "nor by the gradient of the cube");
    imp_scene_destroy(a);
    imp_scene_destroy(b);
}

static void refused(imp_context *ctx, const char *body, enum imp_status want,
                    const char *message)
{
    char text[4096];
    imp_scene *s = NULL;
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 4;
    snprintf(text, sizeof text, SCENE("%s<emitter type='constant'/>"), "perspective",
             "0,0,5", body);
    enum imp_status st = imp_scene_load_string(ctx, text, strlen(text), "test", NULL, &s);
    if (st == IMP_OK) st = imp_render(s, &run, &film);
    const char *said = st == IMP_OK ? "" : imp_last_error(ctx);
    tap_ok(st == want && strstr(said, message), "refused: %s", message);
    if (st != want || !strstr(said, message))
        tap_note("%s: %s", imp_status_text(st), said);
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

#define BALL(bsdf, medium)                                                               \
    "<shape type='sphere'>" bsdf "<medium type='graded' name='interior'>" medium         \
    "</medium></shape>"
#define N0(n) "<volume type='constant'><float name='n0' value='" n "'/></volume>"

static void hostile(imp_context *ctx)
{
    const enum imp_status no = IMP_E_UNSUPPORTED;
    refused(ctx, BALL("<bsdf type='diffuse'/>", N0("1.5")), no, "dielectric or null");
    refused(ctx, BALL("<bsdf type='null'/>", ""), IMP_E_SCENE, "has no <volume>");
    refused(ctx,
            BALL("<bsdf type='null'/>", "<volume type='grid'><vector name='hi' "
                                        "value='1,1,0.5'/></volume>"),
            IMP_E_SCENE, "the field ends at");
    refused(ctx,
            BALL("<bsdf type='dielectric'><float name='int_ior' value='2'/></bsdf>",
                 N0("1.5")),
            IMP_E_SCENE, "no int_ior");
    refused(
        ctx,
        BALL("<bsdf type='null'/>", "<string name='scheme' value='arc-index'/>" N0("1")),
        no, "arc");
    refused(ctx,
            BALL("<bsdf type='null'/>", "<boolean name='outside' value='true'/>" N0("1")),
            no, "files of bent rays");
    refused(ctx, BALL("<bsdf type='null'/>", "<float name='sigma' value='1'/>" N0("1")),
            IMP_E_SCENE, "sigma");
    refused(ctx, BALL("<bsdf type='null'/>", N0("nan")), IMP_E_SCENE, "n0");
    refused(ctx,
            "<shape type='sphere'><bsdf type='null'/><medium type='graded' "
            "name='exterior'>" N0("1") "</medium></shape>",
            no, "interior");
    refused(ctx, "<shape type='sphere'><medium type='fog' name='interior'/></shape>", no,
            "no such medium");
    refused(
        ctx,
        "<shape type='sphere'><float name='radius' value='9'/><bsdf "
        "type='null'/><medium type='graded' name='interior'>" N0("1") "</medium></shape>",
        IMP_E_PATHS, "bent");
    refused(ctx,
            BALL("<bsdf type='null'/>",
                 N0("1")) "<shape type='sphere'><float name='radius' value='0.5'/><bsdf "
                          "type='dielectric'/></shape>",
            IMP_E_PATHS, "bent");
    refused(ctx,
            BALL("<bsdf type='null'/>",
                 N0("1")) "<shape type='cylinder'><transform name='to_world'><scale "
                          "x='.2' y='.1' z='.3'/></transform></shape>",
            no, "an oval cylinder in the box around a graded medium");
    char curve[] = "/tmp/imp_bend_XXXXXX", text[512];
    const int fd = mkstemp(curve);
    if (fd < 0 || write(fd, "-.5 0 0 .2\n.5 0 0 .2\n", 21) != 21) exit(99);
    close(fd);
    snprintf(text, sizeof text,
             BALL("<bsdf type='null'/>",
                  N0("1")) "<shape type='linearcurve'><string name='filename' "
                           "value='%s'/></shape>",
             curve);
    refused(ctx, text, no, "a curve in the box around a graded medium");
    unlink(curve);
    refused(ctx, BALL("<bsdf type='null'/>", N0("-1")), IMP_E_SCENE, "n0 = -1");
    refused(ctx,
            BALL("<bsdf type='null'/>", /* no index where r > 1/2 */
                 "<volume type='rod'><float name='n0' value='1'/><float name='g' "
                 "value='2'/></volume>"),
            IMP_E_PATHS, "bent");
    refused(ctx,
            BALL("<bsdf type='null'/>",
                 "<float name='step' value='1e-3'/><integer name='max_steps' "
                 "value='20'/>" N0("1")),
            IMP_E_PATHS, "bent");
}

/* The same bits whatever the number of threads. */
static void threads(void)
{
    double value[3], variance;
    for (int k = 0; k < 3; k++) {
        imp_context *ctx = test_context(k + 1);
        imp_scene *s = scene_of(
            ctx,
            SCENE("<shape type='sphere'><bsdf type='dielectric'/><medium type='graded' "
                  "name='interior'><volume type='maxwell'><float name='n0' value='2'/>"
                  "<float name='radius' value='2'/></volume></medium></shape>" WALL),
            "perspective", "1,1,5");
        value[k] = functional(ctx, s, 1, 8, &variance);
        imp_scene_destroy(s);
        imp_context_destroy(ctx);
    }
    tap_ok(value[0] == value[1] && value[0] == value[2], "same bits at 1, 2, 3 threads");
}

/* Load, derive, destroy, with every allocation failing once and all after it. */
static enum imp_status whole(struct fail_alloc *heap, double *gradient)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    const char *defines[] = {"width=6"};
    imp_context *ctx = NULL;
    imp_scene *s = NULL;
    imp_problem *p = NULL;
    struct imp_run run = IMP_RUN_INIT;
    float seed[6 * 6 * 3];
    for (int i = 0; i < 108; i++) seed[i] = 1;
    o.threads = 1;
    o.allocator = fail_alloc_hooks(heap);
    load.defines = defines;
    load.n_defines = 1;
    run.spp = 2;
    enum imp_status st = imp_context_create(&o, &ctx);
    if (st == IMP_OK) st = imp_scene_load(ctx, IMP_SCENES "/bend/bump.xml", &load, &s);
    if (st == IMP_OK) st = imp_problem_create(s, &p);
    if (st == IMP_OK) st = imp_problem_activate(p, "lens*");
    if (st == IMP_OK) st = imp_problem_reverse(p, seed, &run, gradient, NULL);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return st;
}

static void memory(void)
{
    long n = 0, wrong = 0, leaks = 0;
    for (;; n++) {
        struct fail_alloc heap = {.fail_at = n + 1};
        double gradient[6] = {0};
        const enum imp_status st = whole(&heap, gradient);
        leaks += heap.live != 0;
        if (st == IMP_OK && heap.calls <= n) break;
        wrong += st != IMP_E_NOMEM || gradient[0] != 0;
    }
    tap_note("%ld allocations, %ld wrong, %ld leaks", n, wrong, leaks);
    tap_ok(n > 20 && wrong == 0 && leaks == 0, "every allocation may fail");
}

int main(void)
{
    imp_context *ctx = test_context(2);
    luneburg(ctx);
    rod(ctx);
    constant(ctx);
    radiance(ctx);
    embedded(ctx);
    hostile(ctx);
    threads();
    memory();
    imp_context_destroy(ctx);
    return tap_done();
}
