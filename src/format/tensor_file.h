/* SPDX-License-Identifier: Apache-2.0
 *
 * Mitsuba's tensor files: named arrays of numbers, as of measured materials (.bsdf). All
 * numbers are little-endian:
 *
 *     "tensor_file\0", version (two bytes: 1, 0), number of fields (uint32); for each:
 *     length of the name (uint16), name, rank (uint16), type (uint8), offset of the numbers
 *     in the file (uint64), sizes (uint64 each), the last running fastest. */
#ifndef IMP_FORMAT_TENSOR_FILE_H
#define IMP_FORMAT_TENSOR_FILE_H

#include "base/file.h"

#define IMP_TENSOR_BYTES_MAX  ((size_t)1 << 32)
#define IMP_TENSOR_FIELDS_MAX 64
#define IMP_TENSOR_RANK_MAX   8

enum imp__tensor_type { /* as in files */
                        IMP_TENSOR_UINT8 = 1,
                        IMP_TENSOR_FLOAT = 10
};
struct imp__tensor_field {
    char name[32]; /* of a longer one: its beginning */
    int type, rank;
    size_t size[IMP_TENSOR_RANK_MAX], count;
    const unsigned char *data; /* in the file: count numbers, all of them there */
};
struct imp__tensor_file {
    const char *name; /* for messages */
    int n;
    struct imp__tensor_field field[IMP_TENSOR_FIELDS_MAX];
};

/* IMP_E_SCENE: not such a file; file, field and what is wrong. */
enum imp_status imp__tensor_parse(imp_context *ctx, const char *name,
                                  const struct imp_bytes *file,
                                  struct imp__tensor_file *out);
/* NULL: it has none of this name. */
const struct imp__tensor_field *imp__tensor_find(const struct imp__tensor_file *file,
                                                 const char *name);

#endif
