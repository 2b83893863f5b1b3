/* SPDX-License-Identifier: Apache-2.0
 *
 * What an output may replace: a file of the same kind with the mark of this
 * program, an empty file, or, with --overwrite, any file. Called before the work. */
#ifndef IMP_CLI_OVERWRITE_H
#define IMP_CLI_OVERWRITE_H

#include <stdbool.h>

enum output_kind {
    OUTPUT_ANSWER, /* what the running command prints, as text or JSON */
    OUTPUT_CHECKPOINT,
    OUTPUT_SOLUTION,
    OUTPUT_PART,
    OUTPUT_MANIFEST,
    OUTPUT_RECORD,
    OUTPUT_SETTINGS,
    OUTPUT_SCENE, /* "# importon ..", and name=value,.. for --set @FILE */
    OUTPUT_TABLE,
    OUTPUT_CURVE,
    OUTPUT_JSON,
    OUTPUT_WALKS,
    OUTPUT_PAGE,
    OUTPUT_PLY,
    OUTPUT_VOL,
    OUTPUT_PROFILE,
    OUTPUT_EXR,
    OUTPUT_PNG,
    OUTPUT_PFM,
    OUTPUT_HDR,
    OUTPUT_NPY
};

/* Can `path` be written, and may it be replaced? 0, or an exit code with the reason
 * printed. */
int overwrite_check(const char *path, enum output_kind kind);
/* The same for "folder/name". */
int overwrite_check_in(const char *folder, const char *name, enum output_kind kind);
/* A file that this command reads is no place for its output. */
void overwrite_protect(const char *path);
/* May a fit keep its state in `path`? An older checkpoint is gone on from with --resume,
 * and begun over with --overwrite. NULL: there is none. */
int checkpoint_writable(const char *path, bool resume);
/* After an interrupt, print how to continue. */
void checkpoint_hint(const char *path);

#endif
