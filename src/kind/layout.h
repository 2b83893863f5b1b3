/* SPDX-License-Identifier: Apache-2.0
 *
 * Was a plug-in compiled with a kinds.h that this library can serve? */
#ifndef IMP_KIND_LAYOUT_H
#define IMP_KIND_LAYOUT_H

#include "base/context.h"
#include <importon/kinds.h>

/* IMP_OK, or IMP_E_ARG with a sentence that names the struct, its size there and here, and
 * both versions (kinds.h, "Versions of this header"). */
enum imp_status imp__kinds_layout_check(imp_context *ctx, const char *function,
                                        const struct imp_kinds_layout *there);

#endif
