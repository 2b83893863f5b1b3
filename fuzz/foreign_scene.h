/* SPDX-License-Identifier: Apache-2.0
 *
 * Any bytes as a file of another program: a scene, or an error that names a file. */
#ifndef IMP_FUZZ_FOREIGN_SCENE_H
#define IMP_FUZZ_FOREIGN_SCENE_H

#include <importon/importon.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* `folder` (or NULL) is searched for files, and may be what an error names. */
static inline void foreign_scene(const char *name, const uint8_t *text, size_t n,
                                 bool lenient, const char *folder)
{
    static imp_context *ctx; /* one for all inputs: Embree's device takes long to make */
    if (!ctx) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        if (imp_context_create(&o, &ctx) != IMP_OK) abort();
    }
    const char *defines[] = {"width=4"}; /* a film of the default size takes long */
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.defines = defines;
    o.n_defines = 1;
    o.search = &folder;
    o.n_search = folder != NULL;
    o.lenient = lenient ? IMP_LENIENT_QUIET : IMP_LENIENT_OFF;
    imp_scene *scene = NULL;
    const enum imp_status st =
        imp_scene_load_string(ctx, (const char *)text, n, name, &o, &scene);
    if ((st == IMP_OK) != (scene != NULL)) abort();
    if ((st == IMP_E_SCENE || st == IMP_E_UNSUPPORTED) &&
        strncmp(imp_last_error(ctx), name, strlen(name)) != 0 &&
        !(folder && strncmp(imp_last_error(ctx), folder, strlen(folder)) == 0))
        abort();
    imp_scene_destroy(scene);
}

#endif
