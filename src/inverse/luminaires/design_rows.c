/* SPDX-License-Identifier: Apache-2.0
 *
 * What is wanted as rows of a search, in the levels x. With readings E_i = b_i + sum_j a_ij x_j of the
 * points of a grid, and E their average:
 *
 *     average      E - w >= 0                 minimum      E_i - w >= 0 for all i
 *     maximum      w - E_i >= 0               uniformity   E_i - w E >= 0
 *     UGR          c L_i - sum_j q_ij x_j^2 >= 0,  c = 4 10^(w/8),  L_i the background
 *
 * (8 log10(.25/L sum) <= w; luminances go with levels). Without any light the last two are not
 * defined and these rows hold, so each has one row more: E - DARK E(1) >= 0, E(1) with all lamps.
 * Readings with different lamps are of different walks, so their errors add as squares; of E_i - w E
 * the error is s_i + w s at most. Each row is divided by a number of the size of its terms. */
#include "base/arguments.h"
#include "designing.h"
#include "math/vec.h"
#include <math.h>

#define DARK 1e-6 /* part of the average with all lamps at level 1: no light */

static bool is_ratio(enum imp_design_want_of of)
{
    return of == IMP_WANT_UNIFORMITY || of == IMP_WANT_UGR;
}

static size_t rows_of(const struct imp__design_model *m, size_t want)
{
    const enum imp_design_want_of of = m->want[want].of;
    if (of == IMP_WANT_AVERAGE) return 1;
    return m->grid[m->grid_of[want]].n + is_ratio(of);
}

/* Is it the row that asks for some light? */
static bool is_light_row(const struct imp__design_model *m, size_t k, size_t r)
{
    return is_ratio(m->want[k].of) && r + 1 == m->first_row[k + 1];
}

/* Average of a grid with all lamps at level 1. */
static double full_average(const struct imp__design_model *m, size_t g)
{
    double sum = m->base.average[g].value;
    for (size_t j = 0; j < m->n; j++) sum += m->with[j].average[g].value;
    return sum;
}

enum imp_status imp__design_rows_make(struct imp__design_model *m)
{
    m->first_row = imp__arena_array(m->arena, m->n_wants + 1, sizeof *m->first_row);
    if (!m->first_row) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for wants");
    m->n_rows = 0;
    for (size_t k = 0; k < m->n_wants; k++) {
        m->first_row[k] = m->n_rows;
        m->n_rows += rows_of(m, k);
    }
    m->first_row[m->n_wants] = m->n_rows;
    m->row = imp__arena_array(m->arena, m->n_rows, sizeof *m->row);
    m->scale = imp__arena_array(m->arena, m->n_rows, sizeof *m->scale);
    double *numbers = imp__arena_array(m->arena, 3 * m->n_rows * m->n, sizeof *numbers);
    if (!m->row || !m->scale || !numbers)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %zu constraints",
                          m->n_rows);
    for (size_t k = 0; k < m->n_wants; k++)
        for (size_t r = m->first_row[k]; r < m->first_row[k + 1]; r++) {
            m->row[r].a = numbers + 3 * r * m->n;
            m->row[r].v = numbers + (3 * r + 1) * m->n;
            m->row[r].q =
                m->want[k].of == IMP_WANT_UGR ? numbers + (3 * r + 2) * m->n : NULL;
        }
    return IMP_OK;
}

/* What a row is divided by, so that its numbers are near 1 whatever is wanted: a want that is far
 * above all that the lamps can give says nothing of the size of their readings. */
static double size_of(const struct imp__design_model *m, size_t k, size_t r,
                      double wanted)
{
    const size_t g = m->grid_of[k];
    double size = full_average(m, g);
    if (is_light_row(m, k, r) || m->want[k].of == IMP_WANT_UNIFORMITY)
        return size > 0 ? size : 1;
    if (m->want[k].of == IMP_WANT_UGR) {
        const size_t p = m->grid[g].first + r - m->first_row[k];
        size = m->base.value[p];
        for (size_t j = 0; j < m->n; j++) size += m->with[j].value[p];
        size *= 4 * pow(10, wanted / 8) * IMP_INV_PI;
        return size > 0 ? size : 1;
    }
    if (!(size > 0)) return wanted > 0 ? wanted : 1;
    return wanted > 0 ? fmin(wanted, size) : size;
}

/* The last row of a ratio, without a margin: it is of being lit at all. */
static void light_row_set(struct imp__design_model *m, size_t k, size_t r)
{
    struct imp__choice_row *row = &m->row[r];
    const size_t g = m->grid_of[k];
    const double full = full_average(m, g), s = 1 / m->scale[r];
    double *a = (double *)(uintptr_t)row->a, *v = (double *)(uintptr_t)row->v;
    double *q = (double *)(uintptr_t)row->q;
    row->b = full > 0 ? (m->base.average[g].value - DARK * full) * s : -1;
    row->v0 = row->z = 0;
    for (size_t j = 0; j < m->n; j++) {
        a[j] = m->with[j].average[g].value * s;
        v[j] = 0;
        if (q) q[j] = 0;
    }
}

