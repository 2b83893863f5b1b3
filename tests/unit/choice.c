/* SPDX-License-Identifier: Apache-2.0
 *
 * Choices of things and of how much of each (search/choice.h): drawn at random, against all sets
 * tried one by one. With linear rows the levels of a set are found by all corners of its
 * polyhedron, with the square roots and squares of noisy rows by nested searches. */
#include "search/choice.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/vec.h"
#include "search/simplex.h"
#include <math.h>
#include <string.h>

enum { MOST = 6, ROWS = 5, CASES = 400, CURVED = 150, PROGRAMS = 300 };

static imp_context *ctx;

struct drawn {
    struct imp__choice c;
    struct imp__choice_row row[ROWS];
    double price[MOST], fixed[MOST], least[MOST], most[MOST];
    double a[ROWS][MOST], v[ROWS][MOST], q[ROWS][MOST];
    size_t place[MOST];
    bool needed[MOST];
};

static double draw(uint64_t seed, uint32_t *dim, double lo, double hi)
{
    return lo + (hi - lo) * imp__u01(imp__key(seed, 0, 0), (*dim)++);
}

static void choice_draw(struct drawn *d, uint64_t seed, size_t n, bool curved)
{
    uint32_t k = 0;
    const size_t places = 1 + (size_t)draw(seed, &k, 0, (double)n - 1e-9);
    const bool costs = draw(seed, &k, 0, 1) < 0.5;
    memset(d, 0, sizeof *d);
    for (size_t j = 0; j < n; j++) {
        d->price[j] = floor(draw(seed, &k, 1, 6)); /* ties */
        d->fixed[j] = costs ? floor(draw(seed, &k, 0, 4)) : 0;
        d->most[j] = 1;
        d->least[j] = draw(seed, &k, 0.05, 0.8);
        d->place[j] = j % places;
        if (j < places) d->needed[j] = draw(seed, &k, 0, 1) < 0.3;
    }
    for (size_t r = 0; r < ROWS; r++) {
        const bool upper = r == ROWS - 1; /* no more than */
        const double part = draw(seed, &k, 0.1, curved ? 0.4 : 0.5);
        double all = 0;
        for (size_t j = 0; j < n; j++) {
            d->a[r][j] = draw(seed, &k, 0, 1) < 0.8 ? draw(seed, &k, 0, 1) : 0;
            all += d->a[r][j];
            d->v[r][j] = curved ? imp__sqr(draw(seed, &k, 0, 0.03)) : 0;
            d->q[r][j] = curved && upper ? draw(seed, &k, 0, 0.4) : 0;
        }
        for (size_t j = 0; j < n && upper; j++) d->a[r][j] *= -1;
        d->row[r] = (struct imp__choice_row){.b = upper ? 0.9 * all : -part * all,
                                             .a = d->a[r],
                                             .z = curved ? 2 : 0,
                                             .v0 = curved ? 1e-4 : 0,
                                             .v = curved ? d->v[r] : NULL,
                                             .q = curved && upper ? d->q[r] : NULL};
    }
    d->c = (struct imp__choice){.ctx = ctx,
                                .n = n,
                                .price = d->price,
                                .fixed = d->fixed,
                                .least = d->least,
                                .most = d->most,
                                .place = d->place,
                                .n_places = places,
                                .needed = d->needed,
                                .n_rows = ROWS,
                                .rows = d->row,
                                .nodes = 100000};
}

static bool allowed(const struct drawn *d, unsigned set)
{
    size_t of[MOST] = {0};
    for (size_t j = 0; j < d->c.n; j++)
        if (set >> j & 1) of[d->place[j]]++;
    for (size_t p = 0; p < d->c.n_places; p++)
        if (of[p] > 1 || (d->needed[p] && of[p] == 0)) return false;
    return true;
}

static double worst_row(const struct drawn *d, const double *x)
{
    double worst = INFINITY;
    for (size_t r = 0; r < d->c.n_rows; r++)
        worst = fmin(worst, imp__choice_row_at(&d->row[r], d->c.n, x));
    return worst;
}

/* ---- Linear rows: all corners ------------------------------------------------------------ */

/* Solve A x = b of m equations by elimination with pivots; false: singular. */
static bool solve(size_t m, double (*A)[MOST + 1], double *x)
{
    for (size_t k = 0; k < m; k++) {
        size_t p = k;
        for (size_t i = k; i < m; i++)
            if (fabs(A[i][k]) > fabs(A[p][k])) p = i;
        if (fabs(A[p][k]) < 1e-10) return false;
        for (size_t j = 0; j <= m; j++) {
            const double swap = A[k][j];
            A[k][j] = A[p][j];
            A[p][j] = swap;
        }
        for (size_t i = 0; i < m; i++) {
            const double f = i == k ? 0 : A[i][k] / A[k][k];
            for (size_t j = k; j <= m; j++) A[i][j] -= f * A[k][j];
        }
    }
    for (size_t k = 0; k < m; k++) x[k] = A[k][m] / A[k][k];
    return true;
}

