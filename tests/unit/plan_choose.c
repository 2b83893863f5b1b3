/* SPDX-License-Identifier: Apache-2.0
 *
 * Plans of matrices drawn at random: sets that are chosen against the best of all sets, the
 * derivative of criteria against differences, the error of a gain against the spread of gains
 * with matrices that are moved by their errors, and directions that nothing determines. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/plan/planning.h"
#include "math/rng.h"
#include <math.h>

enum { N = 4, ITEMS = 8, TAKE = 3, CASES = 100 };

static imp_context *ctx;

static double normal(struct imp_key key, uint32_t k)
{
    const double u = 1 - imp__u01(key, 2 * k), v = imp__u01(key, 2 * k + 1);
    return sqrt(-2 * log(u)) * cos(6.283185307179586 * v);
}

struct items {
    struct imp__plan_data data[ITEMS];
    const struct imp__plan_data *at[ITEMS];
    double H[ITEMS][N * N], deviations[ITEMS][IMP_DEVIATIONS * N * N], cost[ITEMS];
};

/* Sums of two squares, with errors of a part `noise` of their largest entry. */
static void items_make(struct items *s, uint64_t seed, double noise)
{
    for (size_t i = 0; i < ITEMS; i++) {
        const struct imp_key key = imp__key(seed, 1, i);
        double most = 0;
        memset(s->H[i], 0, sizeof s->H[i]);
        memset(s->deviations[i], 0, sizeof s->deviations[i]);
        for (uint32_t r = 0; r < 2; r++) {
            const double size = exp(2 * imp__u01(key, 900 + r)) * 3;
            for (uint32_t k = 0; k < N; k++)
                for (uint32_t l = 0; l < N; l++)
                    s->H[i][k * N + l] +=
                        size * normal(key, r * N + k) * normal(key, r * N + l);
        }
        for (size_t k = 0; k < N; k++) most = fmax(most, s->H[i][k * N + k]);
        for (uint32_t g = 0; g < IMP_DEVIATIONS; g++)
            for (uint32_t k = 0; k < N; k++)
                for (uint32_t l = 0; l <= k; l++) {
                    double *D = s->deviations[i] + g * N * N;
                    D[k * N + l] = D[l * N + k] =
                        noise * most / sqrt(IMP_DEVIATIONS) *
                        normal(key, 100 + g * N * N + k * N + l);
                }
        s->data[i] = (struct imp__plan_data){s->H[i], s->deviations[i], 1};
        s->at[i] = &s->data[i];
        s->cost[i] = 1;
    }
}

static struct imp__plan_model model_of(enum imp_plan_criterion kind, size_t *of)
{
    for (size_t k = 0; k < N; k++) of[k] = k;
    return (struct imp__plan_model){ctx, N, kind, of, kind == IMP_PLAN_A ? 2 : N};
}

static double phi_of(const struct imp__plan_model *m, struct imp__plan_known *known,
                     const struct imp__plan_data *const *items, size_t n)
{
    test_must(ctx, imp__plan_evaluate(m, items, n, known));
    return known->phi;
}

/* The best of all sets of three. */
static double best_of_all(const struct imp__plan_model *m, struct imp__plan_known *known,
                          const struct items *s)
{
    double best = -INFINITY;
    for (size_t a = 0; a < ITEMS; a++)
        for (size_t b = a + 1; b < ITEMS; b++)
            for (size_t c = b + 1; c < ITEMS; c++) {
                const struct imp__plan_data *set[3] = {s->at[a], s->at[b], s->at[c]};
                best = fmax(best, phi_of(m, known, set, 3));
            }
    return best;
}

static void sets(enum imp_plan_criterion kind, const char *name)
{
    static struct items s;
    size_t of[N], chosen[ITEMS], n, same = 0;
    const struct imp__plan_model m = model_of(kind, of);
    struct imp__plan_known known;
    double least = 1;
    test_must(ctx, imp__plan_known_create(&m, &known));
    for (uint64_t k = 0; k < CASES; k++) {
        struct imp_estimate gain;
        items_make(&s, 10 + k, 0);
        const struct imp__plan_choice choice = {
            .model = &m, .items = s.at, .cost = s.cost, .n = ITEMS, .take = TAKE};
        const double zero = phi_of(&m, &known, s.at, 0);
        const double best = best_of_all(&m, &known, &s) - zero;
        test_must(ctx, imp__plan_choose(&choice, chosen, &n, &known, &gain));
        if (n != TAKE) least = 0;
        same += gain.value > best * (1 - 1e-9);
        least = fmin(least, gain.value / best);
    }
    tap_ok(same >= 90 && least > 0.9,
           "%s: sets of three # %zu of %d are the best, the worst has %.4f of its gain",
           name, same, CASES, least);
    imp__plan_known_destroy(ctx, &known);
}

