/* SPDX-License-Identifier: Apache-2.0
 *
 * Decisions name where they are: from primitive, coordinates, instance and the walk's time
 * the surface is what the walk saw, to the rounding of floats. Hits and drawn points of every
 * registered kind of shape; vertices and light samples of walks from the sensor, from lights,
 * from both ends, that split, through media and past boundaries, in instances that are
 * nested, mirrored or move; the same read back from a file. */
#include "scene/located.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "shape_nodes.h"
#include "walk/both/both.h"
#include "walk/core/vertex.h"
#include "walk/kept/record.h"
#include <importon/kinds.h>
#include <stdarg.h>
#include <unistd.h>

/* Coordinates are rounded to 2^-24 of themselves, and so is the place with which a vertex is
 * compared; uv of a sphere or a disk turn by 2 pi. */
#define ROUNDING 1.2e-6 /* 20 * 2^-24 */

static imp_context *ctx;

/* ---- Every kind ------------------------------------------------------------------- */

static double turn_apart(double a, double b)
{
    const double d = fabs(a - b);
    return fmin(d, fabs(1 - d));
}

/* Largest difference of two surfaces, in units of the shape's size. */
static double apart(const struct imp_surface *a, const struct imp_surface *b, double size)
{
    double most = imp__length(a->p - b->p) / size;
    most = fmax(most, imp__length(a->ng - b->ng));
    most = fmax(most, imp__length(a->n - b->n));
    most = fmax(most, imp__length(a->dp_du - b->dp_du) / (size + imp__length(a->dp_du)));
    most = fmax(most, imp__length(a->dp_dv - b->dp_dv) / (size + imp__length(a->dp_dv)));
    for (int k = 0; k < 2; k++) most = fmax(most, turn_apart(a->uv[k], b->uv[k]));
    return most;
}

/* Where the kind's coordinates are no map, as uv is none at a sphere's pole or a disk's
 * middle, a rounding turns dp_du. */
static bool is_pole(const struct imp_surface *a, double size)
{
    return imp__length(a->dp_du) < 1e-2 * size || imp__length(a->dp_dv) < 1e-2 * size;
}

