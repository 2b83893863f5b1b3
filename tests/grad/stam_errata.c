/* SPDX-License-Identifier: Apache-2.0
 *
 * Negative controls (docs/estimators.md 13 G): mistakes of the paper's pseudo-code, and
 * two that others make, planted in this test's own fold and sweep of recorded walks. Each
 * is shown to give the wrong number it must give, where that is known, and to be caught
 * by the check that is there for it; without the mistake the same fold and sweep pass.
 * docs/stam.md quotes what this prints. */
#include "stam_walks.h"

/* ---- Fold and sweep with a mistake --------------------------------------------- */

enum mistake {
    NONE,
    E22_NO_SURVIVAL,    /* P *= f/p: the 1/(1 - a) of the step is forgotten */
    E23_EMISSION_TWICE, /* emission gradient += P emission/a, and E22 */
    E24_CUT_GLOWS,      /* the last vertex glows also where the walk was cut */
    DRAWN_DENSITY, /* chance times density of the lobe drawn from, not of the mixture */
    RELATIVE       /* df/f, which is 0 where f is 0, in place of df */
};

#define LONGEST 70

/* L of the walk, and g if not NULL. */
static double planted(const struct stam *s, const struct imp_walk *w,
                      enum mistake mistake, double *g)
{
    struct dual f[LONGEST]; /* step weight without 1/(1 - a), with its derivative */
    double lin[LONGEST], L = 0;
    const struct imp_vertex *at[LONGEST];
    int n = 0;
    for (const struct imp_vertex *v = w->first; v && n < LONGEST; v = v->next)
        at[n++] = v;
    const struct imp_vertex *last = at[n - 1];
    const int glow = stam_is(last, "sphere") ? AMBIENT2 : AMBIENT3;
    const bool ends =
        w->absorbed || (mistake == E24_CUT_GLOWS && last->d.met.emitter < 0);
    if (last->d.met.emitter >= 0) L = s->theta[EMISSION];
    else if (ends) L = s->theta[glow] / s->absorb;

    for (int k = n - 2; k >= 0; k--) {
        const struct imp_vertex *v = at[k];
        const bool sphere = stam_is(v, "sphere");
        const struct imp_dirs dirs = imp__vertex_dirs(v);
        double p = v->d.pdf;
        if (mistake == DRAWN_DENSITY && sphere) {
            const bool cosine = imp__u01(w->key, imp__dim(k, IMP_DIM_LOBE)) < .5;
            p = .5 *
                stam_m2_pdf(&dirs, cosine ? STAM_COSINE : STAM_PHONG, s->theta[EXPONENT]);
        }
        f[k] = dual_scale(
            sphere ? stam_m2(&dirs, STAM_MICROFACET, s->theta)
                   : dual_scale(dual_control(s->theta, DIFFUSE3), v->d.wi[2] / M_PI),
            1 / p);
        lin[k] = L;
        L *= f[k].v / (1 - s->absorb);
    }
    if (!g) return L;

    double P = 1;
    memset(g, 0, N_CONTROLS * sizeof *g);
    for (int k = 0; k < n - 1; k++) {
        const double arriving = lin[k] / (1 - s->absorb);
        for (int c = 0; c < N_CONTROLS; c++)
            if (mistake != RELATIVE || f[k].v != 0) g[c] += P * f[k].d[c] * arriving;
        P *= mistake == E22_NO_SURVIVAL || mistake == E23_EMISSION_TWICE
                 ? f[k].v
                 : f[k].v / (1 - s->absorb);
    }
    if (last->d.met.emitter >= 0) g[EMISSION] += P;
    else if (ends)
        g[glow] += P / s->absorb * (mistake == E23_EMISSION_TWICE ? s->theta[glow] : 1);
    return L;
}

#define CAUGHT 5 /* |z|: once in 2 million by chance */

/* Agrees with ref; or, where a mistake is planted, differs so that a z-test cannot miss
 * it. */
static void expect(bool same, const struct tap_stat *stat, double ref, double ref_se,
                   const char *what)
{
    const double se = hypot(tap_se(stat), ref_se) + 1e-12, z = (stat->mean - ref) / se;
    tap_ok(same ? fabs(z) <= 4 : fabs(z) > CAUGHT,
           "%s %s # mean %.5f se %.5f reference %.5f z %.1f", what,
           same ? "is right" : "is caught", stat->mean, se, ref, z);
}

/* ---- The furnace: a sphere seen from inside, rho = 1/2, e = 1/5, a = 2/5 ------- */

