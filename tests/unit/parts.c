/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts and teams: pictures, losses, gradients, Jacobians and fits have the bits of one
 * run, for any cut and any number of ranks and threads; what does not belong together is
 * refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "team_kit.h"
#include <unistd.h>

enum { WIDTH = 20, HEIGHT = 14, PIXELS = WIDTH * HEIGHT * 3, TEXELS = 20, SPP = 18 };
enum { MANY = TEXELS * TEXELS * 3 + 64 }; /* more than 1,024: summed in fixed point */

enum job { PICTURE, LOSS, TEXTURE, REVERSE, JACOBIAN, MEAN, JOBS, FIT = JOBS };
static const char *const names[] = {"picture",
                                    "loss and gradient",
                                    "gradient of a texture",
                                    "adjoint image",
                                    "Jacobian and its table",
                                    "mean of a picture",
                                    "fit"};

/* All that is compared, bit by bit. */
struct result {
    float mean[PIXELS], se[PIXELS];
    double objective[2], gradient[MANY], gradient_se[MANY];
};

static float target[PIXELS];

static void rgb(imp_scene *s, const char *name, double r, double g, double b)
{
    imp_scene_rgb(s, name, (double[3]){r, g, b});
}

/* A wall with a texture, and a red ball, under a lamp. */
static imp_scene *scene_make(imp_context *ctx, const char *filter, double red)
{
    static float pixels[TEXELS * TEXELS * 3];
    imp_scene *s;
    for (int k = 0; k < TEXELS * TEXELS * 3; k++)
        pixels[k] = 0.2f + 0.5f * (float)(k % 7) / 7;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_float(s, "fov", 50);
    imp_scene_transform(s, "to_world",
                        (double[16]){-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1});
    imp_scene_begin(s, "sampler", "independent", NULL, NULL);
    imp_scene_integer(s, "sample_count", SPP);
    imp_scene_end(s);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", WIDTH);
    imp_scene_integer(s, "height", HEIGHT);
    imp_scene_begin(s, "rfilter", filter, NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world",
                        (double[16]){2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, -1, 0, 0, 0, 1});
    imp_scene_begin(s, "bsdf", "diffuse", "wall", NULL);
    imp_scene_begin(s, "texture", "bitmap", "paper", "reflectance");
    imp_scene_image(s, TEXELS, TEXELS, 3, pixels);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_float(s, "radius", 0.6);
    imp_scene_begin(s, "bsdf", "diffuse", "ball", NULL);
    rgb(s, "reflectance", red, .2, .1);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_vector(s, "center", (double[3]){1, 2, 2});
    imp_scene_float(s, "radius", 0.4);
    imp_scene_begin(s, "emitter", "area", "lamp", NULL);
    rgb(s, "radiance", 9, 8, 7);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static imp_problem *problem_make(imp_context *ctx, imp_scene *s, const char *active)
{
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    t.width = WIDTH, t.height = HEIGHT, t.channels = 3, t.pixels = target;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, active));
    test_must(ctx, imp_problem_add_target(p, &t));
    return p;
}

static void film_take(imp_film *film, struct result *r)
{
    memcpy(r->mean, imp_film_mean(film), sizeof r->mean);
    memcpy(r->se, imp_film_se(film), sizeof r->se);
    imp_film_destroy(film);
}

