/* SPDX-License-Identifier: Apache-2.0
 *
 * Scene files: what the grammar makes of them (docs/scene-format.md 1), and the exact
 * text and place of every error. */
#include "imp_fail_alloc.h"
#include "imp_tap.h"
#include "scene_parse.h"
#include <sys/stat.h>
#include <unistd.h>

#define IN(text) "<scene version='3.0.0'>\n" text "\n</scene>"

static imp_context *ctx;
static char last_warning[512];

static void on_log(enum imp_log_level level, const char *message, void *payload)
{
    (void)payload;
    if (level == IMP_LOG_WARNING)
        snprintf(last_warning, sizeof last_warning, "%s", message);
}

static enum imp_status parse(const char *xml, const struct imp_load_options *o,
                             struct imp_scene *scene)
{
    return parse_open(ctx, xml, strlen(xml), "s.xml", o, scene);
}

/* ---- What is accepted ---------------------------------------------------------- */

static struct imp_node *child(struct imp_node *n, size_t i)
{
    return i < n->n_children ? n->children[i].node : NULL;
}

static void check_values(void)
{
    struct imp_scene s;
    const enum imp_status st =
        parse(IN("<!-- comment --><?pi x?><shape type='sphere' id='ball'>"
                 "<integer name='i' value=' -42 '/><float name='f' value=' +1.5e-3 '/>"
                 "<boolean name='b' value='TRUE'/><string name='s' value='a &lt; b'/>"
                 "<point name='p' x='1' y='2' z='3'/><vector name='v' value='4'/>"
                 "<vector name='w' value='1,2 , 3'/><rgb name='c' value='0.25'/>"
                 "<spectrum name='u' value='0.5'/><spectrum name='l' value='400:1, 500:2 "
                 "600:.5,'/>"
                 "<spectrum type='d65' name='d'/></shape>"),
              NULL, &s);
    if (!tap_ok(st == IMP_OK, "all properties are read # %s",
                st ? imp_last_error(ctx) : ""))
        return;
    struct imp_node *n = child(s.root, 0);
    const struct imp_prop *p = imp__node_prop(n, "i");
    tap_ok(p->type == IMP_PROP_INTEGER && p->integer == -42, "integer");
    p = imp__node_prop(n, "f");
    tap_ok(p->type == IMP_PROP_FLOAT && p->number[0] == 1.5e-3, "float");
    tap_ok(imp__node_prop(n, "b")->integer == 1, "boolean");
    tap_ok(strcmp(imp__node_prop(n, "s")->string, "a < b") == 0, "string");
    p = imp__node_prop(n, "p");
    tap_ok(p->type == IMP_PROP_VECTOR && p->number[2] == 3, "point");
    tap_ok(imp__node_prop(n, "v")->number[2] == 4, "vector of one number");
    tap_ok(imp__node_prop(n, "w")->number[1] == 2, "vector of a list");
    p = imp__node_prop(n, "c");
    tap_ok(p->type == IMP_PROP_RGB && p->number[2] == 0.25, "rgb of one number");
    p = imp__node_prop(n, "u");
    tap_ok(p->type == IMP_PROP_UNIFORM && p->number[0] == 0.5, "spectrum of one number");
    p = imp__node_prop(n, "l");
    tap_ok(p->type == IMP_PROP_SPECTRUM && p->n == 3 && p->list[1] == 500 &&
               p->list[3] == 1 && p->list[5] == 0.5,
           "spectrum of samples");
    tap_ok(p->loc.line == 2 && p->loc.column > 1, "its place");
    const struct imp_child *c = imp__node_child(n, "d");
    tap_ok(c && strcmp(c->node->tag, "spectrum") == 0 &&
               strcmp(c->node->type, "d65") == 0,
           "spectrum object");
    parse_close(&s);
}

