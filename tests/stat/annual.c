/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight of a year: in the open, where every hour is its diffuse light and the sine of the sun's
 * altitude times the direct; in a black shaft that sees 30 degrees about the zenith, against an
 * integral over Perez' formula; behind a pane; before a mirror; in a room, hour by hour
 * against readings under `perezsky` and `sun`. Its errors: annual_errors.c. */
#include "imp_tap.h"
#include "imp_year.h"
#include "inverse/rooms/sky_patches.h"
#include "kind/emitter/perezsky.h"

static imp_context *ctx;

static struct imp_annual_point year_of(imp_scene *s, int spp, uint64_t seed,
                                       double *reading, double *se)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_annual_options o = IMP_ANNUAL_OPTIONS_INIT;
    struct imp_annual_point point;
    o.size = sizeof o;
    o.closes = 24; /* all hours */
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_annual_read(s, &run, HOURS, hours, &o, &point, NULL, reading, se));
    return point;
}

static double sun_light(const struct imp_weather_hour *h)
{
    return h->direct_illuminance * fmax(h->sun[2], 0);
}

/* Readings of the hours against truths: the largest z, with a relative slack. */
static void compare(const char *what, const double *x, const double *se,
                    const double *truth, double slack, double widest)
{
    double worst = 0, wide = 0;
    for (int i = 0; i < HOURS; i++) {
        if (truth[i] < 0) continue;
        const double off = fabs(x[i] - truth[i]) - slack * truth[i];
        worst = fmax(worst, fmax(off, 0) / (se[i] + 1e-9 * truth[i] + 1e-9));
        wide = fmax(wide, se[i] / (truth[i] + 1));
    }
    /* Of Student's distribution with 15 degrees of freedom 6.5 is what 4.5 is of the normal. */
    tap_ok(worst < 6.5 && wide < widest,
           "%s: %d hours, the worst %.2f standard errors away, which are %.4f at most",
           what, HOURS, worst, wide);
}

static void open_air(void)
{
    imp_scene *s = scene_of(ctx, "path", SKY GRID(FILM(1, 1)));
    double x[HOURS], se[HOURS], truth[HOURS], sum = 0, daylit = 0, useful[4] = {0};
    for (int i = 0; i < HOURS; i++) {
        truth[i] = hours[i].diffuse_illuminance + sun_light(&hours[i]);
        sum += truth[i];
        daylit += truth[i] >= 300;
        useful[truth[i] < 100 ? 0 : truth[i] < 300 ? 1 : truth[i] <= 3000 ? 2 : 3]++;
    }
    const struct imp_annual_point y = year_of(s, 4096, 1, x, se);
    compare("in the open", x, se, truth, 0, .005);
    const double z = (y.exposure.value - sum) / y.exposure.se;
    tap_ok(fabs(z) < 5 && y.exposure.se < .002 * sum,
           "exposure %.0f +- %.0f of %.0f lx h", y.exposure.value, y.exposure.se, sum);
    tap_ok(fabs(y.mean.value - y.exposure.value / HOURS) < 1e-9 * sum, "mean");
    tap_ok(fabs(y.autonomy.value - daylit / HOURS) <= 4 * y.autonomy.se + 1e-12,
           "autonomy %.4f +- %.4f of %.4f", y.autonomy.value, y.autonomy.se,
           daylit / HOURS);
    double parts = 0;
    for (int k = 0; k < 4; k++) {
        parts += y.useful[k].value;
        tap_ok(fabs(y.useful[k].value - useful[k] / HOURS) <= 4 * y.useful[k].se + 1e-12,
               "useful %d: %.4f of %.4f", k, y.useful[k].value, useful[k] / HOURS);
    }
    tap_ok(fabs(parts - 1) < 1e-12, "useful daylight has four parts of all");
    imp_scene_destroy(s);
}

/* Int L cos dw within 30 degrees of the zenith under the sky of hour h, of unit horizontal
 * illuminance. */
