/* SPDX-License-Identifier: Apache-2.0 */
#include "bend_tape.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NONE UINT32_MAX

struct op {
    double da, db;
    uint32_t a, b;
};
typedef struct {
    double v;
    uint32_t id;
} num;

static struct op *tape;
static size_t used, room, n_theta;

static num push(double v, num a, double da, num b, double db)
{
    if (a.id == NONE && b.id == NONE) return (num){v, NONE}; /* a constant */
    if (used == room) {
        room = room ? 2 * room : 1 << 20;
        tape = realloc(tape, room * sizeof *tape);
        if (!tape || room > UINT32_MAX - n_theta) {
            fprintf(stderr, "bend_tape: the tape is full\n");
            exit(3);
        }
    }
    tape[used] = (struct op){da, db, a.id, b.id};
    return (num){v, (uint32_t)(n_theta + used++)};
}
static num C(double v) { return (num){v, NONE}; }
static num add(num a, num b) { return push(a.v + b.v, a, 1, b, 1); }
static num sub(num a, num b) { return push(a.v - b.v, a, 1, b, -1); }
static num mul(num a, num b) { return push(a.v * b.v, a, b.v, b, a.v); }
static num quo(num a, num b)
{
    return push(a.v / b.v, a, 1 / b.v, b, -a.v / (b.v * b.v));
}

struct grid {
    const double *theta;
    int side, cubic;
    double half, inv_h;
};

static void weights(const struct grid *g, num u, num w[4], num d[4])
{
    const num k = C(g->inv_h), m = sub(C(1), u);
    if (!g->cubic) {
        w[0] = m, w[1] = u, d[0] = C(-g->inv_h), d[1] = k;
        return;
    }
    const num u2 = mul(u, u), u3 = mul(u2, u), m2 = mul(m, m), sixth = C(1.0 / 6),
              half = C(0.5);
    w[0] = mul(sixth, mul(m2, m));
    w[1] = mul(sixth, add(sub(mul(C(3), u3), mul(C(6), u2)), C(4)));
    w[2] = mul(sixth, add(add(sub(mul(C(3), u2), mul(C(3), u3)), mul(C(3), u)), C(1)));
    w[3] = mul(sixth, u3);
    d[0] = mul(mul(C(-0.5), m2), k);
    d[1] = mul(mul(half, sub(mul(C(3), u2), mul(C(4), u))), k);
    d[2] = mul(mul(half, add(sub(mul(C(2), u), mul(C(3), u2)), C(1))), k);
    d[3] = mul(mul(half, u2), k);
}

static void field(const struct grid *g, const num x[3], num *eta, num grad[3])
{
    const int m = g->cubic ? 4 : 2, cells = g->side - (g->cubic ? 3 : 1);
    num w[3][4], d[3][4];
    int first[3];
    for (int k = 0; k < 3; k++) {
        const num u = mul(add(x[k], C(g->half)), C(g->inv_h));
        first[k] = (int)fmin(fmax(u.v, 0), cells - 1);
        weights(g, sub(u, C(first[k])), w[k], d[k]);
    }
    *eta = grad[0] = grad[1] = grad[2] = C(0);
    for (int c = 0; c < m; c++)
        for (int b = 0; b < m; b++) {
            const num ww = mul(w[1][b], w[2][c]), dw = mul(d[1][b], w[2][c]),
                      wd = mul(w[1][b], d[2][c]);
            num row = C(0), slope = C(0);
            for (int a = 0; a < m; a++) {
                const size_t i =
                    (size_t)(first[0] + a) +
                    (size_t)g->side * ((size_t)(first[1] + b) +
                                       (size_t)g->side * (size_t)(first[2] + c));
                const num t = {g->theta[i], (uint32_t)i};
                row = add(row, mul(t, w[0][a]));
                slope = add(slope, mul(t, d[0][a]));
            }
            *eta = add(*eta, mul(row, ww));
            grad[0] = add(grad[0], mul(slope, ww));
            grad[1] = add(grad[1], mul(row, dw));
            grad[2] = add(grad[2], mul(row, wd));
        }
}

