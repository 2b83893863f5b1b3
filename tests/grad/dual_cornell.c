/* SPDX-License-Identifier: Apache-2.0
 *
 * The gradient picture of the left wall's colour in the Cornell box, against forward-mode
 * automatic differentiation: dual numbers run through this test's own evaluation of the
 * same walks, which shares no code with the library's derivatives, nor with its BSDFs.
 * The walk's record supplies positions, cosines, densities and weights; values are made
 * here. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/core/walk.h"

struct dual {
    double v, d;
}; /* v + d epsilon, epsilon^2 = 0 */
static struct dual add(struct dual a, struct dual b)
{
    return (struct dual){a.v + b.v, a.d + b.d};
}
static struct dual mul(struct dual a, struct dual b)
{
    return (struct dual){a.v * b.v, a.d * b.v + a.v * b.d};
}
static struct dual times(struct dual a, double s)
{
    return (struct dual){a.v * s, a.d * s};
}

/* Reflectance of a vertex's wall, read from theta by name; the left wall carries epsilon.
 */
static struct dual reflectance(imp_context *ctx, imp_scene *scene,
                               const struct imp_vertex *v, const char *wanted, int c)
{
    char name[128];
    size_t index;
    double rgb[3];
    if (!*v->bsdf->name) return (struct dual){0, 0};
    snprintf(name, sizeof name, "%s.reflectance.value", v->bsdf->name);
    test_must(ctx, imp_scene_find_param(scene, name, &index));
    test_must(ctx, imp_scene_get_values(scene, index, rgb));
    return (struct dual){rgb[c], strcmp(v->bsdf->name, wanted) == 0};
}

/* L of one channel: sum over the places where light is collected of the product of
 * everything before it, in the order light is lost (not the library's order). */
static struct dual radiance(imp_context *ctx, imp_scene *scene, const struct imp_walk *w,
                            const double *light_rgb, const char *wanted, int c)
{
    struct dual L = {0, 0}, throughput = {1, 0};
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        if (v->d.met.emitter >= 0 && v->d.wo[2] > 0)
            L = add(L, times(throughput, light_rgb[c] * v->d.met.weight));
        if (!v->bsdf) break;
        const struct dual rho = reflectance(ctx, scene, v, wanted, c);
        if (v->d.connection == IMP_CONNECTED && v->d.light.cos_light > 0)
            L = add(L, times(mul(throughput, rho), fmax(0, v->d.light.wi[2]) / M_PI *
                                                       light_rgb[c] * v->d.light.weight));
        throughput =
            times(mul(throughput, rho), fmax(0, v->d.wi[2]) / M_PI * v->scale[0]);
        if (!v->d.goes_on) break;
    }
    return L;
}

int main(void)
{
    enum { RES = 24, SPP = 16 };
    const char *const wall = "red";
    imp_context *ctx = test_context(0);
    imp_scene *scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=24");
    imp_problem *p = test_problem(ctx, scene, "red.reflectance.value");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *films[3], *primal;
    size_t light;
    double light_rgb[3];
    run.spp = SPP;
    run.seed = 11;
    run.points = IMP_POINTS_INDEPENDENT; /* as the test's own walks have them */
    test_must(ctx, imp_problem_jacobian(p, &run, &primal, films));
    test_must(ctx, imp_scene_find_param(scene, "light.radiance.value", &light));
    test_must(ctx, imp_scene_get_values(scene, light, light_rgb));

    uint8_t *chosen = calloc(imp_scene_n_params(scene), 1);
    size_t red;
    struct imp_active active;
    test_must(ctx, imp_scene_find_param(scene, "red.reflectance.value", &red));
    chosen[red] = 1;
    test_must(ctx, imp__active_create(scene, chosen, &active));
    const struct imp_tracer tracer = {.scene = scene,
                                      .integrator = imp__walk_integrator(scene),
                                      .sensor = scene->sensors[0],
                                      .active = &active,
                                      .seed = 11};
    struct imp_arena arena;
    imp__arena_init(&arena, ctx);
    double worst_value = 0, worst_slope = 0, total = 0, cross = 0, largest = 0;
    for (int y = 0; y < RES; y++)
        for (int x = 0; x < RES; x++) {
            struct dual mean[3] = {{0, 0}};
            for (int s = 0; s < SPP; s++) {
                struct imp_walk walk;
                const struct imp_arena_mark mark = imp__arena_mark(&arena);
                imp__walk_trace(&tracer, &arena, x, y, s, &walk);
                for (int c = 0; c < 3; c++)
                    mean[c] = add(mean[c],
                                  times(radiance(ctx, scene, &walk, light_rgb, wall, c),
                                        1.0 / SPP));
                imp__arena_rewind(&arena, mark);
            }
            for (int c = 0; c < 3; c++) {
                const size_t at = (size_t)(y * RES + x) * 3 + (size_t)c;
                const double value = imp_film_mean(primal)[at];
                const double slope = imp_film_mean(films[c])[at];
                worst_value =
                    fmax(worst_value, fabs(value - mean[c].v) / (1e-3 + fabs(mean[c].v)));
                worst_slope =
                    fmax(worst_slope, fabs(slope - mean[c].d) / (1e-3 + fabs(mean[c].d)));
                largest = fmax(largest, fabs(mean[c].d));
                total += mean[c].d;
                for (int other = 0; other < 3; other++)
                    if (other != c)
                        cross =
                            fmax(cross, fabs(imp_film_mean(
                                            films[c])[at - (size_t)c + (size_t)other]));
            }
        }
    tap_ok(worst_value < 2e-7, "radiance equals the test's own # worst %.1e",
           worst_value);
    tap_ok(worst_slope < 2e-7, "d/d left wall equals dual numbers # worst %.1e",
           worst_slope);
    tap_ok(total > 0 && largest > 0, "and is not zero # largest %.3g", largest);
    tap_ok(cross == 0, "a colour moves its own channel only");

    imp__arena_free(&arena);
    imp__active_destroy(ctx, &active);
    free(chosen);
    for (int c = 0; c < 3; c++) imp_film_destroy(films[c]);
    imp_film_destroy(primal);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
