/* SPDX-License-Identifier: Apache-2.0
 *
 * importon merge: parts of a run to the whole, or to a larger part. */
#include "shared/overwrite.h"
#include "shared/replay.h"

#include <stdlib.h>
#include <string.h>

static int is_part(const char *path)
{
    const size_t n = path ? strlen(path) : 0;
    return n > 5 && !strcmp(path + n - 5, ".part");
}

/* Run the command that made the parts; its walks are in them. What was given here (-o, --json,
 * --overwrite) stays as parsed. getopt reorders the words, whose memory is that of the first. */
static int run_again(const char *path, int n, char **words)
{
    char *const memory = words[0];
    cli.carried = path;
    const enum imp_status st = imp_context_set_parts(cli.context, cli.parts);
    const int rc = st == IMP_OK ? cli_run_command(n, words) : cli_fail(st, NULL);
    free(memory);
    free(words);
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
    char **words = NULL;
    int n_words = 0;
    rc = replay_words(operand[0], REPLAYS_PARTS, info.command, &n_words, &words);
    if (rc) return rc;
    if (is_part(cli.out) || info.missing) {
        free(words[0]);
        free(words);
    }
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
    return run_again(operand[0], n_words, words);
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
    0,
    REPLAYS_NEVER};
