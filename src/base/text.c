/* SPDX-License-Identifier: Apache-2.0
 *
 * Formatted text appended to a growing buffer. */
#include "text.h"
#include "number.h"
#include <stdio.h>
#include <string.h>

void imp__put(struct imp_text *t, const char *format, ...)
{
    char line[256]; /* most pieces fit; longer ones are written a second time */
    char *text = line;
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    const int n = imp__vformat(line, sizeof line, format, args);
    const size_t length = n < 0 ? 0 : (size_t)n;
    if (length >= sizeof line) {
        text = imp__alloc(t->ctx, length + 1, 1);
        if (text) (void)imp__vformat(text, length + 1, format, again);
    }
    t->failed = t->failed || n < 0 || !text ||
                !imp__bytes_add(t->ctx, &t->bytes, text, length + 1);
    if (!t->failed) t->bytes.size--;
    if (text != line) imp__release(t->ctx, text);
    va_end(again);
    va_end(args);
}

bool imp__json_string(imp_context *ctx, struct imp_bytes *out, const char *text)
{
    bool fine = imp__bytes_add(ctx, out, "\"", 1);
    for (const char *s = text; fine && *s; s++) {
        char c[8] = {*s};
        if (*s == '"' || *s == '\\') c[0] = '\\', c[1] = *s;
        else if ((unsigned char)*s < 0x20) snprintf(c, sizeof c, "\\u%04x", *s);
        fine = imp__bytes_add(ctx, out, c, strlen(c));
    }
    return fine && imp__bytes_add(ctx, out, "\"", 1);
}
