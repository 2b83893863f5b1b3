/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_bend_check fails where a derivative is wrong, and only there: not where the
 * objective is at its least, not because samples are floats, not because a ray runs along
 * the faces of cells. And what a fit says of rays that it cannot see. */
#include "bend/bend_problem.h"
#include "bend_kit.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static char said[400];
static void hear(enum imp_log_level level, const char *text, void *payload)
{
    (void)level, (void)payload;
    snprintf(said, sizeof said, "%s", text);
}

#define PROBLEM(start, scheme, volume, more, target)                                     \
    "<scene version='3.0.0'><medium type='graded'><float name='step' value='0.05'/>"     \
    "<string name='scheme' value='" scheme "'/>" volume more                             \
    "<surface type='plane'><float name='offset' value='0.9'/></surface></medium>"        \
    "<rays type='beam'><integer name='count' value='40'/><float name='radius' "          \
    "value='0.5'/><float name='start' value='" start "'/></rays>" target "</scene>"
#define GRID(index, more)                                                                \
    "<volume type='grid'><integer name='cells' value='6'/><float name='index' "          \
    "value='" index "'/>" more "</volume>"
#define WORD(name, value) "<string name='" name "' value='" value "'/>"
#define FOCUS             "<target type='focus'><point name='point' value='0,0,0.9'/></target>"
#define SPOT              "<target type='spot'/>"
#define WAVEFRONT         "<target type='wavefront'/>"
#define PLUME                                                                            \
    "<volume type='plume'><float name='n0' value='1.2'/><float name='b' value='0.2'/>"   \
    "<float name='width' value='0.5'/></volume>"
#define LENS                                                                             \
    "<volume type='plume' name='start'><float name='n0' value='1.2'/>"                   \
    "<float name='b' value='0.2'/><float name='width' value='0.5'/></volume>"
#define SINGLE "<boolean name='single' value='true'/>"

static imp_bend *load(const char *xml)
{
    imp_bend *b;
    said[0] = 0;
    KIT_CHECK(imp_bend_load_string(kit_ctx, xml, strlen(xml), "p", NULL, &b));
    return b;
}

static int failures(imp_bend *b, const char *method)
{
    const struct imp_check_row *rows;
    size_t n;
    int failed = 0;
    KIT_CHECK(imp_bend_check(b, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        if (rows[i].ok || (method && strcmp(rows[i].method, method))) continue;
        failed++;
        if (!method)
            printf("# %s step %g: %.9g against %.9g, error %.2g, limit %.2g\n",
                   rows[i].method, rows[i].step, rows[i].value, rows[i].reference,
                   rows[i].error, rows[i].limit);
    }
    return failed;
}

static const struct {
    const char *name, *xml;
} problems[] = {
    {"spline", PROBLEM("-0.6", "leapfrog", GRID("1.3", ""), "", FOCUS)},
    {"spline, at the least", PROBLEM("-0.6", "verlet", GRID("1.3", ""), "", WAVEFRONT)},
    {"constant, at the least",
     PROBLEM("-0.6", "leapfrog",
             "<volume type='constant'><float name='n0' value='1.5'/></volume>", "",
             WAVEFRONT)},
    {"floats", PROBLEM("-0.6", "leapfrog", GRID("1.3", SINGLE), "", SPOT)},
    {"floats, yoshida4", PROBLEM("-0.6", "yoshida4", GRID("1.3", SINGLE), "", FOCUS)},
    {"floats of eta^2/2",
     PROBLEM("-0.6", "arc", GRID("1.3", SINGLE WORD("parameter", "eta2")), "", FOCUS)},
    {"trilinear, a ray on a face",
     PROBLEM("-0.6", "euler", GRID("1.3", WORD("interpolation", "trilinear")), "", SPOT)},
    {"trilinear floats",
     PROBLEM("-0.6", "leapfrog", GRID("1.3", SINGLE WORD("interpolation", "trilinear")),
             "", FOCUS)},
    {"plume", PROBLEM("-0.6", "leapfrog", PLUME, "", FOCUS)},
    {"sech", PROBLEM("-0.6", "yoshida4",
                     "<volume type='sech'><float name='n0' value='1.5'/><float name='g' "
                     "value='0.5'/></volume>",
                     "", SPOT)}};

/* The same with gradients off by a thousandth. */
static const struct imp__field_ops *right;
static void wrong_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                        struct imp__bar *bar)
{
    const imp_v3 c = *b * 1.001;
    right->splat(f, x, 1.001 * a, &c, bar);
}

