/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves, interior and boundary together, against central differences of
 * pictures with the same random numbers of scenes that are built again: a block, a lamp and the
 * camera of a room, by direct light, with a sky, and over several bounces. Identities: moving
 * everything, the camera too, changes nothing. Standard errors are bounded. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "moves_kit.h"
#include "walk/moved/boundary.h"

enum { WIDTH = 24, HEIGHT = 16, PIXELS = WIDTH * HEIGHT };
static imp_context *ctx;

/* ---- A room at a place ----------------------------------------------------------------- */

enum body { BLOCK, LAMP, CAMERA, BODIES };
static const imp_v3 centres[BODIES] = {
    {-.2, .3, .7, 0}, {.9, -.2, 3.2, 0}, {.4, -5.5, 2.3, 0}};

/* A pose or scale of one body, as a file says it. */
static void motion_text(enum body body, const double pose[7], char *out, size_t n)
{
    const imp_v3 c = centres[body];
    const double angle = sqrt(pose[3] * pose[3] + pose[4] * pose[4] + pose[5] * pose[5]);
    snprintf(out, n,
             "<translate x='%.17g' y='%.17g' z='%.17g'/><scale value='%.17g'/>"
             "<rotate x='%.17g' y='%.17g' z='%.17g' angle='%.17g'/>"
             "<translate x='%.17g' y='%.17g' z='%.17g'/>",
             -c[0], -c[1], -c[2], 1 + pose[6], angle > 0 ? pose[3] : 0,
             angle > 0 ? pose[4] : 0, angle > 0 ? pose[5] : 1, angle * 180 / IMP_PI,
             c[0] + pose[0], c[1] + pose[1], c[2] + pose[2]);
}

static imp_scene *room(const char *rest, double pose[BODIES][7])
{
    char text[BODIES][1024];
    for (enum body k = 0; k < BODIES; k++)
        motion_text(k, pose[k], text[k], sizeof text[k]);
    return room_build(ctx, &(struct room_parts){.rest = rest,
                                                .camera = text[CAMERA],
                                                .block = text[BLOCK],
                                                .lamp = text[LAMP]});
}

/* A smooth weight of film positions and channels: one that jumps between pixels would have kinks
 * where an edge passes from one to the next. */
static double weight(double px, double py, int c)
{
    const double x = px / WIDTH, y = py / HEIGHT;
    return (1 + 0.8 * sin(5 * x + 2 * y + c) + 0.5 * cos(7 * y - x)) / PIXELS;
}
static double weighed(imp_spec L, double px, double py)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) sum += weight(px, py, c) * L[c];
    return sum;
}

/* ---- Both ways ------------------------------------------------------------------------------ */

static struct imp_tracer tracer_of(imp_scene *scene)
{
    return (struct imp_tracer){.scene = scene,
                               .integrator = imp__walk_integrator(scene),
                               .sensor = scene->sensors[0],
                               .seed = 21};
}

/* The functional of walks `first` to first + n of every pixel. */
static double picture(const char *rest, double pose[BODIES][7], int first, int n)
{
    imp_scene *scene = room(rest, pose);
    struct imp_tracer t = tracer_of(scene);
    struct imp_arena arena;
    double sum = 0;
    t.value_only = true;
    imp__arena_init(&arena, ctx);
    for (int p = 0; p < PIXELS; p++)
        for (int i = first; i < first + n; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&arena);
            struct imp_walk walk;
            imp__walk_trace(&t, &arena, p % WIDTH, p / WIDTH, i, &walk);
            sum += weighed(walk.L, walk.px, walk.py);
            imp__arena_rewind(&arena, mark);
        }
    imp__arena_free(&arena);
    imp_scene_destroy(scene);
    return sum / n;
}

struct number {
    enum body body;
    int k; /* 0 to 2 translation, 3 to 5 rotation, 6 scale */
    double step;
    const char *name;
    bool often;
};

/* Mean and error of a central difference, from groups. */
static struct tap_stat difference_of(const char *rest, const struct number *x, int spp)
{
    enum { GROUPS = 16 };
    struct tap_stat out = {0};
    for (int g = 0; g < GROUPS; g++) {
        double value[2];
        for (int s = 0; s < 2; s++) {
            double pose[BODIES][7] = {{0}};
            pose[x->body][x->k] = (s ? 1 : -1) * x->step;
            value[s] = picture(rest, pose, g * spp / GROUPS, spp / GROUPS);
        }
        tap_add(&out, (value[1] - value[0]) / (2 * x->step));
    }
    return out;
}

