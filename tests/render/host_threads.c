/* SPDX-License-Identifier: Apache-2.0
 *
 * Host threads that share a context and a scene: each renders, differentiates, fails and
 * reads its own error message; results are the bits of one thread alone. Run under the
 * thread sanitizer by ./test. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <pthread.h>

enum { HOSTS = 3, N_MAX = 64, VALUES = 24 * 24 * 3 };

static imp_context *ctx;
static imp_scene *shared;

struct host {
    int id, own_scene;
    enum imp_status st;
    float picture[VALUES];
    double gradient[2 * N_MAX + 1];
    char message[256];
};

static enum imp_status work(struct host *h)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene = shared;
    imp_film *film = NULL;
    imp_problem *p = NULL;
    struct imp_estimate J = {0};
    run.spp = 8;
    run.seed = 11;
    if (h->own_scene) scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=24");
    enum imp_status st = imp_render(scene, &run, &film);
    if (st == IMP_OK) memcpy(h->picture, imp_film_mean(film), sizeof h->picture);
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = 24;
    t.channels = 3;
    t.pixels = h->picture;
    if (st == IMP_OK) st = imp_problem_create(scene, &p);
    if (st == IMP_OK) st = imp_problem_activate(p, "*");
    if (st == IMP_OK) st = imp_problem_add_target(p, &t);
    run.seed = 12;
    if (st == IMP_OK && imp_problem_n_variables(p) > N_MAX) st = IMP_E_ARG;
    if (st == IMP_OK)
        st = imp_problem_objective(p, NULL, &run, &J, h->gradient, h->gradient + N_MAX);
    h->gradient[2 * N_MAX] = J.value;
    if (st == IMP_OK) { /* everybody has an error of his own */
        char name[32];
        snprintf(name, sizeof name, "nobody%d", h->id);
        if (imp_problem_activate(p, name) == IMP_OK) st = IMP_E_ARG;
        snprintf(h->message, sizeof h->message, "%s", imp_last_error(ctx));
        if (!strstr(h->message, name)) st = IMP_E_NUMERIC;
    }
    imp_problem_destroy(p);
    imp_film_destroy(film);
    if (h->own_scene) imp_scene_destroy(scene);
    return st;
}

static void *run_host(void *payload)
{
    struct host *h = payload;
    h->st = work(h);
    return NULL;
}

int main(void)
{
    static struct host alone, host[HOSTS];
    for (int threads = 1; threads <= 2; threads++) {
        pthread_t thread[HOSTS];
        ctx = test_context(threads);
        shared = test_scene(ctx, "cornell.xml", IMP_RGB, "res=24");
        memset(&alone, 0, sizeof alone);
        run_host(&alone);
        tap_ok(alone.st == IMP_OK, "alone # %s", alone.message);
        for (int i = 0; i < HOSTS; i++) {
            memset(&host[i], 0, sizeof host[i]);
            host[i].id = i;
            host[i].own_scene = i == 2; /* two share one, the third loads meanwhile */
            if (pthread_create(&thread[i], NULL, run_host, &host[i]) != 0) return 99;
        }
        for (int i = 0; i < HOSTS; i++) {
            pthread_join(thread[i], NULL);
            tap_ok(host[i].st == IMP_OK &&
                       !memcmp(host[i].picture, alone.picture, sizeof alone.picture) &&
                       !memcmp(host[i].gradient, alone.gradient, sizeof alone.gradient),
                   "host %d of %d, pool of %d, %s scene: the same bits # %s", i, HOSTS,
                   threads, host[i].own_scene ? "own" : "shared", host[i].message);
        }
        imp_scene_destroy(shared);
        imp_context_destroy(ctx);
    }
    return tap_done();
}
