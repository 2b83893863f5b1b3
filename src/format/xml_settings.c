/* SPDX-License-Identifier: Apache-2.0
 *
 * The tag <set>: values of parameters in a scene file, or in a file that it names
 * (docs/scene-format.md 1.1). */
#include "search.h"
#include "setting_lines.h"
#include "xml.h"
#include <stdio.h>
#include <string.h>

static void setting_read(struct xml_file *f, const char *filename, struct imp_setting *s)
{
    struct xml_reader *r = f->reader;
    struct imp_bytes text = {0};
    const char *path;
    enum imp_status st = imp__search(r->scene, f->folder, filename, &path);
    if (st == IMP_OK) st = imp__file_read(r->ctx, path, IMP_SETTINGS_BYTES_MAX, &text);
    if (st != IMP_OK) {
        imp__xml_fail_here(f, st);
        return;
    }
    char *copy = imp__arena_array(&r->scene->settings_arena, text.size + 1, 1);
    if (!copy) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
    else memcpy(copy, text.data, text.size);
    *s = (struct imp_setting){.text = copy, .length = text.size, .place = path};
    imp__bytes_free(r->ctx, &text);
}

/* Lists of attributes are split at blanks and commas, those of settings at commas. In place. */
static void list_join(char *text)
{
    char *to = text;
    for (const char *from = text; *from; from++) {
        const bool blank = strchr(" \t\r\n", *from) != NULL;
        const bool more = strspn(from, " \t\r\n,") < strlen(from);
        if (!blank) *to++ = *from;
        else if (to > text && to[-1] != ',' && more &&
                 from[strspn(from, " \t\r\n")] != ',')
            *to++ = ',';
    }
    *to = 0;
}

static void setting_make(struct xml_file *f, const char *name, const char *value,
                         struct imp_setting *s)
{
    struct imp_arena *arena = &f->reader->scene->settings_arena;
    const struct imp_loc at = imp__xml_loc(f);
    const size_t n = strlen(name) + strlen(value) + 2, m = strlen(at.file) + 32;
    char *text = imp__arena_array(arena, n, 1), *place = imp__arena_array(arena, m, 1);
    if (!text || !place) {
        imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
        return;
    }
    if (strpbrk(name, "=\n#"))
        imp__xml_fail(f, IMP_E_SCENE, "'%.80s' is no name of a parameter", name);
    snprintf(text, n, "%s=%s", name, value);
    list_join(text + strlen(name) + 1);
    snprintf(place, m, "%s:%d:%d", at.file, at.line, at.column);
    *s = (struct imp_setting){
        .text = text, .length = strlen(text), .place = place, .in_scene = true};
}

/* NAME="VALUE", or all lines of a file: kept until the scene is made. */
void imp__xml_set(struct xml_file *f, const struct xml_attributes *a)
{
    struct imp_scene *scene = f->reader->scene;
    struct imp_setting *s = imp__arena_array(&scene->settings_arena, 1, sizeof *s);
    if (f->depth != 1 || !f->levels[0].node || strcmp(f->levels[0].tag, "scene") != 0) {
        imp__xml_fail(f, IMP_E_SCENE, "<set> belongs in the root of a scene");
        return;
    }
    const char *name = imp__xml_get(a, "name"), *value = imp__xml_get(a, "value"),
               *filename = imp__xml_get(a, "filename");
    if (!s) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
    else if (filename ? name || value : !name || !value)
        imp__xml_fail(f, IMP_E_SCENE, "<set> has a name and a value, or a filename");
    else if (filename) setting_read(f, filename, s);
    else setting_make(f, name, value, s);
    if (f->st != IMP_OK) return;
    if (scene->last_setting) scene->last_setting->next = s;
    else scene->settings = s;
    scene->last_setting = s;
}
