/* SPDX-License-Identifier: Apache-2.0
 *
 * <surface>: where bent rays end, are refracted or reflected, or cross a tap. */
#include "bend_load.h"
#include "format/search.h"
#include <string.h>

/* A scene of one mesh, owned by the bend. */
static enum imp_status mesh_load(struct imp__bendfile *l, struct imp_node *node,
                                 const imp_scene **out)
{
    enum imp_status st = IMP_OK;
    const char *file, *path;
    imp_bend *b = l->bend;
    imp_scene *scene = NULL;
    IMP_TRY(imp__props_string(l->ctx, node, "filename", NULL, &file));
    if (!file) IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "needs a 'filename'"));
    IMP_TRY(imp__bendfile_placed(l, node, imp__search(l->scene, NULL, file, &path)));
    const size_t n = strlen(path);
    IMP_TRY(imp_scene_create(l->ctx, NULL, &scene));
    imp_scene_begin(scene, "shape",
                    n > 4 && strcmp(path + n - 4, ".obj") == 0 ? "obj" : "ply", NULL,
                    NULL);
    imp_scene_string(scene, "filename", path);
    imp_scene_bool(scene, "face_normals", 1);
    imp_scene_end(scene);
    IMP_TRY(imp__bendfile_placed(l, node, imp_scene_commit(scene)));
    void *grown =
        imp__grow(l->ctx, b->scenes, &b->cap_scenes, b->n_scenes + 1, sizeof *b->scenes);
    if (!grown) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for a mesh"));
    b->scenes = grown;
    b->scenes[b->n_scenes++] = scene;
    *out = scene;
    scene = NULL;
out:
    imp_scene_destroy(scene);
    return st;
}

enum imp_status imp__bendfile_surface(struct imp__bendfile *l, struct imp_node *node,
                                      const struct imp__bendfile_frame *f, int group)
{
    static const char *const types[] = {"plane", "sphere",   "cylinder",         "disc",
                                        "box",   "distance", "closest-approach", "mesh"};
    static const char *const events[] = {"end", "refract", "mirror", "stop", "tap"};
    enum imp_status st = IMP_OK;
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    const double z[3] = {0, 0, 1}, zero[3] = {0}, minus[3] = {-1, -1, -1},
                 one[3] = {1, 1, 1};
    double normal[3], centre[3];
    int event, type = -1;
    for (int k = 0; k < 8; k++)
        if (strcmp(node->type, types[k]) == 0) type = k;
    if (type < 0)
        IMP_TRY(imp__node_error(
            l->ctx, node, IMP_E_SCENE,
            "is of no known type: there are plane, sphere, cylinder, disc, "
            "box, distance, closest-approach, mesh"));
    IMP_TRY(imp__props_choice(l->ctx, node, "event", events, 5, 0, &event));
    s.type = (enum imp_bend_surface_type)type;
    s.event = event == 4 ? IMP_BEND_END : (enum imp_bend_event)event;
    s.group = group;
    IMP_TRY(imp__bendfile_number(l, node, "index", 1, 1e-6, 1e6, &s.index));
    switch (s.type) {
    case IMP_BEND_PLANE:
    case IMP_BEND_DISC:
    case IMP_BEND_CYLINDER:
        IMP_TRY(imp__props_vector(l->ctx, node, "normal", z, normal));
        imp__v3_store(imp__bendfile_direction(f, imp__v3_load(normal)), s.normal);
        break;
    case IMP_BEND_SPHERE:
    case IMP_BEND_BOX:
    case IMP_BEND_SDF:
    case IMP_BEND_APPROACH:
    case IMP_BEND_MESH: break;
    }
    switch (s.type) {
    case IMP_BEND_PLANE: {
        const double length = imp__length(imp__v3_load(s.normal));
        IMP_TRY(imp__bendfile_number(l, node, "offset", 0, -1e300, 1e300, &s.offset));
        s.offset += imp__dot(imp__v3_load(s.normal), f->o);
        if (!(length > 0))
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "has no normal"));
        break;
    }
    case IMP_BEND_SPHERE:
    case IMP_BEND_CYLINDER:
    case IMP_BEND_DISC:
    case IMP_BEND_APPROACH:
        IMP_TRY(imp__props_vector(l->ctx, node, "centre", zero, centre));
        imp__v3_store(imp__bendfile_point(f, imp__v3_load(centre)), s.centre);
        if (s.type != IMP_BEND_APPROACH)
            IMP_TRY(imp__bendfile_number(l, node, "radius", 1, 1e-300, 1e300, &s.radius));
        break;
    case IMP_BEND_BOX:
        if (group >= 0)
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "is a box, which cannot turn "
                                    "with the rays: put it into the medium"));
        IMP_TRY(imp__props_vector(l->ctx, node, "lo", minus, s.lo));
        IMP_TRY(imp__props_vector(l->ctx, node, "hi", one, s.hi));
        break;
    case IMP_BEND_SDF: IMP_TRY(imp__bendfile_sdf(l, node, &s.sdf)); break;
    case IMP_BEND_MESH: IMP_TRY(mesh_load(l, node, &s.scene)); break;
    }
    IMP_TRY(imp__props_finish(l->ctx, node));
    if (event == 4) {
        if (s.type != IMP_BEND_PLANE || l->n_taps >= imp_count(l->taps))
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "taps are planes, at most 16"));
        struct imp_bend_tap *t = &l->taps[l->n_taps++];
        *t = (struct imp_bend_tap)IMP_BEND_TAP_INIT;
        memcpy(t->normal, s.normal, sizeof t->normal);
        t->offset = s.offset;
        t->group = group;
        goto out;
    }
    void *grown = imp__grow(l->ctx, l->surfaces, &l->cap_surfaces, l->n_surfaces + 1,
                            sizeof *l->surfaces);
    if (!grown) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for a surface"));
    l->surfaces = grown;
    l->surfaces[l->n_surfaces++] = s;
out:
    return st;
}
