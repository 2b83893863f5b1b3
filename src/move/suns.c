/* SPDX-License-Identifier: Apache-2.0
 *
 * Copies of a sky with its sun beside its place (suns.h). */
#include "suns.h"
#include "base/context.h"
#include "math/transform.h"
#include <string.h>

static imp_v3 sun_at(const struct imp__suns *s, int i, int j)
{
    const double by = j ? IMP_SUNS_BESIDE : -IMP_SUNS_BESIDE;
    return s->towards * cos(by) + s->across[i] * sin(by);
}

static double radius_at(const struct imp__suns *s, int j)
{
    return s->radius * (j ? 1 + IMP_SUNS_WIDER : 1 - IMP_SUNS_WIDER);
}

enum imp_status imp__suns_make(imp_context *ctx, const struct imp_emitter *e,
                               enum imp__move_kind kind, struct imp__suns **out)
{
    const int first = kind == IMP_MOVE_DISC ? IMP_SUNS_WIDTH : 0,
              until = kind == IMP_MOVE_DISC ? IMP_SUNS_WAYS : IMP_SUNS_WIDTH;
    const size_t size = e->ops->object_size, align = _Alignof(max_align_t),
                 each = (size + align - 1) / align * align,
                 head = (sizeof **out + align - 1) / align * align;
    struct imp__suns *s = imp__alloc(ctx, 1, head + 2 * IMP_SUNS_WAYS * each);
    struct imp__sky_sun sun;
    if (!s) return imp__error(ctx, IMP_E_NOMEM, "no memory for a sun that moves");
    imp__sky_sun_read(e, &sun);
    const struct imp_frame f = imp__frame_from_normal(sun.towards);
    s->towards = sun.towards;
    s->across[0] = f.s;
    s->across[1] = f.t;
    s->radius = sun.radius;
    for (int k = 2 * first; k < 2 * until; k++) {
        struct imp_emitter *beside = &s->beside[k / 2][k % 2];
        struct imp__sky_sun there = sun;
        *beside = *e;
        beside->self = (char *)s + head + (size_t)k * each;
        memcpy(beside->self, e->self, size);
        if (first) there.radius = radius_at(s, k % 2);
        else there.towards = sun_at(s, k / 2, k % 2);
        const char *wrong = imp__sky_sun_set(beside, &there);
        if (!wrong) continue;
        imp__release(ctx, s);
        return imp__error(ctx, IMP_E_NUMERIC,
                          "derivatives by the sun of light '%s' (%s), which beside its "
                          "place %s",
                          e->name, e->ops->name, wrong);
    }
    *out = s;
    return IMP_OK;
}

const struct imp__mover *imp__sun_mover(const struct imp__moves *moves, int emitter,
                                        enum imp__move_kind kind)
{
    for (int k = 0; k < moves->n_movers; k++)
        if (moves->mover[k].shape == IMP_MOVE_EMITTER(emitter) &&
            moves->mover[k].kind == kind)
            return &moves->mover[k];
    return NULL;
}

/* cos g' = 1 - 2 sin^2(g'/2), and the part across the axis as long as sin g'. */
static imp_v3 widened(const struct imp__suns *s, int j, imp_v3 w)
{
    const imp_v3 chord = w - s->towards,
                 across = w - s->towards * imp__dot(s->towards, w);
    const double ratio =
                     sin(radius_at(s, j) / 2) / sin(s->radius / 2), /* 4 sin^2(g'/2): */
        square = imp_min(imp__dot(chord, chord) * ratio * ratio, 4.0),
                 sine = sqrt(square * (1 - square / 4)), length = imp__length(across);
    if (!(length > 0)) return w;
    return s->towards * (1 - square / 2) + across * (sine / length);
}

imp_v3 imp__suns_turned(const struct imp__suns *s, int i, int j, imp_v3 w)
{
    if (i == IMP_SUNS_WIDTH) return widened(s, j, w);
    const double by = j ? IMP_SUNS_BESIDE : -IMP_SUNS_BESIDE;
    const imp_v3 axis = imp__cross(s->towards, s->across[i]);
    return w * cos(by) + imp__cross(axis, w) * sin(by) +
           axis * (imp__dot(axis, w) * (1 - cos(by)));
}
