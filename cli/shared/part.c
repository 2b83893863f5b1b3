/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of a run: which, and where they go. */
#include "part.h"
#include "overwrite.h"
#include "replay.h"

#include <stdlib.h>
#include <string.h>

static int index_, count;

int part_begin(void)
{
    char rest;
    if (!cli.part) return 0;
    if (sscanf(cli.part, "%d/%d%c", &index_, &count, &rest) != 2 || index_ < 1 ||
        index_ > count)
        return cli_error(EXIT_USAGE,
                         "%s: --part %s is not good: expected I/N with I from 1 to N",
                         cli.name, cli.part);
    if (cli.time_s > 0)
        return cli_error(EXIT_USAGE,
                         "%s: --part and --time do not go together: parts "
                         "end with their samples",
                         cli.name);
    const struct command *command = cli_command(cli.name);
    const char *unfit = command->replays & REPLAYS_PARTS ? replay_unfit() : NULL;
    if (unfit)
        return cli_error(EXIT_USAGE,
                         "%s: --part and %s do not go together: no part may carry this "
                         "option",
                         cli.name, unfit);
    if (!cli.out || !strcmp(cli.out, "-"))
        return cli_error(EXIT_USAGE, "%s: --part needs -o FILE for the part", cli.name);
    cli.part_out = cli.out;
    cli.out = NULL;
    const int rc = overwrite_check(cli.part_out, OUTPUT_PART);
    return rc;
}

int part_open(void)
{
    if (!cli.part) return 0;
    char *text = replay_line();
    if (!text) return cli_error(EXIT_RUN, "out of memory");
    enum imp_status st = imp_parts_create(cli.context, index_, count, text, &cli.parts);
    if (st == IMP_OK) st = imp_context_set_parts(cli.context, cli.parts);
    free(text);
    return st == IMP_OK ? 0 : cli_fail(st, NULL);
}

int part_end(void)
{
    if (!(cli_command(cli.name)->replays & REPLAYS_PARTS))
        return cli_error(EXIT_USAGE, "%s cannot be made in parts", cli.name);
    const enum imp_status st = imp_parts_write(cli.parts, cli.part_out);
    if (st != IMP_OK) return cli_fail(st, NULL);
    cli_say("%s: part %d of %d", cli.part_out, index_, count);
    return EXIT_STOP;
}
