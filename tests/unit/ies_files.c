/* SPDX-License-Identifier: Apache-2.0
 *
 * LM-63 files: what is read of each edition, the message of every error, files cut off
 * and damaged anywhere, memory that ends; and the light that is made of them: symmetry,
 * interpolation, flux in closed form, shapes. */
#include "format/ies_file.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/emitter/ies.h"
#include "math/rng.h"
#include "scene/scene.h"
#include <importon/rooms.h>

static imp_context *ctx;

static enum imp_status load(imp_context *c, const char *text, size_t n,
                            struct imp_arena *keep, struct imp_ies_data *d)
{
    const struct imp_bytes b = {(unsigned char *)text, n, n};
    imp__arena_init(keep, c);
    return imp__ies_parse(c, keep, "l.ies", &b, d);
}

/* ---- Files --------------------------------------------------------------------- */

#define COUNTS(n_v, n_h, type) "1 -1 2.5 " n_v " " n_h " " type " 2 0 0 0\n0.5 0.8 40\n"
#define BODY                   COUNTS("3", "2", "1") "0 45 90\n0 90\n1 2 3\n4 5 6\n"

static void editions(void)
{
    static const struct {
        const char *text;
        double factor;
    } files[] = {{"TILT=NONE\n" BODY, 1.0}, /* 1986: no first line of its own */
                 {"A lamp\nof 1986\nTILT=NONE\n" BODY, 1.0},
                 {"IESNA91\n[TEST] x\n  TILT=NONE  \r\n" BODY, 1.0},
                 {"IESNA:LM-63-1995\r\n[TEST] x\r\nTILT=NONE\r\n" BODY "\x1a", 1.0},
                 {"IESNA:LM-63-2002\nTILT=NONE\n" BODY, 1.25},
                 {"\xef\xbb\xbfIES:LM-63-2019\n[TEST] x\nTILT=NONE\n" BODY "\n\n", 1.25},
                 {"IESNA91\nTILT=INCLUDE\n1\n3\n0 45 90\n1 .9,.8\n" BODY, 1.0},
                 {"IESNA91\rTILT=NONE\r1 -1\r2.5,3, 2 1\r2 0 0\r0\r.5 .8 4e1\r"
                  "0\r45 90 0 90 1 2 3 4 5 6",
                  1.0}};
    for (size_t i = 0; i < imp_count(files); i++) {
        struct imp_arena keep;
        struct imp_ies_data d;
        const enum imp_status st =
            load(ctx, files[i].text, strlen(files[i].text), &keep, &d);
        bool right = st == IMP_OK && d.n_vertical == 3 && d.n_horizontal == 2 &&
                     d.vertical[1] == 45 && d.horizontal[1] == 90;
        for (int k = 0; k < 6 && right; k++)
            right = fabs(d.candela[k] - (k + 1) * files[i].factor) < 1e-12;
        tap_ok(right, "edition %zu # %s", i, st ? imp_last_error(ctx) : "");
        imp__arena_free(&keep);
    }
}