static void kind_test(const struct imp_shape_ops *ops, int mirror, int flip)
{
    world_begin(ctx);
    struct imp_node *node = kind_node(ops);
    const bool sphere = !strcmp(ops->name, "sphere"), curve = !ops->sample_area;
    const struct imp_mat4 s = imp__scale(
                              imp__v3(1.5, sphere ? 1.5 : 0.7,
                                      (mirror ? -1.0 : 1.0) * (sphere ? 1.5 : 1.2))),
                          r = imp__rotate(imp__normalize(imp__v3(2, -1, 0.7)), 61),
                          t = imp__translate(imp__v3(0.3, -0.1, 0.2));
    const struct imp_mat4 rs = imp__mat4_multiply(&r, &s);
    node_transform(node, imp__mat4_multiply(&t, &rs));
    if (flip && !curve) node_bool(node, "flip_normals", true);
    struct imp_shape *shape = shape_build(node, NULL);
    double met_worst = 0, drawn_worst = 0;
    int met = 0, drawn = 0, prims = 0, lost = 0;
    if (!shape || imp__intersector_create(&world) != IMP_OK) {
        tap_ok(false, "%s: %s", ops->name, imp_last_error(ctx));
        world_end();
        return;
    }
    const imp_v3 centre = (shape->lo + shape->hi) * 0.5;
    const double size = imp__length(shape->hi - shape->lo);
    for (uint32_t i = 0; i < 4000; i++) {
        const struct imp_key key = imp__key(3, 1, i);
        double u[6];
        for (uint32_t k = 0; k < 6; k++) u[k] = imp__u01(key, k);
        const imp_v3 o = centre + imp__uniform_sphere(u) * size;
        const imp_v3 d =
            imp__normalize(centre + imp__uniform_sphere(u + 2) * (0.25 * size) - o);
        struct imp_hit hit;
        struct imp_surface at, again;
        if (imp__intersect(&world, &o, &d, 0, INFINITY, &hit)) {
            ops->surface(shape, &hit, &o, &d, &at);
            const struct imp_located x = imp__located_hit(&world, shape, &hit, &at);
            met++;
            prims += x.prim > 0;
            lost += !imp__located_fits(&world, shape, &x, 0) ||
                    !imp__located_surface(&world, 0, &x, 0, 0, &again);
            if (!is_pole(&at, size))
                met_worst = fmax(met_worst, apart(&at, &again, size));
        }
        if (!ops->sample_area) continue;
        at.located.prim = -1;
        ops->sample_area(shape, u + 4, &at);
        struct imp_located x = imp__located_drawn(shape, &at.located, at.uv);
        drawn++;
        lost += !imp__located_fits(&world, shape, &x, 0) ||
                !imp__located_surface(&world, 0, &x, 0, 0, &again);
        drawn_worst = fmax(drawn_worst, imp__length(at.p - again.p) / size);
        drawn_worst = fmax(drawn_worst, imp__length(at.ng - again.ng));
        struct imp_light_sample l = {.located.prim = -1};
        const bool one = ops->sample_triangle && i % 2;
        if (one ? !ops->sample_triangle(shape, (int)(i % shape->triangles.n_triangles),
                                        &o, u + 4, &l)
                : !ops->sample_toward(shape, &o, u + 4, &l))
            continue;
        x = imp__located_drawn(shape, &l.located, l.uv);
        lost += !imp__located_fits(&world, shape, &x, 0) ||
                !imp__located_surface(&world, 0, &x, 0, 0, &again);
        drawn_worst = fmax(drawn_worst, imp__length(l.p - again.p) / size);
        drawn_worst = fmax(drawn_worst, imp__length(l.ng - again.ng));
        for (int k = 0; k < 2; k++)
            drawn_worst = fmax(drawn_worst, turn_apart(l.uv[k], again.uv[k]));
    }
    const bool one_prim =
        shape->geometry == IMP_ANALYTIC ||
        (shape->geometry == IMP_CURVES && shape->curves.n_segments == 1);
    const bool whole = one_prim || prims > 100;
    tap_ok(met > 300 && lost == 0 && whole && met_worst < 20 * ROUNDING,
           "%s%s%s: %d hits, %d of later primitives # %.1e", ops->name,
           mirror ? ", mirrored" : "", flip ? ", flipped" : "", met, prims, met_worst);
    tap_ok((drawn == 4000 || curve) && drawn_worst < ROUNDING,
           "%s: %d drawn points # %.1e", ops->name, drawn, drawn_worst);
    world_end();
}

/* ---- Walks -------------------------------------------------------------------------- */

/* A texture that is 1/2 for even primitives and more for others: what a walk reads when it is
 * traced it has to read again when it is evaluated. */
static void by_prim(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_spec *value)
{
    (void)t, (void)scalar;
    imp_spec_fill(value, 0.5 + 0.03 * (at->prim % 11));
}
static void by_prim_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                            bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    (void)t, (void)at, (void)scalar, (void)bar, (void)sink;
}
static void by_prim_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                            bool scalar, imp_dot_fn *dot, const void *x_dot,
                            imp_spec *value_dot)
{
    (void)t, (void)at, (void)scalar, (void)dot, (void)x_dot;
    imp_spec_fill(value_dot, 0);
}
static const struct imp_texture_ops prim_texture = {.size =
                                                        sizeof(struct imp_texture_ops),
                                                    .name = "by_prim",
                                                    .eval = by_prim,
                                                    .scatter = by_prim_scatter,
                                                    .tangent = by_prim_tangent};

static char folder[] = "/tmp/imp_located_XXXXXX";
static void file_write(const char *name, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}

