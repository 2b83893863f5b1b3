/* SPDX-License-Identifier: Apache-2.0
 *
 * Growing text buffer: append without checks, and test `failed` once at the end. */
#ifndef IMP_BASE_TEXT_H
#define IMP_BASE_TEXT_H

#include "file.h"

struct imp_text { /* {.ctx = ctx} is empty; imp__bytes_free(ctx, &bytes) */
    imp_context *ctx;
    struct imp_bytes bytes; /* a zero byte follows, which `size` does not count */
    bool failed;            /* out of memory: later pieces are dropped */
};

/* printf to the end, with a decimal point whatever the host calls it. */
IMP_PRINTF(2, 3) void imp__put(struct imp_text *t, const char *format, ...);

/* A JSON string with its quotes; bytes that are no UTF-8 are left as they are. */
bool imp__json_string(imp_context *ctx, struct imp_bytes *out, const char *text);

#endif
