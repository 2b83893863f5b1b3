/* SPDX-License-Identifier: Apache-2.0
 *
 * Lamps that a design moves (imp_design_move): the height of a point lamp over a square, places of
 * two in a corridor and the aim of a spot, which sums over the points of the grid give to any
 * accuracy; a room with reflections against designs at other places; luminaires of a file that
 * are moved and turned against the same in the scene file; what is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/design.h>
#include <importon/rooms.h>
#include <math.h>

static imp_context *ctx;

#define HEAD                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='%d'/></integrator>"
/* A meter at nx x ny points of [-ax, ax] x [-ay, ay] at z = 0, and a box around all. */
#define ROOM                                                                             \
    "<shape type='cube' id='box'><transform name='to_world'><scale x='8' y='8' "         \
    "z='%g'/><translate z='%g'/></transform><boolean name='flip_normals' value='true'/>" \
    "<bsdf type='diffuse'><rgb name='reflectance' value='%g'/></bsdf></shape><shape "    \
    "type='rectangle'><transform name='to_world'><scale x='%g' y='%g'/>"                 \
    "</transform><sensor type='irradiancemeter' id='grid'><boolean name='virtual' "      \
    "value='true'/><string name='at' value='points'/><sampler type='independent'>"       \
    "<integer name='sample_count' value='%d'/></sampler><film type='hdrfilm'><integer "  \
    "name='width' value='%d'/><integer name='height' value='%d'/></film></sensor>"       \
    "</shape>%s</scene>"

