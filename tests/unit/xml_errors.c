/* SPDX-License-Identifier: Apache-2.0
 *
 * Scene files: the exact text and place of every error of the grammar. */
#include "imp_tap.h"
#include "scene_parse.h"

#define IN(text) "<scene version='3.0.0'>\n" text "\n</scene>"

static imp_context *ctx;

/* ---- Errors -------------------------------------------------------------------- */

static const struct {
    const char *xml, *message;
} errors[] = {
    {"", "s.xml:1:1: the file holds no scene"},
    {"<scene version='3.0.0'>", "s.xml:1:24: the file ends inside <scene>"},
    {"<scene version='3.0.0'><shape type='cube'></bsdf>",
     "s.xml:1:45: mismatched tag: <shape> is open"},
    {"<scene version='3.0.0'>\n<shape>", "s.xml:2:1: <shape> needs the attribute 'type'"},
    {"<scene version='3.0.0'><a></scene>", "s.xml:1:24: unknown tag <a>"},
    {"<scene/>", "s.xml:1:1: <scene> needs the attribute 'version'"},
    {"<scene version='3'/>", "s.xml:1:1: version '3' is not 'a.b.c'"},
    {"<scene version='3.0.0a'/>", "s.xml:1:1: version '3.0.0a' is not 'a.b.c'"},
    {"<scene version='3.0.0' type='x'/>",
     "s.xml:1:1: <scene> has no attribute 'type' (it has: version id name)"},
    {"<bsdf version='3.0.0' type='diffuse'/>",
     "s.xml:1:1: the root must be a <scene>, not <bsdf>"},
    {"<!DOCTYPE a [<!ENTITY b 'c'>]><scene version='3.0.0'/>",
     "s.xml:1:13: a document type (<!DOCTYPE>) is not allowed"},
    {IN(" <spline/>"), "s.xml:2:2: unknown tag <spline>"},
    {IN("<emitter type='area'><blackbody name='radiance' temperature='5000'/></emitter>"),
     "s.xml:2:22: unknown tag <blackbody>; it is a type: <spectrum type=\"blackbody\">"},
    {IN("<shpae type='cube'/>"), "s.xml:2:1: unknown tag <shpae>; did you mean <shape>?"},
    {IN("<sensor type='perspective'><transform name='to_world'><lookAt/>"),
     "s.xml:2:55: unknown tag <lookAt>; did you mean <lookat>?"},
    {IN("<bsdf type='diffuse' id='metal'/><ref id='metall'/>"),
     "s.xml:2:34: reference to unknown id 'metall'; did you mean 'metal'?"},
    {IN("<bsdf type='diffuse' id='metal'/><alias id='mteal' as='x'/>"),
     "s.xml:2:34: alias of unknown id 'mteal'; did you mean 'metal'?"},
    {IN("<scene version='3.0.0'/>"), "s.xml:2:1: <scene> may only be the root of a file"},
    {IN("<shape type='sphere'>\n  stray</shape>"), "s.xml:3:3: stray text 'stray'"},
    {IN("<shape type='sphere' x='1'/>"),
     "s.xml:2:1: <shape> has no attribute 'x' (it has: type id name)"},
    {IN("<shape type='sphere' version='3.0.0'/>"),
     "s.xml:2:1: <shape> has no attribute 'version' (it has: type id name)"},
    {IN("<integer name='a' value='6x'/>"),
     "s.xml:2:1: integer 'a': '6x' is not an integer"},
    {IN("<integer name='a' value='1.0'/>"),
     "s.xml:2:1: integer 'a': '1.0' is not an integer"},
    {IN("<integer name='a' value='9223372036854775808'/>"),
     "s.xml:2:1: integer 'a': '9223372036854775808' is not an integer"},
    {IN("<integer value='1'/>"), "s.xml:2:1: <integer> needs the attribute 'name'"},
    {IN("<integer name='' value='1'/>"), "s.xml:2:1: empty name"},
    {IN("<float name='a' value='1.5 x'/>"),
     "s.xml:2:1: float 'a': '1.5 x' is not a finite number"},
    {IN("<float name='a' value='nan'/>"),
     "s.xml:2:1: float 'a': 'nan' is not a finite number"},
    {IN("<float name='a' value='1e999'/>"),
     "s.xml:2:1: float 'a': '1e999' is not a finite number"},
    {IN("<float name='a' value='1,5'/>"),
     "s.xml:2:1: float 'a': '1,5' is not a finite number"},
    {IN("<boolean name='a' value='1'/>"),
     "s.xml:2:1: boolean 'a': '1' is not true or false"},
    {IN("<point name='a' x='1' y='2'/>"),
     "s.xml:2:1: point or vector 'a': needs x, y and z, or 'value'"},
    {IN("<point name='a' x='1' y='2' z='3' value='1'/>"),
     "s.xml:2:1: point or vector: either 'value' or x, y, z, not both"},
    {IN("<vector name='a' value='1 2'/>"),
     "s.xml:2:1: point or vector: '1 2' is not one or three finite numbers"},
    {IN("<rgb name='a' value='1,2,3,4'/>"),
     "s.xml:2:1: rgb 'a': '1,2,3,4' is not one or three finite numbers"},
    {IN("<spectrum name='a'/>"),
     "s.xml:2:1: spectrum 'a': needs either 'value' or 'filename'"},
    {IN("<spectrum name='a' value='1' filename='b'/>"),
     "s.xml:2:1: spectrum 'a': needs either 'value' or 'filename'"},
    {IN("<spectrum name='a' value='1 2'/>"),
     "s.xml:2:1: spectrum 'a': '1 2' is not a finite number or a list of "
     "wavelength:value"},
    {IN("<spectrum name='a' value='400:1'/>"),
     "s.xml:2:1: spectrum 'a': a spectrum needs at least two wavelengths"},
    {IN("<spectrum name='a' value='400:1, 400:2'/>"),
     "s.xml:2:1: spectrum 'a': wavelengths must increase: 400 nm does not follow 400 nm"},
    {IN("<spectrum name='a' value='400:1, 500:x'/>"),
     "s.xml:2:1: spectrum 'a': '500:x' is not 'wavelength:value'"},
    {IN("<spectrum name='a' filename='nope.spd'/>"),
     "s.xml:2:1: spectrum 'a': cannot find 'nope.spd' (looked in: .)"},
    {IN("<integer name='a' value='1'/>\n<float name='a' value='1'/>"),
     "s.xml:3:1: scene: 'a' is given twice (first at s.xml:2:1)"},
    {IN("<bsdf type='x' name='a'/>\n<float name='a' value='1'/>"),
     "s.xml:3:1: scene: 'a' is given twice (first at s.xml:2:1)"},
    {IN("<bsdf type='x' id='a'/>\n<bsdf type='y' id='a'/>"),
     "s.xml:3:1: id 'a' is used twice (first at s.xml:2:1)"},
    {IN("<integer name='a' value='1'><float name='b' value='1'/></integer>"),
     "s.xml:2:29: <float> cannot be inside <integer>"},
    {IN("<ref id='a'/>"), "s.xml:2:1: reference to unknown id 'a'"},
    {IN("<bsdf type='x' id='a'><ref id='b'/></bsdf>\n<bsdf type='y' id='b'>"
        "<ref id='a'/></bsdf>"),
     "s.xml:3:23: reference to 'a' makes a cycle"},
    {IN("<bsdf type='x' id='a'>\n <ref id='a'/></bsdf>"),
     "s.xml:3:2: reference to 'a' makes a cycle"},
    {IN("<alias id='a' as='b'/>\n<bsdf type='x' id='a'/>"),
     "s.xml:2:1: alias of unknown id 'a'"},
    {IN("<bsdf type='x' id='a'/><alias id='a' as='a'/>"),
     "s.xml:2:24: id 'a' is used twice (first at s.xml:2:1)"},
    {IN("<integer name='a' value='$spp'/>"),
     "s.xml:2:1: parameter '$spp' has no value (<default> or -D)"},
    {IN("<default name='' value='1'/>"), "s.xml:2:1: default: empty name"},
    {IN("<shape type='s'><path value='x'/></shape>"),
     "s.xml:2:17: <path> belongs in the root of a file"},
    {IN("<path value='no/such'/>"), "s.xml:2:1: cannot find 'no/such' (looked in: .)"},
    {IN("<include filename='no.xml'/>"),
     "s.xml:2:1: cannot find 'no.xml' (looked in: .)"},
    {IN("<translate x='1'/>"), "s.xml:2:1: <translate> cannot be inside <scene>"},
    {IN("<transform name='t'><integer name='a' value='1'/></transform>"),
     "s.xml:2:21: <integer> cannot be inside <transform>"},
    {IN("<transform name='t'><shape type='a'/></transform>"),
     "s.xml:2:21: <shape> cannot be inside <transform>"},
    {IN("<transform name='t'><rotate x='1'/></transform>"),
     "s.xml:2:21: <rotate> needs the attribute 'angle'"},
    {IN("<transform name='t'><rotate angle='30'/></transform>"),
     "s.xml:2:21: rotate: the axis is zero"},
    {IN("<transform name='t'><matrix value='1 2 3'/></transform>"),
     "s.xml:2:21: matrix: needs 16 or 9 finite numbers"},
    {IN("<transform name='t'><scale value='1' x='2'/></transform>"),
     "s.xml:2:21: scale: either 'value' or x, y, z, not both"},
    {IN("<transform name='t'><lookat origin='0 0 0' target='0 0 1' up='0 0 "
        "2'/></transform>"),
     "s.xml:2:21: lookat: origin and target are equal, or up is parallel to the view"},
    {IN("<transform name='t'><lookat origin='0 0 0' target='0 0 0'/></transform>"),
     "s.xml:2:21: lookat: origin and target are equal, or up is parallel to the view"},
    {IN("<transform name='t'><scale value='1e200'/><scale value='1e200'/></transform>"),
     "s.xml:2:43: the transform is not finite"},
    {IN("<shape type='a' type='b'/>"), "s.xml:2:17: duplicate attribute"},
    {IN("&bomb;"), "s.xml:2:1: undefined entity"},
};

static void check_errors(void)
{
    for (size_t i = 0; i < imp_count(errors); i++) {
        struct imp_scene scene;
        const enum imp_status st =
            parse_open(ctx, errors[i].xml, strlen(errors[i].xml), "s.xml", NULL, &scene);
        const bool ok =
            st != IMP_OK && strcmp(imp_last_error(ctx), errors[i].message) == 0;
        tap_ok(ok, "%s", errors[i].message);
        if (!ok) printf("# status %d, message: %s\n", st, st ? imp_last_error(ctx) : "");
        parse_close(&scene);
    }
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 1;
    check_errors();
    imp_context_destroy(ctx);
    return tap_done();
}
