/* SPDX-License-Identifier: Apache-2.0
 *
 * Sizes and scenes at the edge of sense: each gives a clear error or a right picture,
 * soon, and without more memory than it needs. */
#include "base/pool.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/core/walk.h"
#include <time.h>

static imp_context *ctx;

/* Of all threads: what else the machine does is no part of it. */
static double processor_s(void) { return (double)clock() / CLOCKS_PER_SEC; }
static size_t live, peak;

/* Counts bytes, to see that memory stays flat. */
static void *counting_allocate(size_t bytes, void *payload)
{
    (void)payload;
    if (bytes > (size_t)4 << 30) return NULL;
    unsigned char *p = aligned_alloc(64, ((bytes + 127) / 64) * 64);
    if (!p) return NULL;
    memcpy(p, &bytes, sizeof bytes);
    const size_t now = __atomic_add_fetch(&live, bytes, __ATOMIC_RELAXED);
    if (now > peak) peak = now;
    return p + 64;
}
static void counting_release(void *memory, void *payload)
{
    (void)payload;
    size_t bytes;
    memcpy(&bytes, (unsigned char *)memory - 64, sizeof bytes);
    __atomic_sub_fetch(&live, bytes, __ATOMIC_RELAXED);
    free((unsigned char *)memory - 64);
}

static void scene_text(char *xml, size_t size, const char *integrator, const char *film,
                       const char *rest)
{
    snprintf(
        xml, size,
        "<scene version='3.0.0'><integrator type='path'>%s</integrator>"
        "<sensor type='perspective'><transform name='to_world'><lookat origin='0,0,4' "
        "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>%s"
        "<rfilter type='box'/></film></sensor>%s</scene>",
        integrator, film, rest);
}
static enum imp_status load(const char *integrator, const char *film, const char *rest,
                            imp_scene **out)
{
    char xml[4096];
    scene_text(xml, sizeof xml, integrator, film, rest);
    *out = NULL;
    return imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, out);
}
#define SIZE(w, h)                                                                       \
    "<integer name='width' value='" #w "'/><integer name='height' value='" #h "'/>"
#define BALL "<emitter type='constant'/><shape type='sphere'/>"

static double mean_of(imp_film *film)
{
    struct imp_film_info i = {.size = sizeof i};
    double sum = 0;
    imp_film_get_info(film, &i);
    for (int k = 0; k < i.width * i.height * i.channels; k++)
        sum += imp_film_mean(film)[k];
    return sum / (i.width * i.height * i.channels);
}

