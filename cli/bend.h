/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IMP_CLI_BEND_H
#define IMP_CLI_BEND_H

#include "command.h"
#include <importon/bend.h>

/* Pictures of a problem, DIR/<prefix>slice-x.png, ..., rays, spots, images. */
int bend_view(imp_bend *bend, const char *folder, const char *prefix);

#endif
