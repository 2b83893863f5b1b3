/* SPDX-License-Identifier: Apache-2.0
 *
 * Hosts that are not like ours: other rounding, trapping or flush-to-zero modes, forks
 * (also while workers run), no thread to be had, threads that share a scene. A call works
 * with the same bits, or returns an error; nothing aborts or hangs (alarm). */
#include "imp_scene.h"
#include "imp_tap.h"
#include <dlfcn.h>
#include <errno.h>
#include <fenv.h>
#include <importon/bend.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* This program's pthread_create is what the library calls, and what TBB calls. */
static atomic_bool no_threads;

__attribute__((visibility("default"))) int
pthread_create(pthread_t *restrict thread, const pthread_attr_t *restrict attributes,
               void *(*start)(void *), void *restrict payload)
{
    typedef int create(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    static create *real;
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "pthread_create");
    return atomic_load(&no_threads) ? EAGAIN : real(thread, attributes, start, payload);
}

/* And this is its rtcJoinCommitScene: how many threads are in Embree's builder? */
static atomic_int joined;
__attribute__((visibility("default"))) void rtcJoinCommitScene(void *scene);
void rtcJoinCommitScene(void *scene)
{
    static void (*real)(void *);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "rtcJoinCommitScene");
    atomic_fetch_add(&joined, 1);
    real(scene);
    atomic_fetch_sub(&joined, 1);
}

#define HASH_BASIS 14695981039346656037u
static uint64_t hash(uint64_t h, const void *data, size_t n)
{
    for (size_t i = 0; i < n; i++)
        h = (h ^ ((const unsigned char *)data)[i]) * 1099511628211u; /* FNV-1a */
    return h;
}

/* Load, render, gradient, fit: a hash of all numbers. 0: something failed. */
static uint64_t work(imp_context *ctx)
{
    imp_scene *s = NULL;
    imp_film *film = NULL;
    imp_problem *p = NULL;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *result;
    struct imp_estimate loss;
    uint64_t h = HASH_BASIS;
    double g[256], se[256];
    char path[1024];
    static const char *const size[] = {"res=16"};
    struct imp_load_options lo = IMP_LOAD_OPTIONS_INIT;
    lo.defines = size, lo.n_defines = 1;
    snprintf(path, sizeof path, "%s/cornell.xml", IMP_SCENES);
    run.spp = 4;
    if (imp_scene_load(ctx, path, &lo, &s) != IMP_OK ||
        imp_render(s, &run, &film) != IMP_OK || imp_film_get_info(film, &info) != IMP_OK)
        goto failed;
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    h = hash(h, imp_film_mean(film), n * sizeof(float));
    h = hash(h, imp_film_se(film), n * sizeof(float));
    target.width = info.width, target.height = info.height;
    target.channels = info.channels;
    target.pixels = imp_film_mean(film);
    options.max_iterations = 3;
    options.optimizer = IMP_LM;
    options.intervals = 1;
    run.seed = 5;
    if (imp_problem_create(s, &p) != IMP_OK ||
        imp_problem_activate(p, "*reflectance*") != IMP_OK ||
        imp_problem_n_variables(p) > 256 ||
        imp_problem_add_target(p, &target) != IMP_OK ||
        imp_problem_objective(p, NULL, &run, &loss, g, se) != IMP_OK)
        goto failed;
    h = hash(h, &loss.value, sizeof loss.value);
    h = hash(h, g, imp_problem_n_variables(p) * sizeof *g);
    h = hash(h, se, imp_problem_n_variables(p) * sizeof *se);
    if (imp_fit(p, &options, &run, &result) != IMP_OK) goto failed;
    for (size_t i = 0; i < result->n; i++) { /* without the padding */
        const struct imp_fit_variable *v = &result->variables[i];
        const double all[] = {v->start, v->value,    v->se,        v->lo95,
                              v->hi95,  v->at_bound, v->determined};
        h = hash(h, all, sizeof all);
    }
    imp_problem_destroy(p), imp_film_destroy(film), imp_scene_destroy(s);
    return h;
failed:
    printf("# %s\n", imp_last_error(ctx));
    imp_problem_destroy(p), imp_film_destroy(film), imp_scene_destroy(s);
    return 0;
}

