/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of spectra. What is read has at least two wavelengths, which ascend, and finite
 * values. */
#include "format/value.h"
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
        file = memfd_create("spectrum", 0);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
        if (file < 0 || imp_context_create(NULL, &ctx) != IMP_OK) abort();
    }
    if (ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != (ssize_t)size) abort();
    struct imp_samples s;
    if (imp__samples_read(ctx, path, &s) != IMP_OK) {
        if (!strstr(imp_last_error(ctx), path)) abort();
        return 0;
    }
    if (s.n < 2) abort();
    for (size_t k = 0; k < s.n; k++) {
        if (!isfinite(s.list[k]) || !isfinite(s.list[s.n + k])) abort();
        if (k > 0 && !(s.list[k] > s.list[k - 1])) abort();
    }
    imp__release(ctx, s.list);
    return 0;
}
