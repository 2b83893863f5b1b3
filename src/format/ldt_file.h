/* SPDX-License-Identifier: Apache-2.0
 *
 * Photometry of luminaires: EULUMDAT (Stockmar 1990), the European files `.ldt`. */
#ifndef IMP_FORMAT_LDT_FILE_H
#define IMP_FORMAT_LDT_FILE_H

#include "base/file.h"
#include "base/props.h"

/* As imp__ies_parse: the table in cd, by the flux of the first set of lamps. Where flux,
 * light output ratio and table contradict each other by more than 10 %, there is a warning
 * with the file's name. @return IMP_E_SCENE with file and line; IMP_E_NOMEM. */
enum imp_status imp__ldt_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *text, struct imp_ies_data *out);

#endif
