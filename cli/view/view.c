/* SPDX-License-Identifier: Apache-2.0
 *
 * State of a view that page and command share: wishes from the server's thread, items and progress
 * for the page. */
#include "view.h"

#include "http.h"
#include "shared/walk_items.h"
#include "text/progress.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Channels that are no items. */
enum { CHANNEL_STATE = 0, CHANNEL_PROGRESS, CHANNEL_NUMBERS };

static struct {
    struct view_kind kind;
    char *page;
    bool open;
    enum view_state state; /* of the working thread */
    /* What follows belongs to the lock. */
    pthread_mutex_t lock;
    pthread_cond_t changed;
    struct view_wish wish;
    struct view_number *number;
    size_t n;
    double *wanted; /* [n] */
} v = {.lock = PTHREAD_MUTEX_INITIALIZER, .changed = PTHREAD_COND_INITIALIZER};

/* ---- Wishes, in the server's thread ------------------------------------------------- */

/* A number's value from the page: name and value. The lock is held. */
static const char *move(const char *name, const char *text)
{
    char *end;
    const double value = text ? strtod(text, &end) : NAN;
    if (!name || !text || end == text || *end || !isfinite(value))
        return "a name and a number are wanted\n";
    for (size_t i = 0; i < v.n; i++) {
        if (strcmp(v.number[i].name, name) != 0) continue;
        if (value < v.number[i].lo || value > v.number[i].hi)
            return "the value is outside its bounds\n";
        v.wanted[i] = value;
        v.wish.moved = 1;
        return NULL;
    }
    return "there is no such number\n";
}

static const char *pixel(const char *x, const char *y)
{
    char *ends[2];
    if (!x || !y) return "x and y are wanted\n";
    const long at[2] = {strtol(x, &ends[0], 10), strtol(y, &ends[1], 10)};
    for (int k = 0; k < 2; k++)
        if (*ends[k] || at[k] < 0 || at[k] > 1 << 24) return "no such pixel\n";
    v.wish.pixel[0] = (int)at[0];
    v.wish.pixel[1] = (int)at[1];
    v.wish.walks = 1;
    return NULL;
}

static const char *act(const char *what, http_argument_fn argument, void *request)
{
    const char *wrong = NULL;
    pthread_mutex_lock(&v.lock);
    if (!strcmp(what, "stop")) v.wish.stop = 1, v.wish.go = v.wish.again = 0;
    else if (!strcmp(what, "go")) v.wish.go = 1, v.wish.stop = 0;
    else if (!strcmp(what, "again") && v.kind.again) v.wish.again = 1, v.wish.stop = 0;
    else if (!strcmp(what, "save") && v.kind.target) v.wish.save = 1;
    else if (!strcmp(what, "set"))
        wrong = move(argument(request, "name"), argument(request, "value"));
    else if (!strcmp(what, "walks") && v.kind.walks)
        wrong = pixel(argument(request, "x"), argument(request, "y"));
    else wrong = "this view does not do that\n";
    pthread_cond_signal(&v.changed);
    pthread_mutex_unlock(&v.lock);
    return wrong;
}

/* ---- Wishes, in the working thread --------------------------------------------------- */

static bool stops(const struct view_wish *w)
{
    return w->stop || w->again || w->save || w->moved || w->end;
}

int view_asked(void)
{
    pthread_mutex_lock(&v.lock);
    v.wish.end |= progress_interrupted() != 0;
    const int asked = stops(&v.wish);
    pthread_mutex_unlock(&v.lock);
    return asked;
}

struct view_wish view_take(void)
{
    pthread_mutex_lock(&v.lock);
    const struct view_wish w = v.wish;
    v.wish = (struct view_wish){.end = w.end};
    pthread_mutex_unlock(&v.lock);
    return w;
}

