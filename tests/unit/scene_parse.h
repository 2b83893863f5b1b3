/* SPDX-License-Identifier: Apache-2.0
 *
 * Parsing alone: text to a tree of nodes, no objects made. */
#ifndef IMP_TEST_SCENE_PARSE_H
#define IMP_TEST_SCENE_PARSE_H

#include "format/search.h"
#include "format/xml.h"
#include <string.h>

static inline enum imp_status parse_open(imp_context *ctx, const char *xml, size_t size,
                                         const char *name,
                                         const struct imp_load_options *o,
                                         struct imp_scene *scene)
{
    memset(scene, 0, sizeof *scene);
    scene->ctx = ctx;
    imp__arena_init(&scene->arena, ctx);
    const char *folder = imp__folder_of(scene, name);
    enum imp_status st = folder ? imp__search_init(scene, o ? o->search : NULL,
                                                   o ? o->n_search : 0, folder)
                                : IMP_E_NOMEM;
    const struct imp_bytes text = {(unsigned char *)xml, size, size};
    if (st == IMP_OK) st = imp__xml_read(scene, &text, name, o);
    return st;
}
static inline void parse_close(struct imp_scene *scene)
{
    for (size_t i = 0; i < scene->n_search; i++)
        imp__release(scene->ctx, scene->search[i]);
    imp__release(scene->ctx, scene->search);
    imp__arena_free(&scene->arena);
}

#endif
