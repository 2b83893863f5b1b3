/* SPDX-License-Identifier: Apache-2.0
 *
 * Patches of the sky: where they are, and the radiance of a sky in them. */
#include "sky_patches.h"
#include <math.h>

enum { HALVES = 2 }; /* points of a patch in each direction */

static int count_of(int row)
{
    static const int tregenza[] = {30, 30, 24, 24, 18, 12, 6};
    return 2 * tregenza[row / 2];
}

void imp__sky_patches_set(struct imp__sky_patches *p, const imp_v3 axis[3])
{
    int n = 0;
    for (int k = 0; k < 3; k++) p->axis[k] = axis[k];
    for (int row = 0; row <= IMP__PATCH_ROWS; row++) {
        p->sine[row] = sin(row * (IMP_PI / 2) / (IMP__PATCH_ROWS + 0.5));
        p->first[row] = n;
        if (row < IMP__PATCH_ROWS) n += count_of(row);
    }
}

int imp__sky_patch_of(const struct imp__sky_patches *p, imp_v3 w)
{
    const double z = imp__dot(w, p->axis[2]);
    if (!(z > 0)) return -1;
    int row = 0;
    while (row < IMP__PATCH_ROWS && z >= p->sine[row + 1]) row++;
    if (row == IMP__PATCH_ROWS) return p->first[row];
    const int n = count_of(row);
    const double turn = atan2(imp__dot(w, p->axis[1]), imp__dot(w, p->axis[0])) / IMP_2PI;
    const int k = (int)floor((turn - floor(turn)) * n);
    return p->first[row] + imp_min(k, n - 1);
}

static int row_of(const struct imp__sky_patches *p, int patch)
{
    int row = 0;
    while (row < IMP__PATCH_ROWS && patch >= p->first[row + 1]) row++;
    return row;
}

double imp__sky_patch_size(const struct imp__sky_patches *p, int patch)
{
    const int row = row_of(p, patch);
    if (row == IMP__PATCH_ROWS) return IMP_2PI * (1 - p->sine[row]);
    return IMP_2PI * (p->sine[row + 1] - p->sine[row]) / count_of(row);
}

/* Abramowitz and Stegun 4.4.46, to 2e-8: a year has ten million of these. */
static inline double angle_of(double cosine)
{
    const double c = fabs(cosine);
    const double x =
        sqrt(1 - c) *
        (1.5707963050 +
         c * (-0.2145988016 +
              c * (0.0889789874 +
                   c * (-0.0501743046 +
                        c * (0.0308918810 +
                             c * (-0.0170881256 +
                                  c * (0.0066700901 + c * -0.0012624911)))))));
    return cosine < 0 ? IMP_PI - x : x;
}

/* g depends on the height alone: who asks for a row of directions has it. */
static inline double relative(const struct imp__sky_shape *s, double g, imp_v3 w)
{
    const double *n = s->n, c = imp_clamp(imp__dot(w, s->sun), -1.0, 1.0);
    const double f = 1 + n[2] * (exp(n[3] * angle_of(c)) - s->h) + n[4] * c * c;
    return imp_max(g * f, 0.0);
}

/* Relative radiances of a row's patches, at heights even in sin(altitude), added to L. */
static void row_fill(const struct imp__sky_patches *p, const struct imp__sky_shape *s,
                     int row, double *L)
{
    const int n = count_of(row);
    const double lo = p->sine[row], hi = p->sine[row + 1];
    for (int i = 0; i < HALVES; i++) {
        const double z = lo + (hi - lo) * (i + 0.5) / HALVES, r = sqrt(1 - z * z);
        const double g = 1 + s->n[0] * exp(s->n[1] / z);
        const double step = IMP_2PI / (HALVES * n);
        double c = cos(step / 2), q = sin(step / 2);
        const double turn_c = cos(step), turn_s = sin(step);
        for (int j = 0; j < HALVES * n; j++) {
            const imp_v3 w = p->axis[0] * (r * c) + p->axis[1] * (r * q) + p->axis[2] * z;
            L[j / HALVES] += relative(s, g, w) / (HALVES * HALVES);
            const double next = c * turn_c - q * turn_s;
            q = q * turn_c + c * turn_s;
            c = next;
        }
    }
}

static double cap(const struct imp__sky_patches *p, const struct imp__sky_shape *s)
{
    enum { AROUND = 6 };
    const double z = (1 + p->sine[IMP__PATCH_ROWS]) / 2, r = sqrt(1 - z * z);
    const double g = 1 + s->n[0] * exp(s->n[1] / z);
    double sum = 0;
    for (int k = 0; k < AROUND; k++) {
        const double phi = IMP_2PI * (k + 0.5) / AROUND;
        sum += relative(s, g,
                        p->axis[0] * (r * cos(phi)) + p->axis[1] * (r * sin(phi)) +
                            p->axis[2] * z);
    }
    return sum / AROUND;
}

void imp__sky_patches_fill(const struct imp__sky_patches *p,
                           const struct imp__sky_shape *sky, double level, double *L)
{
    double ground = 0; /* Int L cos dw: cos dw = d(z^2)/2 dphi */
    for (int k = 0; k < IMP__PATCHES; k++) L[k] = 0;
    for (int row = 0; row < IMP__PATCH_ROWS; row++) {
        double *here = L + p->first[row];
        row_fill(p, sky, row, here);
        const int n = count_of(row);
        const double each =
            IMP_PI / n *
            (p->sine[row + 1] * p->sine[row + 1] - p->sine[row] * p->sine[row]);
        for (int k = 0; k < n; k++) ground += each * here[k];
    }
    const double edge = p->sine[IMP__PATCH_ROWS];
    L[IMP__PATCHES - 1] = cap(p, sky);
    ground += IMP_PI * (1 - edge * edge) * L[IMP__PATCHES - 1];
    const bool dark = !(ground > 0) || !isfinite(ground);
    for (int k = 0; k < IMP__PATCHES; k++)
        L[k] = dark ? level * IMP_INV_PI : L[k] * (level / ground);
}
