/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight glare probability of a view whose luminances are noisy.
 *
 * The square of a noisy luminance is too large by its variance. Of groups a and b of walks, which
 * are independent, the product L_a L_b is without that bias. The mean of the other groups decides
 * whether the cell is a source, since a cell chosen for a large L_a would have a product that is
 * too large. The sum takes all pairs. Its error is the jackknife's: all of it again
 * without each group.
 *
 * A cell that the edge of a source crosses has less L^2 than there is in it. What is missing is
 * in proportion to the sides of the cells, so that twice the sum over small cells less that
 * over those of twice their side is without it (Richardson). */
#include "dgp.h"
#include <math.h>
#include <string.h>

enum { ALL = -1, GROUPS = IMP__VIEW_GROUPS };

/* Mean over the pairs of groups but `without` of L_a L_b, counted where the others are above the
 * threshold. */
static double square_of(const double L[GROUPS], int without, double threshold)
{
    double sum = 0, squares = 0, first = 0, second = 0;
    for (int g = 0; g < GROUPS; g++) {
        const double x = g == without ? 0 : L[g];
        sum += x;
        squares += x * x;
        second = x > first ? first : fmax(second, x);
        first = fmax(first, x);
    }
    const int n = without == ALL ? GROUPS : GROUPS - 1;
    const double pairs = (double)(n * (n - 1)), bound = threshold * (n - 2);
    if (!(sum > bound)) return 0;
    if (sum - first - second > bound) return (sum * sum - squares) / pairs;
    double found = 0;
    for (int a = 0; a < GROUPS; a++)
        for (int b = 0; b < a; b++)
            if (a != without && b != without && sum - L[a] - L[b] > bound)
                found += 2 * L[a] * L[b];
    return found / pairs;
}

/* Sum of L^2 w/p^2 over the sources. */
static double sum_of(const struct imp__view *v, double (*L)[GROUPS], int without,
                     double threshold)
{
    double sum = 0;
    for (size_t c = 0; c < v->n; c++)
        sum += v->weight[c] * square_of(L[c], without, threshold);
    return sum;
}

/* Luminances of cells and discs by groups; E, total [GROUPS]: illuminance; sum of the cells'
 * luminances, discs among them. */
struct seen {
    const struct imp__view *view; /* [2] */
    double (*cell)[GROUPS];
    size_t n_discs;
    const struct imp__view_disc *disc;
    double (*disc_L)[GROUPS];
    double E[GROUPS], total[GROUPS];
};

/* The number without a group. */
static double number_of(const struct seen *s, int without, double threshold,
                        double *illuminance)
{
    const struct imp__view *view = s->view;
    const int n = without == ALL ? GROUPS : GROUPS - 1;
    double light = 0, mean = 0;
    for (int g = 0; g < GROUPS; g++)
        if (g != without) light += s->E[g] / n, mean += s->total[g] / n;
    if (threshold <= 100) threshold *= mean / (double)view->n;
    const double fine = sum_of(&view[0], s->cell, without, threshold);
    const double coarse = sum_of(&view[1], s->cell + view->n, without, threshold);
    double discs = 0;
    for (size_t k = 0; k < s->n_discs; k++)
        discs += s->disc[k].weight * square_of(s->disc_L[k], without, threshold);
    *illuminance = light;
    return imp__dgp_of(light, fmax(2 * fine - coarse, 0) + fmax(discs, 0));
}

void imp__dgp_rate(const struct imp__view view[2], double (*light)[GROUPS],
                   size_t n_discs, const struct imp__view_disc *disc,
                   double (*disc_light)[GROUPS], double threshold, double *dgp,
                   double *se, double *illuminance)
{
    struct seen s = {view, light, n_discs, disc, disc_light, {0}, {0}};
    const int side = view->side, half = view[1].side;
    double(*merged)[GROUPS] = light + view->n;
    double left[GROUPS], mean = 0, square = 0, lx;
    memset(merged, 0, view[1].n * sizeof *merged);
    for (int c = 0; c < (int)view->n; c++) {
        const int at = c / side / 2 * half + c % side / 2;
        const double k = 1 / (view[0].size * view[0].cosine[c]);
        const double m = 1 / (view[1].size * view[1].cosine[at]);
        for (int g = 0; g < GROUPS; g++) {
            s.E[g] += light[c][g];
            merged[at][g] += light[c][g] * m;
            light[c][g] *= k;
            s.total[g] += light[c][g];
        }
    }
    for (size_t d = 0; d < n_discs; d++)
        for (int g = 0; g < GROUPS; g++) {
            s.E[g] += disc_light[d][g];
            disc_light[d][g] /= disc[d].size * disc[d].cosine;
            s.total[g] += disc_light[d][g] * disc[d].size / view[0].size;
        }
    *dgp = number_of(&s, ALL, threshold, illuminance);
    for (int g = 0; g < GROUPS; g++) {
        left[g] = number_of(&s, g, threshold, &lx);
        mean += left[g] / GROUPS;
    }
    for (int g = 0; g < GROUPS; g++) square += (left[g] - mean) * (left[g] - mean);
    *se = sqrt(square * (GROUPS - 1) / GROUPS);
}
