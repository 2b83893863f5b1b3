/* SPDX-License-Identifier: Apache-2.0
 *
 * Media that no light sample leaves (scene/sealed.h): which are, which are not, and that a lamp
 * which comes in is seen. */
#include "scene/sealed.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/pose.h"

static imp_context *ctx;

#define MILK                                                                             \
    "<medium type='homogeneous' id='milk'><float name='sigma_t' value='3'/>"             \
    "<float name='albedo' value='.9'/></medium>"
#define CAMERA                                                                           \
    "<sensor type='perspective'><float name='fov' value='40'/>"                          \
    "<transform name='to_world'><lookat origin='0,0,9' target='0,0,0' up='0,1,0'/>"      \
    "</transform><film type='hdrfilm'><integer name='width' value='8'/>"                 \
    "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"
#define LAMP(x)                                                                          \
    "<shape type='sphere' id='lamp'><point name='center' x='" x "' y='0' z='0'/>"        \
    "<float name='radius' value='.2'/><emitter type='area'>"                             \
    "<float name='radiance' value='5'/></emitter></shape>"
#define SKY    "<emitter type='constant'><float name='radiance' value='.1'/></emitter>"
#define IN     "<ref id='milk' name='interior'/>"
#define GLASS  "<bsdf type='dielectric'/>" IN
#define TURNED "<transform name='to_world'><rotate x='1' y='.3' angle='30'/></transform>"

static imp_scene *scene_of(const char *body)
{
    char text[4096];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'>"
             "<integer name='max_depth' value='40'/></integrator>" MILK CAMERA "%s"
             "</scene>",
             body);
    return test_scene_text(ctx, text, IMP_MONO);
}

static bool is_sealed(const imp_scene *s) { return imp__is_sealed(s, s->media[0]); }

static void kinds(void)
{
    static const struct {
        const char *what, *body;
        bool sealed;
    } rows[] = {
        {"a ball of glass under a sky", "<shape type='sphere'>" GLASS "</shape>" SKY,
         true},
        {"a cube, turned, beside a lamp",
         "<shape type='cube'>" TURNED GLASS "</shape>" LAMP("3") SKY, true},
        {"two balls",
         "<shape type='sphere'>" GLASS "</shape><shape type='sphere'>"
         "<point name='center' x='2.5' y='0' z='0'/>" GLASS "</shape>" LAMP("-3"),
         true},
        {"a point beside it",
         "<shape type='sphere'>" GLASS "</shape><emitter type='point'>"
         "<point name='position' x='0' y='4' z='0'/></emitter>",
         true},
        {"rough glass",
         "<shape type='sphere'><bsdf type='roughdielectric'/>" IN "</shape>" LAMP("3"),
         true},
        {"milk around a bubble with the camera",
         "<shape type='sphere'><boolean name='flip_normals' value='true'/>"
         "<float name='radius' value='20'/>" GLASS "</shape>" LAMP("30"),
         false},
        {"the same of a cube",
         "<shape type='cube'><boolean name='flip_normals' value='true'/>"
         "<transform name='to_world'><scale value='20'/></transform>" GLASS
         "</shape>" LAMP("30"),
         false},
        {"a lamp inside", "<shape type='sphere'>" GLASS "</shape>" LAMP(".1"), false},
        {"a lamp in its box", "<shape type='sphere'>" GLASS "</shape>" LAMP("1.1"),
         false},
        {"a point inside",
         "<shape type='sphere'>" GLASS "</shape><emitter type='point'>"
         "<point name='position' x='0' y='.4' z='0'/></emitter>",
         false},
        {"a boundary that is passed",
         "<shape type='sphere'><bsdf type='null'/>" IN "</shape>" LAMP("3"), false},
        {"a thin pane",
         "<shape type='sphere'><bsdf type='thindielectric'/>" IN "</shape>" LAMP("3"),
         false},
        {"a mask",
         "<shape type='sphere'><bsdf type='mask'><float name='opacity' value='.5'/>"
         "<bsdf type='diffuse'/></bsdf>" IN "</shape>" LAMP("3"),
         false},
        {"an open surface", "<shape type='rectangle'>" GLASS "</shape>" LAMP("3"), false},
        {"a ball and an open surface",
         "<shape type='sphere'>" GLASS
         "</shape><shape type='disk'><transform name='to_world'>"
         "<translate y='3'/></transform>" GLASS "</shape>" LAMP("3"),
         false},
        {"milk around a ball",
         "<shape type='sphere'>" GLASS "</shape><shape type='sphere'>"
         "<point name='center' x='4' y='0' z='0'/><float name='radius' value='.5'/>"
         "<bsdf type='dielectric'/><ref id='milk' name='exterior'/></shape>" LAMP("-3"),
         false},
        {"instances",
         "<shape type='shapegroup' id='g'><shape type='sphere'>" GLASS
         "</shape></shape><shape type='instance'><ref id='g'/></shape>" LAMP("3"),
         false},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        imp_scene *s = scene_of(rows[k].body);
        tap_ok(is_sealed(s) == rows[k].sealed, "%s: %s", rows[k].what,
               rows[k].sealed ? "sealed" : "not sealed");
        imp_scene_destroy(s);
    }
}

static void lamp_move(imp_scene *s, double x)
{
    const double pose[6] = {x};
    size_t param;
    test_must(ctx, imp_scene_find_param(s, "lamp.pose", &param));
    test_must(ctx, imp_scene_set_values(s, param, 6, pose));
    test_must(ctx, imp__poses_settle(s));
}

/* A lamp comes in and goes out. */
static void moves(void)
{
    imp_scene *s = scene_of("<shape type='sphere'>" GLASS "</shape>" LAMP("3"));
    test_must(ctx, imp_scene_add_pose(s, "lamp"));
    tap_ok(is_sealed(s), "the lamp stands outside");
    lamp_move(s, -3);
    tap_ok(!is_sealed(s), "it has come in");
    lamp_move(s, -6);
    tap_ok(is_sealed(s), "it has gone through");
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(1);
    kinds();
    moves();
    imp_context_destroy(ctx);
    return tap_done();
}
