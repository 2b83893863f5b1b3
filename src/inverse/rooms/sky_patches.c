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

/* ---- Skies ------------------------------------------------------------------------- */

/* Floats, since a year has ten million directions, and patches are means of four of them. */
enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(4 * LANES)));
typedef int32_t mask __attribute__((vector_size(4 * LANES)));

static inline lanes choose(mask m, lanes a, lanes b)
{
    return (lanes)(((mask)a & m) | ((mask)b & ~m));
}
static inline lanes root(lanes x)
{
#ifdef __AVX__
    return (lanes)__builtin_ia32_sqrtps256(x);
#else
    for (int k = 0; k < LANES; k++) x[k] = sqrtf(x[k]);
    return x;
#endif
}

/* As imp__lanes_acos: Abramowitz and Stegun 4.4.45, to 7e-5; c in [-1, 1]. */
static inline lanes angle_of(lanes c)
{
    const lanes a = choose(c < 0.f * c, -c, c);
    const lanes p = ((a * -0.0187293f + 0.0742610f) * a - 0.2121144f) * a + 1.5707288f;
    const lanes x = p * root(1.f - a);
    return choose(c < 0.f * c, 3.14159265f - x, x);
}

/* As imp__exp, to 3e-7: 2^k exp(r), |r| < .35; x in [-80, 80]. */
static inline lanes power_of(lanes x)
{
    const lanes low = 0.f * x - 80.f;
    x = choose(x < low, low, choose(x > -low, -low, x));
    const lanes t = x * 1.44269504f + 0x1.8p23f, k = t - 0x1.8p23f;
    const lanes r = (x - k * 0x1.62ep-1f) - k * 0x1.0bfbe8p-15f;
    const lanes e =
        1.f + r * (1.f + r * (1.f / 2 +
                              r * (1.f / 6 +
                                   r * (1.f / 24 + r * (1.f / 120 + r * (1.f / 720))))));
    return (lanes)((mask)e + (((mask)t - (mask)(0.f * t + 0x1.8p23f)) << 23));
}

/* Relative radiances of directions by the cosines of their angles to the sun; g of their heights. */
static inline lanes relative(const struct imp__sky_shape *s, lanes g, lanes c)
{
    const lanes one = 0.f * c + 1.f;
    c = choose(c < -one, -one, choose(c > one, one, c));
    const lanes near = power_of((float)s->n[3] * angle_of(c)) - (float)s->h;
    const lanes L = g * (1.f + (float)s->n[2] * near + (float)s->n[4] * c * c);
    return choose(L > 0.f * L, L, 0.f * L);
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

/* Relative radiances of a row's patches, at heights even in sin(altitude), into L. Eight directions
 * at once are two patches, at HALVES of 2: the lower four first. */
static void row_fill(const struct imp__sky_patches *p, const struct imp__sky_shape *s,
                     imp_v3 sun, int row, double *L)
{
    const int n = count_of(row);
    const double lo = p->sine[row], hi = p->sine[row + 1];
    const double step = IMP_2PI / (HALVES * n);
    const float turn_c = (float)cos(4 * step), turn_s = (float)sin(4 * step);
    lanes z, r, g, c, q;
    for (int i = 0; i < LANES; i++) {
        const double up = lo + (hi - lo) * (i / 4 + 0.5) / HALVES;
        const double phi = (i % 4 + 0.5) * step;
        z[i] = (float)(up * sun[2]);
        r[i] = (float)sqrt(1 - up * up);
        g[i] = (float)zenith_factor(s, up);
        c[i] = (float)cos(phi);
        q[i] = (float)sin(phi);
    }
    for (int j = 0; j < n; j += 2) {
        const lanes level = c * (float)sun[0] + q * (float)sun[1];
        const lanes x = relative(s, g, level * r + z);
        L[j] = (double)((x[0] + x[1]) + (x[4] + x[5])) / (HALVES * HALVES);
        L[j + 1] = (double)((x[2] + x[3]) + (x[6] + x[7])) / (HALVES * HALVES);
        const lanes next = c * turn_c - q * turn_s;
        q = q * turn_c + c * turn_s;
        c = next;
    }
}

static double cap(const struct imp__sky_patches *p, const struct imp__sky_shape *s,
                  imp_v3 sun)
{
    const double z = (1 + p->sine[IMP__PATCH_ROWS]) / 2, r = sqrt(1 - z * z);
    lanes cosine, g;
    for (int i = 0; i < LANES; i++) {
        const double phi = IMP_2PI * (i + 0.5) / LANES;
        cosine[i] = (float)(r * (cos(phi) * sun[0] + sin(phi) * sun[1]) + z * sun[2]);
        g[i] = (float)zenith_factor(s, z);
    }
    const lanes x = relative(s, g, cosine);
    double sum = 0;
    for (int i = 0; i < LANES; i++) sum += (double)x[i] / LANES;
    return sum;
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
