/* SPDX-License-Identifier: Apache-2.0
 *
 * What the views of importon view share: wishes that come from the page, and what is
 * shown there. The page and its server are set up by view_open; one thread, the one that
 * called it, works and shows; the server's thread only takes wishes. */
#ifndef IMP_CLI_VIEW_H
#define IMP_CLI_VIEW_H

#include "shared/command.h"
#include <importon/report.h>

/* A value with a slider. */
struct view_number {
    char *name; /* owned */
    const char *unit;
    double lo, hi; /* bounds, may be infinite */
    double start, value;
    double
        reach; /* of its slider where it has no bounds, to both sides; 0: by the value */
};

/* Wishes of a page, until they are taken. */
struct view_wish {
    int stop;  /* what runs */
    int go;    /* go on with it */
    int again; /* begin it anew, at the present values */
    int save;
    int moved;           /* numbers: see view_values */
    int walks, pixel[2]; /* random walks of a pixel */
    int end;             /* by a signal: the view is over */
};

enum view_state { VIEW_RUNNING, VIEW_STOPPED, VIEW_DONE };

/* What a view has to offer. */
struct view_kind {
    const char *what;   /* "render", "fit", "bend fit" */
    const char *target; /* of "save": the file or folder; NULL: there is none */
    int again;          /* may begin anew from the present values */
    int walks;          /* has random walks: see view_walks */
};

/* Serve, and print the address. 0, or an exit code with the reason printed. */
int view_open(const struct view_kind *kind, int port);
/* Serve no more, and free the numbers. */
void view_close(void);

/* The unit of element e alone, and how far its slider reaches (view_number.reach); of cli.scene. */
const char *view_unit(const struct imp_param_info *info, size_t e);
double view_reach(const struct imp_param_info *info, size_t e);
/* The numbers with sliders, [n]; taken over, with their names. */
void view_numbers(struct view_number *number, size_t n);
/* Show that they have these values [n]. */
void view_numbers_are(const double *value);
/* Values [n] that sliders were moved to. */
void view_values(double *value);

/* An imp_progress_fn: shows progress, serves walks; stops for any other wish. */
int view_progress(const struct imp_progress *progress, void *payload);
/* The wishes so far, which are taken away. */
struct view_wish view_take(void);
/* The same, once there is one. */
struct view_wish view_wait(void);
/* Is there a wish that what runs should stop for? */
int view_asked(void);

void view_state(enum view_state state, const char *message);

/* Items that take the place of what the page had of this channel. */
enum view_channel {
    VIEW_TARGET = 4,
    VIEW_START,
    VIEW_PICTURE,
    VIEW_ANSWER,
    VIEW_PLACES,
    VIEW_WALKS,
    VIEW_RAYS
};
void view_show(enum view_channel channel, const struct imp_report_item *items, size_t n);
/* One item of JSON that was written to a memory stream; frees the text. */
void view_show_json(enum view_channel channel, const char *kind, const char *name,
                    char *json);
/* Walks of a pixel, in a call-back of the library or between its calls. */
void view_walks(const int pixel[2]);
/* A JSON text in memory: *text, to be freed, is there once the stream is closed. */
struct json view_stream(char **text, size_t *size);
/* Where things are (shared/places.h), of an object that was opened in such a stream, which it closes. */
void view_show_places(struct json *j, char **text);
void view_show_film(enum view_channel channel, const imp_film *film, const char *name,
                    const char *role, int view);

/* ---- view_pictures.c ---- */
/* The pictures of --target, as VIEW_TARGET. */
void view_targets(void);
/* Pictures through the sensor of every target, at the scene's numbers. spp 0: the
 * command's number, with progress. */
void view_pictures(enum view_channel channel, const char *name, const char *role,
                   int spp);

/* ---- view_kept.c ---- */
/* Record walks at the present values, at most `most` of a pixel, unless those that are
 * kept do; any wish ends it. */
void view_kept_draw(int64_t most);
/* The picture at these numbers by the walks that are kept, and their effective sample
 * size; the caller destroys it. NULL: there are none, or their effective sample size is
 * too small. */
imp_film *view_kept_picture(int64_t most, double *ess);
void view_kept_close(void);

/* ---- The views ----------------------------------------------------------------------- */

struct view_options {
    int port;
    const char *checkpoint;
};
extern struct view_options view_options;

/* 0, or an exit code with the reason printed. cli.scene is loaded. */
int view_scene(void); /* a picture that follows its parameters */
int view_fit(void);   /* a fit to --target */
/* Is this a file of bent rays? */
int view_is_bend(const char *path);
int view_bend(const char *path);

#endif
