/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrating sphere (docs/estimators.md 16.1): radius r, Lambertian wall of reflectance
 * rho, an emitting cap of area A_e and radiance e, which also reflects. Whatever its
 * place, each point sends every other the same share, so the irradiance is
 *
 *     E = pi e A_e / (4 pi r^2 (1 - rho))
 *
 * everywhere, 1/(1 - rho) times the direct term, and a sensor of area A_s with response 1
 * reads R = A_s E:  dR/drho = R/(1 - rho), d2R/drho2 = 2 R/(1 - rho)^2, dR/de = R/e. The
 * picture shows rho E/pi of the wall, without the cap. The cap is the first texels of the
 * sphere's radiance, so that the others, which are black, get their gradients too. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

enum { RES = 8, ROWS = 8, LIT = 3, SEEN = 3 }; /* the picture sees rows 3 and 4 */
#define RADIUS 1.7
#define E_CAP  3.

static imp_context *ctx;

static imp_scene *sphere(double rho, int depth)
{
    const double in[16] = {0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1}; /* to -x */
    float texel[ROWS] = {E_CAP, E_CAP, E_CAP};
    imp_scene *s;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.mode = IMP_MONO;
    test_must(ctx, imp_scene_create(ctx, &o, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", depth);
    imp_scene_integer(s, "rr_depth", depth < 0 ? 40 : depth);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_float(s, "fov", 40);
    imp_scene_transform(s, "to_world", in);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", RES);
    imp_scene_integer(s, "height", RES);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_float(s, "radius", RADIUS);
    imp_scene_bool(s, "flip_normals", 1);
    imp_scene_begin(s, "bsdf", "diffuse", "wall", NULL);
    imp_scene_float(s, "reflectance", rho);
    imp_scene_end(s);
    imp_scene_begin(s, "emitter", "area", "cap", NULL);
    imp_scene_begin(s, "texture", "bitmap", NULL, "radiance");
    imp_scene_string(s, "filter_type", "nearest");
    imp_scene_image(s, 1, ROWS, 1, texel);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

struct reading {
    struct imp_estimate R, drho, de[ROWS];
};

/* With A_s = 1: R = pi/rho times the mean of the picture. */
static struct reading measure(double rho, int depth, int spp)
{
    imp_scene *s = sphere(rho, depth);
    imp_problem *p = test_problem(ctx, s, "*");
    struct reading r = {0};
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    float ones[RES * RES];
    double g[1 + ROWS], se[1 + ROWS], var = 0;
    const double scale = M_PI / rho;
    run.spp = spp;
    run.seed = 31;
    test_must(ctx, imp_render(s, &run, &film));
    for (int k = 0; k < RES * RES; k++) {
        ones[k] = (float)(1. / (RES * RES));
        r.R.value += scale * imp_film_mean(film)[k] / (RES * RES);
        var += pow(scale * imp_film_se(film)[k] / (RES * RES), 2);
    }
    r.R.se = sqrt(var);
    imp_film_destroy(film);
    test_must(ctx, imp_problem_reverse(p, ones, &run, g, se));
    const size_t i = test_variable(p, s, ctx, "wall.reflectance.value");
    /* d(pi/rho L) = pi/rho (dL - L/rho); errors added, for they are of the same walks. */
    r.drho = (struct imp_estimate){.value = scale * g[i] - r.R.value / rho,
                                   .se = scale * se[i] + r.R.se / rho};
    const size_t k0 = test_variable(p, s, ctx, "cap.radiance.data");
    for (int k = 0; k < ROWS; k++)
        r.de[k] = (struct imp_estimate){.value = scale * g[k0 + (size_t)k],
                                        .se = scale * se[k0 + (size_t)k]};
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    return r;
}

/* agrees: within 4 SE, and SE/|reference| <= `tight`. Ray origins are moved off the
 * surface, a relative 1e-5 (closed_forms.c). */
static void agrees(struct imp_estimate v, double ref, double tight, const char *what,
                   double rho)
{
    const double z = (v.value - ref) / hypot(v.se, 1e-5 * ref);
    tap_ok(fabs(z) <= 4 && v.se <= tight * fabs(ref),
           "rho %g: %s # value %.7g se %.2g ref %.7g z %.2f", rho, what, v.value, v.se,
           ref, z);
}

/* A_e/(4 pi r^2) of rows [from, to). */
static double share(int from, int to)
{
    return .5 * (cos(M_PI * from / ROWS) - cos(M_PI * to / ROWS));
}

int main(int argc, char **argv)
{
    static const struct {
        double rho;
        int depth, spp;
    } row[] = {{.5, -1, 600}, {.9, -1, 160}, {.98, 401, 24}};
    const bool lengthy = argc > 1 && strcmp(argv[1], "long") == 0;
    const double limit = lengthy ? .002 : .006; /* of SE/R */
    const int more = lengthy ? 8 : 1;
    const double direct = M_PI * E_CAP * share(0, LIT);
    ctx = test_context(0);
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        /* Roulette with survival 0.95 has infinite variance at 0.98
         * (docs/estimators.md 9.1): there n = 400 bounces count, and rho^n = 3e-4 is
         * missing, exactly. */
        const double rho = row[k].rho, left = 1 - rho, n = row[k].depth - 1;
        const double cut = n > 0 ? pow(rho, n) : 0, whole = (1 - cut) / left;
        const double slope = (whole - (n > 0 ? n * cut / rho : 0)) / left;
        const struct reading r = measure(rho, row[k].depth, row[k].spp * more);
        agrees(r.R, direct * whole, limit, "R = pi e A_e/(4 pi r^2 (1 - rho))", rho);
        agrees(r.drho, direct * slope, 2.5 * limit, "dR/drho = R/(1 - rho)", rho);
        for (int t = 0; t < ROWS; t++) {
            const double seen = t == SEEN || t == SEEN + 1 ? M_PI / rho / 2 : 0;
            agrees(r.de[t], seen + M_PI * share(t, t + 1) * whole, 8 * limit,
                   t < LIT ? "dR/de of a texel" : "dR/de of a dark texel", rho);
        }
    }
    agrees(measure(.5, 2, 600 * more).R, direct, limit, "the direct term alone", .5);
    /* d2R/drho2 = 2 R/(1 - rho)^2 by a central difference of gradients, whose own error,
     * of order h^2, is known as well. */
    const double h = .1, lo = .5 + h, hi = .5 - h;
    const struct reading up = measure(.5 + h, -1, 400 * more),
                         down = measure(.5 - h, -1, 400 * more);
    agrees((struct imp_estimate){.value = (up.drho.value - down.drho.value) / (2 * h),
                                 .se = hypot(up.drho.se, down.drho.se) / (2 * h)},
           direct * (1 / (hi * hi) - 1 / (lo * lo)) / (2 * h), 4 * limit,
           "second derivative, from gradients", .5);
    imp_context_destroy(ctx);
    return tap_done();
}
