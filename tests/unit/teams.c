/* SPDX-License-Identifier: Apache-2.0
 *
 * Teams: pictures, losses, gradients, Jacobians, means and fits have the bits of one
 * process, for any number of ranks and threads; a rank that differs is found by all. */
#include "base/compiler.h"
#include "base/team.h"
#include "math/hash.h"
#include "parts_kit.h"
#include "team_kit.h"
#include <math.h>

/* ---- Teams --------------------------------------------------------------------------- */

struct member {
    struct team_rank rank;
    const char *filter;
    enum job job;
    int threads, fails;
    double red;
    enum imp_status st;
    char error[400];
    struct result r;
    double fraction; /* the last that was reported before the end */
    int here;        /* ranks on its machine */
};

static int stop_now(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return 1;
}

static int fraction_note(const struct imp_progress *p, void *payload)
{
    double *last = payload;
    if (p->fraction < 1) *last = imp_max(*last, p->fraction);
    return 0;
}

/* A picture of many tiles: a ball under a sky, one sample a pixel. */
#define SIDE 400
static enum imp_status large_run(imp_context *ctx, struct result *r)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *s;
    imp_film *film;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 2);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world",
                        (double[16]){-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1});
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", SIDE);
    imp_scene_integer(s, "height", SIDE);
    imp_scene_begin(s, "rfilter", "gaussian", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "emitter", "constant", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    run.spp = 1;
    const enum imp_status st = imp_render(s, &run, &film);
    if (st == IMP_OK) {
        const uint64_t hash =
            imp__hash(0, imp_film_mean(film), sizeof(float[SIDE * SIDE * 3]));
        memcpy(r->objective, &hash, sizeof hash);
        imp_film_destroy(film);
    }
    imp_scene_destroy(s);
    return st;
}

/* The optimisers of two ranks have come to different parameters: `member_main` with
 * fails 3. */
static enum imp_status diverge(imp_context *ctx, imp_scene *s, int rank)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p = problem_make(ctx, s, "ball.*");
    double g[3], x[3] = {.5, .2, .1};
    test_must(ctx, imp_problem_objective(p, x, &run, NULL, g, NULL));
    x[1] = rank == 1 ? nextafter(.3, 1) : .3;
    const enum imp_status st = imp_problem_objective(p, x, &run, NULL, g, NULL);
    imp_problem_destroy(p);
    return st;
}

static void *member_main(void *payload)
{
    struct member *m = payload;
    imp_context *ctx = test_context(m->threads);
    imp_scene *s = scene_make(ctx, m->filter, m->red);
    m->st = team_join(ctx, &m->rank);
    m->here = imp__team_here(ctx);
    if (m->st == IMP_OK && m->fails == 4) {
        m->st = large_run(ctx, &m->r);
    } else if (m->st == IMP_OK && m->fails == 3) {
        m->st = diverge(ctx, s, m->rank.rank);
    } else if (m->st == IMP_OK && m->fails) { /* a user stops this rank */
        struct imp_run run = IMP_RUN_INIT;
        imp_problem *p = problem_make(ctx, s, "ball.*");
        double g[3];
        run.progress = m->fails == 1 ? stop_now : fraction_note;
        run.progress_payload = &m->fraction;
        run.spp = 4096;
        m->st = imp_problem_objective(p, NULL, &run, NULL, g, NULL);
        imp_problem_destroy(p);
    } else if (m->st == IMP_OK) {
        m->st = job_run(ctx, s, m->job, 5, &m->r);
    }
    snprintf(m->error, sizeof m->error, "%s", imp_last_error(ctx));
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return NULL;
}

static struct member members[TEAM_MAX];

static const char *(*tamper)(const void *message, size_t bytes);
static int slow, taken[TEAM_MAX];
static size_t most;

