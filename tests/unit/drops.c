/* SPDX-License-Identifier: Apache-2.0
 *
 * Dropped walks: the counts and the keys that are kept do not depend on the order in
 * which walks are added or parts are merged. */
#include "base/drops.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

enum { WALKS = 60, PARTS = 5 };

static struct imp_drop_key key_of(int i)
{
    const int k = (i * 37) % WALKS; /* 37 and 60 have no common factor: every k once */
    return (struct imp_drop_key){.seed = 3,
                                 .sample = k / 20,
                                 .x = k % 5,
                                 .y = k / 5 % 4,
                                 .cause = k % 2 ? IMP_DROP_NAN : IMP_DROP_LONG};
}

static bool same(const struct imp_drops *a, const struct imp_drops *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

/* Status of a picture of a sky with this radiance. */
static enum imp_status sky(imp_context *ctx, const char *radiance, float *pixel)
{
    char xml[1024];
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><sensor "
             "type='perspective'><film type='hdrfilm'><integer name='width' value='4'/>"
             "<integer name='height' value='4'/><rfilter type='box'/></film></sensor>"
             "<emitter type='constant'><rgb name='radiance' value='%s'/></emitter>"
             "</scene>",
             radiance);
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    run.spp = 2;
    const enum imp_status st = imp_render(s, &run, &film);
    if (st == IMP_OK) *pixel = imp_film_mean(film)[0];
    imp_film_destroy(film);
    imp_scene_destroy(s);
    return st;
}

