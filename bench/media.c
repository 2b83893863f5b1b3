/* SPDX-License-Identifier: Apache-2.0
 *
 * Media: samples and segments a second, time to 1 % in the median pixel that is not exact,
 * and what derivatives with respect to every number of the extinction cost: of the picture's
 * mean, and of an l2 loss with its value; one thread, processor time, in turn.
 *
 *     media DIR [REPEATS [SPP [N]]]
 *
 * A homogeneous box, a plume of N^3 cells (128) and a clear sky are written to DIR as
 * scenes, which bench/peers/media.py has Mitsuba measure beside it. Lines for it are
 *
 *     NAME picture SECONDS gradient SECONDS variance SUM noise ERROR segments NUMBER
 *
 * for `spp` samples a pixel, SUM the sum of the squared errors of all derivatives, ERROR
 * the median pixel's, relative, NUMBER that of a walk. */
#include "plume.h"
#include "walk/core/walk.h"
#include <sys/resource.h>
#include <time.h>

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "media: %s\n", imp_last_error(ctx));
    exit(3);
}
static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static const char scene_text[] =
    "<default name=\"integrator\" value=\"volpath\"/>\n"
    "<integrator type=\"$integrator\"><integer name=\"max_depth\" value=\"16\"/>"
    "</integrator>\n"
    "<sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/>\n"
    "<transform name=\"to_world\"><lookat origin=\"0.5,0.5,3\" target=\"0.5,0.5,0.5\" "
    "up=\"0,1,0\"/></transform>\n"
    "<film type=\"hdrfilm\"><integer name=\"width\" value=\"128\"/><integer "
    "name=\"height\" value=\"128\"/><rfilter type=\"box\"/></film></sensor>\n"
    "<shape type=\"cube\"><bsdf type=\"null\"/><ref id=\"smoke\" name=\"interior\"/>"
    "<transform name=\"to_world\"><translate x=\"1\" y=\"1\" z=\"1\"/>"
    "<scale value=\"0.5\"/></transform></shape>\n"
    "<emitter type=\"constant\"><float name=\"radiance\" value=\"0.5\"/></emitter>\n"
    "<shape type=\"sphere\"><point name=\"center\" x=\"3\" y=\"3\" z=\"2\"/>"
    "<float name=\"radius\" value=\"0.3\"/><emitter type=\"area\">"
    "<rgb name=\"radiance\" value=\"40,36,30\"/></emitter></shape>\n</scene>\n";
static const char box_text[] =
    "<medium type=\"homogeneous\" id=\"smoke\"><float name=\"sigma_t\" value=\"3\"/>"
    "<float name=\"albedo\" value=\"0.9\"/><phase type=\"hg\"><float name=\"g\" "
    "value=\"0.3\"/></phase></medium>";
static const char plume_text[] =
    "<medium type=\"heterogeneous\" id=\"smoke\"><volume type=\"gridvolume\" "
    "name=\"sigma_t\" id=\"density\"><string name=\"filename\" value=\"plume.vol\"/>"
    "</volume><float name=\"albedo\" value=\"0.9\"/><phase type=\"hg\"><float "
    "name=\"g\" value=\"0.3\"/></phase></medium>";
/* The air of scenes/sky.xml as a grid of three colours (650, 550, 450 nm), which Mitsuba
 * has, too: up to 80 km over a black planet, within 500 km; the sun is a direction. */
