/* SPDX-License-Identifier: Apache-2.0 */
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
    const double zenith = acos(fmin(fmax(cos(latitude) * cos(turn) * cos(declination) +
                                             sin(declination) * sin(latitude),
                                         -1),
                                    1));
    const double azimuth =
        atan2(-sin(turn), tan(declination) * cos(latitude) - sin(latitude) * cos(turn));
    const double seen = zenith + 6371.01 / 149597890 * sin(zenith); /* parallax */
    return imp__v3(-cos(azimuth) * sin(seen), -sin(azimuth) * sin(seen), cos(seen));
}
