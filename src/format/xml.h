/* SPDX-License-Identifier: Apache-2.0
 *
 * Reading scene files (docs/scene-format.md 1). xml.c drives expat over a file and its
 * includes, xml_tags.c is the grammar. */
#ifndef IMP_FORMAT_XML_H
#define IMP_FORMAT_XML_H

#include "base/file.h"
#include "math/transform.h"
#include "params.h"
#include "tree.h"

/* Read `text` into the tree of scene->root. `name` is the file in messages,
 * `options` gives parameters. scene->search must be filled. References are resolved. */
enum imp_status imp__xml_read(struct imp_scene *scene, const struct imp_bytes *text,
                              const char *name, const struct imp_load_options *options);

/* ---- Shared by xml.c and xml_tags.c -------------------------------------------- */

#define XML_INCLUDE_DEPTH  15
#define XML_INCLUDES_MAX   10000
#define XML_FILE_BYTES_MAX ((size_t)1 << 30)
#define XML_ATTRIBUTES_MAX 8

enum xml_level_kind {
    XML_OBJECT,
    XML_TRANSFORM,
    XML_LEAF /* no content is allowed inside */
};
struct xml_level {
    enum xml_level_kind kind;
    const char *tag;
    struct imp_node *node;  /* OBJECT: gets the children; TRANSFORM: the owner */
    struct imp_node *props; /* OBJECT: gets the properties; not `node` only in the root
                               of an included scene, whose properties are dropped */
    struct imp_prop *prop;  /* TRANSFORM */
    struct imp_mat4 matrix;
};

struct xml_reader { /* of a scene file and its includes */
    imp_context *ctx;
    struct imp_scene *scene;
    struct imp_tree tree;
    struct imp_params params;
    struct imp_arena scratch; /* values of the tag being read */
    size_t n_includes, n_bytes;
};

struct xml_file {
    struct xml_reader *reader;
    struct xml_file *includer; /* NULL: the scene file itself */
    void *parser;
    const char *name;        /* path, in the scene's arena */
    const char *folder;      /* searched first by what this file includes */
    struct imp_node *parent; /* of what the file holds; NULL for the scene file */
    const char *slot;        /* name given by the include, or NULL */
    bool old;                /* version < 2.0.0: names are upgraded */
    int depth;
    enum imp_status st;
    struct xml_level levels[IMP_DEPTH_MAX + 1];
};

/* Attributes of a tag, parameters replaced. Missing: NULL. */
struct xml_attributes {
    int n;
    struct {
        const char *name, *value;
    } at[XML_ATTRIBUTES_MAX];
};

struct imp_loc imp__xml_loc(const struct xml_file *f);
/* Record "file:line:column: message" and stop reading; only the first failure counts. */
IMP_COLD void imp__xml_fail(struct xml_file *f, enum imp_status status,
                            const char *format, ...) IMP_PRINTF(3, 4);
/* Put the place before the message that is there, and stop reading. */
IMP_COLD void imp__xml_fail_here(struct xml_file *f, enum imp_status status);
/* Stop with a message that names its place already; nothing happens for IMP_OK. */
void imp__xml_fail_placed(struct xml_file *f, enum imp_status status);
/* Read the file `name` in place of its tag. */
void imp__xml_include(struct xml_file *f, const char *name, const char *slot,
                      struct imp_node *parent);

void imp__xml_start(struct xml_file *f, const char *tag, const char **attributes);
void imp__xml_end(struct xml_file *f);

/* ---- What tags do: xml_props.c, xml_settings.c, xml_transform.c ----------------- */
typedef void imp__xml_act(struct xml_file *f, const struct xml_attributes *a);
imp__xml_act imp__xml_integer, imp__xml_float, imp__xml_boolean, imp__xml_string,
    imp__xml_vector, imp__xml_rgb, imp__xml_spectrum, imp__xml_set;
imp__xml_act imp__xml_translate, imp__xml_scale, imp__xml_rotate, imp__xml_matrix,
    imp__xml_lookat;

const char *imp__xml_get(const struct xml_attributes *a, const char *name);
/* The name attribute, upgraded if the file is old; NULL if there is none or f failed. */
const char *imp__xml_name(struct xml_file *f, const struct xml_attributes *a);
struct xml_level *imp__xml_top(struct xml_file *f);
/* A new property of the open object, named by the attributes; NULL: f failed. */
struct imp_prop *imp__xml_prop(struct xml_file *f, const struct xml_attributes *a,
                               enum imp_prop_type type);
/* x y z with defaults `missing`, or value; false: f failed. */
bool imp__xml_xyz(struct xml_file *f, const char *tag, const struct xml_attributes *a,
                  double missing, double out[3]);

/* ---- upgrade.c: files before version 2.0.0 (docs/scene-format.md 1.6) ---------- */
/* camelCase -> snake_case, and reflectances renamed; `type` is the plugin that has the
 * property. In scratch; NULL: out of memory. */
const char *imp__upgrade_name(struct imp_arena *scratch, const char *type,
                              const char *name);
/* uoffset, voffset, uscale, vscale -> to_uv. */
enum imp_status imp__upgrade_texture(struct imp_tree *tree, struct imp_node *node);

#endif