struct derivative {
    struct tap_stat sum, part[1 + IMP_BOUNDARY_KINDS];
};

/* All numbers of all bodies: block, lamp, camera, of which the last has no scale. */
enum { NUMBERS = 21 };
static void derivatives_of(const char *rest, int spp, int draws, struct derivative *out)
{
    enum { GROUPS = 32 };
    double pose[BODIES][7] = {{0}};
    imp_scene *scene = room(rest, pose);
    struct imp_tracer t = tracer_of(scene);
    struct imp__moves m = imp__moves_begin(scene, t.sensor);
    struct imp__edges edges;
    struct imp__boundary b;
    struct imp_arena arena;
    t.seed = 5; /* the walks of the differences are others */
    imp__arena_init(&arena, ctx);
    for (int k = 0; k < 2; k++) {
        test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, scene->n_shapes - 2 + k));
        test_must(ctx, imp__moves_add(&m, IMP_MOVE_SCALE, scene->n_shapes - 2 + k));
    }
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, IMP_MOVE_CAMERA));
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &edges));
    test_must(ctx, imp__boundary_begin(&t, &m, &edges, &b));
    bool no_memory = false;
    for (int g = 0; g < GROUPS; g++) {
        double part[1 + IMP_BOUNDARY_KINDS][NUMBERS] = {{0}};
        for (int p = 0; p < PIXELS; p++)
            for (int i = 0; i < spp / GROUPS; i++) {
                const struct imp_arena_mark mark = imp__arena_mark(&arena);
                struct imp_walk walk;
                imp__walk_trace(&t, &arena, p % WIDTH, p / WIDTH, g * spp / GROUPS + i,
                                &walk);
                const imp_spec adjoint = {weight(walk.px, walk.py, 0),
                                          weight(walk.px, walk.py, 1),
                                          weight(walk.px, walk.py, 2), 0};
                imp__moved_sweep(&t, &arena, &m, &walk,
                                 adjoint * (double)GROUPS * (1. / spp), part[0]);
                imp__arena_rewind(&arena, mark);
            }
        for (int kind = 0; kind < IMP_BOUNDARY_KINDS; kind++) {
            /* Most draws of scattered light miss, and cost little. */
            const int n = kind == IMP_BOUNDARY_SCATTER ? 10 * draws : draws;
            for (int i = 0; i < n / GROUPS; i++) {
                const struct imp_arena_mark mark = imp__arena_mark(&arena);
                for (struct imp__flux *f = imp__boundary_draw(
                         &b, &arena, (enum imp__boundary_kind)kind, (int64_t)g * n + i,
                         (struct imp__stratum){0, 1}, &no_memory);
                     f; f = f->next)
                    imp__flux_bar(&m, f, weighed(f->L, f->px, f->py) * GROUPS / n,
                                  part[1 + kind]);
                imp__arena_rewind(&arena, mark);
            }
        }
        for (int k = 0; k < NUMBERS - 1; k++) {
            double sum = 0;
            for (int j = 0; j < 1 + IMP_BOUNDARY_KINDS; j++) {
                tap_add(&out[k].part[j], part[j][k]);
                sum += part[j][k];
            }
            tap_add(&out[k].sum, sum);
        }
    }
    imp__boundary_free(&b);
    imp__edges_free(&edges);
    imp__moves_free(&m);
    imp__arena_free(&arena);
    imp_scene_destroy(scene);
}

static int derivative_index(const struct number *x) { return 7 * (int)x->body + x->k; }

static const struct number numbers[] = {
    {BLOCK, 0, .03, "block x", true},          {BLOCK, 1, .03, "block y", true},
    {BLOCK, 2, .03, "block z", true},          {BLOCK, 3, .03, "block about x", true},
    {BLOCK, 4, .03, "block about y", false},   {BLOCK, 5, .03, "block about z", false},
    {BLOCK, 6, .03, "block's scale", true},    {LAMP, 0, .05, "lamp x", true},
    {LAMP, 2, .05, "lamp z", false},           {LAMP, 4, .05, "lamp about y", true},
    {LAMP, 6, .05, "lamp's scale", false},     {CAMERA, 0, .03, "camera x", true},
    {CAMERA, 1, .03, "camera y", false},       {CAMERA, 2, .03, "camera z", true},
    {CAMERA, 3, .01, "camera about x", false}, {CAMERA, 5, .01, "camera about z", true}};

