/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of every format; what is read can be written and read again. */
#include "format/image.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    const struct imp_bytes file = {(unsigned char *)data, size, size};
    imp_film *film = NULL, *again = NULL;
    bool srgb;
    const enum imp_status st = imp__image_parse(ctx, "fuzz", &file, &film, &srgb);
    if ((st == IMP_OK) != (film != NULL)) abort();
    if (film && imp__film_values(film) < 4096) {
        const struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
        struct imp_bytes bytes = {0};
        if (imp__npy_encode(film, &bytes) != IMP_OK) abort();
        imp__bytes_free(ctx, &bytes);
        if (imp__exr_encode(film, &o, &bytes) == IMP_OK) {
            if (imp__image_parse(ctx, "again", &bytes, &again, &srgb) != IMP_OK) abort();
            if (imp__film_values(again) != imp__film_values(film)) abort();
        }
        imp__bytes_free(ctx, &bytes);
    }
    imp_film_destroy(again);
    imp_film_destroy(film);
    return 0;
}
