/* SPDX-License-Identifier: Apache-2.0
 *
 * Decisions packed for records (packed.h). */
#include "packed.h"

static unsigned located_kind(const struct imp_located *x, const imp_decided uv[2])
{
    if (x->prim < 0) return IMP_LOCATED_NOWHERE;
    if (memcmp(x->at, uv, sizeof x->at) != 0) return IMP_LOCATED_WHOLE;
    return x->prim == 0 ? IMP_LOCATED_UV : IMP_LOCATED_PRIM_UV;
}

struct imp_packed_head imp__packed_head(const struct imp_decision *d)
{
    struct imp_packed_head h;
    memset(&h, 0, sizeof h);
    h.shape = d->shape;
    h.scatterer = d->scatterer & 7;
    h.connection = d->connection & 3;
    h.glows = d->glows;
    h.goes_on = d->goes_on;
    h.back = d->back;
    h.located = located_kind(&d->located, d->uv) & 3;
    h.placed = d->place != 0;
    h.rare = d->passes != 1 || d->glow_weight != 1;
    h.met = d->met.emitter >= 0;
    h.lit = d->connection != IMP_NOT_CONNECTED;
    if (h.lit) h.lit_located = located_kind(&d->light.located, d->light.uv) & 3;
    if (!d->goes_on) return h;
    h.lobe = (uint8_t)d->lobe;
    h.drawn = d->drawn;
    h.alone = d->alone;
    h.mixed = d->share != 1 || d->rest != 0;
    return h;
}

static uint32_t *put(uint32_t *words, const void *data, size_t n)
{
    memcpy(words, data, 4 * n);
    return words + n;
}
static uint32_t *located_put(uint32_t *words, unsigned kind, const struct imp_located *x)
{
    if (kind >= IMP_LOCATED_PRIM_UV) words = put(words, &x->prim, 1);
    return kind == IMP_LOCATED_WHOLE ? put(words, x->at, 2) : words;
}

size_t imp__packed_put(const struct imp_decision *d, uint32_t *words)
{
    const struct imp_packed_head h = imp__packed_head(d);
    uint32_t *at = put(words, &h, 2);
    at = put(at, IMP_PACKED_FROM(d, uv), 5);
    if (h.scatterer != IMP_AT_SKY) at = put(at, d->wo, 3);
    if (h.goes_on) at = put(at, IMP_PACKED_FROM(d, wi), 5);
    if (h.mixed) at = put(at, IMP_PACKED_FROM(d, share), 2);
    if (h.rare) at = put(at, IMP_PACKED_FROM(d, passes), 2);
    at = located_put(at, h.located, &d->located);
    if (h.placed) at = put(at, &d->place, 1);
    if (h.met) at = put(at, &d->met, IMP_PACKED_MET);
    if (h.lit) {
        at = put(at, &d->light, IMP_PACKED_LIGHT);
        at = located_put(at, h.lit_located, &d->light.located);
    }
    return (size_t)(at - words);
}