static size_t team(int ranks, int shares, const char *filter, enum job job)
{
    struct team_hub hub = {.ranks = ranks,
                           .shares = shares,
                           .sums = ranks != 3,
                           .tamper = tamper,
                           .slow = slow};
    pthread_t thread[TEAM_MAX];
    pthread_barrier_init(&hub.barrier, NULL, (unsigned)ranks);
    for (int k = 0; k < ranks; k++) {
        struct member *m = &members[k];
        m->rank = (struct team_rank){&hub, k};
        m->filter = filter;
        m->job = job;
        m->threads = 1 + k % 2;
        pthread_create(&thread[k], NULL, member_main, m);
    }
    for (int k = 0; k < ranks; k++) pthread_join(thread[k], NULL);
    pthread_barrier_destroy(&hub.barrier);
    for (int k = 0; k < ranks; k++) taken[k] = hub.taken[k];
    most = hub.most;
    return hub.sent;
}

static void members_reset(void)
{
    memset(members, 0, sizeof members);
    for (int k = 0; k < TEAM_MAX; k++) members[k].red = .6;
}

static void teams(const char *filter)
{
    static struct result whole;
    for (enum job job = 0; job <= FIT; job++) {
        int same = 0, want = 0;
        alone(filter, job, &whole);
        for (int ranks = 2; ranks <= TEAM_MAX; ranks = ranks == 3 ? 7 : ranks + 1) {
            members_reset();
            team(ranks, ranks == 3, filter, job);
            for (int k = 0; k < ranks; k++, want++) {
                same += members[k].st == IMP_OK &&
                        !memcmp(&members[k].r, &whole, sizeof whole);
                if (members[k].st != IMP_OK)
                    printf("# rank %d: %s\n", k, members[k].error);
            }
        }
        tap_ok(same == want, "%s, %s%s: 2, 3 and 7 ranks, each has the bits # %d of %d",
               names[job], filter, points == IMP_POINTS_SOBOL ? ", sobol" : "", same,
               want);
    }
}

/* As a rank on a processor with other instructions speaks of itself. */
static const char *other_machine(const void *message, size_t bytes)
{
    static char other[512];
    if (bytes > sizeof other) return message;
    memcpy(other, message, bytes);
    char *word = memmem(other, bytes, "importon ", 9);
    if (word) strcpy(word, "importon 0.2.0 sse4.2 neon");
    return other;
}

/* As a rank under another kernel: the last of what ranks say of themselves. */
static const char *other_kernel(const void *message, size_t bytes)
{
    static char other[512];
    if (bytes > sizeof other || !memmem(message, bytes, "importon ", 9)) return message;
    memcpy(other, message, bytes);
    memset(other + bytes - 40, 'x', 39);
    return other;
}

/* Ranks on one machine share its memory. */
static void team_here(void)
{
    members_reset();
    team(3, 0, "box", PICTURE);
    tap_ok(members[0].here == 3 && members[1].here == 3 && members[2].here == 3,
           "three ranks on a machine");
    members_reset();
    tamper = other_kernel;
    team(3, 0, "box", PICTURE);
    tamper = NULL;
    tap_ok(members[0].here == 2 && members[2].here == 2, "two, and one elsewhere # %d %d",
           members[0].here, members[2].here);
}

static void team_troubles(void)
{
    members_reset();
    tamper = other_machine;
    team(3, 0, "box", PICTURE);
    tamper = NULL;
    tap_ok(members[0].st == IMP_E_ARG && members[2].st == IMP_E_ARG &&
               strstr(members[0].error, "rank 0 runs \"importon 0.2.0") &&
               strstr(members[0].error, "rank 1 \"importon 0.2.0 sse4.2 neon\""),
           "a rank on another processor: both are named # %s", members[0].error);

    members_reset();
    members[1].red = .61;
    team(3, 0, "box", PICTURE);
    tap_ok(members[0].st == IMP_E_ARG && members[2].st == IMP_E_ARG &&
               strstr(members[0].error, "set of parameter values of rank 1 differs"),
           "a rank with another scene is found by all # %s", members[0].error);

    members_reset();
    for (int k = 0; k < 3; k++) members[k].fails = 3;
    team(3, 0, "box", LOSS);
    tap_ok(members[0].st == IMP_E_ARG && members[1].st == IMP_E_ARG &&
               members[2].st == IMP_E_ARG &&
               strstr(members[0].error, "parameters of rank 1 are not those of rank 0") &&
               strstr(members[1].error, "parameters of rank 0 are not those of rank 1"),
           "optimisers that go apart end all ranks, and both are named # %s",
           members[0].error);

    members_reset();
    members[1].fails = 1;
    members[0].fails = members[2].fails = 2;
    team(3, 0, "box", LOSS);
    tap_ok(members[0].st == IMP_CANCELLED && members[1].st == IMP_CANCELLED &&
               members[2].st == IMP_CANCELLED,
           "one rank is stopped: all are # %d %d %d", members[0].st, members[1].st,
           members[2].st);
}

