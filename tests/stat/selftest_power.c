/* SPDX-License-Identifier: Apache-2.0
 *
 * What drawing rows of imp_selftest say that they would have seen: the noncentrality of a
 * chi-square against a simulation, and densities that are off by just that much. A BSDF and a
 * phase function whose densities are off by 5 % in what integrates to 1 all the same are seen. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/stat.h"
#include "scene/scene.h"
#include <math.h>

#define SEEDS 40

static imp_context *ctx;

/* ---- Chi-square ----------------------------------------------------------------------- */

static void power(double k, double level)
{
    const double lambda = imp__chi2_seen(level, k, 0.95);
    double found = 0;
    const int n = 20000;
    for (int i = 0; i < n; i++) {
        double sum = 0;
        for (int j = 0; j < (int)k; j++) {
            const double x =
                imp__normal_quantile(imp__u01(imp__key(7, (uint64_t)i, (uint64_t)j), 0)) +
                (j == 0 ? sqrt(lambda) : 0);
            sum += x * x;
        }
        found += imp__chi2_tail(sum, k) < level;
    }
    const double part = found / n, se = sqrt(0.95 * 0.05 / n);
    tap_ok(fabs(part - 0.95) < 4 * se,
           "chi-square of %g degrees, level %g: noncentrality %.4g is seen in .95 # %.4f "
           "+- %.4f",
           k, level, lambda, part, se);
}

/* ---- Densities that are off --------------------------------------------------------------- */

static const struct imp_bsdf_ops *right;
static const struct imp_phase_ops *right_phase;
static double by;
static double tilt(const struct imp_dirs *d)
{
    return 1 + (d->wi[0] * d->wi[1] > 0 ? by : -by);
}
/* Quarters about z, at the borders of which cells end, are drawn more or less often than is
 * claimed. */
static double tilted(const struct imp_bsdf *b, const imp_spec *in,
                     const struct imp_dirs *d)
{
    return right->pdf(b, in, d) * tilt(d);
}
static double tilted_phase(const struct imp_phase *p, const imp_spec *in,
                           const struct imp_dirs *d)
{
    return right_phase->pdf(p, in, d) * tilt(d);
}

struct said {
    int draws, others; /* rows that failed */
    bool open;
    double sees;
};
static struct said test(imp_scene *s, enum imp_selftest_subject subject, int samples,
                        int directions, uint64_t seed)
{
    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    const struct imp_selftest_row *rows;
    size_t n = 0;
    struct said r = {0};
    o.samples = samples;
    o.directions = directions;
    o.seed = seed;
    test_must(ctx, imp_selftest(s, subject, &o, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        const bool draws = strcmp(rows[i].contract, "draws") == 0;
        if (draws) r.sees = rows[i].sees, r.open = rows[i].ok == IMP_VERDICT_OPEN;
        if (rows[i].ok == IMP_VERDICT_WRONG) *(draws ? &r.draws : &r.others) += 1;
    }
    return r;
}

static void kind(imp_scene *s, enum imp_selftest_subject subject, const char *what)
{
    by = 0;
    const struct said own = test(s, subject, 0, 0, 1);
    tap_ok(own.draws + own.others == 0 && own.sees > 0 && own.sees <= 0.02,
           "%s: right, and sees 2 %% # %.4f", what, own.sees);

    by = 0.05;
    const struct said off = test(s, subject, 0, 0, 1);
    tap_ok(off.draws == 1, "%s: a density that is 5 %% off is seen # others fail: %d",
           what, off.others);

    const struct said few = test(s, subject, 24000, 4, 1);
    tap_ok(few.sees > 0.02, "%s: few draws see less # %.4f", what, few.sees);
    by = few.sees;
    int seen = 0, alarms = 0, open = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++)
        seen += test(s, subject, 24000, 4, 100 * seed).draws;
    by = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        const struct said r = test(s, subject, 24000, 4, 100 * seed);
        alarms += r.draws;
        open += r.open;
    }
    /* Of 40, 38 +- 1.4, but for the largest and smallest of the cells. */
    tap_ok(seen >= SEEDS - 6, "%s: of what it says it sees, %d of %d are seen", what,
           seen, SEEDS);
    tap_ok(alarms <= 3 && open == SEEDS - alarms,
           "%s: with too few draws it does not decide # %d alarms, %d open", what, alarms,
           open);
}

int main(void)
{
    test_must(NULL, imp_context_create(NULL, &ctx));
    power(1, 0.01);
    power(12, 1e-3);
    power(150, 1e-4);
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version=\"3.0.0\"><integrator type=\"path\"/><sensor "
        "type=\"perspective\"/>"
        "<shape type=\"sphere\"><bsdf type=\"roughconductor\" id=\"metal\">"
        "<float name=\"alpha\" value=\"0.3\"/></bsdf></shape></scene>",
        IMP_RGB);
    struct imp_bsdf_ops wrong = *s->bsdfs[0]->ops;
    right = s->bsdfs[0]->ops;
    wrong.pdf = tilted;
    s->bsdfs[0]->ops = &wrong;
    kind(s, IMP_SELFTEST_MATERIAL, "a rough conductor");
    imp_scene_destroy(s);
    s = test_scene_text(
        ctx,
        "<scene version=\"3.0.0\"><integrator type=\"volpath\"/>"
        "<sensor type=\"perspective\"><transform name=\"to_world\">"
        "<translate z=\"-4\"/></transform></sensor>"
        "<shape type=\"sphere\"><bsdf type=\"null\"/>"
        "<medium type=\"homogeneous\" name=\"interior\"><phase type=\"hg\">"
        "<float name=\"g\" value=\"0.6\"/></phase></medium></shape></scene>",
        IMP_RGB);
    struct imp_phase *phase = (struct imp_phase *)(uintptr_t)s->media[0]->phase;
    struct imp_phase_ops wrong_phase = *phase->ops;
    right_phase = phase->ops;
    wrong_phase.pdf = tilted_phase;
    phase->ops = &wrong_phase;
    kind(s, IMP_SELFTEST_PHASE, "Henyey-Greenstein");
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