static void check_transforms(void)
{
    static const struct {
        const char *ops;
        double m[16];
    } cases[] = {
        {"<translate x='1'/><scale value='2'/>",
         {2, 0, 0, 2, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1}},
        {"<scale value='2'/><translate x='1'/>",
         {2, 0, 0, 1, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1}},
        {"<scale y='3'/>", {1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}},
        {"<rotate z='1' angle='90'/>", {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}},
        {"<rotate x='1' angle='90'/>", {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1}},
        {"<rotate y='1' angle='90'/>", {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1}},
        {"<rotate value='0 7 0' angle='-270'/>",
         {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1}},
        {"<matrix value='1 2 3 4 5 6 7 8 9'/>",
         {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0, 0, 0, 0, 1}},
        {"<matrix value='1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16'/>",
         {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}},
        {"<lookat origin='1 2 3' target='1 2 10' up='0 5 0'/>",
         {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1}},
        {"<lookat origin='0,0,0' target='1,0,0' up='0,0,1'/>",
         {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1}},
    };
    for (size_t i = 0; i < imp_count(cases); i++) {
        char xml[512];
        struct imp_scene s;
        snprintf(xml, sizeof xml, IN("<transform name='t'>%s</transform>"), cases[i].ops);
        double worst = parse(xml, NULL, &s) == IMP_OK ? 0 : 1;
        for (int k = 0; worst == 0 && k < 16; k++)
            worst =
                fmax(worst, fabs(imp__node_prop(s.root, "t")->number[k] - cases[i].m[k]));
        tap_ok(worst < 1e-15, "%s # error %.1e", cases[i].ops, worst);
        parse_close(&s);
    }
    tap_ok(strstr(last_warning, "s.xml:2:21: rotate: the axis has length 7") != NULL,
           "a long axis is warned about");
    struct imp_mat4 m = imp__rotate(imp__normalize(imp__v3(1, 2, 3)), 40), inverse;
    const struct imp_mat4 t = imp__translate(imp__v3(5, -6, 7e4)),
                          k = imp__scale(imp__v3(1e-5, 3, 1e6));
    m = imp__mat4_multiply(&t, &m);
    m = imp__mat4_multiply(&m, &k);
    tap_ok(imp__mat4_inverse(&m, &inverse), "a map of many scales is inverted");
    const imp_v3 p = imp__v3(0.3, -0.4, 0.5), world = imp__point(&m, p),
                 q = imp__point(&inverse, world);
    tap_near(imp__length(p - q), 0, 0, 1e-5, "and takes points back");
    const struct imp_mat4 flat = imp__scale(imp__v3(1, 0, 1));
    tap_ok(!imp__mat4_inverse(&flat, &inverse), "a flat one is not");
}

static void check_parameters(void)
{
    static const char *const defines[] = {"n=1", "n=7", "ab=x"};
    const struct imp_load_options o = {
        .size = sizeof o, .mode = IMP_RGB, .defines = defines, .n_defines = 3};
    struct imp_scene s;
    enum imp_status st =
        parse(IN("<default name='n' value='3'/><default name='a' value='short'/>"
                 "<default name='a' value='later'/>"
                 "<integer name='i' value='$n'/><string name='s' value='$abc \\$ $a.'/>"
                 "<shape type='sphere'><transform name='t'><scale "
                 "x='$n'/></transform></shape>"),
              &o, &s);
    tap_ok(st == IMP_OK, "parameters # %s", st ? imp_last_error(ctx) : "");
    if (st == IMP_OK) {
        tap_ok(imp__node_prop(s.root, "i")->integer == 7, "the caller's value wins");
        tap_ok(strcmp(imp__node_prop(s.root, "s")->string, "xc $ short.") == 0,
               "the longest name first; the first default counts # %s",
               imp__node_prop(s.root, "s")->string);
        tap_ok(imp__node_prop(child(s.root, 0), "t")->number[0] == 7,
               "inside transforms");
    }
    parse_close(&s);

    st = parse(IN("<default name='n' value='3'/>"), &o, &s);
    tap_ok(st == IMP_E_SCENE &&
               strcmp(imp_last_error(ctx),
                      "s.xml:1:1: parameter 'ab' was given, but nothing uses $ab") == 0,
           "unused parameters are errors # %s", imp_last_error(ctx));
    parse_close(&s);

    static const char *const bad[] = {"novalue"};
    const struct imp_load_options wrong = {
        .size = sizeof o, .mode = IMP_RGB, .defines = bad, .n_defines = 1};
    tap_ok(parse(IN(""), &wrong, &s) == IMP_E_ARG, "a definition needs '='");
    parse_close(&s);

    static char bomb[8192]; /* every default doubles the last */
    size_t n = (size_t)sprintf(
        bomb, "<scene version='3.0.0'><default name='a' value='xxxxxxxx'/>");
    for (int i = 0; i < 60; i++)
        n += (size_t)sprintf(bomb + n, "<default name='%c%c' value='$%c%c$%c%c'/>",
                             'b' + i / 20, 'a' + i % 20, i ? 'b' + (i - 1) / 20 : 'a',
                             i ? 'a' + (i - 1) % 20 : ' ', i ? 'b' + (i - 1) / 20 : 'a',
                             i ? 'a' + (i - 1) % 20 : ' ');
    sprintf(bomb + n, "</scene>");
    st = parse(bomb, NULL, &s);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), "value is too long"),
           "doubling parameters are stopped # %s", imp_last_error(ctx));
    parse_close(&s);
}

