/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks whose value a picture cannot hold: counted by cause with their keys, which are
 * the same for any number of threads and which imp_walk_describe can show. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/kinds.h>
#include <math.h>

static const char *const sky =
    "<scene version='3.0.0'><integrator type='path'/>"
    "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='12'/>"
    "<integer name='height' value='10'/><rfilter type='box'/></film></sensor>"
    "<shape type='sphere'><point name='center' x='0' y='0' z='4'/>"
    "<bsdf type='diffuse'/></shape>"
    "<emitter type='constant'><float name='radiance' value='%s'/></emitter></scene>";

static imp_scene *scene(imp_context *ctx, const char *radiance)
{
    char xml[1024];
    snprintf(xml, sizeof xml, sky, radiance);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void refused(const char *radiance)
{
    imp_context *ctx = test_context(2);
    imp_scene *s = scene(ctx, radiance);
    imp_film *film = NULL;
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    static float pixels[12 * 10 * 3];
    struct imp_estimate f;
    double g[16];
    run.spp = 8;
    run.seed = 3;
    enum imp_status st = imp_render(s, &run, &film);
    const char *message = imp_last_error(ctx);
    tap_ok(st == IMP_E_PATHS && !film && strstr(message, "more than a float holds") &&
               strstr(message, "--pixel ") && strstr(message, "--sample "),
           "radiance %s: no picture # %s", radiance, message);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    target.width = 12, target.height = 10, target.channels = 3, target.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &target));
    st = imp_problem_objective(p, NULL, &run, &f, g, NULL);
    tap_ok(st == IMP_E_PATHS, "nor a gradient # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* All may be dropped: what is known of them. The film's rows are copied. */
struct counts {
    struct imp_film_info info;
    struct imp_drop_key keys[IMP_DROP_KEYS];
};
static struct counts counted(int threads)
{
    struct counts out = {.info = {.size = sizeof out.info}};
    imp_context *ctx = test_context(threads);
    imp_scene *s = scene(ctx, "1e200");
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    run.spp = 8;
    run.drop_budget = 1;
    test_must(ctx, imp_render(s, &run, &film));
    imp_film_get_info(film, &info);
    float largest = 0;
    for (int k = 0; k < 12 * 10 * 3; k++)
        largest = fmaxf(largest, imp_film_mean(film)[k]);
    tap_ok(info.dropped > 0 && largest == 0,
           "%d threads: dropped walks count as 0 # %llu", threads,
           (unsigned long long)info.dropped);
    char *text = NULL;
    const struct imp_drop_key *key = &info.drop_keys[0];
    run.seed = key->seed;
    test_must(ctx, imp_walk_describe(s, &run, key->x, key->y, key->sample, 0, &text));
    tap_ok(strstr(text, "dropped: the value is infinite, or more than a float holds") !=
               NULL,
           "its first key is that walk");
    imp_free(ctx, text);
    for (int k = 0; k < info.n_drop_keys; k++)
        out.keys[k] = *IMP_ROW(imp_drop_key, info.drop_keys, k);
    info.drop_keys = NULL;
    out.info = info;
    imp_film_destroy(film);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return out;
}

/* Catmull-Rom's spline, of a host: the built-in filters have no negative lobes. */
static enum imp_status lobes_build(const struct imp_build *b, void *self,
                                   struct imp_filter *f)
{
    (void)b, (void)self;
    f->radius = 2;
    return IMP_OK;
}
static double lobes_eval(const struct imp_filter *f, double x)
{
    (void)f;
    x = fabs(x);
    return x < 1 ? 1 + x * x * (1.5 * x - 2.5) : 2 + x * (-4 + x * (2.5 - 0.5 * x));
}
static const struct imp_filter_ops lobes = {.size = sizeof lobes,
                                            .name = "lobes",
                                            .object_size = 1,
                                            .build = lobes_build,
                                            .eval = lobes_eval};

/* Values that a float holds, and a pixel between them that it does not: weights of both
 * signs can add up to next to nothing. */
static void not_finite(void)
{
    static const char edge[] =
        "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective'>"
        "<film type='hdrfilm'><integer name='width' value='48'/>"
        "<integer name='height' value='48'/><rfilter type='lobes'/></film></sensor>"
        "<shape type='sphere'><point name='center' x='0' y='0' z='4'/>"
        "<emitter type='area'><float name='radiance' value='3e38'/></emitter></shape>"
        "</scene>";
    imp_context *ctx = test_context(2);
    test_must(ctx, imp_register_filter(ctx, &lobes));
    imp_scene *s = test_scene_text(ctx, edge, IMP_RGB);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = 1;
    const enum imp_status st = imp_render(s, &run, &film);
    tap_ok(st == IMP_E_NUMERIC && !film &&
               strstr(imp_last_error(ctx), "of the picture is not finite in channel R"),
           "a pixel beyond float is an error # %s", imp_last_error(ctx));
    imp_film_destroy(film);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* Walks of the border, which lie outside the picture, are described as their keys say. */
static void border(void)
{
    static const char wide[] =
        "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
        "<film type='hdrfilm'><integer name='width' value='12'/>"
        "<integer name='height' value='10'/><boolean name='sample_border' value='%s'/>"
        "<rfilter type='gaussian'/></film></sensor>"
        "<emitter type='constant'><float name='radiance' value='1e200'/></emitter>"
        "</scene>";
    imp_context *ctx = test_context(2);
    for (int sampled = 0; sampled < 2; sampled++) {
        char xml[1024], *text = NULL;
        snprintf(xml, sizeof xml, wide, sampled ? "true" : "false");
        imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
        imp_film *film = NULL;
        struct imp_run run = IMP_RUN_INIT;
        struct imp_film_info info = {.size = sizeof info};
        run.spp = 2;
        run.drop_budget = 1;
        test_must(ctx, imp_render(s, &run, &film));
        imp_film_get_info(film, &info);
        int outside = 0, told = 0;
        for (int k = 0; k < info.n_drop_keys; k++) {
            const struct imp_drop_key *key = &info.drop_keys[k];
            run.seed = key->seed;
            outside += key->x < 0 || key->y < 0;
            const enum imp_status st =
                imp_walk_describe(s, &run, key->x, key->y, key->sample, 0, &text);
            told += st == IMP_OK && strstr(text, "dropped: ");
            if (st == IMP_OK) imp_free(ctx, text);
        }
        tap_ok(told == IMP_DROP_KEYS && (outside > 0) == sampled,
               "sample_border %d: each key is described # %d of %d, %d in the border",
               sampled, told, IMP_DROP_KEYS, outside);
        tap_ok(imp_walk_describe(s, &run, sampled ? -3 : -1, 0, 0, 0, &text) == IMP_E_ARG,
               "and nothing further out # %s", imp_last_error(ctx));
        imp_film_destroy(film);
        imp_scene_destroy(s);
    }
    imp_context_destroy(ctx);
}

int main(void)
{
    not_finite();
    border();
    refused("1e200");
    refused("1e308");
    refused("4e38");
    const struct counts one = counted(1);
    tap_ok(one.info.dropped_by_cause[IMP_DROP_INFINITE] == one.info.dropped &&
               one.info.n_drop_keys == IMP_DROP_KEYS,
           "the cause is known, and the first keys are");
    for (int threads = 2; threads <= 5; threads += 3) {
        const struct counts more = counted(threads);
        tap_ok(memcmp(&one, &more, sizeof one) == 0, "%d threads: the same", threads);
    }
    imp_context *ctx = test_context(1);
    imp_scene *s = scene(ctx, "1e38");
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 8;
    test_must(ctx, imp_render(s, &run, &film));
    tap_near(imp_film_mean(film)[0], 1e38, 1e-6 * 1e38, 0, "1e38 is a float");
    imp_film_destroy(film);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
