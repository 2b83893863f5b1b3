/* SPDX-License-Identifier: Apache-2.0
 *
 * A point that radiates alike in all directions: irradiance I/r^2 across the ray. */
#include "emission.h"
#include "from_point.h"
#include "math/transform.h"

enum { INTENSITY };

struct point {
    imp_v3 position;
};

static const struct imp_input_desc inputs[] = {
    {.name = "intensity", .role = IMP_EMISSION, .fallback = 1, .unit = "W sr^-1"}, {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct point *p = self;
    struct imp_mat4 to_world;
    double at[3];

    if (imp_build_has(b, "position") && imp_build_has(b, "to_world"))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "give position or to_world, not both"));
    if (e->n_in > INTENSITY && e->input[INTENSITY]->texture)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "intensity cannot be a texture: a point has no surface"));
    IMP_TRY(imp_build_vector(b, "position", (double[3]){0, 0, 0}, at));
    IMP_TRY(imp_build_transform(b, "to_world", to_world.m));
    if (!imp__mat4_is_finite(&to_world) || !imp__mat4_is_affine(&to_world))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is not finite and affine"));
    p->position = imp__point(&to_world, imp__v3(at[0], at[1], at[2]));
out:
    return st;
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    (void)e;
    *le = in[INTENSITY] * (1 / (x->dist * x->dist));
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    (void)e, (void)in;
    dle[INTENSITY] = imp__spec(1 / (x->dist * x->dist));
}
static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    (void)u;
    const struct point *p = e->self;
    return imp__point_light_sample(p->position, *ref, out);
}

static bool emission_sample(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out)
{
    (void)scene;
    const struct point *p = e->self;
    imp__point_emission_sample(p->position, u, out);
    return true;
}

static void aim(struct imp_emitter *e, double v[3], bool set)
{
    struct point *p = e->self;
    if (set) p->position = imp__v3(v[0], v[1], v[2]);
    for (int k = 0; k < 3; k++) v[k] = p->position[k];
}

const struct imp_emitter_ops imp__point_light = {.size = sizeof(struct imp_emitter_ops),
                                                 .name = "point",
                                                 .object_size = sizeof(struct point),
                                                 .flags = IMP_EMITTER_DELTA,
                                                 .inputs = inputs,
                                                 .build = build,
                                                 .eval = eval,
                                                 .eval_d = eval_d,
                                                 .sample = sample,
                                                 .pdf = imp__point_light_pdf,
                                                 .sample_emission = emission_sample,
                                                 .pdf_emission = imp__point_emission_pdf,
                                                 .aim = aim};
