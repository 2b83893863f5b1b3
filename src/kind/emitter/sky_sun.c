/* SPDX-License-Identifier: Apache-2.0
 *
 * The sun of every kind of sky that has one (sky_sun.h). */
#include "sky_sun.h"
#include "sky_shape.h"
#include "sun.h"

extern const struct imp_emitter_ops imp__sunsky, imp__ciesky, imp__perezsky, imp__sun;

static bool is_shape(const struct imp_emitter *e)
{
    return e->ops == &imp__ciesky || e->ops == &imp__perezsky;
}

bool imp__sky_sun_read(const struct imp_emitter *e, struct imp__sky_sun *out)
{
    *out = (struct imp__sky_sun){.radius = 0};
    if (e->ops == &imp__sunsky) return imp__sunsky_sun_read(e, out);
    if (e->ops == &imp__sun) {
        double size;
        imp__sun_disc(e, &out->towards, &size);
        out->radius = 2 * asin(sqrt(size / (2 * IMP_2PI)));
        out->alone = true;
        return true;
    }
    if (!is_shape(e)) return false;
    const struct imp__sky_shape *s = e->self;
    out->towards = s->sun;
    return !s->overcast && (s->n[2] != 0 || s->n[4] != 0 || e->ops == &imp__perezsky);
}

const char *imp__sky_sun_set(struct imp_emitter *e, const struct imp__sky_sun *sun)
{
    static const char below[] = "puts the sun below the horizon";
    if (e->ops == &imp__sunsky) return imp__sunsky_sun_set(e, sun) ? NULL : below;
    if (!is_shape(e)) {
        imp__sun_radius_set(e, sun->radius);
        return NULL;
    }
    struct imp__sky_shape *s = e->self;
    s->sun = sun->towards;
    if (imp__dot(s->sun, s->axis[2]) < 0) return below;
    s->fit(s);
    return s->factor > 0 && isfinite(s->factor)
               ? NULL
               : "puts the sun where the model has no sky for its numbers";
}

double *imp__sun_radius_at(const struct imp_emitter *e)
{
    return e->ops == &imp__sun ? imp__sun_radius_number(e) : NULL;
}

bool imp__sky_sun_is_clear(const struct imp_emitter *e)
{
    struct imp_sky_circle circle[IMP_SKY_CIRCLES];
    struct imp__sky_sun sun;
    if (!imp__sky_sun_read(e, &sun)) return false;
    if (sun.alone) return true; /* it has no horizon */
    e->ops->jumps(e, circle);
    return asin(imp_clamp(imp__dot(circle[0].axis, sun.towards), -1.0, 1.0)) >
           sun.radius + 1e-4;
}

void imp__sky_part(const struct imp_emitter *e, enum imp__sky_part part, imp_spec *in)
{
    if (part == IMP_SKY_WHOLE) return;
    if (e->ops == &imp__sunsky) imp__sunsky_part(part == IMP_SKY_DISC, in);
    else if ((part == IMP_SKY_DISC) == is_shape(e)) in[0] = imp__spec(0);
}
