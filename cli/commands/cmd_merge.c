/* SPDX-License-Identifier: Apache-2.0
 *
 * importon merge: parts of a run to the whole, or to a larger part. */
#include "shared/overwrite.h"
#include "shared/part.h"

#include <stdlib.h>
#include <string.h>

static int is_part(const char *path)
{
    const size_t n = path ? strlen(path) : 0;
    return n > 5 && !strcmp(path + n - 5, ".part");
}

/* Run the command that made the parts; its walks are in them. */
static int run_again(const struct imp_parts_info *info)
{
    int n = 0, used = 0;
    char **words = part_command_words(info->command, &n);
    char **argv;
    if (!words)
        return cli_error(EXIT_USAGE, "these parts were not made by this command: %s",
                         info->command);
    const enum imp_status st = imp_context_set_parts(cli.context, cli.parts);
    if (st != IMP_OK) return cli_fail(st, NULL);
    argv = cli_alloc((size_t)n + 2, sizeof *argv);
    argv[used++] = words[0];
    /* What was given here stays as parsed, but -o, whose place depends on the command. */
    for (int k = 1; k < n; k++) argv[used++] = words[k];
    const int rc = cli_run_command(used, argv);
    free(words[0]);
    free(words);
    free(argv);
    return rc;
}

static int run_merge(int n, char **operand)
{
    struct imp_parts_info info = {.size = sizeof info};
    int rc = cli_open();
    if (rc) return rc;
    enum imp_status st =
        imp_parts_read(cli.context, (const char *const *)operand, (size_t)n, &cli.parts);
    if (st == IMP_OK) st = imp_parts_get_info(cli.parts, &info);
    if (st != IMP_OK) return cli_fail(st, NULL);
    if (is_part(cli.out)) {
        rc = overwrite_check(cli.out, OUTPUT_PART);
        if (rc) return rc;
        st = imp_parts_write(cli.parts, cli.out);
        if (st != IMP_OK) return cli_fail(st, NULL);
        cli_say("%s: %d part%s%s%s", cli.out, info.n, plural(info.n),
                info.missing ? "; missing: " : "", info.missing ? info.holes : "");
        return EXIT_DONE;
    }
    if (info.missing) return cli_error(EXIT_USAGE, "parts are missing: %s", info.holes);
    return run_again(&info);
}

const struct command command_merge = {
    {"merge",
     "PART ...",
     "make the result of a run from its parts (--part), to the bit",
     {options_file, options_general},
     1,
     -1},
    run_merge,
    0,
    NULL,
    0};
