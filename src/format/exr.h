/* SPDX-License-Identifier: Apache-2.0
 *
 * What reading and writing EXR files share: OpenEXRCore on memory, its messages kept. */
#ifndef IMP_FORMAT_EXR_H
#define IMP_FORMAT_EXR_H

#include "base/file.h"
#include <openexr.h>

struct imp_exr { /* the user data of an exr context */
    imp_context *ctx;
    const char *name; /* NULL when writing */
    const struct imp_bytes *from;
    struct imp_bytes *to;
    bool no_memory;
    char message[256];
    imp_context *previous; /* of the hooks */
    struct imp_exr *outer;
};

/* Allocations and messages on this thread belong to `io` from begin to end. */
exr_context_initializer_t imp__exr_begin(struct imp_exr *io);
void imp__exr_end(struct imp_exr *io);
/* The library's message, as ours. */
enum imp_status imp__exr_error(const struct imp_exr *io, exr_result_t code);

#define IMP_EXR_SPP     "importon.spp"
#define IMP_EXR_DROPPED "importon.dropped"
#define IMP_EXR_SETS    "importon.sets"

#endif
