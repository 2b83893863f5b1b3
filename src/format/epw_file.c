/* SPDX-License-Identifier: Apache-2.0
 *
 * EPW (Crawley, Hand and Lawrie 1999; EnergyPlus, "Auxiliary Programs"): lines of fields between
 * commas. A head of eight lines,
 *
 *     LOCATION,city,state,country,source,station,latitude,longitude,time zone,elevation
 *     ...
 *     DATA PERIODS,periods,records an hour,...
 *
 * and a row for each hour, of which count here, from 1
 *
 *     1-4  year, month, day, hour 1 to 24, which ends at that time
 *     8    dew point, degrees Celsius; 99.9: missing
 *     15   direct normal radiation, Wh/m^2; 9999: missing
 *     16   diffuse horizontal radiation, Wh/m^2; 9999: missing
 *     18   direct normal illuminance, lx; 999900 or more: missing
 *     19   diffuse horizontal illuminance, lx
 *
 * Rows of a typical year have the years of the months that it is made of; February has 28 or 29
 * days. The sun is that of the middle of the hour. */
#include "epw_file.h"
#include "base/arguments.h"
#include "base/number.h"
#include "kind/emitter/perezsky.h"
#include "kind/emitter/sun_position.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#define BYTES_MAX    ((size_t)1 << 26)
#define FIELDS_LEAST 19 /* the last that is read */
#define FIELDS_MAX   64
#define HOURS_MAX    8784
#define NO_DEW       10 /* degrees Celsius, where the file has none */
/* Direct radiation, Wh/m^2, of an hour in which the sun is below the horizon from its beginning to its
 * end: in half an hour it rises by 7.5 degrees at most. */
#define DARK_DIRECT 20
#define DARK_HEIGHT (-0.1305)
/* lm/W over a year: outside of these a file's illuminances are in other units. */
#define EFFICACY_LEAST 60
#define EFFICACY_MOST  180

struct reader {
    imp_context *ctx;
    const char *name, *at, *end; /* what is left of the file */
    int line;
    struct field {
        const char *at, *end;
        int column; /* from 1 */
    } field[FIELDS_MAX];
    int n;
};

static enum imp_status IMP_PRINTF(3, 4)
    fail(const struct reader *r, int field, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(r->ctx, IMP_E_SCENE, "%s:%d:%d: %s", r->name, imp_max(r->line, 1),
                      field < r->n ? r->field[field].column : 1, text);
}

/* The next line as fields, without spaces around them; false at the end of the file. Fields
 * beyond FIELDS_MAX are counted. */
static bool next(struct reader *r)
{
    if (r->at == r->end) return false;
    const char *p = r->at, *line = p;
    r->line++;
    r->n = 0;
    for (;;) {
        const char *from = p;
        while (p < r->end && *p != ',' && *p != '\n' && *p != '\r') p++;
        const char *to = p;
        while (from < to && (*from == ' ' || *from == '\t')) from++;
        while (to > from && (to[-1] == ' ' || to[-1] == '\t')) to--;
        if (r->n < FIELDS_MAX)
            r->field[r->n] = (struct field){from, to, (int)(from - line) + 1};
        r->n++;
        if (p == r->end || *p != ',') break;
        p++;
    }
    if (p < r->end) p += p + 1 < r->end && p[0] == '\r' && p[1] == '\n' ? 2 : 1;
    r->at = p;
    return true;
}

static bool is_word(const struct reader *r, const char *word)
{
    const struct field *f = &r->field[0];
    const size_t n = (size_t)(f->end - f->at);
    return n == strlen(word) && strncasecmp(f->at, word, n) == 0;
}

static enum imp_status number(const struct reader *r, int field, const char *what,
                              double lo, double hi, double *out)
{
    double x;
    if (field >= r->n)
        return fail(r, r->n - 1, "the line ends before %s, its field %d", what,
                    field + 1);
    const struct field *f = &r->field[field];
    const char *at = f->at;
    if (!imp__number(&at, f->end, &x) || at != f->end)
        return fail(r, field, "%s: not a number", what);
    if (!(x >= lo && x <= hi))
        return fail(r, field, "%s is %g, not in [%g, %g]", what, x, lo, hi);
    *out = x;
    return IMP_OK;
}
static enum imp_status whole(const struct reader *r, int field, const char *what, int lo,
                             int hi, int *out)
{
    double x = 0;
    IMP_CHECKED(number(r, field, what, lo, hi, &x));
    if (x != floor(x)) return fail(r, field, "%s is %g, not whole", what, x);
    *out = (int)x;
    return IMP_OK;
}

/* ---- The head ---------------------------------------------------------------------- */

