/* SPDX-License-Identifier: Apache-2.0
 *
 * The grammar of Radiance's scene descriptions. Commands ("!xform ...") are refused: a scene
 * file runs nothing. */
#include "rad.h"
#include "base/nearest.h"
#include "base/number.h"
#include <stdio.h>
#include <string.h>

struct imp_loc imp__rad_loc(const struct rad_reader *r)
{
    return (struct imp_loc){r->in->name, r->p.line, 1};
}

enum imp_status imp__rad_error(const struct rad_reader *r, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__loc_error(r->ctx, imp__rad_loc(r), IMP_E_SCENE, "%.80s '%.80s': %s",
                          r->p.type, r->p.id, text);
}

enum imp_status imp__rad_keep(const struct rad_reader *r, const char *text,
                              const char **out)
{
    *out = imp__arena_strdup(&r->in->scene->arena, text);
    return *out ? IMP_OK : imp__error(r->ctx, IMP_E_NOMEM, "scene: out of memory");
}

/* ---- Words ----------------------------------------------------------------------- */

static enum imp_status here(const struct rad_reader *r, const char *format,
                            const char *text)
{
    char message[400];
    snprintf(message, sizeof message, format, text);
    return imp__loc_error(r->ctx, (struct imp_loc){r->in->name, r->line, 1}, IMP_E_SCENE,
                          "%s", message);
}

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
}

static void skip(struct rad_reader *r)
{
    for (; r->at < r->end; r->at++) {
        if (*r->at == '#')
            while (r->at < r->end && *r->at != '\n') r->at++;
        if (r->at == r->end) return;
        if (*r->at == '\n') r->line++;
        else if (!is_space(*r->at)) return;
    }
}

/* The next word, or what is between quotes. *length: with quotes, `*s` is behind the first. */
static enum imp_status word(struct rad_reader *r, const char *what, const char **s,
                            size_t *length)
{
    skip(r);
    if (r->at == r->end) return here(r, "the file ends before %s", what);
    const char quote = *r->at;
    const bool quoted = quote == '"' || quote == '\'';
    *s = r->at += quoted;
    while (r->at < r->end &&
           (quoted ? *r->at != quote && *r->at != '\n' : !is_space(*r->at)))
        r->at++;
    *length = (size_t)(r->at - *s);
    if (quoted && (r->at == r->end || *r->at == '\n'))
        return here(r, "%s is not closed by its quotation mark", what);
    r->at += quoted;
    if (memchr(*s, 0, *length)) return here(r, "%s has a zero byte", what);
    return IMP_OK;
}

static enum imp_status name_read(struct rad_reader *r, const char *what,
                                 char out[RAD_WORD_MAX])
{
    const char *s;
    size_t length;
    const enum imp_status st = word(r, what, &s, &length);
    if (st != IMP_OK) return st;
    if (length == 0 || length >= RAD_WORD_MAX)
        return here(r, "%s is empty or longer than 255 bytes", what);
    memcpy(out, s, length);
    out[length] = 0;
    return IMP_OK;
}

static enum imp_status count_read(struct rad_reader *r, const char *what, size_t *out)
{
    enum imp_status st = IMP_OK;
    const char *s;
    size_t length;
    int64_t n;
    IMP_TRY(word(r, what, &s, &length));
    const char *end = s + length;
    if (!imp__integer(&s, end, &n) || s != end || n < 0 || n > r->end - r->at)
        IMP_TRY(imp__rad_error(r, "%s (%.*s) is not the number of words that follow",
                               what, (int)imp_min(length, (size_t)40), end - length));
    *out = (size_t)n;
out:
    return st;
}

static enum imp_status arguments_read(struct rad_reader *r)
{
    enum imp_status st = IMP_OK;
    struct rad_primitive *p = &r->p;
    const char *s;
    size_t length, n;
    p->string[0] = 0;
    IMP_TRY(count_read(r, "the count of its strings", &p->n_strings));
    for (size_t i = 0; i < p->n_strings; i++)
        if (i == 0) IMP_TRY(name_read(r, "a string", p->string));
        else IMP_TRY(word(r, "a string", &s, &length));
    IMP_TRY(count_read(r, "the count of its integers", &n));
    for (size_t i = 0; i < n; i++) IMP_TRY(word(r, "an integer", &s, &length));
    IMP_TRY(count_read(r, "the count of its numbers", &p->n_real));
    double *grown =
        imp__grow(r->ctx, p->real, &p->capacity, p->n_real + 1, sizeof *grown);
    if (!grown) IMP_TRY(imp__error(r->ctx, IMP_E_NOMEM, "scene: out of memory"));
    p->real = grown;
    for (size_t i = 0; i < p->n_real; i++) {
        IMP_TRY(word(r, "a number", &s, &length));
        const char *end = s + length;
        if (!imp__number(&s, end, &p->real[i]) || s != end ||
            !isfinite((float)p->real[i]))
            IMP_TRY(imp__rad_error(r, "number %zu of %zu is '%.*s'", i + 1, p->n_real,
                                   (int)imp_min(length, (size_t)40), end - length));
    }
out:
    return st;
}

