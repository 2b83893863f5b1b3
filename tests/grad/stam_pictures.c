/* SPDX-License-Identifier: Apache-2.0
 *
 * Stam's Figures 7 and 8 (docs/estimators.md 2.3, T4): the picture and seven derivative
 * pictures, with cosine draws and with half of the draws from the Phong-Blinn lobe. The
 * sampler changes the noise and nothing else: chi-square over blocks of pixels, and the
 * ratios of noise. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/stat.h"

enum { RES = 32, BLOCK = 8, N = RES / BLOCK, N_CONTROLS = 7 };

/* Block means of the picture (first) and the derivatives, and their variances. */
struct pictures {
    double mean[1 + N_CONTROLS][N * N], var[1 + N_CONTROLS][N * N];
};

static void blocks(imp_film *film, double *mean, double *var)
{
    const float *m = imp_film_mean(film), *se = imp_film_se(film);
    const double area = BLOCK * BLOCK;
    for (int y = 0; y < RES; y++)
        for (int x = 0; x < RES; x++) {
            const int b = y / BLOCK * N + x / BLOCK, i = y * RES + x;
            mean[b] += m[i] / area;
            var[b] += (double)se[i] * se[i] / (area * area);
        }
    imp_film_destroy(film);
}

static struct pictures pictures(imp_context *ctx, const char *defines, int spp,
                                uint64_t seed, char name[][64])
{
    struct pictures p;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *primal, *films[N_CONTROLS];
    imp_scene *scene = test_scene(ctx, "stam.xml", IMP_MONO, defines);
    imp_problem *problem = test_problem(ctx, scene, "*");
    memset(&p, 0, sizeof p);
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_problem_jacobian(problem, &run, &primal, films));
    blocks(primal, p.mean[0], p.var[0]);
    snprintf(name[0], 64, "picture");
    for (int k = 0; k < N_CONTROLS; k++) {
        struct imp_param_info info = {.size = sizeof info};
        const size_t param = test_param_of(ctx, problem, (size_t)k);
        test_must(ctx, imp_scene_get_param(scene, param, &info));
        snprintf(name[k + 1], 64, "%s", info.name);
        blocks(films[k], p.mean[k + 1], p.var[k + 1]);
    }
    imp_problem_destroy(problem);
    imp_scene_destroy(scene);
    return p;
}

static void compare(imp_context *ctx, const char *variant, int spp)
{
    char a[64], b[64], name[1 + N_CONTROLS][64];
    snprintf(a, sizeof a, "variant=%s sampling=cosine", variant);
    snprintf(b, sizeof b, "variant=%s sampling=mixture", variant);
    const struct pictures cosine = pictures(ctx, a, 2 * spp, 71, name);
    const struct pictures mixture = pictures(ctx, b, spp, 81, name);
    for (int k = 0; k <= N_CONTROLS; k++) {
        double chi2 = 0, vc = 0, vm = 0;
        int dof = 0;
        for (int i = 0; i < N * N; i++) {
            const double v = cosine.var[k][i] + mixture.var[k][i];
            vc += 2 * cosine.var[k][i];
            vm += mixture.var[k][i];
            if (!(v > 0)) continue;
            const double d = cosine.mean[k][i] - mixture.mean[k][i];
            chi2 += d * d / v;
            dof++;
        }
        const double p = imp__chi2_tail(chi2, dof), ratio = sqrt(vc / vm);
        tap_ok(p > 1e-4 && p < 1 - 1e-4,
               "%s: %s, cosine and mixture # chi2 %.1f of %d, p %.3f", variant, name[k],
               chi2, dof, p);
        /* At equal walks: what the lobe is for, and what it must not spoil. */
        const int specular = strstr(name[k], "specular") || strstr(name[k], "exponent");
        tap_ok(specular ? ratio > 2 && ratio < 20 : ratio > .7 && ratio < 10,
               "%s: %s, noise # cosine / mixture %.2f", variant, name[k], ratio);
    }
}

int main(void)
{
    imp_context *ctx = test_context(0);
    compare(ctx, "microfacet", 1024);
    compare(ctx, "reciprocal", 512);
    imp_context_destroy(ctx);
    return tap_done();
}