/* The standard error is at most `largest` of the largest number of that body. */
static void room_test(const char *name, const char *rest, int spp, int draws,
                      double largest, bool all)
{
    struct derivative d[NUMBERS];
    double most[BODIES] = {0};
    memset(d, 0, sizeof d);
    derivatives_of(rest, spp / 4, draws, d);
    for (int k = 0; k < NUMBERS; k++)
        most[k / 7] = fmax(most[k / 7], fabs(d[k].sum.mean));
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        const struct number *x = &numbers[i];
        const struct derivative *own = &d[derivative_index(x)];
        if (!all && !x->often) continue;
        const struct tap_stat ref = difference_of(rest, x, spp);
        const double own_se = tap_se(&own->sum);
        const double z = (own->sum.mean - ref.mean) / hypot(own_se, tap_se(&ref));
        tap_ok(
            fabs(z) < 3.5 && own_se < largest * most[x->body],
            "%s, %s # %.5f se %.5f ref %.5f se %.5f z %.2f; inside %.4f film %.4f light "
            "%.4f scatter %.4f",
            name, x->name, own->sum.mean, own_se, ref.mean, tap_se(&ref), z,
            own->part[0].mean, own->part[1].mean, own->part[2].mean, own->part[3].mean);
    }
}

/* ---- Identities and closed forms ----------------------------------------------------------- */

/* A floor, a block above it and a lamp under a sky, all of which move with the camera. */
static void together_test(void)
{
    enum { GROUPS = 32, SPP = 96, DRAWS = 300000, MOVERS = 4 };
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='3'/></integrator><emitter type='constant'><rgb name='radiance' "
             "value='.3'/></emitter>" ROOM_CAMERA
             "<shape type='rectangle'><transform name='to_world'><scale value='1.4'/>"
             "<rotate z='1' angle='20'/></transform></shape><shape type='cube'>"
             "<transform name='to_world'><scale value='.5'/><rotate x='1' y='1' "
             "angle='25'/><translate z='1.1'/></transform></shape>"
             "<shape type='rectangle'><transform name='to_world'><scale value='.5'/>"
             "<rotate x='1' angle='170'/><translate x='.6' z='2.6'/></transform><emitter "
             "type='area'><rgb name='radiance' value='9,8,7'/></emitter></shape></scene>",
             "", "type='box'");
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    struct imp_tracer t = tracer_of(scene);
    struct imp__moves m = imp__moves_begin(scene, t.sensor);
    struct imp__edges edges;
    struct imp__boundary b;
    struct imp_arena arena;
    struct tap_stat sum[6] = {{0, 0, 0}}, inside[6] = {{0, 0, 0}};
    imp__arena_init(&arena, ctx);
    for (int k = -1; k < MOVERS - 1; k++)
        test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, k));
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &edges));
    test_must(ctx, imp__boundary_begin(&t, &m, &edges, &b));
    bool no_memory = false;
    for (int g = 0; g < GROUPS; g++) {
        double part[2][6 * MOVERS] = {{0}};
        for (int i = 0; i < PIXELS * SPP / GROUPS; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&arena);
            struct imp_walk walk;
            const int p = i % PIXELS;
            imp__walk_trace(&t, &arena, p % WIDTH, p / WIDTH,
                            g * SPP / GROUPS + i / PIXELS, &walk);
            const imp_spec adjoint = {weight(walk.px, walk.py, 0),
                                      weight(walk.px, walk.py, 1),
                                      weight(walk.px, walk.py, 2), 0};
            imp__moved_sweep(&t, &arena, &m, &walk, adjoint * ((double)GROUPS / SPP),
                             part[0]);
            imp__arena_rewind(&arena, mark);
        }
        for (int i = 0; i < IMP_BOUNDARY_KINDS * DRAWS / GROUPS; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&arena);
            for (struct imp__flux *f = imp__boundary_draw(
                     &b, &arena, (enum imp__boundary_kind)(i % IMP_BOUNDARY_KINDS),
                     (int64_t)g * DRAWS + i, (struct imp__stratum){0, 1}, &no_memory);
                 f; f = f->next)
                imp__flux_bar(&m, f, weighed(f->L, f->px, f->py) * GROUPS / DRAWS,
                              part[1]);
            imp__arena_rewind(&arena, mark);
        }
        for (int k = 0; k < 6; k++) {
            double both[2] = {0};
            for (int j = 0; j < 2 * MOVERS; j++) {
                const double *bar = part[j % 2] + 6 * (j / 2);
                both[j % 2] += bar[k];
                /* About the origin: a mover's centre moves, too. */
                const imp_v3 c = m.mover[j / 2].centre;
                const imp_v3 a = imp__v3(k == 3, k == 4, k == 5), e = imp__cross(a, c);
                both[j % 2] += e[0] * bar[0] + e[1] * bar[1] + e[2] * bar[2];
            }
            tap_add(&inside[k], both[0]);
            tap_add(&sum[k], both[0] + both[1]);
        }
    }
    for (int k = 0; k < 6; k++)
        tap_ok(fabs(sum[k].mean) < 3.5 * tap_se(&sum[k]) + 1e-14 && /* shifts: rounding */
                   tap_se(&sum[k]) < 0.05 * (0.05 + fabs(inside[k].mean)),
               "moving everything changes nothing, %d # %.5f se %.5f; inside alone %.5f",
               k, sum[k].mean, tap_se(&sum[k]), inside[k].mean);
    imp__boundary_free(&b);
    imp__edges_free(&edges);
    imp__moves_free(&m);
    imp__arena_free(&arena);
    imp_scene_destroy(scene);
}

