/* SPDX-License-Identifier: Apache-2.0
 *
 * TIFF files: what is read has the channels and the finite size that its header says. */
#include "format/image.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    const struct imp_bytes file = {(unsigned char *)data, size, size};
    imp_film *film = NULL;
    bool srgb = false;
    const enum imp_status st = imp__tiff_parse(ctx, "fuzz", &file, &film, &srgb);
    if ((st == IMP_OK) != (film != NULL)) abort();
    for (size_t i = 0; film && srgb && i < imp__film_values(film); i++)
        if (!(film->mean[i] >= 0 && film->mean[i] <= 1)) abort();
    imp_film_destroy(film);
    return 0;
}
