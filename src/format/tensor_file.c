/* SPDX-License-Identifier: Apache-2.0
 *
 * A parser of tensor files: named arrays inside the file's bytes, with offsets and sizes
 * checked. */
#include "tensor_file.h"
#include "base/little.h"
#include <string.h>

struct reading {
    imp_context *ctx;
    const char *name;
    const unsigned char *at, *end;
};

static const unsigned char *take(struct reading *r, size_t n)
{
    if ((size_t)(r->end - r->at) < n) return NULL;
    r->at += n;
    return r->at - n;
}
static unsigned little_u16(const unsigned char *b)
{
    return (unsigned)b[0] | (unsigned)b[1] << 8;
}
static uint64_t little_u64(const unsigned char *b)
{
    return (uint64_t)imp__little_u32(b) | (uint64_t)imp__little_u32(b + 4) << 32;
}

/* Bytes of a number of each type; 0: no type. */
static size_t bytes_of(int type)
{
    static const unsigned char bytes[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
    return type > 0 && type < (int)sizeof bytes ? bytes[type] : 0;
}

static enum imp_status field_read(struct reading *r, int k, const struct imp_bytes *file,
                                  struct imp__tensor_field *f)
{
    const unsigned char *b = take(r, 2), *text = b ? take(r, little_u16(b)) : NULL,
                        *head = text ? take(r, 11) : NULL;
    if (!head)
        return imp__error(r->ctx, IMP_E_SCENE, "%s: it ends within field %d", r->name, k);
    const size_t length = little_u16(b),
                 kept = length < sizeof f->name ? length : sizeof f->name - 1;
    memcpy(f->name, text, kept);
    f->name[kept] = 0;
    for (size_t i = 0; i < kept; i++)
        if (f->name[i] < ' ' || f->name[i] > '~') f->name[i] = '?';
    f->rank = (int)little_u16(head);
    f->type = head[2];
    const uint64_t offset = little_u64(head + 3);
    const size_t bytes = bytes_of(f->type);
    if (!bytes)
        return imp__error(r->ctx, IMP_E_SCENE, "%s: field '%s' has the unknown type %d",
                          r->name, f->name, f->type);
    if (f->rank > IMP_TENSOR_RANK_MAX)
        return imp__error(r->ctx, IMP_E_SCENE, "%s: field '%s' has rank %d; at most %d",
                          r->name, f->name, f->rank, IMP_TENSOR_RANK_MAX);
    const unsigned char *sizes = take(r, 8 * (size_t)f->rank);
    if (!sizes)
        return imp__error(r->ctx, IMP_E_SCENE, "%s: it ends within field '%s'", r->name,
                          f->name);
    bool fits = true;
    f->count = 1;
    for (int d = 0; d < f->rank; d++) {
        const uint64_t size = little_u64(sizes + 8 * d);
        fits &= size > 0 && size <= file->size;
        f->size[d] = fits ? (size_t)size : 0;
        fits = fits && !__builtin_mul_overflow(f->count, f->size[d], &f->count) &&
               f->count <= file->size;
    }
    if (!fits || offset > file->size || f->count > (file->size - offset) / bytes)
        return imp__error(r->ctx, IMP_E_SCENE,
                          "%s: field '%s' has other sizes than numbers in the file",
                          r->name, f->name);
    f->data = file->data + offset;
    return IMP_OK;
}

enum imp_status imp__tensor_parse(imp_context *ctx, const char *name,
                                  const struct imp_bytes *file,
                                  struct imp__tensor_file *out)
{
    enum imp_status st = IMP_OK;
    struct reading r = {ctx, name, file->data, file->data + file->size};
    const unsigned char *head = file->size ? take(&r, 18) : NULL;
    out->name = name;
    out->n = 0;
    if (!head || memcmp(head, "tensor_file", 12) != 0)
        return imp__error(ctx, IMP_E_SCENE, "%s: not a tensor file", name);
    if (head[12] != 1 || head[13] != 0)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "%s: version %d.%d of a tensor file; 1.0 is known", name,
                          head[12], head[13]);
    const uint32_t n = imp__little_u32(head + 14);
    if (n > IMP_TENSOR_FIELDS_MAX)
        return imp__error(ctx, IMP_E_SCENE, "%s: %u fields; at most %d", name, n,
                          IMP_TENSOR_FIELDS_MAX);
    for (; out->n < (int)n; out->n++)
        IMP_TRY(field_read(&r, out->n, file, &out->field[out->n]));
out:
    return st;
}

const struct imp__tensor_field *imp__tensor_find(const struct imp__tensor_file *file,
                                                 const char *name)
{
    for (int k = 0; k < file->n; k++)
        if (strcmp(file->field[k].name, name) == 0) return &file->field[k];
    return NULL;
}
