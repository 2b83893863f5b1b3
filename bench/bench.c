/* SPDX-License-Identifier: Apache-2.0
 *
 * The numbers to hold, measured in one run and printed as JSON: ratios, because machines
 * are noisy and differ. Each pair is timed in turn, A B A B ..., and the median of the
 * pairs' ratios is reported.
 *
 *     bench [--repeats N] [--spp N] [--scene FILE]
 *
 *   rays/render      the rays of a render, traced again and nothing else, over the render
 *   gradient/render  loss and gradient of all parameters over the picture, same spp
 *   texture          the same with 1024 x 1024 x 3 texels active
 *   threads          one thread over two
 *   first_gradient_s process start to the first gradient, 64 x 64, 4 spp
 *   memory           peak memory at 65,536 spp over that at 16 spp, 16 x 16 pixels */
#include "base/pool.h"
#include "walk/core/walk.h"
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *scene_file = IMP_SCENES "/cornell.xml";
static int repeats = 5, spp = 16;

static void must(imp_context *ctx, enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "bench: %s: %s\n", imp_status_text(st),
            ctx ? imp_last_error(ctx) : "");
    exit(3);
}

static imp_context *context(int threads)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx = NULL;
    o.threads = threads;
    must(NULL, imp_context_create(&o, &ctx));
    return ctx;
}

