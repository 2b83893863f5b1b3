/* SPDX-License-Identifier: Apache-2.0
 *
 * Analytic materials in the format of MERL's database: a diffuse part, and facets of GGX
 * with Schlick's Fresnel term. */
#ifndef IMP_MERL_H
#define IMP_MERL_H

#include "base/props.h"
#include "math/vec.h"
#include <stdio.h>
#include <stdlib.h>

struct merl_model {
    double alpha;   /* of the facets; 0: none */
    double diffuse; /* share of the diffuse part */
    double albedo[3];
};

/* rho in 1/sr for half-vector h and directions wo, wi on the front. */
static inline void merl_model_rho(const struct merl_model *m, imp_v3 wo, imp_v3 wi,
                                  double rho[3])
{
    double glossy = 0;
    if (m->alpha > 0) {
        const imp_v3 h = imp__normalize(wo + wi);
        const double a2 = m->alpha * m->alpha, c2 = h[2] * h[2];
        const double d = a2 / (IMP_PI * imp__sqr(c2 * (a2 - 1) + 1));
        double g = 1;
        for (int k = 0; k < 2; k++) {
            const double c = k ? wi[2] : wo[2];
            g *= 2 * c / (c + sqrt(a2 + (1 - a2) * c * c));
        }
        const double miss = 1 - imp__dot(wo, h);
        const double f = 0.04 + 0.96 * miss * miss * miss * miss * miss;
        glossy = d * g * f / (4 * wo[2] * wi[2]);
    }
    for (int c = 0; c < 3; c++)
        rho[c] = m->diffuse * m->albedo[c] * IMP_INV_PI +
                 (1 - m->diffuse) * m->albedo[c] * glossy;
}

/* Directions whose half and difference angles are these. */
static inline void merl_directions(double theta_h, double theta_d, double phi_d,
                                   imp_v3 *wo, imp_v3 *wi)
{
    const imp_v3 h = imp__v3(sin(theta_h), 0, cos(theta_h));
    const imp_v3 across = imp__v3(0, 1, 0), along = imp__cross(across, h);
    const imp_v3 e = (along * cos(phi_d) + across * sin(phi_d)) * sin(theta_d);
    *wi = h * cos(theta_d) + e;
    *wo = h * cos(theta_d) - e;
}

/* Values at the middle of every cell; those below the horizon are 0. */
static inline void merl_fill(int n_half, int n_difference, int n_azimuth,
                             const struct merl_model *m, float *rho)
{
    float *p = rho;
    for (int i = 0; i < n_half; i++)
        for (int j = 0; j < n_difference; j++)
            for (int k = 0; k < n_azimuth; k++, p += 3) {
                const double x = (i + 0.5) / n_half;
                imp_v3 wo, wi;
                double value[3] = {0};
                merl_directions(x * x * IMP_PI / 2, (j + 0.5) / n_difference * IMP_PI / 2,
                                (k + 0.5) / n_azimuth * IMP_PI, &wo, &wi);
                if (wo[2] > 0 && wi[2] > 0) merl_model_rho(m, wo, wi, value);
                for (int c = 0; c < 3; c++) p[c] = (float)value[c];
            }
}

/* As a file; what is below the horizon is -1 there. */
static inline bool merl_write(const char *path, int n_half, int n_difference,
                              int n_azimuth, const struct merl_model *m)
{
    static const double scale[3] = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
    const int32_t n[3] = {n_half, n_difference, n_azimuth};
    const size_t cells = (size_t)n_half * (size_t)n_difference * (size_t)n_azimuth;
    float *rho = malloc(3 * cells * sizeof *rho);
    double *plane = malloc(cells * sizeof *plane);
    FILE *f = fopen(path, "wb");
    bool ok = rho && plane && f;
    if (ok) merl_fill(n_half, n_difference, n_azimuth, m, rho);
    if (ok) ok = fwrite(n, sizeof n, 1, f) == 1;
    for (size_t c = 0; c < 3 && ok; c++) {
        for (size_t k = 0; k < cells; k++)
            plane[k] = rho[3 * k + c] > 0 ? (double)rho[3 * k + c] / scale[c] : -1;
        ok = fwrite(plane, sizeof *plane, cells, f) == cells;
    }
    if (f) ok = fclose(f) == 0 && ok;
    free(rho);
    free(plane);
    return ok;
}

#endif
