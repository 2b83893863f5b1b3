/* SPDX-License-Identifier: Apache-2.0
 *
 * Three int32, the numbers of half-angles, difference angles and azimuths of the latter
 * (90, 90, 180), then one plane of doubles for red, green and blue each, the azimuth
 * running fastest; little-endian. Numbers are reflectances in 1/sr over 1/1500, 1.15/1500
 * and 1.66/1500. Those below 0 mark what was not measured: they are 0 here. */
#include "merl_file.h"
#include "base/little.h"
#include <math.h>
#include <string.h>

#define HEADER    12
#define SIDE_MAX  4096
#define TABLE_MAX ((size_t)1 << 24)
#define RHO_MAX   1e12 /* 1/sr */

enum imp_status imp__merl_parse(imp_context *ctx, struct imp_arena *keep,
                                const char *name, const struct imp_bytes *file,
                                struct imp_merl_data *out)
{
    static const double scale[3] = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
    int32_t n[3];
    if (file->size < HEADER)
        return imp__error(ctx, IMP_E_SCENE, "%s: %zu bytes are no measured material",
                          name, file->size);
    for (int k = 0; k < 3; k++) n[k] = imp__little_i32(file->data + 4 * k);
    for (int k = 0; k < 3; k++)
        if (n[k] < 1 || n[k] > SIDE_MAX)
            return imp__error(ctx, IMP_E_SCENE,
                              "%s: a table of %d x %d x %d is no measured material "
                              "(90 x 90 x 180 in MERL's database)",
                              name, n[0], n[1], n[2]);
    const size_t cells = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    if (cells > TABLE_MAX || file->size != HEADER + 24 * cells)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: %zu bytes; a table of %d x %d x %d has %zu", name,
                          file->size, n[0], n[1], n[2], HEADER + 24 * cells);
    float *rho = imp__arena_take(keep, 3 * cells, sizeof *rho);
    if (!rho) return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for its table", name);
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < cells; k++) {
            const double x =
                imp__little_double(file->data + HEADER + 8 * (c * cells + k));
            if (!(fabs(x) <= RHO_MAX))
                return imp__error(ctx, IMP_E_SCENE, "%s: number %zu of plane %zu is %g",
                                  name, k, c, x);
            rho[3 * k + c] = x > 0 ? (float)(x * scale[c]) : 0;
        }
    *out = (struct imp_merl_data){n[0], n[1], n[2], rho};
    return IMP_OK;
}
