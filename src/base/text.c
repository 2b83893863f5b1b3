/* SPDX-License-Identifier: Apache-2.0
 *
 * Formatted text appended to a growing buffer. */
#include "text.h"
#include "number.h"

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
