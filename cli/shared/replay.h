/* SPDX-License-Identifier: Apache-2.0
 *
 * Commands in files. Parts and manifests carry the command that made them, and merge and verify
 * run it again. Such a file may come from anybody: what it may carry is a list (ARG_REPLAYS in
 * the tables of options, `replays` of a command), and nothing else is run. */
#ifndef IMP_CLI_REPLAY_H
#define IMP_CLI_REPLAY_H

#include "command.h"

/* The command that runs, as a line: options spelled out, every word in quotes. Options that do
 * not change the result are left out, and files of --set are put in as their settings. The caller
 * frees it. NULL: no memory. */
char *replay_line(void);
/* The first option given here that a carried command may not have, "--name"; or NULL. */
const char *replay_unfit(void);

/* The words of a line that `path` carries: argv, ends with NULL, [*argc]; the caller frees argv
 * and argv[0]. 0; or an exit code, with the reason printed, if this is not a command that files of
 * this `kind` may carry. */
int replay_words(const char *path, enum replays kind, const char *line, int *argc,
                 char ***argv);

#endif