/* Pictures are exchanged in windows: of their sums, a rank holds and sends no more than
 * some megabytes at a time. */
static void large(void)
{
    static struct result whole;
    int same = 0;
    imp_context *ctx = test_context(2);
    test_must(ctx, large_run(ctx, &whole));
    imp_context_destroy(ctx);
    for (int ranks = 2; ranks <= 3; ranks++) {
        members_reset();
        for (int k = 0; k < ranks; k++) members[k].fails = 4;
        team(ranks, ranks == 3, "box", PICTURE);
        for (int k = 0; k < ranks; k++)
            same +=
                members[k].st == IMP_OK && !memcmp(&members[k].r, &whole, sizeof whole);
    }
    tap_ok(same == 5 && most < (size_t)3 << 20,
           "a picture of %d x %d: %d of 5 ranks have the bits, messages take %zu bytes",
           SIDE, SIDE, same, most);
}

/* A rank that is slow computes less, and the others what it leaves. */
static void idle(void)
{
    static struct result whole;
    alone("box", LOSS, &whole);
    members_reset();
    for (int k = 0; k < TEAM_MAX; k++) members[k].fails = 0;
    slow = 1;
    team(2, 0, "box", LOSS);
    slow = 0;
    tap_ok(!memcmp(&members[0].r, &whole, sizeof whole) && taken[1] <= 2 && taken[0] >= 5,
           "idle ranks take what is left: %d and %d of the chunks", taken[0], taken[1]);
}

/* What the later of two ranks reported before its end: more than the half that is its own. */
static double last_told(void)
{
    return imp_max(members[0].fraction, members[1].fraction);
}

/* What a step sends grows with ranks and numbers, not with samples. */
static void traffic(void)
{
    members_reset();
    const size_t few = team(2, 1, "box", LOSS);
    for (int k = 0; k < 2; k++) members[k].fails = 2; /* 4096 samples instead of 18 */
    const size_t many = team(2, 1, "box", LOSS);
    const double shares = last_told();
    team(2, 0, "box", LOSS);
    tap_ok(shares > .5 && last_told() > .5,
           "progress is that of all ranks: %g and %g before the end", shares,
           last_told());
    tap_ok(many < 1.2 * (double)few && few < 16384,
           "bytes of a rank: %zu at 18 samples, %zu at 4096", few, many);
    /* Of a texture, where integers are added on the way: two times its numbers for mean,
     * spread and its second part, however many ranks there are. */
    members_reset();
    const size_t two = team(2, 1, "box", TEXTURE), seven = team(7, 1, "box", TEXTURE);
    tap_ok(two < 1.5 * 2 * 3 * 8 * MANY && seven < 1.1 * (double)two,
           "bytes of a rank for a texture of %d numbers: %zu of 2 ranks, %zu of 7", MANY,
           two, seven);
}

int main(void)
{
    target_set();
    teams("box");
    teams("gaussian");
    points = IMP_POINTS_SOBOL;
    teams("box");
    points = IMP_POINTS_INDEPENDENT;
    team_here();
    team_troubles();
    large();
    idle();
    traffic();
    return tap_done();
}
