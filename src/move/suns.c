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

enum imp_status imp__suns_make(imp_context *ctx, const struct imp_emitter *e,
                               struct imp__suns **out)
{
    const size_t size = e->ops->object_size, align = _Alignof(max_align_t),
                 each = (size + align - 1) / align * align,
                 head = (sizeof **out + align - 1) / align * align;
    struct imp__suns *s = imp__alloc(ctx, 1, head + 4 * each);
    struct imp__sky_sun sun;
    if (!s) return imp__error(ctx, IMP_E_NOMEM, "no memory for a sun that moves");
    imp__sky_sun_read(e, &sun);
    const struct imp_frame f = imp__frame_from_normal(sun.towards);
    s->towards = sun.towards;
    s->across[0] = f.s;
    s->across[1] = f.t;
    for (int k = 0; k < 4; k++) {
        struct imp_emitter *beside = &s->beside[k / 2][k % 2];
        *beside = *e;
        beside->self = (char *)s + head + (size_t)k * each;
        memcpy(beside->self, e->self, size);
        sun.towards = sun_at(s, k / 2, k % 2);
        imp__sky_sun_set(beside, &sun); /* it is above the horizon by more than that */
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

imp_v3 imp__suns_turned(const struct imp__suns *s, int i, int j, imp_v3 w)
{
    const double by = j ? IMP_SUNS_BESIDE : -IMP_SUNS_BESIDE;
    const imp_v3 axis = imp__cross(s->towards, s->across[i]);
    return w * cos(by) + imp__cross(axis, w) * sin(by) +
           axis * (imp__dot(axis, w) * (1 - cos(by)));
}
