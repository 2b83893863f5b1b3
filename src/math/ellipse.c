/* SPDX-License-Identifier: Apache-2.0
 *
 * With theta counted from where |x'| has its largest value a, and b its smallest,
 *
 *     |x'(theta)| = a sqrt(1 - m sin^2 theta),   m = 1 - (b/a)^2                       (1)
 *
 * so that lengths are a E(theta | m), the incomplete elliptic integral of the second kind,
 * here by Carlson's symmetric integrals R_F and R_D (DLMF 19.25.10, 19.36(i)). */
#include "ellipse.h"
#include "base/compiler.h"
#include <math.h>

/* R_F(x, y, z); at most one of them is 0. */
static double carlson_f(double x, double y, double z)
{
    double mean = 0, dx = 1, dy = 1, dz = 1;
    while (fmax(fabs(dx), fmax(fabs(dy), fabs(dz))) >
           2e-3) { /* the rest: its 6th power */
        const double lambda = sqrt(x * y) + sqrt(y * z) + sqrt(z * x);
        x = (x + lambda) / 4;
        y = (y + lambda) / 4;
        z = (z + lambda) / 4;
        mean = (x + y + z) / 3;
        dx = 1 - x / mean;
        dy = 1 - y / mean;
        dz = 1 - z / mean;
    }
    const double e2 = dx * dy - dz * dz, e3 = dx * dy * dz;
    return (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44) / sqrt(mean);
}

/* R_D(x, y, z); at most one of x and y is 0, z is not. */
static double carlson_d(double x, double y, double z)
{
    double mean = 0, dx = 1, dy = 1, dz = 1, sum = 0, share = 1;
    while (fmax(fabs(dx), fmax(fabs(dy), fabs(dz))) > 1e-3) {
        const double lambda = sqrt(x * y) + sqrt(y * z) + sqrt(z * x);
        sum += share / (sqrt(z) * (z + lambda));
        share /= 4;
        x = (x + lambda) / 4;
        y = (y + lambda) / 4;
        z = (z + lambda) / 4;
        mean = (x + y + 3 * z) / 5;
        dx = 1 - x / mean;
        dy = 1 - y / mean;
        dz = 1 - z / mean;
    }
    const double xy = dx * dy, zz = dz * dz, e2 = xy - 6 * zz,
                 e3 = (3 * xy - 8 * zz) * dz, e4 = 3 * (xy - zz) * zz, e5 = xy * zz * dz;
    const double series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 -
                          9 * e2 * e3 / 52 + 3 * e5 / 26;
    return 3 * sum + share * series / (mean * sqrt(mean));
}

/* E(theta | m) of theta in [0, pi/2], where m = 1 - slow2 and *rate is its derivative. */
static double arc(double theta, double slow2, double *rate)
{
    const double s = sin(theta), c = cos(theta), m = 1 - slow2;
    const double d2 = c * c + slow2 * s * s;
    *rate = sqrt(d2);
    return slow2 * s *
               (carlson_f(c * c, d2, 1) + m * s * s * carlson_d(c * c, 1, d2) / 3) +
           m * s * c / *rate;
}

void imp__ellipse(const imp_v3 *p_, const imp_v3 *q_, struct imp_ellipse *out)
{
    /* |x'|^2 = (pp + qq)/2 + (qq - pp)/2 cos(2 phi) - pq sin(2 phi), and a b = |p x q|. */
    const double unit = imp__length(*p_) + imp__length(*q_);
    const imp_v3 p = *p_ * (1 / unit), q = *q_ * (1 / unit);
    const double pp = imp__dot(p, p), qq = imp__dot(q, q), pq = imp__dot(p, q);
    const double a2 = (pp + qq) / 2 + hypot((qq - pp) / 2, pq);
    *out = (struct imp_ellipse){
        .start = atan2(-pq, (qq - pp) / 2) / 2,
        .slow2 = fmin(imp__sqr(imp__length(imp__cross(p, q)) / a2), 1)};
    double rate;
    out->quarter = arc(IMP_PI / 2, out->slow2, &rate);
    out->length = 4 * out->quarter * sqrt(a2) * unit;
}

/* Newton's rule, kept between bounds: (1) falls, and near pi/2 it may be nearly 0. The first
 * guess: Boyd, Applied Mathematics and Computation 218 (2012), 7005-7013. */
static double arc_inverse(const struct imp_ellipse *e, double share)
{
    const double left = 1 - share, turn = atan(sqrt(e->slow2) / fmax(share, 1e-300));
    double lo = 0, hi = IMP_PI / 2, move = 1;
    double theta = hi + sqrt(hypot(left, turn)) * (turn - hi);
    theta = imp_clamp(theta, lo, hi);
    for (int i = 0; i < 60 && fabs(move) > 4e-16; i++) {
        double rate;
        const double over = arc(theta, e->slow2, &rate) - share * e->quarter;
        if (over > 0) hi = theta;
        else lo = theta;
        double next = theta - over / rate;
        if (!(next >= lo && next <= hi)) next = (lo + hi) / 2;
        move = next - theta;
        theta = next;
    }
    return theta;
}

double imp__ellipse_phi(const struct imp_ellipse *e, double u)
{
    const double quarters = 4 * u, k = floor(quarters), share = quarters - k;
    const bool back = (int)k & 1; /* the second and the fourth mirror the others */
    const double theta = arc_inverse(e, back ? 1 - share : share);
    return e->start + (back ? (k + 1) * (IMP_PI / 2) - theta : k * (IMP_PI / 2) + theta);
}
