/* SPDX-License-Identifier: Apache-2.0
 *
 * <rays>, <surface> and <target>. Rays come in bundles, each with a frame: its z runs
 * along the beam (or from a point source to the centre), and what stands inside <rays> is
 * written in that frame, once for all bundles of the element. */
#include "base/number.h"
#include "bend.h"
#include "search.h"
#include <string.h>

#define GOLDEN_ANGLE 2.39996322972865332
#define RAYS_MAX     100000000

/* Axes so that x and y are those of the world for z = (0, 0, 1). */
static struct bend_frame frame_of(imp_v3 origin, imp_v3 direction)
{
    struct bend_frame f = {.o = origin, .n = imp__normalize(direction)};
    const imp_v3 up =
        fabs(f.n[1]) < 0.999 ? imp__v3(0, 1, 0) : imp__v3(0, 0, -copysign(1, f.n[1]));
    f.s = imp__normalize(imp__cross(up, f.n));
    f.t = imp__cross(f.n, f.s);
    return f;
}

/* Point i of n spread over the sphere (Fibonacci lattice). */
static imp_v3 sphere_point(int64_t i, int64_t n)
{
    const double z = 1 - (2 * (double)i + 1) / (double)n, r = sqrt(fmax(0, 1 - z * z));
    return imp__v3(r * cos(GOLDEN_ANGLE * (double)i), r * sin(GOLDEN_ANGLE * (double)i),
                   z);
}

enum pattern { DISC, GRID, FAN };

/* Point i of n in the unit disc, the square +-1, or on the line +-1. */
static imp_v3 pattern_point(enum pattern p, int64_t i, int64_t n)
{
    const double u = ((double)i + 0.5) / (double)n;
    switch (p) {
    case DISC:
        return imp__v3(sqrt(u) * cos(GOLDEN_ANGLE * (double)i),
                       sqrt(u) * sin(GOLDEN_ANGLE * (double)i), 0);
    case GRID: {
        const int64_t side = (int64_t)ceil(sqrt((double)n) - 1e-9);
        return imp__v3(2 * ((double)(i % side) + 0.5) / (double)side - 1,
                       2 * ((double)(i / side) + 0.5) / (double)side - 1, 0);
    }
    case FAN: return imp__v3(2 * u - 1, 0, 0);
    }
    return (imp_v3){0};
}

struct bundle {
    bool point;
    enum pattern pattern;
    int64_t count;
    double radius, start, on_sphere, angle;
};

static void bundle_rays(const struct bundle *b, const struct bend_frame *f,
                        double (*x)[3], double (*d)[3])
{
    for (int64_t i = 0; i < b->count; i++) {
        const imp_v3 q = pattern_point(b->pattern, i, b->count);
        imp_v3 p = {0}, v = imp__v3(0, 0, 1);
        if (b->point) { /* equal solid angles in a cone; a fan has equal angles */
            p[2] = b->start;
            const double r = sqrt(imp__dot(q, q));
            if (b->pattern == FAN) {
                v = imp__v3(sin(b->angle * q[0]), 0, cos(b->angle * q[0]));
            } else {
                const double c = 1 - imp_min(r * r, 1.0) * (1 - cos(b->angle));
                const double s = sqrt(fmax(0, 1 - c * c));
                v = r > 0 ? imp__v3(s * q[0] / r, s * q[1] / r, c) : v;
            }
        } else {
            p = q * b->radius;
            const double r2 = imp__dot(p, p);
            p[2] = b->on_sphere > 0 ? -sqrt(fmax(0, b->on_sphere * b->on_sphere - r2))
                                    : b->start;
        }
        imp__v3_store(bend_place(f, p), x[i]);
        imp__v3_store(bend_turn(f, v), d[i]);
    }
}

