/* SPDX-License-Identifier: Apache-2.0
 *
 * GNU libmicrohttpd's functions that http.c calls, found when a page is first served: the
 * library brings GnuTLS with it, 3 MiB that no other command should pay for. */
#ifndef IMP_CLI_HTTP_SERVER_H
#define IMP_CLI_HTTP_SERVER_H

#include <microhttpd.h>

#define HTTP_FUNCTIONS(X)                                                                \
    X(lookup_connection_value)                                                           \
    X(add_response_header)                                                               \
    X(queue_response)                                                                    \
    X(destroy_response)                                                                  \
    X(create_response_from_buffer)                                                       \
    X(create_response_from_callback)                                                     \
    X(suspend_connection)                                                                \
    X(resume_connection)                                                                 \
    X(start_daemon)                                                                      \
    X(get_daemon_info)                                                                   \
    X(get_connection_info)                                                               \
    X(stop_daemon)

struct http_server {
#define HTTP_POINTER(name) __typeof__(&MHD_##name) name;
    HTTP_FUNCTIONS(HTTP_POINTER)
#undef HTTP_POINTER
};

/* 0, or an exit code with the reason printed. */
int http_server_find(struct http_server *out);

#endif
