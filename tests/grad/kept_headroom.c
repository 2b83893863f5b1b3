/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks with room for extinctions to grow. Pictures agree with fresh ones within their
 * errors at the draw, where all of a grid is larger, and where cells that had none have
 * some; so do derivatives with respect to the grid, cells without any among them. Above
 * the bounds they are refused, and without headroom. A search for a denser cloud evaluates
 * recorded walks, and finds it. */
#include "kept_media.h"
#include <unistd.h>

static char grey[64], coloured[64], coarse[64];

/* ---- Values ------------------------------------------------------------------------ */

/* Grids before and after: of each number, by which it is multiplied, and what is added
 * where k % 3 is 0. */
struct change {
    double factor, more;
};
static void change_grid(imp_scene *scene, const char *name, struct change c)
{
    double x[3 * CELLS];
    size_t n, k = param(scene, name, x, &n);
    for (size_t e = 0; e < n; e++) x[e] = c.factor * x[e] + (e % 3 ? 0 : c.more);
    test_must(ctx, imp_scene_set_values(scene, k, n, x));
}
/* A third of the cells is empty. */
static void empty_some(imp_scene *scene, const char *name)
{
    double x[3 * CELLS];
    size_t n, k = param(scene, name, x, &n);
    for (size_t e = 0; e < n; e += 3) x[e] = 0;
    test_must(ctx, imp_scene_set_values(scene, k, n, x));
}

static void elsewhere(imp_scene *scene, bool empty, struct change c, double headroom,
                      const char *what)
{
    static const char name[] = "cloud.sigma_t.data";
    double square, at_draw, moved;
    if (empty) empty_some(scene, name);
    imp_walks *walks = keep(scene, 128, false, headroom);
    imp_film *before = render(scene, walks, 0, 0);
    imp_film *drawn = render(scene, NULL, 192, 23);
    const double worst_before = worst_of(before, drawn, &at_draw);
    change_grid(scene, name, c);
    const struct imp_walks_weight w = weigh(walks);
    tap_ok(worst_before < FAIL_Z && at_draw < 1.6 && !w.refused,
           "%s: at the draw # worst z %.2f, mean square %.2f, ess elsewhere %.3f", what,
           worst_before, at_draw, w.ess);
    imp_film *kept = render(scene, walks, 0, 0);
    imp_film *fresh = render(scene, NULL, 192, 22);
    const double worst = worst_of(kept, fresh, &square);
    worst_of(before, fresh, &moved);
    tap_ok(worst < FAIL_Z && square < 1.6 && moved > 2,
           "%s: elsewhere # worst z %.2f, mean square %.2f, without weights %.1f", what,
           worst, square, moved);
    imp_film_destroy(before);
    imp_film_destroy(drawn);
    imp_film_destroy(kept);
    imp_film_destroy(fresh);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* ---- What they are worth ----------------------------------------------------------- */

static double variance(imp_film *film)
{
    double sum = 0;
    for (int k = 0; k < 16 * 16; k++) sum += pow((double)imp_film_se(film)[k], 2);
    return sum;
}

/* A cloud with holes, by walks that meet many collisions in emptiness: where hardly anything
 * has changed all of them count, and elsewhere as many as the variance says, of recorded walks
 * over that of walks which are drawn there in the same way, or under the same bounds: with
 * the headroom 4/factor. */
static void worth(double factor, double headroom)
{
    static const char name[] = "cloud.sigma_t.data";
    imp_scene *scene = cloud(grey, "nearest", "", IMP_MONO);
    empty_some(scene, name);
    imp_walks *walks = keep(scene, 1024, false, 4);
    change_grid(scene, name, (struct change){1 + 1e-7, 0});
    const struct imp_walks_weight here = weigh(walks);
    change_grid(scene, name, (struct change){factor, 0});
    const struct imp_walks_weight there = weigh(walks);
    imp_walks *new = keep(scene, 1024, false, headroom);
    imp_film *kept = render(scene, walks, 0, 0), *fresh = render(scene, new, 0, 0);
    const double ratio = variance(kept) / variance(fresh);
    tap_ok(here.ess > 1 - 1e-6, "holes, where nothing moved # ess 1 - %.2g",
           1 - here.ess);
    tap_ok(there.ess < 1 - 1e-3 && there.ess * ratio > 0.5 && there.ess * ratio < 2,
           "%g times as dense # ess %.3f, variance %.3f of fresh walks of headroom %.2f",
           factor, there.ess, ratio, headroom);
    imp_film_destroy(kept);
    imp_film_destroy(fresh);
    imp_walks_destroy(walks);
    imp_walks_destroy(new);
    imp_scene_destroy(scene);
}

/* ---- Derivatives ------------------------------------------------------------------- */

static imp_problem *problem_of(imp_scene *scene, const char *active, imp_film *film)
{
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    static float pixels[16 * 16 * 3];
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, active));
    for (int k = 0; k < 16 * 16 * 3; k++) pixels[k] = 0.1f + 0.3f * (float)(k % 7) / 7;
    t.width = t.height = 16;
    t.channels = 3;
    t.pixels = film ? imp_film_mean(film) : pixels;
    if (film) t.noise_se = imp_film_se(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    return p;
}

