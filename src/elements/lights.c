/* SPDX-License-Identifier: Apache-2.0
 *
 * What polygons emit: the scene's area lights and beams, and Stam's ambient terms. What
 * depends on place or direction in ways that finite elements cannot hold is refused, by
 * the shape's name. */
#include "elements.h"

static double channels_apart(imp_spec a, imp_spec b, int ch)
{
    double d = 0;
    for (int c = 0; c < ch; c++) d = fmax(d, fabs(a[c] - b[c]) / (1e-12 + fabs(a[c])));
    return d;
}

static void light_set(struct imp__el_root *r, const struct imp_input *in,
                      const char *name)
{
    r->light = EL_UNIFORM;
    r->light_param = in->param;
    r->light_count = in->count;
    r->light_name = name;
    for (int c = 0; c < 3; c++) r->light_value[c] = r->radiance[c] = in->value[c];
}

enum imp_status imp__el_emitter_take(imp_elements *e, const struct imp_shape *s,
                                     struct imp__el_root *r)
{
    const struct imp_emitter *em = e->scene->emitters[s->emitter];
    bool textured = em->n_in < 1;
    for (int j = 0; j < em->n_in; j++) textured |= em->input[j]->texture != NULL;
    if (textured)
        return imp__error(
            e->ctx, IMP_E_UNSUPPORTED,
            "shape '%s': its light (%s) has a texture, which finite elements "
            "cannot project",
            s->name, em->ops->name);
    imp_spec in[IMP_INPUTS_MAX];
    imp__inputs_eval(em->input, em->n_in, &(struct imp_texcoord){.uv = {0.5, 0.5}}, in);
    if (em->ops->lobe) {
        light_set(r, em->input[0], em->name);
        r->light = EL_LOBE;
        const int exponent = em->ops->lobe(em, &r->frame.n, &r->axis);
        r->power_input = em->input[exponent];
        r->power = in[exponent][0];
        return IMP_OK;
    }
    if (em->ops->profile) {
        light_set(r, em->input[0], em->name);
        r->light = EL_PROFILE;
        r->profiled = em;
        r->power = em->ops->profile->mean(em, &r->frame.n);
        return IMP_OK;
    }
    for (int k = 1; k < 16; k++) {
        const double z = k / 16.0, x = sqrt(1 - z * z);
        const struct imp_emission at = {.uv = {0.1 * (k % 7), 0.06 * k},
                                        .dist = 1,
                                        .cos_light = z,
                                        .d = r->frame.s * (x * cos(k)) +
                                             r->frame.t * (x * sin(k)) + r->frame.n * z};
        imp_spec le;
        em->ops->eval(em, in, &at, &le);
        if (channels_apart(in[0], le, e->ch) > 1e-9)
            return imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "shape '%s': its light (%s) is not the same in all directions and "
                "places; finite elements cannot project it",
                s->name, em->ops->name);
    }
    light_set(r, em->input[0], em->name);
    return IMP_OK;
}

enum imp_status imp__el_ambient_take(imp_elements *e, const struct imp_shape *s,
                                     const struct imp_bsdf *b, bool flipped,
                                     struct imp__el_root *r)
{
    imp_spec in[IMP_INPUTS_MAX], emitted, first = {0}, d[IMP_INPUTS_MAX];
    int source = -1;
    imp__inputs_eval(b->input, b->n_in, &(struct imp_texcoord){.uv = {0.5, 0.5}}, in);
    for (int k = 1; k < 16; k++) {
        const double z = k / 16.0, x = sqrt(1 - z * z);
        const imp_v3 wo = imp__v3(x * cos(k), x * sin(k), flipped ? -z : z);
        b->ops->emit(b, in, &wo, &emitted);
        if (k == 1) first = emitted;
        if (channels_apart(first, emitted, e->ch) > 1e-9)
            return imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "shape '%s': what its material emits "
                "depends on the direction; finite elements cannot project it",
                s->name);
        b->ops->emit_d(b, in, &wo, d);
    }
    for (int j = 0; j < b->n_in; j++)
        if (d[j][0] == 1 && channels_apart(first, in[j], e->ch) == 0) source = j;
    if (source < 0) return IMP_OK; /* nothing comes out on this side */
    if (imp__is_zero(first) && r->light != EL_DARK) return IMP_OK;
    if (r->light != EL_DARK)
        return imp__error(e->ctx, IMP_E_UNSUPPORTED,
                          "shape '%s': light of its own and an ambient term together",
                          s->name);
    light_set(r, b->input[source], b->name);
    return IMP_OK;
}