static double shaft_part(const struct imp_weather_hour *h)
{
    enum { UP = 200, AROUND = 400 };
    struct imp__sky_shape sky = {.axis = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    double sum = 0;
    const double r = sqrt(h->sun[0] * h->sun[0] + h->sun[1] * h->sun[1]);
    sky.sun = h->sun[2] < 0 ? imp__v3(h->sun[0] / r, h->sun[1] / r, 0)
                            : imp__v3(h->sun[0], h->sun[1], h->sun[2]);
    imp__perez_shape(
        &sky, &(struct imp__perez_weather){h->diffuse, h->direct, IMP__SOLAR_CONSTANT});
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double z2 = .75 + .25 * (i + .5) / UP, a = 2 * M_PI * (j + .5) / AROUND;
            sum += imp__sky_shape_at(
                &sky, imp__v3(sqrt(1 - z2) * cos(a), sqrt(1 - z2) * sin(a), sqrt(z2)));
        }
    return sum * .25 * M_PI / (UP * AROUND) / imp__sky_shape_horizontal(&sky);
}

static void shaft(void)
{
    imp_scene *s = scene_of(
        ctx, "path",
        SKY GRID(FILM(
            1, 1)) "<shape type='cylinder'><point name='p0' x='0' y='0' "
                   "z='0'/><point name='p1' x='0' y='0' z='1.7320508075688772'/><boolean "
                   "name='flip_normals' value='true'/><bsdf type='diffuse'><rgb "
                   "name='reflectance' "
                   "value='0'/></bsdf></shape>");
    double x[HOURS], se[HOURS], truth[HOURS];
    for (int i = 0; i < HOURS; i++) {
        const struct imp_weather_hour *h = &hours[i];
        truth[i] = h->diffuse > 0 ? h->diffuse_illuminance * shaft_part(h) : 0;
        if (h->sun[2] > sqrt(.75)) truth[i] += sun_light(h);
        if (fabs(acos(h->sun[2]) - M_PI / 6) < .005) truth[i] = -1; /* cut by the edge */
    }
    year_of(s, 8192, 1, x, se);
    compare("at the ground of a shaft", x, se, truth, .01, .05);
    imp_scene_destroy(s);
}

/* Suns at the top edge of a wall, whole, cut or hidden: the part of the disc that is seen. One ray may
 * say that none is, others look where the edge is near. */
static void edge(void)
{
    enum { SEEDS = 32 };
    imp_scene *s = scene_of(
        ctx, "path",
        SKY GRID(FILM(1, 1)) "<shape type='rectangle'><transform name='to_world'><scale "
                             "x='30' y='30'/><rotate y='1' angle='90'/><translate x='30' "
                             "z='20'/></transform><bsdf type='twosided'><bsdf "
                             "type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"
                             "</bsdf></shape>");
    const double radius = .004675;
    struct imp_weather_hour kept[HOURS];
    double truth = 0, open = 0;
    memcpy(kept, hours, sizeof kept);
    for (int i = 0; i < HOURS; i++) {
        struct imp_weather_hour *h = &hours[i];
        const double y = -.19 + .38 * i / HOURS, z = .5 + .0015 * (i % 7 - 3);
        const double r = sqrt(.3 * .3 + y * y + z * z);
        h->sun[0] = .3 / r, h->sun[1] = y / r, h->sun[2] = z / r;
        h->direct = 500, h->direct_illuminance = 50000;
        /* Above the plane of point and edge, in radii. */
        const double d = asin((.3 * h->sun[2] - .5 * h->sun[0]) / hypot(.3, .5)) / radius;
        const double c = fmin(fmax(d, -1), 1);
        truth += sun_light(h) * (1 - (acos(c) - c * sqrt(1 - c * c)) / M_PI);
        open += sun_light(h);
    }
    double sum[2] = {0};
    for (int k = 0; k < 2; k++) {
        for (int seed = 1; seed <= SEEDS; seed++)
            sum[k] += year_of(s, 16, (uint64_t)seed, NULL, NULL).exposure.value / SEEDS;
        for (int i = 0; i < HOURS; i++) hours[i].direct_illuminance = 0;
    }
    const double off = (sum[0] - sum[1]) / truth - 1;
    tap_ok(fabs(off) < .02, "suns cut by a wall: off by %.2f %%, of %.0f %% of the light",
           100 * off, 100 * truth / open);
    memcpy(hours, kept, sizeof kept);
    imp_scene_destroy(s);
}

