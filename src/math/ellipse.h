/* SPDX-License-Identifier: Apache-2.0
 *
 * Length along the ellipse x(phi) = p cos(phi) + q sin(phi), 0 <= phi < 2 pi. */
#ifndef IMP_MATH_ELLIPSE_H
#define IMP_MATH_ELLIPSE_H

#include "vec.h"

struct imp_ellipse {
    double start;   /* the phi where |x'| is largest */
    double slow2;   /* (smallest |x'| / largest)^2, in (0, 1] */
    double quarter; /* length of a quarter, over the largest |x'| */
    double length;  /* of all of it */
};
/* p and q are not parallel. */
void imp__ellipse(const imp_v3 *p, const imp_v3 *q, struct imp_ellipse *out);
/* The phi before which the share u of the length lies, counted from `start`: for u drawn
 * evenly from [0, 1), x(phi) is drawn evenly by length. */
double imp__ellipse_phi(const struct imp_ellipse *e, double u);

#endif
