/* SPDX-License-Identifier: Apache-2.0
 *
 * JSON output. Text from scene files may not be UTF-8; what is malformed is replaced. */
#include "json.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

/* Length of the well-formed UTF-8 sequence at s, 0: none (Unicode, table 3-7). */
static int utf8_length(const unsigned char *s)
{
    static const struct {
        unsigned char lo, hi, lo2, hi2, n;
    } rows[] = {{0x00, 0x7f, 0, 0, 1},       {0xc2, 0xdf, 0x80, 0xbf, 2},
                {0xe0, 0xe0, 0xa0, 0xbf, 3}, {0xe1, 0xec, 0x80, 0xbf, 3},
                {0xed, 0xed, 0x80, 0x9f, 3}, {0xee, 0xef, 0x80, 0xbf, 3},
                {0xf0, 0xf0, 0x90, 0xbf, 4}, {0xf1, 0xf3, 0x80, 0xbf, 4},
                {0xf4, 0xf4, 0x80, 0x8f, 4}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (*s < rows[i].lo || *s > rows[i].hi) continue;
        if (rows[i].n > 1 && (s[1] < rows[i].lo2 || s[1] > rows[i].hi2)) return 0;
        for (int k = 2; k < rows[i].n; k++)
            if ((s[k] & 0xc0) != 0x80) return 0;
        return rows[i].n;
    }
    return 0;
}

static void put_string(FILE *f, const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    fputc('"', f);
    while (*s) {
        const int n = utf8_length(s);
        if (n == 0) fputs("\\ufffd", f);
        else if (*s == '"' || *s == '\\') fprintf(f, "\\%c", *s);
        else if (*s == '\n') fputs("\\n", f);
        else if (*s == '\t') fputs("\\t", f);
        else if (*s < 0x20) fprintf(f, "\\u%04x", *s);
        else fwrite(s, 1, (size_t)n, f);
        s += n ? n : 1;
    }
    fputc('"', f);
}

static void begin_value(struct json *j, const char *key)
{
    if (j->started) fputc(',', j->file);
    j->started = 1;
    if (key) {
        put_string(j->file, key);
        fputc(':', j->file);
    }
}

static void open_with(struct json *j, const char *key, char bracket)
{
    begin_value(j, key);
    fputc(bracket, j->file);
    j->started = 0;
}
static void close_with(struct json *j, char bracket)
{
    fputc(bracket, j->file);
    j->started = 1;
}
void json_object(struct json *j, const char *key) { open_with(j, key, '{'); }
void json_end_object(struct json *j) { close_with(j, '}'); }
void json_array(struct json *j, const char *key) { open_with(j, key, '['); }
void json_end_array(struct json *j) { close_with(j, ']'); }

void json_number(struct json *j, const char *key, double value)
{
    char text[32] = "null";
    begin_value(j, key);
    for (int digits = 15; isfinite(value) && digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    fputs(text, j->file);
}
void json_numbers(struct json *j, const char *key, size_t n, const double *values)
{
    json_array(j, key);
    for (size_t i = 0; i < n; i++) json_number(j, NULL, values[i]);
    json_end_array(j);
}
void json_integer(struct json *j, const char *key, int64_t value)
{
    begin_value(j, key);
    fprintf(j->file, "%" PRId64, value);
}
void json_seed(struct json *j, const char *key, uint64_t value)
{
    begin_value(j, key);
    fprintf(j->file, "%" PRIu64, value);
}
void json_text(struct json *j, const char *key, const char *value)
{
    begin_value(j, key);
    if (value) put_string(j->file, value);
    else fputs("null", j->file);
}
void json_bool(struct json *j, const char *key, int value)
{
    begin_value(j, key);
    fputs(value ? "true" : "false", j->file);
}