static void verdicts(void)
{
    for (size_t i = 0; i < imp_count(problems); i++) {
        imp_bend *b = load(problems[i].xml);
        const int failed = failures(b, NULL);
        const bool least = strstr(problems[i].name, "least") != NULL;
        struct imp__field_ops wrong = *b->field->ops;
        double *theta = malloc(b->field->n_theta * sizeof *theta),
               *after = malloc(b->field->n_theta * sizeof *after);
        imp_field_get_theta(b->field, theta);
        right = b->field->ops;
        wrong.splat = wrong_splat;
        wrong.kick_back = NULL;
        b->field->ops = &wrong;
        const int caught = failures(b, "difference");
        b->field->ops = right;
        imp_field_get_theta(b->field, after);
        tap_ok(failed == 0 && (least || caught > 0) &&
                   !memcmp(theta, after, b->field->n_theta * sizeof *theta),
               "%s # %d rows fail; 0.1 %% off: %d", problems[i].name, failed, caught);
        free(theta), free(after);
        imp_bend_destroy(b);
    }
}

static void lost(void)
{
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    o.iterations[0] = 3;
    imp_bend *b = load(PROBLEM("-1.6", "leapfrog", GRID("1.3", ""), "", FOCUS));
    const enum imp_status st = imp_bend_fit(b, &o, &r);
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(kit_ctx), "40 start outside"),
           "a fit of no rays is refused # %s", imp_last_error(kit_ctx));
    imp_bend_destroy(b);

    /* To go sideways is to leave the field without an exit. */
    b = load(PROBLEM(
        "-0.6", "leapfrog", GRID("1.3", ""), "",
        "<target type='direction'><vector name='point' value='1,0,0'/></target>"));
    o.scale = 1;
    o.iterations[0] = 20;
    KIT_CHECK(imp_bend_fit(b, &o, &r));
    const bool fewer = r.stats.traced < r.stats.rays;
    tap_ok(fewer == (strstr(said, "are lost now") != NULL) && fewer,
           "rays that a fit loses are spoken of # %llu of %llu left; %s",
           (unsigned long long)r.stats.traced, (unsigned long long)r.stats.rays, said);
    imp_bend_destroy(b);
}

/* A value or a check over no rays is an error, whose counts say why; over a part of them
 * it stands for that part, and how large it is can be read. */
static void none(void)
{
    imp_bend *b = load(PROBLEM("2", "leapfrog", GRID("1.3", ""), "", FOCUS));
    struct imp_bend_stats s = IMP_BEND_STATS_INIT;
    const struct imp_check_row *rows;
    double value, error, order;
    size_t n;
    enum imp_status st = imp_bend_objective(b, &value, NULL, NULL, &s);
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(kit_ctx), "none of 40 rays") &&
               s.started_out == 40 && s.traced == 0,
           "an objective of no rays is refused # %s", imp_last_error(kit_ctx));
    st = imp_bend_check(b, &rows, &n);
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(kit_ctx), "none of 40 rays"),
           "a check of no rays is refused # %s", imp_last_error(kit_ctx));
    st = imp_bend_step_error(b, 200, &error, &order);
    tap_ok(st == IMP_E_NUMERIC, "no error of the step without rays # %s",
           imp_last_error(kit_ctx));
    imp_bend_destroy(b);

    b = load(PROBLEM("-0.6", "leapfrog", GRID("1.3", ""),
                     "<surface type='disc'><float name='radius' value='0.3'/>"
                     "<string name='event' value='stop'/></surface>",
                     FOCUS));
    KIT_CHECK(imp_bend_objective(b, &value, NULL, NULL, &s));
    KIT_CHECK(imp_bend_check(b, &rows, &n));
    size_t at = 0;
    while (at < n && strcmp(rows[at].method, "rays")) at++;
    tap_ok(at < n && s.traced > 0 && s.traced < s.rays &&
               rows[at].value == (double)s.traced && rows[at].reference == 40 &&
               fabs(rows[at].error - (double)(s.rays - s.traced) / 40) < 1e-12,
           "a check says how many rays it stands for # %d of 40", (int)s.traced);
    KIT_CHECK(imp_bend_step_error(b, 1, &error, &order)); /* the first ray is lost */
    tap_ok(isfinite(error), "pilot rays that are lost are replaced # %.1e", error);
    imp_bend_destroy(b);
}

