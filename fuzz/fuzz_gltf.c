/* SPDX-License-Identifier: Apache-2.0
 *
 * glTF: any bytes are a scene or an error that names the file. The first byte says whether
 * it is read leniently. */
#include <importon/importon.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx; /* one for all inputs: Embree's device takes long to make */
    static const char name[] = "fuzz.glb";
    if (!ctx) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        if (imp_context_create(&o, &ctx) != IMP_OK) abort();
    }
    if (size < 1) return 0;
    const char *defines[] = {"width=4"}; /* a film of the default size takes long */
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.defines = defines;
    o.n_defines = 1;
    o.lenient = data[0] & 1 ? IMP_LENIENT_QUIET : IMP_LENIENT_OFF;
    imp_scene *scene = NULL;
    const enum imp_status st =
        imp_scene_load_string(ctx, (const char *)data + 1, size - 1, name, &o, &scene);
    if ((st == IMP_OK) != (scene != NULL)) abort();
    if ((st == IMP_E_SCENE || st == IMP_E_UNSUPPORTED) &&
        strncmp(imp_last_error(ctx), name, strlen(name)) != 0)
        abort();
    imp_scene_destroy(scene);
    return 0;
}
