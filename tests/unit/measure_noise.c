/* SPDX-License-Identifier: Apache-2.0
 *
 * Noise of light seen through a power: standard deviations and shifts of the mean against draws of it, from black
 * to white, and without a power. */
#include "imp_tap.h"
#include "inverse/measure/measuring.h"
#include "math/rng.h"
#include <math.h>

enum { VALUES = 7, DRAWS = 200000 };

static double normal(struct imp_key key, uint32_t k)
{
    const double u = 1 - imp__u01(key, 2 * k), v = imp__u01(key, 2 * k + 1);
    return sqrt(-2 * log(u)) * cos(6.283185307179586 * v);
}

static void compare(double gamma)
{
    static const float light[VALUES] = {0, 0.001f, 0.004f, 0.02f, 0.1f, 0.4f, 0.9f};
    float noise[VALUES], lift[VALUES];
    struct imp__photo p = {.n_values = VALUES, .noise_se = noise, .lift = lift};
    p.desc = (struct imp_photo)IMP_PHOTO_INIT;
    p.desc.read = 0.004;
    p.desc.shot = 0.001;
    p.desc.relative = 0.01;
    imp__measure_noise_by_light(&p, light, gamma);
    double worst = 0;
    for (int i = 0; i < VALUES; i++) {
        const struct imp_key key = imp__key(11, 3, (uint64_t)i);
        const double v = (double)light[i];
        const double s = sqrt(0.004 * 0.004 + 0.001 * v + 0.0001 * v * v);
        double sum = 0, square = 0, fourth = 0;
        for (uint32_t k = 0; k < DRAWS; k++) {
            const double x = v + s * normal(key, k);
            const double V = gamma == 1 ? x : pow(fmax(x, 0), 1 / gamma);
            sum += V;
            square += V * V;
        }
        const double mean = sum / DRAWS, variance = square / DRAWS - mean * mean;
        for (uint32_t k = 0; k < DRAWS; k++) {
            const double x = v + s * normal(key, k);
            const double V = gamma == 1 ? x : pow(fmax(x, 0), 1 / gamma);
            fourth += pow(V - mean, 4) / DRAWS;
        }
        const double at = gamma == 1 ? v : pow(v, 1 / gamma);
        const double z = (mean - at - (double)lift[i]) / sqrt(variance / DRAWS);
        const double of = (variance - (double)noise[i] * (double)noise[i]) /
                          sqrt((fourth - variance * variance) / DRAWS);
        worst = fmax(worst, fmax(fabs(z), fabs(of)));
        if (gamma == 1 && lift[i] != 0) worst = INFINITY;
    }
    tap_ok(worst < 4, "gamma %g: means and variances of noisy values # %.2f errors off",
           gamma, worst);
}

int main(void)
{
    compare(1);
    compare(2.2);
    compare(0.6);
    return tap_done();
}
