/* SPDX-License-Identifier: Apache-2.0
 *
 * The Cornell box of scenes/ through another reconstruction filter. */
#ifndef IMP_TESTS_CORNELL_H
#define IMP_TESTS_CORNELL_H

#include "imp_scene.h"

/* `filter`: its element; side x side pixels. */
static inline imp_scene *test_cornell_through(imp_context *ctx, const char *filter,
                                              int side)
{
    static char text[65536], changed[sizeof text + 256];
    const char box[] = "<rfilter type=\"box\"/>";
    char path[1024], size[32];
    const char *defines[] = {size}, *folders[] = {IMP_SCENES};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *scene;
    snprintf(path, sizeof path, "%s/cornell.xml", IMP_SCENES);
    FILE *f = fopen(path, "rb");
    const size_t n = f ? fread(text, 1, sizeof text - 1, f) : 0;
    if (f) fclose(f);
    text[n] = 0;
    const char *at = strstr(text, box);
    if (!at) exit(99);
    snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, filter,
             at + sizeof box - 1);
    snprintf(size, sizeof size, "res=%d", side);
    o.defines = defines;
    o.n_defines = 1;
    o.search = folders;
    o.n_search = 1;
    test_must(ctx,
              imp_scene_load_string(ctx, changed, strlen(changed), path, &o, &scene));
    return scene;
}

#endif
