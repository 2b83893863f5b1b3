/* SPDX-License-Identifier: Apache-2.0
 *
 * Analytic materials in the format of the RGL database: facets of GGX, whose reflectance S
 * is a smooth function of the place in the square, of the direction of sight and of the
 * wavelength. */
#ifndef IMP_MEASURED_H
#define IMP_MEASURED_H

#include "base/props.h"
#include "math/vec.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    RGL_THETAS = 4,
    RGL_PHIS = 5, /* at most */
    RGL_ROWS = 10,
    RGL_COLUMNS = 14,
    RGL_SIDE = 7,
    RGL_WAVES = 4
};
struct rgl_model {
    double alpha[2];
    int fold; /* 0: isotropic; 1, 2, 4: wo by whole, half, quarter turns */
    bool rgb, spectra, jacobian;
};
struct rgl_tables {
    struct imp_measured_data data;
    float theta[RGL_THETAS], phi[RGL_PHIS], wavelength[RGL_WAVES];
    float ndf[RGL_ROWS * RGL_COLUMNS], sigma[RGL_ROWS * RGL_COLUMNS];
    float vndf[RGL_PHIS * RGL_THETAS * RGL_ROWS * RGL_COLUMNS];
    float luminance[RGL_PHIS * RGL_THETAS * RGL_SIDE * RGL_SIDE];
    float rgb[RGL_PHIS * RGL_THETAS * 3 * RGL_SIDE * RGL_SIDE];
    float spectra[RGL_PHIS * RGL_THETAS * RGL_WAVES * RGL_SIDE * RGL_SIDE];
};

static inline imp_v3 rgl_direction(double theta, double phi)
{
    return imp__v3(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
}
/* Node i of columns and j of rows. */
static inline imp_v3 rgl_node(int i, int j, double *theta)
{
    const double u = i / (RGL_COLUMNS - 1.0);
    *theta = u * u * IMP_PI / 2;
    return rgl_direction(*theta, (2 * j / (RGL_ROWS - 1.0) - 1) * IMP_PI);
}
static inline double rgl_facets(const struct rgl_model *m, imp_v3 h)
{
    const double x = h[0] / m->alpha[0], y = h[1] / m->alpha[1];
    const double s = x * x + y * y + h[2] * h[2];
    return 1 / (IMP_PI * m->alpha[0] * m->alpha[1] * s * s);
}
static inline double rgl_sigma(const struct rgl_model *m, imp_v3 w)
{
    const double x = m->alpha[0] * w[0], y = m->alpha[1] * w[1];
    return 0.5 * (w[2] + sqrt(w[2] * w[2] + x * x + y * y));
}
/* S at x, for wo; c from 0 (red) to 1 (blue). At most 0.8. */
static inline double rgl_reflectance(const double x[2], double theta, double phi,
                                     double c)
{
    return (0.7 - 0.4 * c) *
           (0.75 + 0.2 * cos(3 * x[0] + theta + c) * x[1] + 0.1 * sin(2 * phi) * theta);
}

static inline void rgl_fill(const struct rgl_model *m, struct rgl_tables *t)
{
    const int phis = m->fold == 0 ? 1 : m->fold == 4 ? 3 : RGL_PHIS;
    *t = (struct rgl_tables){
        .data = {.n_theta = RGL_THETAS,
                 .n_phi = phis,
                 .n_wave = m->spectra ? RGL_WAVES : 0,
                 .side = RGL_SIDE,
                 .ndf = {RGL_ROWS, RGL_COLUMNS},
                 .sigma = {RGL_ROWS, RGL_COLUMNS},
                 .vndf = {RGL_ROWS, RGL_COLUMNS},
                 .rgb = m->rgb,
                 .jacobian = m->jacobian,
                 .table = {t->theta, t->phi, t->ndf, t->sigma, t->vndf, t->luminance,
                           m->spectra ? t->wavelength : NULL, m->rgb ? t->rgb : NULL,
                           m->spectra ? t->spectra : NULL}}};
    for (int k = 0; k < RGL_THETAS; k++) t->theta[k] = (float)(1.45 * k / RGL_THETAS);
    for (int k = 0; k < phis && m->fold; k++)
        t->phi[k] = (float)(-IMP_PI + IMP_2PI / m->fold * k / (phis - 1));
    for (int k = 0; k < RGL_WAVES; k++) t->wavelength[k] = (float)(430 + 70 * k);
    for (int j = 0; j < RGL_ROWS; j++)
        for (int i = 0; i < RGL_COLUMNS; i++) {
            double theta;
            const imp_v3 h = rgl_node(i, j, &theta);
            t->ndf[j * RGL_COLUMNS + i] = (float)rgl_facets(m, h);
            t->sigma[j * RGL_COLUMNS + i] = (float)rgl_sigma(m, h);
        }
    for (int d = 0; d < phis * RGL_THETAS; d++) {
        const double theta = (double)t->theta[d % RGL_THETAS],
                     phi = (double)t->phi[d / RGL_THETAS];
        const imp_v3 wo = rgl_direction(theta, phi);
        for (int k = 0; k < RGL_ROWS * RGL_COLUMNS; k++) {
            double theta_h;
            const imp_v3 h = rgl_node(k % RGL_COLUMNS, k / RGL_COLUMNS, &theta_h);
            const double area = k % RGL_COLUMNS / (RGL_COLUMNS - 1.0) * sin(theta_h);
            t->vndf[d * RGL_ROWS * RGL_COLUMNS + k] =
                (float)(rgl_facets(m, h) * fmax(0.01, imp__dot(wo, h)) * area);
        }
        const int square = RGL_SIDE * RGL_SIDE;
        for (int k = 0; k < square; k++) {
            const double x[2] = {k % RGL_SIDE / (RGL_SIDE - 1.0),
                                 k / RGL_SIDE / (RGL_SIDE - 1.0)};
            t->luminance[d * square + k] = (float)rgl_reflectance(x, theta, phi, 0.5);
            for (int c = 0; c < 3; c++)
                t->rgb[(3 * d + c) * square + k] =
                    (float)rgl_reflectance(x, theta, phi, c / 2.0);
            for (int c = 0; c < RGL_WAVES; c++)
                t->spectra[(RGL_WAVES * d + c) * square + k] =
                    (float)rgl_reflectance(x, theta, phi, 1 - c / (RGL_WAVES - 1.0));
        }
    }
}

/* A tensor file; data NULL: the field is left out. */
struct rgl_field {
    const char *name;
    int type, rank;
    uint64_t size[5];
    const void *data;
};
static inline bool rgl_write_fields(const char *path, const struct rgl_field *field,
                                    int n)
{
    uint32_t count = 0;
    uint64_t at = 18;
    FILE *f = fopen(path, "wb");
    if (!f) return false;
    for (int k = 0; k < n; k++)
        if (field[k].data) {
            count++;
            at += 13 + strlen(field[k].name) + 8 * (uint64_t)field[k].rank;
        }
    fwrite("tensor_file\0\1\0", 1, 14, f);
    fwrite(&count, 4, 1, f);
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < n; k++) {
            const struct rgl_field *d = &field[k];
            uint64_t bytes = d->type == 1 ? 1 : 4;
            if (!d->data) continue;
            for (int s = 0; s < d->rank; s++) bytes *= d->size[s];
            if (pass) {
                fwrite(d->data, 1, bytes, f);
                continue;
            }
            const uint16_t length = (uint16_t)strlen(d->name), rank = (uint16_t)d->rank;
            const uint8_t type = (uint8_t)d->type;
            fwrite(&length, 2, 1, f);
            fwrite(d->name, 1, length, f);
            fwrite(&rank, 2, 1, f);
            fwrite(&type, 1, 1, f);
            fwrite(&at, 8, 1, f);
            fwrite(d->size, 8, rank, f);
            at += bytes;
        }
    return fclose(f) == 0;
}

