/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of parts and manifests: messages that are kept in files. */
#ifndef IMP_FILM_PARTS_FILE_H
#define IMP_FILM_PARTS_FILE_H

#include "base/file.h"
#include "base/team.h"
#include <string.h>

/* Bytes of a file that are still to be read. */
struct imp__reading {
    const struct imp_bytes *file;
    size_t at, end;
};
static inline bool imp__take(struct imp__reading *r, void *out, size_t n)
{
    if (r->end - r->at < n) return false;
    memcpy(out, r->file->data + r->at, n);
    r->at += n;
    return true;
}

struct imp__kept_message {
    size_t at, size; /* in the bytes of its file */
};

/* A message behind its size; false: no memory. */
static inline bool imp__message_put(imp_context *ctx, struct imp_bytes *out,
                                    const struct imp_bytes *file,
                                    const struct imp__kept_message *m)
{
    const uint64_t size = m->size;
    return imp__bytes_add(ctx, out, &size, sizeof size) &&
           imp__bytes_add(ctx, out, file->data + m->at, m->size);
}

/* One part i of n, counted from 1. */
struct imp__part_source {
    uint32_t index, count;
    size_t file;
    size_t n_messages, cap_messages;
    struct imp__kept_message *messages;
};

struct imp_parts {
    imp_context *ctx;
    bool making; /* a part that is computed now */
    char machine[256];
    char *command;
    size_t n_files;
    struct imp_bytes *files; /* [n_files]; of a part in the making, its messages */
    size_t n_sources, cap_sources;
    struct imp__part_source *sources; /* by where their share begins */
    char holes[256];                  /* which are missing */
    size_t next; /* message of every source that the merge reads next */
};

/* Read file k of the parts. */
enum imp_status imp__parts_file_read(struct imp_parts *p, const char *path, size_t k);
/* What a file of all these parts holds; false: no memory. */
bool imp__parts_bytes(const struct imp_parts *p, struct imp_bytes *out);

#endif