static uint64_t work_anew(int threads)
{
    imp_context *ctx = test_context(threads);
    const uint64_t h = work(ctx);
    imp_context_destroy(ctx);
    return h;
}

static void modes(uint64_t right)
{
    static const struct {
        const char *name;
        int round;
        bool traps, flush;
    } modes[] = {{"rounding up", FE_UPWARD, false, false},
                 {"rounding down", FE_DOWNWARD, false, false},
                 {"rounding to zero", FE_TOWARDZERO, false, false},
                 {"traps on", FE_TONEAREST, true, false},
                 {"subnormal numbers flushed", FE_TONEAREST, false, true}};
    for (size_t m = 0; m < sizeof modes / sizeof *modes; m++)
        for (int threads = 1; threads <= 3; threads += 2) {
            fenv_t before;
            fegetenv(&before);
            fesetround(modes[m].round);
            if (modes[m].traps) feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
#if defined(__x86_64__)
            if (modes[m].flush) __builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8040);
            const unsigned mine = __builtin_ia32_stmxcsr() & 0xffc0;
#endif
            const uint64_t h = work_anew(threads);
#if defined(__x86_64__)
            const bool back = (__builtin_ia32_stmxcsr() & 0xffc0) == mine;
#else
            const bool back = fegetround() == modes[m].round;
#endif
            const bool kept =
                back &&
                fegetexcept() ==
                    (modes[m].traps ? FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW : 0);
            fesetenv(&before);
            tap_ok(h == right, "%s, %d threads: the same bits", modes[m].name, threads);
            tap_ok(kept, "%s, %d threads: the host's mode is given back", modes[m].name,
                   threads);
        }
}

/* ---- Forks --------------------------------------------------------------------- */

/* What work gives in a process that has not used the library before. */
static uint64_t work_in_child(void)
{
    uint64_t h = 0;
    int ends[2];
    if (pipe(ends) != 0) return 0;
    const pid_t pid = fork();
    if (pid == 0) {
        h = work_anew(2);
        _exit(write(ends[1], &h, sizeof h) != sizeof h);
    }
    if (read(ends[0], &h, sizeof h) != sizeof h) h = 0;
    close(ends[0]), close(ends[1]);
    waitpid(pid, NULL, 0);
    return h;
}

/* True if the child says so; a child that hangs is ended by its alarm. */
static bool child(bool (*check)(imp_context *, uint64_t), imp_context *ctx,
                  uint64_t right)
{
    fflush(stdout);
    const pid_t pid = fork();
    if (pid == 0) {
        alarm(60);
        _exit(check(ctx, right) ? 0 : 1);
    }
    int status = -1;
    while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {}
    if (status != 0) printf("# child ended with %#x\n", (unsigned)status);
    return status == 0;
}

static bool works_and_ends(imp_context *ctx, uint64_t right)
{
    const bool same = work(ctx) == right;
    imp_context_destroy(ctx);
    return same;
}
static bool ends(imp_context *ctx, uint64_t right)
{
    (void)right;
    imp_context_destroy(ctx);
    return true;
}

struct busy {
    imp_context *ctx;
    atomic_bool begun, stop;
    imp_context *other; /* of scenes that the callback makes; NULL: it makes none */
    atomic_int made;
};
static int progress(const struct imp_progress *p, void *payload)
{
    struct busy *b = payload;
    (void)p;
    atomic_store(&b->begun, true);
    if (b->other) {
        imp_scene_destroy(test_scene(b->other, "cornell.xml", IMP_RGB, "res=16"));
        atomic_fetch_add(&b->made, 1);
    }
    return atomic_load(&b->stop);
}
static void *render_on(void *payload)
{
    struct busy *b = payload;
    imp_scene *s = test_scene(b->ctx, "cornell.xml", IMP_RGB, NULL);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = 1 << 20;
    run.progress = progress, run.progress_payload = b;
    const enum imp_status st = imp_render(s, &run, &film);
    imp_film_destroy(film);
    imp_scene_destroy(s);
    return st == IMP_CANCELLED ? b : NULL;
}

