/* SPDX-License-Identifier: Apache-2.0
 *
 * Globs over parameter names: `*` matches any characters, dots included, `?` for one.
 */
#ifndef IMP_INVERSE_MATCH_H
#define IMP_INVERSE_MATCH_H

#include <stdbool.h>
#include <string.h>

static inline bool imp__has_wildcards(const char *glob)
{
    return strpbrk(glob, "*?") != NULL;
}

/* Linear in memory, and quadratic at worst: only the last `*` is ever retried. */
static inline bool imp__glob(const char *glob, const char *text)
{
    const char *star = NULL, *from = NULL;
    while (*text) {
        if (*glob == '*') {
            star = glob++;
            from = text;
        } else if (*glob == '?' || *glob == *text) {
            glob++, text++;
        } else if (star) {
            glob = star + 1;
            text = ++from;
        } else {
            return false;
        }
    }
    while (*glob == '*') glob++;
    return !*glob;
}

#endif