static enum imp_status bundle_add(struct bend_loader *l, struct imp_node *node,
                                  const struct bundle *b, const struct bend_frame *f,
                                  double um)
{
    enum imp_status st = IMP_OK;
    double(*x)[3] = imp__alloc(l->ctx, (size_t)b->count, sizeof *x);
    double(*d)[3] = imp__alloc(l->ctx, (size_t)b->count, sizeof *d);
    int bundle;
    if (!x || !d) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for rays"));
    bundle_rays(b, f, x, d);
    IMP_TRY(imp_bend_add_rays(l->bend, (size_t)b->count, (const double(*)[3])x,
                              (const double(*)[3])d, NULL, &bundle));
    if (um > 0) {
        st = imp_bend_set_wavelength(l->bend, bundle, &l->dispersion, um);
        if (st == IMP_E_ARG)
            st = imp__node_error(l->ctx, node, IMP_E_SCENE, "no index at %g um", um);
        if (st != IMP_OK) goto out;
    }
    void *grown = imp__grow(l->ctx, l->frames, &l->cap_frames, (size_t)bundle + 1,
                            sizeof *l->frames);
    if (grown) l->frames = grown;
    void *nodes =
        imp__grow(l->ctx, l->nodes, &l->cap_nodes, (size_t)bundle + 1, sizeof *l->nodes);
    if (nodes) l->nodes = nodes;
    if (!grown || !nodes) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for rays"));
    l->frames[bundle] = *f;
    l->nodes[bundle] = node;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "surface") != 0) continue;
        c->used = true;
        IMP_TRY(bend_surface(l, c->node, f, bundle));
    }
out:
    imp__release(l->ctx, x);
    imp__release(l->ctx, d);
    return st;
}

#define WAVELENGTHS_MAX 64

/* "0.486 0.588 0.656": micrometres; none: 0, the reference. */
static enum imp_status wavelengths_read(struct bend_loader *l, struct imp_node *node,
                                        double um[WAVELENGTHS_MAX], int *n)
{
    const char *text;
    const enum imp_status st =
        imp__props_string(l->ctx, node, "wavelengths", NULL, &text);
    *n = 0;
    um[0] = 0;
    if (st != IMP_OK || !text) return st;
    if (!l->dispersive)
        return imp__node_error(l->ctx, node, IMP_E_SCENE,
                               "has wavelengths, and the medium neither 'cauchy' nor "
                               "'sellmeier_b'");
    const char *end = text + strlen(text);
    for (;;) {
        text += strspn(text, " ,");
        if (*text == 0 && *n > 0) return IMP_OK;
        if (*n == WAVELENGTHS_MAX || !imp__number(&text, end, &um[*n]) ||
            !(um[*n] >= 0.01 && um[*n] <= 1000))
            return imp__prop_error(l->ctx, node, imp__node_prop(node, "wavelengths"),
                                   IMP_E_SCENE, "1 to %d wavelengths of 0.01 to 1000 um",
                                   WAVELENGTHS_MAX);
        ++*n;
    }
}

