/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples until an albedo is known: a floor of SIDE x SIDE texels between a wall, a lamp and the
 * sky, seen by four cameras of WIDTH x WIDTH pixels, from grey to the texture that made the
 * targets; and whether other coordinates than the texels get there sooner.
 *
 *     textures [--side N] [--width N] [--spp N] [--iterations N] [--threads N] [--seed N]
 *              [--target-spp N] [ROW]...
 *
 * Targets are the same for all seeds.
 *
 * Prints the root of the mean squared error of all texels after so many samples of each pixel
 * (iterations x spp). Rows, all by default:
 *
 *     fit M [plain | levels | smooth | noisy [RATE]]
 *                                       importon fit with momentum M, 0: what it does by
 *                                       itself; from coarse to fine in 3 levels, with
 *                                       smoothness, or without control variates
 *     texels M, pyramid M, large M      plain Adam with momentum M in coordinates c of
 *                                       x = B c: B = 1, a Laplacian pyramid of 5 levels whose
 *                                       rate is halved from level to level, or
 *                                       (1 + L)^-1, L the Laplacian of the grid, with one second
 *                                       moment for all (Nicolet, Jacob and Jakob 2021)
 *
 * A row is a word and a number, as "fit .5" or "fit .5 levels", in quotes. */
#include "inverse/estimate/replicates.h"
#include "inverse/gradient/objective_gradient.h"
#include "inverse/gradient/variate.h"
#include "inverse/problem/cells.h"
#include "math/rng.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { VIEWS = 4, LEVELS = 5, COARSE = 3 };
#define RATE       .05  /* of all rows that name none */
#define LARGE_RATE .03  /* that of (1 + L)^-1; not tuned */
#define SMOOTH     .003 /* weight */

static imp_context *ctx;
static int side = 64, width = 96, spp = 8, iterations = 150, threads = 1, seed = 1;
static int target_spp = 2048;
static size_t n; /* numbers */
static double *truth;
static float *grey, *target[VIEWS];

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "textures: %s\n", imp_last_error(ctx));
    exit(3);
}
static void *room(size_t count, size_t size)
{
    void *p = calloc(count + 1, size);
    if (!p) exit(3);
    return p;
}

/* ---- The floor --------------------------------------------------------------------- */

/* At x, y in texels: slow waves, a disc, bricks, a checkerboard of 4 texels, ripples. */
static double paint(double x, double y, int c)
{
    const double u = x / side, v = y / side, du = u - .3, dv = v - .65;
    double a = .5 + .25 * sin(5 * u + 1.7 * c) * cos(4 * v - c);
    if (du * du + dv * dv < .03) a = c == 0 ? .85 : .15;
    if (u > .55 && u < .9 && v > .1 && v < .45)
        a = fmod(y / 8, 1) < .15 || fmod(x / 16 + .5 * floor(y / 8), 1) < .1
                ? .8
                : .3 + .1 * c;
    if (u > .6 && v > .6) a = ((int)(x / 4) + (int)(y / 4)) % 2 ? .7 : .35;
    if (u < .25 && v < .3) a += .2 * sin(x * (v + .1) * (1 + c) * .6);
    return fmin(fmax(a, 0), 1);
}

static void texture_make(float *pixels)
{
    enum { SUB = 4 };
    for (int i = 0; i < side * side * 3; i++) {
        double sum = 0;
        for (int k = 0; k < SUB * SUB; k++)
            sum += paint(i / 3 % side + (k % SUB + .5) / SUB,
                         i / 3 / side + (k / SUB + .5) / SUB, i % 3);
        pixels[i] = (float)(sum / (SUB * SUB));
    }
}

/* to_world of a camera at `o` that looks at the origin, z up: columns x, y, z, o. */
static void look(const double *o, double *m)
{
    const double far = sqrt(o[0] * o[0] + o[1] * o[1] + o[2] * o[2]);
    const double flat = sqrt(o[0] * o[0] + o[1] * o[1]);
    const double z[3] = {-o[0] / far, -o[1] / far, -o[2] / far};
    const double x[3] = {o[1] / flat, -o[0] / flat, 0};
    const double y[3] = {z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2],
                         z[0] * x[1] - z[1] * x[0]};
    for (int k = 0; k < 3; k++)
        m[4 * k] = x[k], m[4 * k + 1] = y[k], m[4 * k + 2] = z[k], m[4 * k + 3] = o[k];
    m[12] = m[13] = m[14] = 0, m[15] = 1;
}

static void rectangle(imp_scene *s, const double *at)
{
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    if (at) imp_scene_transform(s, "to_world", at);
}