static imp_scene *load(imp_context *ctx, const char *file, int res)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char define[32];
    const char *list[] = {define};
    imp_scene *scene;
    snprintf(define, sizeof define, "res=%d", res);
    o.defines = list;
    o.n_defines = 1;
    must(ctx, imp_scene_load(ctx, file, &o, &scene));
    return scene;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, by_value);
    return n % 2 ? x[n / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

static double time_render(imp_context *ctx, imp_scene *scene, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    const double start = imp__now();
    must(ctx, imp_render(scene, &run, &film));
    const double time = imp__now() - start;
    imp_film_destroy(film);
    return time;
}

/* ---- rays/render --------------------------------------------------------------- */

struct ray {
    imp_v3 o, d;
    double t_max;
    bool shadow;
};
struct rays {
    struct ray *list;
    size_t n, per_item;
    const imp_scene *scene;
    size_t hits;
};

/* The rays that made the walks of a render, from their records. */
static void rays_record(imp_context *ctx, imp_scene *scene, struct rays *out)
{
    const struct imp_sensor *sensor = scene->sensors[0];
    const struct imp_tracer tracer = {.scene = scene,
                                      .integrator = imp__walk_integrator(scene),
                                      .sensor = sensor,
                                      .seed = 1};
    struct imp_arena arena;
    size_t capacity = 0;
    imp__arena_init(&arena, ctx);
    *out = (struct rays){.scene = scene};
    for (int y = 0; y < sensor->film.crop_h; y++)
        for (int x = 0; x < sensor->film.crop_w; x++)
            for (int s = 0; s < spp; s++) {
                const struct imp_arena_mark mark = imp__arena_mark(&arena);
                struct imp_walk walk;
                imp__walk_trace(&tracer, &arena, x, y, s, &walk);
                out->list =
                    imp__grow(ctx, out->list, &capacity, out->n + 64, sizeof *out->list);
                if (!out->list) exit(3);
                imp_v3 o = walk.ray.o;
                for (const struct imp_vertex *v = walk.first; v; v = v->next) {
                    if (!v->shape) break;
                    out->list[out->n++] = (struct ray){
                        o, imp__normalize(imp__decided_v3(v->d.p) - o), INFINITY, false};
                    if (v->d.connection != IMP_NOT_CONNECTED) {
                        const imp_v3 d = imp__normalize(imp__decided_v3(v->d.light.p) -
                                                        imp__decided_v3(v->d.p));
                        out->list[out->n++] =
                            (struct ray){imp__offset(imp__decided_v3(v->d.p), v->ng, d),
                                         d, v->d.light.dist * .9999, true};
                    }
                    if (v->next && v->next->shape)
                        o = imp__offset(imp__decided_v3(v->d.p), v->ng,
                                        imp__decided_v3(v->next->d.p) -
                                            imp__decided_v3(v->d.p));
                    if (out->n + 64 > capacity) break;
                }
                imp__arena_rewind(&arena, mark);
            }
    imp__arena_free(&arena);
    out->per_item = 4096;
}

static enum imp_status rays_work(size_t item, int worker, int slot, void *payload)
{
    struct rays *r = payload;
    size_t hits = 0;
    (void)worker, (void)slot;
    for (size_t k = item * r->per_item; k < imp_min(r->n, (item + 1) * r->per_item);
         k++) {
        const struct ray *ray = &r->list[k];
        struct imp_hit hit;
        if (ray->shadow) hits += imp__occluded(r->scene, &ray->o, &ray->d, 0, ray->t_max);
        else hits += imp__intersect(r->scene, &ray->o, &ray->d, 0, ray->t_max, &hit);
    }
    __atomic_add_fetch(&r->hits, hits, __ATOMIC_RELAXED);
    return IMP_OK;
}

static double time_rays(imp_context *ctx, struct rays *r)
{
    const struct imp_loop loop = {.n_items = (r->n + r->per_item - 1) / r->per_item,
                                  .work = rays_work,
                                  .payload = r};
    const double start = imp__now();
    must(ctx, imp__parallel(ctx, &loop, NULL));
    return imp__now() - start;
}

static void bench_rays(void)
{
    imp_context *ctx = context(2);
    imp_scene *scene = load(ctx, scene_file, 256);
    struct rays rays;
    double ratio[64], rate[64];
    rays_record(ctx, scene, &rays);
    for (int k = 0; k < repeats; k++) {
        const double a = time_rays(ctx, &rays), b = time_render(ctx, scene, 1);
        ratio[k] = a / b;
        rate[k] = (double)rays.n / a;
    }
    printf("  \"rays_over_render\": %.3f,\n  \"rays_per_second\": %.3g,\n",
           median(ratio, repeats), median(rate, repeats));
    imp__release(ctx, rays.list);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
}

/* ---- gradient/render ----------------------------------------------------------- */

static double time_gradient(imp_context *ctx, imp_problem *p, double *g, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate J;
    run.spp = spp;
    run.seed = seed;
    const double start = imp__now();
    must(ctx,
         imp_problem_objective(p, NULL, &run, &J, g, g + imp_problem_n_variables(p)));
    return imp__now() - start;
}

static imp_problem *problem(imp_context *ctx, imp_scene *scene)
{
    struct imp_sensor_info s = {.size = sizeof s};
    struct imp_target target = IMP_TARGET_INIT;
    imp_problem *p;
    must(ctx, imp_scene_get_sensor(scene, 0, &s));
    float *pixels = calloc((size_t)s.width * (size_t)s.height * 3, sizeof *pixels);
    if (!pixels) exit(3);
    must(ctx, imp_problem_create(scene, &p));
    must(ctx, imp_problem_activate(p, "*"));
    target.width = s.width;
    target.height = s.height;
    target.channels = 3;
    target.pixels = pixels;
    must(ctx, imp_problem_add_target(p, &target));
    free(pixels);
    return p;
}

static void bench_gradient(const char *key, imp_context *ctx, imp_scene *scene)
{
    imp_problem *p = problem(ctx, scene);
    double ratio[64];
    double *g = calloc(2 * imp_problem_n_variables(p) + 1, sizeof *g);
    if (!g) exit(3);
    time_gradient(ctx, p, g, 1);
    for (int k = 0; k < repeats; k++) {
        const double a = time_gradient(ctx, p, g, 2), b = time_render(ctx, scene, 2);
        ratio[k] = a / b;
    }
    printf("  \"%s\": %.3f,\n  \"%s_numbers\": %zu,\n", key, median(ratio, repeats), key,
           imp_problem_n_variables(p));
    free(g);
    imp_problem_destroy(p);
}

/* The box with a 1024 x 1024 texture on every white wall. */
static imp_scene *textured(imp_context *ctx)
{
    enum { SIDE = 1024 };
    imp_scene *s;
    float *pixels = malloc((size_t)SIDE * SIDE * 3 * sizeof *pixels);
    if (!pixels) exit(3);
    for (size_t k = 0; k < (size_t)SIDE * SIDE * 3; k++) pixels[k] = .5f;
    must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 6);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_float(s, "fov", 40);
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 3.9, 0, 0, 0, 1};
    imp_scene_transform(s, "to_world", camera);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 256);
    imp_scene_integer(s, "height", 256);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "bsdf", "diffuse", "map", NULL);
    imp_scene_begin(s, "texture", "bitmap", "texels", "reflectance");
    imp_scene_image(s, SIDE, SIDE, 3, pixels);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "cube", NULL, NULL);
    imp_scene_bool(s, "flip_normals", 1);
    imp_scene_ref(s, "map", NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    const double lamp[16] = {.3, 0, 0, 0, 0, 0, -.3, .99, 0, .3, 0, 0, 0, 0, 0, 1};
    imp_scene_transform(s, "to_world", lamp);
    imp_scene_begin(s, "emitter", "area", "lamp", NULL);
    const double power[3] = {10, 10, 10};
    imp_scene_rgb(s, "radiance", power);
    imp_scene_end(s);
    imp_scene_end(s);
    must(ctx, imp_scene_commit(s));
    free(pixels);
    return s;
}

