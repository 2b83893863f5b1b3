/* SPDX-License-Identifier: Apache-2.0
 *
 * Smoke for benches, figures and examples: a plume that widens as it rises, torn by two
 * dozen plane waves, with the same values for the same seed on every machine. Most cells
 * are empty. */
#ifndef IMP_BENCH_PLUME_H
#define IMP_BENCH_PLUME_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* On [0, 1) (splitmix64; Steele, Lea, Flood 2014). */
static inline double plume_draw(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

/* Extinction at the centres of n^3 cells of the unit cube, [z][y][x]; y is up. */
static inline void plume_fill(int n, uint64_t seed, float *value)
{
    enum { WAVES = 24 };
    double wave[WAVES][5];
    for (int k = 0; k < WAVES; k++) {
        const double length = 6 + 14 * plume_draw(&seed), z = 2 * plume_draw(&seed) - 1,
                     phi = 2 * M_PI * plume_draw(&seed), r = sqrt(1 - z * z);
        wave[k][0] = length * r * cos(phi);
        wave[k][1] = length * z;
        wave[k][2] = length * r * sin(phi);
        wave[k][3] = 2 * M_PI * plume_draw(&seed);
        wave[k][4] = .5 / (1 + .2 * k);
    }
    for (int k = 0; k < n; k++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                const double x = (i + .5) / n, y = (j + .5) / n, z = (k + .5) / n;
                const double r = hypot(x - .5 - .1 * sin(6 * y),
                                       z - .5 - .1 * cos(5 * y)),
                             s = r / (.05 + .2 * y);
                double turbulence = 1;
                for (int w = 0; w < WAVES; w++)
                    turbulence += wave[w][4] * sin(wave[w][0] * x + wave[w][1] * y +
                                                   wave[w][2] * z + wave[w][3]);
                const double d = exp(-s * s) * turbulence - .1;
                *value++ = y > .05 && y < .95 && d > 0 ? (float)(8 * d) : 0;
            }
}

/* As a .vol file of one channel over the unit cube. 0: it cannot be written. */
static inline int plume_write(const char *path, int n, uint64_t seed)
{
    const int32_t head[5] = {1, n, n, n, 1};
    const float box[6] = {0, 0, 0, 1, 1, 1};
    const size_t cells = (size_t)n * (size_t)n * (size_t)n;
    float *value = malloc(cells * sizeof *value);
    FILE *f = value ? fopen(path, "wb") : NULL;
    int ok = 0;
    if (f) {
        plume_fill(n, seed, value);
        ok = fwrite("VOL\3", 1, 4, f) == 4 && fwrite(head, 4, 5, f) == 5 &&
             fwrite(box, 4, 6, f) == 6 && fwrite(value, 4, cells, f) == cells;
        ok &= fclose(f) == 0;
    }
    free(value);
    return ok;
}

#endif
