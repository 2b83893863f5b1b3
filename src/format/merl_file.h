/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured reflectances in the format of the MERL database (Matusik et al. 2003). */
#ifndef IMP_FORMAT_MERL_FILE_H
#define IMP_FORMAT_MERL_FILE_H

#include "base/file.h"
#include "base/props.h"

#define IMP_MERL_BYTES_MAX ((size_t)1 << 30)

/* The table lives in `keep`. IMP_E_SCENE: not such a file; `name` and what is wrong. */
enum imp_status imp__merl_parse(imp_context *ctx, struct imp_arena *keep,
                                const char *name, const struct imp_bytes *file,
                                struct imp_merl_data *out);

#endif
