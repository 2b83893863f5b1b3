/* SPDX-License-Identifier: Apache-2.0
 *
 * Feeds scene files and their includes to expat in pieces, and places errors at line
 * and column. */
#include "xml.h"
#include "hooks.h"
#include "import.h"
#include "light_units.h"
#include "search.h"
#include <expat.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#define PIECE_BYTES (1 << 16)

struct imp_loc imp__xml_loc(const struct xml_file *f)
{
    return (struct imp_loc){f->name, (int)XML_GetCurrentLineNumber(f->parser),
                            (int)XML_GetCurrentColumnNumber(f->parser) + 1};
}

static void stop(struct xml_file *f, enum imp_status status)
{
    f->st = status;
    XML_StopParser(f->parser, XML_FALSE);
}

void imp__xml_fail(struct xml_file *f, enum imp_status status, const char *format, ...)
{
    if (f->st != IMP_OK) return;
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    imp__loc_error(f->reader->ctx, imp__xml_loc(f), status, "%s", text);
    stop(f, status);
}

void imp__xml_fail_here(struct xml_file *f, enum imp_status status)
{
    if (f->st != IMP_OK) return;
    char where[512];
    imp__error_prefix(f->reader->ctx, status, "%s",
                      imp__loc_text(imp__xml_loc(f), where, sizeof where));
    stop(f, status);
}

void imp__xml_fail_placed(struct xml_file *f, enum imp_status status)
{
    if (f->st == IMP_OK && status != IMP_OK) stop(f, status);
}

/* ---- What expat calls ---------------------------------------------------------- */

static void on_start(void *payload, const char *tag, const char **attributes)
{
    struct xml_file *f = payload;
    if (f->st != IMP_OK) return;
    const struct imp_arena_mark mark = imp__arena_mark(&f->reader->scratch);
    imp__xml_start(f, tag, attributes);
    imp__arena_rewind(&f->reader->scratch, mark);
}

static void on_end(void *payload, const char *tag)
{
    (void)tag;
    struct xml_file *f = payload;
    if (f->st == IMP_OK) imp__xml_end(f);
}

static void on_text(void *payload, const char *text, int length)
{
    struct xml_file *f = payload;
    if (f->st != IMP_OK) return;
    int i = 0;
    while (i < length && strchr(" \t\r\n", text[i]) && text[i]) i++;
    if (i == length) return;
    struct imp_loc loc = imp__xml_loc(f);
    loc.column += i;
    imp__loc_error(f->reader->ctx, loc, IMP_E_SCENE, "stray text '%.*s'",
                   imp_min(length - i, 40), text + i);
    stop(f, IMP_E_SCENE);
}

/* With no document type there are no entities, so none can be expanded without bound. */
static void on_doctype(void *payload, const char *name, const char *system,
                       const char *public, int internal)
{
    (void)name, (void)system, (void)public, (void)internal;
    imp__xml_fail(payload, IMP_E_SCENE, "a document type (<!DOCTYPE>) is not allowed");
}

/* ---- Files --------------------------------------------------------------------- */

static enum imp_status text_read(struct xml_file *f, const struct imp_bytes *text)
{
    static const XML_Memory_Handling_Suite suite = {imp__hooks_malloc, imp__hooks_realloc,
                                                    imp__hooks_free};
    imp_context *ctx = f->reader->ctx;
    imp_context *previous = imp__hooks_enter(ctx);
    XML_Parser parser = XML_ParserCreate_MM(NULL, &suite, NULL);
    if (!parser) {
        imp__hooks_leave(previous);
        return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", f->name);
    }
    f->parser = parser;
    XML_SetUserData(parser, f);
    XML_SetElementHandler(parser, on_start, on_end);
    XML_SetCharacterDataHandler(parser, on_text);
    XML_SetStartDoctypeDeclHandler(parser, on_doctype);
    for (size_t done = 0;;) {
        const size_t n = imp_min(text->size - done, (size_t)PIECE_BYTES);
        const bool last = done + n == text->size;
        const enum XML_Status ok =
            XML_Parse(parser, (const char *)text->data + done, (int)n, last);
        if (f->st == IMP_OK && ok != XML_STATUS_OK) {
            const enum XML_Error code = XML_GetErrorCode(parser);
            if (code == XML_ERROR_NO_MEMORY)
                f->st = imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", f->name);
            else if (code == XML_ERROR_NO_ELEMENTS && f->depth > 0)
                f->st = imp__loc_error(ctx, imp__xml_loc(f), IMP_E_SCENE,
                                       "the file ends inside <%s>", imp__xml_top(f)->tag);
            else if (code == XML_ERROR_NO_ELEMENTS)
                f->st = imp__loc_error(ctx, imp__xml_loc(f), IMP_E_SCENE,
                                       "the file holds no scene");
            else if (code == XML_ERROR_TAG_MISMATCH && f->depth > 0)
                f->st =
                    imp__loc_error(ctx, imp__xml_loc(f), IMP_E_SCENE,
                                   "mismatched tag: <%s> is open", imp__xml_top(f)->tag);
            else
                f->st = imp__loc_error(ctx, imp__xml_loc(f), IMP_E_SCENE, "%s",
                                       XML_ErrorString(code));
        }
        if (f->st != IMP_OK || last) break;
        done += n;
    }
    XML_ParserFree(parser);
    f->parser = NULL;
    imp__hooks_leave(previous);
    return f->st;
}