static enum imp_status location(struct reader *r, struct imp_weather_info *info)
{
    if (!next(r) || !is_word(r, "LOCATION"))
        return fail(r, 0,
                    "not a weather file (EPW): it does not begin with the line LOCATION");
    IMP_CHECKED(number(r, 6, "the latitude", -90, 90, &info->latitude));
    IMP_CHECKED(number(r, 7, "the longitude", -180, 180, &info->longitude));
    IMP_CHECKED(number(r, 8, "the time zone", -12, 14, &info->timezone));
    IMP_CHECKED(number(r, 9, "the elevation", -1000, 9999.9, &info->elevation));
    const struct field *city = &r->field[1];
    size_t n = 0;
    for (const char *c = city->at; c < city->end && n + 1 < sizeof info->place; c++)
        if ((unsigned char)*c >= ' ') info->place[n++] = *c;
    info->place[n] = 0;
    return IMP_OK;
}

static enum imp_status head_read(struct reader *r, struct imp_weather_info *info)
{
    int periods = 0, records = 0;
    IMP_CHECKED(location(r, info));
    do
        if (!next(r)) return fail(r, 0, "the file ends before its line DATA PERIODS");
    while (!is_word(r, "DATA PERIODS"));
    IMP_CHECKED(whole(r, 1, "the number of data periods", 1, 366, &periods));
    IMP_CHECKED(whole(r, 2, "the number of records an hour", 1, 60, &records));
    if (periods != 1 || records != 1)
        return fail(r, periods != 1 ? 1 : 2,
                    "%d periods with %d records an hour: files of one period by hours "
                    "are read",
                    periods, records);
    return IMP_OK;
}

/* ---- Rows -------------------------------------------------------------------------- */

static int days_of(int month)
{
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    return days[month - 1];
}

/* Does b begin when a ends? After 28 February comes 29 February or 1 March. */
static bool follows(const struct imp_weather_hour *a, const struct imp_weather_hour *b)
{
    if (a->hour < 23)
        return a->month == b->month && a->day == b->day && b->hour == a->hour + 1;
    if (b->hour != 0.5) return false;
    if (b->month == a->month) return b->day == a->day + 1;
    return b->day == 1 && b->month == a->month % 12 + 1 && a->day >= days_of(a->month);
}

/* What the rows are made of beyond the hours of the answer. */
struct rows {
    int fields;        /* of the first */
    bool missing;      /* an illuminance */
    double lux, watts; /* sums over the rows */
    int dark;          /* hours with direct radiation and no sun */
};

static enum imp_status light(const struct reader *r, int field, const char *what,
                             double *out)
{
    IMP_CHECKED(number(r, field, what, 0, 9999, out));
    if (*out > 2000)
        return fail(r, field, "%s is %g Wh/m^2: %s", what, *out,
                    *out == 9999 ? "it is missing, and nothing replaces it"
                                 : "more than the sun gives");
    return IMP_OK;
}

static enum imp_status row_read(const struct reader *r, const struct imp_weather_info *w,
                                struct rows *all, double *dew, struct imp_weather_hour *h)
{
    int hour = 0;
    if (r->n < FIELDS_LEAST || r->n > FIELDS_MAX || (all->fields && r->n != all->fields))
        return fail(r, 0, "a row of %d fields; %s%d", r->n,
                    all->fields ? "the first row has " : "rows have 35, at least ",
                    all->fields ? all->fields : FIELDS_LEAST);
    all->fields = r->n;
    IMP_CHECKED(whole(r, 0, "the year", 1900, 2100, &h->year));
    IMP_CHECKED(whole(r, 1, "the month", 1, 12, &h->month));
    IMP_CHECKED(whole(r, 2, "the day", 1, 31, &h->day));
    IMP_CHECKED(whole(r, 3, "the hour", 1, 24, &hour));
    if (h->day > days_of(h->month) + (h->month == 2))
        return fail(r, 2, "month %d has no day %d", h->month, h->day);
    h->hour = hour - 0.5;
    IMP_CHECKED(number(r, 7, "the dew point", -100, 100, dew));
    if (*dew > 99) *dew = NO_DEW;
    IMP_CHECKED(light(r, 14, "the direct normal radiation", &h->direct));
    IMP_CHECKED(light(r, 15, "the diffuse horizontal radiation", &h->diffuse));
    IMP_CHECKED(
        number(r, 17, "the direct normal illuminance", 0, 1e7, &h->direct_illuminance));
    IMP_CHECKED(number(r, 18, "the diffuse horizontal illuminance", 0, 1e7,
                       &h->diffuse_illuminance));
    all->missing |= h->direct_illuminance >= 999900 || h->diffuse_illuminance >= 999900;
    all->lux += h->direct_illuminance + h->diffuse_illuminance;
    all->watts += h->direct + h->diffuse;
    const struct imp__sun_date date = {
        w->latitude, w->longitude, w->timezone, h->year, h->month, h->day, h->hour, 0, 0};
    const imp_v3 sun = imp__normalize(imp__sun_direction(&date));
    for (int k = 0; k < 3; k++) h->sun[k] = sun[k];
    all->dark += h->direct > DARK_DIRECT && sun[2] < DARK_HEIGHT;
    return IMP_OK;
}