static void check_references(void)
{
    struct imp_scene s;
    const enum imp_status st = parse(
        IN("<shape type='sphere'><ref id='late' name='bsdf'/><ref id='other'/></shape>"
           "<bsdf type='diffuse' id='late'/><alias id='late' as='other'/>"),
        NULL, &s);
    tap_ok(st == IMP_OK, "forward references and aliases # %s",
           st ? imp_last_error(ctx) : "");
    if (st == IMP_OK) {
        const struct imp_node *shape = child(s.root, 0), *bsdf = child(s.root, 1);
        tap_ok(shape->children[0].node == bsdf && shape->children[1].node == bsdf,
               "both reach the object");
        tap_ok(strcmp(shape->children[0].name, "bsdf") == 0 && !shape->children[1].name &&
                   strcmp(shape->children[1].ref, "other") == 0,
               "names and ids are kept");
    }
    parse_close(&s);

    static char deep[1 << 15]; /* a chain of references, each one object deeper */
    size_t n = (size_t)sprintf(deep, "<scene version='3.0.0'>");
    for (int i = 0; i < 250; i++)
        n += (size_t)sprintf(deep + n, "<bsdf type='t' id='b%d'>%s%d%s</bsdf>", i,
                             i ? "<ref id='b" : "<!--", i ? i - 1 : 0, i ? "'/>" : "-->");
    sprintf(deep + n, "</scene>");
    tap_ok(parse(deep, NULL, &s) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "nested deeper"),
           "long chains are refused # %s", imp_last_error(ctx));
    parse_close(&s);

    n = (size_t)sprintf(deep, "<scene version='3.0.0'>");
    for (int i = 0; i < 300; i++) n += (size_t)sprintf(deep + n, "<bsdf type='t'>");
    tap_ok(parse(deep, NULL, &s) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "nested deeper"),
           "deep tags are refused # %s", imp_last_error(ctx));
    parse_close(&s);
}

/* What files of versions before 2.0.0 write, and its name today (docs/scene-format.md 1.6). */
static const struct {
    const char *object, *written, *name; /* name NULL: an error */
} old_names[] = {
    {"shape type='sphere'", "<transform name='toWorld'/>", "to_world"},
    {"shape type='sphere'", "<boolean name='flipNormals' value='true'/>", "flip_normals"},
    {"shape type='obj'", "<boolean name='faceNormals' value='true'/>", "face_normals"},
    {"bsdf type='dielectric'", "<float name='intIOR' value='1.5'/>", "int_ior"},
    {"bsdf type='dielectric'", "<string name='extIOR' value='air'/>", "ext_ior"},
    {"bsdf type='roughconductor'", "<float name='alphaU' value='.1'/>", "alpha_u"},
    {"bsdf type='plastic'", "<rgb name='diffuseReflectance' value='1'/>",
     "diffuse_reflectance"},
    {"bsdf type='diffuse'", "<rgb name='diffuseReflectance' value='1'/>", "reflectance"},
    {"bsdf type='diffuse'", "<rgb name='diffuse_reflectance' value='1'/>", "reflectance"},
    {"bsdf type='diffuse'", "<spectrum name='reflectance' value='1'/>", "reflectance"},
    {"bsdf type='twosided'", "<bsdf type='diffuse' name='innerPart'/>", "inner_part"},
    {"bsdf type='twosided'", "<ref id='other' name='innerPart'/>", "inner_part"},
    {"sensor type='thinlens'", "<float name='apertureRadius' value='1'/>",
     "aperture_radius"},
    {"sensor type='thinlens'", "<float name='focusDistance' value='1'/>",
     "focus_distance"},
    {"sensor type='perspective'", "<string name='fovAxis' value='x'/>", "fov_axis"},
    {"sensor type='perspective'", "<float name='nearClip' value='1'/>", "near_clip"},
    {"film type='hdrfilm'", "<string name='pixelFormat' value='rgb'/>", "pixel_format"},
    {"film type='hdrfilm'", "<integer name='cropOffsetX' value='1'/>", "crop_offset_x"},
    {"sampler type='independent'", "<integer name='sampleCount' value='1'/>",
     "sample_count"},
    {"integrator type='path'", "<integer name='maxDepth' value='1'/>", "max_depth"},
    {"integrator type='path'", "<boolean name='hideEmitters' value='true'/>",
     "hide_emitters"},
    {"medium type='homogeneous'", "<rgb name='sigmaT' value='1'/>", "sigma_t"},
    {"emitter type='point'", "<float name='samplingWeight' value='1'/>",
     "sampling_weight"},
    {"texture type='bitmap'", "<string name='filterType' value='nearest'/>",
     "filter_type"},
    {"texture type='bitmap'", "<string name='ABC' value='nearest'/>", "abc"},
    {"texture type='bitmap'", "<float name='uoffset' value='2'/>", "to_uv"},
    {"texture type='bitmap'", "<integer name='vscale' value='2'/>", "to_uv"},
    {"texture type='bitmap'", "<string name='uscale' value='2'/>", NULL},
    {"texture type='bitmap'", "<transform name='toUV'/><float name='uscale' value='2'/>",
     NULL},
};

