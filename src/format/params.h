/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters of a scene file: -D name=value, <default>, and $name in attribute values
 * (docs/scene-format.md 1.3). */
#ifndef IMP_FORMAT_PARAMS_H
#define IMP_FORMAT_PARAMS_H

#include "base/arena.h"

struct imp_params {
    imp_context *ctx;
    struct imp_arena arena;
    struct imp_variable { /* by falling length of the name: the longest match comes first
                           */
        const char *name, *value;
        size_t length;
        bool given, used; /* by the caller; somewhere in the file */
        bool assumed;     /* by the reader of an included file: nobody gave it */
    } * at;
    size_t n, capacity;
    size_t expanded; /* bytes written by expansion so far */
};

/* defines [n] "name=value"; the last of equal names counts. @return IMP_E_ARG if
 * malformed. */
enum imp_status imp__params_init(struct imp_params *p, imp_context *ctx,
                                 const char *const *defines, size_t n);
void imp__params_free(struct imp_params *p);
/* <default>: sets the value unless the caller gave one. */
enum imp_status imp__params_default(struct imp_params *p, const char *name,
                                    const char *value);
/* The same by the reader of an included file. */
enum imp_status imp__params_assume(struct imp_params *p, const char *name,
                                   const char *value);
bool imp__params_assumed(const struct imp_params *p, const char *name);
/* Replace $name and \$. *out is `text` itself if nothing had to be done, else lives in
 * `scratch`. The message has no location. */
enum imp_status imp__params_expand(struct imp_params *p, struct imp_arena *scratch,
                                   const char *text, const char **out);
/* A parameter of the caller that nothing used, or NULL; `meant` is the nearest name that
 * the file gives a default, or NULL. */
const char *imp__params_unused(const struct imp_params *p, const char **meant);

#endif
