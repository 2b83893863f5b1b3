/* SPDX-License-Identifier: Apache-2.0
 *
 * Bent rays, measured in one run and printed as JSON.
 *
 *     bend_bench [--repeats N] [--rays N] [--nodes N] [--full]
 *
 *   fields: ray-steps per second and thread (processor time) forwards, and the time of
 *     the adjoint over it, for both interpolations at 33^3, 129^3 and 257^3 (--nodes: one
 *     of them)
 *   threads: wall time on one thread over two, processor time on two over one
 *   memory: peak of allocations at 16 times the steps over that at 1
 *   iteration (--full): one forward and adjoint of 772,000 rays at 129^3, wall seconds */
#include <importon/bend.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int repeats = 5, only_nodes;
static size_t n_rays = 4096;

static size_t now_bytes, peak_bytes;
static void *count_alloc(size_t bytes, void *payload)
{
    (void)payload;
    size_t *p = aligned_alloc(64, (bytes + 127) / 64 * 64);
    if (!p) return NULL;
    *p = bytes;
    const size_t now = __atomic_add_fetch(&now_bytes, bytes, __ATOMIC_RELAXED);
    size_t peak = peak_bytes;
    while (now > peak &&
           !__atomic_compare_exchange_n(&peak_bytes, &peak, now, 0, __ATOMIC_RELAXED,
                                        __ATOMIC_RELAXED)) {}
    return (char *)p + 64;
}
static void count_release(void *memory, void *payload)
{
    (void)payload;
    if (!memory) return;
    size_t *p = (size_t *)(void *)((char *)memory - 64);
    __atomic_sub_fetch(&now_bytes, *p, __ATOMIC_RELAXED);
    free(p);
}

static imp_context *context(int threads)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    o.threads = threads;
    o.allocator = (struct imp_allocator){count_alloc, count_release, NULL};
    if (imp_context_create(&o, &ctx) != IMP_OK) exit(3);
    return ctx;
}
static void must(imp_context *ctx, enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "bend_bench: %s\n", imp_last_error(ctx));
    exit(3);
}

static double seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *v, int n)
{
    qsort(v, (size_t)n, sizeof *v, by_value);
    return v[n / 2];
}

/* A Luneburg lens on samples, rays along z within 0.9 of its radius. */
struct work {
    imp_context *ctx;
    imp_field *f;
    struct imp_bend_options o;
    struct imp_bend_surface exit;
    double (*x)[3], (*d)[3];
    struct imp_bend_rays rays;
    struct imp_bend_exit *exits;
    struct imp_bend_cotangent *bars;
    double *theta_bar;
    struct imp_bend_stats stats;
};

