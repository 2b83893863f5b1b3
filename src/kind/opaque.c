/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of what kinds of a host get as opaque pointers: a factor over time, a spectrum. */
#include "base/arguments.h"
#include "color/spectrum.h"
#include "math/course.h"
#include <importon/kinds.h>
#include <math.h>

double imp_course_value(const struct imp_course *course, double time)
{
    IMP_REQUIRE_OR(NULL, course, "course", NAN);
    return imp__course_at(course, time);
}

double imp_spectrum_value(const struct imp_spectrum *spectrum, double nm)
{
    IMP_REQUIRE_OR(NULL, spectrum, "spectrum", NAN);
    return imp__spectrum_value(spectrum, nm);
}
