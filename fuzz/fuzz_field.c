/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of fields of refractive indices: grids of both formats, and profiles as text. What is
 * read has finite values everywhere. */
#include <importon/bend.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    static int file;
    static char path[64]; /* of a file in memory */
    if (!ctx) {
        file = memfd_create("field", 0);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
        if (file < 0 || imp_context_create(NULL, &ctx) != IMP_OK) abort();
    }
    if (ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != (ssize_t)size) abort();
    imp_field *f = NULL;
    if (imp_field_read(ctx, path, NULL, &f) != IMP_OK) {
        if (!strstr(imp_last_error(ctx), path) || f) abort();
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
