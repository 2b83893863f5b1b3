/* SPDX-License-Identifier: Apache-2.0
 *
 * The progress bar on stderr, and Ctrl-C: the first asks the library to stop after what
 * it is doing, and results so far are written; the second ends the process at once. */
#ifndef IMP_CLI_PROGRESS_H
#define IMP_CLI_PROGRESS_H

#include <importon/importon.h>

enum progress_mode { PROGRESS_AUTO, PROGRESS_ALWAYS, PROGRESS_NEVER };

/* Install the handler, decide about the bar (auto: only if stderr is a terminal). */
void progress_init(enum progress_mode mode);
/* An imp_progress_fn. */
int progress_report(const struct imp_progress *progress, void *payload);
/* Remove the bar from the terminal; call before printing to stderr. */
void progress_clear(void);
/* Was Ctrl-C pressed? */
int progress_interrupted(void);
/* From now on, ask the library to stop after this time, too; 0: never. */
void progress_deadline(double seconds);
/* Go on after a Ctrl-C, to write what is there; the exit code stays 130. */
void progress_resume(void);

#endif
