/* SPDX-License-Identifier: Apache-2.0
 *
 * A walk over valid JSON, and its strings as HTML. */
#include "json_walk.h"
#include "base/number.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *blanks(const char *p) { return p + strspn(p, " \t\r\n"); }

/* Behind the string that begins here. */
static const char *behind_string(const char *p)
{
    for (p++; *p && *p != '"'; p++)
        if (*p == '\\' && p[1]) p++;
    return *p ? p + 1 : p;
}

/* Behind the value that begins here. */
static const char *behind(const char *p)
{
    int depth = 0;
    do {
        if (*p == '"') p = behind_string(p);
        else if (*p == '[' || *p == '{') depth++, p++;
        else if (*p == ']' || *p == '}') depth--, p++;
        else if (depth) p++;
        else p += strcspn(p, ",]} \t\r\n");
    } while (depth > 0 && *p);
    return p;
}

const char *imp__json_first(const char *container)
{
    if (!container || (*container != '[' && *container != '{')) return NULL;
    const char *p = blanks(container + 1);
    return *p && *p != ']' && *p != '}' ? p : NULL;
}

const char *imp__json_next(const char *value)
{
    if (!value) return NULL;
    const char *p = blanks(behind(value));
    if (*p == ':') p = blanks(behind(blanks(p + 1))); /* it was a key */
    return *p == ',' ? blanks(p + 1) : NULL;
}

const char *imp__json_value_of(const char *key)
{
    if (!key) return NULL;
    const char *p = blanks(behind(key));
    return *p == ':' ? blanks(p + 1) : NULL;
}

const char *imp__json_member(const char *object, const char *key)
{
    const size_t n = strlen(key);
    if (!object || *object != '{') return NULL;
    for (const char *k = imp__json_first(object); k; k = imp__json_next(k))
        if (!strncmp(k + 1, key, n) && k[1 + n] == '"') return imp__json_value_of(k);
    return NULL;
}

const char *imp__json_member_of(const char *object, const char *string)
{
    if (!object || *object != '{' || !imp__json_is_string(string)) return NULL;
    const size_t n = (size_t)(behind_string(string) - string);
    for (const char *k = imp__json_first(object); k; k = imp__json_next(k))
        if (!strncmp(k, string, n)) return imp__json_value_of(k);
    return NULL;
}

double imp__json_number(const char *value)
{
    double x;
    if (!value || (*value != '-' && (*value < '0' || *value > '9'))) return NAN;
    return imp__number(&value, value + strspn(value, "+-.0123456789eE"), &x) ? x : NAN;
}

bool imp__json_is_string(const char *value) { return value && *value == '"'; }
bool imp__json_is_true(const char *value) { return value && *value == 't'; }
bool imp__json_is_false(const char *value) { return value && *value == 'f'; }

/* ---- HTML ---------------------------------------------------------------------------- */

static void html_byte(struct imp_text *t, char c)
{
    switch (c) {
    case '&': imp__put(t, "&amp;"); break;
    case '<': imp__put(t, "&lt;"); break;
    case '>': imp__put(t, "&gt;"); break;
    case '"': imp__put(t, "&quot;"); break;
    case '\'': imp__put(t, "&#39;"); break;
    default:
        if ((unsigned char)c < 0x20) c = ' ';
        t->failed = t->failed || !imp__bytes_add(t->ctx, &t->bytes, &c, 1);
    }
}

void imp__html_text(struct imp_text *t, const char *text)
{
    for (; text && *text; text++) html_byte(t, *text);
}

/* Four digits, of which a valid text has four. */
static unsigned hex4(const char *p)
{
    const char digits[5] = {p[0], p[1], p[2], p[3], 0};
    return (unsigned)strtoul(digits, NULL, 16);
}

void imp__html_json(struct imp_text *t, const char *string)
{
    if (!imp__json_is_string(string)) return;
    const char *const end = behind_string(string) - 1;
    for (const char *p = string + 1; p < end; p++) {
        if (*p != '\\') {
            html_byte(t, *p);
        } else if (*++p != 'u') {
            html_byte(t, strchr("\"\\/", *p) ? *p : ' '); /* \n and its like are blanks */
        } else {
            unsigned code = hex4(p + 1);
            p += 4;
            if (code >> 10 == 0x36 && end - p > 6 && p[1] == '\\' && p[2] == 'u' &&
                hex4(p + 3) >> 10 == 0x37) {
                code = 0x10000 + ((code & 0x3ff) << 10) + (hex4(p + 3) & 0x3ff);
                p += 6;
            }
            if (code < 0x80) html_byte(t, (char)code);
            else imp__put(t, "&#%u;", code >> 11 == 0x1b ? 0xfffd : code);
        }
    }
}
