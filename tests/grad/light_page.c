/* SPDX-License-Identifier: Apache-2.0
 *
 * Section 5 of docs/walk-and-sweep.md: one walk from the lamp of the Cornell box, vertex by
 * vertex. The rows of its tables are made here and must be in the page; their sums are what
 * the library's sweep gives.
 *
 *     light_page PAGE             the test
 *     light_page PAGE SEED WALK   the rows of another walk, to look at */
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include "walk/lights/light_walk.h"
#include <math.h>

#define SEED     41
#define VERTICES 16

static char page[65536], flat[65536]; /* flat: with blanks for line breaks */

struct sum {
    struct imp_sink sink; /* first: the sweep gets a pointer to it */
    const struct imp_scene *scene;
    double red[64]; /* by parameter: derivative by its first number */
};
static void sum_add(struct imp_sink *sink, int param, size_t element, int channels,
                    const imp_spec *bar)
{
    struct sum *s = (struct sum *)sink;
    (void)channels;
    if (element == 0) s->red[param] += (*bar)[0];
}

static int param_of(const struct imp_scene *scene, const char *name)
{
    for (size_t i = 0; i < scene->n_params; i++)
        if (strcmp(scene->params[i].info.name, name) == 0) return (int)i;
    printf("Bail out! no parameter %s\n", name);
    exit(99);
}

static const char *id(const char *name) { return name ? name : "?"; }

/* The page has this row. */
static void row(const char *what, int k, const char *text)
{
    tap_ok(strstr(page, text) != NULL || strstr(flat, text) != NULL,
           "%s, vertex %d # %.*s", what, k, (int)strcspn(text, "\n"), text);
}

int main(int argc, char **argv)
{
    imp_context *ctx = test_context(1);
    imp_scene *scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=1");
    FILE *f = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (!f) {
        printf("Bail out! no page\n");
        return 99;
    }
    page[fread(page, 1, sizeof page - 1, f)] = 0;
    fclose(f);
    for (size_t i = 0; page[i]; i++) flat[i] = page[i] == '\n' ? ' ' : page[i];

    uint8_t chosen[64] = {0};
    struct imp_active active;
    struct imp_arena arena;
    struct imp_light_walk w;
    for (size_t i = 0; i < scene->n_params && i < 64; i++)
        chosen[i] = scene->params[i].info.flags & IMP_PARAM_DIFFERENTIABLE;
    test_must(ctx, imp__active_create(scene, chosen, &active));
    const struct imp_tracer tracer = {.scene = scene,
                                      .integrator = imp__walk_integrator(scene),
                                      .sensor = scene->sensors[0],
                                      .active = &active,
                                      .seed =
                                          argc > 2 ? strtoull(argv[2], NULL, 10) : SEED};
    imp__arena_init(&arena, ctx);
    imp__light_walk_trace(&tracer, &arena, argc > 3 ? atoi(argv[3]) : 0, &w);

    /* Fold: L_k = E_k + B_k + w_k L_{k+1}, red. */
    const struct imp_vertex *v[VERTICES];
    double L[VERTICES + 1] = {0}, P = 1, reached = 0;
    int n = 0;
    for (const struct imp_vertex *at = w.walk.first; at && n < VERTICES; at = at->next)
        v[n++] = at;
    L[n] = 0;
    for (int k = n - 1; k >= 0; k--)
        L[k] = v[k]->e[0] + v[k]->b[0] + (k < n - 1 ? v[k]->w[0] : 0) * L[k + 1];
    for (const struct imp_reach *r = w.reach; r; r = r->next) reached += r->values[0];
    tap_ok(n > 3 && fabs(L[0] - reached) < 1e-14 * fabs(reached),
           "the fold of %d vertices is what reaches the film # %.6g %.6g", n, L[0],
           reached);

    /* Sweep: first to last. */
    const int lamp = param_of(scene, "light.radiance.value");
    const double Le = imp__param_get(&scene->params[lamp], 0);
    struct sum mine = {.scene = scene};
    for (int k = 0; k < n; k++) {
        const double step = k < n - 1 ? v[k]->w[0] : 0, on = v[k]->b[0] + step * L[k + 1];
        char text[256], name[96];
        if (k == 0) {
            snprintf(text, sizeof text,
                     "| 0 | light_panel | %.6g | %.6g | 1 | %.6g | |\n", v[k]->b[0], step,
                     L[0]);
        } else {
            snprintf(name, sizeof name, "%s.reflectance.value", id(v[k]->bsdf->name));
            const int p = param_of(scene, name);
            const double piece = P * on / imp__param_get(&scene->params[p], 0);
            mine.red[p] += piece;
            snprintf(text, sizeof text,
                     "| %d | %s (%s) | %.6g | %.6g | %.6g | %.6g | %.6g |\n", k,
                     id(v[k]->shape->name), id(v[k]->bsdf->name), v[k]->b[0], step, P,
                     L[k], piece);
        }
        if (argc > 2) printf("%s", text);
        else row("light", k, text);
        if (k > 0) snprintf(text, sizeof text, "P_%d B_%d = %.6g", k, k, P * v[k]->b[0]);
        if (k > 0 && argc <= 2) row("film", k, text);
        P *= step;
    }
    mine.red[lamp] = L[0] / Le;
    char text[64];
    snprintf(text, sizeof text, "L_0/Le = %.6g", L[0] / Le);
    if (argc <= 2) row("lamp", 0, text);
    tap_ok(fabs(v[0]->w[0] / (IMP_PI * 130 * 105 * Le) - 1) < 1e-6,
           "the ray carries pi A Le # %.9g", v[0]->w[0]);

    /* The library's sweep, with an adjoint of 1 for red. */
    imp_spec adjoint[VERTICES];
    for (int k = 0; k < VERTICES; k++) adjoint[k] = (imp_spec){1, 0, 0, 0};
    struct sum its = {.sink = {.add = sum_add}, .scene = scene};
    double worst = 0;
    if (w.n_reach > VERTICES ||
        !imp__light_walk_sweep(&tracer, &arena, &w, adjoint, 1, &its.sink))
        tap_ok(false, "the walk is swept");
    for (size_t i = 0; i < scene->n_params && i < 64; i++)
        worst = fmax(worst, fabs(its.red[i] - mine.red[i]) / (fabs(mine.red[i]) + 1e-12));
    tap_ok(worst < 1e-12, "pieces add up to the library's sweep # %.1e", worst);

    imp__arena_free(&arena);
    imp__active_destroy(ctx, &active);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