/* By frozen collisions against probes of fresh walks. */
static void derivatives(const char *vol, struct change c, const char *what)
{
    static const char name[] = "cloud.sigma_t.data";
    imp_scene *scene = cloud(vol, "trilinear", "", IMP_RGB);
    struct imp_estimate f[2];
    double g[2][3 * CELLS], se[2][3 * CELLS], worst = 0, square = 0, size = 0, noise = 0;
    empty_some(scene, name);
    imp_walks *walks = keep(scene, 256, true, 3);
    change_grid(scene, name, c);
    imp_problem *p = problem_of(scene, name, NULL);
    const size_t n = imp_problem_n_variables(p);
    for (int k = 0; k < 2; k++) {
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 256;
        run.seed = 22;
        run.points = IMP_POINTS_INDEPENDENT;
        run.walks = k ? NULL : walks;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &f[k], g[k], se[k]));
    }
    for (size_t e = 0; e < n; e++) {
        const double z = (g[0][e] - g[1][e]) / hypot(se[0][e], se[1][e]);
        worst = fmax(worst, fabs(z));
        square += z * z / (double)n;
        size += g[1][e] * g[1][e];
        noise += se[0][e] * se[0][e];
    }
    tap_ok(
        worst < FAIL_Z && square < 1.6 && noise < 0.1 * size,
        "%s: %zu derivatives # worst z %.2f, mean square %.2f, noise %.3f of them; loss "
        "z %.2f",
        what, n, worst, square, sqrt(noise / size),
        (f[0].value - f[1].value) / hypot(f[0].se, f[1].se));
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* From a file, with the scene's numbers as they are now. */
static void from_file(void)
{
    static const char name[] = "cloud.sigma_t.data";
    imp_scene *scene = cloud(grey, "trilinear", "", IMP_RGB);
    struct imp_estimate f[2];
    double g[2][CELLS], se[CELLS];
    char path[] = "/tmp/importon-XXXXXX";
    imp_walks *read;
    const int fd = mkstemp(path);
    if (fd >= 0) close(fd);
    empty_some(scene, name);
    imp_walks *walks = keep(scene, 16, true, 2);
    test_must(ctx, imp_walks_write(walks, path));
    change_grid(scene, name, (struct change){1.3, 0.1});
    test_must(ctx, imp_walks_read(ctx, scene, path, NULL, &read));
    imp_problem *p = problem_of(scene, name, NULL);
    for (int k = 0; k < 2; k++) {
        struct imp_run run = IMP_RUN_INIT;
        run.points = IMP_POINTS_INDEPENDENT;
        run.walks = k ? read : walks;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &f[k], g[k], se));
    }
    tap_ok(f[0].value == f[1].value && memcmp(g[0], g[1], sizeof g[0]) == 0,
           "from a file: the same loss and derivatives # %g, %g", f[0].value, f[1].value);
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_walks_destroy(read);
    imp_scene_destroy(scene);
    remove(path);
}