/* The least price of one set; INFINITY: it meets no row. */
static double corners(const struct drawn *d, unsigned set)
{
    size_t var[MOST], m = 0;
    double best = INFINITY, fixed = 0;
    for (size_t j = 0; j < d->c.n; j++)
        if (set >> j & 1) var[m++] = j, fixed += d->fixed[j];
    const size_t planes = ROWS + 2 * m;
    size_t pick[MOST] = {0};
    for (size_t k = 0; k < m; k++) pick[k] = k;
    for (;;) {
        double A[MOST][MOST + 1] = {{0}}, y[MOST] = {0}, x[MOST] = {0}, price = fixed;
        for (size_t i = 0; i < m; i++) {
            const size_t p = pick[i];
            if (p < ROWS) {
                for (size_t k = 0; k < m; k++) A[i][k] = d->a[p][var[k]];
                A[i][m] = -d->row[p].b;
            } else {
                const size_t k = (p - ROWS) / 2;
                A[i][k] = 1;
                A[i][m] = (p - ROWS) % 2 ? d->most[var[k]] : d->least[var[k]];
            }
        }
        bool good = solve(m, A, y);
        for (size_t k = 0; k < m && good; k++) {
            x[var[k]] = y[k];
            price += d->price[var[k]] * y[k];
            good = y[k] > d->least[var[k]] - 1e-9 && y[k] < d->most[var[k]] + 1e-9;
        }
        if (good && worst_row(d, x) > -1e-9) best = fmin(best, price);
        size_t i = m; /* the next choice of planes */
        while (i > 0 && pick[i - 1] == planes - m + i - 1) i--;
        if (i == 0) break;
        pick[i - 1]++;
        for (size_t k = i; k < m; k++) pick[k] = pick[k - 1] + 1;
    }
    return best;
}

/* ---- Curved rows: nested searches ----------------------------------------------------------- */

/* The least x[j] in its bounds with which all rows hold; NAN: none. The rows are concave, so those
 * that hold are an interval; its middle is found by the worst row's maximum. */
static double least_of(const struct drawn *d, double *x, size_t j)
{
    double lo = d->least[j], hi = d->most[j];
    const double ratio = (sqrt(5) - 1) / 2;
    for (int i = 0; i < 90; i++) {
        const double a = hi - ratio * (hi - lo), b = lo + ratio * (hi - lo);
        x[j] = a;
        const double at_a = worst_row(d, x);
        x[j] = b;
        if (at_a >= worst_row(d, x)) hi = b;
        else lo = a;
    }
    double good = 0.5 * (lo + hi), bad = d->least[j];
    x[j] = good;
    if (worst_row(d, x) < -1e-9) return NAN;
    x[j] = bad;
    if (worst_row(d, x) >= 0) return bad;
    for (int i = 0; i < 60; i++) {
        x[j] = 0.5 * (good + bad);
        if (worst_row(d, x) >= 0) good = x[j];
        else bad = x[j];
    }
    return good;
}

static double nested(const struct drawn *d, unsigned set)
{
    size_t var[2] = {0, 0}, m = 0;
    double x[MOST] = {0}, fixed = 0, best = INFINITY;
    for (size_t j = 0; j < d->c.n; j++)
        if (set >> j & 1) var[m++] = j, fixed += d->fixed[j];
    if (m == 0) return worst_row(d, x) >= 0 ? 0 : INFINITY;
    if (m == 1) {
        const double y = least_of(d, x, var[0]);
        return isnan(y) ? INFINITY : fixed + d->price[var[0]] * y;
    }
    double lo = d->least[var[0]], hi = d->most[var[0]];
    for (int zoom = 0; zoom < 14; zoom++) { /* the price is convex along x[var[0]] */
        const double from = lo, step = (hi - lo) / 40;
        double at = NAN, here = INFINITY;
        for (int i = 0; i <= 40; i++) {
            x[var[0]] = from + i * step;
            const double y = least_of(d, x, var[1]);
            const double price =
                fixed + d->price[var[0]] * (from + i * step) + d->price[var[1]] * y;
            if (isnan(y) || !(price < here)) continue;
            here = price;
            best = fmin(best, price);
            at = from + i * step;
        }
        if (isnan(at)) break;
        lo = fmax(from, at - 2 * step);
        hi = fmin(hi, at + 2 * step);
    }
    return best;
}

