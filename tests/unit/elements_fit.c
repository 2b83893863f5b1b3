/* SPDX-License-Identifier: Apache-2.0
 *
 * Lighting design by finite elements: against closed forms, against every active set of
 * the same linear problem tried one by one, and what is refused. */
#include "elements/elements.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"

#define EYE                                                                              \
    "<sensor type='perspective'><transform name='to_world'>"                             \
    "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"                     \
    "<film type='hdrfilm'><integer name='width' value='8'/>"                             \
    "<integer name='height' value='8'/></film></sensor>"

static struct imp_elements_options options(size_t n, struct imp_elements_source *sources,
                                           const char *const *shapes)
{
    static const struct imp_elements_source initial = IMP_ELEMENTS_SOURCE_INIT;
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    for (size_t k = 0; k < n; k++) {
        sources[k] = initial;
        sources[k].kind = IMP_ELEMENTS_SHAPE;
        sources[k].shape = shapes[k];
    }
    o.stop = -1;
    o.eps_last = 1e-3;
    o.n_sources = n;
    o.sources = sources;
    return o;
}

/* A square lamp over an equal black square at distance 1: E = pi L F with F known to all
 * digits (Hottel); its power for 100 lux. A second lamp behind it shines on nothing. */
static void one_lamp(imp_context *ctx)
{
    static const char xml[] =
        "<scene version='3.0.0'>" EYE
        "<shape type='rectangle' id='desk'><transform name='to_world'><scale "
        "value='0.5'/></transform>"
        "<bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf></shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale "
        "value='0.5'/>"
        "<rotate x='1' angle='180'/><translate z='1'/></transform>"
        "<emitter type='area'><float name='radiance' value='0'/></emitter></shape>"
        "<shape type='rectangle' id='idle'><transform name='to_world'>"
        "<translate z='2'/></transform>"
        "<emitter type='area'><float name='radiance' value='3'/></emitter></shape>"
        "</scene>";
    const double F = 0.19982489569838746, target = 100;
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    imp_problem *p = test_problem(ctx, s, "*radiance*");
    struct imp_elements_source source;
    struct imp_elements_options o = options(1, &source, (const char *[]){"desk"});
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    const struct imp_elements_fit_result *r;
    imp_elements *e;
    double value;
    size_t lamp;
    f.targets = &target;
    o.eps_last = 1e-4;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_fit(e, p, &f, &r));
    test_must(ctx, imp_scene_find_param(s, "lamp.emitter.radiance.value", &lamp));
    test_must(ctx, imp_scene_get_values(s, lamp, &value));
    tap_near(value, target / (IMP_PI * F), 1e-5, 0, "one lamp over a square, from off");
    tap_near(r->goals[0].after, target, 1e-9, 0, "its target is met");
    tap_ok(fabs(r->goals[0].before) < 1e-9 && r->linear && r->variables[1].value == 3,
           "what has no effect stays # %g", r->variables[1].value);

    /* Ridge: min 1/2 ((A x - t)/t)^2 + W/2 x^2, in closed form x = A/t / (A^2/t^2 + W) */
    const double A = IMP_PI * F, W = 1e-6;
    test_must(ctx, imp_problem_add_tikhonov(p, "lamp*", W, 0));
    test_must(ctx, imp_elements_fit(e, p, &f, &r));
    tap_near(r->variables[0].value, A / target / (A * A / target / target + W), 1e-5, 0,
             "with a price on power");
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- Scene b: four lamps, three walls, bounds ---------------------------------- */

enum { LAMPS = 4, WALLS = 3 };

/* Solve the symmetric system of the free variables; false: singular. */
static bool gauss(int n, double a[LAMPS][LAMPS + 1])
{
    for (int i = 0; i < n; i++) {
        int best = i;
        for (int k = i + 1; k < n; k++)
            if (fabs(a[k][i]) > fabs(a[best][i])) best = k;
        if (fabs(a[best][i]) < 1e-14) return false;
        for (int j = 0; j <= n; j++) {
            const double t = a[i][j];
            a[i][j] = a[best][j];
            a[best][j] = t;
        }
        for (int k = 0; k < n; k++) {
            const double f = a[k][i] / a[i][i];
            for (int j = 0; j <= n && k != i; j++) a[k][j] -= f * a[i][j];
        }
    }
    return true;
}

