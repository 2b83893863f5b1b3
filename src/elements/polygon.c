/* SPDX-License-Identifier: Apache-2.0
 *
 * Lambert's formula: the integral of cos cos'/r^2 over a polygon is half the sum over its
 * edges of the angle they subtend times the cosine between the receiver's normal and the
 * normal of the triangle (x, v_k, v_k+1) (docs/elements-theory.md 3.1). */
#include "elements.h"
#include "math/trig.h"

double imp__polygon_area(int n, const imp_v3 *v)
{
    imp_v3 sum = imp__v3(0, 0, 0);
    for (int k = 1; k + 1 < n; k++) sum += imp__cross(v[k] - v[0], v[k + 1] - v[0]);
    return imp__length(sum) / 2;
}

double imp__polygon_factor(imp_v3 x, imp_v3 normal, int n, const imp_v3 *v, imp_v3 facing)
{
    imp_v3 cut[8], at[4];
    double height[4], far = 0, top = 0;
    for (int k = 0; k < n; k++) {
        at[k] = v[k] - x;
        height[k] = imp__dot(at[k], normal);
        far = imp_max(imp__dot(at[k], at[k]), far);
        top = imp_max(height[k], top);
    }
    /* Planes that touch: without a tolerance the inside of a coplanar polygon would be a
     * whole hemisphere. */
    const double least = 1e-11 * sqrt(far);
    if (top <= least || imp__dot(at[0], facing) >= -least) return 0;

    int m = 0;
    for (int k = 0; k < n; k++) { /* Sutherland and Hodgman against one plane */
        const int next = k + 1 < n ? k + 1 : 0;
        if (height[k] >= 0) cut[m++] = at[k];
        if ((height[k] > 0 && height[next] < 0) || (height[k] < 0 && height[next] > 0))
            cut[m++] =
                at[k] + (at[next] - at[k]) * (height[k] / (height[k] - height[next]));
    }
    double sum = 0;
    for (int first = 0; first < m; first += 4) { /* angles of four edges at a time */
        imp_v3 sine = {0}, cosine = {1, 1, 1, 1}, across = {0};
        for (int k = first; k < m && k < first + 4; k++) {
            const imp_v3 p = cut[k], q = cut[k + 1 < m ? k + 1 : 0];
            const imp_v3 c = imp__cross(p, q);
            const double length = imp__length(c);
            if (!(length > 0)) continue;
            sine[k - first] = length;
            cosine[k - first] = imp__dot(p, q);
            across[k - first] = imp__dot(c, normal) / length;
        }
        const imp_v3 part = imp__angles_4(cosine, sine) * across;
        sum += (part[0] + part[1]) + (part[2] + part[3]);
    }
    return fabs(sum) / 2;
}
