/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of spectra. What is read has at least two wavelengths, which ascend, and finite
 * values. */
#include "format/value.h"
#include "memory_file.h"
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
    struct imp_samples s;
    if (imp__samples_read(ctx, file.path, &s) != IMP_OK) {
        if (!strstr(imp_last_error(ctx), file.path)) abort();
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
