/* SPDX-License-Identifier: Apache-2.0
 *
 * Variance of nets from their quarters (film_nets.h): which sample counts are whole nets, and the
 * factor of errors against its closed form, for quarters that are drawn with known variances. */
#include "film/film_nets.h"
#include "imp_tap.h"
#include <math.h>
#include <stdint.h>

enum { PIXELS = 400000 };

static double normal(uint64_t *state)
{
    double u[2];
    for (int k = 0; k < 2; k++) {
        *state = *state * 6364136223846793005u + 1442695040888963407u;
        u[k] = ((double)(*state >> 11) + .5) * 0x1p-53;
    }
    return sqrt(-2 * log(u[0])) * cos(6.283185307179586 * u[1]);
}

/* Quarters of a net whose variance is A/n^2 + B/n, at the size of the net 1: a common part of
 * variance V_P, halves apart by V_H - V_P, quarters by V_Q - V_H. */
static void law(double A, double B)
{
    uint64_t state = 11;
    double sums[2] = {0, 0}, bound = 0, seen = 0;
    const double p = A + B, h = 4 * A + 2 * B, q = 16 * A + 4 * B;
    for (int k = 0; k < PIXELS; k++) {
        double parts[IMP_NET_PARTS];
        const double m = sqrt(p) * normal(&state), d = sqrt(h - p) * normal(&state);
        for (int i = 0; i < 2; i++) {
            const double half = m + (i ? -d : d), e = sqrt(q - h) * normal(&state);
            parts[2 * i] = half + e;
            parts[2 * i + 1] = half - e;
        }
        double mean = 0, spread = 0;
        for (int i = 0; i < IMP_NET_PARTS; i++) mean += parts[i] / IMP_NET_PARTS;
        for (int i = 0; i < IMP_NET_PARTS; i++)
            spread += (parts[i] - mean) * (parts[i] - mean) / 12;
        bound += spread / PIXELS;
        seen += mean * mean / PIXELS;
        imp__nets_add(sums, parts, 1);
    }
    /* The factor is halfway: its fourth power turns the bound into the variance. */
    const double to = pow(imp__nets_factor(sums), 4) * bound;
    tap_ok(fabs(to / seen - 1) < .03 && fabs(seen / p - 1) < .01,
           "variance %.2f/n^2 + %.2f/n # seen %.4f, bound %.4f, from quarters %.4f", A, B,
           seen, bound, to);
}

int main(void)
{
    static const struct {
        int64_t walks;
        int set;
        bool whole;
    } counts[] = {{16, 4, true},    {32, 8, true},   {64, 16, true}, {256, 16, true},
                  {192, 16, true},  {8, 2, false},   {24, 6, false}, {48, 12, false},
                  {100, 16, false}, {96, 16, false}, {64, 4, false}, {0, 4, false},
                  {4, 1, false},    {1024, 16, true}};
    bool right = true;
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++)
        right &= imp__nets_whole(counts[k].walks, counts[k].set) == counts[k].whole;
    tap_ok(right, "sample counts that are whole nets");
    law(0, 1);
    law(.3, .7);
    law(.7, .3);
    law(1, 0);
    tap_ok(imp__nets_factor((double[2]){5, 20}) == 1, "few pixels show nothing");
    return tap_done();
}
