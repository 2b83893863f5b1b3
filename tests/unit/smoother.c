/* SPDX-License-Identifier: Apache-2.0
 *
 * Smooth steps of a mesh against elimination in a full matrix: a sheet that is cut along a column of
 * vertices, so that these are there twice, with a border that is held. */
#include "search/smoother.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <string.h>

enum { SIDE = 6, VERTICES = SIDE * SIDE + SIDE, TRIANGLES = 2 * (SIDE - 1) * (SIDE - 1) };
static imp_context *ctx;
static uint32_t indices[3 * TRIANGLES], place[VERTICES];
static bool held[VERTICES];

/* Vertex (x, y); column 2 is there again for what lies to its right. */
static uint32_t vertex(int x, int y, bool right)
{
    return (uint32_t)(right && x == 2 ? SIDE * SIDE + y : y * SIDE + x);
}

static void sheet_make(void)
{
    uint32_t *i = indices;
    for (int y = 0; y + 1 < SIDE; y++)
        for (int x = 0; x + 1 < SIDE; x++) {
            const bool right = x >= 2;
            const uint32_t a = vertex(x, y, right), b = vertex(x + 1, y, right),
                           c = vertex(x + 1, y + 1, right), d = vertex(x, y + 1, right);
            const uint32_t own[6] = {a, b, c, a, c, d};
            memcpy(i, own, sizeof own);
            i += 6;
        }
    for (uint32_t v = 0; v < VERTICES; v++)
        place[v] = v < SIDE * SIDE ? v : vertex(2, (int)v - SIDE * SIDE, false);
    for (int y = 0; y < SIDE; y++) held[vertex(0, y, false)] = true;
}

/* x of M x = b by elimination, of places; M = I + lambda L, held ones without a row. */
static void exact(double lambda, const double *b, double *x)
{
    static double m[VERTICES][VERTICES + 1];
    bool joined[VERTICES][VERTICES] = {{false}};
    memset(m, 0, sizeof m);
    for (int k = 0; k < 3 * TRIANGLES; k++) {
        const uint32_t p = place[indices[k]],
                       q = place[indices[k % 3 == 2 ? k - 2 : k + 1]];
        joined[p][q] = joined[q][p] = true;
    }
    for (int p = 0; p < VERTICES; p++) {
        m[p][p] = 1;
        if (place[p] != (uint32_t)p || held[p]) continue;
        m[p][VERTICES] = b[p];
        for (int q = 0; q < VERTICES; q++) {
            if (!joined[p][q]) continue;
            m[p][p] += lambda;
            if (!held[q]) m[p][q] -= lambda;
        }
    }
    for (int p = 0; p < VERTICES; p++)
        for (int q = 0; q < VERTICES; q++) {
            const double factor = q == p ? 0 : m[q][p] / m[p][p];
            for (int k = 0; factor != 0 && k <= VERTICES; k++)
                m[q][k] -= factor * m[p][k];
        }
    for (int p = 0; p < VERTICES; p++) x[p] = m[p][VERTICES] / m[p][p];
}

static void solve_test(const struct imp__smoother *s, double lambda)
{
    double step[3 * VERTICES], g[3 * VERTICES], sum[VERTICES], ref[VERTICES];
    double worst[2] = {0};
    for (uint32_t k = 0; k < 3 * VERTICES; k++) {
        g[k] = imp__u01(imp__key(1, 0, k), 0) - 0.5;
        step[k] = imp__u01(imp__key(2, 0, 3 * place[k / 3] + k % 3), 0) - 0.5;
    }
    double given[2][3 * VERTICES];
    memcpy(given[0], g, sizeof g);
    memcpy(given[1], step, sizeof step);
    imp__smoother_derivative(s, g);
    imp__smoother_step(s, step);
    for (int i = 0; i < 6; i++) {
        memset(sum, 0, sizeof sum);
        for (int v = 0; v < VERTICES; v++)
            if (i < 3) sum[place[v]] += given[0][3 * v + i];
            else sum[place[v]] = given[1][3 * v + i - 3];
        exact(lambda, sum, ref);
        for (int v = 0; v < VERTICES; v++) {
            const double found = i < 3 ? g[3 * v + i] : step[3 * v + i - 3];
            const double off = fabs(found - ref[place[v]]);
            worst[i / 3] = fmax(worst[i / 3], off);
        }
    }
    tap_ok(worst[0] < 1e-13, "derivatives, lambda %g # %.1e", lambda, worst[0]);
    tap_ok(worst[1] < 1e-13, "steps, lambda %g # %.1e", lambda, worst[1]);
}

int main(void)
{
    static const double lambdas[] = {0.5, 19, 1000};
    ctx = test_context(1);
    sheet_make();
    struct imp__smooth_mesh mesh = {VERTICES, TRIANGLES, indices, place, held, 1};
    struct imp__smoother *s;
    if (imp__smoother_create(ctx, &mesh, &s) == IMP_E_UNSUPPORTED) {
        tap_skip("smooth steps", "this build has no CXSparse");
        imp_context_destroy(ctx);
        return tap_done();
    }
    imp__smoother_destroy(ctx, s);
    for (int k = 0; k < 3; k++) {
        mesh.lambda = lambdas[k];
        test_must(ctx, imp__smoother_create(ctx, &mesh, &s));
        solve_test(s, mesh.lambda);
        imp__smoother_destroy(ctx, s);
    }
    mesh.held = NULL;
    test_must(ctx, imp__smoother_create(ctx, &mesh, &s));
    double shift[3 * VERTICES], off = 0;
    for (int k = 0; k < 3 * VERTICES; k++) shift[k] = 1 + k % 3;
    imp__smoother_step(s, shift);
    for (int k = 0; k < 3 * VERTICES; k++) off = fmax(off, fabs(shift[k] - 1 - k % 3));
    tap_ok(off < 1e-12, "a shift of the whole mesh stays as it is # %.1e", off);
    imp__smoother_destroy(ctx, s);
    bool all[VERTICES];
    memset(all, 1, sizeof all);
    mesh.held = all;
    test_must(ctx, imp__smoother_create(ctx, &mesh, &s));
    imp__smoother_step(s, shift);
    off = 0;
    for (int k = 0; k < 3 * VERTICES; k++) off = fmax(off, fabs(shift[k]));
    tap_ok(off == 0, "what is held stays");
    imp__smoother_destroy(ctx, s);
    imp_context_destroy(ctx);
    return tap_done();
}
