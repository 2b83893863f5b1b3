/* SPDX-License-Identifier: Apache-2.0
 *
 * DNG files: what is read has a picture of finite values, none above white. */
#include "format/image.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    if (size < 4) return 0;
    struct imp_bytes file = {malloc(size), size, size}; /* LibRaw takes no const */
    if (!file.data) return 0;
    for (size_t i = 0; i < size; i++) file.data[i] = data[i];
    imp_film *film = NULL;
    (void)imp__dng_is(&file);
    const enum imp_status st = imp__dng_parse(ctx, "fuzz", &file, &film);
    if ((st == IMP_OK) != (film != NULL)) abort();
    for (size_t i = 0; film && i < imp__film_values(film); i++)
        if (!isfinite(film->mean[i]) || film->mean[i] > 1) abort();
    imp_film_destroy(film);
    free(file.data);
    return 0;
}