/* ---- Primitives ------------------------------------------------------------------ */

static enum imp_status type_check(const struct rad_reader *r)
{
    static const char *const types[] = {
        "light",     "illum",      "glow",       "spotlight",  "mirror",     "prism1",
        "prism2",    "mist",       "plastic",    "metal",      "trans",      "plastic2",
        "metal2",    "trans2",     "ashik2",     "dielectric", "interface",  "glass",
        "plasfunc",  "metfunc",    "transfunc",  "BRTDfunc",   "plasdata",   "metdata",
        "transdata", "BSDF",       "aBSDF",      "antimatter", "WGMDfunc",   "texfunc",
        "texdata",   "colorfunc",  "brightfunc", "colordata",  "brightdata", "colorpict",
        "colortext", "brighttext", "mixfunc",    "mixdata",    "mixpict",    "mixtext",
        "spectrum",  "specfile",   "specfunc",   "specdata",   "specpict",   "source",
        "sphere",    "bubble",     "polygon",    "cone",       "cup",        "cylinder",
        "tube",      "ring",       "instance",   "mesh",       "alias"};
    struct imp_nearest near = imp__nearest(r->p.type);
    for (size_t i = 0; i < imp_count(types); i++) {
        if (strcmp(types[i], r->p.type) == 0) return IMP_OK;
        imp__nearest_try(&near, types[i]);
    }
    return imp__rad_error(r, "Radiance has no such type%s%s%s",
                          near.best ? "; did you mean '" : "", near.best ? near.best : "",
                          near.best ? "'?" : "");
}

static enum imp_status primitive_read(struct rad_reader *r)
{
    enum imp_status st = IMP_OK;
    struct rad_primitive *p = &r->p;
    p->line = r->line;
    IMP_TRY(name_read(r, "a modifier", p->modifier));
    IMP_TRY(name_read(r, "a type", p->type));
    IMP_TRY(name_read(r, "an identifier", p->id));
    IMP_TRY(type_check(r));
    if (strcmp(p->type, "alias") == 0) {
        IMP_TRY(name_read(r, "the name that an alias is for", p->string));
        IMP_TRY(imp__rad_alias(r));
        return IMP_OK;
    }
    IMP_TRY(arguments_read(r));
    if (imp__rad_is_surface(p->type)) IMP_TRY(imp__rad_surface(r));
    else if (imp__rad_is_material(p->type)) IMP_TRY(imp__rad_material(r));
    else IMP_TRY(imp__rad_other(r));
out:
    return st;
}

static enum imp_status commands_refused(const struct rad_reader *r)
{
    const char *stop = r->at;
    while (stop < r->end && *stop != '\n' && *stop != '\r') stop++;
    char command[80];
    snprintf(command, sizeof command, "%.*s", (int)imp_min(stop - r->at, (ptrdiff_t)60),
             r->at);
    return here(r,
                "'%s': commands are not run; write what this one prints to a file, and "
                "include that",
                command);
}

enum imp_status imp__rad_read(const struct imp__import *in)
{
    enum imp_status st = IMP_OK;
    struct rad_reader r = {.in = in,
                           .ctx = in->scene->ctx,
                           .at = (const char *)in->text->data,
                           .line = 1,
                           .names.ctx = in->scene->ctx,
                           .nothing = {.kind = RAD_VOID, .type = "void", .id = "void"}};
    r.end = r.at + in->text->size;
    IMP_TRY(imp__import_number(in, "efficacy", "1", 0, 1e6, &r.efficacy));
    for (skip(&r); r.at < r.end; skip(&r)) {
        if (*r.at == '!') IMP_TRY(commands_refused(&r));
        IMP_TRY(primitive_read(&r));
    }
    if (r.n_empty)
        imp__warn(r.ctx, "%s:%d:1: %zu polygon%s without area: left out", in->name,
                  r.first_empty, r.n_empty, r.n_empty > 1 ? "s, this the first," : "");
    IMP_TRY(imp__unread_finish(in, &r.unread));
    IMP_TRY(imp__rad_meshes_finish(&r));
out:
    imp__rad_meshes_free(&r);
    imp__names_free(&r.names);
    imp__release(r.ctx, r.p.real);
    imp__release(r.ctx, r.cut);
    return st;
}
