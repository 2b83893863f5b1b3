/* SPDX-License-Identifier: Apache-2.0
 *
 * EPW weather files: a year that is written here and read back, the sun of known days, illuminances
 * of the file and of the model, leap years; each kind of damage with its line and column. */
#include "format/epw_file.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdarg.h>

static imp_context *ctx;
static char text[4 << 20];
static size_t used;

static void put(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    used += (size_t)vsnprintf(text + used, sizeof text - used, format, args);
    va_end(args);
}

/* What the file is; a row of which one field is another word. */
static struct {
    int february, lux, dark;
    int missing_hour; /* of the year, which is left out; -1: none */
    int row, field;   /* -1: none is changed */
    const char *word;
} make;

static double diffuse_at(int hour) { return hour > 6 && hour < 19 ? 100 + hour : 0; }
static double direct_at(int hour) { return hour > 7 && hour < 18 ? 300 : 0; }

static void write(const char *first_line)
{
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    int n = 0;
    used = 0;
    put("%s\n", first_line);
    put("DESIGN CONDITIONS,0\r\nGROUND TEMPERATURES,0\nDATA PERIODS,1,1,Data,Sunday, "
        "1/ 1,12/31\n");
    for (int month = 1; month <= 12; month++)
        for (int day = 1; day <= (month == 2 ? make.february : days[month - 1]); day++)
            for (int hour = 1; hour <= 24; hour++, n++) {
                char field[35][24];
                if (n == make.missing_hour) continue;
                for (int k = 0; k < 35; k++) snprintf(field[k], 24, "0");
                snprintf(field[0], 24, "2011");
                snprintf(field[1], 24, "%d", month);
                snprintf(field[2], 24, " %d", day);
                snprintf(field[3], 24, "%d ", hour);
                snprintf(field[5], 24, "A7A7A7A7");
                snprintf(field[7], 24, "10.5");
                snprintf(field[14], 24, "%g", make.dark ? 0 : direct_at(hour));
                snprintf(field[15], 24, "%g", make.dark ? 0 : diffuse_at(hour));
                snprintf(field[17], 24, "%g", make.lux ? 95 * direct_at(hour) : 999999);
                snprintf(field[18], 24, "%g", make.lux ? 120 * diffuse_at(hour) : 999999);
                if (n == make.row) snprintf(field[make.field], 24, "%s", make.word);
                for (int k = 0; k < 35; k++) put("%s%s", k ? "," : "", field[k]);
                put("\n");
            }
}

#define TOWN "LOCATION,Town,-,-,-,0,50,10,1,100"

static void reset(void)
{
    make.february = 28;
    make.lux = 1;
    make.dark = 0;
    make.missing_hour = make.row = -1;
}

static enum imp_status parse(struct imp_arena *keep, struct imp_weather *w)
{
    const struct imp_bytes b = {(unsigned char *)text, used, used};
    imp__arena_init(keep, ctx);
    return imp__epw_parse(ctx, keep, "t.epw", &b, w);
}

static void years(void)
{
    for (int leap = 0; leap < 2; leap++) {
        struct imp_arena keep;
        struct imp_weather w;
        reset();
        make.february += leap;
        write(TOWN);
        test_must(ctx, parse(&keep, &w));
        double worst = 0;
        for (size_t i = 0; i < w.info.n; i++) {
            const int hour = (int)(i % 24) + 1;
            const struct imp_weather_hour *h = &w.hour[i];
            worst = fmax(worst, fabs(h->diffuse - diffuse_at(hour)));
            worst = fmax(worst, fabs(h->direct - direct_at(hour)));
            worst = fmax(worst, fabs(h->diffuse_illuminance - 120 * diffuse_at(hour)));
            worst = fmax(worst, fabs(h->hour - hour + .5));
        }
        tap_ok(w.info.n == (leap ? 8784 : 8760) && worst == 0 && !w.info.modelled &&
                   strcmp(w.info.place, "Town") == 0 && w.info.latitude == 50,
               "a year of %zu hours", w.info.n);
        /* 21 June: 90 - 50 + 23.44 degrees high at noon, which is at 12:22 on this clock. */
        const struct imp_weather_hour *noon = &w.hour[(171 + leap) * 24 + 12];
        const double height = asin(noon->sun[2]) * 180 / M_PI;
        tap_ok(noon->month == 6 && noon->day == 21 && fabs(height - 63.4) < .1 &&
                   noon->sun[0] > .44 && fabs(noon->sun[1]) < .05,
               "the sun of a summer's noon: %.2f degrees high", height);
        imp__arena_free(&keep);
    }
}

