/* SPDX-License-Identifier: Apache-2.0
 *
 * --until: samples until the wanted error is reached. */
#ifndef IMP_CLI_WANTED_H
#define IMP_CLI_WANTED_H

#include "text/json.h"
#include <importon/until.h>

/* With parts, and with a clock on several machines. 0, or an exit code. */
int until_refused(void);
/* run->spp, which is the most, moves there. */
struct imp_until_options until_options(double relative, struct imp_run *run);
void until_say(const char *what, const struct imp_until_end *end);
void until_json(struct json *j, double relative, const struct imp_until_end *end);

#endif
