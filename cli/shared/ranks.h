/* SPDX-License-Identifier: Apache-2.0
 *
 * Processes that mpirun started: all run the command, the first of them prints and
 * writes. */
#ifndef IMP_CLI_RANKS_H
#define IMP_CLI_RANKS_H

#include <importon/importon.h>
#include <stdbool.h>
#include <stddef.h>

/* Which one this is, by what mpirun left in the environment; before anything is printed.
 */
void ranks_begin(void);
int ranks_count(void);
/* Does this process print and write? */
bool ranks_first(void);
/* Does it read files that are not the library's to read? */
bool ranks_reads(void);
/* Until then, rank 0 alone writes to standard error: all parse the same options. */
void ranks_heard(void);

/* Join the others in this context. 0, or an exit code. */
int ranks_open(imp_context *context);
/* This process works alone from here on. */
void ranks_leave(void);
/* The bytes that rank 0 has, for all; alone, nothing happens. */
int ranks_broadcast(char **bytes, size_t *n);

/* The number of rank 0, for what is decided by a clock or a user. */
double ranks_same(double number);

/* Keep what the first process is to print in the end. */
void ranks_remember(bool error, const char *text);
/* Why calls fail, where the reason is another rank: its exit code, and a text. 0: not. */
int ranks_ended(const char **text);
/* The same exit code for all, with the messages of the others. */
int ranks_close(int rc);

#endif
