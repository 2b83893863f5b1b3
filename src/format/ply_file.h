/* SPDX-License-Identifier: Apache-2.0
 *
 * A PLY file as it is read: its header, and where the body goes. */
#ifndef IMP_PLY_FILE_H
#define IMP_PLY_FILE_H

#include "mesh_file.h"
#include <string.h>

#define ELEMENTS_MAX   64
#define PROPERTIES_MAX 256
#define ATTRIBUTES_MAX 64

enum ply_format { PLY_ASCII, PLY_LITTLE, PLY_BIG };
enum ply_type {
    PLY_I8,
    PLY_U8,
    PLY_I16,
    PLY_U16,
    PLY_I32,
    PLY_U32,
    PLY_F32,
    PLY_F64,
    PLY_NONE
};
/* Bytes of a number in the body. */
static inline int imp__ply_bytes(enum ply_type type)
{
    static const int bytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return bytes[type];
}

/* Meaning of a vertex property; SKIP: ignored, or a channel of an attribute. */
enum ply_use {
    USE_X,
    USE_Y,
    USE_Z,
    USE_NX,
    USE_NY,
    USE_NZ,
    USE_U,
    USE_V,
    USES,
    USE_SKIP
};

struct ply_property {
    enum ply_type type, count; /* count NONE: a scalar */
    enum ply_use use;
    bool indices;
    char name[48];
    int attribute, channel; /* that it is part of; attribute -1: of none */
};
struct ply_element {
    char name[32];
    size_t n;
    int first, n_properties; /* in ply.properties */
};

struct ply {
    const struct imp_mesh_source *source;
    imp_context *ctx;
    const unsigned char *at, *end;
    int64_t line; /* of the header, and of ascii bodies */
    enum ply_format format;
    struct ply_element elements[ELEMENTS_MAX];
    struct ply_property properties[PROPERTIES_MAX];
    int n_elements, n_properties, vertex, face;
    struct imp_attribute_data attribute[ATTRIBUTES_MAX];
    int n_attributes;
    float *positions, *normals, *uvs;
    uint32_t *indices;
};

IMP_COLD enum imp_status IMP_PRINTF(2, 3)
    imp__ply_error(const struct ply *p, const char *format, ...);
bool imp__ply_has(const struct ply *p, enum ply_use use);
/* Up to the first byte of the body. The counts are not larger than the file can hold. */
enum imp_status imp__ply_header(struct ply *p);

/* The numbers of a vertex, by their use, where they belong. */
static inline void imp__ply_put(const struct ply *p, size_t row, const float f[USES])
{
    memcpy(p->positions + 3 * row, f + USE_X, 3 * sizeof *f);
    if (p->normals) memcpy(p->normals + 3 * row, f + USE_NX, 3 * sizeof *f);
    if (!p->uvs) return;
    p->uvs[2 * row] = f[USE_U];
    p->uvs[2 * row + 1] = p->source->flip_v ? 1 - f[USE_V] : f[USE_V];
}

/* The rows of an element, where they have one size and their numbers lie as in this machine's
 * memory: copied, by all threads, and p->at is behind them. False: nothing was done; they are
 * to be read number by number, which also finds what is wrong with them. */
bool imp__ply_copy(struct ply *p, int element);

/* Attributes: found in the header, with room for their numbers; number x of property q
 * goes to row `row`; and they are the mesh's. */
enum imp_status imp__ply_attributes(struct ply *p);
enum imp_status imp__ply_attribute_store(struct ply *p, const struct ply_property *q,
                                         size_t row, double x);
enum imp_status imp__ply_attributes_keep(const struct ply *p, struct imp_mesh_data *mesh);

#endif