static void step(const struct grid *g, num t, num x[3], num v[3])
{
    num eta, grad[3];
    for (int k = 0; k < 3; k++) x[k] = add(x[k], mul(mul(C(0.5), t), v[k]));
    field(g, x, &eta, grad);
    for (int k = 0; k < 3; k++) v[k] = add(v[k], mul(t, mul(eta, grad[k])));
    for (int k = 0; k < 3; k++) x[k] = add(x[k], mul(mul(C(0.5), t), v[k]));
}

void tape_gradient(const double *theta, int side, int cubic, double half, size_t n,
                   double (*x0)[3], double (*d0)[3], double t, double plane, double *bar,
                   struct tape_cost *cost)
{
    const int cells = side - (cubic ? 3 : 1);
    struct grid g = {theta, side, cubic, half, cells / (2 * half)};
    n_theta = (size_t)side * (size_t)side * (size_t)side;
    used = 0;
    num *ends = malloc(3 * n * sizeof *ends);
    for (size_t i = 0; i < n; i++) {
        num x[3], v[3], eta, grad[3];
        for (int k = 0; k < 3; k++) x[k] = C(x0[i][k]);
        field(&g, x, &eta, grad);
        for (int k = 0; k < 3; k++) v[k] = mul(eta, C(d0[i][k]));
        for (;;) {
            num y[3] = {x[0], x[1], x[2]}, w[3] = {v[0], v[1], v[2]};
            const size_t mark = used;
            step(&g, C(t), y, w);
            if (y[2].v > plane) {
                used = mark;
                break;
            }
            memcpy(x, y, sizeof y);
            memcpy(v, w, sizeof w);
        }
        /* Newton for the fractional step, off the tape; one more on it brings d tau. */
        double tau = 0.5 * t, e = 1e-7 * t;
        for (int it = 0; it < 60; it++) {
            const size_t mark = used;
            double z[2];
            for (int s = 0; s < 2; s++) {
                num y[3] = {x[0], x[1], x[2]}, w[3] = {v[0], v[1], v[2]};
                step(&g, C(tau + (s ? e : 0)), y, w);
                z[s] = y[2].v - plane;
            }
            used = mark;
            const double move = z[0] / ((z[1] - z[0]) / e);
            tau -= move;
            if (fabs(move) < 1e-15 * t) break;
        }
        num y[3] = {x[0], x[1], x[2]}, w[3] = {v[0], v[1], v[2]};
        step(&g, C(tau), y, w);
        const size_t mark = used;
        double
            rate; /* dz/dtau by reading the tape of a step whose length is a variable */
        {
            num a[3] = {C(x[0].v), C(x[1].v), C(x[2].v)},
                b[3] = {C(v[0].v), C(v[1].v), C(v[2].v)};
            const num var = push(tau, (num){0, 0}, 0, C(0), 0);
            step(&g, var, a, b);
            const size_t m = used - mark;
            double *s = calloc(m, sizeof *s);
            s[a[2].id - n_theta - mark] = 1;
            for (size_t q = m; q-- > 1;) {
                const struct op *o = &tape[mark + q];
                if (o->a != NONE && o->a >= n_theta + mark)
                    s[o->a - n_theta - mark] += s[q] * o->da;
                if (o->b != NONE && o->b >= n_theta + mark)
                    s[o->b - n_theta - mark] += s[q] * o->db;
            }
            rate = s[0];
            free(s);
            used = mark;
        }
        const num length = sub(C(tau), quo(sub(y[2], C(plane)), C(rate)));
        num z[3] = {x[0], x[1], x[2]}, u[3] = {v[0], v[1], v[2]};
        step(&g, length, z, u);
        for (int k = 0; k < 3; k++) ends[3 * i + (size_t)k] = z[k];
    }
    cost->bytes =
        (double)used * (sizeof *tape + sizeof(double)); /* with one adjoint each */
    double *s = calloc(n_theta + used, sizeof *s);
    for (size_t i = 0; i < 3 * n; i++)
        if (ends[i].id != NONE) s[ends[i].id] += 1;
    for (size_t q = used; q-- > 0;) {
        const double b = s[n_theta + q];
        if (b == 0) continue;
        if (tape[q].a != NONE) s[tape[q].a] += b * tape[q].da;
        if (tape[q].b != NONE) s[tape[q].b] += b * tape[q].db;
    }
    for (size_t i = 0; i < n_theta; i++) bar[i] += s[i];
    free(s), free(ends), free(tape);
    tape = NULL;
    room = 0;
}
