/* SPDX-License-Identifier: Apache-2.0
 *
 * The progress bar on stderr, and the signals that end a run (SIGINT by Ctrl-C, SIGTERM,
 * SIGHUP): the first stops the library after what it is doing, and results so far
 * are written; the second ends the process at once. */
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
/* The signal that came; 0: none did. */
int progress_interrupted(void);
/* From now on, the library stops after this time, too; 0: never. */
void progress_deadline(double seconds);
/* Go on after a signal, to write what is there; the exit code stays. */
void progress_resume(void);

#endif
