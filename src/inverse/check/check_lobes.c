/* SPDX-License-Identifier: Apache-2.0
 *
 * The mixture of a uniform density and lobes. */
#include "check_lobes.h"
#include "math/warp.h"
#include <math.h>

#define WIDTHS 5
static const double width[WIDTHS] = {2, 20, 200, 2000, 20000};

void imp__lobes_add(struct imp__lobes *q, imp_v3 axis)
{
    if (q->n < IMP_LOBE_AXES) q->axis[q->n++] = imp__normalize(axis);
}

/* Density of one lobe at cosine c to its axis, kappa = width[k]:
 * kappa/(2 pi (1 - exp(-2 kappa))) exp(kappa (c - 1)). */
double imp__lobes_pdf(const struct imp__lobes *q, imp_v3 w)
{
    static const double peak[WIDTHS] = {/* kappa/(1 - exp(-2 kappa)) */
                                        2 / (1 - 0.018315638888734179), 20, 200, 2000,
                                        20000};
    double sum = 0.5;
    for (int i = 0; i < q->n; i++) {
        const double c = imp__dot(q->axis[i], w);
        for (int k = 0; k < WIDTHS; k++) {
            if (!(width[k] * (1 - c) < 80)) break; /* e^-80 does not count */
            sum += peak[k] * exp(width[k] * (c - 1));
        }
    }
    return sum / (IMP_2PI * (1 + WIDTHS * q->n));
}

imp_v3 imp__lobes_sample(const struct imp__lobes *q, const double u[3])
{
    const int lobes = 1 + WIDTHS * q->n, k = imp_min((int)(u[0] * lobes), lobes - 1);
    if (k == 0) return imp__uniform_sphere(&u[1]);
    const double kappa = width[(k - 1) % WIDTHS];
    const double c = 1 + log1p(u[1] * expm1(-2 * kappa)) / kappa;
    const double s = sqrt(fmax(0, 1 - c * c)), phi = IMP_2PI * u[2];
    const struct imp_frame f = imp__frame_from_normal(q->axis[(k - 1) / WIDTHS]);
    return imp__to_world(&f, (imp_v3){s * cos(phi), s * sin(phi), c});
}