static struct stam furnace_walks(imp_context *ctx, double rho, int depth)
{
    char xml[1024];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='stam'><integer name='max_depth' "
        "value='%d'/></integrator><sensor type='perspective'><float name='fov' "
        "value='60'/>"
        "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "
        "value='8'/><rfilter type='box'/></film></sensor><bsdf type='stam_m3' id='walls'>"
        "<float name='ambient' value='.2'/><float name='diffuse' value='%g'/>"
        "<float name='absorb' value='.4'/></bsdf><shape type='sphere'>"
        "<boolean name='flip_normals' value='true'/><ref id='walls'/></shape></scene>",
        depth, rho);
    return stam_walks(ctx, test_scene_text(ctx, xml, IMP_MONO), 3);
}

struct furnace {
    struct tap_stat L, g_rho, g_e;
};

static struct furnace furnace(imp_context *ctx, double rho, int depth,
                              enum mistake mistake)
{
    struct stam s = furnace_walks(ctx, rho, depth);
    struct furnace r;
    memset(&r, 0, sizeof r);
    for (int64_t k = 0; k < 100000; k++) {
        double g[N_CONTROLS];
        const struct imp_arena_mark mark = imp__arena_mark(&s.arena);
        const struct imp_walk w = stam_trace(&s, (int)(k & 7), (int)(k >> 3 & 7), k);
        tap_add(&r.L, planted(&s, &w, mistake, g));
        tap_add(&r.g_rho, g[DIFFUSE3]);
        tap_add(&r.g_e, g[AMBIENT3]);
        imp__arena_rewind(&s.arena, mark);
    }
    stam_close(&s);
    return r;
}

static void furnaces(imp_context *ctx)
{
    struct furnace r = furnace(ctx, .5, 64, NONE);
    expect(true, &r.L, .4, 0, "furnace: L");
    expect(true, &r.g_rho, .8, 0, "furnace: dL/drho");
    expect(true, &r.g_e, 2, 0, "furnace: dL/de");
    r = furnace(ctx, .5, 64, E22_NO_SURVIVAL);
    expect(true, &r.L, .4, 0, "E22, the picture shows nothing: L");
    expect(true, &r.g_rho, 4. / 7, 0, "E22: dL/drho, as predicted 4/7,");
    expect(false, &r.g_rho, .8, 0, "E22: dL/drho");
    r = furnace(ctx, .5, 64, E23_EMISSION_TWICE);
    expect(true, &r.g_e, 2. / 7, 0, "E23: dL/de, as predicted 2/7,");
    expect(false, &r.g_e, 2, 0, "E23: dL/de");
    static const struct {
        int depth;
        double right, printed;
    } cap[] = {{1, .2, .5}, {2, .3, .45}, {4, .375, .4125}};
    for (int k = 0; k < 3; k++) {
        char what[96];
        r = furnace(ctx, .5, cap[k].depth, NONE);
        snprintf(what, sizeof what, "depth %d: L", cap[k].depth);
        expect(true, &r.L, cap[k].right, 0, what);
        r = furnace(ctx, .5, cap[k].depth, E24_CUT_GLOWS);
        snprintf(what, sizeof what, "E24, depth %d: L, as predicted,", cap[k].depth);
        expect(true, &r.L, cap[k].printed, 0, what);
        snprintf(what, sizeof what, "E24, depth %d: L", cap[k].depth);
        expect(false, &r.L, cap[k].right, 0, what);
    }
    r = furnace(ctx, 0, 8, NONE);
    expect(true, &r.g_rho, .2, 0, "black walls: dL/drho");
    r = furnace(ctx, 0, 8, RELATIVE);
    tap_ok(r.g_rho.mean == 0, "df/f at rho = 0: dL/drho is caught # mean 0 truth 0.2");
}

/* ---- Stam's box against the table of 2.2 --------------------------------------- */

struct row {
    double value, se;
};
static const struct row table[1 + N_CONTROLS] = {
    {.149190, .000007}, {.019663, .000002},   {.869446, .000017},  {.129130, .000009},
    {.212496, .000016}, {.0003882, .0000003}, {1.116213, .000018}, {.253808, .000015}};
static const struct row table_paper[1 + N_CONTROLS] = {
    {.101409, .000013}, {.011562, .000003},  {.859354, .000054}, {.123374, .000025},
    {.049937, .000012}, {-.000189, .000001}, {.880400, .000051}, {.189464, .000043}};

/* Mean over the picture of L (first) and of the derivatives; of the library's own sweep
 * where `mistake` is -1. */
