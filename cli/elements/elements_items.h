/* SPDX-License-Identifier: Apache-2.0
 *
 * Finite elements for a page (docs/report.md): the answer with its sensitivities
 * (elements.json), and the elements, their links, illuminances and ranked lamps
 * (mesh.json). */
#ifndef IMP_CLI_ELEMENTS_ITEMS_H
#define IMP_CLI_ELEMENTS_ITEMS_H

#include "cmd_elements.h"

/* May both be written? 0, or an exit code with the reason printed. */
int elements_report_writable(const char *folder);
int elements_report_write(const imp_elements *e, const struct elements_answer *a,
                          const char *folder);

#endif
