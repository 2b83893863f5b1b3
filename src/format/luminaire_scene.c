/* SPDX-License-Identifier: Apache-2.0
 *
 * A photometric file as a scene, or included in one: a luminaire at the origin that shines down
 * (-z), named after the file. */
#include "import.h"
#include "math/transform.h"
#include <stdio.h>
#include <string.h>

enum imp_status imp__luminaire_read(const struct imp__import *in)
{
    /* Half a turn about x, after which nadir, the lamp's +z, points down. */
    static const double down[16] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};
    enum imp_status st = IMP_OK;
    const struct imp_loc loc = {in->name, 1, 1};
    const char *slash = strrchr(in->name, '/'), *base = slash ? slash + 1 : in->name;
    char stem[104];
    struct imp_node *lamp;
    snprintf(stem, sizeof stem, "%.*s", (int)imp_min(strlen(base) - 4, (size_t)100),
             base); /* an ending of four letters brought it here */
    const char *id = imp__import_name(in, stem);
    if (!id) return imp__error(in->scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    IMP_TRY(imp__tree_open(in->tree, in->parent, "emitter", "ies", id, NULL, loc, &lamp));
    IMP_TRY(imp__import_string(in, lamp, "filename", in->name, loc));
    IMP_TRY(imp__import_matrix(in, lamp, "to_world", down, loc));
out:
    return st;
}