static const char sky_text[] =
    "<default name=\"integrator\" value=\"volpath\"/>\n"
    "<integrator type=\"$integrator\"><integer name=\"max_depth\" value=\"16\"/>"
    "</integrator>\n"
    "<medium type=\"heterogeneous\" id=\"air\"><volume type=\"gridvolume\" "
    "name=\"sigma_t\" id=\"density\"><string name=\"filename\" value=\"sky.vol\"/>"
    "<boolean name=\"raw\" value=\"true\"/><transform name=\"to_world\">"
    "<scale x=\"1000\" y=\"125\" z=\"1000\"/>"
    "<translate x=\"-500\" y=\"-45\" z=\"-500\"/></transform></volume>"
    "<float name=\"albedo\" value=\"1\"/><phase type=\"rayleigh\"/></medium>\n"
    "<shape type=\"cube\"><bsdf type=\"null\"/><ref id=\"air\" name=\"interior\"/>"
    "<transform name=\"to_world\"><scale x=\"500\" y=\"62.5\" z=\"500\"/>"
    "<translate y=\"17.5\"/></transform></shape>\n"
    "<shape type=\"sphere\"><point name=\"center\" x=\"0\" y=\"-6360\" z=\"0\"/>"
    "<float name=\"radius\" value=\"6360\"/><bsdf type=\"diffuse\"><float "
    "name=\"reflectance\" value=\"0\"/></bsdf><ref id=\"air\" name=\"exterior\"/>"
    "</shape>\n"
    "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"-0.5\" "
    "z=\"-0.8660254\"/><float name=\"irradiance\" value=\"3.1415927\"/></emitter>\n"
    "<sensor type=\"perspective\"><float name=\"fov\" value=\"60\"/>"
    "<transform name=\"to_world\"><lookat origin=\"0,0.1,0\" target=\"0,0.8,1\" "
    "up=\"0,1,0\"/></transform><ref id=\"air\"/>\n"
    "<film type=\"hdrfilm\"><integer name=\"width\" value=\"128\"/><integer "
    "name=\"height\" value=\"128\"/><rfilter type=\"box\"/></film></sensor>\n</scene>\n";

/* The grid of sky_text, in 1/km: optical depths of the column by Hansen and Travis (1974),
 * scale height 8 km. 0: it cannot be written. */
static int sky_write(const char *path)
{
    enum { NX = 32, NY = 128, NZ = 32 };
    static const double depth[3] = {.0493, .0973, .2213};
    const int32_t head[5] = {1, NX, NY, NZ, 3};
    const float box[6] = {0, 0, 0, 1, 1, 1};
    FILE *f = fopen(path, "wb");
    if (!f) return 0;
    int ok = fwrite("VOL\3", 1, 4, f) == 4 && fwrite(head, 4, 5, f) == 5 &&
             fwrite(box, 4, 6, f) == 6;
    for (int k = 0; k < NZ && ok; k++)
        for (int j = 0; j < NY && ok; j++)
            for (int i = 0; i < NX && ok; i++) {
                const double x = 1000 * (i + .5) / NX - 500, y = 125 * (j + .5) / NY - 45,
                             z = 1000 * (k + .5) / NZ - 500;
                const double h =
                    fmax(sqrt(x * x + (y + 6360) * (y + 6360) + z * z) - 6360, 0);
                float value[3];
                for (int c = 0; c < 3; c++)
                    value[c] = (float)(depth[c] / 8 * exp(-h / 8));
                ok = fwrite(value, 4, 3, f) == 3;
            }
    return fclose(f) == 0 && ok;
}

/* Median relative error of a pixel's green, of those that have one. */
static double noise(imp_film *f)
{
    struct imp_film_info info = {.size = sizeof info};
    must(imp_film_get_info(f, &info));
    const int n = info.width * info.height;
    double *e = malloc((size_t)n * sizeof *e), m;
    size_t noisy = 0;
    for (int p = 0; p < n; p++) {
        const double mean = (double)imp_film_mean(f)[3 * p + 1],
                     se = (double)imp_film_se(f)[3 * p + 1];
        if (se > 1e-6 * mean) e[noisy++] = se / mean;
    }
    qsort(e, noisy, sizeof *e, by_value);
    m = noisy ? e[noisy / 2] : 0;
    free(e);
    return m;
}

/* Vertices of a walk, which is how many segments it has, in the mean. */
static double segments(const imp_scene *s)
{
    const struct imp_tracer tracer = {.scene = s,
                                      .integrator = imp__walk_integrator(s),
                                      .sensor = s->sensors[0],
                                      .value_only = true};
    const struct imp_film_desc *film = &tracer.sensor->film;
    struct imp_arena arena;
    double sum = 0;
    imp__arena_init(&arena, ctx);
    for (int y = 0; y < film->crop_h; y++)
        for (int x = 0; x < film->crop_w; x++) {
            const struct imp_arena_mark mark = imp__arena_mark(&arena);
            struct imp_walk w;
            imp__walk_trace(&tracer, &arena, x, y, 0, &w);
            sum += w.n;
            imp__arena_rewind(&arena, mark);
        }
    imp__arena_free(&arena);
    return sum / (film->crop_w * film->crop_h);
}

static long peak_kib(void)
{
    struct rusage u;
    getrusage(RUSAGE_SELF, &u);
    return u.ru_maxrss;
}

