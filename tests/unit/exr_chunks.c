/* SPDX-License-Identifier: Apache-2.0
 *
 * EXR chunks of every compressed length round their own: pictures of noise whose ZIP
 * stream is about as long as the pixels, one picture for each number of pixels that are
 * 0. Readers take a chunk of exactly the pixels' length for plain pixels. */
#include "base/file.h"
#include "format/image.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"

int main(void)
{
    enum { WIDTH = 64, HEIGHT = 16, N = WIDTH * HEIGHT };
    imp_context *ctx = test_context(1);
    int wrong = 0, equal = 0;
    for (int round = 0; round < 2400; round++) {
        const int blank = round % 120;
        const struct imp_key key = imp__key(31, (uint64_t)round, 0);
        struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
        struct imp_bytes bytes = {0};
        imp_film *film, *back;
        test_must(ctx, imp_film_create(ctx, WIDTH, HEIGHT, "Y", &film));
        float *pixels = imp_film_mean(film);
        for (int k = blank; k < N; k++) {
            const double u = imp__u01(key, (uint32_t)(2 * k));
            pixels[k] = (float)exp(80 * imp__u01(key, (uint32_t)(2 * k + 1)) - 40 + u);
        }
        test_must(ctx, imp__exr_encode(film, &o, &bytes));
        /* The last chunk is the whole picture: it ends the file. */
        const size_t raw = N * sizeof(float);
        uint32_t length;
        if (bytes.size > raw + 4) {
            memcpy(&length, (const char *)bytes.data + bytes.size - raw - 4, 4);
            equal += length == raw;
        }
        test_must(ctx, imp__exr_parse(ctx, "picture", &bytes, &back));
        wrong += memcmp(imp_film_mean(back), pixels, raw) != 0;
        imp__bytes_free(ctx, &bytes);
        imp_film_destroy(film);
        imp_film_destroy(back);
    }
    tap_ok(wrong == 0 && equal > 0 && equal < 2400,
           "2400 pictures of noise come back # %d wrong, %d stored plain", wrong, equal);
    imp_context_destroy(ctx);
    return tap_done();
}