/* uoffset, voffset, uscale, vscale, and the rows of scale(us, vs, 1) translate(uo, vo, 0). */
static const struct {
    const char *written;
    double row[2][4];
} old_uv[] = {
    {"<float name='uoffset' value='2'/>", {{1, 0, 0, 2}, {0, 1, 0, 0}}},
    {"<float name='voffset' value='3'/>", {{1, 0, 0, 0}, {0, 1, 0, 3}}},
    {"<float name='uscale' value='5'/>", {{5, 0, 0, 0}, {0, 1, 0, 0}}},
    {"<integer name='vscale' value='7'/>", {{1, 0, 0, 0}, {0, 7, 0, 0}}},
    {"<float name='vscale' value='7'/><float name='uoffset' value='2'/>"
     "<float name='uscale' value='5'/><float name='voffset' value='3'/>",
     {{5, 0, 0, 10}, {0, 7, 0, 21}}},
};

static enum imp_status parse_old(const char *version, const char *object,
                                 const char *written, struct imp_scene *s)
{
    char xml[1024];
    snprintf(xml, sizeof xml,
             "<scene version='%s'><default name='someCase' value='1'/><bsdf "
             "type='diffuse' id='other'/><%s>%s</%.*s></scene>",
             version, object, written, (int)strcspn(object, " "), object);
    return parse(xml, NULL, s);
}

static void check_upgrade(void)
{
    static const struct {
        const char *version;
        bool old;
    } versions[] = {{"0.4.0", true},  {"0.6.0", true},  {"1.9.9", true},
                    {"2.0.0", false}, {"2.1.0", false}, {"3.10.0", false}};
    struct imp_scene s;
    for (size_t k = 0; k < imp_count(old_names); k++) {
        const char *name = old_names[k].name;
        const enum imp_status st =
            parse_old("0.6.0", old_names[k].object, old_names[k].written, &s);
        const struct imp_node *node = st == IMP_OK ? child(s.root, 1) : NULL;
        tap_ok(name ? node && node->n_props + node->n_children == 1 &&
                          (imp__node_prop(node, name) || imp__node_child(node, name))
                    : st == IMP_E_SCENE,
               "%s: %s is %s # %s", old_names[k].object, old_names[k].written,
               name ? name : "an error", st ? imp_last_error(ctx) : "");
        parse_close(&s);
    }
    for (size_t k = 0; k < imp_count(old_uv); k++) {
        const enum imp_status st =
            parse_old("0.6.0", "texture type='bitmap'", old_uv[k].written, &s);
        const struct imp_prop *uv =
            st == IMP_OK ? imp__node_prop(child(s.root, 1), "to_uv") : NULL;
        bool same = uv != NULL;
        for (int i = 0; i < 8 && uv; i++)
            same &= uv->number[i] == old_uv[k].row[i / 4][i % 4];
        tap_ok(same, "%s", old_uv[k].written);
        parse_close(&s);
    }
    for (size_t k = 0; k < imp_count(versions); k++) {
        const enum imp_status st = parse_old(
            versions[k].version, "shape type='sphere'",
            "<transform name='toWorld'/><float name='a' value='$someCase'/>", &s);
        const struct imp_node *node = st == IMP_OK ? child(s.root, 1) : NULL;
        tap_ok(node && imp__node_prop(node, versions[k].old ? "to_world" : "toWorld"),
               "version %s %s upgraded, and names of parameters never # %s",
               versions[k].version, versions[k].old ? "is" : "is not",
               st ? imp_last_error(ctx) : "");
        parse_close(&s);
    }
}