/* A bent square of 32 triangles, with or without uv and normals. */
static void square_write(const char *name, bool uv, bool normals)
{
    static char obj[16384];
    size_t n = 0;
    for (int i = 0; i < 25; i++) {
        const double x = i % 5 / 2. - 1, y = i / 5 / 2. - 1;
        n += (size_t)sprintf(obj + n, "v %g %g %g\nvt %g %g\nvn %g 0.2 1\n", x, y,
                             0.3 * x * x - 0.2 * y, 0.4 * x * x + x, y, -0.6 * x);
    }
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            for (int t = 0; t < 2; t++) {
                const int a = 5 * j + i + 1,
                          v[3] = {a, t ? a + 6 : a + 1, t ? a + 5 : a + 6};
                n += (size_t)sprintf(obj + n, "f");
                for (int k = 0; k < 3; k++)
                    n += (size_t)(uv && normals
                                      ? sprintf(obj + n, " %d/%d/%d", v[k], v[k], v[k])
                                  : uv      ? sprintf(obj + n, " %d/%d", v[k], v[k])
                                  : normals ? sprintf(obj + n, " %d//%d", v[k], v[k])
                                            : sprintf(obj + n, " %d", v[k]));
                n += (size_t)sprintf(obj + n, "\n");
            }
    file_write(name, obj);
}

/* ---- The scene ---------------------------------------------------------------------- */

static char text[32768];
static size_t n_text;
__attribute__((format(printf, 1, 2))) static void put(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    n_text += (size_t)vsnprintf(text + n_text, sizeof text - n_text, format, args);
    va_end(args);
}

/* A kind of shape or, with a dot in its name, a file; `inside`: what else stands in it. */
static void put_shape(const char *what, double x, double y, double z, const char *placed,
                      const char *inside)
{
    static const char *const curves[] = {"bsplinecurve", "linearcurve"};
    const char *file = strchr(what, '.') ? what : NULL;
    for (int k = 0; k < 2; k++)
        if (!strcmp(what, curves[k])) file = "tubes.txt";
    put("<shape type='%s'>", strchr(what, '.') ? "obj" : what);
    if (file) put("<string name='filename' value='%s'/>", file);
    put("<transform name='to_world'>%s<translate x='%g' y='%g' z='%g'/></transform>",
        placed, x, y, z);
    put("%s</shape>", inside);
}
#define PAINT   "<ref id='paint'/>"
#define FLIPPED "<boolean name='flip_normals' value='true'/>" PAINT
#define SMALL   "<scale value='.6'/>"

static void put_instance(const char *group, const char *from, const char *to)
{
    put("<shape type='instance'><ref id='%s'/><transform name='to_world'>%s</transform>",
        group, from);
    if (to) put("<transform name='to_world_end'>%s</transform>", to);
    put("</shape>");
}

