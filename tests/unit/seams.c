/* SPDX-License-Identifier: Apache-2.0
 *
 * Where meshes pass through each other (move/edges_seams.h): lengths of seams of boxes, closed curves of
 * seams of finer meshes, meshes that are crossed along their own edges, what only touches, and the velocity
 * of a seam against planes that are moved. */
#include "egg.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "move/edges.h"
#include <stdarg.h>

#define EGG_FILE  "seams_egg.obj"
#define GRID_FILE "seams_grid.obj"
#define PAIR_FILE "seams_pair.obj"
#define EGG(id, place)                                                                   \
    "<shape type='obj' id='" id "'><string name='filename' value='" EGG_FILE "'/>"       \
    "<boolean name='face_normals' value='true'/><transform name='to_world'>" place       \
    "</transform></shape>"
#define GRID(id, place)                                                                  \
    "<shape type='obj' id='" id "'><string name='filename' value='" GRID_FILE "'/>"      \
    "<transform name='to_world'>" place "</transform></shape>"
#define FLOOR "<shape type='rectangle' id='floor'/>"
#define BOX(place)                                                                       \
    "<shape type='cube' id='box'><transform name='to_world'><scale x='.3' y='.2' "       \
    "z='.4'/>" place "</transform></shape>"

static imp_context *ctx;

static imp_scene *scene_of(const char *shapes)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><emitter "
             "type='constant'/>%s</scene>",
             shapes);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* A square of 4 x 4 squares, whose vertices lie at -1, -.5, .., 1. */
static void grid_write(void)
{
    FILE *f = fopen(GRID_FILE, "w");
    if (!f) exit(99);
    for (int k = 0; k < 25; k++)
        fprintf(f, "v %g %g 0\n", k % 5 / 2. - 1, k / 5 / 2. - 1);
    for (int k = 0; k < 16; k++) {
        const int v = k / 4 * 5 + k % 4 + 1;
        fprintf(f, "f %d %d %d\nf %d %d %d\n", v, v + 1, v + 6, v, v + 6, v + 5);
    }
    fclose(f);
}

/* Two boxes of sides 2, one shifted by (.5, .4, .3), in one mesh. */
static void pair_write(void)
{
    static const int face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    FILE *f = fopen(PAIR_FILE, "w");
    if (!f) exit(99);
    for (int box = 0; box < 2; box++)
        for (int k = 0; k < 8; k++)
            fprintf(f, "v %g %g %g\n", (k & 1 ? 1 : -1) + .5 * box,
                    (k & 2 ? 1 : -1) + .4 * box, (k & 4 ? 1 : -1) + .3 * box);
    for (int box = 0; box < 2; box++)
        for (int k = 0; k < 6; k++) {
            const int v = 8 * box + 1, *c = face[k];
            fprintf(f, "f %d %d %d\nf %d %d %d\n", v + c[0], v + c[1], v + c[2], v + c[0],
                    v + c[2], v + c[3]);
        }
    fclose(f);
}

struct seen {
    int seams;
    size_t laid;
    double length;
    bool closed; /* each end of a seam is that of one other */
};

static struct seen look(const struct imp__edges *e)
{
    struct seen s = {.laid = e->n_laid, .closed = true};
    for (size_t k = 0; k < e->n; k++) {
        const struct imp__edge *x = &e->edge[k];
        if (!x->seam) continue;
        s.seams++;
        s.length += imp__length(x->b - x->a);
        for (int end = 0; end < 2; end++) {
            int met = 0;
            for (size_t j = 0; j < e->n; j++)
                if (e->edge[j].seam && j != k)
                    for (int i = 0; i < 2; i++)
                        met += imp__length((end ? x->b : x->a) -
                                           (i ? e->edge[j].b : e->edge[j].a)) < 1e-5;
            s.closed &= met == 1;
        }
    }
    return s;
}

/* The seams of a scene; torn: are edges torn where a shape of this number moves? */
static struct seen seams_of(const char *shapes, int moves, bool *torn)
{
    imp_scene *scene = scene_of(shapes);
    struct imp__edges e;
    struct imp__moves m = imp__moves_begin(scene, NULL);
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, moves));
    *torn = imp__edges_torn(&e, &m) != NULL;
    const struct seen s = look(&e);
    imp__moves_free(&m);
    imp__edges_free(&e);
    imp_scene_destroy(scene);
    return s;
}