/* Signals do not wake a thread that waits, so it polls. */
struct view_wish view_wait(void)
{
    pthread_mutex_lock(&v.lock);
    for (;;) {
        v.wish.end |= progress_interrupted() != 0;
        if (stops(&v.wish) || v.wish.go || v.wish.walks) break;
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += 100000000;
        if (until.tv_nsec >= 1000000000) until.tv_nsec -= 1000000000, until.tv_sec++;
        pthread_cond_timedwait(&v.changed, &v.lock, &until);
    }
    pthread_mutex_unlock(&v.lock);
    return view_take();
}

void view_values(double *value)
{
    pthread_mutex_lock(&v.lock);
    memcpy(value, v.wanted, v.n * sizeof *value);
    pthread_mutex_unlock(&v.lock);
}

/* ---- What is shown ------------------------------------------------------------------- */

struct json view_stream(char **text, size_t *size)
{
    FILE *f = open_memstream(text, size);
    if (!f) exit(cli_error(EXIT_RUN, "out of memory"));
    return (struct json){f, 0};
}

static void send_progress(const struct imp_progress *p)
{
    char *text;
    size_t size;
    struct json j = view_stream(&text, &size);
    json_object(&j, NULL);
    json_text(&j, "stage", p->stage);
    json_number(&j, "fraction", p->fraction);
    json_number(&j, "elapsed_s", p->elapsed_s);
    json_number(&j, "eta_s", p->eta_s >= 0 ? p->eta_s : NAN);
    json_number(&j, "rate", p->rate);
    json_text(&j, "rate_unit", p->rate_unit);
    json_text(&j, "note", p->note);
    json_end_object(&j);
    fclose(j.file);
    http_send(CHANNEL_PROGRESS, "progress", text);
}

int view_progress(const struct imp_progress *p, void *payload)
{
    send_progress(p);
    pthread_mutex_lock(&v.lock);
    const int walks = v.wish.walks, at[2] = {v.wish.pixel[0], v.wish.pixel[1]};
    v.wish.walks = 0;
    pthread_mutex_unlock(&v.lock);
    if (walks) view_walks(at);
    return progress_report(p, payload) || view_asked();
}

void view_state(enum view_state state, const char *message)
{
    static const char *const words[] = {"running", "stopped", "done"};
    char *text;
    size_t size;
    struct json j = view_stream(&text, &size);
    v.state = state;
    json_object(&j, NULL);
    json_text(&j, "state", words[state]);
    json_text(&j, "what", v.kind.what);
    json_text(&j, "message", message);
    json_text(&j, "target", v.kind.target);
    json_bool(&j, "again", v.kind.again);
    json_bool(&j, "walks", v.kind.walks);
    json_end_object(&j);
    fclose(j.file);
    http_send(CHANNEL_STATE, "state", text);
}

const char *view_unit(const struct imp_param_info *info, size_t e)
{
    if (strcmp(info->unit, "scene units, radians") != 0) return info->unit;
    return e < 3 ? "scene units" : "radians";
}

double view_reach(const struct imp_param_info *info, size_t e)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    double diagonal = 0;
    const char *unit = view_unit(info, e);
    if (!strcmp(unit, "radians")) return 3.14159265358979;
    if (strcmp(unit, "scene units") != 0 ||
        imp_scene_get_info(cli.scene, &scene) != IMP_OK)
        return 0;
    for (int k = 0; k < 3; k++)
        diagonal = hypot(diagonal, scene.bounds_max[k] - scene.bounds_min[k]);
    return diagonal / 4;
}

void view_numbers(struct view_number *number, size_t n)
{
    pthread_mutex_lock(&v.lock);
    v.number = number;
    v.n = n;
    v.wanted = cli_alloc(n, sizeof *v.wanted);
    pthread_mutex_unlock(&v.lock);
}

void view_numbers_are(const double *value)
{
    char *text;
    size_t size;
    struct json j = view_stream(&text, &size);
    json_array(&j, NULL);
    pthread_mutex_lock(&v.lock);
    for (size_t i = 0; i < v.n; i++) {
        struct view_number *a = &v.number[i];
        a->value = value[i];
        if (!v.wish.moved) v.wanted[i] = value[i];
        json_object(&j, NULL);
        json_text(&j, "name", a->name);
        json_text(&j, "unit", a->unit);
        json_number(&j, "min", a->lo);
        json_number(&j, "max", a->hi);
        json_number(&j, "start", a->start);
        json_number(&j, "value", a->value);
        json_number(&j, "reach", a->reach);
        json_end_object(&j);
    }
    pthread_mutex_unlock(&v.lock);
    json_end_array(&j);
    fclose(j.file);
    http_send(CHANNEL_NUMBERS, "numbers", text);
}