static enum imp_status job_run(imp_context *ctx, imp_scene *s, enum job job,
                               uint64_t seed, struct result *r)
{
    struct imp_run run = IMP_RUN_INIT;
    enum imp_status st;
    imp_film *film = NULL, *films[3] = {0};
    struct imp_estimate e = {0, 0, 0};
    run.seed = seed;
    memset(r, 0, sizeof *r);
    if (job == PICTURE) {
        st = imp_render(s, &run, &film);
        if (st == IMP_OK) film_take(film, r);
        return st;
    }
    imp_problem *p = problem_make(ctx, s, job == TEXTURE ? "*" : "ball.*");
    switch (job) {
    case LOSS:
    case TEXTURE:
        st = imp_problem_objective(p, NULL, &run, &e, r->gradient, r->gradient_se);
        r->objective[0] = e.value;
        r->objective[1] = e.se;
        break;
    case REVERSE:
        st = imp_problem_reverse(p, target, &run, r->gradient, r->gradient_se);
        break;
    case JACOBIAN: {
        struct imp_estimate sums[2];
        const int group[3] = {0, 1, 0};
        st = imp_problem_jacobian(p, &run, &film, films);
        if (st != IMP_OK && st != IMP_PART) break;
        /* The walks of a part, for its pictures and their sums. */
        const enum imp_status made = imp_problem_jacobian_sums(
            p, NULL, &run, film, st == IMP_OK ? films : NULL, group, 2, &e, sums);
        if (made != st) tap_ok(0, "sums of a Jacobian # %s", imp_last_error(ctx));
        if (st != IMP_OK) break;
        r->objective[0] = e.value;
        r->objective[1] = e.se;
        for (int k = 0; k < 2; k++) {
            r->gradient[k] = sums[k].value;
            r->gradient_se[k] = sums[k].se;
        }
        film_take(films[2], r);
        imp_film_destroy(films[1]);
        imp_film_destroy(films[0]);
        imp_film_destroy(film);
        break;
    }
    case MEAN:
        st = imp_problem_functional(p, NULL, &run, &e, r->gradient, r->gradient_se);
        r->objective[0] = e.value;
        r->objective[1] = e.se;
        break;
    default: {
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *f;
        o.max_iterations = 4;
        st = imp_fit(p, &o, &run, &f);
        for (int k = 0; k < 3 && st == IMP_OK; k++) {
            r->gradient[k] = f->variables[k].value;
            r->gradient_se[k] = f->variables[k].se;
        }
        if (st == IMP_OK) r->objective[0] = f->objective.value;
    }
    }
    imp_problem_destroy(p);
    return st;
}

static void alone(const char *filter, enum job job, struct result *r)
{
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_make(ctx, filter, .6);
    test_must(ctx, job_run(ctx, s, job, 5, r));
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* ---- Parts --------------------------------------------------------------------------- */

static char folder[64];
static const char *part_path(char path[96], int i, int n)
{
    snprintf(path, 96, "%s/%d-%d.part", folder, i, n);
    return path;
}

static void part_make(const char *filter, enum job job, int i, int n, int threads)
{
    char path[96];
    struct result none;
    imp_parts *part;
    imp_context *ctx = test_context(threads);
    imp_scene *s = scene_make(ctx, filter, .6);
    test_must(ctx, imp_parts_create(ctx, i, n, "a test", &part));
    test_must(ctx, imp_context_set_parts(ctx, part));
    const enum imp_status st = job_run(ctx, s, job, 5, &none);
    if (st != IMP_PART) tap_ok(0, "a part ends with IMP_PART # %s", imp_last_error(ctx));
    test_must(ctx, imp_parts_write(part, part_path(path, i, n)));
    imp_parts_destroy(part);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* Of the parts [n] named i/k; NULL: what the merge said is in `error`. */
static enum imp_status merge(const char *filter, enum job job, const int (*which)[2],
                             int n, double red, uint64_t seed, struct result *r,
                             char error[400])
{
    char path[8][96];
    const char *paths[8];
    imp_parts *parts = NULL;
    imp_context *ctx = test_context(2);
    imp_scene *s = scene_make(ctx, filter, red);
    for (int k = 0; k < n; k++) paths[k] = part_path(path[k], which[k][0], which[k][1]);
    enum imp_status st = imp_parts_read(ctx, paths, (size_t)n, &parts);
    if (st == IMP_OK) st = imp_context_set_parts(ctx, parts);
    if (st == IMP_OK) st = job_run(ctx, s, job, seed, r);
    snprintf(error, 400, "%s", imp_last_error(ctx));
    imp_parts_destroy(parts);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return st;
}

static void cuts(const char *filter)
{
    static struct result whole, merged;
    static const int halves[][2] = {{2, 2}, {1, 2}},
                     mixed[][2] = {{4, 4}, {1, 2}, {3, 4}},
                     sevenths[][2] = {{1, 7}, {2, 7}, {3, 7}, {4, 7},
                                      {5, 7}, {6, 7}, {7, 7}};
    static const struct {
        const int (*which)[2];
        int n;
    } cut[] = {{halves, 2}, {mixed, 3}, {sevenths, 7}};
    for (enum job job = 0; job < JOBS; job++) {
        int same = 0;
        char error[400] = "";
        alone(filter, job, &whole);
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < cut[c].n; k++)
                part_make(filter, job, cut[c].which[k][0], cut[c].which[k][1], 1 + k % 2);
            same += merge(filter, job, cut[c].which, cut[c].n, .6, 5, &merged, error) ==
                        IMP_OK &&
                    !memcmp(&merged, &whole, sizeof whole);
        }
        tap_ok(same == 3, "%s, %s: parts of three cuts merge to the bit # %d %s",
               names[job], filter, same, error);
    }
}

