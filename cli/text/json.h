/* SPDX-License-Identifier: Apache-2.0
 *
 * A JSON writer: always valid JSON, on one line. What is not finite becomes null. `key`
 * is NULL inside arrays and for the outermost value. */
#ifndef IMP_CLI_JSON_H
#define IMP_CLI_JSON_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct json {
    FILE *file;
    int started; /* something precedes in the open object or array */
};

void json_object(struct json *j, const char *key);
void json_end_object(struct json *j);
void json_array(struct json *j, const char *key);
void json_end_array(struct json *j);
/* The shortest decimal that reads back as the same double. */
void json_number(struct json *j, const char *key, double value);
void json_numbers(struct json *j, const char *key, size_t n, const double *values);
void json_integer(struct json *j, const char *key, int64_t value);
void json_seed(struct json *j, const char *key, uint64_t value);
/* NULL becomes null. Bytes that are no UTF-8 become U+FFFD. */
void json_text(struct json *j, const char *key, const char *value);
void json_bool(struct json *j, const char *key, int value);

#endif
