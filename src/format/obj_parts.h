/* SPDX-License-Identifier: Apache-2.0
 *
 * An OBJ file as a scene: one mesh for each object and material, and the materials of its
 * MTL files (docs/import.md). */
#ifndef IMP_FORMAT_OBJ_PARTS_H
#define IMP_FORMAT_OBJ_PARTS_H

#include "import.h"
#include "mesh_file.h"

/* What the lines o, usemtl and mtllib say, while faces are read. */
struct imp__obj_names {
    imp_context *ctx;
    struct imp_arena *arena;
    struct imp__obj_run {              /* triangles from `first` on */
        const char *object, *material; /* NULL: none */
        size_t first;
    } * run;
    size_t n_runs, cap_runs;
    const char **library;
    size_t n_libraries, cap_libraries;
};

/* A line whose first word is `word` [length]; s to end is its rest; n_triangles so far.
 * False: out of memory. */
bool imp__obj_name(struct imp__obj_names *names, const char *word, size_t length,
                   const char *s, const char *end, size_t n_triangles);
/* As imp__obj_parse; also the names of parts. */
enum imp_status imp__obj_parse_names(const struct imp_mesh_source *source,
                                     struct imp__obj_names *names,
                                     struct imp_mesh_data *out);

/* A material of an MTL file (B5, "Material Library File", Alias|Wavefront), with the
 * physically based terms that modelling programs add (Pr, Pm). */
struct imp__mtl {
    const char *name;
    const char *library;                           /* where it stands, */
    int line;                                      /* and the line of its newmtl */
    double kd[3], ks[3], ke[3], ns, ni, d, pr, pm; /* pr, pm: NAN if not there */
    int illum;
    const char *map_kd, *map_d, *map_bump, *map_pr; /* files, or NULL */
    const char *id;                                 /* of its bsdf; NULL: not made yet */
};
struct imp__mtl_list {
    struct imp__mtl *material;
    size_t n, capacity;
};
/* Append those of a file's text. @return IMP_E_SCENE at a line of it. */
enum imp_status imp__mtl_parse(const struct imp__import *in, const char *name,
                               const struct imp_bytes *text, struct imp__mtl_list *list);
/* Its bsdf, once. */
enum imp_status imp__mtl_make(const struct imp__import *in, struct imp__mtl *m);

#endif