static void put_things(void)
{
    static const char *const kinds[] = {"sphere", "disk", "cylinder", "rectangle",
                                        "cube"};
    static const char *const lamps[] = {"rectangle", "disk", "sphere",
                                        "cylinder",  "cube", "both.obj"};
    put("<texture type='by_prim' id='prims'/><bsdf type='twosided' id='paint'><bsdf "
        "type='diffuse'><ref name='reflectance' id='prims'/></bsdf></bsdf>");
    for (int k = 0; k < 5; k++) put_shape(kinds[k], 1.5 * k - 3, 0, 0, SMALL, PAINT);
    put_shape("sphere", -3, 1.5, 0, SMALL, FLIPPED);
    put_shape("rectangle", -1.5, 1.5, 0, SMALL, FLIPPED);
    put_shape("bare.obj", 0, 1.5, 0, SMALL, PAINT);
    put_shape("uv.obj", 1.5, 1.5, 0, SMALL, PAINT);
    put_shape("normals.obj", 3, 1.5, 0, SMALL, PAINT);
    put_shape("both.obj", -3, 3, 0, SMALL, FLIPPED);
    put_shape("bsplinecurve", -1, 3, 0, "", PAINT);
    put_shape("linearcurve", 1.5, 3, 0, "", PAINT);

    put_shape("cube", 0.5, 0.5, 3, SMALL, "<bsdf type='null'/>");

    put("<shape type='shapegroup' id='pair'>");
    put_shape("cube", 0, 0, 0, SMALL, PAINT);
    put_shape("sphere", 1.2, 0, 0, SMALL, PAINT);
    put_shape("both.obj", 0, 1.3, 0, SMALL, PAINT);
    put_shape("linearcurve", 1, 1.3, 0, "", PAINT);
    put("</shape><shape type='shapegroup' id='nest'>");
    put_instance("pair", "<rotate z='1' angle='40'/>", NULL);
    put_shape("disk", -1, 0, 0, SMALL, PAINT);
    put("</shape>");
    put_instance("pair", "<scale x='.5' y='-.6' z='.5'/><translate x='-3' y='-2'/>",
                 NULL);
    put("<shape type='instance'><ref id='pair'/><transform name='to_world'><scale "
        "value='.4'/><translate x='-2.2' y='-3.2'/></transform>" PAINT "</shape>");
    put_instance("nest", "<scale value='.5'/><translate y='-2'/>", NULL);
    put_instance(
        "pair", "<scale value='.5'/><translate x='2' y='-2'/>",
        "<scale value='.5'/><rotate z='1' angle='50'/><translate x='2.5' y='-1.8' "
        "z='.4'/>");
    put_instance(
        "nest", "<scale value='.5'/><translate x='-1.5' y='-2'/>",
        "<scale value='.4'/><rotate y='1' angle='30'/><translate x='-1.6' y='-1.9' "
        "z='.3'/>");

    for (int k = 0; k < 6; k++)
        put_shape(lamps[k], k - 2.5, 4, 3,
                  "<scale value='.3'/><rotate x='1' angle='120'/>",
                  "<emitter type='area'><rgb name='radiance' value='3,2,1'/></emitter>");
    put("<emitter type='point'><point name='position' x='3' y='2' z='6'/><rgb "
        "name='intensity' value='9,8,7'/></emitter><emitter type='constant'><rgb "
        "name='radiance' value='.2,.3,.4'/></emitter>");
}

static const char fog[] =
    "<shape type='cube'><transform name='to_world'><scale x='5' y='5' z='4'/><translate "
    "z='1'/></transform><bsdf type='null'/><medium name='interior' type='homogeneous'>"
    "<float name='sigma_t' value='.03'/><rgb name='albedo' value='.9,.8,.7'/></medium>"
    "</shape>"
    /* A veil before the lamps, which light samples pass. */
    "<shape type='cube'><transform name='to_world'><scale x='4' y='.1' z='3'/><translate "
    "y='3.3' z='1'/></transform><bsdf type='mask'><ref name='opacity' id='prims'/><bsdf "
    "type='diffuse'/></bsdf></shape>";

#define SHUTTER                                                                          \
    "<float name='shutter_open' value='0'/><float name='shutter_close' value='1'/>"
static const char camera[] =
    "<sensor type='perspective'><float name='fov' value='50'/>" SHUTTER
    "<transform name='to_world'><lookat origin='0,.5,9' target='0,.5,0' up='0,1,0'/>"
    "</transform><film type='hdrfilm'><integer name='width' value='40'/><integer "
    "name='height' value='30'/><rfilter type='box'/></film></sensor>";
static const char meter[] =
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='180'/>"
    "<translate z='7'/></transform><sensor type='irradiancemeter'>" SHUTTER
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "
    "value='4'/><rfilter type='box'/></film></sensor></shape>";

static imp_scene *scene_of(const char *integrator, const char *sensor, const char *more)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    const char *folders[1] = {folder};
    imp_scene *scene;
    o.search = folders;
    o.n_search = 1;
    n_text = 0;
    put("<scene version='3.0.0'><integrator type='%s'><integer name='max_depth' "
        "value='5'/>"
        "</integrator>%s",
        integrator, sensor);
    put_things();
    put("%s</scene>", more);
    test_must(ctx, imp_scene_load_string(ctx, text, n_text, "test", &o, &scene));
    return scene;
}

struct seen {
    int vertices, placed, moving, lights, backs, media, skies, boundaries, meters, lenses;
    int lost;                 /* that have no surface, but should */
    double place, normal, uv; /* largest differences */
    bool kind[64];            /* shapes that were met */
};

