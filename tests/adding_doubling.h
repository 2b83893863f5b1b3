/* SPDX-License-Identifier: Apache-2.0
 *
 * Plane-parallel slabs by adding and doubling (van de Hulst 1963; Grant and Hunt 1969):
 * the truth about radiance that a slab of matched index reflects and transmits.
 *
 * Radiance at nodes mu_i of the half range, with quadrature weights w_i for integrals over
 * mu; nodes of weight 0 are directions that are asked for. A layer is a pair of matrices
 * R, T that take the radiance that falls onto it to what comes back and through. A layer
 * of optical depth t -> 0 has
 *
 *     T = 1 - t M^-1 (1 - (a/2) P+ W),    R = t M^-1 (a/2) P- W,    M = diag mu, W = diag w
 *
 * with P+- the phase function, averaged over azimuth and normalised to 1 over the sphere
 * times 4 pi. Two equal layers on top of each other:
 *
 *     T2 = T (1 - R R)^-1 T,    R2 = R + T (1 - R R)^-1 R T
 *
 * Behind smooth boundaries of index n, radiance inside meets Fresnel's reflectance F(mu), 1
 * beyond the critical angle, so the half range is cut there into two. */
#ifndef IMP_ADDING_DOUBLING_H
#define IMP_ADDING_DOUBLING_H

#include <math.h>
#include <string.h>

enum { AD_GAUSS = 40, AD_MAX = AD_GAUSS + 4 };
typedef double ad_matrix[AD_MAX][AD_MAX];

struct ad_slab {
    int n;
    double mu[AD_MAX], w[AD_MAX];
    ad_matrix R, T;
};

/* Gauss-Legendre on (0, 1), by Newton's iteration. */
static inline void ad_gauss(int n, double *x, double *w)
{
    for (int i = 0; i < n; i++) {
        double z = cos(M_PI * (i + .75) / (n + .5)), slope = 0;
        for (int k = 0; k < 100; k++) {
            double p = 1, before = 0;
            for (int j = 1; j <= n; j++) {
                const double next = ((2 * j - 1) * z * p - (j - 1) * before) / j;
                before = p, p = next;
            }
            slope = n * (z * p - before) / (z * z - 1);
            z -= p / slope;
            if (fabs(p / slope) < 1e-16) break;
        }
        x[i] = (1 + z) / 2;
        w[i] = 1 / ((1 - z * z) * slope * slope);
    }
}

/* X = A^-1 B, A is destroyed. */
static inline void ad_solve(int n, ad_matrix A, const ad_matrix B, ad_matrix X)
{
    memcpy(X, B, sizeof(ad_matrix));
    for (int k = 0; k < n; k++) { /* diagonally dominant: no pivots */
        for (int i = 0; i < n; i++) {
            const double f = i == k ? 0 : A[i][k] / A[k][k];
            if (f == 0) continue;
            for (int j = k; j < n; j++) A[i][j] -= f * A[k][j];
            for (int j = 0; j < n; j++) X[i][j] -= f * X[k][j];
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) X[i][j] /= A[i][i];
}
static inline void ad_multiply(int n, const ad_matrix A, const ad_matrix B, ad_matrix C)
{
    memset(C, 0, sizeof(ad_matrix));
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++)
            for (int j = 0; j < n; j++) C[i][j] += A[i][k] * B[k][j];
}

/* 4 pi times a phase function of the cosine of the turn. */
typedef double ad_phase(double c, double g);
static inline double ad_hg(double c, double g)
{
    return (1 - g * g) / pow(1 + g * g - 2 * g * c, 1.5);
}
static inline double ad_rayleigh(double c, double g)
{
    (void)g;
    return .75 * (1 + c * c);
}

/* mu [n_asked]: directions that are asked for, behind the nodes of the quadrature, half of
 * which lie below the cosine `cut`; 0: all above. */
