/* SPDX-License-Identifier: Apache-2.0
 *
 * Random walks as an item of a page. */
#ifndef IMP_CLI_WALK_ITEMS_H
#define IMP_CLI_WALK_ITEMS_H

#include "command.h"

/* Walks 0 to count - 1 of each of the pixels [n][2], with the shares of parameters:
 * {"bounds":.., "params":.., "pixels":.., "walk_shares":.., "walks":[..]}, to be freed; NULL
 * with the reason printed and *rc an exit code. */
char *walks_json(const struct imp_run *run, size_t n, const int (*pixel)[2], int count,
                 int *rc);

#endif
