/* SPDX-License-Identifier: Apache-2.0
 *
 * What is wanted, judged by a reading that had no part in the search: each bound is one-sided. That
 * all points are above the least of their lower bounds fails with the risk of one point, the
 * point that is lowest in truth, so bounds of extremes need no correction for their number. */
#include "designing.h"
#include "math/stat.h"
#include "math/vec.h"
#include <math.h>

static double rating(double sources, double light)
{
    if (!(sources > 0)) return -INFINITY;
    return light > 0 ? 8 * log10(0.25 * sources * IMP_PI / light) : INFINITY;
}

void imp__design_judge(const struct imp__design_model *m, size_t k, const double *x,
                       const struct imp__design_reading *r, double risk,
                       struct imp_design_finding *out)
{
    const enum imp_design_want_of of = m->want[k].of;
    const struct imp__design_grid *g = &m->grid[m->grid_of[k]];
    const struct imp_estimate *e = &r->average[m->grid_of[k]];
    const double t = imp__student_of_normal(-imp__normal_quantile(risk), r->freedom);
    const bool upper = imp__design_upper(of);
    out->value = out->sure = upper ? -INFINITY : INFINITY;
    out->at = 0;
    for (size_t i = 0; i < g->n; i++) {
        const size_t p = g->first + i;
        const double v = r->value[p], s = t * r->se[p];
        double value = v, sure = upper ? v + s : v - s;
        if (of == IMP_WANT_AVERAGE) {
            value = e->value;
            sure = e->value - t * e->se;
        } else if (of == IMP_WANT_UNIFORMITY) {
            value = e->value > 0 ? v / e->value : 0;
            sure = e->value > 0 ? fmax(v - s, 0) / (e->value + t * e->se) : 0;
        } else if (of == IMP_WANT_UGR) {
            double sources = m->base_source[p], direct = m->base_direct[p];
            for (size_t j = 0; j < m->n; j++) {
                sources += m->source[p * m->n + j] * x[j] * x[j];
                direct += m->direct[p * m->n + j] * x[j];
            }
            value = rating(sources, v - direct);
            sure = rating(sources, v - s - direct);
        }
        out->value = upper ? fmax(out->value, value) : fmin(out->value, value);
        if (upper ? sure > out->sure : sure < out->sure) {
            out->sure = sure;
            out->at = of == IMP_WANT_AVERAGE ? 0 : i;
        }
    }
    out->holds = imp_design_enough(of, out->sure, m->want[k].value);
}
