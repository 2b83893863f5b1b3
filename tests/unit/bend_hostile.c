/* SPDX-License-Identifier: Apache-2.0
 *
 * Bent rays that go wrong are counted, never silent; arguments that cannot be are
 * refused; threads change no bit; memory does not grow with steps; running out of it is
 * an error. */
#include "bend_kit.h"
#include <stdatomic.h>

#define N 300

static struct imp_bend_exit e[N];

static struct imp_bend_stats trace(const imp_field *f, const struct imp_bend_options *o)
{
    struct imp_bend_rays r = kit_beam(N, -0.8, 0.7, 0.2);
    struct imp_bend_stats s = {.size = sizeof s};
    KIT_CHECK(imp_bend_trace(f, o, &r, e, NULL, &s));
    kit_rays_free(&r);
    return s;
}

static void counts(void)
{
    imp_field *f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 8, 1, 0.02);
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_stats st = trace(f, &o);
    tap_ok(st.traced + st.grazing == N && st.rays == N && st.steps > 5 * N,
           "default: the field's box, default step # %d traced", (int)st.traced);
    o.step = 1e-4, o.max_steps = 100;
    st = trace(f, &o);
    tap_ok(st.truncated == N && st.traced == 0, "tiny steps: all truncated, all counted");
    o.step = 0.05, o.max_steps = 0;
    s.offset = 5;
    o.surfaces = &s, o.n_surfaces = 1;
    st = trace(f, &o);
    tap_ok(st.missed == N, "a plane behind the field: rays that leave are missed");
    s.offset = -0.9;
    st = trace(f, &o);
    tap_ok(st.started_out == N, "starts behind the exit");
    s.offset = 0.5, s.normal[0] = 1, s.normal[2] = 0.02;
    o.grazing = 0.3;
    st = trace(f, &o);
    tap_ok(st.grazing > 0 && st.grazing + st.traced + st.missed + st.started_out == N,
           "grazing exits are dropped and counted # %d of %d", (int)st.grazing, N);
    s = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    s.offset = 0.9, o.grazing = 0;
    o.step = 1.5; /* most of the field at once */
    st = trace(f, &o);
    tap_ok(st.traced + st.missed + st.broken + st.grazing + st.started_out +
                   st.truncated >=
               N,
           "steps as long as the field: %d traced, %d broken, %d missed", (int)st.traced,
           (int)st.broken, (int)st.missed);
    o.step = 3;
    struct imp_bend_rays one = kit_beam(1, -0.8, 0.7, 0.2);
    tap_ok(imp_bend_trace(f, &o, &one, e, NULL, NULL) == IMP_E_ARG, "longer: refused");
    kit_rays_free(&one);
    imp_field_destroy(f);

    /* A jump of the index, and an index below zero. */
    f = kit_grid(IMP_FIELD_TRILINEAR, IMP_FIELD_ETA, 8, 1, 0);
    const size_t n = imp_field_n_theta(f);
    double *t = calloc(n, sizeof *t);
    for (size_t i = 0; i < n; i++) t[i] = i < n / 2 ? 1 : 2.5;
    KIT_CHECK(imp_field_set_theta(f, t));
    o.step = 0.4;
    st = trace(f, &o);
    tap_ok(st.broken > N / 2,
           "a jump of the index at large steps: energy flagged # %d broken",
           (int)st.broken);
    for (size_t i = 0; i < n; i++) t[i] = i < n / 2 ? 1 : -2.5;
    KIT_CHECK(imp_field_set_theta(f, t));
    o.step = 0.05;
    st = trace(f, &o);
    tap_ok(st.traced < N / 2,
           "negative index: no silent exits # %d traced, %d broken, %d lost",
           (int)st.traced, (int)st.broken, (int)(st.missed + st.truncated));
    free(t);
    imp_field_destroy(f);

    /* Rays that never leave: a bound orbit. */
    const double p[5] = {2, 1, 0, 0, 0};
    f = kit_profile("maxwell", p, NULL);
    s = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    s.type = IMP_BEND_SPHERE, s.radius = 50;
    o.step = 0.1, o.max_steps = 2000;
    st = trace(f, &o);
    tap_ok(st.truncated == N, "bound orbits: truncated and counted");

    struct imp_bend_rays r = kit_beam(N, -0.8, 0.7, 0.2);
    double(*x)[3] = (double(*)[3])(uintptr_t)r.x, (*d)[3] = (double(*)[3])(uintptr_t)r.d;
    x[3][1] = NAN, x[4][2] = INFINITY, d[5][0] = NAN;
    d[6][0] = d[6][1] = d[6][2] = 0;
    s.radius = 1, o.max_steps = 0;
    KIT_CHECK(imp_bend_trace(f, &o, &r, e, NULL, &st));
    tap_ok(st.broken >= 3 && (e[3].flags & IMP_BEND_DROPPED) &&
               (e[4].flags & IMP_BEND_DROPPED) && (e[5].flags & IMP_BEND_BROKEN) &&
               (e[6].flags & IMP_BEND_BROKEN),
           "rays of NaN, infinity and no direction are dropped");
    kit_rays_free(&r);
    imp_field_destroy(f);
}