static void refusals(void)
{
    static const int all[][2] = {{1, 4}, {2, 4}, {3, 4}, {4, 4}},
                     twice[][2] = {{1, 2}, {1, 2}}, over[][2] = {{1, 2}, {2, 4}, {2, 2}};
    static struct result r;
    char error[400], path[96], other[96];
    for (int i = 1; i <= 4; i++) part_make("box", PICTURE, i, 4, 1);
    for (int i = 1; i <= 2; i++) part_make("box", PICTURE, i, 2, 1);

    const struct {
        const int (*which)[2];
        int n;
        enum job job;
        double red;
        uint64_t seed;
        const char *says;
    } bad[] = {{all, 3, PICTURE, .6, 5, "missing: 4/4"},
               {all + 3, 1, PICTURE, .6, 5, "missing: 1/4 to 3/4"},
               {twice, 2, PICTURE, .6, 5, "part 1 of 2 is there twice"},
               {over, 3, PICTURE, .6, 5, "overlap"},
               {all, 4, PICTURE, .61, 5, "part 1 of 4 was made with another set of"},
               {all, 4, PICTURE, .6, 6, "made with another seed or number of samples"},
               {all, 4, LOSS, .6, 5, "part 1 of 4 was made with another call"}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const enum imp_status st = merge("box", bad[k].job, bad[k].which, bad[k].n,
                                         bad[k].red, bad[k].seed, &r, error);
        tap_ok(st == IMP_E_ARG && strstr(error, bad[k].says), "refused: %s # %s",
               bad[k].says, error);
    }

    /* Every byte of a file counts. */
    FILE *f = fopen(part_path(path, 2, 2), "rb+");
    int found = 0, tried = 0;
    fseek(f, 0, SEEK_END);
    const long size = ftell(f);
    for (long at = 0; at < size; at += size / 23 + 1, tried++) {
        fseek(f, at, SEEK_SET);
        const int byte = fgetc(f);
        fseek(f, at, SEEK_SET);
        fputc(byte ^ 0x10, f);
        fflush(f);
        const enum imp_status st =
            merge("box", PICTURE, (const int[][2]){{1, 2}, {2, 2}}, 2, .6, 5, &r, error);
        found += st == IMP_E_SCENE || st == IMP_E_ARG;
        fseek(f, at, SEEK_SET);
        fputc(byte, f);
        fflush(f);
    }
    fclose(f);
    tap_ok(found == tried, "one changed byte is found, wherever # %d of %d", found,
           tried);
    snprintf(other, sizeof other, "%s/other", folder);
    tap_ok(truncate(path, size / 2) == 0 &&
               merge("box", PICTURE, (const int[][2]){{1, 2}, {2, 2}}, 2, .6, 5, &r,
                     error) == IMP_E_SCENE,
           "half a file is refused # %s", error);
}

/* What needs results of what was before is not cut. */
static void no_parts(void)
{
    static struct result r;
    imp_parts *part;
    imp_context *ctx = test_context(1);
    imp_scene *s = scene_make(ctx, "box", .6);
    test_must(ctx, imp_parts_create(ctx, 1, 2, "a test", &part));
    test_must(ctx, imp_context_set_parts(ctx, part));
    tap_ok(job_run(ctx, s, FIT, 5, &r) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "a fit cannot be made in parts"),
           "a fit in parts is refused # %s", imp_last_error(ctx));
    test_must(ctx, imp_context_set_parts(ctx, NULL));
    tap_ok(job_run(ctx, s, PICTURE, 5, &r) == IMP_OK, "without parts: whole again");
    imp_parts_destroy(part);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* Parts of parts. */
