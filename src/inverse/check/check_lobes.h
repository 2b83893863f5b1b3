/* SPDX-License-Identifier: Apache-2.0
 *
 * A second density of directions, which can be drawn, and is known in closed form: uniform, and
 * lobes about axes where the density under test may have peaks, each in five widths from a
 * half sphere to half a degree (von Mises and Fisher's density). About one axis there may be
 * one more that is as narrow as a peak in a sky, with a quarter of the draws. */
#ifndef IMP_INVERSE_CHECK_LOBES_H
#define IMP_INVERSE_CHECK_LOBES_H

#include "kind/build.h"
#include "math/vec.h"

#define IMP_LOBE_AXES 8
struct imp__lobes {
    int n;
    imp_v3 axis[IMP_LOBE_AXES];
    double
        narrow; /* kappa of the lobe about axis[0] with a quarter of the draws; 0: none */
};
/* An axis more, while there is room. */
void imp__lobes_add(struct imp__lobes *q, imp_v3 axis);
/* Per steradian, over the whole sphere. */
double imp__lobes_pdf(const struct imp__lobes *q, imp_v3 w);
imp_v3 imp__lobes_sample(const struct imp__lobes *q, const double u[3]);

/* Lobes about directions that a light without end draws, seen from `ref`. If it has a small
 * bright place, such as a sun, `narrow` fits that. */
void imp__lobes_of_sky(struct imp__lobes *q, const struct imp_emitter *sky, imp_v3 ref);
/* Does w lie in the small bright place? */
bool imp__lobes_narrowly(const struct imp__lobes *q, imp_v3 w);

#endif
