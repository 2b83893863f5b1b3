/* SPDX-License-Identifier: Apache-2.0
 *
 * info --ugr-table: the glare ratings of luminaires in standard rooms. */
#ifndef IMP_CLI_UGR_TABLES_H
#define IMP_CLI_UGR_TABLES_H

#include "text/args.h"
#include "text/json.h"

struct glare_table_wanted {
    int on;
    double spacing, flux;
};
extern struct glare_table_wanted glare_table_wanted;
extern const struct arg_option options_glare_table[];

/* 0, or an exit code with the reason printed, where options go without --ugr-table. */
int glare_table_check(void);
/* The tables of the scene's luminaires, each once; as text if j is NULL. 0, or an exit code with
 * the reason printed. */
int glare_tables_print(struct json *j);

#endif