static void box(imp_context *ctx, const char *defines, int mistake, int spp,
                struct tap_stat stat[1 + N_CONTROLS])
{
    struct stam s = stam_walks(ctx, test_scene(ctx, "stam.xml", IMP_MONO, defines), 8);
    memset(stat, 0, (1 + N_CONTROLS) * sizeof *stat);
    for (int64_t k = 0; k < 1024 * (int64_t)spp; k++) {
        double g[N_CONTROLS];
        const struct imp_arena_mark mark = imp__arena_mark(&s.arena);
        const struct imp_walk w =
            stam_trace(&s, (int)(k & 31), (int)(k >> 5 & 31), k >> 10);
        double L = w.L[0];
        if (mistake < 0) stam_gradient(&s, &w, 1, g);
        else L = planted(&s, &w, (enum mistake)mistake, g);
        tap_add(&stat[0], L);
        for (int c = 0; c < N_CONTROLS; c++) tap_add(&stat[c + 1], g[c]);
        imp__arena_rewind(&s.arena, mark);
    }
    stam_close(&s);
}

/* A table of z. At least one of the `caught` entries (a bit each) must be beyond doubt,
 * all others right. */
static void report(const char *what, const struct tap_stat *stat, const struct row *ref,
                   int n, unsigned caught)
{
    bool right = true, hit = caught == 0;
    for (int k = 0; k < n; k++) {
        const double se = hypot(tap_se(&stat[k]), ref[k].se);
        const double z = (stat[k].mean - ref[k].value) / se;
        const int control = k + N_CONTROLS - n;
        printf("#   %-22s mean %10.6f se %.6f truth %10.6f z %7.1f\n",
               control < 0 ? "L" : control_name[control], stat[k].mean, se, ref[k].value,
               z);
        if (caught >> k & 1) hit |= fabs(z) > CAUGHT;
        else right &= fabs(z) <= 4;
    }
    tap_ok(right && hit, "%s: %s", what,
           caught ? "the truth catches it, and nothing else is off" : "the truth");
}

static void boxes(imp_context *ctx)
{
    struct tap_stat stat[1 + N_CONTROLS];
    const unsigned all = 0xfe, alpha = 1u << (EXPONENT + 1);
    box(ctx, "", NONE, 128, stat);
    report("no mistake", stat, table, 1 + N_CONTROLS, 0);
    box(ctx, "", E22_NO_SURVIVAL, 128, stat);
    report("E22", stat, table, 1 + N_CONTROLS, all);
    box(ctx, "", DRAWN_DENSITY, 128, stat);
    report("density of the drawn lobe", stat, table, 1 + N_CONTROLS, 1 | all);
    box(ctx, "alpha_gradient=paper", -1, 512, stat);
    report("E9, D without the sine", stat, table, 1 + N_CONTROLS, alpha);
    box(ctx, "variant=paper", -1, 512, stat);
    report("D with the sine, detached", stat, table_paper, 1 + N_CONTROLS, 0);
    box(ctx, "variant=paper alpha_gradient=paper", -1, 512, stat);
    report("E9, D with the sine", stat, table_paper, 1 + N_CONTROLS, alpha);
}

/* ---- E25: the loss of 16 x 16 pixels against T = 0.12, N walks a pixel (2.3 T5) ---- */

enum estimator { PRINTED, PER_SAMPLE, SAME, LEAVE_ONE_OUT, N_ESTIMATORS };
static const char *const estimator_name[] = {"as printed", "cost of every sample",
                                             "same samples", "leave-one-out"};

/* One pixel's dJ/dtheta from n values and derivatives. */
static double pixel(enum estimator e, int n, const double *L, const double *x, double T)
{
    double S = 0, g = 0;
    for (int i = 0; i < n; i++) S += L[i];
    for (int i = 0; i < n; i++) {
        const double mean = e == PRINTED      ? L[i] / n
                            : e == PER_SAMPLE ? L[i]
                            : e == SAME       ? S / n
                                              : (S - L[i]) / (n - 1);
        g += (mean - T) * x[i] / n;
    }
    return g;
}

/* L = theta X, X ~ Exp(1), theta = 1.3, T = 1: the truth is 0.3. */
static void scalar(void)
{
    static const struct {
        int n, repeats;
        double expected[N_ESTIMATORS], sd;
    } row[] = {{4, 200000, {-.35, 1.6, .625, .3}, .960},
               {16, 100000, {-.8375, 1.6, .38125, .3}, .417},
               {256, 10000, {-.98984, 1.6, .30508, .3}, .1003}};
    for (int r = 0; r < 3; r++) {
        struct tap_stat stat[N_ESTIMATORS] = {{0}};
        double L[256], x[256];
        for (int k = 0; k < row[r].repeats; k++) {
            for (int i = 0; i < row[r].n; i++) {
                x[i] = -log1p(
                    -imp__u01(imp__key(25, (uint64_t)k, (uint64_t)r), (uint32_t)i));
                L[i] = 1.3 * x[i];
            }
            for (int e = 0; e < N_ESTIMATORS; e++)
                tap_add(&stat[e], pixel((enum estimator)e, row[r].n, L, x, 1));
        }
        for (int e = 0; e < N_ESTIMATORS; e++) {
            char what[96];
            snprintf(what, sizeof what, "E25, one number, N = %d: %s", row[r].n,
                     estimator_name[e]);
            tap_z(&stat[e], row[r].expected[e], .02, what);
        }
        const double sd = tap_se(&stat[LEAVE_ONE_OUT]) * sqrt(row[r].repeats);
        tap_near(sd, row[r].sd, .04, 0, "its standard deviation");
    }
}