/* ---- Files --------------------------------------------------------------------- */

static void put(const char *folder, const char *name, const char *text)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f) return;
    fputs(text, f);
    fclose(f);
}

static void check_files(void)
{
    char folder[] = "/tmp/importon-xml-XXXXXX", sub[64], main_xml[64], want[512];
    if (!mkdtemp(folder)) {
        tap_skip("includes", "no temporary folder");
        return;
    }
    snprintf(sub, sizeof sub, "%s/sub", folder);
    snprintf(main_xml, sizeof main_xml, "%s/main.xml", folder);
    mkdir(sub, 0755);
    put(sub, "part.xml",
        "<scene version='3.0.0'><default name='n' value='5'/>\n"
        "<integer name='dropped' value='1'/>\n"
        "<bsdf type='diffuse' id='x'/><include filename='one.xml'/></scene>");
    put(sub, "one.xml",
        "<bsdf version='1.0.0' type='twosided' name='two'>"
        "<float name='camelCase' value='1'/></bsdf>");
    put(sub, "dup.xml", "<scene version='3.0.0'>\n<bsdf type='diffuse' id='x'/></scene>");
    put(sub, "loop.xml", "<scene version='3.0.0'><include filename='loop.xml'/></scene>");
    put(sub, "a.spd", "# lamp\n\n400 1\n 500.5\t2e-1 \r\n600 3");
    put(sub, "bad.spd", "400 1\n500\n");

    struct imp_scene s;
    const char *xml = "<scene version='3.0.0'>\n<include filename='sub/part.xml'/>"
                      "<integer name='i' value='$n'/><path value='sub'/>"
                      "<spectrum name='l' filename='a.spd'/></scene>";
    enum imp_status st = parse_open(ctx, xml, strlen(xml), main_xml, NULL, &s);
    tap_ok(st == IMP_OK, "includes # %s", st ? imp_last_error(ctx) : "");
    if (st == IMP_OK) {
        tap_ok(s.root->n_children == 2 && s.root->n_props == 2,
               "an included scene gives its objects, not its properties");
        tap_ok(imp__node_prop(s.root, "i")->integer == 5, "parameters are shared");
        const struct imp_child *c = imp__node_child(s.root, "two");
        tap_ok(c && imp__node_prop(c->node, "camel_case"),
               "each file has its own version");
        const struct imp_prop *l = imp__node_prop(s.root, "l");
        tap_ok(l->n == 3 && l->list[1] == 500.5 && l->list[4] == 0.2, "spectrum files");
    }
    parse_close(&s);

    static const struct {
        const char *body, *message;
    } cases[] = {
        {"<bsdf type='a' id='x'/><include filename='sub/dup.xml'/>",
         "D/sub/dup.xml:2:1: id 'x' is used twice (first at D/main.xml:2:1)"},
        {"<include filename='sub/loop.xml'/>",
         "D/sub/loop.xml:1:24: 'D/sub/loop.xml' includes itself"},
        {"<include filename='sub'/>",
         "D/main.xml:2:1: D/sub: cannot read: Is a directory"},
        {"<spectrum name='a' filename='sub/bad.spd'/>",
         "D/main.xml:2:1: spectrum 'a': D/sub/bad.spd:2: a line must be 'wavelength "
         "value'"},
    };
    for (size_t i = 0; i < imp_count(cases); i++) {
        char text[512];
        snprintf(text, sizeof text, IN("%s"), cases[i].body);
        st = parse_open(ctx, text, strlen(text), main_xml, NULL, &s);
        size_t n = 0;
        for (const char *m = cases[i].message; *m; m++)
            if (*m == 'D') n += (size_t)sprintf(want + n, "%s", folder);
            else want[n++] = *m;
        want[n] = 0;
        tap_ok(st != IMP_OK && strcmp(imp_last_error(ctx), want) == 0, "%s",
               cases[i].message);
        if (strcmp(imp_last_error(ctx), want) != 0)
            printf("# %s\n# %s\n", imp_last_error(ctx), want);
        parse_close(&s);
    }
    for (int i = 0; i < 17; i++) { /* a chain of includes */
        char name[32], text[128];
        sprintf(name, "c%d.xml", i);
        sprintf(text, "<scene version='3.0.0'><include filename='c%d.xml'/></scene>",
                i + 1);
        put(folder, name, i < 16 ? text : "<scene version='3.0.0'/>");
    }
    const char *chain[] = {IN("<include filename='c0.xml'/>"),
                           IN("<include filename='c2.xml'/>")};
    for (int i = 0; i < 2; i++) {
        st = parse_open(ctx, chain[i], strlen(chain[i]), main_xml, NULL, &s);
        tap_ok((st == IMP_OK) == (i == 1), "%d includes deep # %s", i ? 15 : 17,
               st ? imp_last_error(ctx) : "");
        parse_close(&s);
    }
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) printf("# %s stays\n", folder);
}