static void bench_threads(void)
{
    imp_context *one = context(1), *two = context(2);
    imp_scene *a = load(one, scene_file, 256), *b = load(two, scene_file, 256);
    double ratio[64];
    for (int k = 0; k < repeats; k++)
        ratio[k] = time_render(one, a, 3) / time_render(two, b, 3);
    printf("  \"two_threads_speedup\": %.3f,\n", median(ratio, repeats));
    imp_scene_destroy(a);
    imp_scene_destroy(b);
    imp_context_destroy(one);
    imp_context_destroy(two);
}

/* ---- in processes of their own ------------------------------------------------- */

static int child(int res, int child_spp)
{
    spp = child_spp;
    imp_context *ctx = context(2);
    imp_scene *scene = load(ctx, scene_file, res);
    imp_problem *p = problem(ctx, scene);
    double *g = calloc(2 * imp_problem_n_variables(p) + 1, sizeof *g);
    time_gradient(ctx, p, g, 1);
    free(g);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return 0;
}

/* Run this program again; seconds it took, and its peak memory in KiB. */
static double spawn(const char *self, int res, int child_spp, long *peak)
{
    char r[16], s[16];
    struct rusage usage;
    snprintf(r, sizeof r, "%d", res);
    snprintf(s, sizeof s, "%d", child_spp);
    const double start = imp__now();
    const pid_t pid = fork();
    if (pid == 0) {
        execl(self, self, "--child", r, s, "--scene", scene_file, (char *)NULL);
        _exit(127);
    }
    int status;
    wait4(pid, &status, 0, &usage);
    *peak = usage.ru_maxrss;
    return status == 0 ? imp__now() - start : NAN;
}

int main(int argc, char **argv)
{
    int child_res = 0, child_spp = 0;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--repeats") && i + 1 < argc) repeats = atoi(argv[++i]);
        else if (!strcmp(argv[i], "--spp") && i + 1 < argc) spp = atoi(argv[++i]);
        else if (!strcmp(argv[i], "--scene") && i + 1 < argc) scene_file = argv[++i];
        else if (!strcmp(argv[i], "--child") && i + 2 < argc) {
            child_res = atoi(argv[++i]);
            child_spp = atoi(argv[++i]);
        } else {
            fprintf(stderr, "usage: bench [--repeats N] [--spp N] [--scene FILE]\n");
            return 2;
        }
    }
    repeats = imp_clamp(repeats, 1, 64);
    if (child_res) return child(child_res, child_spp);

    printf("{\n  \"importon\": \"%s\",\n  \"repeats\": %d,\n  \"spp\": %d,\n",
           imp_version(), repeats, spp);
    bench_rays();
    imp_context *ctx = context(2);
    imp_scene *scene = load(ctx, scene_file, 256);
    bench_gradient("gradient_over_render", ctx, scene);
    imp_scene_destroy(scene);
    scene = textured(ctx);
    bench_gradient("texture_gradient_over_render", ctx, scene);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    bench_threads();

    double start[64];
    long small = 0, large = 0;
    for (int k = 0; k < repeats; k++) start[k] = spawn(argv[0], 64, 4, &small);
    printf("  \"first_gradient_s\": %.3f,\n", median(start, repeats));
    spawn(argv[0], 16, 16, &small);
    spawn(argv[0], 16, 65536, &large);
    printf("  \"memory_65536_over_16_spp\": %.3f\n}\n", (double)large / (double)small);
    return 0;
}
