/* SPDX-License-Identifier: Apache-2.0
 *
 * In place of image_tiff.c, where libtiff is not there. */
#include "image.h"

enum imp_status imp__tiff_parse(imp_context *ctx, const char *name,
                                const struct imp_bytes *file, imp_film **out, bool *srgb)
{
    (void)file, (void)out, (void)srgb;
    return imp__error(ctx, IMP_E_UNSUPPORTED,
                      "%s: a TIFF file, and this importon was built without libtiff",
                      name);
}
