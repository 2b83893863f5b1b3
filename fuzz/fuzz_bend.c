/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of bent rays: any bytes are a problem that can be traced and differentiated, or
 * an error. Memory is limited, so that absurd sizes are refused and not swapped. */
#include <importon/bend.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define MEMORY_MAX ((size_t)256 << 20)

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static size_t held;
static void *limited(size_t bytes, void *payload)
{
    (void)payload;
    if (bytes > MEMORY_MAX || held + bytes > MEMORY_MAX) return NULL;
    size_t *p = aligned_alloc(64, (bytes + 127) / 64 * 64);
    if (!p) return NULL;
    *p = bytes;
    held += bytes;
    return (char *)p + 64;
}
static void release(void *memory, void *payload)
{
    (void)payload;
    if (!memory) return;
    size_t *p = (size_t *)(void *)((char *)memory - 64);
    held -= *p;
    free(p);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        o.allocator = (struct imp_allocator){limited, release, NULL};
        if (imp_context_create(&o, &ctx) != IMP_OK) abort();
    }
    imp_bend *b = NULL;
    const enum imp_status st =
        imp_bend_load_string(ctx, (const char *)data, size, "fuzz.xml", NULL, &b);
    if ((st == IMP_OK) != (b != NULL)) abort();
    if (st != IMP_OK && !imp_last_error(ctx)[0]) abort();
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    if (b && imp_bend_n_rays(b) <= 200 && imp_bend_n_targets(b) <= 20 &&
        imp_field_n_theta(imp_bend_field(b)) <= 4096 &&
        imp_bend_get_options(b, &o) == IMP_OK && o.step > 1e-3) {
        double value, *g = calloc(imp_field_n_theta(imp_bend_field(b)), sizeof *g);
        if (imp_bend_objective(b, &value, g, NULL, NULL) != IMP_OK &&
            !imp_last_error(ctx)[0])
            abort();
        free(g);
    }
    imp_bend_destroy(b);
    return 0;
}