static void work_make(struct work *w, int threads, enum imp_field_interp interp,
                      int single, int nodes, size_t n, double step_cells)
{
    memset(w, 0, sizeof *w);
    w->ctx = context(threads);
    struct imp_field_grid g = IMP_FIELD_GRID_INIT;
    const int M = nodes - 1;
    g.interp = interp;
    g.single = single;
    for (int k = 0; k < 3; k++) g.cells[k] = M, g.lo[k] = -1, g.hi[k] = 1;
    must(w->ctx, imp_field_grid_create(w->ctx, &g, 1, &w->f));
    const size_t m = (size_t)nodes;
    double *s = malloc(m * m * m * sizeof *s);
    for (size_t k = 0; k < m; k++)
        for (size_t j = 0; j < m; j++)
            for (size_t i = 0; i < m; i++) {
                const double x = -1 + 2.0 * (double)i / M, y = -1 + 2.0 * (double)j / M,
                             z = -1 + 2.0 * (double)k / M, r2 = x * x + y * y + z * z;
                s[i + m * (j + m * k)] = r2 < 1 ? sqrt(2 - r2) : 1;
            }
    must(w->ctx, imp_field_set_samples(w->f, s));
    free(s);
    w->exit = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    w->exit.offset = 1;
    w->stats = (struct imp_bend_stats)IMP_BEND_STATS_INIT;
    w->o = (struct imp_bend_options)IMP_BEND_OPTIONS_INIT;
    w->o.surfaces = &w->exit, w->o.n_surfaces = 1;
    w->o.step = step_cells * 2.0 / M;
    w->o.grazing = -1;
    w->x = calloc(n, sizeof *w->x), w->d = calloc(n, sizeof *w->d);
    for (size_t i = 0; i < n; i++) { /* neighbours in the beam follow each other */
        const size_t side = (size_t)ceil(sqrt((double)n));
        const double u = 2 * ((double)(i % side) + 0.5) / (double)side - 1;
        const double v = 2 * ((double)(i / side) + 0.5) / (double)side - 1;
        w->x[i][0] = 0.63 * u, w->x[i][1] = 0.63 * v, w->x[i][2] = -0.99999;
        w->d[i][2] = 1;
    }
    w->rays = (struct imp_bend_rays){.size = sizeof(struct imp_bend_rays),
                                     .n = n,
                                     .x = (const double(*)[3])w->x,
                                     .d = (const double(*)[3])w->d,
                                     .group = NULL};
    w->exits = calloc(n, sizeof *w->exits);
    w->bars = calloc(n, sizeof *w->bars);
    w->theta_bar = calloc(imp_field_n_theta(w->f), sizeof(double));
}
static void work_free(struct work *w)
{
    free(w->x), free(w->d), free(w->exits), free(w->bars), free(w->theta_bar);
    imp_field_destroy(w->f);
    imp_context_destroy(w->ctx);
}
static double forward(struct work *w, clockid_t clock)
{
    const double start = seconds(clock);
    must(w->ctx, imp_bend_trace(w->f, &w->o, &w->rays, w->exits, NULL, &w->stats));
    const double t = seconds(clock) - start;
    for (size_t i = 0; i < w->rays.n; i++)
        for (int k = 0; k < 2; k++) w->bars[i].x[k] = w->exits[i].x[k];
    return t;
}
static double backward(struct work *w, clockid_t clock)
{
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.theta = w->theta_bar;
    const double start = seconds(clock);
    must(w->ctx, imp_bend_adjoint(w->f, &w->o, &w->rays, w->exits, NULL, w->bars, NULL,
                                  &g, NULL));
    return seconds(clock) - start;
}

static void fields(void)
{
    static const struct {
        const char *name;
        enum imp_field_interp interp;
        int single;
    } kinds[] = {{"trilinear float", IMP_FIELD_TRILINEAR, 1},
                 {"trilinear", IMP_FIELD_TRILINEAR, 0},
                 {"spline float", IMP_FIELD_SPLINE, 1},
                 {"spline", IMP_FIELD_SPLINE, 0}};
    static const int sizes[] = {33, 129, 257};
    const char *comma = "";
    printf(" \"fields\": [");
    for (int k = 0; k < 4; k++)
        for (int s = 0; s < 3; s++) {
            struct work w;
            double rate[64], ratio[64];
            if (only_nodes && only_nodes != sizes[s]) continue;
            const size_t n = n_rays * (size_t)(4 << s); /* about one a cell of a face */
            work_make(&w, 1, kinds[k].interp, kinds[k].single, sizes[s], n, 0.5);
            forward(&w, CLOCK_PROCESS_CPUTIME_ID);
            for (int r = 0; r < repeats; r++) {
                const double f = forward(&w, CLOCK_PROCESS_CPUTIME_ID);
                const double b = backward(&w, CLOCK_PROCESS_CPUTIME_ID);
                rate[r] = (double)w.stats.steps / f * 1e-6;
                ratio[r] = b / f;
            }
            printf("%s\n  {\"field\": \"%s\", \"nodes\": %d, "
                   "\"million_ray_steps_per_s\": %.2f, "
                   "\"adjoint/forward\": %.3f}",
                   comma, kinds[k].name, sizes[s], median(rate, repeats),
                   median(ratio, repeats));
            comma = ",";
            fflush(stdout);
            work_free(&w);
        }
    printf("],\n");
}