static void light_check(const struct imp_scene *scene, const struct imp_sensor *sensor,
                        const struct imp_vertex *v, double time, struct seen *n)
{
    if (v->d.connection == IMP_NOT_CONNECTED) return;
    const struct imp_light *l = &v->d.light;
    const struct imp_shape *shape = l->emitter >= 0 ? scene->emitters[l->emitter]->shape
                                    : sensor        ? sensor->shape
                                                    : NULL;
    struct imp_surface at;
    const bool there = imp__decided_light(scene, sensor, &v->d, time, &at);
    if (!shape) {
        n->lost += there || l->located.prim != -1;
        n->lenses += l->emitter < 0;
        return;
    }
    n->lost += !there;
    if (!there) return;
    if (l->emitter < 0) n->meters++;
    else n->lights++;
    const imp_v3 p = imp__decided_v3(l->p);
    n->place = fmax(n->place, imp__length(at.p - p) / (1 + imp__length(p)));
    for (int k = 0; k < 2 && l->emitter >= 0; k++)
        n->uv = fmax(n->uv, turn_apart(at.uv[k], l->uv[k]));
    if (l->emitter < 0 || v->d.scatterer == IMP_AT_LIGHT) return;
    /* The side that it was seen from: the cosine at the shading normal. */
    const double cosine = imp__dot(at.n, imp__decided_v3(l->d));
    n->normal = fmax(n->normal, fabs(cosine - (double)l->cos_light));
}

static void walk_check(const struct imp_scene *scene, const struct imp_sensor *sensor,
                       const struct imp_walk *w, bool traced, struct seen *n)
{
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        const struct imp_decision *d = &v->d;
        const struct imp_shape *shape = d->scatterer == IMP_AT_LIGHT
                                            ? scene->emitters[d->met.emitter]->shape
                                            : v->shape;
        struct imp_surface at;
        const bool there = imp__decided_surface(scene, d, w->time, &at);
        n->media += d->scatterer == IMP_IN_MEDIUM;
        n->skies += d->scatterer == IMP_AT_SKY;
        n->boundaries += d->scatterer == IMP_AT_BOUNDARY;
        light_check(scene, sensor, v, w->time, n);
        for (const struct imp_side *s = v->side; s; s = s->next)
            walk_check(scene, sensor, &s->walk, traced, n);
        n->lost += there != (shape != NULL);
        if (!there || !shape) continue;
        n->vertices++;
        n->kind[imp_min(shape->index, 63)] = true;
        n->placed += d->place > 0;
        n->backs += d->back;
        const imp_v3 p = imp__decided_v3(d->p);
        n->place = fmax(n->place, imp__length(at.p - p) / (1 + imp__length(p)));
        for (int k = 0; k < 2; k++) n->uv = fmax(n->uv, turn_apart(at.uv[k], d->uv[k]));
        if (traced) n->normal = fmax(n->normal, imp__length(at.ng - v->ng));
        n->lost += imp__vertex_at(v).prim != d->located.prim;
        struct imp_surface later;
        if (d->place == 0 || !traced) continue;
        n->lost += !imp__decided_surface(scene, d, w->time + 0.3, &later);
        n->moving += imp__length(later.p - at.p) > 0.01;
    }
}

/* The first vertex again, by its ray: all of its surface. */
static double first_apart(const struct imp_scene *scene, const struct imp_walk *w)
{
    const struct imp_sensor_ray *r = &w->ray;
    const struct imp_decision *d = &w->first->d;
    struct imp_hit hit;
    struct imp_surface at, again;
    if (!imp__intersect_at(scene, w->time, &r->o, &r->d, r->t_near, r->t_far, &hit))
        return 1;
    imp__hit_surface(scene, &hit, &r->o, &r->d, &at);
    if (d->shape != hit.shape || d->place != hit.place ||
        d->back != (imp__dot(at.ng, r->d) > 0) ||
        !imp__decided_surface(scene, d, w->time, &again))
        return 1;
    return is_pole(&at, 1) ? 0 : apart(&at, &again, 1);
}