/* Without illuminances, those of Perez et al. 1990: an hour by hand. */
static void modelled(void)
{
    struct imp_arena keep;
    struct imp_weather w;
    reset();
    make.lux = 0;
    write(TOWN);
    test_must(ctx, parse(&keep, &w));
    const struct imp_weather_hour *h = &w.hour[171 * 24 + 11];
    const double Z = acos(h->sun[2]), cube = 1.041 * Z * Z * Z;
    const double epsilon = ((112. + 300) / 112 + cube) / (1 + cube);
    const double air = 1 / (cos(Z) + .15 * pow(93.885 - Z * 180 / M_PI, -1.253));
    const double delta = air * 112 / 1367, W = exp(.07 * 10.5 - .075);
    const double diffuse = 106.42 + 3.83 * W - 36.15 * cos(Z) - 28.83 * log(delta);
    const double direct = 107.19 - 1.25 * W - 1.51 * exp(5.73 * Z - 5) - 26.73 * delta;
    tap_ok(epsilon > 2.8 && epsilon < 4.5 && w.info.modelled, "bin 6: %.3f", epsilon);
    tap_near(h->diffuse_illuminance, 112 * diffuse, 1e-12, 0, "diffuse");
    tap_near(h->direct_illuminance, 300 * direct, 1e-12, 0, "direct");
    imp__arena_free(&keep);
    /* Illuminances in other units are no illuminances. */
    reset();
    make.row = 10, make.field = 17, make.word = "9e5";
    write(TOWN);
    test_must(ctx, parse(&keep, &w));
    tap_ok(!w.info.modelled && w.hour[10].direct_illuminance == 9e5,
           "one strange hour is the file's");
    imp__arena_free(&keep);
}

static void refused(const char *what, const char *first_line, const char *message)
{
    struct imp_arena keep;
    struct imp_weather w;
    write(first_line);
    const enum imp_status st = parse(&keep, &w);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), message), "%s: %s", what,
           imp_last_error(ctx));
    imp__arena_free(&keep);
}

static void changed(int row, int field, const char *word, const char *message)
{
    reset();
    make.row = row;
    make.field = field;
    make.word = word;
    refused(word, TOWN, message);
}

static void damaged(void)
{
    reset();
    refused("no head", "LAGE,Town", "t.epw:1:1: not a weather file");
    refused("no place", "LOCATION,Town,-,-",
            "t.epw:1:17: the line ends before the latitude");
    refused("latitude", "LOCATION,Town,-,-,-,0,91,10,1,100",
            "t.epw:1:23: the latitude is 91");
    make.missing_hour = 30;
    refused("an hour less", TOWN,
            "t.epw:35:6: hour 8 of 01-02 comes behind hour 6 of 01-02");
    reset();
    make.february = 27;
    refused("a day less", TOWN, "hour 1 of 03-01 comes behind hour 24 of 02-27");
    reset();
    make.missing_hour = 8759;
    refused("the last less", TOWN, "the file has 8759 hours");
    changed(2, 14, "9999",
            "t.epw:7:44: the direct normal radiation is 9999 Wh/m^2: it is missing");
    changed(2, 15, "nan", "t.epw:7:46: the diffuse horizontal radiation");
    changed(2, 15, "x", "the diffuse horizontal radiation: not a number");
    changed(2, 15, "-1", "the diffuse horizontal radiation is -1, not in [0, 9999]");
    changed(2, 3, "25", "t.epw:7:11: the hour is 25");
    changed(2, 3, "2.5", "the hour is 2.5, not whole");
    changed(24 * 31 + 2, 2, "30", "month 2 has no day 30");
    changed(2, 30, "1,1", "t.epw:7:1: a row of 36 fields; the first row has 35");
    reset();
    make.dark = 1;
    refused("a year without sun", TOWN, "no hour has any radiation");
    reset();
    write(TOWN);
    struct imp_arena keep;
    struct imp_weather w;
    used = (size_t)(strstr(text, "DATA") - text);
    tap_ok(parse(&keep, &w) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "ends before its line DATA PERIODS"),
           "%s", imp_last_error(ctx));
    imp__arena_free(&keep);
}

int main(void)
{
    ctx = test_context(1);
    years();
    modelled();
    damaged();
    imp_context_destroy(ctx);
    return tap_done();
}