enum imp_status bend_rays(struct bend_loader *l, struct imp_node *node)
{
    static const char *const patterns[] = {"disc", "grid", "fan"};
    enum imp_status st = IMP_OK;
    struct bundle b = {0};
    const double zero[3] = {0}, z[3] = {0, 0, 1};
    double origin[3], direction[3], degrees;
    int64_t directions, views;
    int pattern, n_um;
    double um[WAVELENGTHS_MAX];
    b.point = strcmp(node->type, "point") == 0;
    if (!b.point && strcmp(node->type, "beam") != 0)
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "is of no known type: there are beam "
                                "and point"));
    IMP_TRY(imp__props_choice(l->ctx, node, "pattern", patterns, 3, 0, &pattern));
    IMP_TRY(imp__props_int(l->ctx, node, "count", 1000, 1, RAYS_MAX, &b.count));
    IMP_TRY(imp__props_vector(l->ctx, node, "origin", zero, origin));
    IMP_TRY(imp__props_vector(l->ctx, node, "direction", z, direction));
    IMP_TRY(imp__props_int(l->ctx, node, "directions", 0, 0, 60000, &directions));
    IMP_TRY(imp__props_int(l->ctx, node, "views", 0, 0, 60000, &views));
    IMP_TRY(bend_number(l, node, "start", b.point ? 0 : -1, -1e300, 1e300, &b.start));
    b.pattern = (enum pattern)pattern;
    if (b.point) {
        IMP_TRY(bend_number(l, node, "angle", 10, 0, 180, &degrees));
        b.angle = degrees * IMP_PI / 180;
    } else {
        IMP_TRY(bend_number(l, node, "radius", 1, 0, 1e300, &b.radius));
        IMP_TRY(bend_number(l, node, "on_sphere", 0, 0, 1e300, &b.on_sphere));
        if (b.on_sphere > 0 && b.on_sphere < b.radius)
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "starts on a sphere of radius %g "
                                    "and is %g wide",
                                    b.on_sphere, b.radius));
    }
    if (!(imp__length(imp__v3_load(direction)) > 0))
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "has no direction"));
    IMP_TRY(wavelengths_read(l, node, um, &n_um));
    const int64_t n = directions > 0 ? directions : views > 0 ? views : 1;
    for (int64_t i = 0; i < n; i++) {
        imp_v3 dir = imp__v3_load(direction);
        if (directions > 0) {
            dir = sphere_point(i, n);
        } else if (views > 0) { /* over half a turn about y */
            const double a = IMP_PI * (double)i / (double)n;
            dir = imp__v3(sin(a), 0, cos(a));
        }
        const struct bend_frame f = frame_of(imp__v3_load(origin), dir);
        for (int k = 0; k < imp_max(n_um, 1); k++)
            IMP_TRY(bundle_add(l, node, &b, &f, um[k]));
    }
out:
    return st;
}

/* A scene of one mesh, which the bend keeps. */
static enum imp_status mesh_load(struct bend_loader *l, struct imp_node *node,
                                 const imp_scene **out)
{
    enum imp_status st = IMP_OK;
    const char *file, *path;
    imp_bend *b = l->bend;
    imp_scene *scene = NULL;
    IMP_TRY(imp__props_string(l->ctx, node, "filename", NULL, &file));
    if (!file) IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "needs a 'filename'"));
    IMP_TRY(imp__search(l->scene, NULL, file, &path));
    const size_t n = strlen(path);
    IMP_TRY(imp_scene_create(l->ctx, NULL, &scene));
    imp_scene_begin(scene, "shape",
                    n > 4 && strcmp(path + n - 4, ".obj") == 0 ? "obj" : "ply", NULL,
                    NULL);
    imp_scene_string(scene, "filename", path);
    imp_scene_bool(scene, "face_normals", 1);
    imp_scene_end(scene);
    IMP_TRY(imp_scene_commit(scene));
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

/* ---- Surfaces ------------------------------------------------------------------ */

enum imp_status bend_surface(struct bend_loader *l, struct imp_node *node,
                             const struct bend_frame *f, int group)
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
    IMP_TRY(bend_number(l, node, "index", 1, 1e-6, 1e6, &s.index));
    switch (s.type) {
    case IMP_BEND_PLANE:
    case IMP_BEND_DISC:
    case IMP_BEND_CYLINDER:
        IMP_TRY(imp__props_vector(l->ctx, node, "normal", z, normal));
        imp__v3_store(bend_turn(f, imp__v3_load(normal)), s.normal);
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
        IMP_TRY(bend_number(l, node, "offset", 0, -1e300, 1e300, &s.offset));
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
        imp__v3_store(bend_place(f, imp__v3_load(centre)), s.centre);
        if (s.type != IMP_BEND_APPROACH)
            IMP_TRY(bend_number(l, node, "radius", 1, 1e-300, 1e300, &s.radius));
        break;
    case IMP_BEND_BOX:
        if (group >= 0)
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "is a box, which cannot turn "
                                    "with the rays: put it into the medium"));
        IMP_TRY(imp__props_vector(l->ctx, node, "lo", minus, s.lo));
        IMP_TRY(imp__props_vector(l->ctx, node, "hi", one, s.hi));
        break;
    case IMP_BEND_SDF: IMP_TRY(bend_sdf(l, node, &s.sdf)); break;
    case IMP_BEND_MESH: IMP_TRY(mesh_load(l, node, &s.scene)); break;
    }
    IMP_TRY(imp__props_finish(l->ctx, node));
    if (event == 4) {
        if (s.type != IMP_BEND_PLANE || l->n_taps >= imp_count(l->taps))
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "taps are planes, at most 16"));
        struct imp_bend_tap *t = &l->taps[l->n_taps++];
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

