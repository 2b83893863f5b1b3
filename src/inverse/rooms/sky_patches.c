/* SPDX-License-Identifier: Apache-2.0
 *
 * Patches of the sky: where they are, and the radiance of a sky in them. */
#include "sky_patches.h"
#include "math/exp.h"
#include "math/lanes.h"
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

/* Relative radiances of four directions at one height, of which g is the factor, by the cosines
 * of their angles to the sun. A year has ten million of them. */
static inline imp_v3 relative(const struct imp__sky_shape *s, double g, imp_v3 cosine)
{
    const double *n = s->n;
    const imp_v3 c = imp__lanes_clamp(cosine, -1, 1);
    const imp_v3 near = imp__exp(n[3] * imp__lanes_acos(c)) - s->h;
    const imp_v3 L = g * (1 + n[2] * near + n[4] * c * c);
    return imp__choose_4(L > imp__spec(0), L, imp__spec(0));
}

static double zenith_factor(const struct imp__sky_shape *s, double z)
{
    return 1 + s->n[0] * exp(s->n[1] / z);
}

/* The sun in the axes of the patches. */
static imp_v3 sun_in(const struct imp__sky_patches *p, const struct imp__sky_shape *s)
{
    return imp__v3(imp__dot(s->sun, p->axis[0]), imp__dot(s->sun, p->axis[1]),
                   imp__dot(s->sun, p->axis[2]));
}

/* Relative radiances of a row's patches, at heights even in sin(altitude), into L. Four
 * directions at once are two patches, at HALVES of 2. */
static void row_fill(const struct imp__sky_patches *p, const struct imp__sky_shape *s,
                     imp_v3 sun, int row, double *L)
{
    const int n = count_of(row);
    const double lo = p->sine[row], hi = p->sine[row + 1];
    const double step = IMP_2PI / (HALVES * n), turn_c = cos(4 * step),
                 turn_s = sin(4 * step);
    double z[HALVES], r[HALVES], g[HALVES];
    imp_v3 c, q;
    for (int i = 0; i < HALVES; i++) {
        z[i] = lo + (hi - lo) * (i + 0.5) / HALVES;
        r[i] = sqrt(1 - z[i] * z[i]);
        g[i] = zenith_factor(s, z[i]);
    }
    for (int k = 0; k < 4; k++) {
        c[k] = cos((k + 0.5) * step);
        q[k] = sin((k + 0.5) * step);
    }
    for (int j = 0; j < n; j += 2) {
        const imp_v3 level = c * sun[0] + q * sun[1];
        imp_v3 sum = imp__spec(0);
        for (int i = 0; i < HALVES; i++)
            sum += relative(s, g[i], level * r[i] + z[i] * sun[2]);
        L[j] = (sum[0] + sum[1]) / (HALVES * HALVES);
        L[j + 1] = (sum[2] + sum[3]) / (HALVES * HALVES);
        const imp_v3 next = c * turn_c - q * turn_s;
        q = q * turn_c + c * turn_s;
        c = next;
    }
}

static double cap(const struct imp__sky_patches *p, const struct imp__sky_shape *s,
                  imp_v3 sun)
{
    enum { FOURS = 2, AROUND = 4 * FOURS };
    const double z = (1 + p->sine[IMP__PATCH_ROWS]) / 2, r = sqrt(1 - z * z);
    imp_v3 sum = imp__spec(0);
    for (int k = 0; k < FOURS; k++) {
        imp_v3 cosine;
        for (int i = 0; i < 4; i++) {
            const double phi = IMP_2PI * (4 * k + i + 0.5) / AROUND;
            cosine[i] = r * (cos(phi) * sun[0] + sin(phi) * sun[1]) + z * sun[2];
        }
        sum += relative(s, zenith_factor(s, z), cosine);
    }
    return imp__sum_used(sum, 4) / AROUND;
}

void imp__sky_patches_fill(const struct imp__sky_patches *p,
                           const struct imp__sky_shape *sky, double level, double *L)
{
    double ground = 0; /* Int L cos dw: cos dw = d(z^2)/2 dphi */
    const imp_v3 sun = sun_in(p, sky);
    for (int row = 0; row < IMP__PATCH_ROWS; row++) {
        double *here = L + p->first[row];
        row_fill(p, sky, sun, row, here);
        const int n = count_of(row);
        const double each =
            IMP_PI / n *
            (p->sine[row + 1] * p->sine[row + 1] - p->sine[row] * p->sine[row]);
        for (int k = 0; k < n; k++) ground += each * here[k];
    }
    const double edge = p->sine[IMP__PATCH_ROWS];
    L[IMP__PATCHES - 1] = cap(p, sky, sun);
    ground += IMP_PI * (1 - edge * edge) * L[IMP__PATCHES - 1];
    const bool dark = !(ground > 0) || !isfinite(ground);
    for (int k = 0; k < IMP__PATCHES; k++)
        L[k] = dark ? level * IMP_INV_PI : L[k] * (level / ground);
}
