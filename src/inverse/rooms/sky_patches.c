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

/* Directions of a row, a step of two patches at a time: in floats, since patches are means of four. */
static void turns_set(float *cosine, float *sine, int n)
{
    const double step = IMP_2PI / (HALVES * n);
    const float c = (float)cos(4 * step), s = (float)sin(4 * step);
    for (int i = 0; i < 4; i++) {
        cosine[i] = (float)cos((i + 0.5) * step);
        sine[i] = (float)sin((i + 0.5) * step);
    }
    for (int i = 4; i < HALVES * n; i++) {
        cosine[i] = cosine[i - 4] * c - sine[i - 4] * s;
        sine[i] = sine[i - 4] * c + cosine[i - 4] * s;
    }
}

void imp__sky_patches_set(struct imp__sky_patches *p, const imp_v3 axis[3])
{
    int n = 0;
    for (int k = 0; k < 3; k++) p->axis[k] = axis[k];
    for (int row = 0; row <= IMP__PATCH_ROWS; row++) {
        p->sine[row] = sin(row * (IMP_PI / 2) / (IMP__PATCH_ROWS + 0.5));
        p->first[row] = n;
        if (row == IMP__PATCH_ROWS) break;
        turns_set(p->turn[0] + HALVES * n, p->turn[1] + HALVES * n, count_of(row));
        n += count_of(row);
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

typedef imp__annual_lanes lanes;
typedef imp__annual_mask mask;
typedef double doubles __attribute__((vector_size(8 * IMP__AT_ONCE)));

static inline lanes choose(mask m, lanes a, lanes b)
{
    return (lanes)(((mask)a & m) | ((mask)b & ~m));
}
/* root; a if it is above b, or below, else b. */
#ifdef __AVX__
static inline lanes root(lanes x) { return __builtin_ia32_sqrtps256(x); }
static inline lanes larger(lanes a, lanes b) { return __builtin_ia32_maxps256(a, b); }
static inline lanes lesser(lanes a, lanes b) { return __builtin_ia32_minps256(a, b); }
#else
static inline lanes root(lanes x)
{
    for (int k = 0; k < IMP__AT_ONCE; k++) x[k] = sqrtf(x[k]);
    return x;
}
static inline lanes larger(lanes a, lanes b) { return choose(a > b, a, b); }
static inline lanes lesser(lanes a, lanes b) { return choose(a < b, a, b); }
#endif
static inline lanes splat(float x) { return (lanes){x, x, x, x, x, x, x, x}; }

/* As imp__lanes_acos: Abramowitz and Stegun 4.4.45, to 7e-5; c in [-1, 1]. */
static inline lanes angle_of(lanes c)
{
    const lanes a = (lanes)((mask)c & INT32_MAX);
    const lanes p = ((a * -0.0187293f + 0.0742610f) * a - 0.2121144f) * a + 1.5707288f;
    const lanes x = p * root(1.f - a);
    return choose(c < splat(0), 3.14159265f - x, x);
}

/* As imp__exp, to 3e-7: 2^k exp(r), |r| < .35; x in [-80, 80]. */
static inline lanes power_of(lanes x)
{
    x = larger(splat(-80), lesser(splat(80), x));
    const lanes t = x * 1.44269504f + 0x1.8p23f, k = t - 0x1.8p23f;
    const lanes r = (x - k * 0x1.62ep-1f) - k * 0x1.0bfbe8p-15f;
    const lanes e =
        1.f + r * (1.f + r * (1.f / 2 +
                              r * (1.f / 6 +
                                   r * (1.f / 24 + r * (1.f / 120 + r * (1.f / 720))))));
    return (lanes)((mask)e + (((mask)t - (mask)splat(0x1.8p23f)) << 23));
}

/* Eight skies: what their radiances in a direction are made of. */
struct skies {
    lanes sun[2];  /* level, in the axes of the patches */
    doubles up;    /* the sun's height */
    lanes c, d, e; /* of sky_shape.h */
    lanes h;
};
static struct skies skies_of(const struct imp__sky_patches *p,
                             const struct imp__sky_shape *sky)
{
    struct skies s;
    for (int t = 0; t < IMP__AT_ONCE; t++) {
        s.sun[0][t] = (float)imp__dot(sky[t].sun, p->axis[0]);
        s.sun[1][t] = (float)imp__dot(sky[t].sun, p->axis[1]);
        s.up[t] = imp__dot(sky[t].sun, p->axis[2]);
        s.c[t] = (float)sky[t].n[2];
        s.d[t] = (float)sky[t].n[3];
        s.e[t] = (float)sky[t].n[4];
        s.h[t] = (float)sky[t].h;
    }
    return s;
}

/* Relative radiances of directions by the cosines of their angles to the sun; g of their heights. */
static inline lanes relative(const struct skies *s, lanes g, lanes c)
{
    c = larger(splat(-1), lesser(splat(1), c));
    const lanes near = power_of(s->d * angle_of(c)) - s->h;
    return larger(g * (1.f + s->c * near + s->e * c * c), splat(0));
}

static lanes zenith_factors(const struct imp__sky_shape *sky, double z)
{
    lanes g;
    for (int t = 0; t < IMP__AT_ONCE; t++)
        g[t] = (float)(1 + sky[t].n[0] * exp(sky[t].n[1] / z));
    return g;
}
static inline lanes narrow(doubles x) { return __builtin_convertvector(x, lanes); }
static inline doubles widen(lanes x) { return __builtin_convertvector(x, doubles); }

/* The patches of a row, at heights even in sin(altitude). */
static void row_fill(const struct imp__sky_patches *p, const struct imp__sky_shape *sky,
                     const struct skies *s, int row, lanes *L)
{
    const double lo = p->sine[row], hi = p->sine[row + 1];
    const float *c = p->turn[0] + HALVES * p->first[row],
                *q = p->turn[1] + HALVES * p->first[row];
    lanes z[HALVES], g[HALVES];
    float r[HALVES];
    for (int i = 0; i < HALVES; i++) {
        const double up = lo + (hi - lo) * (i + 0.5) / HALVES;
        z[i] = narrow(up * s->up);
        r[i] = (float)sqrt(1 - up * up);
        g[i] = zenith_factors(sky, up);
    }
    for (int k = 0; k < count_of(row); k++) {
        lanes x[HALVES][HALVES];
        for (int j = 0; j < HALVES; j++) {
            const lanes level =
                c[HALVES * k + j] * s->sun[0] + q[HALVES * k + j] * s->sun[1];
            x[0][j] = relative(s, g[0], level * r[0] + z[0]);
            x[1][j] = relative(s, g[1], level * r[1] + z[1]);
        }
        L[2 * k] =
            ((x[0][0] + x[0][1]) + (x[1][0] + x[1][1])) * (1.f / (HALVES * HALVES));
    }
}

static doubles cap(const struct imp__sky_patches *p, const struct imp__sky_shape *sky,
                   const struct skies *s)
{
    enum { AROUND = 8 };
    const double z = (1 + p->sine[IMP__PATCH_ROWS]) / 2, r = sqrt(1 - z * z);
    const lanes g = zenith_factors(sky, z);
    doubles sum = {0}, level[2];
    for (int i = 0; i < 2; i++)
        for (int t = 0; t < IMP__AT_ONCE; t++)
            level[i][t] = imp__dot(sky[t].sun, p->axis[i]);
    for (int i = 0; i < AROUND; i++) {
        const double phi = IMP_2PI * (i + 0.5) / AROUND;
        sum += widen(relative(
                   s, g,
                   narrow(r * (cos(phi) * level[0] + sin(phi) * level[1]) + z * s->up))) /
               AROUND;
    }
    return sum;
}

void imp__sky_patches_fill(const struct imp__sky_patches *p,
                           const struct imp__sky_shape sky[IMP__AT_ONCE],
                           const double level[IMP__AT_ONCE], lanes *L)
{
    const struct skies s = skies_of(p, sky);
    doubles ground = {0}, factor; /* Int L cos dw: cos dw = d(z^2)/2 dphi */
    lanes even;
    mask dark;
    for (int row = 0; row < IMP__PATCH_ROWS; row++) {
        lanes *here = L + 2 * p->first[row];
        row_fill(p, sky, &s, row, here);
        const int n = count_of(row);
        const double each =
            IMP_PI / n *
            (p->sine[row + 1] * p->sine[row + 1] - p->sine[row] * p->sine[row]);
        for (int k = 0; k < n; k++) ground += each * widen(here[2 * k]);
    }
    const double edge = p->sine[IMP__PATCH_ROWS];
    const doubles top = cap(p, sky, &s);
    ground += IMP_PI * (1 - edge * edge) * top;
    for (int t = 0; t < IMP__AT_ONCE; t++) {
        const bool no = !(ground[t] > 0) || !isfinite(ground[t]);
        dark[t] = -no;
        even[t] = (float)(level[t] * IMP_INV_PI);
        factor[t] = level[t] / ground[t];
    }
    for (int k = 0; k < IMP__PATCHES - 1; k++)
        L[2 * k] = choose(dark, even, narrow(widen(L[2 * k]) * factor));
    L[2 * (IMP__PATCHES - 1)] = choose(dark, even, narrow(top * factor));
}