/* ---- Targets ------------------------------------------------------------------- */

/* Picture or numbers of a target from its file. */
static enum imp_status target_file(struct bend_loader *l, struct imp_node *node,
                                   const char *file, bool image,
                                   struct imp_bend_target *t, imp_film **film,
                                   double **data, float **pixels)
{
    enum imp_status st = IMP_OK;
    const char *path;
    struct imp_film_info info = {.size = sizeof info};
    IMP_TRY(imp__search(l->scene, NULL, file, &path));
    IMP_TRY(imp_film_read(l->ctx, path, film));
    imp_film_get_info(*film, &info);
    const float *p = imp_film_mean(*film);
    const size_t n = (size_t)info.width * (size_t)info.height, c = (size_t)info.channels;
    if (image) { /* the mean of the colours */
        *pixels = imp__alloc(l->ctx, n, sizeof **pixels);
        if (!*pixels) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "%s: no memory", file));
        const size_t colours = imp_min(c, (size_t)3);
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < colours; k++)
                (*pixels)[i] += imp_max(p[i * c + k], 0.0f) / (float)colours;
        t->pixels = *pixels;
        t->width = info.width, t->height = info.height;
        goto out;
    }
    const size_t first = t->bundle < 0 ? 0 : l->bend->bundle_first[t->bundle];
    const size_t last = t->bundle < 0 ? l->bend->n : l->bend->bundle_first[t->bundle + 1];
    const size_t each = t->type == IMP_BEND_PATH ? 1 : 3;
    if (n * c != (last - first) * each)
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "%s holds %zu numbers, %zu rays need "
                                "%zu each",
                                file, n * c, last - first, each));
    *data = imp__alloc(l->ctx, n * c, sizeof **data);
    if (!*data) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "%s: no memory", file));
    for (size_t i = 0; i < n * c; i++) (*data)[i] = p[i];
    t->data = *data;
out:
    return st;
}