/* ---- Truncation and memory ----------------------------------------------------- */

static const char sample[] =
    "<?xml version='1.0'?><scene version='2.1.0'><default name='r' value='2'/>"
    "<shape type='sphere' id='a' name='b'><float name='radius' value='$r'/>"
    "<transform name='to_world'><rotate x='1' angle='$r'/></transform>"
    "<spectrum name='s' value='400:1,500:2'/><ref id='m'/></shape>"
    "<bsdf type='diffuse' id='m'><rgb name='reflectance' "
    "value='.1,.2,.3'/></bsdf></scene>";

static void check_truncation(void)
{
    int wrong = 0;
    struct imp_scene s;
    for (size_t n = 0; n + 1 < sizeof sample; n++) {
        const enum imp_status st = parse_open(ctx, sample, n, "s.xml", NULL, &s);
        wrong += st != IMP_E_SCENE || strncmp(imp_last_error(ctx), "s.xml:1:", 8) != 0;
        parse_close(&s);
    }
    tap_ok(wrong == 0, "cut anywhere, the place is named # %d wrong", wrong);
}

static void check_memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
    int steps = 0, wrong = 0;
    for (enum imp_status st = IMP_E_NOMEM; st != IMP_OK && steps < 10000; steps++) {
        const long live = heap.live;
        struct imp_scene s;
        heap.calls = 0;
        heap.fail_at = steps + 1;
        st = parse_open(fragile, sample, sizeof sample - 1, "s.xml", NULL, &s);
        heap.fail_at = 0;
        parse_close(&s);
        wrong += st != IMP_OK && st != IMP_E_NOMEM;
        wrong += heap.live > live + 1; /* the error text stays with the context */
    }
    imp_context_destroy(fragile);
    tap_ok(steps > 5 && wrong == 0 && heap.live == 0,
           "no memory at the n-th allocation # %d allocations, %d wrong, %ld leaked",
           steps, wrong, heap.live);
}

/* Scenes of others, if they are there: all of them must be read. */
static void check_foreign(void)
{
    static const char *const files[] = {
        "scenes/cbox/cbox.xml",
        "scenes/cbox/cbox-rgb.xml",
        "scenes/cbox/cbox-spectral.xml",
        "tests/scenes/bsdf_spheres/test_arealight_path.xml",
        "tests/scenes/bsdf_spheres/test_constant_path.xml",
        "tests/scenes/bsdf_spheres/test_roughplastic_linear_path.xml",
        "tests/scenes/bsdf_spheres/test_textured_diffuse_path.xml",
        "tests/scenes/orthographic_sensor/test_orthographic_path.xml",
        "tests/scenes/participating_media/test_hetero_sigmat_volpath.xml",
        "tests/scenes/participating_media/test_homo_area_light_volpath.xml",
        "tests/scenes/spot_light/test_spot_direct.xml"};
    const char *shared = getenv("IMP_SHARED");
    for (size_t i = 0; i < imp_count(files); i++) {
        char path[512];
        struct imp_bytes text;
        struct imp_scene s;
        snprintf(path, sizeof path, "%s/mitsuba-scenes/%s", shared ? shared : ".",
                 files[i]);
        if (!shared || access(path, R_OK) != 0) {
            tap_skip(files[i], "IMP_SHARED is not set");
            continue;
        }
        enum imp_status st = imp__file_read(ctx, path, 1 << 20, &text);
        if (st != IMP_OK) continue;
        st = parse_open(ctx, (const char *)text.data, text.size, path, NULL, &s);
        tap_ok(st == IMP_OK, "%s # %s", files[i], st ? imp_last_error(ctx) : "");
        parse_close(&s);
        imp__bytes_free(ctx, &text);
    }
}

int main(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    o.log = on_log;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 1;
    check_values();
    check_transforms();
    check_parameters();
    check_references();
    check_upgrade();
    check_files();
    check_truncation();
    check_memory();
    check_foreign();
    imp_context_destroy(ctx);
    return tap_done();
}
