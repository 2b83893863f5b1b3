/* SPDX-License-Identifier: Apache-2.0
 *
 * What the tests of pictures share: a context, a folder, a picture to write. */
#ifndef IMP_TEST_PICTURE_KIT_H
#define IMP_TEST_PICTURE_KIT_H

#include "format/image.h"
#include "imp_tap.h"
#include <stdlib.h>
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/importon-pictures-XXXXXX";

static inline const char *in_folder(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static inline int kit_open(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    return imp_context_create(&o, &ctx) == IMP_OK && mkdtemp(folder);
}
static inline int kit_close(void)
{
    char command[300];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) printf("# %s stays\n", folder);
    imp_context_destroy(ctx);
    return tap_done();
}

/* A picture whose every number is different, some beyond [0,1] and negative. */
static inline imp_film *sample(int width, int height, const char *names, bool with_se)
{
    imp_film *f = NULL;
    if (imp__film_create(ctx, width, height, names, with_se, &f) != IMP_OK) exit(1);
    for (size_t i = 0; i < imp__film_values(f); i++) {
        f->mean[i] = (float)sin((double)i) * 3;
        if (f->se) f->se[i] = (float)i * 0.01f;
    }
    return f;
}

#endif
