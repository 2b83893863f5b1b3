/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of sets: every pair is a net, also after its shifts; numbers are uniform, and
 * those of different pairs, blocks and sets are not correlated. The samples of a pixel are cut
 * into sets that no other shares. */
#include "math/points.h"
#include "imp_tap.h"
#include "walk/core/walk.h"
#include <stdbool.h>
#include <stdlib.h>

static struct imp_point_table table;

static struct imp_point point(int set, int index)
{
    return (struct imp_point){&table, imp__key(7, (uint64_t)set, 1).state,
                              (uint32_t)index};
}

/* The first 2^m points have one in each rectangle of sides 2^-a and 2^(a-m). */
static bool is_net(int set, int block, int pair, int m)
{
    for (int a = 0; a <= m; a++) {
        uint64_t taken = 0;
        for (int i = 0; i < 1 << m; i++) {
            const struct imp_point p = point(set, i);
            const double u = imp__point_number(p, (uint32_t)block, 2 * pair);
            const double v = imp__point_number(p, (uint32_t)block, 2 * pair + 1);
            const int cell = (int)ldexp(u, a) << (m - a) | (int)ldexp(v, m - a);
            taken |= 1ull << cell;
        }
        if (taken != (m == 6 ? ~0ull : (1ull << (1 << m)) - 1)) return false;
    }
    return true;
}

static void nets(void)
{
    bool fine = true;
    for (int set = 0; set < 200; set++)
        for (int block = 0; block < 5; block++)
            for (int pair = 0; pair < 4; pair++)
                for (int m = 0; m <= 6; m++) fine &= is_net(set, block, pair, m);
    tap_ok(fine, "the first 1, 2, 4 ... 64 points of a set are nets in every pair");
}

/* Numbers of one point over many sets: uniform, and without correlation. */
static void independence(void)
{
    enum { SETS = 40000, N = 12, CELLS = 16 };
    static double u[SETS][N];
    double worst_cell = 0, worst_pair = 0;
    for (int s = 0; s < SETS; s++) {
        for (int k = 0; k < 8; k++) u[s][k] = imp__point_number(point(s, 5), 1, k);
        u[s][8] = imp__point_number(point(s, 5), 2, 0);
        u[s][9] = imp__point_number(point(s, 5), 0, 0);
        u[s][10] = imp__point_number(point(s + 1, 5), 1, 0);
        u[s][11] = imp__point_number(point(s + 1, 6), 1, 3);
    }
    for (int k = 0; k < N; k++) {
        double count[CELLS] = {0}, chi2 = 0;
        for (int s = 0; s < SETS; s++) count[(int)(CELLS * u[s][k])]++;
        for (int c = 0; c < CELLS; c++)
            chi2 += pow(count[c] - SETS / (double)CELLS, 2) / (SETS / (double)CELLS);
        /* chi-square of 15 degrees of freedom */
        worst_cell = fmax(worst_cell, (chi2 - 15) / sqrt(30));
        for (int j = 0; j < k; j++) {
            double sum = 0;
            for (int s = 0; s < SETS; s++) sum += (u[s][k] - .5) * (u[s][j] - .5) * 12;
            worst_pair = fmax(worst_pair, fabs(sum) / sqrt(SETS));
        }
    }
    tap_ok(worst_cell < 5, "numbers are uniform # worst %.2f sigma", worst_cell);
    tap_ok(worst_pair < 4.5, "and not correlated # worst %.2f sigma", worst_pair);
}

/* Where a product has its mean: of two numbers of one set of 64, over pairs that are no
 * net together, as independent numbers have it on the average of sets. */
static void products(void)
{
    struct tap_stat s = {0};
    for (int set = 0; set < 20000; set++) {
        double sum = 0;
        for (int i = 0; i < IMP_SET_POINTS; i++)
            sum += imp__point_number(point(set, i), 1, 1) *
                   imp__point_number(point(set, i), 3, 4) / IMP_SET_POINTS;
        tap_add(&s, sum);
    }
    tap_z(&s, .25, 1e-3, "a mean of products over two blocks");
}

/* Samples of pixels of n samples: sets of up to 64, at least four from four samples on, of sizes
 * that differ by one at most, with the numbers 64 s, 64 s + 1, ... */
static void numbers(void)
{
    const struct imp_film_desc film = {.crop_w = 9, .crop_h = 7};
    const struct imp_sensor sensor = {.film = film};
    const struct imp_tracer tracer = {.sensor = &sensor, .points = &table};
    bool fine = true;
    int64_t fewest = INT64_MAX;
    for (int64_t n = 1; n < 1100; n++) {
        const int set = imp__tracer_set(&tracer, n);
        int64_t sets = 0, least = n, most = 0;
        for (int64_t k = 0; k < n;) {
            int64_t first, size;
            imp__set_at(set, n, k, &first, &size);
            fine &= first == k && size >= 1 && size <= IMP_SET_POINTS;
            for (int64_t i = 0; i < size; i++)
                fine &= imp__set_number(set, n, k + i) == IMP_SET_POINTS * sets + i;
            least = imp_min(least, size);
            most = imp_max(most, size);
            k += imp_max(size, (int64_t)1);
            sets++;
        }
        fine &= most - least <= 1;
        if (n >= 4) fewest = imp_min(fewest, sets);
    }
    for (int64_t k = 0; k < 100; k++)
        fine &= imp__set_number(4, 0, k) == IMP_SET_POINTS * (k / 4) + k % 4;
    tap_ok(fine && fewest == 4, "samples of a pixel in sets # %d or more", (int)fewest);
}

int main(void)
{
    imp__points_make(&table);
    nets();
    independence();
    products();
    numbers();
    return tap_done();
}