static enum imp_status file_read(struct xml_reader *r, struct xml_file *includer,
                                 const struct imp_bytes *text, const char *name,
                                 struct imp_node *parent, const char *slot)
{
    enum imp_status st = IMP_OK;
    struct xml_file *f = imp__alloc(r->ctx, 1, sizeof *f);
    if (!f) return imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", name);
    f->reader = r;
    f->includer = includer;
    f->parent = parent;
    f->slot = slot;
    f->name = imp__arena_strdup(&r->scene->arena, name);
    f->folder = imp__folder_of(r->scene, name);
    if (!f->name || !f->folder)
        IMP_TRY(imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", name));
    IMP_TRY(text_read(f, text));
out:
    imp__release(r->ctx, f);
    return st;
}

/* A file of another program: in the root of a scene, or with parent NULL the scene. */
static enum imp_status foreign_read(struct xml_reader *r, imp__import_read *read,
                                    const struct imp_bytes *text, const char *name,
                                    struct imp_node *parent)
{
    const struct imp__import in = {.scene = r->scene,
                                   .tree = &r->tree,
                                   .params = &r->params,
                                   .scratch = &r->scratch,
                                   .parent = parent,
                                   .name = imp__arena_strdup(&r->scene->arena, name),
                                   .text = text};
    if (!in.name) return imp__error(r->ctx, IMP_E_NOMEM, "%s: out of memory", name);
    return read(&in);
}

static bool same_file(const char *a, const char *b)
{
    struct stat x, y;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev &&
           x.st_ino == y.st_ino;
}

void imp__xml_include(struct xml_file *f, const char *name, const char *slot,
                      struct imp_node *parent)
{
    struct xml_reader *r = f->reader;
    enum imp_status st = IMP_OK;
    struct imp_bytes text = {0};
    const char *path;

    st = imp__search(r->scene, f->folder, name, &path);
    if (st != IMP_OK) {
        imp__xml_fail_here(f, st);
        return;
    }
    imp__import_read *read = imp__import_of(path);
    int depth = 1;
    for (const struct xml_file *up = f; up; up = up->includer, depth++)
        if (same_file(up->name, path)) {
            imp__xml_fail(f, IMP_E_SCENE, "'%s' includes itself", path);
            return;
        }
    if (depth - 1 > XML_INCLUDE_DEPTH) {
        imp__xml_fail(f, IMP_E_SCENE, "includes are nested deeper than %d",
                      XML_INCLUDE_DEPTH);
        return;
    }
    if (++r->n_includes > XML_INCLUDES_MAX) {
        imp__xml_fail(f, IMP_E_SCENE, "more than %d includes", XML_INCLUDES_MAX);
        return;
    }
    st = imp__file_read(r->ctx, path, XML_FILE_BYTES_MAX, &text);
    if (st != IMP_OK) {
        imp__xml_fail_here(f, st);
        return;
    }
    r->n_bytes += text.size;
    if (r->n_bytes > XML_FILE_BYTES_MAX)
        imp__xml_fail(f, IMP_E_SCENE, "included files are larger than %zu bytes together",
                      XML_FILE_BYTES_MAX);
    else if (read && strcmp(parent->tag, "scene") != 0)
        imp__xml_fail(f, IMP_E_SCENE, "'%s' belongs in the scene, not in a %s", path,
                      parent->tag);
    else /* the message names the place inside */
        imp__xml_fail_placed(f, read ? foreign_read(r, read, &text, path, parent)
                                     : file_read(r, f, &text, path, parent, slot));
    imp__bytes_free(r->ctx, &text);
}

enum imp_status imp__xml_read(struct imp_scene *scene, const struct imp_bytes *text,
                              const char *name, const struct imp_load_options *options)
{
    enum imp_status st = IMP_OK;
    struct xml_reader r = {.ctx = scene->ctx, .scene = scene};
    imp__tree_init(&r.tree, scene);
    imp__arena_init(&r.scratch, scene->ctx);
    IMP_TRY(imp__params_init(&r.params, scene->ctx, options ? options->defines : NULL,
                             options ? options->n_defines : 0));
    if (imp__import_of(name))
        IMP_TRY(foreign_read(&r, imp__import_scene, text, name, NULL));
    else IMP_TRY(file_read(&r, NULL, text, name, NULL, NULL));
    const char *meant, *unused = imp__params_unused(&r.params, &meant);
    if (unused)
        IMP_TRY(imp__loc_error(r.ctx, r.tree.root->loc, IMP_E_SCENE,
                               "parameter '%s' was given, but nothing uses $%s%s%s%s",
                               unused, unused, meant ? "; did you mean '" : "",
                               meant ? meant : "", meant ? "'?" : ""));
    IMP_TRY(imp__tree_resolve(&r.tree));
    scene->root = r.tree.root;
    if (imp__params_assumed(&r.params, "efficacy"))
        imp__light_units_mixed(scene, scene->root);
out:
    imp__params_free(&r.params);
    imp__arena_free(&r.scratch);
    imp__tree_free(&r.tree);
    return st;
}