static imp_scene *room(int depth, double high, double ax, double ay, int spp, int nx,
                       int ny, const char *lamps)
{
    char xml[4096];
    const double reflectance = depth > 2 ? 0.5 : 0;
    snprintf(xml, sizeof xml, HEAD ROOM, depth, high / 2, high / 2 - 0.01, reflectance,
             ax, ay, spp, nx, ny, lamps);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static struct imp_design_lamp lamp_of(const char *name)
{
    struct imp_design_lamp l = IMP_DESIGN_LAMP_INIT;
    l.lamp = name;
    l.watts = 50;
    l.least = 0.01;
    return l;
}
static struct imp_design_want want_of(enum imp_design_want_of of, double value)
{
    struct imp_design_want w = IMP_DESIGN_WANT_INIT;
    w.of = of;
    w.value = value;
    return w;
}
static struct imp_design_move move_of(const char *name, int component, double lo,
                                      double hi)
{
    struct imp_design_move m = IMP_DESIGN_MOVE_INIT;
    m.name = name;
    m.component = component;
    m.lo = lo;
    m.hi = hi;
    return m;
}

/* ---- One lamp over a square ------------------------------------------------------------------ */

/* Least and mean of 100 h/r^3 over 6 x 6 points of [-2, 2]^2, from above the middle. */
static void square_of(double h, double *least, double *mean)
{
    *least = INFINITY, *mean = 0;
    for (int i = 0; i < 36; i++) {
        const double x = (i % 6 - 2.5) * 4 / 6, y = (i / 6 - 2.5) * 4 / 6;
        const double e = 100 * h / pow(x * x + y * y + h * h, 1.5);
        *least = fmin(*least, e);
        *mean += e / 36;
    }
}

static void height(void)
{
    imp_scene *s =
        room(2, 6, 2, 2, 16, 6, 6,
             "<emitter type='point' id='lamp'><point name='position' x='.6' y='-.4' "
             "z='1.2'/><rgb name='intensity' value='100'/></emitter>");
    const struct imp_design_lamp lamp = lamp_of("lamp");
    const struct imp_design_want wants[] = {want_of(IMP_WANT_AVERAGE, 6),
                                            want_of(IMP_WANT_UNIFORMITY, 0.6)};
    const struct imp_design_move moves[] = {move_of("lamp.position", 0, 0, 0),
                                            move_of("lamp.position", 1, 0, 0),
                                            move_of("lamp.position", 2, 0, 0)};
    struct imp_design_options o = IMP_DESIGN_OPTIONS_INIT;
    imp_design *d = NULL;
    o.clearance = 0.3;
    /* Higher is more uniform, and takes more watts: the height at which u is just .6. */
    double lo = 0.5, hi = 6, least, mean;
    for (int k = 0; k < 60; k++) {
        const double h = (lo + hi) / 2;
        square_of(h, &least, &mean);
        if (least / mean < 0.6) lo = h;
        else hi = h;
    }
    test_must(ctx, imp_design_move(s, &lamp, 1, wants, 2, moves, 3, &o, NULL, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    const double truth[3] = {0, 0, lo};
    for (int k = 0; k < 3; k++)
        tap_ok(fabs(a->moved_to[k] - truth[k]) < 1e-4,
               "place %d: %.6f, %.6f by arithmetic", k, a->moved_to[k], truth[k]);
    tap_ok(a->holds && fabs(a->watts / (50 * 6 / mean) - 1) < 1e-4 && a->n_moves == 3 &&
               a->moved_from[0] == 0.6 && a->steps > 0,
           "%.4f W after %d steps, %.4f W by arithmetic", a->watts, a->steps, 300 / mean);
    size_t param;
    double at[3];
    test_must(ctx, imp_scene_find_param(s, "lamp.position", &param));
    test_must(ctx, imp_scene_get_values(s, param, at));
    tap_ok(at[2] == a->moved_to[2], "the scene has the places found");
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

/* ---- Several starts -------------------------------------------------------------------------- */

/* The mean of 100 h/r^3 over points at -4, 0 and 4, from a lamp at x, 2 above them. */
static double three_of(double x)
{
    double sum = 0;
    for (int i = -1; i <= 1; i++)
        sum += 200 / pow((x - 4 * i) * (x - 4 * i) + 4, 1.5) / 3;
    return sum;
}

/* Near each point there is a place that is the best around; above the middle one it is the best of
 * all, and a search from near the last one does not find it. */
static void starts(void)
{
    const struct imp_design_lamp lamp = lamp_of("lamp");
    const struct imp_design_want want = want_of(IMP_WANT_AVERAGE, 5);
    const struct imp_design_move move = move_of("lamp.position", 0, -7, 7);
    double near = 0;
    for (double x = 3; x < 5; x += 1e-4) near = fmax(near, three_of(x));
    for (int k = 0; k < 2; k++) {
        imp_scene *s =
            room(2, 6, 6, 1, 16, 3, 1,
                 "<emitter type='point' id='lamp'><point name='position' x='4.4' y='0' "
                 "z='2'/><rgb name='intensity' value='100'/></emitter>");
        struct imp_design_options o = IMP_DESIGN_OPTIONS_INIT;
        imp_design *d = NULL;
        o.starts = k ? 8 : 1;
        test_must(ctx, imp_design_move(s, &lamp, 1, &want, 1, &move, 1, &o, NULL, &d));
        const struct imp_design_answer *a = imp_design_result(d);
        const double truth = 50 * 5 / (k ? three_of(0) : near);
        tap_ok(a->holds && fabs(a->watts / truth - 1) < 1e-4, "%d starts: %.4f W of %.4f",
               o.starts, a->watts, truth);
        double least = INFINITY;
        for (size_t i = 0; i < a->n_starts; i++)
            least = fmin(least, a->start_objective[i]);
        tap_ok(a->n_starts == (size_t)o.starts && a->start < a->n_starts &&
                   a->start_objective[a->start] == least &&
                   a->start_place[a->start] == a->moved_to[0] &&
                   fabs(a->start_objective[0] * near / (50 * 5) - 1) < 1e-4,
               "the best of them is start %zu", a->start);
        imp_design_destroy(d);
        imp_scene_destroy(s);
    }
}

/* ---- Two lamps in a corridor ------------------------------------------------------------------ */

/* The least illuminance of 12 x 2 points of [-6, 6] x [-1, 1] with lamps at (+-a, 0, 2.5). */
static double corridor_least(double a)
{
    double least = INFINITY;
    for (int i = 0; i < 24; i++) {
        const double x = i % 12 - 5.5, y = i / 12 - 0.5, h = 2.5;
        double e = 0;
        for (int side = -1; side <= 1; side += 2)
            e += 100 * h / pow((x - side * a) * (x - side * a) + y * y + h * h, 1.5);
        least = fmin(least, e);
    }
    return least;
}

static void corridor(void)
{
    imp_scene *s = room(2, 6, 6, 1, 16, 12, 2,
                        "<emitter type='point' id='west'><point name='position' x='-1' "
                        "y='.3' z='2.5'/><rgb name='intensity' value='100'/></emitter>"
                        "<emitter type='point' id='east'><point name='position' x='2.5' "
                        "y='0' z='2.5'/><rgb name='intensity' value='100'/></emitter>");
    const struct imp_design_lamp lamps[] = {lamp_of("west"), lamp_of("east")};
    const struct imp_design_want want = want_of(IMP_WANT_MINIMUM, 3);
    const struct imp_design_move moves[] = {
        move_of("west.position", 0, -6, 6), move_of("west.position", 1, -1, 1),
        move_of("east.position", 0, -6, 6), move_of("east.position", 1, -1, 1)};
    imp_design *d = NULL;
    double best = 0, most = 0;
    for (double a = 0; a < 6; a += 1e-4)
        if (corridor_least(a) > most) most = corridor_least(a), best = a;
    test_must(ctx, imp_design_move(s, lamps, 2, &want, 1, moves, 4, NULL, NULL, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    tap_ok(fabs(a->moved_to[0] + best) < 0.02 && fabs(a->moved_to[2] - best) < 0.02 &&
               fabs(a->moved_to[1]) < 0.05 && fabs(a->moved_to[3]) < 0.05,
           "lamps at %.4f, %.4f and %.4f, %.4f; +-%.4f, 0 by trial", a->moved_to[0],
           a->moved_to[1], a->moved_to[2], a->moved_to[3], best);
    tap_ok(a->holds && fabs(a->watts / (100 * 3 / most) - 1) < 2e-3,
           "%.4f W, by trial %.4f W", a->watts, 300 / most);
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

/* ---- A spot is aimed --------------------------------------------------------------------------- */

static void aimed(void)
{
    /* Above (2, 1), pointing down; the grid lies about the origin. By symmetry the axis comes to
     * lie in the vertical plane through the origin. */
    imp_scene *s =
        room(2, 6, 0.5, 0.5, 16, 4, 4,
             "<emitter type='spot' id='spot'><transform name='to_world'><rotate "
             "x='1' angle='180'/><translate x='2' y='2' z='2.5'/></transform>"
             "<rgb name='intensity' value='100'/><float name='cutoff_angle' "
             "value='60'/><float name='beam_width' value='5'/></emitter>");
    const struct imp_design_lamp lamp = lamp_of("spot");
    const struct imp_design_want want = want_of(IMP_WANT_MINIMUM, 1);
    const struct imp_design_move moves[] = {move_of("spot.direction", 0, 0, 0),
                                            move_of("spot.direction", 1, 0, 0)};
    imp_design *d = NULL;
    test_must(ctx, imp_design_move(s, &lamp, 1, &want, 1, moves, 2, NULL, NULL, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    const double x = a->moved_to[0], y = a->moved_to[1];
    tap_ok(a->holds && fabs(x - y) < 0.02 && x < -0.4,
           "a spot is aimed along (%.4f, %.4f, -1) with %.4f W", x, y, a->watts);
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

/* ---- Reflections ------------------------------------------------------------------------------- */

#define HALL_LAMP                                                                        \
    "<emitter type='point' id='lamp'><point name='position' x='%g' y='0' z='%g'/><rgb "  \
    "name='intensity' value='300'/></emitter>"

static imp_scene *hall(double x, double z)
{
    char lamp[512];
    snprintf(lamp, sizeof lamp, HALL_LAMP, x, z);
    return room(5, 4, 2, 2, 256, 5, 5, lamp);
}

static void reflected(void)
{
    const struct imp_design_lamp lamp = lamp_of("lamp");
    const struct imp_design_want wants[] = {want_of(IMP_WANT_AVERAGE, 12),
                                            want_of(IMP_WANT_UNIFORMITY, 0.6)};
    const struct imp_design_move moves[] = {move_of("lamp.position", 0, -2, 2),
                                            move_of("lamp.position", 2, 1, 3.5)};
    imp_design *d = NULL;
    imp_scene *s = hall(0.8, 3.2);
    test_must(ctx, imp_design_move(s, &lamp, 1, wants, 2, moves, 2, NULL, NULL, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    /* Against designs at places around: none needs fewer watts by more than the errors. */
    double least = INFINITY, se = 0;
    for (int k = 0; k < 9; k++) {
        imp_design *other = NULL;
        imp_scene *t =
            hall(a->moved_to[0] + 0.3 * (k % 3 - 1), a->moved_to[1] + 0.2 * (k / 3 - 1));
        test_must(ctx, imp_design_find(t, &lamp, 1, wants, 2, NULL, NULL, &other));
        const struct imp_design_answer *b = imp_design_result(other);
        if (b->found && b->watts < least) least = b->watts, se = b->objective_se;
        imp_design_destroy(other);
        imp_scene_destroy(t);
    }
    tap_ok(
        a->holds && a->watts < least + 3 * hypot(se, a->objective_se) &&
            a->objective_se < 0.02 * a->watts && fabs(a->moved_to[0]) < 0.3,
        "with reflections: %.3f +- %.2g W at x = %.3f, z = %.3f; %.3f W at best around",
        a->watts, a->objective_se, a->moved_to[0], a->moved_to[1], least);
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

/* ---- Luminaires of files ----------------------------------------------------------------------- */

#define IES                                                                              \
    "<emitter type='ies' id='lamp'><string name='filename' value='" IMP_SCENES           \
    "/lamps/batwing.ies'/><transform name='to_world'>%s</transform></emitter>"

static void grid_values(imp_scene *s, double value[24])
{
    struct imp_estimate mean;
    double se[24];
    test_must(ctx, imp_grid_read(s, NULL, value, se, &mean, NULL));
}

static void luminaire(void)
{
    char lamp[1024];
    double moved[24], there[24], worst = 0;
    snprintf(lamp, sizeof lamp, IES, "<rotate x='1' angle='180'/><translate z='2'/>");
    imp_scene *s = room(2, 6, 3, 2, 16, 6, 4, lamp);
    const char set[] = "lamp.position=1,-.5,3\nlamp.direction=0,1,-1\n";
    test_must(ctx, imp_scene_set_text(s, set, strlen(set), NULL));
    grid_values(s, moved);
    /* From straight down to (0, 1, -1)/sqrt 2: a turn by 45 degrees about x. */
    snprintf(
        lamp, sizeof lamp, IES,
        "<rotate x='1' angle='180'/><rotate x='1' angle='45'/><translate x='1' y='-.5' "
        "z='3'/>");
    imp_scene *t = room(2, 6, 3, 2, 16, 6, 4, lamp);
    grid_values(t, there);
    for (int i = 0; i < 24; i++)
        worst = fmax(worst, fabs(moved[i] - there[i]) / (there[i] + 1e-3));
    tap_ok(worst < 1e-5 && there[0] > 0, "a luminaire that is moved and turned: %.1e",
           worst);
    imp_scene_destroy(s);
    imp_scene_destroy(t);
}

/* ---- What is refused ---------------------------------------------------------------------------- */

static void refused(void)
{
    static const struct {
        const char *name;
        int component;
        double lo, hi;
        const char *says;
    } rows[] = {{"lamb.position", 0, 0, 0, "lamb"},
                {"lamp.position", 3, 0, 0, "no component 3"},
                {"lamp.position", 0, 1, 2, "is not within"},
                {"lamp.position", 2, 3, 1, "there is no room"},
                {"lamp.direction", 0, 0, 0, "lamp"},
                {"box.scale", 0, 0, 0, "is none of"}};
    const struct imp_design_lamp lamp = lamp_of("lamp");
    const struct imp_design_want want = want_of(IMP_WANT_AVERAGE, 1);
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        imp_scene *s = hall(0, 2);
        const struct imp_design_move move =
            move_of(rows[k].name, rows[k].component, rows[k].lo, rows[k].hi);
        imp_design *d = NULL;
        const enum imp_status st =
            imp_design_move(s, &lamp, 1, &want, 1, &move, 1, NULL, NULL, &d);
        tap_ok((st == IMP_E_ARG || st == IMP_E_UNSUPPORTED) && !d &&
                   strstr(imp_last_error(ctx), rows[k].says),
               "%s", imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    imp_scene *s = hall(0, 2);
    const struct imp_design_move twice[] = {move_of("lamp.position", 0, 0, 0),
                                            move_of("lamp.position", 0, 0, 0)};
    imp_design *d = NULL;
    tap_ok(imp_design_move(s, &lamp, 1, &want, 1, twice, 2, NULL, NULL, &d) == IMP_E_ARG,
           "%s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    height();
    starts();
    corridor();
    aimed();
    reflected();
    luminaire();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}
