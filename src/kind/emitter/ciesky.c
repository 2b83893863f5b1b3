/* SPDX-License-Identifier: Apache-2.0
 *
 * ciesky: the fifteen sky luminance distributions of CIE S 011 (ISO 15469:2004), with Z the angle
 * to the zenith, x that to the sun, Zs the sun's to the zenith:
 *
 *     L/Lz = f(x) g(Z) / (f(Zs) g(0)),   g(Z) = 1 + a exp(b/cos Z),
 *     f(x) = 1 + c (exp(d x) - exp(d pi/2)) + e cos^2 x
 *
 * (types 1 to 15, five numbers each), and type 16, the traditional overcast sky,
 * L/Lz = (1 + 2 cos Z)/3, whose horizontal illuminance is 7 pi/9 Lz. */
#include "emission.h"
#include "sky_shape.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define OVERCAST 16

static const double numbers[15][5] = {
    {4, -.7, 0, -1, 0},       {4, -.7, 2, -1.5, .15},  {1.1, -.8, 0, -1, 0},
    {1.1, -.8, 2, -1.5, .15}, {0, -1, 0, -1, 0},       {0, -1, 2, -1.5, .15},
    {0, -1, 5, -2.5, .3},     {0, -1, 10, -3, .45},    {-1, -.55, 2, -1.5, .15},
    {-1, -.55, 5, -2.5, .3},  {-1, -.55, 10, -3, .45}, {-1, -.32, 10, -3, .45},
    {-1, -.32, 16, -3, .3},   {-1, -.15, 16, -3, .3},  {-1, -.15, 24, -2.8, .15}};

static void fit_now(struct imp__sky_shape *s)
{
    s->factor = s->level / (s->on_ground ? imp__sky_shape_horizontal(s)
                                         : imp__sky_shape_at(s, s->axis[2]));
}

static enum imp_status level_read(const struct imp_build *b, struct imp__sky_shape *s)
{
    enum imp_status st = IMP_OK;
    double zenith, illuminance;
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "zenith", 1, IMP_POSITIVE, &zenith));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "illuminance", 1, IMP_POSITIVE,
                                &illuminance));
    if (imp_build_has(b, "zenith") && imp_build_has(b, "illuminance"))
        IMP_TRY(imp_build_error(b, "illuminance", IMP_E_SCENE,
                                "illuminance = %g and zenith = %g: give one of them",
                                illuminance, zenith));
    s->on_ground = imp_build_has(b, "illuminance");
    s->level = s->on_ground ? illuminance : zenith;
    s->fit = fit_now;
    fit_now(s);
out:
    return st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct imp__sky_shape *s = self;
    bool of_world;
    int64_t sky;
    (void)e;
    IMP_TRY(imp_build_int(b, "sky", OVERCAST, 1, OVERCAST, &sky));
    IMP_TRY(imp__sky_shape_place(b, s, &of_world));
    s->overcast = sky == OVERCAST;
    if (!s->overcast) {
        char what[32];
        memcpy(s->n, numbers[sky - 1], sizeof s->n);
        s->h = exp(s->n[3] * IMP_PI / 2);
        snprintf(what, sizeof what, "type %d", (int)sky);
        if (s->n[2] != 0) IMP_TRY(imp__sky_shape_by_day(b, s, of_world, what));
    }
    IMP_TRY(level_read(b, s));
out:
    return st;
}

const struct imp_emitter_ops imp__ciesky = {IMP__SKY_SHAPE_OPS, .name = "ciesky",
                                            .build = build};
