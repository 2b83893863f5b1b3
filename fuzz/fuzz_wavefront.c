/* SPDX-License-Identifier: Apache-2.0
 *
 * OBJ files with MTL files: any bytes are a scene or an error that names a file. The first
 * byte says whether they are read leniently; the library, "m.mtl", is what follows the
 * first zero byte. */
#include <importon/importon.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void library_put(const char *folder, const uint8_t *data, size_t size)
{
    char path[64];
    snprintf(path, sizeof path, "%s/m.mtl", folder);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(data, 1, size, f) != size || fclose(f) != 0) abort();
}

static char folder[] = "/tmp/importon-fuzz-XXXXXX";
static void folder_remove(void)
{
    char path[64];
    snprintf(path, sizeof path, "%s/m.mtl", folder);
    remove(path);
    remove(folder);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx; /* one for all inputs: Embree's device takes long to make */
    static const char name[] = "fuzz.obj";
    if (!ctx) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        if (imp_context_create(&o, &ctx) != IMP_OK || !mkdtemp(folder)) abort();
        atexit(folder_remove);
    }
    if (size < 1) return 0;
    const uint8_t *zero = memchr(data + 1, 0, size - 1);
    const size_t n = zero ? (size_t)(zero - data) - 1 : size - 1;
    library_put(folder, zero ? zero + 1 : data, zero ? size - n - 2 : 0);
    const char *defines[] = {"width=4"}; /* a film of the default size takes long */
    const char *search[] = {folder};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.defines = defines;
    o.n_defines = 1;
    o.search = search;
    o.n_search = 1;
    o.lenient = data[0] & 1 ? IMP_LENIENT_QUIET : IMP_LENIENT_OFF;
    imp_scene *scene = NULL;
    const enum imp_status st =
        imp_scene_load_string(ctx, (const char *)data + 1, n, name, &o, &scene);
    if ((st == IMP_OK) != (scene != NULL)) abort();
    if ((st == IMP_E_SCENE || st == IMP_E_UNSUPPORTED) &&
        strncmp(imp_last_error(ctx), name, strlen(name)) != 0 &&
        strncmp(imp_last_error(ctx), folder, strlen(folder)) != 0)
        abort();
    imp_scene_destroy(scene);
    return 0;
}
