/* SPDX-License-Identifier: Apache-2.0
 *
 * The layout of kinds.h as a plug-in was compiled with it, compared with that of this
 * library: the version, and the size of every struct by the rule of its list. */
#include "layout.h"
#include "base/arguments.h"
#include <string.h>

#define SIZES_MAX 4096 /* a list that is longer has not been initialised */

const struct imp_kinds_layout *imp_kinds_of_library(void) { return imp_kinds_here(); }

/* Does a struct of this name grow at its end? False where it must be as here. */
static bool grows(const char *name)
{
#define GROWS(one)                                                                       \
    if (strcmp(name, #one) == 0) return true;
#define STAYS(one)
    IMP_KINDS_STRUCTS(GROWS, STAYS)
#undef GROWS
#undef STAYS
    return false;
}

/* Size of a struct of this library; 0: it has none of this name. */
static size_t size_here(const char *name)
{
    const struct imp_kinds_layout *here = imp_kinds_here();
    for (int i = 0; i < here->n; i++)
        if (strcmp(here->structs[i].name, name) == 0) return here->structs[i].size;
    return 0;
}

static bool fits(const struct imp_struct_size *there)
{
    const size_t here = size_here(there->name);
    return there->size == here || (there->size < here && grows(there->name));
}

enum imp_status imp__kinds_layout_check(imp_context *ctx, const char *function,
                                        const struct imp_kinds_layout *there)
{
    const char *const advice = "compile it with the kinds.h of this library";
    const struct imp_struct_size *bad = NULL;
    const bool whole = there->structs && there->n > 0 && there->n <= SIZES_MAX;
    if (!whole && there->version == IMP_KINDS_VERSION)
        return imp__error(ctx, IMP_E_ARG, "%s: layout has no sizes", function);
    for (int i = 0; whole && i < there->n && !bad; i++) {
        if (!there->structs[i].name)
            return imp__error(ctx, IMP_E_ARG, "%s: layout: struct %d has no name",
                              function, i);
        if (!fits(&there->structs[i])) bad = &there->structs[i];
    }
    if (bad)
        return imp__error(ctx, IMP_E_ARG,
                          "%s: layout: struct %s has %zu bytes there and %zu here: the "
                          "kind was compiled with another kinds.h, of version %d, and "
                          "this library with version %d; %s",
                          function, bad->name, bad->size, size_here(bad->name),
                          there->version, IMP_KINDS_VERSION, advice);
    if (there->version != IMP_KINDS_VERSION)
        return imp__error(ctx, IMP_E_ARG,
                          "%s: layout: the kind was compiled with another kinds.h, of "
                          "version %d, and this library with version %d; %s",
                          function, there->version, IMP_KINDS_VERSION, advice);
    return IMP_OK;
}