static void errors(void)
{
    static const struct {
        const char *text, *message;
        enum imp_status status;
    } files[] = {
        {"", "l.ies:0: the file ends without a line that begins with TILT=", 0},
        {"IESNA91\n[A]\n",
         "l.ies:2: the file ends without a line that begins with TILT=", 0},
        {"IESNA:LM-63-1887\nTILT=NONE\n",
         "l.ies:1: the format 'IESNA:LM-63-1887' is not "
         "known",
         0},
        {"TILT= \n", "l.ies:1: TILT= names nothing: NONE, INCLUDE or a file", 0},
        {"TILT=INCLUDE\n1 2\n0 190 1 1\n",
         "l.ies:3: a tilt angle is 190, not in [0, 180]", 0},
        {"TILT=INCLUDE\n1 2\n10 0 1 1\n",
         "l.ies:3: a tilt angle 0 does not come after 10", 0},
        {"TILT=INCLUDE\n1 2\n0 90\n1 -1\n",
         "l.ies:4: a tilt multiplier is -1, not in [0, 100]", 0},
        {"TILT=INCLUDE\n4\n",
         "l.ies:2: the lamp-to-luminaire geometry is 4, not in [1, 3]", 0},
        {"TILT=INCLUDE\n1 0\n",
         "l.ies:2: the number of tilt angles is 0, not in [1, 10000]", 0},
        {"TILT=INCLUDE\n1 2\n0 1 1\n", "l.ies:3: the file ends before a tilt multiplier",
         0},
        {"TILT=NONE\n", "l.ies:2: the file ends before the number of lamps", 0},
        {"TILT=NONE\n1\n\nx", "l.ies:4: lumens per lamp: not a number", 0},
        {"TILT=NONE\n1 1000 1a", "l.ies:2: the candela multiplier: not a number", 0},
        {"TILT=NONE\n1 1000 nan 3",
         "l.ies:2: the candela multiplier is nan, not in [0, "
         "1e+12]",
         0},
        {"TILT=NONE\n1 1000 -1 3",
         "l.ies:2: the candela multiplier is -1, not in [0, "
         "1e+12]",
         0},
        {"TILT=NONE\n1 1000 1 1 1 1 1",
         "l.ies:2: the number of vertical angles is 1, not in [2, 36001]", 0},
        {"TILT=NONE\n1 1000 1 1e9 1 1 1",
         "l.ies:2: the number of vertical angles is 1e+09, not in [2, 36001]", 0},
        {"TILT=NONE\n1 1000 1 2.5 1 1 1",
         "l.ies:2: the number of vertical angles is 2.5, not whole", 0},
        {"TILT=NONE\n" COUNTS("2", "2", "2") "-90 90\n0 180\n1 1 1 1",
         "l.ies:5: a horizontal angle is 180, not in [-90, 90]", 0},
        {"TILT=NONE\n" COUNTS("2", "2", "3") "-90 90\n0 45\n1 1 1 1",
         "l.ies:5: horizontal angles go from 0 to 45: with type A they may be 0, or go "
         "from "
         "-90 or 0 to 90",
         0},
        {"TILT=NONE\n" COUNTS("2", "1", "0"),
         "l.ies:2: the photometric type is 0, not in [1, 3]", 0},
        {"TILT=NONE\n" COUNTS("36001", "36001", "1") "0 90",
         "l.ies:3: 36001 x 36001 angles, but the file has 5 bytes more", 0},
        {"TILT=NONE\n" COUNTS("2", "1", "1") "0 181 0 1 1",
         "l.ies:4: a vertical angle is 181, not in [0, 180]", 0},
        {"TILT=NONE\n" COUNTS("2", "1", "1") "-90 90 0 1 1",
         "l.ies:4: a vertical angle is -90, not in [0, 180]", 0},
        {"TILT=NONE\n" COUNTS("2", "1", "1") "90\n90\n0 1 1",
         "l.ies:5: a vertical angle 90 does not come after 90", 0},
        {"TILT=NONE\n" COUNTS("2", "2", "1") "0 90\n0 120\n1 1 1 1",
         "l.ies:5: horizontal angles go from 0 to 120: they may be 0, or go from 0 to "
         "90, "
         "180 or 360, or from 90 to 270",
         0},
        {"TILT=NONE\n" COUNTS("2", "1", "1") "0 90\n45\n1 1",
         "l.ies:5: horizontal angles go from 45 to 45: they may be 0, or go from 0 to "
         "90, "
         "180 or 360, or from 90 to 270",
         0},
        {"TILT=NONE\n" COUNTS("2", "2", "1") "0 90\n0 90\n1 1 1\n\n",
         "l.ies:6: the file ends after 3 of 4 candela values", 0},
        {"TILT=NONE\n" COUNTS("2", "2", "1") "0 90\n0 90\n1 1 -1 1\n",
         "l.ies:6: a candela value is -1, not in [0, 1e+12]", 0},
        {"TILT=NONE\n" COUNTS("2", "2", "1") "0 90\n0 90\n1 1 inf 1\n",
         "l.ies:6: a candela value is inf, not in [0, 1e+12]", 0},
        {"TILT=NONE\n" COUNTS("2", "2", "1") "0 90\n0 90\n1 1 1 1\n1\n",
         "l.ies:7: there is more than 2 x 2 candela values", 0}};
    for (size_t i = 0; i < imp_count(files); i++) {
        struct imp_arena keep;
        struct imp_ies_data d;
        const enum imp_status want = files[i].status ? files[i].status : IMP_E_SCENE;
        const enum imp_status st =
            load(ctx, files[i].text, strlen(files[i].text), &keep, &d);
        const bool right =
            st == want && strcmp(imp_last_error(ctx), files[i].message) == 0;
        tap_ok(right, "%s", files[i].message);
        if (!right) printf("# %d %s\n", st, imp_last_error(ctx));
        imp__arena_free(&keep);
    }
}

