/* SPDX-License-Identifier: Apache-2.0
 *
 * Manifests, what a result was made from, for importon verify: --manifest FILE, or beside
 * an output file. */
#ifndef IMP_CLI_PROOF_H
#define IMP_CLI_PROOF_H

#include "command.h"

/* Begin the manifest of the context that was just made. 0, or an exit code. */
int manifest_open(void);
/* Around the calls whose sums are kept, or verified; `output` is the file, or folder, that
 * gets the result, NULL: none. 0, or an exit code. */
int manifest_begin(const char *output);
int manifest_pause(void);
/* The sums to come are not those of the whole run: keep none. */
int manifest_whole(void);
/* Results, by name; nothing where there is no manifest. 0, or an exit code. */
int manifest_numbers(const char *name, const double *x, size_t n);
int manifest_film(const char *name, const imp_film *film);
/* A file was written; written again, its last bytes count. */
void manifest_wrote(const char *path);
/* Write it, if the run was not refused. The exit code. */
int manifest_end(int rc);

#endif