static imp_scene *scene_make(const float *pixels)
{
    static const double eye[VIEWS][3] = {
        {0, -2.2, 2.4}, {2, -.8, 2.6}, {-2, -.6, 2.6}, {.3, -.5, 3.2}};
    static const double wall[16] = {1, 0, 0, 0, 0, 0, -1, 1, 0, 1, 0, 1, 0, 0, 0, 1};
    static const double panel[16] = {.4, 0, 0,   -.8, 0, -.4, 0, -.3,
                                     0,  0, -.4, 2.2, 0, 0,   0, 1};
    imp_scene *s = NULL;
    must(imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_end(s);
    for (int k = 0; k < VIEWS; k++) {
        double to_world[16];
        char id[16];
        look(eye[k], to_world);
        snprintf(id, sizeof id, "eye%d", k);
        imp_scene_begin(s, "sensor", "perspective", id, NULL);
        imp_scene_float(s, "fov", 40);
        imp_scene_transform(s, "to_world", to_world);
        imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
        imp_scene_integer(s, "width", width);
        imp_scene_integer(s, "height", width);
        imp_scene_begin(s, "rfilter", "box", NULL, NULL);
        imp_scene_end(s);
        imp_scene_end(s);
        imp_scene_end(s);
    }
    imp_scene_begin(s, "emitter", "constant", "sky", NULL);
    imp_scene_float(s, "radiance", .6);
    imp_scene_end(s);
    rectangle(s, panel);
    imp_scene_begin(s, "emitter", "area", "lamp", NULL);
    imp_scene_float(s, "radiance", 8);
    imp_scene_end(s);
    imp_scene_end(s);
    rectangle(s, NULL);
    imp_scene_begin(s, "bsdf", "diffuse", "floor", NULL);
    imp_scene_begin(s, "texture", "bitmap", "paint", "reflectance");
    imp_scene_bool(s, "raw", 1);
    imp_scene_image(s, side, side, 3, pixels);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    rectangle(s, wall);
    imp_scene_begin(s, "bsdf", "diffuse", "plaster", NULL);
    imp_scene_float(s, "reflectance", .7);
    imp_scene_end(s);
    imp_scene_end(s);
    must(imp_scene_commit(s));
    return s;
}

static void targets_make(const float *pixels)
{
    const size_t count = (size_t)width * (size_t)width * 3;
    imp_scene *s = scene_make(pixels);
    for (int k = 0; k < VIEWS; k++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film;
        run.spp = target_spp;
        run.points = IMP_POINTS_SOBOL;
        run.sensor = k;
        run.seed = 1001;
        target[k] = room(count, sizeof(float));
        must(imp_render(s, &run, &film));
        memcpy(target[k], imp_film_mean(film), count * sizeof(float));
        imp_film_destroy(film);
    }
    imp_scene_destroy(s);
}

static imp_problem *problem_make(imp_scene **scene)
{
    imp_problem *p;
    *scene = scene_make(grey);
    must(imp_problem_create(*scene, &p));
    must(imp_problem_activate(p, "paint.*"));
    for (int k = 0; k < VIEWS; k++) {
        struct imp_target t = IMP_TARGET_INIT;
        t.sensor = k;
        t.width = t.height = width;
        t.channels = 3;
        t.pixels = target[k];
        must(imp_problem_add_target(p, &t));
    }
    return p;
}

/* ---- What is printed ---------------------------------------------------------------- */

static const int shown[] = {5, 10, 15, 20, 30, 45, 60, 100, 150};
static bool is_shown(int done)
{
    for (size_t k = 0; k < sizeof shown / sizeof *shown; k++)
        if (shown[k] == done) return true;
    return false;
}

static void show(const double *x, int done)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++) sum += imp__sqr(x[k] - truth[k]);
    printf(" %d: %.4f", done * spp, sqrt(sum / (double)n));
    fflush(stdout);
}

static size_t unseen(void)
{
    imp_scene *s;
    imp_problem *p = problem_make(&s);
    double *g = room(n, sizeof *g);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate J;
    size_t count = 0;
    run.spp = 16;
    must(imp_problem_objective(p, NULL, &run, &J, g, NULL));
    for (size_t k = 0; k < n; k++) count += g[k] == 0;
    free(g);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    return count;
}

/* ---- Rows --------------------------------------------------------------------------- */