static bool is_sound(const struct imp_ies_data *d)
{
    bool sound = d->n_vertical >= 2 && d->n_horizontal >= 1;
    for (int k = 0; k < d->n_vertical; k++)
        sound &= d->vertical[k] >= 0 && d->vertical[k] <= 180 &&
                 (k == 0 || d->vertical[k] > d->vertical[k - 1]);
    for (int k = 0; k < d->n_horizontal; k++)
        sound &= d->horizontal[k] >= 0 && d->horizontal[k] <= 360;
    for (int k = 0; k < d->n_vertical * d->n_horizontal; k++)
        sound &= d->candela[k] >= 0 && isfinite(d->candela[k]);
    return sound;
}

static void hostile(void)
{
    static const char text[] = "IESNA91\n[TEST] x\nTILT=INCLUDE\n1 2\n0 90\n1 0.9\n" BODY;
    const size_t size = sizeof text - 1;
    int wrong = 0, read = 0;
    struct imp_arena keep;
    struct imp_ies_data d;
    for (size_t n = 0; n < size; n++) {
        char *cut = malloc(n ? n : 1); /* exact: overruns are seen */
        memcpy(cut, text, n);
        const enum imp_status st = load(ctx, cut, n, &keep, &d);
        read += st == IMP_OK;
        wrong += st == IMP_OK ? n + 1 < size || !is_sound(&d)
                              : strncmp(imp_last_error(ctx), "l.ies:", 6) != 0;
        imp__arena_free(&keep);
        free(cut);
    }
    char *damaged = malloc(size);
    for (uint32_t i = 0; i < 20000; i++) {
        const struct imp_key key = imp__key(11, 0, i);
        memcpy(damaged, text, size);
        for (uint32_t k = 0; k < 1 + i % 3; k++) {
            static const char with[] = "09-.e ,\n\xff";
            damaged[(size_t)(imp__u01(key, 2 * k) * (double)size)] =
                with[(size_t)(imp__u01(key, 2 * k + 1) * (sizeof with))];
        }
        const enum imp_status st = load(ctx, damaged, size, &keep, &d);
        read += st == IMP_OK;
        wrong += st == IMP_OK && !is_sound(&d);
        imp__arena_free(&keep);
    }
    free(damaged);
    tap_ok(wrong == 0 && read > 1000, "cut and damaged anywhere # %d wrong, %d read",
           wrong, read);

    struct fail_alloc heap = {0};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    o.allocator = fail_alloc_hooks(&heap);
    imp_context *fragile;
    int steps = 0;
    wrong = 0;
    if (imp_context_create(&o, &fragile) != IMP_OK) return;
    for (enum imp_status st = IMP_E_NOMEM; st != IMP_OK && steps < 100; steps++) {
        heap.calls = 0;
        heap.fail_at = steps + 1;
        st = load(fragile, text, size, &keep, &d);
        heap.fail_at = 0;
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        imp__arena_free(&keep);
    }
    imp_context_destroy(fragile);
    tap_ok(steps > 1 && wrong == 0 && heap.live == 0, "no memory # %d steps", steps);
}

/* ---- Light --------------------------------------------------------------------- */

/* Along z, C0 along x: C90 is -y, as the lamp is seen from the other side. */
static struct imp__ies lamp_of(const struct imp_ies_data *d)
{
    return (struct imp__ies){.nadir = imp__v3(0, 0, 1),
                             .c0 = imp__v3(1, 0, 0),
                             .c90 = imp__v3(0, -1, 0),
                             .data = d,
                             .factor = 1};
}
static imp_v3 along(double v, double h)
{
    v *= IMP_PI / 180, h *= IMP_PI / 180;
    return imp__v3(sin(v) * cos(h), -sin(v) * sin(h), cos(v));
}

