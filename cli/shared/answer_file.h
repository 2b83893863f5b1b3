/* SPDX-License-Identifier: Apache-2.0
 *
 * JSON files of answers, which begin with the version and the command that wrote them. */
#ifndef IMP_CLI_ANSWER_FILE_H
#define IMP_CLI_ANSWER_FILE_H

#include "output.h"
#include "text/json.h"

struct answer_file {
    struct json json; /* inside its object: for what the answer says */
    struct output to;
    char *path;
};

/* FOLDER/FILE, of a command as the file shall name it. 0, or an exit code with the reason
 * printed; then nothing is to be closed. */
int answer_open(struct answer_file *a, const char *folder, const char *file,
                const char *command);
/* What was there before stays where `rc` is not 0. Returns rc, or an exit code with the reason
 * printed. */
int answer_close(struct answer_file *a, int rc);

#endif
