/* SPDX-License-Identifier: Apache-2.0
 *
 * libmicrohttpd opened by its name, and the functions of http_server.h found in it. */
#include "http_server.h"

#include "shared/command.h"

#include <dlfcn.h>
#include <string.h>

#define LIBRARY "libmicrohttpd.so.12"

int http_server_find(struct http_server *out)
{
    void *library = dlopen(LIBRARY, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!library) return cli_error(EXIT_RUN, "view needs %s: %s", LIBRARY, dlerror());
    const struct {
        const char *name;
        void *to;
    } functions[] = {
#define HTTP_NAME(name) {"MHD_" #name, &out->name},
        HTTP_FUNCTIONS(HTTP_NAME)
#undef HTTP_NAME
    };
    for (size_t k = 0; k < sizeof functions / sizeof functions[0]; k++) {
        void *f = dlsym(library, functions[k].name);
        if (!f) return cli_error(EXIT_RUN, "%s has no %s", LIBRARY, functions[k].name);
        memcpy(functions[k].to, &f, sizeof f);
    }
    return 0;
}
