/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of all directions from one projection to another, with the light of the map as
 * it is interpolated kept. For a map sum L_k hat_k, texel i of the new one is
 *
 *     L_i = (Int psi_i sum L_k hat_k dw) / (Int hat_i dw),    sum_i psi_i = 1,
 *
 * so that sum L_i Int hat_i dw = sum L_k Int hat_k dw. Along a column psi_i is the hat of
 * the new row, or, where all texels have the same solid angle, its box. Along a row both
 * are boxes: pictures of the same width keep their columns. */
#include "base/arguments.h"
#include "base/film.h"
#include "kind/emitter/sphere_map.h"
#include "math/quadrature.h"
#include <stdio.h>
#include <string.h>

enum { NODES = 8 };

/* theta of a row coordinate, in [0, pi]. */
static double theta_of(const struct imp__sphere_map *m, double row)
{
    if (m->projection == IMP_LATLONG) return IMP_PI * row / (m->height - 1);
    return acos(imp_clamp(1 - 2 * (row + 0.5) / m->height, -1.0, 1.0));
}
static double row_of(const struct imp__sphere_map *m, double theta)
{
    const double row = m->projection == IMP_LATLONG
                           ? theta * IMP_INV_PI * (m->height - 1)
                           : (1 - cos(theta)) * 0.5 * m->height - 0.5;
    return imp_clamp(row, 0.0, m->height - 1.0);
}

/* Adds Int psi_i hat_k sin(theta) dtheta over a piece without kinks to weight[k]. */
static void piece_add(const struct imp__sphere_map *from,
                      const struct imp__sphere_map *to, int i, double theta0,
                      double theta1, double *weight)
{
    double x[NODES], w[NODES];
    if (!(theta1 > theta0)) return;
    imp__gauss_legendre(NODES, theta0, theta1, x, w);
    for (int n = 0; n < NODES; n++) {
        const double psi =
            to->projection == IMP_LATLONG ? fmax(0, 1 - fabs(row_of(to, x[n]) - i)) : 1;
        const double row = row_of(from, x[n]);
        const int k = imp_min((int)row, from->height - 2);
        const double f = row - k, part = w[n] * psi * sin(x[n]);
        weight[k] += part * (1 - f);
        weight[k + 1] += part * f;
    }
}

/* Row i of the new map from all rows of the old: weight [from->height]. */
static void row_weights(const struct imp__sphere_map *from,
                        const struct imp__sphere_map *to, int i, double *weight)
{
    const double reach = to->projection == IMP_LATLONG ? 1 : 0.5;
    const double lo = to->projection == IMP_LATLONG ? 0 : -0.5;
    const double borders[3] = {theta_of(to, fmax(i - reach, lo)), theta_of(to, i),
                               theta_of(to, fmin(i + reach, to->height - 1 - lo))};
    const double all = imp__sphere_map_weight(to, i) * to->width * (IMP_INV_PI / 2);
    memset(weight, 0, (size_t)from->height * sizeof *weight);
    for (int b = 0; b < 2; b++) {
        double at = borders[b];
        /* The kinks of the old map in between: the centres of its rows. */
        for (int k = (int)ceil(row_of(from, at)); k < from->height; k++) {
            const double kink = theta_of(from, k);
            if (kink <= at) continue;
            if (kink >= borders[b + 1]) break;
            piece_add(from, to, i, at, kink, weight);
            at = kink;
        }
        piece_add(from, to, i, at, borders[b + 1], weight);
    }
    for (int k = 0; k < from->height; k++) weight[k] /= all;
}

/* One row of `from` columns, boxes, as `to` columns: means over their boxes. */
static void columns_mean(const float *in, int from, double *out, int to, int channels)
{
    memset(out, 0, (size_t)to * (size_t)channels * sizeof *out);
    for (int j = 0; j < to; j++) {
        const double u0 = (double)j * from / to, u1 = (double)(j + 1) * from / to;
        for (int k = (int)u0; k < from && k < u1; k++) {
            const double part = (fmin(u1, k + 1) - fmax(u0, k)) / (u1 - u0);
            for (int c = 0; c < channels; c++)
                out[j * channels + c] +=
                    part * (double)in[(size_t)k * (size_t)channels + (size_t)c];
        }
    }
}

static bool projection_known(enum imp_sky_projection p)
{
    return p == IMP_LATLONG || p == IMP_EQUAL_AREA;
}

enum imp_status imp_film_project(const imp_film *map, enum imp_sky_projection from,
                                 enum imp_sky_projection to, int width, int height,
                                 imp_film **out)
{
    enum imp_status st = IMP_OK;
    double *weight = NULL, *rows = NULL, *sum = NULL;
    char *names = NULL;
    imp_film *made = NULL;
    IMP_REQUIRE(NULL, map, "map");
    IMP_REQUIRE(map->ctx, out, "out");
    IMP_FLOAT_MODE;
    imp_context *ctx = map->ctx;
    *out = NULL;
    if (!projection_known(from) || !projection_known(to))
        return imp__error(ctx, IMP_E_ARG, "imp_film_project: no such projection");
    if (map->width < 2 || map->height < 2 || width < 2 || height < 2 ||
        width > IMP_FILM_SIDE_MAX || height > IMP_FILM_SIDE_MAX)
        return imp__error(ctx, IMP_E_ARG,
                          "imp_film_project: width x height = %d x %d from %d x %d: maps "
                          "are at least 2 x 2",
                          width, height, map->width, map->height);
    const struct imp__sphere_map old = {from, map->width, map->height},
                                 new = {to, width, height};
    const size_t channels = (size_t)map->channels, n = (size_t)width * channels;
    size_t length = 1;
    for (int c = 0; c < map->channels; c++) length += strlen(map->names[c]) + 1;
    names = imp__alloc(ctx, length, 1);
    weight = imp__alloc(ctx, (size_t)old.height, sizeof *weight);
    rows = imp__alloc(ctx, (size_t)old.height * n, sizeof *rows);
    sum = imp__alloc(ctx, n, sizeof *sum);
    if (!names || !weight || !rows || !sum)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a projection"));
    for (int c = 0; c < map->channels; c++) {
        if (c) strcat(names, ",");
        strcat(names, map->names[c]);
    }
    IMP_TRY(imp_film_create(ctx, width, height, names, &made));
    for (int i = 0; i < old.height; i++)
        columns_mean(map->mean + (size_t)i * (size_t)old.width * channels, old.width,
                     rows + (size_t)i * n, width, map->channels);
    for (int i = 0; i < height; i++) {
        row_weights(&old, &new, i, weight);
        memset(sum, 0, n * sizeof *sum);
        for (int k = 0; k < old.height; k++)
            for (size_t j = 0; j < n && weight[k] != 0; j++)
                sum[j] += weight[k] * rows[(size_t)k * n + j];
        for (size_t j = 0; j < n; j++) made->mean[(size_t)i * n + j] = (float)sum[j];
    }
    *out = made;
    made = NULL;
out:
    imp_film_destroy(made);
    imp__release(ctx, names);
    imp__release(ctx, weight);
    imp__release(ctx, rows);
    imp__release(ctx, sum);
    return st;
}
