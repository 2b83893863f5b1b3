/* SPDX-License-Identifier: Apache-2.0
 *
 * The server behind `importon view`: token and Host of a request checked, wishes passed on, news
 * sent to each open stream (http.h). */
#include "http.h"

#include "http_server.h"

#include "shared/command.h"

#include <arpa/inet.h>
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>

static struct http_server mhd; /* since http_start */

/* Connections in all; of them without a request with the token, whose oldest goes when another
 * comes; seconds without a byte after which one is closed (not that of a page that listens). */
enum { TOKEN_BYTES = 16, CONNECTIONS = 64, GUESTS = 32, IDLE_S = 10 };

/* The last news of a channel. */
struct news {
    char *text; /* "event: NAME\ndata: TEXT\n\n" */
    size_t size;
    uint64_t number; /* grows with all news; 0: none yet */
};

/* A page that listens. */
struct stream {
    struct MHD_Connection *connection;
    struct stream *next;
    uint64_t sent[HTTP_CHANNELS]; /* number of the last news it got */
    char *text;                   /* being sent */
    size_t size, at;
    int waits; /* its connection is suspended */
};

/* A connection; in the list of guests until a request with the token came by it. */
struct guest {
    int fd, listed;
    struct guest *next;
};

static struct {
    struct MHD_Daemon *daemon;
    struct http_service service;
    char token[2 * TOKEN_BYTES + 1], host[32], origin[48], url[128];
    pthread_mutex_t lock; /* of what follows */
    struct news news[HTTP_CHANNELS];
    uint64_t number;
    struct stream *streams;
    int closing;
    /* The oldest first; used by the server's thread alone. */
    struct guest *guests;
    int n_guests;
} s = {.lock = PTHREAD_MUTEX_INITIALIZER};

/* ---- Access ------------------------------------------------------------------------ */

/* In a time that does not depend on how much of it is right. */
static int is_token(const char *text)
{
    unsigned char differs = 0;
    for (size_t i = 0; i < 2 * TOKEN_BYTES; i++) {
        if (!text[i]) return 0;
        differs |= (unsigned char)(text[i] ^ s.token[i]);
    }
    return !differs;
}

static const char *header(struct MHD_Connection *c, const char *name)
{
    return mhd.lookup_connection_value(c, MHD_HEADER_KIND, name);
}

/* What follows the token in the path; NULL with the status to answer. */
static const char *allowed(struct MHD_Connection *c, const char *path, unsigned *status)
{
    const char *host = header(c, "Host"), *origin = header(c, "Origin"),
               *site = header(c, "Sec-Fetch-Site");
    *status = MHD_HTTP_FORBIDDEN;
    if (!host || strcmp(host, s.host) != 0) return NULL;
    if (origin && strcmp(origin, s.origin) != 0) return NULL;
    if (site && strcmp(site, "same-origin") != 0 && strcmp(site, "none") != 0)
        return NULL;
    *status = MHD_HTTP_NOT_FOUND;
    if (path[0] != '/' || !is_token(path + 1)) return NULL;
    return path + 1 + 2 * TOKEN_BYTES;
}

/* ---- Guests ------------------------------------------------------------------------- */

/* Whoever can connect to this machine's loopback could hold all connections and send nothing: the
 * page would not be answered. So guests are few, and the oldest leaves for the next. */
static void guest_unlist(struct guest *g)
{
    struct guest **at = &s.guests;
    if (!g->listed) return;
    while (*at != g) at = &(*at)->next;
    *at = g->next;
    g->listed = 0;
    s.n_guests--;
}

static void guest_list(struct guest *g)
{
    struct guest **at = &s.guests;
    while (*at) at = &(*at)->next;
    *at = g;
    g->listed = 1;
    if (++s.n_guests <= GUESTS) return;
    struct guest *oldest = s.guests;
    guest_unlist(oldest);
    shutdown(oldest->fd, SHUT_RDWR); /* the server sees its end, and closes it */
}

static void on_connection(void *payload, struct MHD_Connection *c, void **context,
                          enum MHD_ConnectionNotificationCode what)
{
    (void)payload;
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            mhd.get_connection_info(c, MHD_CONNECTION_INFO_CONNECTION_FD);
        struct guest *g = info ? calloc(1, sizeof *g) : NULL;
        *context = g;
        if (!g) return;
        g->fd = info->connect_fd;
        guest_list(g);
    } else if (*context) {
        guest_unlist(*context);
        free(*context);
        *context = NULL;
    }
}

