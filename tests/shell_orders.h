/* SPDX-License-Identifier: Apache-2.0
 *
 * Light in a shell of air around a black ball, by successive orders of scattering on a grid:
 * the truth about a Rayleigh sky, without a random number. Density falls as exp(-h/H), the
 * sun is a direction s with irradiance 1, nothing is absorbed.
 *
 * Rayleigh's phase function is a quadratic in directions, so that what a point scatters,
 *
 *     J(x, w) = 3/(16 pi) (trace B + w^T B w),    B(x) = Int L(x, v) v v^T dv,
 *
 * depends on one symmetric matrix, and that on height and on the angle to s alone. In the
 * frame (up, towards the sun, across) of x the products of `across` with the others vanish by
 * symmetry: four numbers are left. The n-th order has
 *
 *     L_n(x, v) = Int sigma(y) T(x, y) J_{n-1}(y) dy   along x - v */
#ifndef IMP_SHELL_ORDERS_H
#define IMP_SHELL_ORDERS_H

#include <math.h>
#include <string.h>

enum {
    SHELL_H = 26,
    SHELL_ANGLE = 44,
    SHELL_UP = 10,
    SHELL_AROUND = 8,
    SHELL_STEPS = 56
};

struct shell {
    double R, H, top,
        sigma; /* of the ball; scale height; shell; extinction at height 0 */
};
/* B without the sun's own light, at heights top (i/(n-1))^2, angles to s evenly to pi. */
struct shell_field {
    double up_up, up_sun, sun_sun, across_across;
};
struct shell_light {
    struct shell of;
    struct shell_field sum[SHELL_H][SHELL_ANGLE]; /* of all orders */
};
/* In the plane of s = (0, 1) and x = (sin a, cos a) r; directions have a third part. */
struct shell_v3 {
    double x, y, z;
};

static inline double shell_height(const struct shell *p, struct shell_v3 x)
{
    return fmax(sqrt(x.x * x.x + x.y * x.y + x.z * x.z) - p->R, 0);
}
/* To the end of the shell, or to the ball: then *ground. */
static inline double shell_reach(const struct shell *p, struct shell_v3 x,
                                 struct shell_v3 d, int *ground)
{
    const double b = x.x * d.x + x.y * d.y + x.z * d.z,
                 rr = x.x * x.x + x.y * x.y + x.z * x.z, T = p->R + p->top;
    const double low = b * b - rr + p->R * p->R;
    *ground = b < 0 && low > 0;
    if (*ground) return fmax(-b - sqrt(low), 0);
    return -b + sqrt(fmax(b * b - rr + T * T, 0));
}
static inline struct shell_v3 shell_on(struct shell_v3 x, struct shell_v3 d, double t)
{
    return (struct shell_v3){x.x + t * d.x, x.y + t * d.y, x.z + t * d.z};
}
/* Steps are short near the start, where the air is often densest. */
static inline double shell_step(double reach, int i, int n, double *dt)
{
    const double u = (i + .5) / n;
    *dt = reach * 2 * u / n;
    return reach * u * u;
}
static inline double shell_sun(const struct shell *p, struct shell_v3 x)
{
    const struct shell_v3 s = {0, 1, 0};
    int ground;
    double depth = 0, dt;
    const double reach = shell_reach(p, x, s, &ground);
    if (ground) return 0;
    for (int i = 0; i < SHELL_STEPS; i++) {
        const double t = shell_step(reach, i, SHELL_STEPS, &dt);
        depth += dt * exp(-shell_height(p, shell_on(x, s, t)) / p->H);
    }
    return exp(-p->sigma * depth);
}

/* trace B + w^T B w of a field at x, interpolated. */
static inline double shell_source(const struct shell *p,
                                  struct shell_field f[SHELL_H][SHELL_ANGLE],
                                  struct shell_v3 x, struct shell_v3 w)
{
    const double r = sqrt(x.x * x.x + x.y * x.y + x.z * x.z), across = hypot(x.x, x.z);
    const double h = sqrt(fmin(fmax(r - p->R, 0) / p->top, 1)) * (SHELL_H - 1),
                 a = atan2(across, x.y) / M_PI * (SHELL_ANGLE - 1);
    const int i = (int)fmin(h, SHELL_H - 2), j = (int)fmin(a, SHELL_ANGLE - 2);
    const double u = h - i, v = a - j;
    const double weight[4] = {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v};
    double uu = 0, us = 0, ss = 0, aa = 0;
    for (int k = 0; k < 4; k++) {
        const struct shell_field *g = &f[i + k / 2][j + k % 2];
        uu += weight[k] * g->up_up, us += weight[k] * g->up_sun;
        ss += weight[k] * g->sun_sun, aa += weight[k] * g->across_across;
    }
    /* The frame at x: up = (out sin, cos), towards the sun = (-out cos, sin). */
    const double sine = across / r, cosine = x.y / r;
    const double ox = across > 0 ? x.x / across : 1, oz = across > 0 ? x.z / across : 0;
    const double out = w.x * ox + w.z * oz;
    const double up = out * sine + w.y * cosine, sun = -out * cosine + w.y * sine,
                 side = w.z * ox - w.x * oz;
    return uu + ss + aa + up * up * uu + 2 * up * sun * us + sun * sun * ss +
           side * side * aa;
}

