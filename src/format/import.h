/* SPDX-License-Identifier: Apache-2.0
 *
 * Geometry in the files of other programs, read into the tree of nodes as if it had been
 * written in XML. A file is included in a scene, or is a scene of its own with a `path`
 * integrator and a camera. */
#ifndef IMP_FORMAT_IMPORT_H
#define IMP_FORMAT_IMPORT_H

#include "base/file.h"
#include "params.h"
#include "tree.h"

struct imp__import {
    struct imp_scene *scene;
    struct imp_tree *tree;
    struct imp_params *params;
    struct imp_arena *scratch; /* rewound by the caller */
    struct imp_node *parent;   /* the root of the scene */
    const char *name;          /* path, in the scene's arena */
    const struct imp_bytes *text;
    bool alone; /* a scene of its own: what it lacks to be seen is added */
};

/* @return IMP_E_SCENE at a line of the file; IMP_E_UNSUPPORTED with all that is not read,
 * by name and line, unless the scene is lenient. */
typedef enum imp_status imp__import_read(const struct imp__import *in);
imp__import_read imp__rad_read;  /* Radiance: materials and surfaces */
imp__import_read imp__view_read; /* Radiance: a view, which becomes a sensor */
imp__import_read imp__obj_read;  /* Wavefront: OBJ with the materials of its MTL files */
imp__import_read imp__gltf_read; /* glTF 2.0, as text and binary */
imp__import_read imp__luminaire_read; /* EULUMDAT and LM-63: a luminaire */

/* The reader by the ending of a name; NULL: a file in XML. */
imp__import_read *imp__import_of(const char *name);
/* A scene of the file alone. in->parent is NULL; the camera is the view file that the
 * parameter `view` names, or Radiance's view without options; glTF brings its own. */
enum imp_status imp__import_scene(const struct imp__import *in);

/* ---- Nodes and properties, written at `loc` -------------------------------------- */

enum imp_status imp__import_float(const struct imp__import *in, struct imp_node *node,
                                  const char *name, double value, struct imp_loc loc);
enum imp_status imp__import_integer(const struct imp__import *in, struct imp_node *node,
                                    const char *name, int64_t value, struct imp_loc loc);
enum imp_status imp__import_bool(const struct imp__import *in, struct imp_node *node,
                                 const char *name, bool value, struct imp_loc loc);
enum imp_status imp__import_string(const struct imp__import *in, struct imp_node *node,
                                   const char *name, const char *value,
                                   struct imp_loc loc);
enum imp_status imp__import_rgb(const struct imp__import *in, struct imp_node *node,
                                const char *name, const double value[3],
                                struct imp_loc loc);
enum imp_status imp__import_point(const struct imp__import *in, struct imp_node *node,
                                  const char *name, const double value[3],
                                  struct imp_loc loc);
enum imp_status imp__import_matrix(const struct imp__import *in, struct imp_node *node,
                                   const char *name, const double value[16],
                                   struct imp_loc loc);
/* An id that no object of the scene has: `wanted`, or with a number behind it. In the
 * scene's arena; NULL: out of memory. */
const char *imp__import_id(const struct imp__import *in, const char *wanted);
/* The same of a name that somebody gave: what patterns and parameters' names are made of
 * becomes '_'. */
const char *imp__import_name(const struct imp__import *in, const char *name);
/* The number that the parameter $name has, or `missing` if nobody gave it.
 * @return IMP_E_SCENE if it is not one in [lo, hi]. */
enum imp_status imp__import_number(const struct imp__import *in, const char *name,
                                   const char *missing, double lo, double hi,
                                   double *out);

/* ---- What a file alone may lack (import_view.c) ----------------------------------- */

/* The film of a sensor: the parameters `width` and `spp`, the height by width/height. */
enum imp_status imp__import_film(const struct imp__import *in, struct imp_node *sensor,
                                 double aspect, struct imp_loc loc);
/* A camera on all of a box from the front, above and the right; +y is up. */
enum imp_status imp__import_camera(const struct imp__import *in, const double lo[3],
                                   const double hi[3], struct imp_loc loc);
/* A sky of radiance 1, and a warning. */
enum imp_status imp__import_sky(const struct imp__import *in, struct imp_loc loc);

/* ---- What is not read ------------------------------------------------------------ */

struct imp__unread {
    int n;          /* so far */
    char text[900]; /* the list of them, while it has room */
    int listed;
};
/* One more, "brightfunc 'sky'", at a line: `lost` is what a lenient scene goes on with. */
enum imp_status imp__unread_add(const struct imp__import *in, struct imp__unread *u,
                                int line, const char *what, const char *lost);
/* IMP_E_UNSUPPORTED with the list, unless it is empty or the scene is lenient. */
enum imp_status imp__unread_finish(const struct imp__import *in,
                                   const struct imp__unread *u);

#endif
