/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures to a viewer that listens on a port: tev's protocol (github.com/Tom94/tev:
 * CreateImage, and version 3 of UpdateImage). */
#ifndef IMP_CLI_DISPLAY_H
#define IMP_CLI_DISPLAY_H

#include <importon/importon.h>

/* Connect to --display HOST:PORT, if it was given. 0, or an exit code with the reason
 * printed. */
int display_open(void);
/* Show a film, with its standard errors as channels se.*, under this name; a later one of
 * the same name and size takes its place. A connection that breaks is reported once, and the
 * run goes on. */
void display_film(const imp_film *film, const char *name);
/* An imp_preview_fn; payload: the name. */
void display_preview(const imp_film *film, void *payload);
void display_close(void);

#endif