/* The least of 1/2 sum ((A x - t)/t)^2 + w/2 |x|^2 in a box: every choice of free and
 * fixed variables. */
static double least(double A[WALLS][LAMPS], const double *t, double w, double lo,
                    double hi, double *x)
{
    double best = INFINITY;
    for (int set = 0; set < 81; set++) {
        int code = set, free[LAMPS], n = 0;
        double y[LAMPS], m[LAMPS][LAMPS + 1];
        for (int i = 0; i < LAMPS; i++, code /= 3) {
            y[i] = code % 3 == 1 ? lo : hi;
            if (code % 3 == 0) free[n++] = i, y[i] = 0;
        }
        for (int a = 0; a < n; a++) {
            for (int b = 0; b < n; b++) m[a][b] = a == b ? w : 0;
            m[a][n] = 0;
            for (int k = 0; k < WALLS; k++) {
                double r = t[k];
                for (int i = 0; i < LAMPS; i++) r -= A[k][i] * y[i];
                for (int b = 0; b < n; b++)
                    m[a][b] += A[k][free[a]] * A[k][free[b]] / (t[k] * t[k]);
                m[a][n] += A[k][free[a]] * r / (t[k] * t[k]);
            }
        }
        if (!gauss(n, m)) continue;
        bool inside = true;
        for (int a = 0; a < n; a++) {
            y[free[a]] = m[a][n] / m[a][a];
            inside &= y[free[a]] >= lo && y[free[a]] <= hi;
        }
        double f = 0;
        for (int i = 0; i < LAMPS; i++) f += w / 2 * y[i] * y[i];
        for (int k = 0; k < WALLS; k++) {
            double r = -t[k];
            for (int i = 0; i < LAMPS; i++) r += A[k][i] * y[i];
            f += r * r / (2 * t[k] * t[k]);
        }
        if (!inside || f >= best) continue;
        best = f;
        memcpy(x, y, sizeof y);
    }
    return best;
}

static void bounded(imp_context *ctx, enum imp_optimizer optimizer, const double *t,
                    const char *name)
{
    static const char *const walls[] = {"floor", "ceiling", "back"};
    const double w = 1e-5, lo = 0.5, hi = 60;
    struct imp_elements_source source[WALLS];
    struct imp_elements_options o = options(WALLS, source, walls);
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    const struct imp_elements_bounds box = {sizeof box, "light*", lo, hi};
    const struct imp_elements_fit_result *r;
    const struct imp_elements_row *rows;
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=16");
    imp_problem *p = test_problem(ctx, s, "light*");
    imp_elements *e;
    double A[WALLS][LAMPS] = {{0}}, x[LAMPS] = {0};
    size_t n_rows;
    f.optimizer = optimizer;
    f.targets = t;
    f.n_bounds = 1;
    f.bounds = &box;
    test_must(ctx, imp_problem_add_tikhonov(p, "light*", w, 0));
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_fit(e, p, &f, &r));
    for (int k = 0; k < WALLS; k++) {
        double unit[WALLS] = {0};
        unit[k] = 1;
        imp__el_weigh(e, unit);
        test_must(ctx, imp__el_bin(e));
        test_must(ctx, imp_elements_sensitivity(e, &rows, &n_rows));
        for (size_t i = 0; i < n_rows; i++)
            for (size_t j = 0; j < LAMPS; j++) {
                const size_t param = test_param_of(ctx, p, j);
                if (rows[i].param == (int)param) A[k][j] += rows[i].derivative;
            }
    }
    const double best = least(A, t, w, lo, hi, x);
    double apart = 0;
    int walled = 0;
    for (int i = 0; i < LAMPS; i++) {
        apart = fmax(apart, fabs(r->variables[i].value - x[i]) / hi);
        walled += r->variables[i].at_bound != 0;
    }
    tap_ok(r->n == LAMPS && r->linear && apart < 1e-5,
           "%s: lamps as by all active sets # %.1e, %d at bounds: %g %g %g %g", name,
           apart, walled, x[0], x[1], x[2], x[3]);
    printf("# %s: %d iterations\n", name, r->iterations);
    tap_near(r->objective, best, 1e-7, 1e-12, "its loss");
    for (int k = 0; k < WALLS; k++) {
        double J = 0;
        for (int i = 0; i < LAMPS; i++) J += A[k][i] * r->variables[i].value;
        tap_near(r->goals[k].after, J, 1e-6, 0, "what a wall measures");
    }
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A lamp and the walls' reflectance for two measurements that a known pair gives. */
static void reflectance(imp_context *ctx, enum imp_optimizer optimizer, const char *name)
{
    static const char *const walls[] = {"floor", "left"};
    struct imp_elements_source source[2];
    struct imp_elements_options o = options(2, source, walls);
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    const struct imp_elements_fit_result *r = NULL;
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=16");
    imp_problem *p = test_problem(ctx, s, "light_left*");
    imp_elements *e;
    double x[2] = {0.7, 10}, t[2];
    test_must(ctx, imp_problem_activate(p, "wall*"));
    f.optimizer = optimizer;
    f.targets = t;
    f.rounds = 1; /* the truth was measured on the same links */
    o.eps_last = 5e-3;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp__el_settle(e, 8, true, 1e-14));
    for (int k = 0; k < 2; k++) {
        imp__el_weigh(e, (const double[]){k == 0, k == 1});
        test_must(ctx, imp__el_bin(e));
        t[k] = imp__el_measure(e, NULL);
    }
    /* No link is split again: the search has to find where it came from. */
    e->opt.eps_first = e->opt.eps_last = 1e9;
    x[0] = 0.4;
    x[1] = 25;
    test_must(ctx, imp_problem_set_x(p, x));
    const enum imp_status st = imp_elements_fit(e, p, &f, &r);
    tap_ok(st == IMP_OK && !r->linear && r->iterations > 2, "%s: %d iterations # %s",
           name, r->iterations, r->reason);
    const double tight = optimizer == IMP_LM ? 1e-6 : 1e-3;
    tap_near(r->variables[0].value, 0.7, tight, 0, "its reflectance");
    tap_near(r->variables[1].value, 10, tight, 0, "its lamp");
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A closed white box that glows: E = pi Le/(1 - rho), so E = 4 pi Le wants rho = 0.75; on
 * the way lies rho = 1, where reflections never end. */