/* ---- Comparisons ------------------------------------------------------------------------------- */

static struct imp__choice_answer answer_of(const struct drawn *d, double *x, bool *used,
                                           double *dual)
{
    struct imp__choice_answer a = {.x = x, .used = used, .dual = dual};
    test_must(ctx, imp__choose(&d->c, &a));
    return a;
}

/* Is what is said to be an answer one? */
static bool is_answer(const struct drawn *d, const struct imp__choice_answer *a)
{
    unsigned set = 0;
    double price = 0;
    for (size_t j = 0; j < d->c.n; j++) {
        set |= (unsigned)a->used[j] << j;
        if (a->used[j] ? a->x[j] < d->least[j] - 1e-9 || a->x[j] > d->most[j] + 1e-9
                       : a->x[j] != 0)
            return false;
        price += d->price[j] * a->x[j] + (a->used[j] ? d->fixed[j] : 0);
    }
    return allowed(d, set) && worst_row(d, a->x) > -2e-7 && fabs(price - a->price) < 1e-9;
}

static void compare_all(const char *what, int cases, bool curved)
{
    int wrong = 0, none = 0, unproven = 0, false_answers = 0;
    double most = 0;
    for (int i = 0; i < cases; i++) {
        static struct drawn d;
        double x[MOST], dual[ROWS], best = INFINITY;
        bool used[MOST];
        const size_t n = curved ? 2 : 2 + (size_t)(i % (MOST - 1));
        choice_draw(&d, (uint64_t)i + (curved ? 10000 : 0), n, curved);
        for (unsigned set = 0; set < 1u << n; set++)
            if (allowed(&d, set))
                best = fmin(best, curved ? nested(&d, set) : corners(&d, set));
        const struct imp__choice_answer a = answer_of(&d, x, used, dual);
        unproven += !a.proven;
        none += !a.found;
        false_answers += a.found && !is_answer(&d, &a);
        if (a.found != isfinite(best)) wrong++;
        else if (a.found) {
            const double off = fabs(a.price - best);
            most = fmax(most, off);
            wrong += off > (curved ? 2e-5 : 1e-6);
        }
    }
    tap_ok(
        wrong == 0 && unproven == 0 && false_answers == 0 && none > cases / 50 &&
            none < 2 * cases / 3,
        "%s # %d drawn, %d without an answer, %d differ from all sets (at most %.1e), %d "
        "unproven, %d no answers",
        what, cases, none, wrong, most, unproven, false_answers);
}

/* Sets left out one by one come in the order of their prices. */
static void test_next(void)
{
    int wrong = 0, compared = 0;
    for (int i = 0; i < 60; i++) {
        static struct drawn d;
        bool used[4][MOST];
        const bool *without[4];
        double x[MOST], dual[ROWS], last = -INFINITY;
        choice_draw(&d, 20000 + (uint64_t)i, 5, false);
        double prices[64];
        size_t n = 0;
        for (unsigned set = 0; set < 32; set++) {
            const double p = allowed(&d, set) ? corners(&d, set) : INFINITY;
            if (isfinite(p)) prices[n++] = p;
        }
        for (size_t a = 0; a < n; a++)
            for (size_t b = a + 1; b < n; b++)
                if (prices[b] < prices[a]) {
                    const double swap = prices[a];
                    prices[a] = prices[b];
                    prices[b] = swap;
                }
        for (size_t k = 0; k < 4; k++) {
            without[k] = used[k];
            d.c.not_these = without;
            d.c.n_not = k;
            const struct imp__choice_answer a = answer_of(&d, x, used[k], dual);
            wrong += a.found != (k < n) || !a.proven;
            if (!a.found) break;
            compared++;
            wrong += fabs(a.price - prices[k]) > 1e-6 || a.price < last - 1e-9;
            last = a.price;
        }
    }
    tap_ok(wrong == 0 && compared > 60, "the next best sets # %d compared, %d wrong",
           compared, wrong);
}

/* Prices of rows are derivatives, where the set stays. */
static void test_duals(void)
{
    int wrong = 0, compared = 0;
    for (int i = 0; i < 80; i++) {
        static struct drawn d;
        double x[MOST], dual[ROWS], other[ROWS];
        bool used[MOST];
        choice_draw(&d, 30000 + (uint64_t)i, 4, i % 2);
        const struct imp__choice_answer a = answer_of(&d, x, used, dual);
        for (size_t r = 0; a.found && r < ROWS; r++) {
            const double h = 1e-4;
            double price[2];
            bool same = true;
            for (int s = 0; s < 2; s++) {
                bool now[MOST];
                d.row[r].b += s ? h : -h;
                const struct imp__choice_answer b = answer_of(&d, x, now, other);
                d.row[r].b -= s ? h : -h;
                same &= b.found;
                for (size_t j = 0; j < d.c.n && same; j++) same = now[j] == used[j];
                price[s] = b.price;
            }
            /* At a corner of several rows the derivatives of both sides differ. */
            const double down = (price[0] - a.price) / h, up = (a.price - price[1]) / h;
            if (!same || fabs(down - up) > 1e-3 * (1 + fabs(up))) continue;
            compared++;
            wrong += fabs(dual[r] - 0.5 * (down + up)) > 5e-3 * (1 + fabs(up));
        }
    }
    tap_ok(wrong == 0 && compared > 100, "prices of rows # %d compared, %d wrong",
           compared, wrong);
}

