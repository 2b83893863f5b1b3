/* SPDX-License-Identifier: Apache-2.0
 *
 * JSON files of answers. */
#include "answer_file.h"

#include "command.h"
#include "picture_files.h"

#include <stdlib.h>

int answer_open(struct answer_file *a, const char *folder, const char *file,
                const char *command)
{
    a->path = join_path(folder, file);
    const int rc = output_open(&a->to, a->path, OUTPUT_JSON);
    if (rc) {
        free(a->path);
        return rc;
    }
    a->json = (struct json){a->to.file, 0};
    json_object(&a->json, NULL);
    json_text(&a->json, "importon", imp_version());
    json_text(&a->json, "command", command);
    return 0;
}

int answer_close(struct answer_file *a, int rc)
{
    cli_json_end(&a->json);
    rc = output_close(&a->to, rc);
    free(a->path);
    return rc;
}