/* Radiance that arrives at x from direction d; `f`: NULL: of the sun's light, scattered
 * once. */
static inline double shell_radiance(const struct shell *p,
                                    struct shell_field f[SHELL_H][SHELL_ANGLE],
                                    struct shell_v3 x, struct shell_v3 d, int steps)
{
    int ground;
    const double reach = shell_reach(p, x, d, &ground);
    double depth = 0, sum = 0, dt;
    for (int i = 0; i < steps; i++) {
        const struct shell_v3 y = shell_on(x, d, shell_step(reach, i, steps, &dt));
        const double k = p->sigma * exp(-shell_height(p, y) / p->H) * dt;
        const double source =
            f ? shell_source(p, f, y, d) : shell_sun(p, y) * (1 + d.y * d.y);
        sum += source * exp(-depth - k / 2) * k;
        depth += k;
    }
    return 3 / (16 * M_PI) * sum;
}

/* All orders from the second on are in l->sum as what scatters; `orders` of them. */
static inline void shell_solve(struct shell_light *l, int orders)
{
    static struct shell_field before[SHELL_H][SHELL_ANGLE], now[SHELL_H][SHELL_ANGLE];
    const struct shell *p = &l->of;
    memset(l->sum, 0, sizeof l->sum);
    for (int n = 0; n < orders; n++) {
        for (int i = 0; i < SHELL_H; i++)
            for (int j = 0; j < SHELL_ANGLE; j++) {
                const double r = p->R + p->top * pow(i / (SHELL_H - 1.), 2),
                             a = M_PI * j / (SHELL_ANGLE - 1);
                const double sine = sin(a), cosine = cos(a);
                const struct shell_v3 x = {r * sine, r * cosine, 0};
                struct shell_field *g = &now[i][j];
                *g = (struct shell_field){0};
                /* Above and below the horizon. */
                const double horizon = -sqrt(fmax(1 - pow(p->R / r, 2), 0));
                for (int half = 0; half < 2; half++)
                    for (int u = 0; u < SHELL_UP; u++)
                        for (int v = 0; v < SHELL_AROUND; v++) {
                            /* Dense near the horizon. */
                            const double q = (u + .5) / SHELL_UP,
                                         room = half ? 1 - horizon : 1 + horizon;
                            const double mu = horizon + (half ? 1 : -1) * room * q * q;
                            const double phi = M_PI * (v + .5) / SHELL_AROUND;
                            const double weight = room * 2 * q / SHELL_UP * 2 * M_PI /
                                                  SHELL_AROUND,
                                         flat = sqrt(fmax(1 - mu * mu, 0));
                            const double sun = flat * cos(phi), side = flat * sin(phi);
                            const struct shell_v3 d = {mu * sine - sun * cosine,
                                                       mu * cosine + sun * sine, side};
                            const double L =
                                weight *
                                shell_radiance(p, n ? before : NULL, x, d,
                                               n ? SHELL_STEPS : SHELL_STEPS / 2);
                            g->up_up += L * mu * mu;
                            g->up_sun += L * mu * sun;
                            g->sun_sun += L * sun * sun;
                            g->across_across += L * side * side;
                        }
            }
        memcpy(before, now, sizeof before);
        for (int i = 0; i < SHELL_H; i++)
            for (int j = 0; j < SHELL_ANGLE; j++) {
                l->sum[i][j].up_up += now[i][j].up_up;
                l->sum[i][j].up_sun += now[i][j].up_sun;
                l->sum[i][j].sun_sun += now[i][j].sun_sun;
                l->sum[i][j].across_across += now[i][j].across_across;
            }
    }
}

#endif