/* A box at c, of half a side h, as vertices and triangles n to n + 7 and so on. */
static void box_add(float c, float h, uint32_t n, float *p, uint32_t *triangle)
{
    static const uint32_t side[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                        {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    for (uint32_t k = 0; k < 8; k++)
        for (uint32_t a = 0; a < 3; a++) p[3 * k + a] = c + (k >> (2 - a) & 1 ? h : -h);
    for (uint32_t k = 0; k < 6; k++)
        for (uint32_t a = 0; a < 6; a++) {
            static const uint32_t corner[6] = {0, 1, 2, 0, 2, 3};
            triangle[6 * k + a] = n + side[k][corner[a]];
        }
}

/* Two boxes of one mesh overlap in a corner, as parts of scanned meshes do: where the second
 * begins, the first has not ended, and a walk is dropped. The fog is none (sigma_t 0), the sky
 * is 1: every other walk carries 1, so the mean of the picture is one less their share. */
static void overlap(imp_context *ctx)
{
    float position[48];
    uint32_t triangle[72];
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_scene *s;
    imp_film *film = NULL;
    double mean = 0;
    box_add(0, 1, 0, position, triangle);
    box_add(1.02f, .05f, 8, position + 24, triangle + 36);
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "volpath", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(
        s, "to_world",
        (double[16]){-.7071067811865476, -.408248290463863, -.5773502691896258, 4, 0,
                     .816496580927726, -.5773502691896258, 4, .7071067811865476,
                     -.408248290463863, -.5773502691896258, 4, 0, 0, 0, 1});
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 32);
    imp_scene_integer(s, "height", 32);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "emitter", "constant", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(s, 16, 24, position, NULL, NULL, triangle);
    imp_scene_begin(s, "bsdf", "null", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "medium", "homogeneous", NULL, "interior");
    imp_scene_float(s, "sigma_t", 0);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    run.spp = 64;
    const enum imp_status st = imp_render(s, &run, &film);
    tap_ok(st == IMP_OK, "overlapping parts of a mesh leave a picture # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
    if (st == IMP_OK) {
        test_must(ctx, imp_film_get_info(film, &info));
        for (int k = 0; k < 32 * 32 * 3; k++)
            mean += imp_film_mean(film)[k] / (32 * 32 * 3.);
        const double share = (double)info.dropped / (32 * 32 * 64);
        tap_ok(info.dropped > 2 &&
                   info.dropped == info.dropped_by_cause[IMP_DROP_MEDIUM] && share < 1e-3,
               "some walks are dropped there, and counted # %llu of 65536",
               (unsigned long long)info.dropped);
        tap_ok(fabs(mean - (1 - share)) < 1e-6, "their share is missing # %.8f, %.8f",
               mean, 1 - share);
    }
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

int main(void)
{
    struct imp_drops forward = {0}, backward = {0}, merged = {0}, part[PARTS];
    memset(part, 0, sizeof part);
    for (int i = 0; i < WALKS; i++) {
        const struct imp_drop_key k = key_of(i), l = key_of(WALKS - 1 - i);
        imp__drops_add(&forward, &k);
        imp__drops_add(&backward, &l);
        imp__drops_add(&part[i % PARTS], &k);
    }
    for (int p = PARTS - 1; p >= 0; p--) imp__drops_merge(&merged, &part[p]);
    tap_ok(imp__drops_total(&forward) == WALKS &&
               forward.by_cause[IMP_DROP_NAN] == WALKS / 2 &&
               forward.by_cause[IMP_DROP_LONG] == WALKS / 2,
           "every walk is counted, by cause");
    tap_ok(same(&forward, &backward), "in another order: the same");
    tap_ok(same(&forward, &merged), "in parts: the same");

    bool lowest = forward.n_keys == IMP_DROP_KEYS;
    for (int k = 0; k < forward.n_keys; k++)
        lowest &= forward.keys[k].sample == 0 && forward.keys[k].y == k / 5 &&
                  forward.keys[k].x == k % 5;
    tap_ok(lowest, "the keys are the lowest, by sample, row and column");

    struct imp_drops twice = forward;
    imp__drops_merge(&twice, &forward);
    tap_ok(imp__drops_total(&twice) == 2 * WALKS &&
               memcmp(twice.keys, forward.keys, sizeof twice.keys) == 0,
           "a walk that is dropped twice is counted twice and shown once");

    struct imp_drops none = {0};
    imp__drops_add(&none, &(struct imp_drop_key){.cause = IMP_DROP_NONE});
    imp__drops_add(&none, &(struct imp_drop_key){.cause = IMP_DROP_CAUSES});
    tap_ok(imp__drops_total(&none) == 0 && none.n_keys == 0, "no cause: not counted");

    imp_context *ctx = test_context(1);
    tap_ok(imp__drops_budget(ctx, &forward, 0, 1e6, "") == IMP_OK, "60 of 1e6 are few");
    const enum imp_status st =
        imp__drops_budget(ctx, &forward, 1e-5, 1e6, " --points sobol");
    const char *said = imp_last_error(ctx);
    tap_ok(st == IMP_E_PATHS && strstr(said, "30: the value is not a number") &&
               strstr(said, "--pixel 0,0 --sample 0 --seed 3") &&
               strstr(said, " --points sobol"),
           "too many for the budget # %s", said);
    struct imp_drops holes = {.by_cause = {[IMP_DROP_MEDIUM] = 1000}};
    tap_ok(imp__drops_budget(ctx, &holes, 0, 1e6, "") == IMP_OK &&
               imp__drops_budget(ctx, &holes, 1e-4, 1e6, "") == IMP_E_PATHS,
           "1 of 1000 walks at holes are few, unless the run has a budget");
    holes.by_cause[IMP_DROP_NAN] = 102;
    tap_ok(imp__drops_budget(ctx, &holes, 0, 1e6, "") == IMP_E_PATHS,
           "they make no room for other causes");
    holes = (struct imp_drops){.by_cause = {[IMP_DROP_MEDIUM] = 1002}};
    tap_ok(imp__drops_budget(ctx, &holes, 0, 1e6, "") == IMP_E_PATHS, "more are many");
    float pixel = 0;
    tap_ok(sky(ctx, "1e38", &pixel) == IMP_OK && pixel == 1e38f, "radiance 1e38 # %g",
           (double)pixel);
    tap_ok(sky(ctx, "1e39", &pixel) == IMP_E_PATHS &&
               sky(ctx, "1e200", &pixel) == IMP_E_PATHS,
           "radiance that a float cannot hold is a bad walk # %s", imp_last_error(ctx));
    overlap(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
