/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance scene descriptions: "modifier type identifier" and three lists of arguments
 * (Ward Larson and Shakespeare, Rendering with Radiance, 1998, ch. 3 and 5; the manual
 * "The RADIANCE Synthetic Imaging System"). rad.c reads them, rad_material.c and
 * rad_surface.c make nodes of them. */
#ifndef IMP_FORMAT_RAD_H
#define IMP_FORMAT_RAD_H

#include "import.h"

#define RAD_WORD_MAX 256 /* bytes of a name, with the zero */

struct rad_primitive {
    char modifier[RAD_WORD_MAX], type[RAD_WORD_MAX], id[RAD_WORD_MAX];
    char string[RAD_WORD_MAX]; /* the first of n_strings */
    size_t n_strings, n_real, capacity;
    double *real;
    int line;
};

enum rad_kind {
    RAD_VOID,  /* what has it is not there */
    RAD_PLAIN, /* plastic, metal, glass, mirror */
    RAD_LIGHT, /* light, glow, illum */
    RAD_OTHER  /* not read */
};
struct rad_modifier {
    enum rad_kind kind;
    const char *type, *id; /* type: a literal, or of the arena */
    double value[5]; /* real arguments, those that are missing with their defaults */
    int line;
    struct rad_modifier *under; /* the modifier of it that is not read; NULL */
    bool reported;              /* RAD_OTHER, or `under`: in the list already */
    const char *node_id;        /* of the bsdf in the scene; NULL: not made yet */
    struct rad_mesh *mesh;      /* of its polygons; NULL: none so far */
};

/* Triangles of all polygons of one material. */
struct rad_mesh {
    struct rad_mesh *next;
    struct imp_node *node;
    float *position;
    uint32_t *index;
    size_t n_position, cap_position, n_index, cap_index; /* numbers */
};

struct rad_reader {
    const struct imp__import *in;
    imp_context *ctx;
    const char *at, *end;
    int line;
    struct rad_primitive p;
    struct imp_names names; /* value: struct rad_modifier */
    struct rad_modifier nothing;
    struct rad_mesh *meshes;
    uint32_t *cut; /* triangles of a polygon */
    size_t cap_cut, n_empty;
    int first_empty; /* line of the first polygon without area */
    double efficacy; /* factor of emitted radiances */
    struct imp__unread unread;
};

/* "file:line:1: type 'id': message", IMP_E_SCENE. */
IMP_COLD enum imp_status imp__rad_error(const struct rad_reader *r, const char *format,
                                        ...) IMP_PRINTF(2, 3);
struct imp_loc imp__rad_loc(const struct rad_reader *r);
/* In the arena of the scene. @return IMP_E_NOMEM */
enum imp_status imp__rad_keep(const struct rad_reader *r, const char *text,
                              const char **out);

/* The modifier of that name. @return IMP_E_SCENE if there is none before this line. */
enum imp_status imp__rad_modifier(struct rad_reader *r, const char *name,
                                  struct rad_modifier **out);
/* Is `type` a material of those that are read? Declare it. */
bool imp__rad_is_material(const char *type);
enum imp_status imp__rad_material(struct rad_reader *r);
enum imp_status imp__rad_other(struct rad_reader *r); /* a modifier that is not read */
enum imp_status imp__rad_alias(struct rad_reader *r);
/* What a surface looks like: *bsdf is an id, or NULL. @return of a material that is not
 * read, once each, the list. *m NULL: the surface is left out. */
enum imp_status imp__rad_look(struct rad_reader *r, struct rad_modifier **m,
                              const char **bsdf);

bool imp__rad_is_surface(const char *type); /* of all that Radiance has */
enum imp_status imp__rad_surface(struct rad_reader *r);
enum imp_status imp__rad_meshes_finish(struct rad_reader *r);
void imp__rad_meshes_free(struct rad_reader *r);

#endif
