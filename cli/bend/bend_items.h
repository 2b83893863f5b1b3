/* SPDX-License-Identifier: Apache-2.0
 *
 * Bent rays as an item of a page (kind "rays", docs/report.md): paths, slices of the
 * index, arrivals and irradiances, each of the problem as it is and, where it is known,
 * of the truth. */
#ifndef IMP_CLI_BEND_ITEMS_H
#define IMP_CLI_BEND_ITEMS_H

#include "text/json.h"
#include <importon/bend.h>

/* The members of the item. truth NULL: not known. 0, or an exit code with the reason
 * printed. */
int bend_rays_json(struct json *j, imp_bend *bend, const imp_field *truth);

/* The box of the field, or that of the rays and their ends. */
void bend_box(imp_bend *bend, double lo[3], double hi[3]);

/* The true field of --truth FILE: the field of a file with rays (.xml), or what
 * imp_field_read takes. 0, or an exit code with the reason printed. */
struct bend_truth {
    imp_bend *bend; /* that it is of; NULL */
    imp_field *own; /* or the field alone; NULL */
};
int bend_truth_open(const char *path, struct bend_truth *out);
const imp_field *bend_truth_field(const struct bend_truth *truth);
void bend_truth_close(struct bend_truth *truth);

#endif