/* A request with the token came by this connection. */
static void guest_known(struct MHD_Connection *c)
{
    const union MHD_ConnectionInfo *info =
        mhd.get_connection_info(c, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    if (info && info->socket_context) guest_unlist(info->socket_context);
}

/* ---- Answers ------------------------------------------------------------------------ */

static enum MHD_Result answer(struct MHD_Connection *c, unsigned status,
                              struct MHD_Response *r, const char *type)
{
    static const char *const fixed[][2] = {
        {"Cache-Control", "no-store"},
        {"Referrer-Policy", "no-referrer"},
        {"X-Content-Type-Options", "nosniff"},
        {"X-Frame-Options", "DENY"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Cross-Origin-Opener-Policy", "same-origin"},
    };
    if (!r) return MHD_NO;
    for (size_t k = 0; k < sizeof fixed / sizeof *fixed; k++)
        (void)mhd.add_response_header(r, fixed[k][0], fixed[k][1]);
    (void)mhd.add_response_header(r, "Content-Type", type);
    const enum MHD_Result done = mhd.queue_response(c, status, r);
    mhd.destroy_response(r);
    return done;
}

static enum MHD_Result answer_text(struct MHD_Connection *c, unsigned status,
                                   const char *text)
{
    return answer(c, status,
                  mhd.create_response_from_buffer(strlen(text), (void *)(uintptr_t)text,
                                                  MHD_RESPMEM_MUST_COPY),
                  "text/plain; charset=utf-8");
}

/* ---- News ---------------------------------------------------------------------------- */

/* The oldest news that the stream has not got: copied into it. The lock is held. */
static int take_news(struct stream *t)
{
    int best = -1;
    for (int k = 0; k < HTTP_CHANNELS; k++)
        if (s.news[k].number > t->sent[k] &&
            (best < 0 || s.news[k].number < s.news[best].number))
            best = k;
    if (best < 0) return 0;
    free(t->text);
    t->text = malloc(s.news[best].size);
    if (!t->text) return 0;
    memcpy(t->text, s.news[best].text, s.news[best].size);
    t->size = s.news[best].size;
    t->at = 0;
    t->sent[best] = s.news[best].number;
    return 1;
}

static ssize_t read_news(void *payload, uint64_t offset, char *to, size_t room)
{
    struct stream *t = payload;
    ssize_t n = 0;
    (void)offset;
    pthread_mutex_lock(&s.lock);
    if (s.closing) n = MHD_CONTENT_READER_END_OF_STREAM;
    else if (t->at < t->size || take_news(t)) {
        n = (ssize_t)(t->size - t->at < room ? t->size - t->at : room);
        memcpy(to, t->text + t->at, (size_t)n);
        t->at += (size_t)n;
    } else {
        t->waits = 1;
        mhd.suspend_connection(t->connection);
    }
    pthread_mutex_unlock(&s.lock);
    return n;
}

static void stream_free(void *payload)
{
    struct stream *t = payload, **at = &s.streams;
    pthread_mutex_lock(&s.lock);
    while (*at && *at != t) at = &(*at)->next;
    if (*at) *at = t->next;
    pthread_mutex_unlock(&s.lock);
    free(t->text);
    free(t);
}

/* The lock is held. */
static void wake_all(void)
{
    for (struct stream *t = s.streams; t; t = t->next)
        if (t->waits) {
            t->waits = 0;
            mhd.resume_connection(t->connection);
        }
}

static enum MHD_Result listen_to(struct MHD_Connection *c)
{
    struct stream *t = calloc(1, sizeof *t);
    if (!t) return MHD_NO;
    t->connection = c;
    struct MHD_Response *r = mhd.create_response_from_callback(MHD_SIZE_UNKNOWN, 1 << 16,
                                                               read_news, t, stream_free);
    if (!r) {
        free(t);
        return MHD_NO;
    }
    pthread_mutex_lock(&s.lock);
    t->next = s.streams;
    s.streams = t;
    pthread_mutex_unlock(&s.lock);
    return answer(c, MHD_HTTP_OK, r, "text/event-stream");
}

void http_send(int channel, const char *event, char *text)
{
    for (char *line = text; (line = strpbrk(line, "\r\n"));) *line = ' ';
    char *all;
    const int n = asprintf(&all, "event: %s\ndata: %s\n\n", event, text);
    free(text);
    if (n < 0) return;
    pthread_mutex_lock(&s.lock);
    free(s.news[channel].text);
    s.news[channel] = (struct news){all, (size_t)n, ++s.number};
    wake_all();
    pthread_mutex_unlock(&s.lock);
}

/* ---- Requests ------------------------------------------------------------------------ */

static const char *argument(void *request, const char *name)
{
    return mhd.lookup_connection_value(request, MHD_GET_ARGUMENT_KIND, name);
}

static enum MHD_Result handle(void *payload, struct MHD_Connection *c, const char *path,
                              const char *method, const char *version, const char *upload,
                              size_t *upload_size, void **begun)
{
    unsigned status;
    (void)payload, (void)version, (void)upload;
    if (!*begun) { /* the head is here, a body may follow */
        *begun = &s;
        return MHD_YES;
    }
    if (*upload_size) { /* no request has a body that is read */
        *upload_size = 0;
        return MHD_YES;
    }
    const char *rest = allowed(c, path, &status);
    if (!rest)
        return answer_text(c, status,
                           status == MHD_HTTP_FORBIDDEN
                               ? "This address is for the page of importon alone.\n"
                               : "There is nothing here.\n");
    guest_known(c);
    const int gets = !strcmp(method, "GET"), posts = !strcmp(method, "POST");
    if (!strcmp(rest, "/") && gets)
        return answer(c, MHD_HTTP_OK,
                      mhd.create_response_from_buffer(s.service.page_size,
                                                      (void *)(uintptr_t)s.service.page,
                                                      MHD_RESPMEM_PERSISTENT),
                      "text/html; charset=utf-8");
    if (!strcmp(rest, "/events") && gets) return listen_to(c);
    if (!strcmp(rest, "/act") && posts) {
        const char *what = argument(c, "do");
        const char *wrong = s.service.act(what ? what : "", argument, c);
        return wrong ? answer_text(c, MHD_HTTP_BAD_REQUEST, wrong)
                     : answer_text(c, MHD_HTTP_OK, "done\n");
    }
    if (!strcmp(rest, "/") || !strcmp(rest, "/events") || !strcmp(rest, "/act"))
        return answer_text(c, MHD_HTTP_METHOD_NOT_ALLOWED, "Not by this method.\n");
    return answer_text(c, MHD_HTTP_NOT_FOUND, "There is nothing here.\n");
}

/* ---- Beginning and end --------------------------------------------------------------- */

static int token_make(void)
{
    unsigned char bytes[TOKEN_BYTES];
    for (size_t done = 0; done < sizeof bytes;) {
        const ssize_t n = getrandom(bytes + done, sizeof bytes - done, 0);
        if (n < 0 && errno != EINTR)
            return cli_error(EXIT_RUN, "no random numbers: %s", strerror(errno));
        if (n > 0) done += (size_t)n;
    }
    for (size_t i = 0; i < sizeof bytes; i++) sprintf(s.token + 2 * i, "%02x", bytes[i]);
    return 0;
}

int http_open(const struct http_service *service, int port)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int rc = token_make();
    if (rc) return rc;
    const int found = http_server_find(&mhd);
    if (found) return found;
    s.service = *service;
    s.closing = 0;
    errno = 0;
    s.daemon = mhd.start_daemon(
        MHD_USE_INTERNAL_POLLING_THREAD | MHD_ALLOW_SUSPEND_RESUME, 0, NULL, NULL, handle,
        NULL, MHD_OPTION_SOCK_ADDR, &at, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)IDLE_S,
        MHD_OPTION_NOTIFY_CONNECTION, on_connection, NULL, MHD_OPTION_END);
    if (!s.daemon)
        return cli_error(EXIT_RUN, "127.0.0.1:%d cannot be listened on: %s", port,
                         errno ? strerror(errno) : "the server does not start");
    const union MHD_DaemonInfo *info =
        mhd.get_daemon_info(s.daemon, MHD_DAEMON_INFO_BIND_PORT);
    snprintf(s.host, sizeof s.host, "127.0.0.1:%u", info ? info->port : (unsigned)port);
    snprintf(s.origin, sizeof s.origin, "http://%s", s.host);
    snprintf(s.url, sizeof s.url, "%s/%s/", s.origin, s.token);
    return 0;
}

const char *http_url(void) { return s.url; }

void http_close(void)
{
    if (!s.daemon) return;
    pthread_mutex_lock(&s.lock);
    s.closing = 1;
    wake_all();
    pthread_mutex_unlock(&s.lock);
    mhd.stop_daemon(s.daemon);
    s.daemon = NULL;
    for (int k = 0; k < HTTP_CHANNELS; k++) {
        free(s.news[k].text);
        s.news[k] = (struct news){0};
    }
}
