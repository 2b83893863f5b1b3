/* SPDX-License-Identifier: Apache-2.0
 *
 * Rooms lit by photometric files: E = I cos/d^2 under a point, the integral over a lamp
 * that glows by quadrature, derivatives, and finite elements against walks. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/emitter/ies.h"

#define LAMP_FILE(name)                                                                  \
    "<string name='filename' value='" IMP_SCENES "/lamps/" name ".ies'/>"

/* A camera that looks down on (x, 0, z) of a floor of reflectance 1, and a light. */
static imp_scene *floor_scene(imp_context *ctx, double x, double z, const char *light)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='direct'/>"
             "<sensor type='perspective'><float name='fov' value='0.01'/>"
             "<transform name='to_world'><lookat origin='%g,9,%g' target='%g,0,%g' "
             "up='1,0,0'/></transform><film type='hdrfilm'><integer name='width' "
             "value='4'/><integer name='height' value='4'/><rfilter type='box'/></film>"
             "</sensor><shape type='rectangle'><transform name='to_world'><scale "
             "value='50'/><rotate x='1' angle='-90'/></transform><bsdf type='diffuse'>"
             "<float name='reflectance' value='1'/></bsdf></shape>%s</scene>",
             x, z, x, z, light);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static double seen(imp_context *ctx, imp_scene *s, int spp, double *se)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f;
    double mean = 0, var = 0;
    run.spp = spp;
    test_must(ctx, imp_render(s, &run, &f));
    const size_t n = imp__film_values(f);
    for (size_t k = 0; k < n; k++) {
        mean += f->mean[k] / (double)n;
        var += imp__sqr(f->se[k] / (double)n);
    }
    imp_film_destroy(f);
    *se = sqrt(var);
    return mean;
}

/* Points of the floor on and between the table's angles, C0 turned to +z. */
static void under_a_point(imp_context *ctx)
{
    static const double at[][3] = {
        {0.2, 0.1, 0}, {1, 0, 0}, {0, 1.5, 0}, {-2, 0, 0}, {0.7, -1.3, 0}};
    static const char light[] = "<emitter type='ies'>" LAMP_FILE(
        "wallwash") "<float name='scale' value='2.5'/>"
                    "<transform name='to_world'><rotate x='1' angle='90'/><rotate y='1' "
                    "angle='-90'/><translate y='2'/></transform></emitter>";
    for (size_t k = 0; k < imp_count(at); k++) {
        const double x = at[k][0], z = at[k][1], d = sqrt(x * x + z * z + 4);
        imp_scene *s = floor_scene(ctx, x, z, light);
        const struct imp_ies_data *t =
            ((const struct imp__ies *)s->emitters[0]->self)->data;
        /* The table by hand: +x of the lamp goes to +z of the world, and the file is
         * symmetric about that plane. */
        const double v = acos(2 / d) * 180 / IMP_PI;
        double h = fabs(atan2(x, z)) * 180 / IMP_PI, fv, fh;
        int i = (int)(v / 5), j = imp_min((int)(h / 22.5), 7);
        fv = v / 5 - i;
        fh = h / 22.5 - j;
        const double *cd = t->candela + j * t->n_vertical + i, *next = cd + t->n_vertical;
        const double intensity = (1 - fh) * ((1 - fv) * cd[0] + fv * cd[1]) +
                                 fh * ((1 - fv) * next[0] + fv * next[1]);
        double se;
        const double mean = seen(ctx, s, 4, &se);
        tap_near(mean, 2.5 * intensity * 2 / (d * d * d) / IMP_PI, 2e-4, 0,
                 "E = I cos/d^2 under a point");
        imp_scene_destroy(s);
    }
}

/* Near and far from lamps of several shapes: walks against the quadrature of
 * Int L cos cos/d^2 dA, and far away I cos/d^2. */
