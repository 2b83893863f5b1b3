/* SPDX-License-Identifier: Apache-2.0
 *
 * Scene files: any bytes are a scene or an error that names a place. */
#include <importon/importon.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx; /* one for all inputs: Embree's device takes long to make */
    if (!ctx) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        if (imp_context_create(&o, &ctx) != IMP_OK) abort();
    }
    const char *defines[] = {"res=16"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.defines = defines;
    o.n_defines = size & 1;
    imp_scene *scene = NULL;
    const enum imp_status st =
        imp_scene_load_string(ctx, (const char *)data, size, "fuzz.xml", &o, &scene);
    if ((st == IMP_OK) != (scene != NULL)) abort();
    if (st == IMP_E_SCENE && strncmp(imp_last_error(ctx), "fuzz.xml:", 9) != 0 &&
        !strstr(imp_last_error(ctx), ".xml:"))
        abort();
    imp_scene_destroy(scene);
    return 0;
}
