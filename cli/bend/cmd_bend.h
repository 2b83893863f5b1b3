/* SPDX-License-Identifier: Apache-2.0
 *
 * What the files of `importon bend` share: the open problem, its answer as text or JSON,
 * pictures. */
#ifndef IMP_CLI_CMD_BEND_H
#define IMP_CLI_CMD_BEND_H

#include "shared/command.h"
#include "shared/output.h"
#include <importon/bend.h>

/* A file with rays and a field. 0, or an exit code with the reason printed. */
int bend_open(const char *path, imp_bend **out);
int bend_fit(imp_bend *bend);
extern const struct arg_option bend_fit_options[];
/* --truth: a file that bend_truth_open takes; NULL. */
extern const char *bend_truth_path;
/* "NAME": value of each named number of the field. */
void bend_put_numbers(imp_bend *bend, FILE *to, struct json *j);
/* The field, into cli.out: field.vol and field.npy, or field.txt. */
int bend_field_write(const imp_bend *bend);
/* Counts of a trace. */
void bend_print_stats(FILE *to, const struct imp_bend_stats *s);
void bend_put_stats(struct json *j, const struct imp_bend_stats *s);
const char *bend_target_word(enum imp_bend_target_type type);
/* Pictures of a problem, DIR/<prefix>slice-x.png, ..., rays, spots, images. `json` gets
 * what they show; NULL: no answer. */
int bend_view(imp_bend *bend, const char *folder, const char *prefix, struct json *json);
/* May they all be written? */
int bend_view_writable(const char *folder, const char *prefix);

#endif