static void films(void)
{
    static const struct {
        const char *film;
        bool loads;
    } cases[] = {
        {SIZE(40000, 40000), true},
        {SIZE(100000, 100000), false},
        {SIZE(1048576, 1048576), false},
        {SIZE(2147483647, 1), false},
        {SIZE(0, 4), false},
        {SIZE(-3, 4), false},
        {SIZE(99999999999999999999, 4), false},
        {SIZE(8, 8) "<integer name='crop_width' value='2147483647'/>", false},
        {SIZE(8, 8) "<integer name='crop_offset_x' value='-2147483648'/>", false},
        {SIZE(8, 8) "<integer name='crop_offset_x' value='4'/>"
                    "<integer name='crop_width' value='2147483647'/>",
         false},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        imp_scene *s;
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film = NULL;
        const double start = processor_s();
        enum imp_status st = load("", cases[k].film, BALL, &s);
        const bool loaded = st == IMP_OK;
        run.spp = 1;
        if (loaded) st = imp_render(s, &run, &film);
        tap_ok((loaded ? st == IMP_E_NOMEM || st == IMP_E_ARG : st == IMP_E_SCENE) &&
                   loaded == cases[k].loads && !film && *imp_last_error(ctx) &&
                   processor_s() - start < 2,
               "%s # %s", cases[k].film, imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    imp_film *film = NULL;
    tap_ok(imp_film_create(ctx, 1 << 20, 1 << 20, "R,G,B", &film) == IMP_E_NOMEM && !film,
           "a film of 2^40 pixels # %s", imp_last_error(ctx));
    tap_ok(imp_film_create(ctx, INT32_MAX, INT32_MAX, "R", &film) == IMP_E_ARG && !film,
           "a film of 2^62 pixels # %s", imp_last_error(ctx));
}

static void far_off(void)
{
    static const char *const shapes[] = {
        "<shape type='sphere'><float name='radius' value='2e18'/></shape>",
        ("<shape type='rectangle'><transform name='to_world'><translate y='2e18'/>"
         "</transform></shape>"),
        "<shape type='cylinder'><point name='p1' value='0, 0, 1e19'/></shape>",
    };
    for (size_t k = 0; k < sizeof shapes / sizeof *shapes; k++) {
        imp_scene *s;
        tap_ok(load("", SIZE(8, 8), shapes[k], &s) == IMP_E_SCENE && !s &&
                   strncmp(imp_last_error(ctx), "test:1:", 7) == 0 &&
                   strstr(imp_last_error(ctx),
                          k ? "reaches further out than 1e+18" : "is outside (0, 1e+18)"),
               "%s # %s", shapes[k], imp_last_error(ctx));
    }
}

static int stop_now(const struct imp_progress *p, void *payload)
{
    (void)p;
    ++*(int *)payload;
    return 1;
}

static void samples(void)
{
    imp_scene *s;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    struct imp_film_info info = {.size = sizeof info};
    int calls = 0;
    test_must(ctx, load("", SIZE(9, 9), BALL, &s));
    run.spp = INT32_MAX;
    run.progress = stop_now;
    run.progress_payload = &calls;
    enum imp_status st = imp_render(s, &run, &film);
    imp_film_get_info(film, &info);
    tap_ok(st == IMP_CANCELLED && film && calls >= 1 && info.spp < 100000,
           "2^31 - 1 samples, cancelled at the first report # %s, %d calls, %lld samples",
           imp_status_text(st), calls, (long long)info.spp);
    imp_film_destroy(film);

    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    o.samples = INT32_MAX;
    o.progress = stop_now;
    o.progress_payload = &calls;
    for (int subject = IMP_SELFTEST_MATERIAL; subject <= IMP_SELFTEST_LIGHT; subject++) {
        const struct imp_selftest_row *rows = NULL;
        size_t n = 0;
        calls = 0;
        const double start = processor_s();
        st = imp_selftest(s, (enum imp_selftest_subject)subject, &o, &rows, &n);
        tap_ok(st == IMP_CANCELLED && calls == 1 && !rows && n == 0 &&
                   processor_s() - start < 2,
               "self-test %d of as many draws, cancelled # %s", subject,
               imp_last_error(ctx));
    }

    imp_problem *p = test_problem(ctx, s, "*");
    static float pixels[9 * 9 * 3];
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = 9, t.channels = 3, t.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &t));
    struct imp_estimate J;
    double g[64];
    calls = 0;
    st = imp_problem_objective(p, NULL, &run, &J, g, NULL);
    tap_ok(st == IMP_CANCELLED && calls >= 1, "its objective too # %s",
           imp_status_text(st));
    film = NULL;
    run.spp = -5;
    st = imp_render(s, &run, &film);
    tap_ok(st == IMP_E_ARG && !film, "spp -5 # %s", imp_last_error(ctx));
    run = (struct imp_run)IMP_RUN_INIT;
    run.spp = 1;
    film = NULL;
    run.sensor = 3;
    tap_ok(imp_render(s, &run, &film) == IMP_E_ARG && !film, "no sensor 3 # %s",
           imp_last_error(ctx));
    run.sensor = -1;
    tap_ok(imp_render(s, &run, &film) == IMP_E_ARG && !film, "no sensor -1 # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* One pixel, many samples: all threads work, and no walk is kept longer than its batch.
 */
static void one_pixel(void)
{
    imp_scene *s;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *few, *many;
    test_must(ctx, load("<integer name='max_depth' value='3'/>", SIZE(1, 1), BALL, &s));
    imp_problem *p = test_problem(ctx, s, "*");
    static float pixels[3];
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_estimate J;
    double g[64];
    t.width = t.height = 1, t.channels = 3, t.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &t));
    size_t peaks[2];
    for (int k = 0; k < 2; k++) {
        run.spp = k ? 65536 : 1024;
        peak = live;
        test_must(ctx, imp_render(s, &run, k ? &many : &few));
        test_must(ctx, imp_problem_objective(p, NULL, &run, &J, g, NULL));
        peaks[k] = peak - live;
    }
    tap_ok(peaks[1] <= peaks[0] + (512 << 10),
           "one pixel: memory does not follow spp # %zu, %zu kB", peaks[0] >> 10,
           peaks[1] >> 10);
    const double se = hypot(imp_film_se(few)[0], imp_film_se(many)[0]);
    tap_ok(fabs(imp_film_mean(few)[0] - imp_film_mean(many)[0]) < 4.5 * se,
           "the same picture # %.4f +- %.4f, %.4f", imp_film_mean(few)[0], se,
           imp_film_mean(many)[0]);
    imp_film_destroy(few);
    imp_film_destroy(many);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

#define WHITE "<bsdf type='diffuse'><rgb name='reflectance' value='1'/></bsdf>"

/* Nothing ends a walk in a closed white room without roulette. */
static void endless(void)
{
    imp_scene *s;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    const double start = processor_s();
    test_must(ctx,
              load("<integer name='max_depth' value='-1'/><integer name='rr_depth' "
                   "value='2147483647'/>",
                   SIZE(16, 16),
                   "<shape type='sphere'><transform name='to_world'><scale value='9'/>"
                   "</transform><boolean name='flip_normals' value='true'/>" WHITE
                   "</shape>",
                   &s));
    run.spp = 64;
    tap_ok(imp_render(s, &run, &film) == IMP_E_PATHS && !film &&
               processor_s() - start < 20,
           "walks without end # %s", imp_last_error(ctx));
    char *text = NULL;
    test_must(ctx, imp_walk_describe(s, &run, 3, 3, 0, 0, &text));
    tap_ok(strstr(text, "nothing ended the walk") != NULL, "the walk says so");
    imp_free(ctx, text);
    imp_problem *p = test_problem(ctx, s, "*");
    static float seed[16 * 16 * 3];
    double g[3];
    tap_ok(imp_problem_reverse(p, seed, &run, g, NULL) == IMP_E_PATHS, "gradients # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);

    /* With roulette the same room is dark, and every walk ends. */
    test_must(ctx,
              load("<integer name='max_depth' value='2147483647'/>", SIZE(4, 4),
                   "<shape type='sphere'><transform name='to_world'><scale value='9'/>"
                   "</transform><boolean name='flip_normals' value='true'/>" WHITE
                   "</shape>",
                   &s));
    test_must(ctx, imp_render(s, &run, &film));
    tap_ok(mean_of(film) == 0, "depth 2^31 - 1 with roulette");
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

static void empty(void)
{
    static const struct {
        const char *what, *rest;
        double mean;
    } cases[] = {
        {"no light", "<shape type='sphere'/>", 0},
        {"no shape", "<emitter type='constant'/>", 1},
        {"nothing", "", 0},
        {"looking away",
         "<shape type='sphere'><transform name='to_world'><translate z='20'/>"
         "</transform></shape><emitter type='point'/>",
         0},
        {"a light that is never chosen",
         "<shape type='sphere'/><emitter type='point'><float name='sampling_weight' "
         "value='0'/>"
         "<point name='position' x='0' y='0' z='8'/></emitter>",
         0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        imp_scene *s;
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film = NULL;
        run.spp = 4;
        test_must(ctx, load("", SIZE(4, 4), cases[k].rest, &s));
        test_must(ctx, imp_render(s, &run, &film));
        tap_near(mean_of(film), cases[k].mean, 0, 0, cases[k].what);
        imp_film_destroy(film);
        imp_problem *p;
        test_must(ctx, imp_problem_create(s, &p));
        enum imp_status st = imp_problem_activate(p, "*");
        if (imp_scene_n_params(s) == 0) {
            tap_ok(st == IMP_E_ARG, "%s: nothing to activate # %s", cases[k].what,
                   imp_last_error(ctx));
        } else {
            static float seed[4 * 4 * 3];
            double g[64], x[64];
            for (int i = 0; i < 48; i++) seed[i] = 1;
            test_must(ctx, imp_problem_reverse(p, seed, &run, g, x));
            bool finite = true;
            for (size_t i = 0; i < imp_problem_n_variables(p); i++)
                finite &= isfinite(g[i]) && isfinite(x[i]);
            tap_ok(finite, "%s: finite gradients", cases[k].what);
        }
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
    /* An area light of weight 0 is met by chance: the picture is the same. */
    imp_film *film[2];
    struct imp_estimate e[2];
    for (int k = 0; k < 2; k++) {
        char rest[512];
        imp_scene *s;
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 2000;
        run.seed = (uint64_t)k;
        snprintf(rest, sizeof rest,
                 "<shape type='rectangle'/><shape type='sphere'><point name='center' "
                 "x='0' y='0' "
                 "z='2'/><float name='radius' value='0.8'/><emitter type='area'>"
                 "<float name='sampling_weight' value='%d'/></emitter></shape>",
                 k);
        test_must(ctx, load("<boolean name='hide_emitters' value='true'/>", SIZE(4, 4),
                            rest, &s));
        test_must(ctx, imp_render(s, &run, &film[k]));
        double variance = 0;
        for (int i = 0; i < 48; i += 3) variance += pow(imp_film_se(film[k])[i], 2);
        e[k] =
            (struct imp_estimate){.value = mean_of(film[k]), .se = sqrt(variance) / 16};
        imp_film_destroy(film[k]);
        imp_scene_destroy(s);
    }
    const double se = hypot(e[0].se, e[1].se);
    tap_ok(fabs(e[0].value - e[1].value) < 4.5 * se && e[1].value > 0,
           "sampling_weight does not change the picture # %.4f, %.4f +- %.4f", e[0].value,
           e[1].value, se);
}

/* Loading is linear in the number of objects. */
static void many_shapes(void)
{
    imp_scene *s;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    const int n = 100000;
    const double start = processor_s();
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, -1, 40, 2, 2);
    for (int i = 0; i < n; i++) {
        const double at[3] = {i % 100, i / 100 % 100, 5 + i / 10000};
        imp_scene_begin(s, "shape", "sphere", NULL, NULL);
        imp_scene_vector(s, "center", at);
        imp_scene_float(s, "radius", 0.3);
        imp_scene_end(s);
    }
    test_must(ctx, imp_scene_commit(s));
    struct imp_scene_info info = {.size = sizeof info};
    imp_scene_get_info(s, &info);
    test_must(ctx, imp_render(s, &run, &film));
    tap_ok(info.n_shapes == n && imp_scene_n_params(s) == (size_t)n &&
               processor_s() - start < 20,
           "%d spheres # %zu MB", n, info.memory_bytes >> 20);
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

static void small_texture(void)
{
    imp_scene *s;
    const float grey[3] = {0.25f, 0.25f, 0.25f};
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 1, 20, 3, 3);
    test_picture_wall(s, 1, 1, grey);
    test_must(ctx, imp_scene_commit(s));
    run.spp = 4096;
    test_must(ctx, imp_render(s, &run, &film));
    tap_near(mean_of(film), 0.25, 0.02, 0, "a texture of one texel");
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

/* Inputs of nested materials double with every level: 3 * 2^levels here. */
static void nested(void)
{
    for (int levels = 1; levels <= 40; levels += levels < 5 ? 1 : 35) {
        char rest[8192] = "<emitter type='constant'/><bsdf type='phong' id='m0'/>";
        for (int k = 0; k < levels; k++) {
            const size_t used = strlen(rest);
            snprintf(
                rest + used, sizeof rest - used,
                "<bsdf type='twosided' id='m%d'><ref id='m%d'/><ref id='m%d'/></bsdf>",
                k + 1, k, k);
        }
        const size_t used = strlen(rest);
        snprintf(rest + used, sizeof rest - used,
                 "<shape type='sphere'><ref id='m%d'/></shape>", levels);
        imp_scene *s = NULL;
        const enum imp_status st = load("", SIZE(4, 4), rest, &s);
        if (3 * pow(2, levels) > IMP_INPUTS_MAX) {
            tap_ok(st == IMP_E_SCENE && !s, "%d levels of materials # %s", levels,
                   imp_last_error(ctx));
            continue;
        }
        imp_problem *p = test_problem(ctx, s, "*");
        struct imp_run run = IMP_RUN_INIT;
        static float seed[4 * 4 * 3];
        double g[64];
        for (int i = 0; i < 48; i++) seed[i] = 1;
        test_must(ctx, imp_problem_reverse(p, seed, &run, g, NULL));
        bool finite = true;
        for (size_t i = 0; i < imp_problem_n_variables(p); i++) finite &= isfinite(g[i]);
        tap_ok(finite, "%d levels of materials have a gradient", levels);
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
}

/* Properties that nobody reads: 65,536 of them took over a minute of processor time when each
 * was looked at beside all others. */
static void unread(void)
{
    enum { N = 65536 };
    static const char one[] = "<float name='radiu%05d' value='1'/>";
    const size_t size = 256 + N * sizeof one;
    char *xml = malloc(size);
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s = NULL;
    if (!xml) return;
    size_t n =
        (size_t)snprintf(xml, size, "<scene version='3.0.0'><shape type='sphere'>");
    for (int k = 0; k < N; k++) n += (size_t)snprintf(xml + n, size - n, one, k);
    n += (size_t)snprintf(xml + n, size - n, "</shape></scene>");
    const double begun = processor_s();
    const enum imp_status st = imp_scene_load_string(ctx, xml, n, "test", &o, &s);
    const double seconds = processor_s() - begun;
    tap_ok(st == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "'radiu00000', 'radiu00001'") && seconds < 5,
           "%d unknown properties are refused # %.2g s", N, seconds);
    free(xml);
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 2;
    o.allocator = (struct imp_allocator){counting_allocate, counting_release, NULL};
    if (imp_context_create(&o, &ctx) != IMP_OK) return 1;
    films();
    far_off();
    samples();
    one_pixel();
    endless();
    empty();
    many_shapes();
    small_texture();
    nested();
    unread();
    imp_context_destroy(ctx);
    tap_ok(live == 0, "all memory is given back");
    return tap_done();
}
