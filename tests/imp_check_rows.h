/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_check as one line of a test: what is wrong is printed before it. */
#ifndef IMP_TEST_CHECK_ROWS_H
#define IMP_TEST_CHECK_ROWS_H

#include "imp_scene.h"
#include "imp_tap.h"

static inline void test_check(imp_context *ctx, imp_problem *p,
                              const struct imp_check_options *o, const char *what)
{
    const struct imp_check_row *rows;
    size_t n;
    int frozen = 0, wrong = 0;
    test_must(ctx, imp_check(p, o, NULL, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        frozen += strcmp(rows[k].method, "frozen") == 0;
        if (rows[k].ok) continue;
        wrong++;
        printf("# %s %s %g, reference %g, error %g\n", rows[k].method, rows[k].param,
               rows[k].value, rows[k].reference, rows[k].error);
    }
    tap_ok(frozen > 0 && wrong == 0, "%s: %d rows of check, %d frozen, %d wrong", what,
           (int)n, frozen, wrong);
}

#endif
