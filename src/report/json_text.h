/* SPDX-License-Identifier: Apache-2.0
 *
 * Is a text one JSON value (RFC 8259)? What a page holds was written elsewhere, and a page
 * whose data does not parse shows nothing. */
#ifndef IMP_REPORT_JSON_TEXT_H
#define IMP_REPORT_JSON_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* *at becomes the offset of the first byte that does not belong. Values nest at most 64
 * deep. */
bool imp__json_valid(const char *text, size_t *at);

#endif
