/* SPDX-License-Identifier: Apache-2.0
 *
 * --set: numbers of the scene given on the command line, or in a file. */
#ifndef IMP_CLI_SETTINGS_H
#define IMP_CLI_SETTINGS_H

#include <importon/importon.h>
#include <stddef.h>
#include <stdio.h>

/* "ID=V[,V..]", or "@FILE" with one of these a line. 0, or an exit code with the reason
 * printed. */
int settings_apply(const char *text);

/* Where the name is OBJECT.pose or another number of geometry, and no parameter yet, it becomes
 * one. */
enum imp_status settings_pose(const char *name);
/* The text of such a file, read now and kept for settings_apply, which reads no file
 * twice (it may be a pipe); NULL: it cannot be read, which settings_apply will report. */
const char *settings_hold(const char *path, size_t *length);

/* All of a file, with a zero byte behind the end; NULL with errno set: it cannot be read,
 * or (EFBIG) is not shorter than `limit`. */
char *read_all(FILE *file, size_t limit, size_t *length);

#endif