static void seen_report(const char *name, const struct seen *n)
{
    int kinds = 0;
    for (int k = 0; k < 64; k++) kinds += n->kind[k];
    tap_ok(
        n->lost == 0 && n->vertices > 1000 && n->place < ROUNDING && n->uv < ROUNDING &&
            n->normal < 20 * ROUNDING,
        "%s: %d vertices on %d shapes, %d in instances, %d light samples # off %.1e, uv "
        "%.1e, normals %.1e; lost %d",
        name, n->vertices, kinds, n->placed, n->lights, n->place, n->uv, n->normal,
        n->lost);
}

struct traced {
    imp_scene *scene;
    uint8_t chosen[64];
    struct imp_active active;
    struct imp_tracer tracer;
    struct imp_arena arena;
};
static void begin(struct traced *t, const char *integrator, const char *sensor,
                  const char *more)
{
    imp_scene *scene = scene_of(integrator, sensor, more);
    *t = (struct traced){.scene = scene};
    for (size_t k = 0; k < scene->n_params && k < sizeof t->chosen; k++)
        t->chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(ctx, imp__active_create(scene, t->chosen, &t->active));
    t->tracer = (struct imp_tracer){.scene = scene,
                                    .integrator = imp__walk_integrator(scene),
                                    .sensor = scene->sensors[0],
                                    .active = &t->active,
                                    .collisions_fixed = true,
                                    .seed = 5};
    imp__arena_init(&t->arena, ctx);
}
static void end(struct traced *t)
{
    imp__arena_free(&t->arena);
    imp__active_destroy(ctx, &t->active);
    imp_scene_destroy(t->scene);
}

/* From the sensor: traced, and read back from a file. */
static void from_sensor(const char *name, const char *integrator, const char *sensor,
                        const char *more, int split)
{
    enum { N = 4000, PLENTY = 64 << 20 };
    struct traced t;
    struct seen n = {0}, m = {0};
    struct imp_record record, read;
    char path[128];
    const bool keeps = sensor == camera; /* walks of a meter are not recorded */
    double first = 0;
    int firsts = 0, same = 0, values = 0;
    begin(&t, integrator, sensor, more);
    t.tracer.split = split;
    const struct imp_film_desc *film = &t.tracer.sensor->film;
    test_must(ctx, imp__record_create(&t.tracer, PLENTY, &record));
    const struct imp_arena_mark mark = imp__arena_mark(&t.arena);
    for (int i = 0; i < N; i++) {
        struct imp_walk w;
        imp__walk_trace(&t.tracer, &t.arena, i * 7 % film->width, i * 13 % film->height,
                        i, &w);
        walk_check(t.scene, NULL, &w, true, &n);
        if (keeps && w.n > 0 && w.first->d.scatterer == IMP_AT_SURFACE) {
            first = fmax(first, first_apart(t.scene, &w));
            firsts++;
        }
        if (keeps) test_must(ctx, imp__record_keep(&record, &w, i));
        imp__arena_rewind(&t.arena, mark);
    }
    seen_report(name, &n);
    tap_ok(n.placed > 100 && n.moving > 50 && n.lights > 500 && n.backs > 20,
           "%s: %d vertices of moving instances, %d hit from behind", name, n.moving,
           n.backs);
    if (firsts > 0)
        tap_ok(firsts > 500 && first < 20 * ROUNDING,
               "%s: the whole surface at %d first vertices # %.1e", name, firsts, first);
    if (*more) tap_ok(n.media > 100, "%s: %d points in a medium", name, n.media);
    else tap_ok(n.boundaries > 50, "%s: %d boundaries", name, n.boundaries);

    snprintf(path, sizeof path, "%s/walks", folder);
    test_must(ctx, imp__record_write(&record, path));
    test_must(ctx, imp__record_read(&t.tracer, path, PLENTY, &read));
    for (int i = 0; i < N && keeps; i++) {
        struct imp_walk w, k;
        imp__walk_trace(&t.tracer, &t.arena, i * 7 % film->width, i * 13 % film->height,
                        i, &w);
        imp__record_walk(&read, (size_t)i, &t.tracer, &t.arena, &k);
        walk_check(t.scene, NULL, &k, false, &m);
        same += k.dropped || (k.time == w.time && memcmp(&k.L, &w.L, 24) == 0);
        values += w.L[0] > 0;
        imp__arena_rewind(&t.arena, mark);
    }
    const double bytes =
        (double)imp__record_bytes(&read) - 80.0 * N - 16.0 * (double)read.n_items;
    if (keeps) {
        seen_report("kept", &m);
        tap_ok(m.vertices == n.vertices && m.placed == n.placed && m.lights == n.lights &&
                   m.backs == n.backs,
               "%s: recorded walks name the same places", name);
        tap_ok(same == N && values > N / 3,
               "%s: a texture that reads the primitive gives the same bits again # %d",
               name, same);
        tap_ok(bytes / (double)read.n_vertices < 160, "%s: %.0f bytes a kept vertex",
               name, bytes / (double)read.n_vertices);
    }
    remove(path);
    imp__record_destroy(&record);
    imp__record_destroy(&read);
    end(&t);
}