/* Every symmetry against the whole circle written out. */
static void symmetries(void)
{
    static const double v[] = {0, 30, 75, 90}, h[] = {0, 45, 90};
    static const double half[] = {0, 45, 90, 135, 180},
                        other[] = {90, 135, 180, 225, 270};
    static const double whole[] = {0, 45, 90, 135, 180, 225, 270, 315, 360};
    static const int of_quadrant[] = {0, 1, 2, 1, 0, 1, 2, 1, 0},
                     of_half[] = {0, 1, 2, 3, 4, 3, 2, 1, 0},
                     of_other[] = {2, 1, 0, 1, 2, 3, 4, 3, 2}, of_one[9] = {0};
    const struct {
        const char *what;
        int n;
        const double *h;
        const int *index;
    } spans[] = {{"0", 1, h, of_one},
                 {"0-90", 3, h, of_quadrant},
                 {"0-180", 5, half, of_half},
                 {"90-270", 5, other, of_other}};
    for (size_t k = 0; k < imp_count(spans); k++) {
        double some[5 * 4], all[9 * 4], worst = 0;
        for (int i = 0; i < 20; i++) some[i] = 10 + 7 * i % 13 + i;
        for (int i = 0; i < 9; i++)
            memcpy(all + 4 * i, some + 4 * spans[k].index[i], 4 * sizeof *all);
        const struct imp_ies_data a = {.n_vertical = 4,
                                       .n_horizontal = spans[k].n,
                                       .vertical = v,
                                       .horizontal = spans[k].h,
                                       .candela = some};
        const struct imp_ies_data b = {.n_vertical = 4,
                                       .n_horizontal = 9,
                                       .vertical = v,
                                       .horizontal = whole,
                                       .candela = all};
        const struct imp__ies x = lamp_of(&a), y = lamp_of(&b);
        for (uint32_t i = 0; i < 2000; i++) {
            const struct imp_key key = imp__key(3, k, i);
            const imp_v3 w = along(100 * imp__u01(key, 0), 360 * imp__u01(key, 1));
            worst =
                fmax(worst, fabs(imp__ies_intensity(&x, w) - imp__ies_intensity(&y, w)));
        }
        for (int i = 0; i < 9; i++) /* at the angles of the table */
            for (int j = 0; j < 4; j++)
                worst = fmax(worst, fabs(imp__ies_intensity(&x, along(v[j], whole[i])) -
                                         (j ? all[4 * i + j] : all[4 * i])) *
                                        (j > 0));
        tap_ok(worst < 1e-11, "symmetry of %s # %.1e", spans[k].what, worst);
        tap_ok(imp__ies_intensity(&x, along(91, 10)) == 0 &&
                   imp__ies_intensity(&x, along(90, 10)) > 0,
               "nothing beyond the last angle");
    }
}

/* Int over a piece where I is linear in the angle: [-(a + b v) cos v + b sin v]. */
static double flux_of(const struct imp_ies_data *d)
{
    double sum = 0;
    const int n = d->n_vertical, m = d->n_horizontal;
    for (int j = 0; j < (m > 1 ? m - 1 : 1); j++)
        for (int i = 0; i + 1 < n; i++) {
            const double *p = d->candela + j * n + i;
            const double p0 = m > 1 ? 0.5 * (p[0] + p[n]) : p[0];
            const double p1 = m > 1 ? 0.5 * (p[1] + p[n + 1]) : p[1];
            const double v0 = d->vertical[i] * IMP_PI / 180,
                         v1 = d->vertical[i + 1] * IMP_PI / 180;
            const double b = (p1 - p0) / (v1 - v0), a = p0 - b * v0;
            const double width =
                m > 1 ? (d->horizontal[j + 1] - d->horizontal[j]) * IMP_PI / 180
                      : IMP_2PI;
            sum += width * (-(a + b * v1) * cos(v1) + b * sin(v1) +
                            (a + b * v0) * cos(v0) - b * sin(v0));
        }
    const double last = d->horizontal[m - 1];
    return sum * (m == 1 || last == 360 ? 1 : last == 90 ? 4 : 2);
}