static void under_a_surface(imp_context *ctx)
{
    enum { N = 200 };
    static const char light[] =
        "<shape type='rectangle'><transform name='to_world'><scale x='0.6' y='0.15'/>"
        "<rotate x='1' angle='90'/><translate y='%g'/></transform><emitter "
        "type='ies'>" LAMP_FILE("batwing") "</emitter></shape>";
    static const double at[][3] = {
        {0.65, 0, 0.3}, {0.7, 0.2, 0.5}, {0.3, 3, 2}, {2, 40, 30}};
    for (size_t k = 0; k < imp_count(at); k++) {
        const double x = at[k][0], z = at[k][1], y = at[k][2];
        char text[1024];
        snprintf(text, sizeof text, light, y);
        imp_scene *s = floor_scene(ctx, x, z, text);
        const struct imp__ies *lamp = s->emitters[0]->self;
        double sum = 0, se;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++) {
                const imp_v3 d = imp__v3(x - 1.2 * ((i + 0.5) / N - 0.5), -y,
                                         z - 0.3 * ((j + 0.5) / N - 0.5));
                const double r = imp__length(d);
                sum += imp__ies_radiance(lamp, d * (1 / r)) * imp__sqr(y / r) / (r * r) *
                       0.36 / (N * N);
            }
        const double mean = seen(ctx, s, 4000, &se);
        tap_ok(fabs(mean - sum / IMP_PI) < 4 * se + 2e-4 * mean && se < 7e-3 * mean,
               "a rectangle at (%g, %g, %g) # %.6g quadrature %.6g se %.1e z %.2f", x, y,
               z, mean, sum / IMP_PI, se, (mean - sum / IMP_PI) / se);
        if (k == 3) {
            const double r = sqrt(x * x + y * y + z * z);
            const double far = imp__ies_intensity(lamp, imp__v3(x, -y, z) * (1 / r)) * y /
                               (r * r * r) / IMP_PI;
            tap_near(sum / IMP_PI, far, 2e-4, 0, "far away it is a point");
        }
        imp_scene_destroy(s);
    }
}

/* ---- Finite elements ----------------------------------------------------------- */

#define WALL(place)                                                                      \
    "<shape type='rectangle'><transform name='to_world'>" place                          \
    "</transform><ref id='wall'/></shape>"
static const char room[] =
    "<scene version='3.0.0'><integrator type='path'/>"
    "<sensor type='perspective'><float name='fov' "
    "value='60'/><transform "
    "name='to_world'><lookat origin='0,0.2,0.95' "
    "target='0,-0.1,0' up='0,1,0'/>"
    "</transform><film type='hdrfilm'><integer name='width' "
    "value='24'/><integer "
    "name='height' value='24'/><rfilter "
    "type='box'/></film></sensor>"
    "<bsdf type='diffuse' id='wall'><float name='reflectance' "
    "value='0.5'/></bsdf>" WALL("<rotate x='1' angle='-90'/><translate y='-1'/>")
        WALL("<rotate x='1' angle='90'/><translate y='1'/>") WALL("<translate z='-1'/>")
            WALL("<rotate y='1' angle='180'/><translate z='1'/>")
                WALL("<rotate y='1' angle='90'/><translate "
                     "x='-1'/>")
                    WALL("<rotate y='1' angle='-90'/><translate "
                         "x='1'/>") "<shape type='rectangle' "
                                    "id='pendant'><transform "
                                    "name='to_world'><scale x='0.3' "
                                    "y='0.1'/><rotate x='1' "
                                    "angle='90'/><translate y='0.6' "
                                    "z='-0.2'/></transform>"
                                    "<emitter type='ies' "
                                    "id='bat'>" LAMP_FILE("batwing") "<string "
                                                                     "name='units' "
                                                                     "value='radiometric'"
                                                                     "/></emitter></"
                                                                     "shape>"
                                                                     "<shape type='cube' "
                                                                     "id='box'><"
                                                                     "transform "
                                                                     "name='to_world'><"
                                                                     "scale "
                                                                     "value='0.08'/>"
                                                                     "<translate "
                                                                     "x='-0.5' y='-0.1' "
                                                                     "z='-0.4'/></"
                                                                     "transform><emitter "
                                                                     "type='ies' "
                                                                     "id='washer'"
                                                                     ">" LAMP_FILE(
                                                                         "wallwash") "<st"
                                                                                     "rin"
                                                                                     "g "
                                                                                     "nam"
                                                                                     "e='"
                                                                                     "uni"
                                                                                     "ts'"
                                                                                     " va"
                                                                                     "lue"
                                                                                     "='"
                                                                                     "rad"
                                                                                     "iom"
                                                                                     "etr"
                                                                                     "ic'"
                                                                                     "/>"
                                                                                     "<tr"
                                                                                     "ans"
                                                                                     "for"
                                                                                     "m "
                                                                                     "nam"
                                                                                     "e='"
                                                                                     "to_"
                                                                                     "wor"
                                                                                     "ld'"
                                                                                     "><"
                                                                                     "rot"
                                                                                     "ate"
                                                                                     " x="
                                                                                     "'1'"
                                                                                     " an"
                                                                                     "gle"
                                                                                     "='"
                                                                                     "90'"
                                                                                     "/><"
                                                                                     "rot"
                                                                                     "ate"
                                                                                     " y="
                                                                                     "'1'"
                                                                                     " an"
                                                                                     "gle"
                                                                                     "='"
                                                                                     "20'"
                                                                                     "/>"
                                                                                     "</"
                                                                                     "tra"
                                                                                     "nsf"
                                                                                     "orm"
                                                                                     "></"
                                                                                     "emi"
                                                                                     "tte"
                                                                                     "r><"
                                                                                     "/sh"
                                                                                     "ape"
                                                                                     "></"
                                                                                     "sce"
                                                                                     "ne"
                                                                                     ">";