/* A pane over the point: the sun comes through the sheet's 1 - R'. */
static void behind_glass(void)
{
    for (int k = 0; k < 2; k++) {
        imp_scene *s = scene_of(
            ctx, k ? "volpath" : "path",
            SKY GRID(FILM(
                1, 1)) "<shape type='rectangle'><transform name='to_world'>"
                       "<scale value='1000'/><translate z='.5'/></transform><bsdf "
                       "type='thindielectric'><float name='int_ior' value='1.5'/><float "
                       "name='ext_ior' value='1'/></bsdf></shape>");
        double x[HOURS], se[HOURS], worst = 0;
        year_of(s, 2048, 1, x, se);
        /* The sky alone has no closed form here: the sun is what is left of it. */
        struct imp_weather_hour kept[HOURS];
        double sky[HOURS], sky_se[HOURS];
        memcpy(kept, hours, sizeof kept);
        for (int i = 0; i < HOURS; i++) hours[i].direct_illuminance = 0;
        year_of(s, 2048, 1, sky, sky_se);
        memcpy(hours, kept, sizeof kept);
        for (int i = 0; i < HOURS; i++) {
            const double c = hours[i].sun[2], t = sqrt(1 - (1 - c * c) / 2.25);
            const double rs = (c - 1.5 * t) / (c + 1.5 * t),
                         rp = (1.5 * c - t) / (1.5 * c + t);
            const double R = (rs * rs + rp * rp) / 2;
            if (c < .2) continue; /* over the sun's disc R changes too much there */
            const double truth = sun_light(&hours[i]) * (1 - 2 * R / (1 + R));
            worst = fmax(worst, fabs(x[i] - sky[i] - truth) / (truth + 1));
        }
        tap_ok(worst < 2e-3, "the sun behind a pane, %s: %.1e", k ? "volpath" : "path",
               worst);
        imp_scene_destroy(s);
    }
}

/* A wall-high perfect mirror doubles the sun that stands before it, in a mean over its patch. */
static void mirror(void)
{
    imp_scene *s = scene_of(
        ctx, "path",
        SKY GRID(FILM(
            1, 1)) "<shape type='rectangle'><transform "
                   "name='to_world'><scale value='10000'/><rotate y='1' "
                   "angle='90'/><translate "
                   "x='-1'/></transform><bsdf type='conductor'><string name='material' "
                   "value='none'/></bsdf></shape>");
    double sum = 0, open = 0;
    const struct imp_annual_point y = year_of(s, 32768, 1, NULL, NULL);
    for (int i = 0; i < HOURS; i++) {
        const double sun = sun_light(&hours[i]);
        sum += hours[i].sun[0] > 0 ? 2 * sun : 0;
        open += sun;
        sum += 0;
    }
    /* The sky: the half before the mirror, twice. */
    struct imp_weather_hour kept[HOURS];
    memcpy(kept, hours, sizeof kept);
    for (int i = 0; i < HOURS; i++) hours[i].direct_illuminance = 0;
    const struct imp_annual_point sky = year_of(s, 32768, 1, NULL, NULL);
    memcpy(hours, kept, sizeof kept);
    const double got = y.exposure.value - sky.exposure.value;
    tap_ok(fabs(got / sum - 1) < .03,
           "the sun before a mirror: %.0f of %.0f lx h, %.0f in "
           "the open",
           got, sum, open);
    imp_scene_destroy(s);
}