static inline void ad_make_cut(struct ad_slab *s, double tau, double albedo,
                               ad_phase *phase, double g, int n_asked,
                               const double *asked, double cut)
{
    enum { AZIMUTH = 256, DOUBLINGS = 26 };
    static ad_matrix plus, minus, RR, TX, X, Y;
    const double t = ldexp(tau, -DOUBLINGS);
    const int n = s->n = AD_GAUSS + n_asked;
    const int below = cut > 0 ? AD_GAUSS / 2 : 0;
    if (below) ad_gauss(below, s->mu, s->w);
    ad_gauss(AD_GAUSS - below, s->mu + below, s->w + below);
    for (int i = 0; i < AD_GAUSS; i++) {
        const double lo = i < below ? 0 : cut, hi = i < below ? cut : 1;
        s->mu[i] = lo + (hi - lo) * s->mu[i];
        s->w[i] *= hi - lo;
    }
    for (int k = 0; k < n_asked; k++) {
        s->mu[AD_GAUSS + k] = asked[k];
        s->w[AD_GAUSS + k] = 0;
    }
    for (int i = 0; i < n; i++) {
        double norm = 0;
        for (int j = 0; j < n; j++) {
            const double c = s->mu[i] * s->mu[j],
                         r = sqrt((1 - s->mu[i] * s->mu[i]) * (1 - s->mu[j] * s->mu[j]));
            plus[i][j] = minus[i][j] = 0;
            for (int k = 0; k < AZIMUTH; k++) {
                const double x = r * cos(M_PI * (k + .5) / AZIMUTH);
                plus[i][j] += phase(c + x, g) / AZIMUTH;
                minus[i][j] += phase(-c + x, g) / AZIMUTH;
            }
            norm += s->w[j] * (plus[i][j] + minus[i][j]) / 2;
        }
        for (int j = 0; j < n; j++) plus[i][j] /= norm, minus[i][j] /= norm;
    }
    memset(s->R, 0, sizeof s->R);
    memset(s->T, 0, sizeof s->T);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const double share = t / s->mu[i] * albedo / 2 * s->w[j];
            s->R[i][j] = share * minus[i][j];
            s->T[i][j] = share * plus[i][j] + (i == j ? 1 - t / s->mu[i] : 0);
        }
    for (int k = 0; k < DOUBLINGS; k++) {
        ad_multiply(n, s->R, s->R, RR);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) RR[i][j] = (i == j) - RR[i][j];
        ad_solve(n, RR, s->T, X); /* (1 - RR)^-1 T, which commutes with R */
        ad_multiply(n, s->T, X, TX);
        ad_multiply(n, s->R, X, Y);
        ad_multiply(n, s->T, Y, X);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) s->R[i][j] += X[i][j];
        memcpy(s->T, TX, sizeof s->T);
    }
}

static inline void ad_make(struct ad_slab *s, double tau, double albedo, ad_phase *phase,
                           double g, int n_asked, const double *asked)
{
    ad_make_cut(s, tau, albedo, phase, g, n_asked, asked, 0);
}

/* Radiance towards node i under uniform radiance 1 from one side: also the flux that a
 * narrow beam from there gives (reciprocity). */
static inline double ad_row(const struct ad_slab *s, const ad_matrix A, int i)
{
    double sum = 0;
    for (int j = 0; j < s->n; j++) sum += A[i][j];
    return sum;
}
/* The same in all directions, as a part of the flux. */
static inline double ad_flux(const struct ad_slab *s, const ad_matrix A)
{
    double sum = 0;
    for (int i = 0; i < s->n; i++) sum += 2 * s->mu[i] * s->w[i] * ad_row(s, A, i);
    return sum;
}

/* Unpolarised reflectance, from inside index n, at cosine mu there. */
static inline double ad_fresnel(double n, double mu)
{
    const double sin2 = n * n * (1 - mu * mu);
    if (sin2 >= 1) return 1;
    const double out = sqrt(1 - sin2), s = (n * mu - out) / (n * mu + out),
                 p = (mu - n * out) / (mu + n * out);
    return (s * s + p * p) / 2;
}

/* A slab between smooth boundaries of index n, under uniform radiance 1 from one side:
 * radiance that leaves it at cosine mu outside, on that side (mirrored light included) and
 * on the other. */
static inline void ad_behind_glass(double n, double tau, double albedo, ad_phase *phase,
                                   double g, double mu, double *reflected,
                                   double *transmitted)
{
    static struct ad_slab s;
    const double inside = sqrt(1 - (1 - mu * mu) / (n * n));
    double F[AD_MAX], in[AD_MAX], down[AD_MAX], up[AD_MAX] = {0}, low[AD_MAX] = {0};
    ad_make_cut(&s, tau, albedo, phase, g, 1, &inside, sqrt(1 - 1 / (n * n)));
    const int m = s.n;
    for (int i = 0; i < m; i++) {
        F[i] = ad_fresnel(n, s.mu[i]);
        in[i] = (1 - F[i]) * n * n;
    }
    /* up: at the top; low: downwards at the bottom. Both boundaries mirror in turn. */
    for (int k = 0; k < 20000; k++) {
        double change = 0, next_up[AD_MAX] = {0}, next_low[AD_MAX] = {0};
        for (int i = 0; i < m; i++) down[i] = in[i] + F[i] * up[i];
        for (int i = 0; i < m; i++) {
            for (int j = 0; j < m; j++) {
                next_up[i] += s.R[i][j] * down[j] + s.T[i][j] * F[j] * low[j];
                next_low[i] += s.T[i][j] * down[j] + s.R[i][j] * F[j] * low[j];
            }
            change = fmax(change, fabs(next_up[i] - up[i]) + fabs(next_low[i] - low[i]));
        }
        memcpy(up, next_up, sizeof up);
        memcpy(low, next_low, sizeof low);
        if (change < 1e-13) break;
    }
    const int asked = m - 1;
    *reflected = F[asked] + (1 - F[asked]) / (n * n) * up[asked];
    *transmitted = (1 - F[asked]) / (n * n) * low[asked];
}

#endif