/* A fit that goes on from a checkpoint has the start of one that was never stopped, also
 * where the search began by moving numbers into their bounds; other problems are refused.
 */
static void resumed(void)
{
    static const char *const xml[3] = {
        PROBLEM("-0.6", "leapfrog", GRID("1.3", LENS),
                "<float name='index_min' value='1.3'/>", FOCUS),
        PROBLEM("-0.6", "leapfrog", GRID("1.3", LENS),
                "<float name='index_min' value='1.31'/>", FOCUS),
        PROBLEM("-0.6", "leapfrog", GRID("1.3", LENS),
                "<float name='index_min' value='1.3'/>",
                "<target type='focus'><point name='point' value='0,0,0.9'/>"
                "<float name='plane' value='0.95'/></target>")};
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r[2] = {{.size = sizeof *r}, {.size = sizeof *r}};
    enum imp_status st[3];
    bool moved = false;
    o.checkpoint = "bend_check.checkpoint";
    remove(o.checkpoint);
    for (int k = 0; k < 2; k++) {
        imp_bend *b = load(xml[0]);
        o.iterations[0] = k == 0 ? 3 : 6;
        o.resume = k;
        KIT_CHECK(imp_bend_fit(b, &o, &r[k]));
        moved |= k == 0 && r[0].history[0] != r[0].start;
        imp_bend_destroy(b);
    }
    tap_ok(moved && r[1].start == r[0].start && r[1].n_history > r[0].n_history,
           "a resumed fit has the same start # %.9g %.9g", r[0].start, r[1].start);
    for (int k = 1; k < 3; k++) {
        imp_bend *b = load(xml[k]);
        st[k] = imp_bend_fit(b, &o, &r[1]);
        imp_bend_destroy(b);
    }
    tap_ok(st[1] == IMP_E_ARG && st[2] == IMP_E_ARG,
           "a checkpoint of other bounds or targets is refused # %s",
           imp_last_error(kit_ctx));
    remove(o.checkpoint);
}

static void bounds(void)
{
    imp_bend *b = load(PROBLEM("-0.6", "leapfrog", GRID("0.5", ""), "", FOCUS));
    tap_ok(strstr(said, "p:1:") && strstr(said, "729 of 729"), "index below 1 # %s",
           said);
    imp_bend_destroy(b);
    b = load(PROBLEM("-0.6", "leapfrog", GRID("0.5", ""),
                     "<float name='index_min' value='0.4'/>", FOCUS));
    tap_ok(!said[0], "and nothing is said where index_min allows it # %s", said);
    imp_bend_destroy(b);
}

/* A picture whose sides are one line has no pixels. */
static void picture(void)
{
    static const float pixels[16] = {1, 1, 1, 1, 1, 2, 2, 1, 1, 2, 2, 1, 1, 1, 1, 1};
    imp_bend *b = load(PROBLEM("-0.6", "leapfrog", GRID("1.3", ""), "", FOCUS));
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    t.type = IMP_BEND_IMAGE;
    t.width = t.height = 4;
    t.pixels = pixels;
    t.origin[0] = t.origin[1] = -1;
    t.u[0] = t.v[0] = 2;
    const enum imp_status oblique = imp_bend_add_target(b, &t);
    t.v[0] = 0, t.v[1] = 2;
    tap_ok(oblique == IMP_E_ARG && imp_bend_add_target(b, &t) == IMP_OK,
           "sides of a picture are orthogonal # %s", imp_last_error(kit_ctx));
    imp_bend_destroy(b);
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 2;
    o.log = hear;
    if (imp_context_create(&o, &kit_ctx) != IMP_OK) return 1;
    verdicts();
    lost();
    none();
    resumed();
    bounds();
    picture();
    imp_context_destroy(kit_ctx);
    return tap_done();
}