enum { RGL_FIELDS = 11 };
static inline void rgl_fields(const struct rgl_tables *t, struct rgl_field *out)
{
    static const uint8_t numbers[] = {0, 1};
    const struct imp_measured_data *d = &t->data;
    const uint64_t p = (uint64_t)d->n_phi, q = RGL_THETAS, s = RGL_SIDE, w = RGL_WAVES;
    const struct rgl_field fields[RGL_FIELDS] = {
        {"description", 1, 1, {9}, "synthetic"},
        {"jacobian", 1, 1, {1}, &numbers[d->jacobian]},
        {"theta_i", 10, 1, {q}, d->table[0]},
        {"phi_i", 10, 1, {p}, d->table[1]},
        {"ndf", 10, 2, {RGL_ROWS, RGL_COLUMNS}, d->table[2]},
        {"sigma", 10, 2, {RGL_ROWS, RGL_COLUMNS}, d->table[3]},
        {"vndf", 10, 4, {p, q, RGL_ROWS, RGL_COLUMNS}, d->table[4]},
        {"luminance", 10, 4, {p, q, s, s}, d->table[5]},
        {"wavelengths", 10, 1, {w}, d->table[6]},
        {"rgb", 10, 5, {p, q, 3, s, s}, d->table[7]},
        {"spectra", 10, 5, {p, q, w, s, s}, d->table[8]}};
    memcpy(out, fields, sizeof fields);
}
static inline bool rgl_write(const char *path, const struct rgl_model *m)
{
    struct rgl_tables *t = malloc(sizeof *t);
    struct rgl_field field[RGL_FIELDS];
    bool ok = t != NULL;
    if (ok) {
        rgl_fill(m, t);
        rgl_fields(t, field);
        ok = rgl_write_fields(path, field, RGL_FIELDS);
    }
    free(t);
    return ok;
}

#endif
