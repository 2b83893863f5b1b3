/* SPDX-License-Identifier: Apache-2.0
 *
 * importon view where it was built without an HTTP server. */
#include "shared/command.h"

static int run(int n, char **operand)
{
    (void)n, (void)operand;
    return cli_error(EXIT_RUN, "view: this importon was built without libmicrohttpd");
}

const struct command command_view = {
    {"view",
     "SCENE",
     "look on in a browser: a render, a fit (--target) or bent rays",
     {options_general},
     1,
     1},
    run,
    0,
    0,
    REPLAYS_NEVER};
