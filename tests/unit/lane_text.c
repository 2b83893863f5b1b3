/* SPDX-License-Identifier: Apache-2.0
 *
 * Formulas in lanes (math/lane_text.h): the text for four and for eight numbers gives every bit of
 * that for one. */
#include "imp_tap.h"
#include "math/exp.h"
#include "math/rng.h"
#include "math/trig.h"
#include <string.h>

#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/conductor_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/dielectric_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 4
#define IMP_TEXT "kind/bsdf/conductor_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 4
#define IMP_TEXT "kind/bsdf/dielectric_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 8
#define IMP_TEXT "kind/bsdf/conductor_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 8
#define IMP_TEXT "kind/bsdf/dielectric_text.h"
#include "math/lane_text.h"

enum { DRAWS = 20000, MOST = 8 };

/* Numbers that formulas treat apart are among them. */
static double number(struct imp_key key, unsigned dim)
{
    static const double special[] = {0, -0., 1, -1, INFINITY, NAN, 0x1p-1074, 1e300};
    const double u = imp__u01(key, 2 * dim), v = imp__u01(key, 2 * dim + 1);
    return u < .1 ? special[(int)(imp_count(special) * v)] : 8 * v - 2;
}
static bool same(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static void functions(void)
{
    int wrong = 0;
    for (int i = 0; i < DRAWS; i++) {
        double a[MOST], b[MOST];
        imp_real_4 a4, b4;
        imp_real_8 a8, b8;
        for (int k = 0; k < MOST; k++) {
            const struct imp_key key = imp__key(1, (uint64_t)i, (uint64_t)k);
            a8[k] = a[k] = number(key, 0);
            b8[k] = b[k] = number(key, 1);
            if (k < 4) a4[k] = a[k], b4[k] = b[k];
        }
        const imp_real_4 c4 = imp__choose_4((a4 > b4) & (a4 > imp__real_4(0)), a4, b4),
                         l4 = imp__larger_4(a4, b4), r4 = imp__root_4(a4);
        const imp_real_8 c8 = imp__choose_8((a8 > b8) & (a8 > imp__real_8(0)), a8, b8),
                         l8 = imp__larger_8(a8, b8), r8 = imp__root_8(a8);
        for (int k = 0; k < MOST; k++) {
            const double c = imp__choose_1((a[k] > b[k]) & (a[k] > imp__real_1(0)), a[k],
                                           b[k]),
                         l = imp__larger_1(a[k], b[k]), r = imp__root_1(a[k]);
            wrong += !same(c, c8[k]) || !same(l, l8[k]) || !same(r, r8[k]);
            if (k < 4) wrong += !same(c, c4[k]) || !same(l, l4[k]) || !same(r, r4[k]);
        }
    }
    tap_ok(wrong == 0, "choice, maximum and root in lanes: %d differ", wrong);
}

/* Sines, cosines and angles. */
static void angles(void)
{
    int wrong = 0;
    for (int i = 0; i < DRAWS; i++) {
        double x[MOST], y[MOST];
        imp_real_4 x4, y4;
        imp_real_8 x8, y8;
        for (int k = 0; k < MOST; k++) {
            const struct imp_key key = imp__key(3, (uint64_t)i, (uint64_t)k);
            x8[k] = x[k] = number(key, 0);
            y8[k] = y[k] = number(key, 1);
            if (k < 4) x4[k] = x[k], y4[k] = y[k];
        }
        const imp_real_4 s4 = imp__sin_eighth_4(x4), c4 = imp__cos_eighth_4(x4),
                         a4 = imp__angles_signed_4(x4, y4);
        const imp_real_8 s8 = imp__sin_eighth_8(x8), c8 = imp__cos_eighth_8(x8),
                         a8 = imp__angles_signed_8(x8, y8);
        for (int k = 0; k < MOST; k++) {
            const double s = imp__sin_eighth_1(x[k]), c = imp__cos_eighth_1(x[k]),
                         a = imp__angles_signed_1(x[k], y[k]);
            wrong += !same(s, s8[k]) || !same(c, c8[k]) || !same(a, a8[k]);
            if (k < 4) wrong += !same(s, s4[k]) || !same(c, c4[k]) || !same(a, a4[k]);
        }
    }
    tap_ok(wrong == 0, "sines, cosines and angles in lanes: %d differ", wrong);
}

/* Exponential function and logarithm, and their errors: x in [-700, 700], and of the logarithm all
 * magnitudes and what is close to 1. */
static void exponentials(void)
{
    int wrong = 0;
    double e_worst = 0, l_worst = 0;
    for (int i = 0; i < DRAWS; i++) {
        double x[MOST], y[MOST];
        imp_real_4 x4, y4;
        imp_real_8 x8, y8;
        for (int k = 0; k < MOST; k++) {
            const struct imp_key key = imp__key(4, (uint64_t)i, (uint64_t)k);
            const double u = imp__u01(key, 0), v = imp__u01(key, 1);
            x8[k] = x[k] = 1400 * u - 700;
            y8[k] = y[k] = k & 1 ? ldexp(.5 + u / 2, (int)(2000 * v) - 1000)
                                 : 1 - ldexp(u, -(int)(54 * v));
            if (k < 4) x4[k] = x[k], y4[k] = y[k];
        }
        const imp_real_4 e4 = imp__exp_4(x4), l4 = imp__log_4(y4);
        const imp_real_8 e8 = imp__exp_8(x8), l8 = imp__log_8(y8);
        for (int k = 0; k < MOST; k++) {
            const double e = imp__exp_1(x[k]), l = imp__log_1(y[k]);
            const long double e_true = expl(x[k]), l_true = logl(y[k]);
            wrong += !same(e, e8[k]) || !same(l, l8[k]);
            if (k < 4) wrong += !same(e, e4[k]) || !same(l, l4[k]);
            e_worst = fmax(e_worst, (double)fabsl(e / e_true - 1));
            if (y[k] == 1) wrong += l != 0;
            else l_worst = fmax(l_worst, (double)fabsl(l / l_true - 1));
        }
    }
    tap_ok(wrong == 0, "exponentials and logarithms in lanes: %d differ", wrong);
    tap_ok(e_worst < 0x1.7p-53 && l_worst < 0x1p-52,
           "their errors # exp 2^%.2f, log 2^%.2f", log2(e_worst), log2(l_worst));
    tap_ok(imp__exp_1(-800) == 0 && imp__exp_1(800) == INFINITY && imp__exp_1(-0.) == 1,
           "far below 0 and above");
}

/* Cosine and index of a conductor, and all that follows from them. */
static void conductors(void)
{
    int wrong = 0, turned = 0;
    for (int i = 0; i < DRAWS; i++) {
        double c[MOST], eta[MOST], k[MOST];
        imp_real_4 c4, eta4, k4, by_eta4, by_k4;
        imp_real_8 c8, eta8, k8, by_eta8, by_k8;
        for (int j = 0; j < MOST; j++) {
            const struct imp_key key = imp__key(2, (uint64_t)i, (uint64_t)j);
            const double u = imp__u01(key, 0);
            c8[j] = c[j] = u < .05 ? 0 : u > .95 ? 1 : u;
            eta8[j] = eta[j] = fabs(number(key, 1));
            k8[j] = k[j] = fabs(number(key, 2));
            if (j < 4) c4[j] = c[j], eta4[j] = eta[j], k4[j] = k[j];
        }
        const imp_real_4 f4 = imp__conductor_4(c4, eta4, k4),
                         d4 = imp__conductor_d_4(c4, eta4, k4, &by_eta4, &by_k4),
                         t4 = imp__conductor_by_c_4(c4, eta4, k4);
        const imp_real_8 f8 = imp__conductor_8(c8, eta8, k8),
                         d8 = imp__conductor_d_8(c8, eta8, k8, &by_eta8, &by_k8),
                         t8 = imp__conductor_by_c_8(c8, eta8, k8);
        for (int j = 0; j < MOST; j++) {
            double by_eta, by_k;
            const double f = imp__conductor_1(c[j], eta[j], k[j]),
                         d = imp__conductor_d_1(c[j], eta[j], k[j], &by_eta, &by_k),
                         t = imp__conductor_by_c_1(c[j], eta[j], k[j]);
            turned += imp__conductor_parts_1(c[j], eta[j], k[j]).t < 0;
            wrong += !same(f, f8[j]) || !same(d, d8[j]) || !same(t, t8[j]) ||
                     !same(by_eta, by_eta8[j]) || !same(by_k, by_k8[j]) || !same(f, d);
            if (j < 4)
                wrong += !same(f, f4[j]) || !same(d, d4[j]) || !same(t, t4[j]) ||
                         !same(by_eta, by_eta4[j]) || !same(by_k, by_k4[j]);
        }
    }
    tap_ok(wrong == 0 && turned > DRAWS && turned < MOST * DRAWS - DRAWS,
           "reflectance of conductors and its derivatives in lanes: %d differ", wrong);
}

/* Cosine, of either side, and index of a dielectric. */
static void dielectrics(void)
{
    int wrong = 0, total = 0;
    for (int i = 0; i < DRAWS; i++) {
        double c[MOST], eta[MOST];
        imp_real_4 c4, eta4, t4, e4;
        imp_real_8 c8, eta8, t8, e8;
        for (int j = 0; j < MOST; j++) {
            const struct imp_key key = imp__key(4, (uint64_t)i, (uint64_t)j);
            const double u = imp__u01(key, 0);
            c8[j] = c[j] = u < .05 ? 0 : u > .95 ? 1 : 2 * u - 1;
            eta8[j] = eta[j] = fabs(number(key, 1));
            if (j < 4) c4[j] = c[j], eta4[j] = eta[j];
        }
        const imp_real_4 f4 = imp__dielectric_4(c4, eta4, &t4, &e4);
        const imp_real_8 f8 = imp__dielectric_8(c8, eta8, &t8, &e8);
        for (int j = 0; j < MOST; j++) {
            double t, e;
            const double f = imp__dielectric_1(c[j], eta[j], &t, &e);
            total += f == 1;
            wrong += !same(f, f8[j]) || !same(t, t8[j]) || !same(e, e8[j]);
            if (j < 4) wrong += !same(f, f4[j]) || !same(t, t4[j]) || !same(e, e4[j]);
        }
    }
    tap_ok(wrong == 0 && total > DRAWS && total < MOST * DRAWS - DRAWS,
           "reflectance of dielectrics in lanes: %d differ", wrong);
}

int main(void)
{
    functions();
    angles();
    exponentials();
    conductors();
    dielectrics();
    return tap_done();
}