static void expect(const char *what, const char *shapes, double length, bool closed,
                   size_t laid)
{
    bool torn;
    const struct seen s = seams_of(shapes, 1, &torn);
    tap_ok(fabs(s.length - length) < 1e-5 * (1 + length) &&
               (!closed || (s.seams > 0 && s.closed)) && (s.laid > 0) == (laid > 0) &&
               torn == (laid > 0),
           "%s # %d seams of length %.6f, %zu laid", what, s.seams, s.length, s.laid);
}

/* ---- Velocity ---------------------------------------------------------------------------- */

/* A plane through p that has been moved as its body, by h. */
struct plane {
    imp_v3 n;
    double at;
};
static struct plane plane_moved(const struct imp__moves *m,
                                const struct imp__edge_face *f,
                                const struct imp__glued *x, const double *theta, double h)
{
    const struct imp__velocity v = imp__velocity_of(m, x, theta);
    const imp_v3 n = f->n + v.n * (h * (imp__dot(f->n, x->n) < 0 ? -1 : 1));
    return (struct plane){n, imp__dot(n, x->p + v.v * h)};
}

/* The point in which three planes meet. */
static imp_v3 meeting(const struct plane p[3])
{
    const imp_v3 a = imp__cross(p[1].n, p[2].n), b = imp__cross(p[2].n, p[0].n),
                 c = imp__cross(p[0].n, p[1].n);
    return (a * p[0].at + b * p[1].at + c * p[2].at) * (1 / imp__dot(p[0].n, a));
}

static void velocity_test(void)
{
    imp_scene *scene = scene_of(EGG("a", "<scale value='.7'/>") EGG(
        "b", "<scale value='.6'/><rotate x='1' y='2' z='.5' "
             "angle='40'/><translate x='.3' y='-.2' z='.25'/>"));
    struct imp__edges e;
    struct imp__moves m = imp__moves_begin(scene, NULL);
    double theta[12], worst = 0;
    int tested = 0;
    test_must(ctx, imp__edges_build(scene, IMP_EDGES_ALL, &e));
    for (int k = 0; k < 2; k++) test_must(ctx, imp__moves_add(&m, IMP_MOVE_POSE, k));
    for (int k = 0; k < 12; k++)
        theta[k] = imp__u01(imp__key(4, 1, 0), (unsigned)k) - 0.5;
    for (size_t k = 0; k < e.n; k++) {
        const struct imp__edge *x = &e.edge[k];
        if (!x->seam) continue;
        const imp_v3 p = x->a * 0.4 + x->b * 0.6, d = imp__normalize(x->b - x->a);
        const struct imp_frame frame = imp__frame_from_normal(d);
        const double psi = 7.0 * (double)k, h = 1e-5;
        const imp_v3 w = frame.s * cos(psi) + frame.t * sin(psi);
        imp_v3 bar[2], at[2];
        double rate = 0;
        imp__seam_bar(&e, x, w, bar);
        struct imp__glued g[2];
        for (int i = 0; i < 2; i++) {
            g[i] = imp__edge_glued(&e, scene, x, 2 * i, 0, p);
            rate += imp__dot(bar[i], imp__velocity_of(&m, &g[i], theta).v);
        }
        for (int s = 0; s < 2; s++) {
            const double by = s ? h : -h;
            const struct plane planes[3] = {
                plane_moved(&m, &e.face[x->first], &g[0], theta, by),
                plane_moved(&m, &e.face[x->first + 2], &g[1], theta, by),
                {d, imp__dot(d, p)}};
            at[s] = meeting(planes);
        }
        const double seen = imp__dot(w, at[1] - at[0]) / (2 * h);
        worst = fmax(worst, fabs(rate - seen) / (1 + fabs(seen)));
        tested++;
    }
    tap_ok(tested > 20 && worst < 1e-6,
           "%d seams move as the meeting of two planes # worst %.1e", tested, worst);
    const struct seen s = look(&e);
    tap_ok(s.closed, "seams of two eggs are closed curves # %d, %g long", s.seams,
           s.length);
    imp__moves_free(&m);
    imp__edges_free(&e);
    imp_scene_destroy(scene);
}

