/* SPDX-License-Identifier: Apache-2.0
 *
 * Values in a JSON text that imp__json_valid has accepted. A value is a pointer to its first byte;
 * NULL is one that is not there, and every function takes it. */
#ifndef IMP_REPORT_JSON_WALK_H
#define IMP_REPORT_JSON_WALK_H

#include "base/text.h"

/* The member of an object; keys are compared as they are written. */
const char *imp__json_member(const char *object, const char *key);
/* The member whose key is this string. */
const char *imp__json_member_of(const char *object, const char *string);
/* The first element of an array, or the key of the first member of an object, and what follows. */
const char *imp__json_first(const char *container);
const char *imp__json_next(const char *value);
/* The value of a member, by its key. */
const char *imp__json_value_of(const char *key);

/* NAN for what is no number. */
double imp__json_number(const char *value);
bool imp__json_is_string(const char *value);
bool imp__json_is_true(const char *value);
bool imp__json_is_false(const char *value);

/* A string as text of HTML: no byte of it can become markup. */
void imp__html_json(struct imp_text *t, const char *string);
void imp__html_text(struct imp_text *t, const char *text);

#endif
