/* SPDX-License-Identifier: Apache-2.0
 *
 * A page for the person at this machine: served on a loopback address alone, under a
 * random token that only the address printed to the terminal contains; requests whose Host or
 * Origin is another are refused (a page of somebody else's may send requests to any
 * address, and a name of theirs may lead here). News go to the page as server-sent
 * events. HTTP itself is libmicrohttpd's; its thread calls back. */
#ifndef IMP_CLI_HTTP_H
#define IMP_CLI_HTTP_H

#include <stddef.h>

/* The value of a request's argument; NULL: not given. Valid during the call. */
typedef const char *(*http_argument_fn)(void *request, const char *name);

struct http_service {
    /* The page, which is copied. */
    const char *page;
    size_t page_size;
    /* A request of the page, POST act?do=WHAT&...: 0, or a reason to refuse it. */
    const char *(*act)(const char *what, http_argument_fn argument, void *request);
};

/* Listen on 127.0.0.1, port 0: any that is free. 0, or an exit code with the reason
 * printed. */
int http_open(const struct http_service *service, int port);
/* The address of the page, with its token. */
const char *http_url(void);
/* Send to all pages: an event of this name with this text (JSON; malloc'ed, taken over). Of
 * each channel, a small number, a page that comes late or is slow gets the last one
 * alone. */
enum { HTTP_CHANNELS = 16 };
void http_send(int channel, const char *event, char *text);
void http_close(void);

#endif