/* Illuminances by the model, of the weather and the dew points. */
static void model(const struct imp_weather *w, const double *dew)
{
    for (size_t i = 0; i < w->info.n; i++) {
        struct imp_weather_hour *h = &w->hour[i];
        /* Without diffuse light the model has no clearness: as clear as it knows. */
        const struct imp__perez_weather now = {fmax(h->diffuse, 1), h->direct,
                                               IMP__SOLAR_CONSTANT};
        double diffuse, direct;
        imp__perez_efficacy(&now, h->sun[2], dew[i], &diffuse, &direct);
        h->diffuse_illuminance = h->diffuse * diffuse;
        h->direct_illuminance = h->direct * direct;
    }
}

static enum imp_status rows_read(struct reader *r, double *dew, struct imp_weather *w,
                                 struct rows *all)
{
    while (next(r)) {
        if (r->n == 1 && r->field[0].at == r->field[0].end) continue; /* an empty line */
        if (w->info.n == HOURS_MAX)
            return fail(r, 0, "more than %d hours, as a leap year has", HOURS_MAX);
        struct imp_weather_hour *h = &w->hour[w->info.n];
        IMP_CHECKED(row_read(r, &w->info, all, &dew[w->info.n], h));
        if (w->info.n > 0 && !follows(h - 1, h))
            return fail(r, 1,
                        "hour %g of %02d-%02d comes behind hour %g of %02d-%02d: hours "
                        "are missing, or out of order",
                        h->hour + 0.5, h->month, h->day, h[-1].hour + 0.5, h[-1].month,
                        h[-1].day);
        w->info.n++;
    }
    if (w->info.n != 8760 && w->info.n != HOURS_MAX)
        return fail(r, 0, "the file has %zu hours; a year has 8760, or 8784", w->info.n);
    if (!follows(&w->hour[w->info.n - 1], &w->hour[0]))
        return fail(r, 1, "the last hour does not lead to the first: it is not a year");
    return IMP_OK;
}

enum imp_status imp__epw_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *text, struct imp_weather *out)
{
    enum imp_status st = IMP_OK;
    const char *at = (const char *)text->data;
    struct reader r = {.ctx = ctx, .name = name, .at = at, .end = at + text->size};
    struct imp_weather w = {.info = {.size = sizeof w.info}};
    struct rows all = {0, false, 0, 0, 0};
    double *dew = NULL;
    if (text->size >= 3 && memcmp(at, "\xef\xbb\xbf", 3) == 0) r.at += 3;
    IMP_TRY(head_read(&r, &w.info));
    dew = imp__alloc(ctx, HOURS_MAX, sizeof *dew);
    w.hour = imp__arena_take(keep, HOURS_MAX, sizeof *w.hour);
    if (!dew || !w.hour) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", name));
    IMP_TRY(rows_read(&r, dew, &w, &all));
    if (!(all.watts > 0))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: no hour has any radiation", name));
    if (all.dark > 0)
        imp__warn(ctx,
                  "%s: in %d hours it has direct radiation while the sun is below the "
                  "horizon: do latitude %g, longitude %g and time zone %g belong to it?",
                  name, all.dark, w.info.latitude, w.info.longitude, w.info.timezone);
    const double efficacy = all.lux / all.watts;
    w.info.modelled = all.missing || !(all.lux > 0);
    if (!w.info.modelled && !(efficacy >= EFFICACY_LEAST && efficacy <= EFFICACY_MOST)) {
        imp__warn(ctx,
                  "%s: its illuminances are %.3g lm for each W of its radiation, which "
                  "daylight is not: they are made of the radiation",
                  name, efficacy);
        w.info.modelled = true;
    }
    if (w.info.modelled) model(&w, dew);
    *out = w;
out:
    imp__release(ctx, dew);
    return st;
}

enum imp_status imp_weather_read(imp_context *context, const char *path,
                                 struct imp_weather_info *info,
                                 struct imp_weather_hour *hour, size_t room)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes text = {0};
    struct imp_arena keep;
    struct imp_weather w;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, path, "path");
    IMP_REQUIRE(context, info, "info");
    if (room > 0) IMP_REQUIRE(context, hour, "hour");
    IMP_SIZED(context, info, "info");
    imp__arena_init(&keep, context);
    IMP_TRY(imp__file_read(context, path, BYTES_MAX, &text));
    IMP_TRY(imp__epw_parse(context, &keep, path, &text, &w));
    for (size_t i = 0; i < imp_min(room, w.info.n); i++) hour[i] = w.hour[i];
    st = imp__info_give(context, __func__, "info", info, &w.info, sizeof w.info);
out:
    imp__arena_free(&keep);
    imp__bytes_free(context, &text);
    return st;
}
