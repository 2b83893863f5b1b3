/* SPDX-License-Identifier: Apache-2.0
 *
 * The sun's direction from date, time and place by the algorithm of Blanco-Muriel et al. (2001), or
 * as the scene gives it. */
#include "sun_position.h"
#include <math.h>

#define DEGREE (IMP_PI / 180)

/* Days since noon of 2000-01-01, universal time. */
static double days_since_2000(const struct imp__sun_date *d, double hours)
{
    const long leap =
        (d->month - 14) / 12; /* January and February count as last year's */
    const long day = 1461 * (d->year + 4800 + leap) / 4 +
                     367 * (d->month - 2 - 12 * leap) / 12 -
                     3 * ((d->year + 4900 + leap) / 100) / 4 + d->day - 32075;
    return (double)day - 0.5 + hours / 24 - 2451545;
}

imp_v3 imp__sun_direction(const struct imp__sun_date *d)
{
    const double hours = d->hour - d->timezone + (d->minute + d->second / 60) / 60;
    const double n = days_since_2000(d, hours);

    /* On the ecliptic. */
    const double omega = 2.1429 - 0.0010394594 * n;
    const double mean = 4.8950630 + 0.017202791698 * n;
    const double anomaly = 6.2400600 + 0.0172019699 * n;
    const double l = mean + 0.03341607 * sin(anomaly) + 0.00034894 * sin(2 * anomaly) -
                     0.0001134 - 0.0000203 * sin(omega);
    const double tilt = 0.4090928 - 6.2140e-9 * n + 0.0000396 * cos(omega);

    /* On the sky of the earth's centre, and then of the place. */
    const double ascension = atan2(cos(tilt) * sin(l), cos(l));
    const double declination = asin(sin(tilt) * sin(l));
    const double greenwich = 6.6974243242 + 0.0657098283 * n + hours;
    const double turn = (greenwich * 15 + d->longitude) * DEGREE - ascension;
    const double latitude = d->latitude * DEGREE;
    const double zenith =
        acos(imp_min(imp_max(cos(latitude) * cos(turn) * cos(declination) +
                                 sin(declination) * sin(latitude),
                             -1.0),
                     1.0));
    const double azimuth =
        atan2(-sin(turn), tan(declination) * cos(latitude) - sin(latitude) * cos(turn));
    const double seen = zenith + 6371.01 / 149597890 * sin(zenith); /* parallax */
    return imp__v3(-cos(azimuth) * sin(seen), -sin(azimuth) * sin(seen), cos(seen));
}

static int days_of(int year, int month)
{
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    const bool leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    return days[month - 1] + (month == 2 && leap);
}

/* Clocks are up to three hours from the sun's, in the west of China and, by summer time, of
 * Alaska. A time zone of 0 that is given is universal time, which is right everywhere. */
#define CLOCK_OFF_MOST 3.5
static void clock_check(const struct imp_build *b, const struct imp__sun_date *d)
{
    if (d->timezone == 0 && imp_build_has(b, "timezone")) return;
    const double off = remainder(d->timezone - d->longitude / 15, 24);
    if (fabs(off) <= CLOCK_OFF_MOST) return;
    char where[512];
    imp__warn(
        b->ctx,
        "%s: emitter '%s' (%s): clocks of time zone %g are %.2g hours %s the sun of "
        "longitude %g: do they belong together?",
        imp__loc_text(b->node->loc, where, sizeof where), b->node->id ? b->node->id : "",
        b->node->type, d->timezone, fabs(off), off > 0 ? "ahead of" : "behind",
        d->longitude);
}

/* Half a place: the other half is in Tokyo. */
static void place_check(const struct imp_build *b)
{
    const bool north = imp_build_has(b, "latitude"), east = imp_build_has(b, "longitude");
    if (north == east) return;
    char where[512];
    imp__warn(b->ctx, "%s: emitter '%s' (%s): it has no %s, and Tokyo's is taken%s",
              imp__loc_text(b->node->loc, where, sizeof where),
              b->node->id ? b->node->id : "", b->node->type,
              north ? "longitude" : "latitude",
              north && !imp_build_has(b, "timezone") ? ", with its time zone" : "");
}

static enum imp_status date_read(const struct imp_build *b, imp_v3 *sun)
{
    enum imp_status st = IMP_OK;
    static const struct imp_interval sixty = {0, 60, IMP_CLOSED};
    struct imp__sun_date d;
    int64_t year, month, day;
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "latitude", 35.6894,
                                (struct imp_interval){-90, 90, IMP_CLOSED}, &d.latitude));
    IMP_TRY(imp_build_float(b, "longitude", 139.6917, &d.longitude));
    IMP_TRY(imp_build_float(b, "timezone", 9, &d.timezone));
    IMP_TRY(imp_build_int(b, "year", 2010, 1900, 2100, &year));
    IMP_TRY(imp_build_int(b, "month", 7, 1, 12, &month));
    IMP_TRY(imp_build_int(b, "day", 10, 1, 31, &day));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "hour", 15,
                                (struct imp_interval){0, 24, IMP_CLOSED}, &d.hour));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "minute", 0, sixty, &d.minute));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "second", 0, sixty, &d.second));
    d.year = (int)year;
    d.month = (int)month;
    d.day = (int)day;
    if (d.day > days_of(d.year, d.month))
        IMP_TRY(imp_build_error(b, "day", IMP_E_SCENE, "month %d of %d has no day %d",
                                d.month, d.year, d.day));
    place_check(b);
    clock_check(b, &d);
    *sun = imp__sun_direction(&d);
out:
    return st;
}

enum imp_status imp__sun_read(const struct imp_build *b, imp_v3 *sun, bool *of_world)
{
    static const char *const times[] = {"latitude", "longitude", "timezone",
                                        "year",     "month",     "day",
                                        "hour",     "minute",    "second"};
    enum imp_status st = IMP_OK;
    double d[3];
    *of_world = imp_build_has(b, "sun_direction");
    if (!*of_world) return date_read(b, sun);
    for (size_t k = 0; k < sizeof times / sizeof *times; k++)
        if (imp_build_has(b, times[k]))
            IMP_TRY(
                imp_build_error(b, times[k], IMP_E_SCENE,
                                "give sun_direction, or a place and a time, not both"));
    IMP_TRY(imp_build_vector(b, "sun_direction", (double[3]){0, 0, 1}, d));
    *sun = imp__v3(d[0], d[1], d[2]);
    const double length = imp__length(*sun);
    if (!(length > 0) || !isfinite(length))
        IMP_TRY(imp_build_error(b, "sun_direction", IMP_E_SCENE,
                                "sun_direction has length %g", length));
    *sun *= imp__spec(1 / length);
out:
    return st;
}
