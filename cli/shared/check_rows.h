/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of a check, as a table or in an answer. */
#ifndef IMP_CLI_CHECK_ROWS_H
#define IMP_CLI_CHECK_ROWS_H

#include "text/json.h"
#include <importon/importon.h>

void check_rows_print(const struct imp_check_row *rows, size_t n);
/* "rows", and how many failed or are noisy. */
void check_rows_json(struct json *j, const struct imp_check_row *rows, size_t n);
/* Rows whose verdict is `ok`: 0 failed, 1 good, -1 noisy. */
size_t check_rows_count(const struct imp_check_row *rows, size_t n, int ok);

#endif
