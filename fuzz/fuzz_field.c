/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of fields of refractive indices: grids of both formats, and profiles as text. What is
 * read has finite values everywhere. */
#include "memory_file.h"
#include <importon/bend.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    static struct memory_file file;
    if (!ctx) {
        memory_file_open(&file);
        if (imp_context_create(NULL, &ctx) != IMP_OK) abort();
    }
    memory_file_put(&file, data, size);
    imp_field *f = NULL;
    if (imp_field_read(ctx, file.path, NULL, &f) != IMP_OK) {
        if (!strstr(imp_last_error(ctx), file.path) || f) abort();
        return 0;
    }
    for (int k = 0; k < 64; k++) {
        const double x[3] = {-1 + k % 4 * .66, -1 + k / 4 % 4 * .66, -1 + k / 16 * .66};
        double eta, gradient[3];
        imp_field_eval(f, x, &eta, gradient, NULL);
        if (isnan(eta)) abort();
    }
    imp_field_destroy(f);
    return 0;
}