/* Int I dw by walks' own function, and Int L cos dA dw over the shape. */
static double flux_by_quadrature(const struct imp__ies *x, bool surface)
{
    enum { V = 1440, H = 288 };
    double sum = 0;
    for (int i = 0; i < V; i++)
        for (int j = 0; j < H; j++) {
            const double a = (i + 0.5) * IMP_PI / V, b = (j + 0.5) * IMP_2PI / H;
            const imp_v3 w =
                x->nadir * cos(a) + (x->c0 * cos(b) + x->c90 * sin(b)) * sin(a);
            const double value = surface
                                     ? imp__ies_radiance(x, w) * imp__ies_projected(x, w)
                                     : imp__ies_intensity(x, w);
            sum += value * sin(a) * (IMP_PI / V) * (IMP_2PI / H);
        }
    return sum;
}

static const struct imp__ies *emitter_of(imp_scene *s) { return s->emitters[0]->self; }
static imp_scene *scene_with(const char *objects)
{
    char xml[4096];
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s = NULL;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><sensor type='perspective'/>%s</scene>", objects);
    return imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &s) == IMP_OK ? s
                                                                                  : NULL;
}
#define FILE_OF(name)                                                                    \
    "<string name='filename' value='" IMP_SCENES "/lamps/" name ".ies'/>"
#define LAMP(name, rest) "<emitter type='ies' id='lamp'>" FILE_OF(name) rest "</emitter>"

static void fluxes(void)
{
    static const struct {
        const char *what, *xml;
        double part; /* of the flux that the shape lets out; 0: some */
    } lights[] = {
        {"point, downlight", LAMP("downlight", ""), 1},
        {"point, batwing", LAMP("batwing", ""), 1},
        {"point, wallwash, turned",
         LAMP("wallwash", "<transform name='to_world'><rotate x='1' y='2' z='-1' "
                          "angle='77'/><scale x='2' y='3' z='0.5'/></transform>"),
         1},
        {"rectangle", "<shape type='rectangle'>" LAMP("batwing", "") "</shape>", 1},
        {"disk", "<shape type='disk'>" LAMP("downlight", "") "</shape>", 1},
        {"sphere", "<shape type='sphere'>" LAMP("wallwash", "") "</shape>", 1},
        {"cube", "<shape type='cube'>" LAMP("wallwash", "") "</shape>", 1},
        {"cylinder", "<shape type='cylinder'>" LAMP("wallwash", "") "</shape>", 1},
        {"rectangle, whose back is dark",
         "<shape type='rectangle'>" LAMP("wallwash", "") "</shape>", 0}};
    for (size_t k = 0; k < imp_count(lights); k++) {
        imp_scene *s = scene_with(lights[k].xml);
        if (!s) {
            tap_ok(0, "%s # %s", lights[k].what, imp_last_error(ctx));
            continue;
        }
        const struct imp__ies *x = emitter_of(s);
        const double table = flux_of(x->data);
        const double flux = flux_by_quadrature(x, s->emitters[0]->ops == &imp__ies_area);
        tap_ok(lights[k].part > 0 ? fabs(flux / table - 1) < 2e-5
                                  : flux < 0.95 * table && flux > 0.5 * table,
               "%s: flux # %.8g lm, table %.8g", lights[k].what, flux, table);
        imp_scene_destroy(s);
    }
    /* Exact cosines at the table's angles: pi I0, up to the interpolation's h^2/12. */
    double v[91], cd[91];
    static const double h[] = {0};
    for (int k = 0; k < 91; k++) v[k] = k, cd[k] = 700 * cos(k * IMP_PI / 180);
    const struct imp_ies_data d = {.n_vertical = 91,
                                   .n_horizontal = 1,
                                   .vertical = v,
                                   .horizontal = h,
                                   .candela = cd};
    tap_near(flux_of(&d), 700 * IMP_PI, 2.6e-5, 0, "a Lambertian lamp has pi I0");
}

