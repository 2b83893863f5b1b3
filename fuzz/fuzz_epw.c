/* SPDX-License-Identifier: Apache-2.0
 *
 * EPW weather files. What is read is a year of finite hours in range. */
#include "format/epw_file.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct imp_weather *w)
{
    if (w->info.n != 8760 && w->info.n != 8784) abort();
    for (size_t i = 0; i < w->info.n; i++) {
        const struct imp_weather_hour *h = &w->hour[i];
        const double x[] = {h->diffuse, h->direct, h->diffuse_illuminance,
                            h->direct_illuminance};
        double length = 0;
        for (int k = 0; k < 3; k++) length += h->sun[k] * h->sun[k];
        if (!(fabs(length - 1) < 1e-9)) abort();
        for (int k = 0; k < 4; k++)
            if (!(x[k] >= 0 && x[k] < 1e9)) abort();
        if (!(h->hour > 0 && h->hour < 24)) abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    struct imp_arena keep;
    struct imp_weather w;
    const struct imp_bytes text = {(unsigned char *)data, size, size};
    imp__arena_init(&keep, ctx);
    if (imp__epw_parse(ctx, &keep, "fuzz", &text, &w) == IMP_OK) check(&w);
    imp__arena_free(&keep);
    return 0;
}