enum imp_status bend_target(struct bend_loader *l, struct imp_node *node,
                            const struct bend_frame *f, int bundle)
{
    static const char *const types[IMP_BEND_N_TARGETS] = {
        "focus", "spot",      "points", "direction", "directions", "deflection",
        "path",  "wavefront", "image",  "far-field", "shape"};
    enum imp_status st = IMP_OK;
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    const double z[3] = {0, 0, 1}, zero[3] = {0}, corner[3] = {-1, 1, 0},
                 right[3] = {2, 0, 0}, down[3] = {0, -2, 0};
    double normal[3], point[3], origin[3], u[3], v[3];
    const char *file;
    imp_film *film = NULL;
    double *data = NULL;
    float *pixels = NULL;
    bool from_truth;
    int64_t tap;
    int type = -1;
    for (int k = 0; k < IMP_BEND_N_TARGETS; k++)
        if (strcmp(node->type, types[k]) == 0) type = k;
    if (type < 0)
        IMP_TRY(imp__node_error(
            l->ctx, node, IMP_E_SCENE,
            "is of no known type: there are focus, spot, points, direction, "
            "directions, deflection, path, wavefront, image, far-field, "
            "shape"));
    t.type = (enum imp_bend_target_type)type;
    t.bundle = bundle;
    const bool image = t.type == IMP_BEND_IMAGE || t.type == IMP_BEND_FARFIELD;
    IMP_TRY(bend_number(l, node, "weight", 1, 0, 1e300, &t.weight));
    IMP_TRY(imp__props_int(l->ctx, node, "tap", -1, -1, 15, &tap));
    t.tap = (int)tap;
    t.at_plane = imp__props_has(node, "plane");
    IMP_TRY(bend_number(l, node, "plane", 0, -1e300, 1e300, &t.offset));
    IMP_TRY(imp__props_vector(l->ctx, node, "normal", z, normal));
    IMP_TRY(
        bend_number(l, node, "index", l->options.outside_index, 1e-6, 1e6, &t.outside));
    IMP_TRY(imp__props_vector(l->ctx, node, "point", zero, point));
    imp__v3_store(bend_turn(f, imp__v3_load(normal)), t.normal);
    t.offset += imp__dot(imp__v3_load(t.normal), f->o);
    const bool directions = t.type == IMP_BEND_DIRECTION;
    imp__v3_store(directions ? bend_turn(f, imp__v3_load(point))
                             : bend_place(f, imp__v3_load(point)),
                  t.point);
    IMP_TRY(imp__props_bool(l->ctx, node, "from_truth", false, &from_truth));
    IMP_TRY(imp__props_string(l->ctx, node, "filename", NULL, &file));
    if (image) {
        IMP_TRY(imp__props_vector(l->ctx, node, "corner", corner, origin));
        IMP_TRY(imp__props_vector(l->ctx, node, "u", right, u));
        IMP_TRY(imp__props_vector(l->ctx, node, "v", down, v));
        imp_v3 o = imp__v3_load(origin);
        if (t.type == IMP_BEND_IMAGE && t.at_plane && o[2] == 0) {
            double p;
            IMP_TRY(bend_number(l, node, "plane", 0, -1e300, 1e300, &p));
            o[2] = p;
        }
        imp__v3_store(t.type == IMP_BEND_FARFIELD ? bend_turn(f, o) : bend_place(f, o),
                      t.origin);
        imp__v3_store(bend_turn(f, imp__v3_load(u)), t.u);
        imp__v3_store(bend_turn(f, imp__v3_load(v)), t.v);
        if (!file)
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "needs a 'filename'"));
    }
    if (file) IMP_TRY(target_file(l, node, file, image, &t, &film, &data, &pixels));
    if (t.type == IMP_BEND_SHAPE) IMP_TRY(bend_sdf(l, node, &t.sdf));
    IMP_TRY(imp__props_finish(l->ctx, node));
    const size_t n =
        bundle < 0 ? l->bend->n
                   : l->bend->bundle_first[bundle + 1] - l->bend->bundle_first[bundle];
    if (from_truth && !t.data) { /* filled when all is there */
        data = imp__alloc(l->ctx, 3 * n, sizeof *data);
        if (!data) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for a target"));
        for (size_t i = 0; i < 3 * n; i++) data[i] = 1;
        t.data = data;
    }
    st = imp_bend_add_target(l->bend, &t);
    if (st == IMP_E_ARG) {
        char message[512];
        strncpy(message, imp_last_error(l->ctx), sizeof message - 1);
        message[sizeof message - 1] = 0;
        st = imp__node_error(l->ctx, node, IMP_E_SCENE, "%s", message);
    }
    if (st == IMP_OK && from_truth) { /* the sign marks it for truth_apply */
        struct imp__target_of_rays *made = &l->bend->targets[l->bend->n_targets - 1];
        made->power = -made->power;
    }
out:
    imp_film_destroy(film);
    imp__release(l->ctx, data);
    imp__release(l->ctx, pixels);
    return st;
}
