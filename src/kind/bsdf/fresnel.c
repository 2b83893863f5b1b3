/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance of dielectrics and conductors, and its derivatives with respect
 * to angle and index. */
#include "fresnel.h"

#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/dielectric_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/conductor_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 4
#define IMP_TEXT "kind/bsdf/conductor_text.h"
#include "math/lane_text.h"

double imp__fresnel_dielectric(double c, double eta, double *cos_t, double *eta_t)
{
    return imp__dielectric_1(c, eta, cos_t, eta_t);
}

double imp__fresnel_dielectric_d(double c, double e, double *d_c, double *d_e)
{
    return imp__dielectric_d_1(c, e, d_c, d_e);
}

/* int_0^1 2 c F(c, n) dc for n >= 1, and its derivative (Walsh, Dept. Sci. Ind. Res.
 * Illum. Res. Tech. Pap. 2, 1926; Duntley, J. Opt. Soc. Am. 32, 1942):
 *
 *   1/2 + (n - 1)(3 n + 1)/(6 (n + 1)^2) + P ln((n - 1)/(n + 1)) - Q + R ln n
 *
 *   P = n^2 (n^2 - 1)^2/(n^2 + 1)^3,    Q = 2 n^3 (n^2 + 2 n - 1)/((n^2 + 1)(n^4 - 1)),
 *   R = 8 n^4 (n^4 + 1)/((n^2 + 1)(n^4 - 1)^2)
 *
 * Near n = 1 its terms cancel: there it is (n - 1)/3. */
static double diffuse_from_outside(double n, double *d)
{
    if (n - 1 < 2e-5) {
        *d = 1. / 3;
        return (n - 1) / 3;
    }
    const double n2 = n * n, n3 = n * n2, n4 = n2 * n2, above = n2 + 1,
                 below = (n - 1) * (n + 1), both = below * above; /* n^4 - 1 */
    const double P = n2 * below * below / (above * above * above),
                 Q = 2 * n3 * (n2 + 2 * n - 1) / (above * both),
                 R = 8 * n4 * (n4 + 1) / (above * both * both);
    const double lnP = log((n - 1) / (n + 1)), lnR = log1p(n - 1);
    const double dP = P * (2 / n + 4 * n / below - 6 * n / above),
                 dQ = Q * (3 / n + (2 * n + 2) / (n2 + 2 * n - 1) - 2 * n / above -
                           4 * n3 / both),
                 dR = R * (4 / n + 4 * n3 / (n4 + 1) - 2 * n / above - 8 * n3 / both);
    *d = 4 * n / (3 * (n + 1) * (n + 1) * (n + 1)) + dP * lnP + P * 2 / below - dQ +
         dR * lnR + R / n;
    return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) + P * lnP - Q + R * lnR;
}

/* From the denser side: 1 - F(e) = e^2 (1 - F(1/e)), since as much light passes one way
 * as the other. */
double imp__fresnel_diffuse(double e, double *d_e)
{
    if (e >= 1) return diffuse_from_outside(e, d_e);
    double d_n;
    const double passes = 1 - diffuse_from_outside(1 / e, &d_n);
    *d_e = -2 * e * passes - d_n;
    return 1 - e * e * passes;
}

/* Lanes that differ: one where all are equal; three for colours, whose fourth lane is
 * 0. */
static int lanes_of(const imp_spec *eta, const imp_spec *k)
{
    bool equal = true;
    for (int i = 1; i < 4; i++) equal &= (*eta)[i] == (*eta)[0] && (*k)[i] == (*k)[0];
    return equal ? 1 : (*eta)[3] == 0 && (*k)[3] == 0 ? 3 : 4;
}

void imp__fresnel_conductor(double c, const imp_spec *eta, const imp_spec *k, imp_spec *f)
{
    const int n = lanes_of(eta, k);
    if (n == 1) {
        *f = imp__spec(imp__conductor_1(c, (*eta)[0], (*k)[0]));
        return;
    }
    *f = imp__conductor_4(imp__spec(c), *eta, *k);
    if (n == 3) (*f)[3] = 0;
}

void imp__fresnel_conductor_d(double c, const imp_spec *eta, const imp_spec *k,
                              imp_spec *f, imp_spec *df_deta, imp_spec *df_dk)
{
    *f = imp__conductor_d_4(imp__spec(c), *eta, *k, df_deta, df_dk);
    if (lanes_of(eta, k) == 3) (*f)[3] = (*df_deta)[3] = (*df_dk)[3] = 0;
}

void imp__fresnel_conductor_turned(double c, const imp_spec *eta, const imp_spec *k,
                                   imp_spec *f, imp_spec *df_dc)
{
    imp__fresnel_conductor(c, eta, k, f);
    *df_dc = imp__conductor_by_c_4(imp__spec(c), *eta, *k);
    if (lanes_of(eta, k) == 3) (*df_dc)[3] = 0;
}