/* pull against central differences of phi along every symmetric entry. */
static void derivative(enum imp_plan_criterion kind, const char *name)
{
    static struct items s;
    size_t of[N];
    const struct imp__plan_model m = model_of(kind, of);
    struct imp__plan_known known, moved;
    double worst = 0;
    items_make(&s, 3, 0);
    test_must(ctx, imp__plan_known_create(&m, &known));
    test_must(ctx, imp__plan_known_create(&m, &moved));
    phi_of(&m, &known, s.at, 3);
    for (size_t k = 0; k < N; k++)
        for (size_t l = 0; l <= k; l++) {
            double phi[2];
            for (int side = 0; side < 2; side++) {
                const double step = side ? 1e-5 : -1e-5;
                s.H[0][k * N + l] += step;
                if (l != k) s.H[0][l * N + k] += step;
                phi[side] = phi_of(&m, &moved, s.at, 3);
                s.H[0][k * N + l] -= step;
                if (l != k) s.H[0][l * N + k] -= step;
            }
            const double pull =
                known.pull[k * N + l] + (l != k ? known.pull[l * N + k] : 0);
            worst = fmax(worst, fabs((phi[1] - phi[0]) / 2e-5 - pull));
        }
    tap_near(worst, 0, 0, 1e-7, name);
    imp__plan_known_destroy(ctx, &known);
    imp__plan_known_destroy(ctx, &moved);
}

/* What the errors of matrices do to a gain, by moving them. */
static void error(void)
{
    static struct items s, moved;
    size_t of[N], chosen[ITEMS], n;
    const struct imp__plan_model m = model_of(IMP_PLAN_D, of);
    struct imp__plan_known known;
    struct imp_estimate gain;
    struct tap_stat spread = {0};
    test_must(ctx, imp__plan_known_create(&m, &known));
    items_make(&s, 5, 0.002);
    const struct imp__plan_choice choice = {.model = &m,
                                            .have = s.at,
                                            .n_have = 2,
                                            .items = s.at + 2,
                                            .cost = s.cost,
                                            .n = 1,
                                            .take = 1};
    test_must(ctx, imp__plan_choose(&choice, chosen, &n, &known, &gain));
    for (uint64_t k = 0; k < 2000; k++) {
        items_make(&moved, 5, 0.002);
        for (size_t i = 0; i < 3; i++)
            for (uint32_t g = 0; g < IMP_DEVIATIONS; g++) {
                const double e = normal(imp__key(99, k, i), g);
                for (size_t q = 0; q < N * N; q++)
                    moved.H[i][q] += e * s.deviations[i][g * N * N + q];
            }
        const double before = phi_of(&m, &known, moved.at, 2);
        tap_add(&spread, phi_of(&m, &known, moved.at, 3) - before);
    }
    const double observed = sqrt(spread.m2 / (spread.n - 1));
    tap_ok(fabs(gain.se / observed - 1) < 0.15,
           "error of a gain # %.4f, spread of moved ones %.4f", gain.se, observed);
    imp__plan_known_destroy(ctx, &known);
}

/* A direction that no item sees, and one that a noisy item hides in the sum. */
static void loose(void)
{
    static struct items s;
    size_t of[N], n;
    const struct imp__plan_model m = model_of(IMP_PLAN_D, of);
    struct imp__plan_known known;
    double out[N * N];
    test_must(ctx, imp__plan_known_create(&m, &known));
    items_make(&s, 7, 0);
    for (size_t i = 0; i < ITEMS; i++)
        for (size_t k = 0; k < N; k++) s.H[i][3 * N + k] = s.H[i][k * N + 3] = 0;
    test_must(ctx, imp__plan_loose(&m, s.at, ITEMS, &known, out, &n));
    tap_ok(n == 1 && fabs(fabs(out[3]) - 1) < 1e-9, "what no item sees");
    memset(s.H[1], 0, sizeof s.H[1]);
    for (size_t k = 0; k < N; k++) s.H[0][k * N + k] += 1000;
    for (size_t k = 0; k < N; k++) s.deviations[1][k * N + k] = 1e4;
    test_must(ctx, imp__plan_loose(&m, s.at, 2, &known, out, &n));
    tap_ok(n == 0, "noise of one item does not hide what another sees");
    imp__plan_known_destroy(ctx, &known);
}

int main(void)
{
    ctx = test_context(1);
    sets(IMP_PLAN_D, "determinants");
    sets(IMP_PLAN_A, "traces of two numbers");
    derivative(IMP_PLAN_D, "derivative of the determinant");
    derivative(IMP_PLAN_A, "derivative of the trace");
    error();
    loose();
    imp_context_destroy(ctx);
    return tap_done();
}