void view_show(enum view_channel channel, const struct imp_report_item *items, size_t n)
{
    struct imp_report report = IMP_REPORT_INIT;
    char *text = NULL;
    report.items = items;
    report.n_items = n;
    if (imp_report_data(cli.context, &report, &text, NULL) != IMP_OK) {
        progress_clear();
        cli_say("importon: the page misses something: %s", imp_last_error(cli.context));
        return;
    }
    http_send((int)channel, "report", cli_strdup(text));
    imp_free(cli.context, text);
}

void view_show_json(enum view_channel channel, const char *kind, const char *name,
                    char *json)
{
    struct imp_report_item item = IMP_REPORT_ITEM_INIT;
    item.kind = kind;
    item.name = name;
    item.json = json;
    view_show(channel, &item, 1);
    free(json);
}

void view_show_places(struct json *j, char **text)
{
    json_end_object(j);
    fclose(j->file);
    if (!strcmp(*text, "{}")) { /* what the page has is no longer in the picture */
        free(*text);
        *text = cli_strdup("{\"places\":[]}");
    }
    view_show_json(VIEW_PLACES, "places", NULL, *text);
}

void view_show_film(enum view_channel channel, const imp_film *film, const char *name,
                    const char *role, int view)
{
    struct imp_report_item item = IMP_REPORT_ITEM_INIT;
    item.kind = "picture";
    item.name = name;
    item.role = role;
    item.view = view;
    item.film = film;
    view_show(channel, &item, 1);
}

void view_walks(const int pixel[2])
{
    enum { COUNT = 16 };
    const struct imp_run run = cli_run();
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    const int at[1][2] = {{pixel[0], pixel[1]}};
    char name[64];
    int rc;
    if (imp_scene_get_sensor(cli.scene, run.sensor, &sensor) != IMP_OK ||
        pixel[0] >= sensor.width || pixel[1] >= sensor.height)
        return;
    char *text = walks_json(&run, 1, at, COUNT, &rc);
    snprintf(name, sizeof name, "pixel %d, %d", pixel[0], pixel[1]);
    if (text) view_show_json(VIEW_WALKS, "walks", name, text);
}

/* ---- Beginning and end ---------------------------------------------------------------- */

/* The command as typed, for the page. */
static char *command_line(void)
{
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (!f) exit(cli_error(EXIT_RUN, "out of memory"));
    fprintf(f, "importon");
    for (int i = 0; i < cli.argc; i++) fprintf(f, " %s", cli.argv[i]);
    fclose(f);
    return text;
}

int view_open(const struct view_kind *kind, int port)
{
    struct imp_report report = IMP_REPORT_INIT;
    struct http_service service = {.act = act};
    char *command = command_line();
    v.kind = *kind;
    report.title = cli.scene_path;
    report.command = command;
    report.live = 1;
    const enum imp_status st =
        imp_report_page(cli.context, &report, &v.page, &service.page_size);
    free(command);
    if (st != IMP_OK) return cli_fail(st, NULL);
    service.page = v.page;
    const int rc = http_open(&service, port);
    if (rc) return rc;
    v.open = true;
    printf("%s\n", http_url());
    fflush(stdout);
    cli_say("open this address in a browser of this machine; Ctrl-C ends the view");
    return 0;
}

void view_close(void)
{
    if (v.open) http_close();
    v.open = false;
    imp_free(cli.context, v.page);
    for (size_t i = 0; i < v.n; i++) free(v.number[i].name);
    free(v.number);
    free(v.wanted);
    v.number = NULL;
    v.wanted = NULL;
    v.page = NULL;
    v.n = 0;
}