static void refusals(void)
{
    const double p[5] = {2, 1, 0, 0, 0};
    imp_field *f = kit_profile("maxwell", p, NULL);
    struct imp_bend_rays r = kit_beam(N, -0.8, 0.7, 0.2);
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    enum imp_status st;
#define REFUSED(what, want)                                                              \
    st = imp_bend_trace(f, &o, &r, e, NULL, NULL);                                       \
    tap_ok(st == (want), what " # %s", imp_last_error(kit_ctx))
    REFUSED("no cells to choose a step by", IMP_E_ARG);
    o.step = 0.1;
    REFUSED("no end to an unbounded field", IMP_E_ARG);
    o.surfaces = &s, o.n_surfaces = 1;
    o.step = -1;
    REFUSED("negative step", IMP_E_ARG);
    o.step = NAN;
    REFUSED("NaN step", IMP_E_ARG);
    o.step = 0.1;
    s.normal[2] = 0;
    REFUSED("plane without normal", IMP_E_ARG);
    s.normal[2] = 1;
    s.type = IMP_BEND_SPHERE, s.radius = -1;
    REFUSED("negative radius", IMP_E_ARG);
    s.type = IMP_BEND_SDF;
    REFUSED("no distance field", IMP_E_ARG);
    s.type = IMP_BEND_BOX;
    REFUSED("empty box", IMP_E_ARG);
    s.type = 77;
    REFUSED("no such surface", IMP_E_ARG);
    s = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    s.event = IMP_BEND_REFRACT, s.index = 0;
    REFUSED("index outside zero", IMP_E_ARG);
    s.event = IMP_BEND_END;
    o.scheme = 9;
    REFUSED("no such scheme", IMP_E_ARG);
    o.scheme = IMP_BEND_ARC_INDEX;
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    static struct imp_bend_cotangent bars[N];
    KIT_CHECK(imp_bend_trace(f, &o, &r, e, NULL, NULL));
    st = imp_bend_adjoint(f, &o, &r, e, NULL, bars, NULL, &g, NULL);
    tap_ok(st == IMP_E_BIAS, "index form cannot be reversed # %s",
           imp_last_error(kit_ctx));
    kit_rays_free(&r);
    imp_field_destroy(f);
}