/* Wall time is what counts, and says nothing where the cores are busy with other work:
 * there processor time tells what a second thread costs. */
static void threads(void)
{
    double wall[2][64], cpu[2][64];
    struct work w[2];
    for (int k = 0; k < 2; k++) {
        work_make(&w[k], k + 1, IMP_FIELD_SPLINE, 0, 129, 8 * n_rays, 0.5);
        forward(&w[k], CLOCK_MONOTONIC);
    }
    for (int r = 0; r < repeats; r++)
        for (int back = 0; back < 2; back++) {
            double t[2], c[2];
            for (int k = 0; k < 2; k++) {
                c[k] = seconds(CLOCK_PROCESS_CPUTIME_ID);
                t[k] = (back ? backward : forward)(&w[k], CLOCK_MONOTONIC);
                c[k] = seconds(CLOCK_PROCESS_CPUTIME_ID) - c[k];
            }
            wall[back][r] = t[0] / t[1];
            cpu[back][r] = c[1] / c[0];
        }
    printf(" \"threads\": {\"forward 1/2\": %.3f, \"adjoint 1/2\": %.3f, "
           "\"forward processor time 2/1\": %.3f, \"adjoint processor time 2/1\": "
           "%.3f},\n",
           median(wall[0], repeats), median(wall[1], repeats), median(cpu[0], repeats),
           median(cpu[1], repeats));
    work_free(&w[0]);
    work_free(&w[1]);
}

static void memory(void)
{
    double peak[2];
    for (int k = 0; k < 2; k++) {
        struct work w;
        work_make(&w, 1, IMP_FIELD_SPLINE, 0, 33, 1024, k ? 0.5 / 16 : 0.5);
        peak_bytes = now_bytes;
        forward(&w, CLOCK_MONOTONIC);
        backward(&w, CLOCK_MONOTONIC);
        peak[k] = (double)peak_bytes;
        work_free(&w);
    }
    printf(" \"memory\": {\"peak_bytes\": %.0f, \"16 times the steps/1\": %.4f}", peak[0],
           peak[1] / peak[0]);
}

static void iteration(void)
{
    struct work w;
    work_make(&w, 2, IMP_FIELD_SPLINE, 0, 129, 772000, 0.5);
    peak_bytes = now_bytes;
    const double f = forward(&w, CLOCK_MONOTONIC), b = backward(&w, CLOCK_MONOTONIC);
    printf(",\n \"iteration\": {\"rays\": 772000, \"nodes\": 129, \"threads\": 2, "
           "\"steps\": %.0f, "
           "\"forward_s\": %.2f, \"adjoint_s\": %.2f, \"peak_bytes\": %.0f}",
           (double)w.stats.steps, f, b, (double)peak_bytes);
    work_free(&w);
}

int main(int argc, char **argv)
{
    int full = 0;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--full")) full = 1;
        else if (i + 1 < argc && !strcmp(argv[i], "--repeats")) repeats = atoi(argv[++i]);
        else if (i + 1 < argc && !strcmp(argv[i], "--rays"))
            n_rays = (size_t)atol(argv[++i]);
        else if (i + 1 < argc && !strcmp(argv[i], "--nodes"))
            only_nodes = atoi(argv[++i]);
        else {
            fprintf(stderr,
                    "usage: bend_bench [--repeats N] [--rays N] [--nodes N] [--full]\n");
            return 2;
        }
    }
    if (repeats < 1 || repeats > 64 || n_rays < 64) return 2;
    printf("{\n");
    fields();
    threads();
    memory();
    if (full) iteration();
    printf("\n}\n");
    return 0;
}