/* Table of I = L0 A cos^(n+1) at close angles is the beam of exponent n. */
static void beams(void)
{
    enum { N = 1801 };
    static double v[N], cd[N];
    static const double h[] = {0};
    imp_scene *s = scene_with(
        "<shape type='rectangle'><transform name='to_world'><scale x='0.3' y='0.2'/>"
        "<rotate x='1' y='1' angle='40'/><translate x='5'/></transform><emitter "
        "type='beam'><float name='radiance' value='3'/><float name='exponent' "
        "value='7'/></emitter></shape><shape type='rectangle'><transform "
        "name='to_world'><scale x='0.3' y='0.2'/><rotate x='1' y='1' "
        "angle='40'/></transform>" LAMP("downlight",
                                        "<float name='scale' value='1'/>") "</shape>");
    if (!s) {
        tap_ok(0, "beams # %s", imp_last_error(ctx));
        return;
    }
    const double area = s->emitters[1]->shape->area;
    for (int k = 0; k < N; k++) {
        v[k] = 90.0 * k / (N - 1);
        cd[k] = 3 * area * pow(fmax(0, cos(v[k] * IMP_PI / 180)), 8);
    }
    const struct imp_ies_data d = {.n_vertical = N,
                                   .n_horizontal = 1,
                                   .vertical = v,
                                   .horizontal = h,
                                   .candela = cd};
    struct imp__ies *x = s->emitters[1]->self;
    x->data = &d;
    const imp_v3 n = x->nadir;
    double worst = 0, most = 0;
    for (uint32_t i = 0; i < 3000; i++) {
        const struct imp_key key = imp__key(9, 0, i);
        const imp_v3 w = imp__normalize(imp__v3(
            imp__u01(key, 0) - 0.5, imp__u01(key, 1) - 0.5, imp__u01(key, 2) - 0.5));
        const struct imp_emission at = {.dist = 2, .cos_light = imp__dot(w, n), .d = w};
        const imp_spec one[2] = {imp__spec(1)}, two[2] = {imp__spec(3), imp__spec(7)};
        imp_spec a, b;
        s->emitters[1]->ops->eval(s->emitters[1], one, &at, &a);
        s->emitters[0]->ops->eval(s->emitters[0], two, &at, &b);
        most = fmax(most, b[0]);
        worst = fmax(worst, fabs(a[0] - b[0]));
    }
    tap_ok(worst < 3e-6 * most && most > 2,
           "a table of cos^8 is a beam of 7 # %.1e of %g", worst, most);
    tap_near(fabs(imp__dot(x->c0, imp__cross(x->nadir, x->c90))), 1, 1e-14, 0,
             "a frame of unit vectors");
    imp_scene_destroy(s);
}

/* The bound of a cone holds the radiance of all its directions, where the table's steps
 * are small beside it; turned lamps, all symmetries. */
static void bounds(void)
{
    static const char *const names[] = {
        "<shape type='sphere'>" LAMP("wallwash", "") "</shape>",
        "<shape type='rectangle'>" LAMP("batwing", "") "</shape>"};
    for (size_t k = 0; k < imp_count(names); k++) {
        imp_scene *s = scene_with(names[k]);
        if (!s) continue;
        const struct imp__ies *x = emitter_of(s);
        int wrong = 0;
        for (uint32_t i = 0; i < 4000; i++) {
            const struct imp_key key = imp__key(5, k, i);
            const imp_v3 d = along(180 * imp__u01(key, 0), 360 * imp__u01(key, 1));
            const double angle = 0.7 * imp__u01(key, 2);
            const struct imp_frame f = imp__frame_from_normal(d);
            const double b = angle * imp__u01(key, 3), c = IMP_2PI * imp__u01(key, 4);
            const imp_v3 w = f.n * cos(b) + (f.s * cos(c) + f.t * sin(c)) * sin(b);
            /* Times what is shown: L cos, which is what links carry. */
            const double bound = imp__ies_bound(x, d, angle);
            wrong += imp__ies_intensity(x, w) > 0 && imp__ies_projected(x, w) > 0 &&
                     imp__ies_intensity(x, w) >
                         bound *
                             fmax(imp__ies_projected(x, w),
                                  x->same + (x->n_facets ? x->facets[0].area : 0)) *
                             (1 + 1e-9);
        }
        tap_ok(wrong == 0, "bounds over cones # %d wrong", wrong);
        imp_scene_destroy(s);
    }
}

