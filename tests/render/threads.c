/* SPDX-License-Identifier: Apache-2.0
 *
 * The same bits for 1, 2, 3 and 7 threads: pictures, losses, gradients of few and of many
 * numbers, derivative pictures, Gauss-Newton matrices; paths and photons by mixtures,
 * colours and wavelengths. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"

struct output {
    double *numbers;
    size_t n;
};

static void keep(struct output *o, const void *from, size_t n, size_t size)
{
    o->numbers = realloc(o->numbers, (o->n + n) * sizeof(double));
    for (size_t k = 0; k < n; k++)
        o->numbers[o->n + k] =
            size == 8 ? ((const double *)from)[k] : ((const float *)from)[k];
    o->n += n;
}

static const char plain[] =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='5'/>"
    "</integrator><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,1,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='21'/><integer name='height' value='17'/>"
    "</film></sensor><emitter type='constant' id='sky'/>"
    "<bsdf type='roughconductor' id='ball'/><shape type='sphere'><ref id='ball'/></shape>"
    "</scene>";
static const char textured[] =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='5'/>"
    "</integrator><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,1,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='21'/><integer name='height' value='17'/>"
    "<rfilter type='%s'/></film></sensor><emitter type='constant' id='sky'/>"
    "<bsdf type='diffuse' id='floor'><texture type='bitmap' name='reflectance' id='map'>"
    "<string name='filename' value='%s/textured/waves.png'/></texture></bsdf>"
    "<bsdf type='diffuse' id='ball'/>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/>"
    "<scale value='3'/><translate y='-1'/></transform><ref id='floor'/></shape>"
    "<shape type='sphere'><ref id='ball'/></shape></scene>";

static void run_all(int threads, imp_scene *(*make)(imp_context *), bool few,
                    struct output *out)
{
    imp_context *ctx = test_context(threads);
    imp_scene *scene = make(ctx);
    imp_problem *p = test_problem(ctx, scene, "*");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    struct imp_film_info info = {.size = sizeof info};
    run.spp = 20;
    run.seed = 3;
    test_must(ctx, imp_render(scene, &run, &film));
    imp_film_get_info(film, &info);
    const size_t values = (size_t)info.width * info.height * info.channels,
                 n = imp_problem_n_variables(p);
    keep(out, imp_film_mean(film), values, 4);
    keep(out, imp_film_se(film), values, 4);

    struct imp_target target = IMP_TARGET_INIT;
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    target.pixels = imp_film_mean(film);
    test_must(ctx, imp_problem_add_target(p, &target));
    struct imp_estimate J;
    double *g = calloc(4 * n, sizeof *g);
    run.seed = 4;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &J, g, g + n));
    keep(out, &J.value, 1, 8);
    keep(out, g, 2 * n, 8);
    test_must(ctx, imp_problem_reverse(p, imp_film_mean(film), &run, g, g + n));
    keep(out, g, 2 * n, 8);
    imp_film *slope;
    for (size_t k = 0; k < n; k++) g[k] = 1.0 / (double)(k + 1);
    test_must(ctx, imp_problem_forward(p, g, &run, &slope));
    keep(out, imp_film_mean(slope), values, 4);
    imp_film_destroy(slope);
    if (few) {
        struct imp__gauss_newton gn = {0};
        gn.H = calloc(n * n, 8);
        gn.cov_g = calloc(n * n, 8);
        test_must(ctx, imp__gauss_newton(p, NULL, &run, &gn));
        keep(out, gn.H, n * n, 8);
        keep(out, gn.cov_g, n * n, 8);
        free(gn.H);
        free(gn.cov_g);
    }
    free(g);
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
}

static imp_scene *stam(imp_context *ctx)
{
    return test_scene(ctx, "stam.xml", IMP_MONO, NULL);
}
static imp_scene *cornell(imp_context *ctx)
{
    return test_scene(ctx, "cornell.xml", IMP_RGB, "res=30");
}
static imp_scene *map(imp_context *ctx, const char *filter)
{
    char xml[2048];
    snprintf(xml, sizeof xml, textured, filter, IMP_SCENES);
    return test_scene_text(ctx, xml, IMP_RGB);
}
static imp_scene *map_box(imp_context *ctx) { return map(ctx, "box"); }
static imp_scene *default_filter(imp_context *ctx)
{
    return test_scene_text(ctx, plain, IMP_RGB);
}
static imp_scene *map_gaussian(imp_context *ctx) { return map(ctx, "gaussian"); }
#define SKY "width=21 height=17 weights=kernel=1,environment=1,uniform=.2"
static imp_scene *photons(imp_context *ctx)
{
    return test_scene(ctx, "photons/sky.xml", IMP_RGB, SKY);
}
static imp_scene *photons_spectral(imp_context *ctx)
{
    return test_scene(ctx, "photons/sky.xml", IMP_SPECTRAL, SKY);
}
static imp_scene *proxies_single(imp_context *ctx)
{
    return test_scene(ctx, "photons/reflector.xml", IMP_SINGLE,
                      "res=20 weights=kernel=1,proxies=1");
}
static imp_scene *cornell_spectral(imp_context *ctx)
{
    return test_scene(ctx, "cornell.xml", IMP_SPECTRAL, "res=20");
}

int main(void)
{
    static const struct {
        const char *name;
        imp_scene *(*make)(imp_context *);
        bool few;
    } cases[] = {{"stam", stam, true},
                 {"cornell", cornell, true},
                 {"the default filter", default_filter, true},
                 {"texture, box filter", map_box, false},
                 {"texture, gaussian filter", map_gaussian, false},
                 {"photons under a sky", photons, false},
                 {"photons under a sky, spectral", photons_spectral, false},
                 {"photons and proxies, single", proxies_single, false},
                 {"cornell, spectral", cornell_spectral, false}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct output one = {0};
        run_all(1, cases[k].make, cases[k].few, &one);
        for (int i = 0; i < 3; i++) {
            static const int counts[] = {2, 3, 7};
            const int threads = counts[i];
            struct output many = {0};
            run_all(threads, cases[k].make, cases[k].few, &many);
            size_t differ = 0;
            for (size_t v = 0; v < one.n && v < many.n; v++)
                differ += memcmp(&one.numbers[v], &many.numbers[v], 8) != 0;
            tap_ok(one.n == many.n && differ == 0,
                   "%s: %d threads give the bits of one # %zu numbers, %zu differ",
                   cases[k].name, threads, one.n, differ);
            free(many.numbers);
        }
        free(one.numbers);
    }
    return tap_done();
}