static void forks(uint64_t right)
{
    imp_context *ctx = test_context(3);
    tap_ok(child(works_and_ends, ctx, right), "forked before anything was done");
    tap_ok(work(ctx) == right, "the parent goes on");
    tap_ok(child(works_and_ends, ctx, right), "forked with a pool and a device");
    tap_ok(child(ends, ctx, right), "forked, and the context destroyed at once");

    struct busy b = {.ctx = ctx};
    pthread_t thread;
    void *fine = NULL;
    if (pthread_create(&thread, NULL, render_on, &b) != 0) {
        tap_ok(0, "a thread that renders");
        return;
    }
    while (!atomic_load(&b.begun)) usleep(1000);
    bool all = true;
    for (int i = 0; i < 5; i++) all &= child(works_and_ends, ctx, right);
    tap_ok(all, "forked while workers run: five children work");
    atomic_store(&b.stop, true);
    pthread_join(thread, &fine);
    tap_ok(fine != NULL, "the parent's render was cancelled, not disturbed");
    tap_ok(work(ctx) == right, "and the parent goes on");
    imp_context_destroy(ctx);
}

/* A mesh that all threads build. */
enum { SIDE = 256 };
static imp_scene *large_scene(imp_context *ctx)
{
    const size_t n = SIDE * SIDE, triangles = 2 * (SIDE - 1) * (SIDE - 1);
    float *positions = malloc(3 * n * sizeof *positions);
    uint32_t *indices = malloc(3 * triangles * sizeof *indices), *to = indices;
    imp_scene *s = NULL;
    if (!positions || !indices || imp_scene_create(ctx, NULL, &s) != IMP_OK) abort();
    for (uint32_t k = 0; k < n; k++) {
        const uint32_t x = k % SIDE, y = k / SIDE;
        positions[3 * k] = (float)x;
        positions[3 * k + 1] = (float)y;
        positions[3 * k + 2] = (float)(x * y % 7);
        if (x + 1 == SIDE || y + 1 == SIDE) continue;
        const uint32_t corner[6] = {k, k + 1, k + SIDE, k + 1, k + SIDE + 1, k + SIDE};
        memcpy(to, corner, sizeof corner);
        to += 6;
    }
    imp_scene_begin(s, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(s, n, triangles, positions, NULL, NULL, indices);
    imp_scene_end(s);
    if (imp_scene_commit(s) != IMP_OK) s = NULL;
    free(positions);
    free(indices);
    return s;
}
static bool builds(imp_context *ctx)
{
    imp_scene *s = large_scene(ctx);
    imp_scene_destroy(s);
    return s != NULL;
}
static void *build_on(void *payload)
{
    struct busy *b = payload;
    bool all = true;
    while (!atomic_load(&b->stop)) {
        all &= builds(b->ctx);
        atomic_fetch_add(&b->made, 1);
        atomic_store(&b->begun, true);
    }
    return all ? b : NULL;
}

static atomic_int *fell; /* shared with children: forks that fell into a build */
static bool builds_after(imp_context *ctx, uint64_t right)
{
    (void)right;
    if (atomic_load(&joined) > 0) atomic_fetch_add(fell, 1); /* as it was at the fork */
    return builds(ctx);
}

static void forks_in_builds(void)
{
    struct busy b = {.ctx = test_context(3)};
    pthread_t thread;
    void *fine = NULL;
    bool all = true;
    int forks = 0;
    fell = mmap(NULL, sizeof *fell, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                -1, 0);
    if (fell == MAP_FAILED || pthread_create(&thread, NULL, build_on, &b) != 0) {
        tap_ok(0, "a thread that builds");
        return;
    }
    while (!atomic_load(&b.begun)) usleep(1000);
    for (; forks < 12 || (forks < 60 && atomic_load(fell) < 3); forks++) {
        usleep(3000); /* somewhere in the next build */
        all &= child(builds_after, b.ctx, 0);
    }
    tap_ok(all && atomic_load(fell) >= 3,
           "forked while threads build a tree: the children build # %d of %d in Embree",
           atomic_load(fell), forks);
    atomic_store(&b.stop, true);
    pthread_join(thread, &fine);
    tap_ok(fine != NULL, "and the parent goes on");
    munmap(fell, sizeof *fell);
    imp_context_destroy(b.ctx);
}

/* ---- Builds beside a render ------------------------------------------------------ */

/* Of one context: one thread renders, another makes large scenes, and the render's callback
 * makes scenes of another context. Nobody waits for the render to end, which it does when
 * the others have made theirs. */
static void builds_beside(void)
{
    struct busy render = {.ctx = test_context(2), .other = test_context(2)},
                build = {.ctx = render.ctx};
    pthread_t threads[2];
    void *fine[2] = {NULL, NULL};
    if (pthread_create(&threads[0], NULL, render_on, &render) != 0 ||
        pthread_create(&threads[1], NULL, build_on, &build) != 0) {
        tap_ok(0, "threads that render and build");
        return;
    }
    const int both = 3;
    int waited = 0; /* ms */
    while ((atomic_load(&render.made) < both || atomic_load(&build.made) < both) &&
           waited < 30000)
        usleep(5000), waited += 5;
    const bool in_time =
        tap_ok(waited < 30000,
               "scenes are made beside a render of their context # in its callback %d, "
               "of 130,050 triangles %d",
               atomic_load(&render.made), atomic_load(&build.made));
    if (!in_time) return; /* they may wait for ever */
    atomic_store(&render.stop, true);
    atomic_store(&build.stop, true);
    for (int k = 0; k < 2; k++) pthread_join(threads[k], &fine[k]);
    tap_ok(fine[0] && fine[1], "and both are right");
    imp_context_destroy(render.ctx);
    imp_context_destroy(render.other);
}

/* ---- No threads ---------------------------------------------------------------- */

static bool limited(imp_context *ctx, uint64_t right)
{
    (void)ctx;
    const struct rlimit one = {1, 1};
    if (setuid(65534) != 0 || setrlimit(RLIMIT_NPROC, &one) != 0) return true;
    if (access(IMP_SCENES "/cornell.xml", R_OK) != 0)
        return true; /* the checkout is closed to that user */
    return work_anew(1) == right && work_anew(3) == right;
}

static bool without(imp_context *ctx, uint64_t right)
{
    (void)ctx;
    atomic_store(&no_threads, true);
    return work_anew(1) == right && work_anew(3) == right;
}

/* ---- Threads that share -------------------------------------------------------- */

struct user {
    imp_scene *scene;
    double x[3], g[3];
    bool fine;
};
static void *use(void *payload)
{
    struct user *u = payload;
    imp_problem *p = NULL;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate loss;
    static const float pixels[16 * 16 * 3] = {0};
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = 16, t.channels = 3, t.pixels = pixels;
    run.spp = 8;
    u->fine = imp_problem_create(u->scene, &p) == IMP_OK &&
              imp_problem_activate(p, "white.reflectance.value") == IMP_OK &&
              imp_problem_add_target(p, &t) == IMP_OK && imp_problem_n_variables(p) == 3;
    for (int i = 0; i < 20 && u->fine; i++) {
        double g[3];
        u->fine = imp_problem_objective(p, u->x, &run, &loss, g, NULL) == IMP_OK;
        if (i > 0) u->fine &= memcmp(g, u->g, sizeof g) == 0;
        memcpy(u->g, g, sizeof g);
    }
    imp_problem_destroy(p);
    return NULL;
}

static void shared(void)
{
    enum { N = 4 };
    imp_context *ctx = test_context(2);
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    struct user u[N], alone[N];
    pthread_t thread[N];
    bool same = true;
    for (int i = 0; i < N; i++) {
        u[i] = (struct user){s, {0.1 + 0.2 * i, 0.3, 0.8 - 0.2 * i}, {0}, false};
        alone[i] = u[i];
        use(&alone[i]);
    }
    for (int i = 0; i < N; i++) pthread_create(&thread[i], NULL, use, &u[i]);
    for (int i = 0; i < N; i++) {
        pthread_join(thread[i], NULL);
        same &=
            u[i].fine && alone[i].fine && memcmp(u[i].g, alone[i].g, sizeof u[i].g) == 0;
    }
    tap_ok(same, "four threads, one scene, x given: each gets what it gets alone # %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* ---- Threads that end -------------------------------------------------------------- */

static atomic_int blocks;
static void *counted_allocate(size_t bytes, void *payload)
{
    (void)payload;
    void *p = NULL;
    if (posix_memalign(&p, 64, bytes) != 0) return NULL;
    atomic_fetch_add(&blocks, 1);
    return p;
}
static void counted_release(void *memory, void *payload)
{
    (void)payload;
    atomic_fetch_sub(&blocks, 1);
    free(memory);
}
static void *fails(void *payload)
{
    imp_film *film;
    imp_context *ctx = payload;
    const bool said = imp_film_read(ctx, "/none/x.exr", &film) != IMP_OK &&
                      strstr(imp_last_error(ctx), "/none/x.exr");
    return said ? payload : NULL;
}

/* A host may make a thread for every call: the message of one that has ended is released.
 */
static void short_lived(void)
{
    imp_context *ctx = NULL;
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    bool fine = true;
    int before = 0;
    o.threads = 1;
    o.allocator = (struct imp_allocator){counted_allocate, counted_release, NULL};
    test_must(NULL, imp_context_create(&o, &ctx));
    fails(ctx);
    for (int i = 0; i < 50 && fine; i++) {
        pthread_t thread;
        void *said = NULL;
        if (i == 1) before = atomic_load(&blocks);
        fine = pthread_create(&thread, NULL, fails, ctx) == 0 &&
               pthread_join(thread, &said) == 0 && said == ctx;
    }
    tap_ok(fine && atomic_load(&blocks) == before,
           "messages of threads that have ended # %d blocks, %d before",
           atomic_load(&blocks), before);
    imp_context_destroy(ctx);
    tap_ok(atomic_load(&blocks) == 0, "and nothing is left of the context");
}

struct inner {
    imp_scene *scene;
    enum imp_status set;
    bool read, called;
};
static int callback(const struct imp_progress *p, void *payload)
{
    struct inner *in = payload;
    double value[3] = {0.5, 0.5, 0.5};
    size_t index;
    (void)p;
    in->read = imp_scene_find_param(in->scene, "white.reflectance", &index) == IMP_OK &&
               imp_scene_get_values(in->scene, index, value) == IMP_OK;
    in->set = imp_scene_set_values(in->scene, index, 3, value);
    in->called = true;
    return 0;
}

static void callbacks(void)
{
    imp_context *ctx = test_context(2);
    struct inner in = {.scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16")};
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = 2;
    run.progress = callback, run.progress_payload = &in;
    test_must(ctx, imp_render(in.scene, &run, &film));
    tap_ok(in.called && in.read && in.set == IMP_E_ARG,
           "a callback of a render reads parameters, and may not set them # %d",
           (int)in.set);
    imp_film_destroy(film);
    imp_scene_destroy(in.scene);
    imp_context_destroy(ctx);
}

/* ---- Order of destruction ------------------------------------------------------ */

static int64_t held; /* allocations */
static void *counted(size_t bytes, void *payload)
{
    void *p = NULL;
    (void)payload;
    if (posix_memalign(&p, 64, bytes) != 0) return NULL;
    held++;
    return p;
}
static void uncounted(void *memory, void *payload)
{
    (void)payload;
    held--;
    free(memory);
}

static void order(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_field_grid grid = IMP_FIELD_GRID_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_context *ctx;
    imp_film *film = NULL;
    imp_problem *p = NULL;
    imp_field *field = NULL;
    o.threads = 1;
    o.allocator = (struct imp_allocator){counted, uncounted, NULL};
    test_must(NULL, imp_context_create(&o, &ctx));
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    run.spp = 1;
    test_must(ctx, imp_render(s, &run, &film));
    test_must(ctx, imp_problem_create(s, &p));
    for (int k = 0; k < 3; k++) grid.cells[k] = 2, grid.lo[k] = -1, grid.hi[k] = 1;
    test_must(ctx, imp_field_grid_create(ctx, &grid, 1.5, &field));
    imp_context_destroy(ctx);
    tap_ok(held > 0 && imp_film_mean(film)[0] >= 0, "a context that is destroyed first");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_field_destroy(field);
    imp_film_destroy(film);
    tap_ok(held == 0, "goes with the last of its objects # %d left", (int)held);
}

/* ---- theta --------------------------------------------------------------------- */

static void theta(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    const size_t n = imp_scene_n_theta(s), params = imp_scene_n_params(s);
    double *a = calloc(n, sizeof *a), *b = calloc(n, sizeof *b), one[64];
    size_t sum = 0;
    bool agree = true;
    imp_scene_get_theta(s, a);
    for (size_t k = 0; k < params; k++) {
        struct imp_param_info info = {.size = sizeof info};
        test_must(ctx, imp_scene_get_param(s, k, &info));
        agree &= info.offset == sum;
        sum += info.count;
        if (info.count > 64) continue;
        test_must(ctx, imp_scene_get_values(s, k, one));
        agree &= memcmp(one, a + info.offset, info.count * sizeof *one) == 0;
    }
    tap_ok(n > 0 && sum == n && agree, "theta is the parameters, one after the other");

    size_t white;
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_find_param(s, "white.reflectance", &white));
    test_must(ctx, imp_scene_get_param(s, white, &info));
    memcpy(b, a, n * sizeof *b);
    b[info.offset] = 0.125;
    test_must(ctx, imp_scene_set_theta(s, b));
    test_must(ctx, imp_scene_get_values(s, white, one));
    tap_ok(one[0] == 0.125 && one[1] == a[info.offset + 1],
           "set: one number has changed");
    b[info.offset] = 0.25;
    b[info.offset + 2] = 1.5;
    tap_ok(imp_scene_set_theta(s, b) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "white.reflectance.value[2] = 1.5") &&
               imp_scene_get_values(s, white, one) == IMP_OK && one[0] == 0.125,
           "outside a bound: named, and nothing is set");
    test_must(ctx, imp_scene_set_theta(s, a));
    imp_scene_get_theta(s, b);
    tap_ok(memcmp(a, b, n * sizeof *a) == 0, "set and read: the same");
    free(a), free(b);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

int main(void)
{
    alarm(110);
    const uint64_t right = work_in_child();
    tap_ok(right != 0, "as usual");
    /* First: once there is a thread of TBB's, it may not need another. */
    tap_ok(child(without, NULL, right), "no thread can be made: the same bits");
    if (geteuid() == 0)
        tap_ok(child(limited, NULL, right), "RLIMIT_NPROC of a user without rights");
    else tap_skip("RLIMIT_NPROC", "not root");
    modes(right);
    forks(right);
    forks_in_builds();
    builds_beside();
    order();
    shared();
    short_lived();
    callbacks();
    theta();
    return tap_done();
}