/* The target: a picture of other random numbers. */
static void target_add(imp_scene *scene, imp_problem *p)
{
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f;
    run.seed = 12345;
    run.spp = 4;
    must(imp_render(scene, &run, &f));
    must(imp_film_get_info(f, &info));
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    target.pixels = imp_film_mean(f);
    must(imp_problem_add_target(p, &target));
    imp_film_destroy(f);
}

static void measure(const char *name, const char *path, const char *numbers, int repeats,
                    int spp)
{
    imp_scene *scene;
    imp_problem *p;
    double *g, *se, picture = 1e300, gradient = 1e300, loss = 1e300, error = 0, sum = 0;
    must(imp_scene_load(ctx, path, NULL, &scene));
    must(imp_problem_create(scene, &p));
    must(imp_problem_activate(p, numbers));
    const size_t n = imp_problem_n_variables(p);
    g = malloc(n * sizeof *g);
    se = malloc(n * sizeof *se);
    target_add(scene, p);
    const long before = peak_kib();
    for (int r = 0; r < repeats; r++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        run.seed = (uint64_t)r + 1;
        run.spp = spp;
        double t = cpu();
        must(imp_render(scene, &run, &f));
        picture = fmin(picture, cpu() - t);
        error = noise(f);
        imp_film_destroy(f);
        t = cpu();
        must(imp_problem_functional(p, NULL, &run, NULL, g, se));
        gradient = fmin(gradient, cpu() - t);
        for (size_t i = 0; i < n; i++) sum += se[i] * se[i] / repeats;
        struct imp_estimate value;
        t = cpu();
        must(imp_problem_objective(p, NULL, &run, &value, g, se));
        loss = fmin(loss, cpu() - t);
    }
    const double samples = 128. * 128. * spp, walk = segments(scene);
    printf(
        "%s: %zu numbers, %.3g samples and %.3g segments a second; 1 %% in the median "
        "pixel in %.2f s; gradient/picture %.2f; (loss + gradient)/picture %.2f; memory "
        "of the gradient %.1f bytes a number\n",
        name, n, samples / picture, walk * samples / picture,
        picture * pow(error / .01, 2), gradient / picture, loss / picture,
        1024. * (double)(peak_kib() - before) / (double)n);
    printf("%s picture %.4f gradient %.4f variance %.6g noise %.6g segments %.4f\n", name,
           picture, gradient, sum, error, walk);
    free(g);
    free(se);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void scene_write(const char *path, const char *medium, const char *rest)
{
    FILE *f = fopen(path, "w");
    if (!f || fprintf(f, "<scene version=\"3.0.0\">\n%s\n%s", medium, rest) < 0 ||
        fclose(f) != 0) {
        fprintf(stderr, "media: %s cannot be written\n", path);
        exit(3);
    }
}

int main(int argc, char **argv)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    char box[1024], plume[1024], grid[1024], sky[1024], air[1024];
    if (argc < 2) {
        fprintf(stderr, "usage: media DIR [REPEATS [SPP [N]]]\n");
        return 2;
    }
    const int repeats = argc > 2 ? atoi(argv[2]) : 3, spp = argc > 3 ? atoi(argv[3]) : 32,
              n = argc > 4 ? atoi(argv[4]) : 128;
    snprintf(box, sizeof box, "%s/box.xml", argv[1]);
    snprintf(plume, sizeof plume, "%s/plume.xml", argv[1]);
    snprintf(grid, sizeof grid, "%s/plume.vol", argv[1]);
    snprintf(sky, sizeof sky, "%s/sky.xml", argv[1]);
    snprintf(air, sizeof air, "%s/sky.vol", argv[1]);
    scene_write(box, box_text, scene_text);
    scene_write(plume, plume_text, scene_text);
    scene_write(sky, "", sky_text);
    if (repeats < 1 || spp < 2 || n < 1 || !plume_write(grid, n, 7) || !sky_write(air)) {
        fprintf(stderr, "media: %s or %s cannot be written\n", grid, air);
        return 3;
    }
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    measure("box", box, "smoke.sigma_t.value", repeats, spp);
    measure("plume", plume, "density.data", repeats, spp);
    measure("sky", sky, "density.data", repeats, spp);
    imp_context_destroy(ctx);
    return 0;
}