static void larger_parts(void)
{
    static struct result whole, r;

    char path[6][96];
    struct imp_parts_info info = {.size = sizeof info};
    imp_context *ctx = test_context(1);
    imp_parts *parts;
    imp_scene *s = scene_make(ctx, "gaussian", .6);

    alone("gaussian", LOSS, &whole);
    for (int i = 1; i <= 3; i++) part_make("gaussian", LOSS, i, 3, 1);
    const char *first[] = {part_path(path[0], 1, 3), part_path(path[1], 3, 3)};
    test_must(ctx, imp_parts_read(ctx, first, 2, &parts));
    test_must(ctx, imp_parts_get_info(parts, &info));
    tap_ok(info.n == 2 && info.missing == 1 && !strcmp(info.holes, "2/3"),
           "two of three: 2/3 is missing # %s", info.holes);
    test_must(ctx, imp_parts_write(parts, part_path(path[2], 13, 3)));
    imp_parts_destroy(parts);
    const char *both[] = {path[2], part_path(path[3], 2, 3)};
    test_must(ctx, imp_parts_read(ctx, both, 2, &parts));
    test_must(ctx, imp_context_set_parts(ctx, parts));
    test_must(ctx, job_run(ctx, s, LOSS, 5, &r));
    imp_parts_destroy(parts);
    tap_ok(!memcmp(&r, &whole, sizeof r), "a part of two parts, and the third: the bits");
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

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
};

static int stop_now(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return 1;
}

static void *member_main(void *payload)
{
    struct member *m = payload;
    imp_context *ctx = test_context(m->threads);
    imp_scene *s = scene_make(ctx, m->filter, m->red);
    m->st = team_join(ctx, &m->rank);
    if (m->st == IMP_OK && m->fails) { /* a user stops this rank */
        struct imp_run run = IMP_RUN_INIT;
        imp_problem *p = problem_make(ctx, s, "ball.*");
        double g[3];
        if (m->fails == 1) run.progress = stop_now;
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

static size_t team(int ranks, int shares, const char *filter, enum job job)
{
    struct team_hub hub = {.ranks = ranks, .shares = shares, .tamper = tamper};
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
        tap_ok(same == want, "%s, %s: 2, 3 and 7 ranks, each has the bits # %d of %d",
               names[job], filter, same, want);
    }
}

/* As a rank on a processor with other instructions speaks of itself. */
static const char *other_machine(const void *message, size_t bytes)
{
    static char other[512];
    if (bytes > sizeof other) return message;
    memcpy(other, message, bytes);
    char *word = memmem(other, bytes, "importon ", 9);
    if (word) strcpy(word, "importon 0.1.0 sse4.2 neon");
    return other;
}

static void team_troubles(void)
{
    members_reset();
    tamper = other_machine;
    team(3, 0, "box", PICTURE);
    tamper = NULL;
    tap_ok(members[0].st == IMP_E_ARG && members[2].st == IMP_E_ARG &&
               strstr(members[0].error, "rank 0 runs \"importon 0.1.0") &&
               strstr(members[0].error, "rank 1 \"importon 0.1.0 sse4.2 neon\""),
           "a rank on another processor: both are named # %s", members[0].error);

    members_reset();
    members[1].red = .61;
    team(3, 0, "box", PICTURE);
    tap_ok(members[0].st == IMP_E_ARG && members[2].st == IMP_E_ARG &&
               strstr(members[0].error, "set of parameter values of rank 1 differs"),
           "a rank with another scene is found by all # %s", members[0].error);

    members_reset();
    members[1].fails = 1;
    members[0].fails = members[2].fails = 2;
    team(3, 0, "box", LOSS);
    tap_ok(members[0].st == IMP_CANCELLED && members[1].st == IMP_CANCELLED &&
               members[2].st == IMP_CANCELLED,
           "one rank is stopped: all are # %d %d %d", members[0].st, members[1].st,
           members[2].st);
}

/* What a step sends grows with ranks and numbers, not with samples. */
static void traffic(void)
{
    members_reset();
    const size_t few = team(2, 1, "box", LOSS);
    for (int k = 0; k < 2; k++) members[k].fails = 2; /* 4096 samples instead of 18 */
    const size_t many = team(2, 1, "box", LOSS);
    tap_ok(many < 1.2 * (double)few && few < 16384,
           "bytes of a rank: %zu at 18 samples, %zu at 4096", few, many);
}

int main(void)
{
    snprintf(folder, sizeof folder, "/tmp/parts.XXXXXX");
    if (!mkdtemp(folder)) return 99;
    for (int k = 0; k < PIXELS; k++) target[k] = 0.05f + 0.4f * (float)(k % 11) / 11;
    cuts("box");
    cuts("gaussian");
    refusals();
    no_parts();
    larger_parts();
    teams("box");
    teams("gaussian");
    team_troubles();
    traffic();
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) tap_ok(0, "the folder is removed");
    return tap_done();
}
