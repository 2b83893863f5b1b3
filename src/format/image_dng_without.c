/* SPDX-License-Identifier: Apache-2.0
 *
 * In place of image_dng.c, where LibRaw is not there. */
#include "image.h"

enum imp_status imp__dng_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    (void)file, (void)out;
    return imp__error(ctx, IMP_E_UNSUPPORTED,
                      "%s: a DNG file, and this importon was built without LibRaw", name);
}
