/* SPDX-License-Identifier: Apache-2.0
 *
 * What the files of `importon elements` share: options as arrays, the answer, the fit. */
#ifndef IMP_CLI_CMD_ELEMENTS_H
#define IMP_CLI_CMD_ELEMENTS_H

#include "shared/command.h"
#include <importon/elements.h>

struct elements_sources {
    struct arg_list regions, planes, shapes; /* --region, --plane, --lux */
};
/* From the texts of the options; each allocates its array. 0, or an exit code with the
 * reason printed. */
int elements_phong(const struct arg_list *list, struct imp_elements_phong **out);
int elements_beams(const struct arg_list *list, struct imp_elements_beam **out);
int elements_bounds(const struct arg_list *list, struct imp_elements_bounds **out);
/* targets [*n]: NAN where none is given. */
int elements_sources(const struct elements_sources *s, int sensor,
                     struct imp_elements_source **out, double **targets, size_t *n);
/* As typed. */
const char *elements_source_name(const struct elements_sources *s, size_t i);

/* elements_answer.c: what was found. */
struct elements_answer {
    const struct imp_elements_info *info;
    int complete;
    const struct imp_elements_source *sources; /* [n_sources] */
    const double *targets;
    size_t n_sources;
    const struct elements_sources *typed;
    const struct imp_elements_row *rows; /* [n_rows] */
    size_t n_rows;
};
/* Members of the answer, or text for j NULL. */
void elements_answer_info(const struct elements_answer *a, struct json *j);
void elements_answer_sensitivity(const struct elements_answer *a, struct json *j);
/* Into text, or of a parameter. */
const char *elements_row_name(const struct imp_elements_row *r, char *text, size_t size);

/* cmd_elements_fit.c: importon elements --fit. */
extern const struct arg_option options_elements_fit[];
int elements_fit_wanted(void);
/* May its files be written? */
int elements_fit_writable(void);
/* Refuses targets without --fit, and --fit without targets or parameters. */
int elements_fit_check(const double *targets, size_t n);
/* Search, and keep the answer; *complete 0: it was stopped. */
int elements_fit(imp_elements *e, const double *targets, int *complete);
/* Its member "fit" of an answer. */
void elements_fit_json(struct json *j, const struct elements_sources *s);
/* Print it, as JSON if j, and write --recovered. */
int elements_fit_answer(struct json *j, const struct elements_sources *s);
void elements_fit_close(void);

#endif