/* Parts of one fit, each resumed from the last one's checkpoint: the bits of the whole. */
static void fit(double momentum, const char *how, double rate)
{
    imp_scene *s;
    imp_problem *p = problem_make(&s);
    double *x = room(n, sizeof *x);
    char file[64];
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    snprintf(file, sizeof file, "/tmp/textures.%ld.checkpoint", (long)getpid());
    remove(file);
    run.spp = spp;
    run.seed = (uint64_t)seed;
    o.momentum = momentum;
    o.learning_rate = rate > 0 ? rate : RATE;
    o.checkpoint = file;
    if (strcmp(how, "levels") == 0) o.levels = COARSE;
    if (strcmp(how, "noisy") == 0) o.control_variate = IMP_VARIATES_OFF;
    if (strcmp(how, "smooth") == 0)
        must(imp_problem_add_smoothness(p, "paint.*", SMOOTH));
    for (int i = 1; i <= iterations; i++) {
        const struct imp_fit_result *result;
        if (!is_shown(i) && i < iterations) continue;
        o.max_iterations = i;
        if (o.levels) { /* an iteration's level is by the number of all */
            remove(file);
            for (size_t k = 0; k < n; k++) x[k] = grey[k];
            must(imp_problem_set_x(p, x));
        }
        must(imp_fit(p, &o, &run, &result));
        imp_problem_get_x(p, x);
        show(x, i);
        o.resume = !o.levels;
    }
    remove(file);
    free(x);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

enum basis { TEXELS, PYRAMID, LARGE };

/* Coefficients of a pyramid: those of the texels, then of coarser and coarser grids. */
static struct imp__cells grid[LEVELS];
static size_t first[LEVELS + 1];

static void pyramid_make(void)
{
    grid[0] = (struct imp__cells){{1, (size_t)side, (size_t)side}, 3};
    for (int k = 0; k < LEVELS; k++) {
        if (k > 0) grid[k] = imp__cells_coarse(&grid[k - 1], 1);
        first[k + 1] = first[k] + imp__cells_count(&grid[k]);
    }
}
static void pyramid_down(double *c) /* c = B^T c, of which the first n are given */
{
    for (int k = 1; k < LEVELS; k++)
        imp__cells_restrict(&grid[k - 1], 1, c + first[k - 1], c + first[k]);
}
static void pyramid_up(double *c, double *work) /* the first n of c = B c */
{
    for (int k = LEVELS - 1; k > 0; k--) {
        imp__cells_prolong(&grid[k - 1], 1, c + first[k], work);
        for (size_t i = 0; i < first[k] - first[k - 1]; i++)
            c[first[k - 1] + i] += .5 * work[i];
    }
}

static double *wave; /* [side][side] cosines, orthonormal */

static void waves_make(void)
{
    const size_t N = (size_t)side;
    wave = room(N * N, sizeof *wave);
    for (size_t a = 0; a < N; a++)
        for (size_t i = 0; i < N; i++)
            wave[a * N + i] = cos(M_PI * ((double)i + .5) * (double)a / (double)N) *
                              sqrt((a ? 2. : 1.) / (double)N);
}

/* (1 + L)^-1 x, by cosines along both axes. work: [2 n]. */
static void large(double *x, double *work)
{
    const size_t N = (size_t)side;
    double *mid = work, *f = work + n;
    for (int back = 0; back < 2; back++) {
        const double *in = back ? f : x;
        double *out = back ? x : f;
        memset(mid, 0, n * sizeof *mid);
        for (size_t y = 0; y < N; y++)
            for (size_t k = 0; k < N; k++)
                for (size_t i = 0; i < N; i++)
                    for (size_t c = 0; c < 3; c++)
                        mid[(y * N + k) * 3 + c] +=
                            wave[back ? i * N + k : k * N + i] * in[(y * N + i) * 3 + c];
        memset(out, 0, n * sizeof *out);
        for (size_t k = 0; k < N; k++)
            for (size_t i = 0; i < N; i++)
                for (size_t j = 0; j < 3 * N; j++)
                    out[k * 3 * N + j] +=
                        wave[back ? i * N + k : k * N + i] * mid[i * 3 * N + j];
        for (size_t a = 0; !back && a < N; a++)
            for (size_t b = 0; b < N; b++)
                for (size_t c = 0; c < 3; c++)
                    f[(a * N + b) * 3 + c] /= 5 - 2 * cos(M_PI * (double)a / (double)N) -
                                              2 * cos(M_PI * (double)b / (double)N);
    }
}

/* Coordinates are never needed, only their steps: x <- x - B step(B^T g). Texels that press
 * against a bound are left out of both. */
static void adam(enum basis basis, double momentum)
{
    imp_scene *s;
    imp_problem *p = problem_make(&s);
    struct imp__variate *variate;
    struct imp_run run = IMP_RUN_INIT;
    const size_t m_n = basis == PYRAMID ? first[LEVELS] : n;
    double *x = room(n, sizeof *x), *g = room(n, sizeof *g), *c = room(m_n, sizeof *c);
    double *m = room(m_n, sizeof *m), *v = room(m_n, sizeof *v);
    double *work = room(2 * n, sizeof *work);
    run.spp = spp;
    must(imp__variate_create(p, &run, &variate));
    for (size_t k = 0; k < n; k++) x[k] = grey[k];
    for (int i = 1; i <= iterations; i++) {
        double largest = 0;
        run.seed = imp__mix64(((uint64_t)seed << 32) + (uint64_t)i);
        p->variate = variate;
        must(imp__problem_objective(p, x, &run, true, NULL, g, NULL));
        p->variate = NULL;
        for (size_t k = 0; k < n; k++)
            c[k] = (x[k] <= 0 && g[k] > 0) || (x[k] >= 1 && g[k] < 0) ? 0 : g[k];
        if (basis == PYRAMID) pyramid_down(c);
        if (basis == LARGE) large(c, work);
        for (size_t k = 0; k < m_n; k++) {
            m[k] = momentum * m[k] + (1 - momentum) * c[k];
            v[k] = .99 * v[k] + .01 * c[k] * c[k];
            largest = fmax(largest, v[k]);
        }
        const double c1 = 1 - pow(momentum, i), c2 = 1 - pow(.99, i);
        const double rate = basis == LARGE ? LARGE_RATE : RATE;
        for (size_t k = 0; k < m_n; k++)
            c[k] =
                rate * m[k] / c1 / (sqrt((basis == LARGE ? largest : v[k]) / c2) + 1e-30);
        if (basis == PYRAMID) pyramid_up(c, work);
        if (basis == LARGE) large(c, work);
        for (size_t k = 0; k < n; k++)
            if (!(x[k] <= 0 && c[k] > 0) && !(x[k] >= 1 && c[k] < 0))
                x[k] = fmin(fmax(x[k] - c[k], 0), 1);
        if (is_shown(i) || i == iterations) show(x, i);
    }
    imp__variate_destroy(variate);
    free(x), free(g), free(c), free(m), free(v), free(work);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static bool row(const char *text)
{
    static const char *const words[] = {"texels", "pyramid", "large", "fit"};
    char word[16], how[16] = "";
    double momentum, rate = 0;
    if (sscanf(text, "%15s %lf %15s %lf", word, &momentum, how, &rate) < 2) return false;
    for (int k = 0; k < 4; k++) {
        if (strcmp(word, words[k]) != 0) continue;
        printf("%-20s", text);
        if (k == 3) fit(momentum, how, rate);
        else adam((enum basis)k, momentum);
        printf("\n");
        return true;
    }
    return false;
}

int main(int argc, char **argv)
{
    static const char *const all[] = {
        "fit 0",        "fit .9",       "fit .7",       "fit .3",    "fit 0 levels",
        "fit 0 smooth", "fit .9 noisy", "fit .5 noisy", "texels .9", "texels .5",
        "pyramid .9",   "pyramid .5",   "large .9",     "large .5"};
    const char *rows[16];
    int n_rows = 0, wrong = 0;
    static const struct {
        const char *name;
        int *value;
    } numbers[] = {{"--side", &side},
                   {"--width", &width},
                   {"--spp", &spp},
                   {"--iterations", &iterations},
                   {"--threads", &threads},
                   {"--seed", &seed},
                   {"--target-spp", &target_spp}};
    for (int k = 1; k < argc; k++) {
        int *value = NULL;
        for (int j = 0; j < 7; j++)
            if (strcmp(argv[k], numbers[j].name) == 0) value = numbers[j].value;
        if (value && k + 1 < argc) *value = atoi(argv[++k]);
        else if (!value && *argv[k] != '-' && n_rows < 16) rows[n_rows++] = argv[k];
        else wrong = 1;
    }
    if (wrong || side < 8 || width < 8 || spp < 4 || iterations < 1 || threads < 0 ||
        target_spp < 1) {
        fprintf(stderr,
                "usage: textures [--side N] [--width N] [--spp N] [--iterations N] "
                "[--threads N] [--seed N] [--target-spp N] [ROW]...\n");
        return 2;
    }
    const struct imp_context_options o = {.size = sizeof o, .threads = threads};
    if (imp_context_create(&o, &ctx) != IMP_OK) return 3;
    n = (size_t)side * (size_t)side * 3;
    float *pixels = room(n, sizeof *pixels);
    truth = room(n, sizeof *truth), grey = room(n, sizeof *grey);
    texture_make(pixels);
    for (size_t k = 0; k < n; k++) truth[k] = pixels[k], grey[k] = .5f;
    targets_make(pixels);
    pyramid_make();
    waves_make();
    printf("%d x %d texels, %d views of %d x %d, %d samples an iteration; %zu texels are "
           "never seen\n",
           side, side, VIEWS, width, width, spp, unseen());
    if (n_rows == 0)
        for (size_t k = 0; k < sizeof all / sizeof *all; k++) rows[n_rows++] = all[k];
    for (int k = 0; k < n_rows; k++)
        if (!row(rows[k])) fprintf(stderr, "textures: '%s' is no row\n", rows[k]);
    imp_context_destroy(ctx);
    return 0;
}
