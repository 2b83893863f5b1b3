/* SPDX-License-Identifier: Apache-2.0
 *
 * Even-parity real spherical harmonics. Products of two are even, so the functions are
 * orthonormal on the hemisphere and complete there: they expand the mirror extension,
 * which is continuous at the horizon. */
#include "elements.h"

/* clang-format off */
/* Recurrence of the normalised associated Legendre functions of one m,
 *
 *     z P_l = alpha_{l+1} P_{l+1} + alpha_l P_{l-1},
 *
 * applied twice, so that it steps over the odd ones:
 *
 *     z^2 P_l = alpha_{l+1} alpha_{l+2} P_{l+2} + (alpha_{l+1}^2 + alpha_l^2) P_l
 *             + alpha_l alpha_{l-1} P_{l-2}. */
/* clang-format on */
static double alpha(int l, int m)
{
    return l > m ? sqrt((double)(l * l - m * m) / (double)(4 * l * l - 1)) : 0;
}

void imp__basis_init(struct imp__el_basis *b, int order)
{
    *b = (struct imp__el_basis){.order = order};
    double lead = sqrt(1 / IMP_2PI); /* sqrt(2) Y_00 */
    for (int m = 0; m <= order; m++) {
        b->size[m] = (order - m) / 2 + 1;
        b->start[m] = b->n;
        b->n += m ? 2 * b->size[m] : b->size[m];
        /* Y_mm grows by sqrt((2m+1)/(2m)) a step; real functions have sqrt(2) more. */
        if (m) lead *= sqrt((2.0 * m + 1) / (2.0 * m));
        b->lead[m] = m ? M_SQRT2 * lead : lead;
        for (int k = 0; k + 1 < b->size[m]; k++) {
            const int l = m + 2 * k;
            b->inv[m][k] = 1 / (alpha(l + 1, m) * alpha(l + 2, m));
            b->mid[m][k] = imp__sqr(alpha(l + 1, m)) + imp__sqr(alpha(l, m));
            b->low[m][k] = k ? alpha(l, m) * alpha(l - 1, m) : 0;
        }
    }
}

void imp__basis_eval4(const struct imp__el_basis *b, imp_spec x, imp_spec y, imp_spec z,
                      imp_spec *h)
{
    const imp_spec t = z * z;
    imp_spec re = imp__spec(1), im = imp__spec(0); /* (x + iy)^m */
    for (int m = 0; m <= b->order; m++) {
        imp_spec p = imp__spec(b->lead[m]), before = imp__spec(0);
        imp_spec *out = h + b->start[m];
        const int n = b->size[m];
        for (int k = 0;; k++) {
            out[k] = p * re;
            if (m) out[k + n] = p * im;
            if (k + 1 == n) break;
            const imp_spec next =
                ((t - b->mid[m][k]) * p - b->low[m][k] * before) * b->inv[m][k];
            before = p;
            p = next;
        }
        const imp_spec next = re * x - im * y;
        im = re * y + im * x;
        re = next;
    }
}

void imp__basis_eval(const struct imp__el_basis *b, imp_v3 w, double *h)
{
    imp_spec four[EL_N_MAX];
    imp__basis_eval4(b, imp__spec(w[0]), imp__spec(w[1]), imp__spec(w[2]), four);
    for (int k = 0; k < b->n; k++) h[k] = four[k][0];
}