/* ---- A room -------------------------------------------------------------------------- */

static void hour_by_hour(bool is_long)
{
    static double x[POINTS][HOURS], se[POINTS][HOURS];
    imp_scene *s = scene_of(ctx, "path", SKY ROOM DESK);
    struct imp_run run = IMP_RUN_INIT;
    double worst = 0, off = 0, all = 0;
    run.spp = 16384;
    test_must(ctx, imp_annual_read(s, &run, HOURS, hours, NULL, NULL, NULL, x[0], se[0]));
    imp_scene_destroy(s);
    int n = 0;
    for (int i = 0; i < HOURS && n < (is_long ? 40 : 8); i++) {
        const struct imp_weather_hour *h = &hours[i];
        if (h->sun[2] < .05 || (n % 2 == 0 && h->direct == 0)) continue;
        n++;
        static char sky[1024];
        const double *d = h->sun, solid = 2 * M_PI * (1 - cos(.004675));
        snprintf(sky, sizeof sky,
                 "<emitter type='perezsky'><float name='diffuse' value='%.12g'/><float "
                 "name='direct' value='%.12g'/><float name='illuminance' value='%.12g'/>"
                 "<vector name='sun_direction' x='%.12g' y='%.12g' z='%.12g'/></emitter>"
                 "<emitter type='sun'><float name='radiance' value='%.12g'/><vector "
                 "name='direction' x='%.12g' y='%.12g' z='%.12g'/></emitter>",
                 h->diffuse, h->direct, h->diffuse_illuminance, d[0], d[1], d[2],
                 h->direct_illuminance / solid, -d[0], -d[1], -d[2]);
        static char all_of[8192];
        snprintf(all_of, sizeof all_of, "%s%s", sky, ROOM DESK);
        s = scene_of(ctx, "path", all_of);
        double value[POINTS], error[POINTS];
        struct imp_estimate mean;
        run.seed = 100 + (uint64_t)i;
        test_must(ctx, imp_grid_read(s, &run, value, error, &mean, NULL));
        for (int p = 0; p < POINTS; p++) {
            const double e = hypot(se[p][i], error[p]);
            /* Reflected sun is a mean over a patch of 6 degrees: here to 4 %. */
            worst = fmax(worst, (fabs(x[p][i] - value[p]) - .04 * value[p]) / e);
            off += x[p][i] - value[p];
            all += value[p];
        }
        imp_scene_destroy(s);
    }
    tap_ok(worst < 6.5, "%d hours by single readings: %.2f standard errors beyond 4 %%",
           n, worst);
    tap_ok(fabs(off) < .01 * all, "and their mean: off by %.2f %%", 100 * off / all);
}

/* ---- The rest ------------------------------------------------------------------------ */

static void threads(void)
{
    struct imp_annual_point point[2][POINTS];
    struct imp_run run = IMP_RUN_INIT;
    imp_context *before = ctx;
    run.spp = 100;
    for (int k = 0; k < 2; k++) {
        ctx = test_context(k ? 3 : 1);
        imp_scene *s = scene_of(ctx, "path", SKY ROOM DESK);
        memset(point[k], 0, sizeof point[k]);
        test_must(ctx, imp_annual_read(s, &run, HOURS, hours, NULL, point[k], NULL, NULL,
                                       NULL));
        imp_scene_destroy(s);
        imp_context_destroy(ctx);
    }
    ctx = before;
    tap_ok(memcmp(point[0], point[1], sizeof point[0]) == 0,
           "the same bits on 3 threads");
}

