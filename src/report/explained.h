/* SPDX-License-Identifier: Apache-2.0
 *
 * Does a picture agree with its target? An item of the page for each view that has both
 * (docs/report.md). */
#ifndef IMP_REPORT_EXPLAINED_H
#define IMP_REPORT_EXPLAINED_H

#include "base/film.h"
#include "base/text.h"

/* The value of the item's `data`. false: the two cannot be compared (size, channels), and
 * nothing is written; or there is no memory, and t->failed. */
bool imp__explained_put(struct imp_text *t, const imp_film *picture,
                        const imp_film *target);

#endif
