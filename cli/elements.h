/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IMP_CLI_ELEMENTS_H
#define IMP_CLI_ELEMENTS_H

#include "command.h"
#include <importon/elements.h>

struct elements_sources {
    struct arg_list regions, planes, shapes; /* --region, --plane, --lux */
};
/* From the texts of the options; each allocates its array. 0, or an exit code with the
 * reason printed. */
int elements_phong(const struct arg_list *list, struct imp_elements_phong **out);
int elements_beams(const struct arg_list *list, struct imp_elements_beam **out);
int elements_sources(const struct elements_sources *s, int sensor,
                     struct imp_elements_source **out, size_t *n);

#endif