/* The constant (lamp m->n), or what x_j is multiplied by: a term with its error. */
static struct imp_estimate term(const struct imp__design_model *m, size_t want, size_t at,
                                double w, size_t j)
{
    const size_t g = m->grid_of[want], p = m->grid[g].first + at;
    const struct imp__design_reading *r = j < m->n ? &m->with[j] : &m->base;
    const struct imp_estimate *e = &r->average[g];
    const double c = 4 * pow(10, w / 8) * IMP_INV_PI;
    switch (m->want[want].of) {
    case IMP_WANT_AVERAGE: return (struct imp_estimate){.value = e->value, .se = e->se};
    case IMP_WANT_MINIMUM:
        return (struct imp_estimate){.value = r->value[p], .se = r->se[p]};
    case IMP_WANT_MAXIMUM:
        return (struct imp_estimate){.value = -r->value[p], .se = r->se[p]};
    case IMP_WANT_UNIFORMITY:
        return (struct imp_estimate){.value = r->value[p] - w * e->value,
                                     .se = r->se[p] + w * e->se};
    case IMP_WANT_UGR: break;
    }
    const double direct = j < m->n ? m->direct[p * m->n + j] : m->base_direct[p];
    return (struct imp_estimate){.value = c * (r->value[p] - direct), .se = c * r->se[p]};
}

void imp__design_rows_set(struct imp__design_model *m, size_t k, double wanted, double z)
{
    const enum imp_design_want_of of = m->want[k].of;
    for (size_t r = m->first_row[k]; r < m->first_row[k + 1]; r++) {
        struct imp__choice_row *row = &m->row[r];
        const size_t at = r - m->first_row[k], p = m->grid[m->grid_of[k]].first + at;
        m->scale[r] = size_of(m, k, r, wanted);
        if (is_light_row(m, k, r)) {
            light_row_set(m, k, r);
            continue;
        }
        const double s = 1 / m->scale[r];
        double *a = (double *)(uintptr_t)row->a, *v = (double *)(uintptr_t)row->v;
        double *q = (double *)(uintptr_t)row->q;
        const struct imp_estimate base = term(m, k, at, wanted, m->n);
        row->b = base.value;
        if (of == IMP_WANT_AVERAGE || of == IMP_WANT_MINIMUM) row->b -= wanted;
        if (of == IMP_WANT_MAXIMUM) row->b += wanted;
        if (of == IMP_WANT_UGR) row->b -= m->base_source[p];
        row->b *= s;
        row->v0 = imp__sqr(base.se * s);
        row->z = z;
        for (size_t j = 0; j < m->n; j++) {
            const struct imp_estimate t = term(m, k, at, wanted, j);
            a[j] = t.value * s;
            v[j] = imp__sqr(t.se * s);
            if (q) q[j] = m->source[p * m->n + j] * s;
        }
    }
}

double imp__design_price(const struct imp__design_model *m, size_t k, double wanted,
                         const double *x, const double *dual)
{
    const size_t g = m->grid_of[k];
    double price = 0, average = m->base.average[g].value;
    for (size_t j = 0; j < m->n; j++) average += m->with[j].average[g].value * x[j];
    for (size_t r = m->first_row[k]; r < m->first_row[k + 1]; r++) {
        const size_t at = r - m->first_row[k];
        double slope = -1; /* of the left side, by what is wanted */
        if (dual[r] == 0 || is_light_row(m, k, r)) continue;
        if (m->want[k].of == IMP_WANT_MAXIMUM) slope = 1;
        if (m->want[k].of == IMP_WANT_UNIFORMITY) slope = -average;
        if (m->want[k].of == IMP_WANT_UGR) {
            slope = term(m, k, at, wanted, m->n).value;
            for (size_t j = 0; j < m->n; j++)
                slope += term(m, k, at, wanted, j).value * x[j];
            slope *= log(10) / 8;
        }
        price -= dual[r] * slope / m->scale[r];
    }
    return price;
}

double imp__design_objective_se(const struct imp__design_model *m, const double *x,
                                const double *dual)
{
    double sum = 0; /* rows have the same walks, so errors add at most */
    for (size_t r = 0; r < m->n_rows; r++) {
        double v = m->row[r].v0;
        for (size_t j = 0; j < m->n; j++) v += m->row[r].v[j] * x[j] * x[j];
        sum += dual[r] * sqrt(v);
    }
    return sum;
}
