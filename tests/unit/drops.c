/* SPDX-License-Identifier: Apache-2.0
 *
 * Dropped walks: the counts and the keys that are kept do not depend on the order in
 * which walks are added or parts are merged. */
#include "base/drops.h"
#include "imp_scene.h"
#include "imp_tap.h"

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
    float pixel = 0;
    tap_ok(sky(ctx, "1e38", &pixel) == IMP_OK && pixel == 1e38f, "radiance 1e38 # %g",
           (double)pixel);
    tap_ok(sky(ctx, "1e39", &pixel) == IMP_E_PATHS &&
               sky(ctx, "1e200", &pixel) == IMP_E_PATHS,
           "radiance that a float cannot hold is a bad walk # %s", imp_last_error(ctx));
    imp_context_destroy(ctx);
    return tap_done();
}
