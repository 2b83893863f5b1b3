/* SPDX-License-Identifier: Apache-2.0
 *
 * A checker of JSON texts without recursion: brackets that are open are a string, at most 64 of
 * them. */
#include "json_text.h"
#include <string.h>

enum { DEPTH_MAX = 64 };

static bool digit(char c) { return c >= '0' && c <= '9'; }

static void space(const char **s) { *s += strspn(*s, " \t\r\n"); }

static bool digits(const char **s)
{
    const char *first = *s;
    while (digit(**s)) ++*s;
    return *s > first;
}

static bool number(const char **s)
{
    if (**s == '-') ++*s;
    if (**s == '0') ++*s;
    else if (!digits(s)) return false;
    if (**s == '.') {
        ++*s;
        if (!digits(s)) return false;
    }
    if (**s != 'e' && **s != 'E') return true;
    ++*s;
    if (**s == '+' || **s == '-') ++*s;
    return digits(s);
}

static bool string(const char **s)
{
    if (**s != '"') return false;
    for (++*s; **s != '"'; ++*s) {
        if ((unsigned char)**s < 0x20) return false; /* the end of the text too */
        if (**s != '\\') continue;
        ++*s;
        if (**s == 'u') {
            if (strspn(*s + 1, "0123456789abcdefABCDEF") < 4) return false;
            *s += 4;
        } else if (!**s || !strchr("\"\\/bfnrt", **s)) {
            return false;
        }
    }
    ++*s;
    return true;
}

static bool word(const char **s, const char *text)
{
    const size_t n = strlen(text);
    if (strncmp(*s, text, n) != 0) return false;
    *s += n;
    return true;
}

static bool scalar(const char **s)
{
    switch (**s) {
    case '"': return string(s);
    case 't': return word(s, "true");
    case 'f': return word(s, "false");
    case 'n': return word(s, "null");
    default: return number(s);
    }
}

/* The key of an object's member, with its colon. */
static bool key(const char **s)
{
    space(s);
    if (!string(s)) return false;
    space(s);
    if (**s != ':') return false;
    ++*s;
    return true;
}

/* Behind a value: commas and the ends of what is open, up to where a value follows or
 * nothing is open. */
static bool behind(const char **s, const char *open, int *depth)
{
    for (;;) {
        space(s);
        if (!*depth) return true;
        const char end = open[*depth - 1];
        if (**s == ',') {
            ++*s;
            return end != '}' || key(s);
        }
        if (**s != end) return false;
        ++*s;
        --*depth;
    }
}

bool imp__json_valid(const char *text, size_t *at)
{
    char open[DEPTH_MAX]; /* the brackets that will close */
    int depth = 0;
    bool fine = true;
    const char *s = text;
    do {
        space(&s);
        if (*s == '{' || *s == '[') {
            if (depth == DEPTH_MAX) break;
            open[depth++] = *s++ == '{' ? '}' : ']';
            space(&s);
            if (*s == open[depth - 1]) {
                s++;
                depth--;
                fine = behind(&s, open, &depth);
            } else {
                fine = open[depth - 1] == ']' || key(&s);
                if (fine) continue;
            }
        } else {
            fine = scalar(&s) && behind(&s, open, &depth);
        }
    } while (fine && depth);
    *at = (size_t)(s - text);
    return fine && !depth && !*s;
}