/* Exits and gradients with 1, 2 and 3 threads; 40 cells: many blocks of numbers. */
static void bits(int cells)
{
    static struct imp_bend_exit exits[3][N];
    static struct imp_bend_cotangent bars[N];
    double *bar[3];
    size_t n = 0;
    for (int threads = 1; threads <= 3; threads++) {
        imp_context_destroy(kit_ctx);
        kit_begin(threads);
        imp_field *f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, cells, 1, 0.3 / cells);
        struct imp_bend_rays r = kit_beam(N, -0.8, 0.7, 0.2);
        struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
        n = imp_field_n_theta(f);
        bar[threads - 1] = calloc(n, sizeof(double));
        for (int i = 0; i < N; i++)
            for (int k = 0; k < 3; k++)
                bars[i].x[k] = kit_pm(300, i), bars[i].v[k] = kit_pm(301, i);
        struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
        g.theta = bar[threads - 1];
        KIT_CHECK(imp_bend_trace(f, &o, &r, exits[threads - 1], NULL, NULL));
        KIT_CHECK(
            imp_bend_adjoint(f, &o, &r, exits[threads - 1], NULL, bars, NULL, &g, NULL));
        kit_rays_free(&r);
        imp_field_destroy(f);
    }
    tap_ok(!memcmp(exits[0], exits[1], sizeof exits[0]) &&
               !memcmp(exits[0], exits[2], sizeof exits[0]),
           "exits: same bits, 1, 2, 3 threads, %d cells", cells);
    tap_ok(!memcmp(bar[0], bar[1], n * sizeof(double)) &&
               !memcmp(bar[0], bar[2], n * sizeof(double)),
           "gradients: same bits, 1, 2, 3 threads, %d cells", cells);
    for (int i = 0; i < 3; i++) free(bar[i]);
}

/* ---- Memory -------------------------------------------------------------------- */

static size_t now, peak, left = SIZE_MAX;
static atomic_int outstanding;
static void *count_alloc(size_t bytes, void *payload)
{
    (void)payload;
    if (left == 0) return NULL;
    if (left != SIZE_MAX) left--;
    size_t *p = aligned_alloc(64, (bytes + 64 + 63) / 64 * 64);
    if (!p) return NULL;
    *p = bytes;
    now += bytes;
    if (now > peak) peak = now;
    outstanding++;
    return (char *)p + 64;
}
static void count_release(void *memory, void *payload)
{
    (void)payload;
    if (!memory) return;
    size_t *p = (size_t *)(void *)((char *)memory - 64);
    now -= *p;
    outstanding--;
    free(p);
}

static enum imp_status run_once(double step)
{
    static struct imp_bend_cotangent bars[N];
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    struct imp_bend_rays r = kit_beam(N, -0.8, 0.7, 0.2);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_field_grid d = IMP_FIELD_GRID_INIT;
    imp_field *f = NULL;
    static double bar[11 * 11 * 11];
    o.step = step;
    for (int k = 0; k < 3; k++) d.cells[k] = 8, d.lo[k] = -1, d.hi[k] = 1;
    enum imp_status st = imp_field_grid_create(kit_ctx, &d, 1.3, &f);
    for (int i = 0; i < N; i++) bars[i].x[0] = bars[i].v[1] = 1;
    g.theta = bar;
    if (st == IMP_OK) st = imp_bend_trace(f, &o, &r, e, NULL, NULL);
    if (st == IMP_OK) st = imp_bend_adjoint(f, &o, &r, e, NULL, bars, NULL, &g, NULL);
    imp_field_destroy(f);
    kit_rays_free(&r);
    return st;
}

static void memory(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    o.allocator.allocate = count_alloc;
    o.allocator.release = count_release;
    imp_context_destroy(kit_ctx);
    if (imp_context_create(&o, &kit_ctx) != IMP_OK) exit(1);
    KIT_CHECK(run_once(0.05));
    peak = now;
    KIT_CHECK(run_once(0.05));
    const size_t few = peak;
    peak = now;
    KIT_CHECK(run_once(0.05 / 16));
    tap_ok(peak <= few * 1.01, "peak memory, 16 times the steps # %zu against %zu bytes",
           peak, few);
    const int held = outstanding;
    int failures = 0;
    for (size_t k = 0; k < 200; k++) {
        left = k;
        const enum imp_status st = run_once(0.05);
        left = SIZE_MAX;
        if (st == IMP_OK) break;
        failures += st == IMP_E_NOMEM;
        if (st != IMP_E_NOMEM) failures = -1000;
    }
    tap_ok(failures > 5 && outstanding == held,
           "the n-th allocation fails: IMP_E_NOMEM, no leak "
           "# %d failures",
           failures);
}

int main(void)
{
    kit_begin(2);
    counts();
    refusals();
    bits(10);
    bits(40);
    memory();
    imp_context_destroy(kit_ctx);
    tap_ok(outstanding == 0, "everything given back");
    return tap_done();
}
