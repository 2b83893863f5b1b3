/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer of a report as HTML that needs no script: the verdict, the numbers, how it was made. */
#ifndef IMP_REPORT_PAGE_STATIC_H
#define IMP_REPORT_PAGE_STATIC_H

#include "base/text.h"
#include <importon/report.h>

/* `data` is the page's data, which has been made and is valid. @return IMP_OK; IMP_E_NOMEM. */
enum imp_status imp__page_static(struct imp_text *t, const struct imp_report *r,
                                 const char *data);

#endif