/* Without memory for one thing after the other: an error, and nothing is left. */
static void memory_test(void)
{
    struct fail_alloc heap = {0};
    imp_context *whole = ctx;
    ctx = fail_alloc_context(&heap);
    imp_scene *scene =
        scene_of(FLOOR GRID("g", "<scale value='.6'/><rotate x='1' angle='90'/>")
                     EGG("egg", "<translate x='.3' z='.2'/>") "<shape type='sphere'/>");
    enum imp_status st = IMP_E_NOMEM;
    const long live = heap.live;
    int failed = 0, wrong = 0;
    struct imp__edges e;
    for (long k = 1; st == IMP_E_NOMEM && k < 1000; k++) {
        heap.fail_at = heap.calls + k;
        st = imp__edges_build(scene, IMP_EDGES_ALL, &e);
        heap.fail_at = 0;
        if (st == IMP_OK) imp__edges_free(&e);
        failed += st == IMP_E_NOMEM;
        wrong += heap.live != live;
    }
    tap_ok(st == IMP_OK && failed > 10 && wrong == 0,
           "memory that ends at each of %d places is an error", failed);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    ctx = whole;
}

int main(void)
{
    ctx = test_context(1);
    egg_write(EGG_FILE, false);
    grid_write();
    pair_write();
    /* Sides of .6 and .4. */
    expect("a box in a floor", FLOOR BOX("<translate x='.11' y='.07' z='.1'/>"), 2, true,
           0);
    expect("a box aslant in a floor",
           FLOOR BOX("<rotate x='1' angle='30'/><translate x='.11' y='.07' z='.05'/>"),
           2 * (.6 + .4 / cos(IMP_PI / 6)), true, 0);
    expect("a box on a floor", FLOOR BOX("<translate x='.11' z='.4'/>"), 0, false, 0);
    expect("a box on a floor, by a rounding deeper",
           FLOOR BOX("<translate x='.11' z='.399999'/>"), 0, false, 0);
    expect("a box under a floor", FLOOR BOX("<translate x='.11' z='-.4'/>"), 0, false, 0);
    expect("a box above a floor", FLOOR BOX("<translate x='.11' z='.6'/>"), 0, false, 0);
    expect("a box that sticks out of a floor's border",
           FLOOR BOX("<translate x='1' y='.07' z='.1'/>"), .6 + .4, false, 0);
    expect("a grid through a floor, between its vertices",
           FLOOR GRID("g", "<scale value='.6'/><rotate x='1' angle='70'/><translate "
                           "z='.1'/>"),
           1.2, false, 0);
    expect("a grid through a floor, along its own sides",
           FLOOR GRID("g", "<scale value='.6'/><rotate x='1' angle='90'/>"), 1.2, false,
           0);
    expect("two grids through each other, along the sides of both",
           GRID("g", "<scale value='.5'/>") GRID("h", "<rotate x='1' angle='90'/>"), 1,
           false, 0);
    expect("a grid that stands on a floor",
           FLOOR GRID("g", "<scale value='.6'/><rotate x='1' angle='90'/><translate "
                           "z='.6'/>"),
           0, false, 0);
    expect("an egg whose equator lies in a floor",
           FLOOR EGG("egg", "<scale value='.6'/>"), 0, false, 1);
    /* The part in common has sides 1.5, 1.6, 1.7, of whose twelve six are on both. */
    expect("two boxes in one mesh",
           "<shape type='sphere' id='far'><point name='center' x='9' y='0' z='0'/>"
           "</shape><shape type='obj' id='pair'><string name='filename' value='" PAIR_FILE
           "'/><boolean name='face_normals' value='true'/></shape>",
           9.6, true, 0);
    expect("an egg and a grid, which do not pass through themselves",
           GRID("g", "") EGG("egg", "<translate z='3'/>"), 0, false, 0);
    velocity_test();
    memory_test();
    remove(PAIR_FILE);
    remove(EGG_FILE);
    remove(GRID_FILE);
    imp_context_destroy(ctx);
    return tap_done();
}
