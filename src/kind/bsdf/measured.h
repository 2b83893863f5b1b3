/* SPDX-License-Identifier: Apache-2.0
 *
 * The tables of a measured BRDF (imp_measured_data): their sizes, and which numbers they
 * may hold. */
#ifndef IMP_KIND_BSDF_MEASURED_H
#define IMP_KIND_BSDF_MEASURED_H

#include "base/props.h"
#include <stdbool.h>
#include <stddef.h>

#define IMP_MEASURED_SIDE_MAX (1 << 14)
#define IMP_MEASURED_SHARE    0.0625 /* of directions that are drawn by the cosine */

/* Numbers of each table; 0: there is none. False: sizes that no file may have. */
bool imp__measured_counts(const struct imp_measured_data *d,
                          size_t count[IMP_MEASURED_TABLES]);
/* Numbers below 0, of tables of densities and reflectances, become 0.
 * @return NULL, or what is wrong with the numbers */
const char *imp__measured_mend(enum imp__measured_table k, float *table, size_t n);

#endif
