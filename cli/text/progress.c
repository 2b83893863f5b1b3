/* SPDX-License-Identifier: Apache-2.0
 *
 * Progress bar, time limit, and signals that stop a run. */
#include "progress.h"

#include <math.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Written by a signal's handler, in whichever thread it comes, and read by all: atomic objects
 * without a lock may be both (C11 7.14.1.1). */
_Static_assert(ATOMIC_INT_LOCK_FREE == 2, "int is atomic without a lock");
static _Atomic int stop_asked;  /* the library shall stop */
static _Atomic int interrupted; /* by this signal */
static int show, drawn;
static double deadline; /* on the monotonic clock; 0: none */

static void on_interrupt(int signal_number)
{
    stop_asked = 1;
    interrupted = signal_number;
}

void progress_init(enum progress_mode mode)
{
    /* SA_RESETHAND: the second signal finds the default action, which ends the process.
     */
    const struct sigaction action = {.sa_handler = on_interrupt,
                                     .sa_flags = SA_RESETHAND};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    struct sigaction before; /* nohup ignores it */
    if (sigaction(SIGHUP, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
        sigaction(SIGHUP, &action, NULL);
    signal(SIGXFSZ, SIG_IGN); /* over a size limit writes fail, as on a full disk */
    show = mode == PROGRESS_ALWAYS || (mode == PROGRESS_AUTO && isatty(STDERR_FILENO));
}
int progress_interrupted(void) { return interrupted; }
void progress_resume(void)
{
    stop_asked = 0;
    deadline = 0;
}

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
void progress_deadline(double seconds)
{
    deadline = seconds > 0 ? seconds_now() + seconds : 0;
}
static int shall_stop(void)
{
    return stop_asked || (deadline > 0 && seconds_now() > deadline);
}

void progress_clear(void)
{
    if (drawn) fputs("\r\033[K", stderr);
    drawn = 0;
}

static void format_time(double seconds, char *text, size_t size)
{
    const long s = lround(seconds);
    if (!(seconds >= 0) || seconds > 1e7) snprintf(text, size, "--:--");
    else if (s < 3600) snprintf(text, size, "%ld:%02ld", s / 60, s % 60);
    else snprintf(text, size, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
}

static void format_rate(double rate, const char *unit, char *text, size_t size)
{
    static const char prefix[] = " kMGT";
    int k = 0;
    if (!(rate > 0) || !unit) {
        text[0] = 0;
        return;
    }
    for (; rate >= 1000 && k < 4; k++) rate /= 1000;
    snprintf(text, size, "%.3g %.*s%s/s", rate, k > 0, prefix + k, unit);
}

int progress_report(const struct imp_progress *p, void *payload)
{
    enum { WIDTH = 24 };
    char bar[WIDTH + 1], eta[64], elapsed[64], rate[48];
    (void)payload;
    if (!show) return shall_stop();
    const double fraction = fmin(fmax(p->fraction, 0), 1);
    const int full = (int)(fraction * WIDTH + 0.5);
    memset(bar, '#', (size_t)full);
    memset(bar + full, '.', (size_t)(WIDTH - full));
    bar[WIDTH] = 0;
    format_time(p->eta_s, eta, sizeof eta);
    format_time(p->elapsed_s, elapsed, sizeof elapsed);
    format_rate(p->rate, p->rate_unit, rate, sizeof rate);
    fprintf(stderr, "\r\033[K%-9s [%s] %3.0f%% %s ETA %s%s%s%s%s",
            p->stage ? p->stage : "", bar, 100 * fraction, elapsed, eta,
            rate[0] ? "  " : "", rate, p->note ? "  " : "", p->note ? p->note : "");
    fflush(stderr);
    drawn = 1;
    return shall_stop();
}
