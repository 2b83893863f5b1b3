/* SPDX-License-Identifier: Apache-2.0
 *
 * glTF 2.0 (Khronos 2021; ISO/IEC 12113:2022), .gltf and .glb, as nodes of a scene
 * (docs/import.md): gltf.c opens files and reads JSON's members, gltf_data.c buffers and
 * accessors, gltf_mesh.c primitives, gltf_texture.c pictures, gltf_material.c materials,
 * gltf_nodes.c the tree of nodes with its cameras and lights. */
#ifndef IMP_FORMAT_GLTF_H
#define IMP_FORMAT_GLTF_H

#include "base/arguments.h"
#include "base/film.h"
#include "format/import.h"
#include "math/transform.h"
#include <jansson.h>

struct gltf_buffer {
    const unsigned char *data;
    size_t size;
    struct imp_bytes own; /* what `data` is of, unless it is a part of the file */
    bool read;
};

/* A picture as a texture of the scene, once for all materials that use it alike. */
struct gltf_texture {
    struct gltf_texture *next;
    int texture, texcoord;
    int use;          /* enum gltf_use */
    double factor[3]; /* of the texels */
    double matrix[16];
    const char *id;
};
enum gltf_use {
    GLTF_COLOR,     /* R, G, B, encoded as sRGB where the file has bytes */
    GLTF_GREEN,     /* numbers of one channel: roughness, */
    GLTF_BLUE,      /* metallic, */
    GLTF_RED,       /* clear coat and others; */
    GLTF_ALPHA,     /* opacity; */
    GLTF_CUT,       /* 1 where alpha is at least factor[0], else 0 */
    GLTF_DIRECTION, /* normals, their x and y times factor[0] */
};

struct gltf_primitive {
    const struct imp_mesh_data *mesh; /* NULL: nothing that is drawn */
    double lo[3], hi[3];
    int material; /* -1: the default */
};
struct gltf_mesh {
    struct gltf_primitive *primitive; /* NULL: not read yet */
    size_t n;
};

struct gltf_material {
    const char *id; /* of the bsdf; NULL: not made yet */
    int texcoord;   /* the set of uvs that its textures use */
    bool textured;
    double emitted[3];           /* radiance, texture aside */
    const char *emitted_texture; /* an id, or NULL */
};

struct gltf {
    const struct imp__import *in;
    imp_context *ctx;
    struct imp_loc loc;
    json_t *root;
    const unsigned char *binary; /* the second chunk of a .glb, or NULL */
    size_t n_binary;
    const char *folder;
    double efficacy;
    char where[160]; /* the object that is read, for messages */
    struct gltf_buffer *buffer;
    size_t n_buffers;
    imp_film **film; /* [n_images], as they are asked for */
    bool *film_srgb;
    size_t n_images;
    struct gltf_texture *textures;
    struct gltf_material *material; /* [n_materials + 1]: the last is the default */
    size_t n_materials;
    struct gltf_mesh *mesh;
    size_t n_meshes;
    bool *visited; /* [n_nodes] */
    size_t n_nodes;
    size_t n_cameras, n_lamps; /* in the scene so far */
    double lo[3], hi[3];       /* box of all shapes */
    double bytes_read, bytes_made;
    struct imp__unread unread;
};

/* ---- Members of objects (gltf.c) ----------------------------------------------------- */

/* "file: meshes[2]: message", IMP_E_SCENE. */
IMP_COLD enum imp_status imp__gltf_error(const struct gltf *g, const char *format, ...)
    IMP_PRINTF(2, 3);
enum imp_status imp__gltf_memory(const struct gltf *g); /* IMP_E_NOMEM */
/* Something of the file that is not read: "materials[2]: KHR_materials_iridescence". */
enum imp_status imp__gltf_unread(struct gltf *g, const char *lost, const char *format,
                                 ...) IMP_PRINTF(3, 4);
/* root[list][index], an object; *out NULL if there is no such list. */
enum imp_status imp__gltf_item(struct gltf *g, const char *list, size_t index,
                               const json_t **out);
size_t imp__gltf_count(const struct gltf *g, const char *list);
/* An absent member leaves *out as it is. */
enum imp_status imp__gltf_number(const struct gltf *g, const json_t *object,
                                 const char *name, double lo, double hi, double *out);
enum imp_status imp__gltf_numbers(const struct gltf *g, const json_t *object,
                                  const char *name, size_t n, double *out);
/* An index below `count`, or a number of bytes. */
enum imp_status imp__gltf_size(const struct gltf *g, const json_t *object,
                               const char *name, size_t count, size_t *out);
enum imp_status imp__gltf_index(const struct gltf *g, const json_t *object,
                                const char *name, size_t count, int *out);
bool imp__gltf_flag(const json_t *object, const char *name);
const char *imp__gltf_text(const json_t *object, const char *name); /* or NULL */
const json_t *imp__gltf_extension(const json_t *object, const char *name);
/* An id that no object has: its name, or `kind` and its index. */
const char *imp__gltf_id(const struct gltf *g, const json_t *object, const char *kind,
                         size_t index);

/* ---- Bytes (gltf_data.c) --------------------------------------------------------------- */

/* What a uri names: base64 of its own, or a file beside this one. */
enum imp_status imp__gltf_uri(struct gltf *g, const char *uri, struct imp_bytes *out);
enum imp_status imp__gltf_view(struct gltf *g, size_t view, const unsigned char **data,
                               size_t *size, size_t *stride);

struct gltf_accessor {
    const unsigned char *data;
    size_t count, stride;
    int component, n; /* componentType; numbers of an element */
    bool normalized;
};
enum imp_status imp__gltf_accessor(struct gltf *g, size_t index,
                                   struct gltf_accessor *out);
/* n numbers of element i, as the specification scales them. */
void imp__gltf_element(const struct gltf_accessor *a, size_t i, int n, float *out);
uint32_t imp__gltf_integer(const struct gltf_accessor *a, size_t i);
/* Count what a file becomes in memory. @return IMP_E_SCENE if it is out of proportion. */
enum imp_status imp__gltf_made(struct gltf *g, double bytes);

/* ---- Parts of the scene ------------------------------------------------------------------ */

enum imp_status imp__gltf_mesh(struct gltf *g, size_t index, struct gltf_mesh **out);
/* material -1: the default. */
enum imp_status imp__gltf_material(struct gltf *g, int material,
                                   struct gltf_material **out);
/* A reference to the texture of `info` (a textureInfo) in the slot of a node. */
enum imp_status imp__gltf_texture(struct gltf *g, const json_t *info, enum gltf_use use,
                                  const double factor[3], const char **id);
/* The set of uvs of a textureInfo, its transform counted. */
enum imp_status imp__gltf_texcoord(struct gltf *g, const json_t *info, int *out);
enum imp_status imp__gltf_nodes(struct gltf *g);

#endif