/* A sky without any shape is even; one of any has the illuminance that it was asked for. */
static void patches(void)
{
    const imp_v3 axis[3] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    struct imp__sky_patches p;
    struct imp__sky_shape sky[IMP__AT_ONCE];
    double level[IMP__AT_ONCE];
    static imp__annual_lanes L[IMP__PATCHES][2];
    double worst = 0, all = 0;
    imp__sky_patches_set(&p, axis);
    for (int t = 0; t < IMP__AT_ONCE; t++) {
        sky[t] =
            (struct imp__sky_shape){.axis = {axis[0], axis[1], axis[2]}, .sun = axis[2]};
        level[t] = 5 * t;
    }
    imp__sky_patches_fill(&p, sky, level, L[0]);
    for (int k = 0; k < IMP__PATCHES; k++) {
        for (int t = 0; t < IMP__AT_ONCE; t++)
            worst = fmax(worst, fabs((double)L[k][0][t] - level[t] / M_PI));
        all += imp__sky_patch_size(&p, k);
    }
    tap_ok(worst < 1e-6 && fabs(all - 2 * M_PI) < 1e-12, "an even sky: %.1e", worst);
    /* Where directions are. */
    const struct imp_key key = imp__key(1, 2, 3);
    double count[IMP__PATCHES] = {0}, chi2 = 0;
    enum { DRAWS = 200000 };
    for (uint32_t i = 0; i < DRAWS; i++) {
        const double z = imp__u01(key, 2 * i), a = 2 * M_PI * imp__u01(key, 2 * i + 1);
        const double r = sqrt(1 - z * z);
        count[imp__sky_patch_of(&p, imp__v3(r * cos(a), r * sin(a), z))]++;
    }
    for (int k = 0; k < IMP__PATCHES; k++) {
        const double wanted = DRAWS * imp__sky_patch_size(&p, k) / (2 * M_PI);
        chi2 += (count[k] - wanted) * (count[k] - wanted) / wanted;
    }
    tap_ok(fabs(chi2 - 576) < 4.5 * sqrt(2 * 576),
           "directions by patches: chi2 %.0f of 576", chi2);
}

static void refuse(const char *inside, const struct imp_weather_hour *h,
                   const struct imp_annual_options *o, const char *word)
{
    imp_scene *s = scene_of(ctx, "path", inside);
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 16;
    const enum imp_status st = imp_annual_read(s, &run, 1, h, o, NULL, NULL, NULL, NULL);
    tap_ok((st == IMP_E_ARG || st == IMP_E_UNSUPPORTED) &&
               strstr(imp_last_error(ctx), word),
           "%s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

static void refused(void)
{
    struct imp_weather_hour h = {2021, 6, 1, 12.5, {0, 0, 1}, 100, 100, 12000, 9000};
    struct imp_annual_options o = IMP_ANNUAL_OPTIONS_INIT;
    o.size = sizeof o;
    refuse("<emitter type='constant'/>" GRID(FILM(1, 1)), &h, NULL, "perezsky or ciesky");
    refuse(SKY "<sensor type='perspective'/>", &h, NULL, "no irradiancemeter");
    o.opens = 13, o.closes = 14;
    refuse(SKY GRID(FILM(1, 1)), &h, &o, "none of the hours");
    o.closes = 12;
    refuse(SKY GRID(FILM(1, 1)), &h, &o, "from hour 13 to 12");
    o = (struct imp_annual_options){.size = sizeof o, .useful = {300, 100, 3000}};
    refuse(SKY GRID(FILM(1, 1)), &h, &o, "do not ascend");
    h.sun[2] = 2;
    refuse(SKY GRID(FILM(1, 1)), &h, NULL, "no unit vector");
    h.sun[2] = 1;
    h.direct_illuminance = -1;
    refuse(SKY GRID(FILM(1, 1)), &h, NULL, "not in [0,");
    h.direct_illuminance = h.diffuse_illuminance = 0;
    refuse(SKY GRID(FILM(1, 1)), &h, NULL, "any daylight");
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    ctx = test_context(0);
    weather_make();
    patches();
    open_air();
    shaft();
    edge();
    behind_glass();
    mirror();
    hour_by_hour(is_long);
    threads();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}