static void elements(imp_context *ctx)
{
    imp_scene *s = test_scene_text(ctx, room, IMP_MONO);
    imp_problem *p = test_problem(ctx, s, "*");
    enum { SIDE = 24, BLOCK = 8 };
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_elements_row *rows;
    static float seed[SIDE * SIDE];
    double g[64], se[64];
    imp_elements *e;
    imp_film *walks, *fe;
    size_t n_rows;
    run.spp = 600;
    test_must(ctx, imp_render(s, &run, &walks));
    o.stop = -1;
    o.eps_last = 5e-5;
    o.rays = 8;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    test_must(ctx, imp_elements_image(e, 0, IMP_ELEMENTS_FLAT, 8, &fe));
    double a = 0, b = 0, var = 0, apart = 0, squares = 0;
    for (int y = 0; y < SIDE; y += BLOCK)
        for (int x = 0; x < SIDE; x += BLOCK) {
            double q = 0, r = 0;
            for (int k = 0; k < BLOCK * BLOCK; k++) {
                const int at = (y + k / BLOCK) * SIDE + x + k % BLOCK;
                q += fe->mean[at], r += walks->mean[at];
                var += imp__sqr(walks->se[at]);
            }
            a += q, b += r;
            apart += imp__sqr(q - r);
            squares += r * r;
        }
    tap_ok(
        fabs(a / b - 1) < fmax(0.01, 3 * sqrt(var) / b) && sqrt(var) < 0.01 * b,
        "elements against walks, mean # %.6g and %.6g, %+.2f %%, se %.2f %%, %zu links",
        a / (SIDE * SIDE), b / (SIDE * SIDE), 100 * (a / b - 1), 100 * sqrt(var) / b,
        e->n_links);
    tap_ok(sqrt(apart / squares) < 0.03, "blocks, RMS # %.2f %%",
           100 * sqrt(apart / squares));

    for (int k = 0; k < SIDE * SIDE; k++) seed[k] = 1.0f / (SIDE * SIDE);
    run.spp = 300;
    test_must(ctx, imp_problem_reverse(p, seed, &run, g, se));
    test_must(ctx, imp_elements_sensitivity(e, &rows, &n_rows));
    int compared = 0;
    for (size_t i = 0; i < imp_problem_n_variables(p); i++) {
        const size_t param = test_param_of(ctx, p, i);
        for (size_t k = 0; k < n_rows; k++)
            if (rows[k].param == (int)param) {
                const double off = rows[k].derivative - g[i];
                tap_ok(fabs(off) < 3 * se[i] + 0.015 * fabs(g[i]) &&
                           se[i] < 0.05 * fabs(g[i]),
                       "d mean / d %s # %.5g walks %.5g se %.2g z %.2f", rows[k].name,
                       rows[k].derivative, g[i], se[i], off / se[i]);
                compared++;
            }
    }
    tap_ok(compared == 3, "both lamps and the wall were compared");
    imp_film_destroy(fe);
    imp_film_destroy(walks);
    imp_elements_destroy(e);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(2);
    under_a_point(ctx);
    under_a_surface(ctx);
    elements(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
