/* SPDX-License-Identifier: Apache-2.0
 *
 * Whole files: read into memory, and written so that they appear whole or not at all. */
#ifndef IMP_BASE_FILE_H
#define IMP_BASE_FILE_H

#include "context.h"
#include <stdio.h>

struct imp_bytes { /* growing memory; all zero is empty */
    unsigned char *data;
    size_t size, capacity;
};

/* What a small file may become: `unpacked` bytes in memory, of `packed` in the file, are refused
 * where they are more than `always` and than IMP_UNPACKS_TO times as many. @return IMP_E_SCENE with
 * both numbers. */
#define IMP_UNPACKS_TO 100
enum imp_status imp__unpacks(imp_context *ctx, const char *name, double packed,
                             double unpacked, double always);

/* Read all of it, with a zero byte behind the end. @return IMP_E_IO if it cannot be read,
 * is a folder or a device with anything in it, is longer than `limit`, or is a pipe in which nothing
 * comes for long; IMP_E_SCENE if it is all holes; IMP_E_NOMEM. */
enum imp_status imp__file_read(imp_context *ctx, const char *path, size_t limit,
                               struct imp_bytes *out);
/* As imp__file_read, by this process for itself, of a file that is no input of a run. */
enum imp_status imp__file_read_own(imp_context *ctx, const char *path, size_t limit,
                                   struct imp_bytes *out);
/* For reading, as fopen: *out NULL and IMP_OK if there is no such file. `held` keeps bytes
 * that come from another process: free them when the file is closed. */
enum imp_status imp__file_open(imp_context *ctx, const char *path, struct imp_bytes *held,
                               FILE **out);
bool imp__file_exists(imp_context *ctx, const char *path);
/* Write a temporary file beside it, flush it to the disk, rename it over `path`: at any
 * failure what was there stays. What is not a regular file (/dev/stdout) is written to.
 */
enum imp_status imp__file_write(imp_context *ctx, const char *path, const void *data,
                                size_t size);
/* The same, of what `fill` puts into it, in order: no more than the buffer is held. */
struct imp_file_writer {
    int fd, error; /* errno of the first failure: later bytes are dropped */
    size_t used;
    unsigned char buffer[1 << 14];
};
void imp__file_put(struct imp_file_writer *w, const void *data, size_t n);
enum imp_status imp__file_write_by(imp_context *ctx, const char *path,
                                   void (*fill)(struct imp_file_writer *w,
                                                const void *payload),
                                   const void *payload);
/* The same, of parts in turn. */
struct imp_chunk {
    const void *data;
    size_t size;
};
enum imp_status imp__file_write_parts(imp_context *ctx, const char *path,
                                      const struct imp_chunk *parts, size_t n);

/* Put n bytes at `offset`, growing as needed; false if out of memory. */
bool imp__bytes_put(imp_context *ctx, struct imp_bytes *b, size_t offset,
                    const void *data, size_t n);
static inline bool imp__bytes_add(imp_context *ctx, struct imp_bytes *b, const void *data,
                                  size_t n)
{
    return imp__bytes_put(ctx, b, b->size, data, n);
}
void imp__bytes_free(imp_context *ctx, struct imp_bytes *b);

#endif