static void furnace(imp_context *ctx, enum imp_optimizer optimizer)
{
    static const char xml[] =
        "<scene version='3.0.0'>" EYE
        "<shape type='cube' id='box'><boolean name='flip_normals' value='true'/>"
        "<bsdf type='diffuse' id='white'><float name='reflectance' value='0.1'/></bsdf>"
        "<emitter type='area'><float name='radiance' value='1'/></emitter></shape>"
        "</scene>";
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    imp_problem *p = test_problem(ctx, s, "white*");
    struct imp_elements_source source;
    struct imp_elements_options o = options(1, &source, (const char *[]){"box"});
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    const struct imp_elements_fit_result *r;
    const double target = 4 * IMP_PI;
    imp_elements *e;
    o.eps_first = o.eps_last = 0.05;
    f.optimizer = optimizer;
    f.targets = &target;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_fit(e, p, &f, &r));
    tap_near(r->variables[0].value, 0.75, 1e-6, 0, "a furnace's reflectance");
    tap_near(r->goals[0].before, IMP_PI / 0.9, 1e-8, 0, "what it was");
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- What is refused, stopped, or out of memory -------------------------------- */

static int stop_now(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return 1;
}
static int stop_in_fit(const struct imp_progress *p, void *payload)
{
    imp_elements *e = payload;
    e->last_tick_s = 0; /* report everything */
    return strcmp(p->stage, "fit") == 0;
}

static void is_refused(imp_elements *e, imp_problem *p,
                       const struct imp_elements_fit_options *f,
                       const struct imp_elements_fit_result **r, const char *what)
{
    const enum imp_status st = imp_elements_fit(e, p, f, r);
    tap_ok(st == IMP_E_ARG && *imp_last_error(e->ctx), "%s # %s", what,
           imp_last_error(e->ctx));
}

