/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures sent to tev over TCP: packets CreateImage and UpdateImage. */
#include "display.h"

#include "command.h"
#include "text/progress.h"

#include <errno.h>
#include <netdb.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

enum { CREATE_IMAGE = 4, UPDATE_IMAGE = 6 }; /* packets */
enum { ROWS_BYTES = 1 << 20 };               /* pixels of one packet, about */
enum { PATIENCE_S = 10 }; /* longest wait for a viewer; then the run goes on alone */

static struct {
    int socket;
    char *name; /* of the picture that was created last, */
    int width, height, channels;
} shown = {.socket = -1};

/* ---- Packets: little-endian, the length of all of it first ------------------------ */

struct packet {
    unsigned char *bytes;
    size_t n, room;
};

static void add(struct packet *p, const void *data, size_t n)
{
    if (p->n + n > p->room) {
        p->room = 2 * (p->n + n);
        p->bytes = realloc(p->bytes, p->room);
        if (!p->bytes) exit(cli_error(EXIT_RUN, "out of memory"));
    }
    memcpy(p->bytes + p->n, data, n);
    p->n += n;
}
static void add_number(struct packet *p, int64_t value, int bytes)
{
    for (int k = 0; k < bytes; k++)
        add(p, &(unsigned char){(unsigned char)((uint64_t)value >> 8 * k)}, 1);
}
static void add_text(struct packet *p, const char *text)
{
    add(p, text, strlen(text) + 1);
}
static void begin(struct packet *p, int kind, const char *name)
{
    p->n = 0;
    add_number(p, 0, 4);
    add_number(p, kind, 1);
    add_number(p, 0, 1); /* does not grab the focus */
    add_text(p, name);
}

static void lose(const char *what)
{
    cli_say("importon: warning: the viewer of --display is gone: %s", what);
    close(shown.socket);
    shown.socket = -1;
}

/* Wait until the viewer takes more: for PATIENCE_S at most, and until a signal comes,
 * which may reach any thread, so that poll alone need not be interrupted. */
static void await_viewer(void)
{
    struct pollfd viewer = {.fd = shown.socket, .events = POLLOUT};
    for (int slice = 0; slice < PATIENCE_S * 10; slice++) {
        const int n = poll(&viewer, 1, 100);
        if (n > 0) return;
        if (progress_interrupted()) {
            lose("interrupted");
            return;
        }
    }
    lose("it reads nothing");
}

static void send_packet(struct packet *p)
{
    for (int k = 0; k < 4; k++) p->bytes[k] = (unsigned char)(p->n >> 8 * k);
    for (size_t done = 0; done < p->n && shown.socket >= 0;) {
        const ssize_t n =
            send(shown.socket, p->bytes + done, p->n - done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n >= 0) done += (size_t)n;
        else if (errno == EAGAIN || errno == EWOULDBLOCK) await_viewer();
        else if (errno != EINTR) lose(strerror(errno));
    }
}

/* ---- Pictures ---------------------------------------------------------------------- */

static void add_names(struct packet *p, const imp_film *film, int channels, int se)
{
    char text[256];
    add_number(p, channels * (1 + se), 4);
    for (int k = 0; k <= se; k++)
        for (int c = 0; c < channels; c++) {
            snprintf(text, sizeof text, "%s%s", k ? "se." : "",
                     imp_film_channel(film, c));
            add_text(p, text);
        }
}

static void add_floats(struct packet *p, const float *values, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        add_number(p, bits, 4);
    }
}

static void create(struct packet *p, const imp_film *film, const char *name,
                   const struct imp_film_info *info)
{
    if (shown.name && !strcmp(shown.name, name) && shown.width == info->width &&
        shown.height == info->height && shown.channels == info->channels)
        return;
    begin(p, CREATE_IMAGE, name);
    add_number(p, info->width, 4);
    add_number(p, info->height, 4);
    add_names(p, film, info->channels, info->has_se);
    send_packet(p);
    free(shown.name);
    shown.name = strdup(name);
    shown.width = info->width;
    shown.height = info->height;
    shown.channels = info->channels;
}

void display_film(const imp_film *film, const char *name)
{
    struct imp_film_info info = {.size = sizeof info};
    struct packet p = {NULL, 0, 0};
    if (shown.socket < 0 || imp_film_get_info(film, &info) != IMP_OK) return;
    const size_t c = (size_t)info.channels, row = (size_t)info.width * c;
    const int rows =
        row * sizeof(float) < ROWS_BYTES ? (int)(ROWS_BYTES / (row * sizeof(float))) : 1;
    const float *planes[2] = {imp_film_mean((imp_film *)(uintptr_t)film),
                              imp_film_se((imp_film *)(uintptr_t)film)};
    const int sets = planes[1] ? 2 : 1;
    create(&p, film, name, &info);
    for (int y = 0; y < info.height && shown.socket >= 0; y += rows) {
        const int n = info.height - y < rows ? info.height - y : rows;
        const int64_t set = (int64_t)row * n;
        begin(&p, UPDATE_IMAGE, name);
        add_names(&p, film, info.channels, sets - 1);
        add_number(&p, 0, 4);
        add_number(&p, y, 4);
        add_number(&p, info.width, 4);
        add_number(&p, n, 4);
        /* Each channel: its first number, and the distance from pixel to pixel. */
        for (int k = 0; k < sets; k++)
            for (int i = 0; i < info.channels; i++) add_number(&p, k * set + i, 8);
        for (int k = 0; k < sets * info.channels; k++) add_number(&p, info.channels, 8);
        for (int k = 0; k < sets; k++)
            add_floats(&p, planes[k] + (size_t)y * row, (size_t)set);
        send_packet(&p);
    }
    free(p.bytes);
}

void display_preview(const imp_film *film, void *payload) { display_film(film, payload); }

/* ---- The connection ---------------------------------------------------------------- */

int display_open(void)
{
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *found = NULL;
    if (!cli.display || shown.socket >= 0) return 0;
    const char *colon = strrchr(cli.display, ':');
    if (!colon || colon == cli.display || !colon[1])
        return cli_error(EXIT_USAGE, "--display %s: HOST:PORT is wanted", cli.display);
    char *host = strndup(cli.display, (size_t)(colon - cli.display));
    const int wrong = host ? getaddrinfo(host, colon + 1, &hints, &found) : EAI_MEMORY;
    int code = 0;
    for (struct addrinfo *a = found; a && !wrong && shown.socket < 0; a = a->ai_next) {
        shown.socket = socket(a->ai_family, a->ai_socktype, a->ai_protocol);
        /* The time-out is that of connect. */
        const struct timeval patience = {.tv_sec = PATIENCE_S};
        if (shown.socket >= 0)
            (void)setsockopt(shown.socket, SOL_SOCKET, SO_SNDTIMEO, &patience,
                             sizeof patience);
        if (shown.socket >= 0 && connect(shown.socket, a->ai_addr, a->ai_addrlen) == 0)
            break;
        code = errno == EINPROGRESS ? ETIMEDOUT : errno;
        if (shown.socket >= 0) close(shown.socket);
        shown.socket = -1;
    }
    if (found) freeaddrinfo(found);
    free(host);
    if (shown.socket >= 0) return 0;
    return cli_error(EXIT_RUN, "--display %s: %s", cli.display,
                     wrong ? gai_strerror(wrong) : strerror(code));
}

void display_close(void)
{
    if (shown.socket >= 0) close(shown.socket);
    free(shown.name);
    shown.socket = -1;
    shown.name = NULL;
}