/* ---- Scenes -------------------------------------------------------------------- */

static void scenes(void)
{
    static const struct {
        const char *xml, *words;
    } wrong[] = {
        {"<emitter type='ies'/>", "'filename' is missing"},
        {"<emitter type='ies'><string name='filename' value='no.ies'/></emitter>",
         "no.ies"},
        {LAMP("downlight", "<string name='units' value='lux'/>"), "units"},
        {LAMP("downlight", "<transform name='to_world'><scale x='0'/></transform>"),
         "to_world is not affine and invertible"},
        {LAMP("downlight", "<point name='position' x='1'/>"), "position"},
        {LAMP("downlight", "<texture type='checkerboard' name='scale'/>"),
         "scale cannot be a texture"},
        {"<shape type='cylinder'><transform name='to_world'><scale "
         "x='2'/></transform>" LAMP("downlight", "") "</shape>",
         "is an oval cylinder: by a table only a circular one glows"},
        {"<shape type='sphere' id='s'>" LAMP("downlight", "") "</shape><shape "
                                                              "type='disk'><ref "
                                                              "id='lamp'/></shape>",
         "second shape"}};
    for (size_t k = 0; k < imp_count(wrong); k++) {
        imp_scene *s = scene_with(wrong[k].xml);
        tap_ok(!s && strstr(imp_last_error(ctx), wrong[k].words), "error: %s # %s",
               wrong[k].words, s ? "" : imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    imp_scene *s = scene_with(LAMP("downlight", "<string name='units' "
                                                "value='radiometric'/>"));
    if (s)
        tap_near(imp__ies_intensity(emitter_of(s), imp__v3(0, 0, 1)), 2000 / 683.0, 1e-12,
                 0, "candela are 1/683 W/sr");
    imp_scene_destroy(s);
    s = scene_with("<shape type='rectangle'><transform name='to_world'><rotate x='1' "
                   "angle='90'/></transform>" LAMP("batwing", "") "</shape>");
    if (s) {
        const struct imp__ies *x = emitter_of(s);
        tap_ok(fabs(x->nadir[1] + 1) < 1e-12 && fabs(x->c0[0] - 1) < 1e-12,
               "a flat lamp shines along its normal, C0 along its x # nadir %.3g %.3g "
               "%.3g",
               x->nadir[0], x->nadir[1], x->nadir[2]);
    }
    imp_scene_destroy(s);
}

/* ---- Tilted lamps -------------------------------------------------------------- */

static bool file_put(const char *name, const char *text)
{
    FILE *f = fopen(name, "w");
    return f && fputs(text, f) >= 0 && fclose(f) == 0;
}

/* The luminaire's flux over that of its table; NAN: an error. */
static double part_kept(const char *more)
{
    char xml[512];
    struct imp_luminaire_info info = {.size = sizeof info};
    imp_scene *s = NULL;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><emitter type='ies' id='a'><string name='filename' "
             "value='tilted_lamp.ies'/>%s</emitter></scene>",
             more);
    if (imp_scene_load_string(ctx, xml, strlen(xml), "tilted", NULL, &s) != IMP_OK)
        return NAN;
    test_must(ctx, imp_scene_get_luminaire(s, 0, &info));
    imp_scene_destroy(s);
    return info.flux / (2 * M_PI * 2.5);
}

/* 1, .9 and .6 of its flux at 0, 30 and 90 degrees: in the file, or in one beside it. */
static void tilted(void)
{
#define TILTS "1\n3\n0 30 90\n1 .9 .6\n"
#define EVEN  "1 -1 2.5 2 1 1 2 0 0 0\n1 1 40\n0 90\n0\n1 1\n"
    for (int k = 0; k < 2; k++) {
        const char *what = k ? "in a file of its own" : "in the file";
        tap_ok(file_put("tilted_lamp.ies", k ? "IESNA91\nTILT=tilted_lamp.tlt\n" EVEN
                                             : "IESNA91\nTILT=INCLUDE\n" TILTS EVEN) &&
                   (!k || file_put("tilted_lamp.tlt", TILTS)),
               "tilts %s", what);
        const double all = part_kept("");
        tap_near(all, 1, 2e-3, 0, what);
        tap_near(part_kept("<float name='tilt' value='60'/>") / all, .75, 1e-9, 0, what);
        tap_near(part_kept("<float name='tilt' value='-15'/>") / all, .95, 1e-9, 0, what);
        tap_near(part_kept("<float name='tilt' value='90'/><float name='flux' "
                           "value='1000'/>"),
                 600 / (2 * M_PI * 2.5), 1e-3, 0, what);
        tap_ok(isnan(part_kept("<float name='tilt' value='91'/>")) &&
                   strstr(imp_last_error(ctx), "outside [0, 90]"),
               "%s", imp_last_error(ctx));
    }
    static const struct {
        const char *tilts, *message;
    } wrong[] = {{"1\n2\n0 90\n1\n", "tilted_lamp.tlt:4: the file ends before a tilt "},
                 {TILTS "5", "tilted_lamp.tlt:5: there is more than 3 tilt multipliers"}};
    for (size_t k = 0; k < imp_count(wrong); k++)
        tap_ok(file_put("tilted_lamp.tlt", wrong[k].tilts) && isnan(part_kept("")) &&
                   strstr(imp_last_error(ctx), wrong[k].message),
               "%s", imp_last_error(ctx));
    remove("tilted_lamp.tlt");
    tap_ok(isnan(part_kept("")) && strstr(imp_last_error(ctx), "TILT: ") &&
               strstr(imp_last_error(ctx), "tilted_lamp.tlt"),
           "%s", imp_last_error(ctx));
    tap_ok(file_put("tilted_lamp.ies", "IESNA91\nTILT=NONE\n" EVEN) &&
               isnan(part_kept("<float name='tilt' value='5'/>")) &&
               strstr(imp_last_error(ctx), "TILT=NONE"),
           "%s", imp_last_error(ctx));
    remove("tilted_lamp.ies");
}

static void hear(enum imp_log_level level, const char *message, void *payload)
{
    if (level == IMP_LOG_WARNING) snprintf(payload, 200, "%s", message);
}

#define MORE "and its lamps give 1000 lm alone"
/* An intensity I below the horizon is 2 pi I lm, of lamps of 1000 lm: more than they give is a
 * contradiction, less is what the luminaire keeps. */
static void contradictions(void)
{
    static const struct {
        const char *counts, *candela;
        const char *warned, *opening;
    } files[] = {
        {"1 1000", "170 170", NULL, "0 0 0"},
        {"1 1000", "180 180", MORE, "0 0 0"},
        {"2 500", "180 180", MORE, "0 0 0"},
        {"1 -1", "180 180", NULL, "0 0 0"},
        {"1 1000", "20 20", NULL, "0 0 0"},
        {"1 1000", "20 20", NULL, "1.2 .6 0"},
        {"1 1000", "20 20", "opening is 600 m long: LM-63 has metres", "600 300 0"}};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *loud;
    char said[200], text[200];
    o.log = hear;
    o.log_payload = said;
    test_must(NULL, imp_context_create(&o, &loud));
    for (size_t k = 0; k < imp_count(files); k++) {
        struct imp_arena keep;
        struct imp_ies_data d;
        said[0] = 0;
        snprintf(text, sizeof text,
                 "IESNA91\nTILT=NONE\n%s 1 2 1 1 2 %s\n1 1 40\n0 90\n0\n%s\n",
                 files[k].counts, files[k].opening, files[k].candela);
        tap_ok(load(loud, text, strlen(text), &keep, &d) == IMP_OK &&
                   (files[k].warned ? strstr(said, files[k].warned) != NULL : !*said),
               "lamps %s, candela %s, opening %s # %s", files[k].counts, files[k].candela,
               files[k].opening, said);
        imp__arena_free(&keep);
    }
    imp_context_destroy(loud);
}

int main(void)
{
    ctx = test_context(1);
    editions();
    errors();
    hostile();
    symmetries();
    fluxes();
    beams();
    bounds();
    scenes();
    tilted();
    contradictions();
    imp_context_destroy(ctx);
    return tap_done();
}