/* A black square before a sky of radiance L: its picture has the area (2 f/D)^2 pixels at the
 * distance D, so that the sum over all pixels loses 8 f^2 L/D^3 where D shrinks by one, and the
 * same times D by its scale. */
static void square_test(void)
{
    enum { GROUPS = 16, DRAWS = 16000 };
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='path'/><emitter type='constant'/>"
        "<sensor type='perspective'><float name='fov' value='50'/><transform "
        "name='to_world'><lookat origin='.1,-.2,-4' target='.1,-.2,0' up='.3,1,0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='24'/><integer "
        "name='height' value='24'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><bsdf type='diffuse'><rgb name='reflectance' "
        "value='0'/></bsdf></shape></scene>",
        IMP_MONO);
    struct imp_tracer t = tracer_of(scene);
    struct imp__moves m = imp__moves_begin(scene, t.sensor);
    struct imp__edges edges;
    struct imp__boundary b;
    struct imp_arena arena;
    struct tap_stat d[3] = {{0, 0, 0}};
    imp__arena_init(&arena, ctx);
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, 0));
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_SCALE, 0));
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, IMP_MOVE_CAMERA));
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &edges));
    test_must(ctx, imp__boundary_begin(&t, &m, &edges, &b));
    bool no_memory = false;
    for (int g = 0; g < GROUPS; g++) {
        double bar[13] = {0};
        for (int i = 0; i < DRAWS / GROUPS; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&arena);
            for (struct imp__flux *f =
                     imp__boundary_draw(&b, &arena, IMP_BOUNDARY_FILM, g * DRAWS + i,
                                        (struct imp__stratum){0, 1}, &no_memory);
                 f; f = f->next)
                imp__flux_bar(&m, f, f->L[0] * GROUPS / DRAWS, bar);
            imp__arena_rewind(&arena, mark);
        }
        tap_add(&d[0], bar[2]);
        tap_add(&d[1], bar[6]);
        tap_add(&d[2], bar[9]);
    }
    const double f = 12 / tan(25 * IMP_PI / 180), area = 4 * f * f / 16;
    tap_z(&d[0], area * 2 / 4, 3e-3 * area, "a square before a sky, by its distance");
    tap_z(&d[1], -2 * area, 3e-3 * area, "by its scale");
    tap_z(&d[2], -area * 2 / 4, 3e-3 * area, "by the camera's distance");
    imp__boundary_free(&b);
    imp__edges_free(&edges);
    imp__moves_free(&m);
    imp__arena_free(&arena);
    imp_scene_destroy(scene);
}

#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"

int main(void)
{
    char many[4096] = PATH;
    ctx = test_context(1);
    room_test("direct", DIRECT, 1024, 500000, 0.03, true);
    room_test("direct with a sky", DIRECT SKY, 1024, 800000, 0.05, false);
    /* So many facets, behind the camera, that rays are traced in float. */
    for (int k = 0; k < 8; k++)
        snprintf(many + strlen(many), sizeof many - strlen(many),
                 "<shape type='cube'><transform name='to_world'><scale value='.05'/>"
                 "<translate x='%d' y='-9'/></transform></shape>",
                 k - 4);
    room_test("path, many facets", many, 1024, 600000, 0.03, false);
    together_test();
    square_test();
    imp_context_destroy(ctx);
    return tap_done();
}