static void from_lights(const char *name, const char *integrator, const char *sensor)
{
    struct traced t;
    struct seen n = {0};
    int starts = 0;
    begin(&t, integrator, sensor, "");
    const struct imp_arena_mark mark = imp__arena_mark(&t.arena);
    for (int i = 0; i < 4000; i++) {
        struct imp_light_walk w;
        imp__light_walk_trace(&t.tracer, &t.arena, i, &w);
        walk_check(t.scene, t.tracer.sensor, &w.walk, true, &n);
        starts += w.walk.first && w.walk.first->d.located.prim >= 0;
        if (w.both) walk_check(t.scene, t.tracer.sensor, &w.both->eye, true, &n);
        imp__arena_rewind(&t.arena, mark);
    }
    seen_report(name, &n);
    const bool both = !strcmp(integrator, "bdpt");
    tap_ok(starts > 1000 && (sensor == camera ? n.lenses : n.meters) > 200 &&
               (!both || n.lights > 500),
           "%s: %d begin on surfaces, %d connections to the sensor, %d to lights", name,
           starts, sensor == camera ? n.lenses : n.meters, n.lights);
    end(&t);
}

int main(void)
{
    ctx = test_context(1);
    test_must(ctx, imp_register_texture(ctx, &prim_texture));
    if (!mkdtemp(folder)) return 99;
    square_write("bare.obj", false, false);
    square_write("uv.obj", true, false);
    square_write("normals.obj", false, true);
    square_write("both.obj", true, true);
    file_write("tubes.txt",
               "-1 0 0 .2\n-.3 .2 .1 .25\n.4 -.1 0 .2\n1 .1 .2 .1\n1.5 .5 .3 .1\n");
    for (int k = 0; imp__shape_kinds[k]; k++)
        for (int how = 0; how < 4; how++)
            kind_test(imp__shape_kinds[k], how & 1, how & 2);
    from_sensor("paths", "path", camera, "", 0);
    from_sensor("paths that split", "path", camera, "", 3);
    from_sensor("a meter", "path", meter, "", 0);
    from_sensor("through fog", "volpath", camera, fog, 0);
    from_lights("from lights", "ptracer", camera);
    from_lights("from lights to a meter", "ptracer", meter);
    from_lights("both ends", "bdpt", camera);
    from_lights("both ends, a meter", "bdpt", meter);
    for (int k = 0; k < 5; k++) {
        static const char *const files[] = {"bare.obj", "uv.obj", "normals.obj",
                                            "both.obj", "tubes.txt"};
        char path[128];
        snprintf(path, sizeof path, "%s/%s", folder, files[k]);
        remove(path);
    }
    rmdir(folder);
    imp_context_destroy(ctx);
    return tap_done();
}