/* Programs whose rows come one by one, and whose bounds move, against those of one piece. */
static void test_programs(void)
{
    int wrong = 0, infeasible = 0, left_out = 0;
    for (int i = 0; i < PROGRAMS; i++) {
        enum { N = 8, M = 30 };
        struct imp__lp one, many;
        double cost[N], lo[N], hi[N], a[M][N], b[M];
        uint32_t k = 0;
        const uint64_t seed = 40000 + (uint64_t)i;
        enum imp__lp_end end, other = IMP_LP_INFEASIBLE;
        for (size_t j = 0; j < N; j++) {
            cost[j] = floor(draw(seed, &k, 0, 3)); /* degenerate */
            lo[j] = 0;
            hi[j] = 1;
        }
        for (size_t r = 0; r < M; r++) {
            b[r] = -draw(seed, &k, -0.5, 1);
            for (size_t j = 0; j < N; j++) a[r][j] = floor(draw(seed, &k, -1, 3));
        }
        test_must(ctx, imp__lp_create(ctx, N, cost, lo, hi, &one));
        test_must(ctx, imp__lp_create(ctx, N, cost, lo, hi, &many));
        for (size_t r = 0; r < M; r++) {
            test_must(ctx, imp__lp_add(&one, a[r], b[r], 0));
            test_must(ctx, imp__lp_add(&many, a[r], b[r], 0));
            many.lo[r % N] = many.hi[r % N] = 0.5;
            test_must(ctx, imp__lp_solve(&many, &other));
            many.lo[r % N] = 0, many.hi[r % N] = 1;
            test_must(ctx, imp__lp_solve(&many, &other));
            if (r % 7 != 3 || other == IMP_LP_INFEASIBLE) continue;
            test_must(ctx,
                      imp__lp_purge(&many, 2, 1e-3)); /* and back come those needed */
            for (size_t q = 0; q <= r && other == IMP_LP_OPTIMAL; q++) {
                double g = b[q];
                for (size_t j = 0; j < N; j++) g += a[q][j] * many.x[j];
                left_out += g > 1e-3;
            }
        }
        for (size_t q = 0; q < M && other == IMP_LP_OPTIMAL; q++) {
            double g = b[q];
            for (size_t j = 0; j < N; j++) g += a[q][j] * many.x[j];
            if (g > -1e-9) continue;
            test_must(ctx, imp__lp_add(&many, a[q], b[q], 0));
            test_must(ctx, imp__lp_solve(&many, &other));
            q = SIZE_MAX; /* from the first */
        }
        test_must(ctx, imp__lp_solve(&one, &end));
        infeasible += end == IMP_LP_INFEASIBLE;
        if (end != other) wrong++;
        else if (end == IMP_LP_OPTIMAL) {
            double under = 0, dual = 0;
            for (size_t r = 0; r < M; r++) {
                double g = b[r];
                for (size_t j = 0; j < N; j++) g += a[r][j] * one.x[j];
                under = fmin(under, g);
                dual -= one.dual[r] * b[r];
            }
            for (size_t j = 0; j < N; j++) { /* the dual objective: bounds are 0 and 1 */
                double r = cost[j];
                for (size_t q = 0; q < M; q++) r -= one.dual[q] * a[q][j];
                dual += fmin(r, 0);
            }
            wrong += fabs(one.objective - many.objective) > 1e-8 || under < -1e-8 ||
                     fabs(dual - one.objective) > 1e-8;
        }
        imp__lp_destroy(&one);
        imp__lp_destroy(&many);
    }
    tap_ok(
        wrong == 0 && infeasible > 30 && infeasible < PROGRAMS - 100 && left_out > 100,
        "linear programs: duality, rows one by one # %d drawn, %d infeasible, %d wrong",
        PROGRAMS, infeasible, wrong);
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    test_programs();
    compare_all("linear rows", CASES, false);
    compare_all("rows with errors and squares", CURVED, true);
    test_next();
    test_duals();
    imp_context_destroy(ctx);
    return tap_done();
}