/* ---- Searches and refusals --------------------------------------------------------- */

static void search(double headroom)
{
    static const char name[] = "cloud.sigma_t.data";
    imp_scene *scene = cloud(coarse, "trilinear", "", IMP_RGB);
    double truth[8], x[8], worst = 0;
    int kept = 0, of = 0;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    imp_film *film = render(scene, NULL, 1024, 5);
    imp_problem *p = problem_of(scene, name, film);
    imp_problem_get_x(p, truth);
    for (int k = 0; k < 8; k++) x[k] = k == 3 ? 0 : 0.4 * truth[k];
    test_must(ctx, imp_problem_set_x(p, x));
    o.optimizer = IMP_LBFGS;
    o.max_iterations = 40;
    o.headroom = headroom;
    o.intervals = 1;
    run.spp = 64;
    run.seed = 3;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    for (size_t k = 0; k < 8; k++)
        worst = fmax(worst, fabs(r->variables[k].value - truth[k]) / r->variables[k].se);
    if (r->walks) sscanf(r->walks, "%d of %d", &kept, &of);
    tap_ok(worst < FAIL_Z && (headroom > 1 ? 2 * kept > of && of > 0 : kept == 0),
           "headroom %g: a cloud 2.5 times as dense is found # worst z %.2f; %s",
           headroom, worst, r->walks ? r->walks : "");
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

static void refusals(void)
{
    static const char name[] = "cloud.sigma_t.data";
    imp_scene *scene = cloud(grey, "trilinear", "", IMP_RGB);
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    imp_walks *none;
    empty_some(scene, name);
    imp_walks *walks = keep(scene, 16, false, 1.5);
    change_grid(scene, name, (struct change){2, 0});
    struct imp_walks_weight w = weigh(walks);
    tap_ok(w.refused && strstr(w.refused, "above the bound"), "above the headroom # %s",
           w.refused ? w.refused : "");
    imp_walks_destroy(walks);
    walks = keep(scene, 16, false, 0);
    change_grid(scene, name, (struct change){1, 0.1});
    w = weigh(walks);
    tap_ok(w.refused && strstr(w.refused, "was 0"), "without headroom # %s",
           w.refused ? w.refused : "");
    o.headroom = 65;
    tap_ok(imp_walks_keep(scene, NULL, &o, &none) == IMP_E_ARG, "too much of it");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    float value[3 * CELLS];
    ctx = test_context(2);
    clouds_write(1.6f, grey, coloured, value);
    vol_write(coarse, 2, 2, 2, 1, value);
    static const char residual[] = "<string name='transmittance' value='residual'/>";
    if (is_long)
        elsewhere(cloud(grey, "trilinear", "", IMP_MONO), false, (struct change){1.6, 0},
                  2, "a cloud, mono, denser");
    elsewhere(cloud(coloured, "trilinear", "", IMP_RGB), false, (struct change){1.6, 0},
              2, "a coloured cloud, denser");
    if (is_long)
        elsewhere(cloud(grey, "trilinear", "", IMP_RGB), true, (struct change){1, 0.6}, 2,
                  "a cloud whose holes are filled");
    elsewhere(cloud(coloured, "nearest", "", IMP_RGB), true, (struct change){1.3, 0.6}, 2,
              "coloured, holes of cells");
    elsewhere(cloud(grey, "trilinear", residual, IMP_RGB), true,
              (struct change){1.2, 0.6}, 2, "by residuals");
    worth(0.6, 4 / 0.6);
    worth(1.5, 4);
    if (is_long) {
        worth(0.8, 4);
        worth(0.8, 4 / 0.8);
        worth(1.5, 4 / 1.5);
        derivatives(grey, (struct change){1, 0}, "at the draw, with holes");
    }
    derivatives(coloured, (struct change){1.2, 0.1}, "elsewhere, coloured");
    from_file();
    search(4);
    if (is_long) search(0);
    refusals();
    remove(grey);
    remove(coloured);
    remove(coarse);
    imp_context_destroy(ctx);
    return tap_done();
}