static void refused(imp_context *ctx)
{
    static const char *const walls[] = {"floor"};
    struct imp_elements_source source;
    struct imp_elements_options o = options(1, &source, walls);
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    struct imp_elements_bounds box = {sizeof box, "light*", 3, 2};
    const struct imp_elements_fit_result *r = NULL;
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=16");
    imp_problem *none, *p = test_problem(ctx, s, "light*");
    double start[LAMPS], x[LAMPS], target = 2;
    imp_elements *e;
    test_must(ctx, imp_problem_create(s, &none));
    test_must(ctx, imp_elements_create(s, &o, &e));
    is_refused(e, p, &f, &r, "no targets");
    f.targets = &target;
    is_refused(e, none, &f, &r, "nothing active");
    f.n_bounds = 1;
    f.bounds = &box;
    is_refused(e, p, &f, &r, "bounds");
    box = (struct imp_elements_bounds){sizeof box, "nothing*", 0, 1};
    is_refused(e, p, &f, &r, "bounds");
    box = (struct imp_elements_bounds){sizeof box, "light*", -2, -1};
    is_refused(e, p, &f, &r, "bounds");
    box = (struct imp_elements_bounds){0, "light*", 0, 1};
    is_refused(e, p, &f, &r, "size 0 of bounds");
    f.n_bounds = 0;
    target = NAN;
    is_refused(e, p, &f, &r, "target");
    tap_ok(r == NULL, "no result of any of them");
    target = 2;
    imp_problem_get_x(p, start);
    e->opt.progress = stop_now;
    const enum imp_status st = imp_elements_fit(e, p, &f, &r);
    imp_problem_get_x(p, x);
    tap_ok(st == IMP_CANCELLED && r && r->n == LAMPS && memcmp(x, start, sizeof x) == 0,
           "stopped at once: where it began # %s", r ? r->reason : "");
    /* Stopped on the way: what it holds is a whole solution all the same. */
    imp_elements_destroy(e);
    test_must(ctx, imp_problem_activate(p, "wall*"));
    test_must(ctx, imp_elements_create(s, &o, &e));
    e->opt.progress = stop_in_fit;
    e->opt.progress_payload = e;
    const enum imp_status later = imp_elements_fit(e, p, &f, &r);
    struct imp_elements_info info = {.size = sizeof info};
    test_must(ctx, imp_elements_get_info(e, &info));
    tap_ok(later == IMP_CANCELLED && e->opt.progress == stop_in_fit &&
               fabs(info.measure / info.measure_adjoint - 1) < 1e-6 &&
               fabs(info.measure / r->goals[0].after - 1) < 1e-6,
           "stopped on the way: settled # %s; %.9g %.9g %.9g", r->reason, info.measure,
           info.measure_adjoint, r->goals[0].after);
    imp_elements_destroy(e);
    imp_problem_destroy(none);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void memory(void)
{
    static const char *const walls[] = {"floor"};
    struct fail_alloc heap = {0};
    struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_elements_fit_options f = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    const double target = 2;
    imp_context *ctx;
    co.threads = 1;
    co.allocator = fail_alloc_hooks(&heap);
    test_must(NULL, imp_context_create(&co, &ctx));
    imp_scene *s = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=4");
    imp_problem *p = test_problem(ctx, s, "light*");
    int failures = 0;
    f.targets = &target;
    bool good = true;
    for (long n = 1; n < 100000; n += 1 + n / 8) {
        struct imp_elements_source source;
        struct imp_elements_options o = options(1, &source, walls);
        const struct imp_elements_fit_result *r;
        imp_elements *e = NULL;
        o.eps_first = o.eps_last = 0.05;
        heap.calls = 0;
        heap.fail_at = n;
        enum imp_status st = imp_elements_create(s, &o, &e);
        if (st == IMP_OK) st = imp_elements_fit(e, p, &f, &r);
        heap.fail_at = 0;
        imp_elements_destroy(e);
        if (st == IMP_OK) break;
        good &= st == IMP_E_NOMEM;
        failures++;
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    tap_ok(good && failures > 10 && heap.live == 0, "out of memory %d times # %ld left",
           failures, heap.live);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    one_lamp(ctx);
    bounded(ctx, IMP_LM, (const double[]){2, 1, 3}, "lm");
    bounded(ctx, IMP_LM, (const double[]){0.3, 0.8, 0.9}, "lm, inside");
    bounded(ctx, IMP_SLSQP, (const double[]){2, 1, 3}, "slsqp");
    reflectance(ctx, IMP_LM, "lm");
    reflectance(ctx, IMP_LBFGS, "lbfgs");
    furnace(ctx, IMP_LM);
    furnace(ctx, IMP_SLSQP);
    refused(ctx);
    imp_context_destroy(ctx);
    memory();
    return tap_done();
}