static void loss(imp_context *ctx, int n, int repeats)
{
    static const struct row truth[N_CONTROLS] = {
        {1.641, .001},  {9.022, .005}, {4.324, .004}, {21.40, .02},
        {.0950, .0001}, {5.036, .005}, {1.716, .002}};
    struct stam s = stam_walks(ctx, test_scene(ctx, "stam.xml", IMP_MONO, "res=16"), 30);
    struct tap_stat stat[N_ESTIMATORS][N_CONTROLS] = {{{0}}};
    double L[64], x[N_CONTROLS][64];
    for (int r = 0; r < repeats; r++) {
        double sum[N_ESTIMATORS][N_CONTROLS] = {{0}};
        for (int p = 0; p < 256; p++) {
            for (int i = 0; i < n; i++) {
                double g[N_CONTROLS];
                const struct imp_arena_mark mark = imp__arena_mark(&s.arena);
                const struct imp_walk w =
                    stam_trace(&s, p & 15, p >> 4, (int64_t)r * n + i);
                L[i] = planted(&s, &w, NONE, g);
                for (int c = 0; c < N_CONTROLS; c++) x[c][i] = g[c];
                imp__arena_rewind(&s.arena, mark);
            }
            for (int e = 0; e < N_ESTIMATORS; e++)
                for (int c = 0; c < N_CONTROLS; c++)
                    sum[e][c] += pixel((enum estimator)e, n, L, x[c], .12);
        }
        for (int e = 0; e < N_ESTIMATORS; e++)
            for (int c = 0; c < N_CONTROLS; c++) tap_add(&stat[e][c], sum[e][c]);
    }
    for (int e = 0; e < N_ESTIMATORS; e++) {
        char what[96];
        snprintf(what, sizeof what, "E25, box, N = %d: %s", n, estimator_name[e]);
        report(what, stat[e], truth, N_CONTROLS, e == LEAVE_ONE_OUT ? 0 : 0x7f);
    }
    if (n == 8) { /* 13.58 and 12.39 */
        expect(true, &stat[SAME][DIFFUSE2], 13.58, .05,
               "E25: same samples, theta_3, as wrong as tabled,");
        expect(true, &stat[SAME][DIFFUSE3], 12.39, .05,
               "E25: same samples, theta_7, as wrong as tabled,");
    }
    stam_close(&s);
}

/* Two renders (form D of 5.3): the adjoint image must not come from the gradient's seed.
 */
static void seeds(imp_context *ctx)
{
    static const struct row truth[2] = {{4.324, .004}, {1.716, .002}};
    static const struct row same[2] = {{13.58, .05}, {12.39, .05}};
    static const int control[2] = {DIFFUSE2, DIFFUSE3};
    imp_scene *scene = test_scene(ctx, "stam.xml", IMP_MONO, "res=16");
    imp_problem *p = test_problem(ctx, scene, "*");
    struct tap_stat stat[2][2];
    memset(stat, 0, sizeof stat);
    for (uint64_t r = 0; r < 300; r++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film;
        float adjoint[256];
        double g[N_CONTROLS];
        run.spp = 8;
        run.seed = 2 * r;
        run.points = IMP_POINTS_INDEPENDENT; /* so are those of the table */
        test_must(ctx, imp_render(scene, &run, &film));
        for (int k = 0; k < 256; k++) adjoint[k] = imp_film_mean(film)[k] - .12f;
        imp_film_destroy(film);
        for (int other = 0; other < 2; other++) {
            run.seed = 2 * r + (uint64_t)other;
            test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
            for (int c = 0; c < 2; c++)
                tap_add(&stat[other][c],
                        g[test_variable(p, scene, ctx, control_name[control[c]])]);
        }
    }
    for (int c = 0; c < 2; c++) {
        char what[96];
        snprintf(what, sizeof what, "adjoint image of another seed: %s",
                 control_name[control[c]]);
        expect(true, &stat[1][c], truth[c].value, truth[c].se, what);
        snprintf(what, sizeof what, "adjoint image of the same seed: %s",
                 control_name[control[c]]);
        expect(false, &stat[0][c], truth[c].value, truth[c].se, what);
        expect(true, &stat[0][c], same[c].value, same[c].se,
               "as wrong as same samples are");
    }
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    furnaces(ctx);
    boxes(ctx);
    scalar();
    loss(ctx, 8, 300);
    seeds(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
