/* SPDX-License-Identifier: Apache-2.0
 *
 * The values of a tabulated phase function as parameters: radiance that a slab reflects and
 * transmits, and its derivatives, against adding and doubling; frozen, forward and reverse,
 * fresh seeds; only ratios count. */
#include "adding_doubling.h"
#include "media_kit.h"

static imp_context *ctx;

enum { N = 7 };
static const double usual[N] = {.5, .4, .3, .4, .7, 1.5, 3},
                    dark[N] = {.5, 0,   0, .4,
                               0,  1.5, 3}; /* neighbours of 0, and one alone */
static double value[N];

/* 4 pi p(c) */
static double table(double c, double g)
{
    double all = 0;
    (void)g;
    for (int k = 0; k < N; k++) all += value[k] * (k == 0 || k == N - 1 ? .5 : 1);
    const double x = (fmin(fmax(c, -1), 1) + 1) / 2 * (N - 1);
    const int i = (int)fmin(x, N - 2);
    return 2 * ((1 - (x - i)) * value[i] + (x - i) * value[i + 1]) / (all * 2 / (N - 1));
}

static double truth(int reflected)
{
    static struct ad_slab s;
    const double mu = 1;
    ad_make(&s, 1, .9, table, 0, 1, &mu);
    return ad_row(&s, reflected ? s.R : s.T, s.n - 1);
}

static imp_scene *slab(int reflected)
{
    char text[4096], values[256];
    int n = 0;
    for (int k = 0; k < N; k++)
        n += snprintf(values + n, sizeof values - (size_t)n, "%g ", value[k]);
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'/><medium "
             "type='homogeneous' id='fog'><float name='sigma_t' value='1'/><float "
             "name='albedo' value='0.9'/><phase type='tabphase' id='turn'><string "
             "name='values' value='%s'/></phase></medium>"
             "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/>"
             "<transform name='to_world'><scale x='3000' y='3000' z='0.5'/></transform>"
             "</shape><shape type='rectangle'><emitter type='area'><float "
             "name='radiance' value='1'/></emitter><transform name='to_world'><scale "
             "value='10000'/><rotate x='1' angle='%d'/><translate z='%d'/></transform>"
             "</shape><sensor type='orthographic'><transform name='to_world'><scale "
             "value='0.001'/><lookat origin='0,0,-0.8' target='0,0,1' up='0,1,0'/>"
             "</transform><film type='hdrfilm'><integer name='width' value='8'/><integer "
             "name='height' value='8'/><rfilter type='box'/></film></sensor></scene>",
             values, reflected ? 0 : 180, reflected ? -1 : 1);
    return test_scene_text(ctx, text, IMP_MONO);
}

static void derivatives(int reflected)
{
    imp_scene *s = slab(reflected);
    imp_problem *p = test_problem(ctx, s, "turn.value_*");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    double g[N], se[N], sum = 0, size = 0;
    run.spp = 2048;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, se));
    media_near(v.value, v.se, truth(reflected), .005,
               reflected ? "reflected" : "through");
    for (int k = 0; k < N; k++) {
        const double h = 1e-3, at = value[k];
        double d[2];
        const double low = at == 0 ? 0 : -h; /* one-sided at 0 */
        for (int i = 0; i < 2; i++) {
            value[k] = at + (i ? h : low);
            d[i] = truth(reflected);
        }
        value[k] = at;
        media_near(g[k], se[k] + (at == 0 ? 1e-4 : 0), (d[1] - d[0]) / (h - low),
                   at == 0 ? 5e-3 : 2e-3,
                   at == 0 ? "... by a value that is 0" : "... by a value");
        sum += g[k] * at;
        size += fabs(g[k] * at);
    }
    tap_ok(fabs(sum) < 1e-12 * size,
           "a factor of all values changes nothing # %.1e of %.1e", sum, size);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void checked(int fresh_spp)
{
    imp_scene *s = slab(1);
    imp_problem *p = test_problem(ctx, s, "turn.value_*");
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows;
    size_t n;
    int frozen = 0, fresh = 0, wrong = 0;
    o.draws_s = 0.02;
    o.paths = 400;
    o.fresh_spp = fresh_spp;
    test_must(ctx, imp_check(p, &o, NULL, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        frozen += strcmp(rows[k].method, "frozen") == 0;
        fresh += strcmp(rows[k].method, "fresh") == 0;
        if (rows[k].ok) continue;
        wrong++;
        printf("# %s %s %g, reference %g, error %g\n", rows[k].method, rows[k].param,
               rows[k].value, rows[k].reference, rows[k].error);
    }
    tap_ok(frozen >= N && fresh > 0 && wrong == 0,
           "%d rows of check, %d frozen, %d fresh, %d wrong", (int)n, frozen, fresh,
           wrong);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    ctx = test_context(0);
    for (int k = 0; k < 2; k++) {
        memcpy(value, k ? dark : usual, sizeof value);
        derivatives(1);
        if (is_long || !k) derivatives(0);
        if (is_long || k) checked(k ? 256 : 2048);
    }
    imp_context_destroy(ctx);
    return tap_done();
}
