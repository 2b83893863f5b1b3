/* SPDX-License-Identifier: Apache-2.0
 *
 * What a scene's author reads after a mistake: every property of every kind gets values of the
 * wrong type and numbers out of its range, and each message must hold the file, the line of the
 * property, its name, and what would be accepted. Kinds come from the registry, and their
 * properties are those that they ask for, so a new one is tested by existing; it adds a line to
 * bad_rows.h for what it cannot be without. */
#include "bad_rows.h"
#include "base/text.h"
#include "film/film_integrator.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/registry.h"
#include "scene/scene.h"
#include <ctype.h>
#include <unistd.h>

static imp_context *ctx;
static struct imp_text scene_text;
static char folder[] = "/tmp/importon-bad-XXXXXX"; /* of files that no other folder has */

/* The scene with `prop` among the object's properties, and without the line that has its name;
 * *line: where it stands. */
static void write_scene(const struct row *r, const char *name, const char *prop,
                        int *line)
{
    const char *scene = r->scene;
    for (size_t k = 0; k < imp_count(places) && !scene; k++)
        if (strcmp(places[k].tag, r->tag) == 0) scene = places[k].scene;
    const char *hole = strchr(scene, '%');
    char written[96];
    snprintf(written, sizeof written, " name='%s'", name);
    scene_text.bytes.size = 0;
    imp__put(&scene_text, "<scene version='3.0.0'>\n%.*s\n<%s type='%s' %s>\n",
             (int)(hole - scene), scene, r->tag, r->type, r->slot ? r->slot : "");
    *line = 4;
    for (const char *s = r->props; s && *s;) {
        const char *end = strchr(s, '\n') + 1, *has = strstr(s, written);
        if (!has || has > end) {
            imp__put(&scene_text, "%.*s", (int)(end - s), s);
            ++*line;
        }
        s = end;
    }
    imp__put(&scene_text, "%s\n</%s>\n%s\n</scene>\n", prop, r->tag, hole + 1);
}

/* What loading says; "" if all is well. */
static const char *said(const struct row *r, imp_scene **keep)
{
    const char *const folders[] = {folder,
                                   IMP_SCENES "/textured",
                                   IMP_SCENES "/cornell",
                                   IMP_SCENES "/photons",
                                   IMP_SCENES "/lamps",
                                   IMP_SCENES "/../fuzz/corpus/merl",
                                   IMP_SCENES "/../fuzz/corpus/tensor",
                                   IMP_SCENES "/../fuzz/corpus/vol"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *scene = NULL;
    o.mode = r->mode;
    o.search = folders;
    o.n_search = imp_count(folders);
    const enum imp_status st =
        imp_scene_load_string(ctx, (const char *)scene_text.bytes.data,
                              scene_text.bytes.size, "bad.xml", &o, &scene);
    if (keep && st == IMP_OK) *keep = scene;
    else imp_scene_destroy(scene);
    return st == IMP_OK ? "" : imp_last_error(ctx);
}

static const struct imp_node *object_of(const struct imp_node *n, const struct row *r)
{
    if (strcmp(n->tag, r->tag) == 0 && strcmp(n->type, r->type) == 0) return n;
    for (size_t i = 0; i < n->n_children; i++) {
        const struct imp_node *found = object_of(n->children[i].node, r);
        if (found) return found;
    }
    return NULL;
}

/* ---- One property ---------------------------------------------------------------- */

static int n_bad, n_probes;

static bool has_word(const char *text, const char *word)
{
    const size_t n = strlen(word);
    for (const char *s = text; (s = strstr(s, word)); s += n)
        if ((s == text || !(isalnum((unsigned char)s[-1]) || s[-1] == '_')) &&
            !(isalnum((unsigned char)s[n]) || s[n] == '_'))
            return true;
    return false;
}

/* Mistakes that are of two properties, or of no interval: both are named, or the condition. */
static bool is_of_two(const char *message)
{
    static const char *const words[] = {"not both",
                                        "give either ",
                                        "give both ",
                                        "instead of",
                                        " needs ",
                                        "one of the two",
                                        "has no inverse in the picture",
                                        "no picture has such",
                                        "which the integrator",
                                        "is for files of bent rays only"};
    for (size_t k = 0; k < imp_count(words); k++)
        if (strstr(message, words[k])) return true;
    return false;
}

/* What is said, "" if nothing; a number (`range`) shows what it may be. */
static const char *try(const struct row *r, const char *name, const char *prop,
                       bool range)
{
    static char message[4096];
    char where[32], bound[96];
    int line;
    write_scene(r, name, prop, &line);
    snprintf(message, sizeof message, "%s", said(r, NULL));
    n_probes++;
    if (!*message) return message;
    snprintf(where, sizeof where, "bad.xml:%d:", line);
    /* Of another property, or of its file, at their line. */
    snprintf(bound, sizeof bound, "%s = ",
             strcmp(name, "shape_index") == 0 ? ".serialized: shape_index" : name);
    const char *bounds = strstr(message, bound);
    if (bounds && bounds[-1] != '(' && *bound != '.') bounds = NULL;
    /* Of a place, a date and an hour together. */
    const bool night = strstr(message, "degrees below the horizon") != NULL;
    const bool ok =
        night || ((strncmp(message, where, strlen(where)) == 0 || bounds) &&
                  has_word(message + strlen(where), name) &&
                  (!range || strstr(message, " must be ") || is_of_two(message) ||
                   strstr(message, "outside [") || strstr(message, "outside (")));
    if (!ok) {
        n_bad++;
        printf("# %s %s: %s\n#     %s\n", r->tag, r->type, prop, message);
    }
    return message;
}

static void property(const struct row *r, const char *name)
{
    static const char *const numbers[] = {"-1e30", "-1000", "-1",   "-1e-9",
                                          "0",     "2",     "1000", "1e30"};
    char prop[256];
    snprintf(prop, sizeof prop, "<string name='%s' value='zz'/>", name);
    if (!*try(r, name, prop, false)) { /* any text */
        snprintf(prop, sizeof prop, "<boolean name='%s' value='true'/>", name);
        try(r, name, prop, false);
    }
    snprintf(prop, sizeof prop, "<transform name='%s'/>", name);
    try(r, name, prop, false);
    snprintf(prop, sizeof prop, "<float name='%s' value='nan'/>", name);
    try(r, name, prop, false);
    for (size_t k = 0; k < imp_count(numbers); k++) {
        snprintf(prop, sizeof prop, "<float name='%s' value='%s'/>", name, numbers[k]);
        const bool whole = strstr(try(r, name, prop, true), "must be an integer") != NULL;
        snprintf(prop, sizeof prop, "<integer name='%s' value='%s'/>", name, numbers[k]);
        if (whole && !strchr(numbers[k], 'e')) try(r, name, prop, true);
    }
}

static void row(const struct row *r)
{
    imp_scene *scene = NULL;
    /* Nodes of instances are given back when their scene is made. */
    const char *asked[imp_count(((struct imp_node *)0)->asked)] = {
        "to_world", "to_world_end", "time_start", "time_end"};
    int line, n = 4;
    write_scene(r, "", "", &line);
    const char *message = said(r, &scene);
    if (!tap_ok(scene != NULL, "%s %s loads # %s", r->tag, r->type, message)) return;
    if (strcmp(r->type, "instance") != 0) {
        const struct imp_node *node = object_of(scene->root, r);
        n = node->n_asked;
        memcpy(asked, node->asked, sizeof asked);
    }
    imp_scene_destroy(scene);
    n_bad = n_probes = 0;
    for (int k = 0; k < n; k++) property(r, asked[k]);
    tap_ok(n_bad == 0, "%s %s: messages # %d properties, %d of %d are wrong", r->tag,
           r->type, n, n_bad, n_probes);
    if (n == (int)imp_count(asked))
        tap_ok(0, "%s %s: all its properties fit into `asked`", r->tag, r->type);
}

static void kind(const char *tag, const char *type)
{
    bool any = false;
    for (size_t k = 0; k < imp_count(rows); k++)
        if (strcmp(rows[k].tag, tag) == 0 && strcmp(rows[k].type, type) == 0) {
            row(&rows[k]);
            any = true;
        }
    if (!any) row(&(struct row){tag, type, NULL, NULL, NULL, IMP_RGB});
}

/* Types that this version has not are told together, each once; of very many, how many. */
static void missing(void)
{
    static const int counts[] = {5, 300};
    for (size_t k = 0; k < imp_count(counts); k++) {
        int told = 0, more = 0;
        char want[64];
        scene_text.bytes.size = 0;
        imp__put(&scene_text, "<scene version='3.0.0'>\n");
        for (int i = 0; i < 2 * counts[k]; i++)
            imp__put(&scene_text, "<shape type='sphere'><bsdf type='none%d'/></shape>\n",
                     i % counts[k]);
        imp__put(&scene_text, "</scene>\n");
        const char *message = said(&(struct row){.mode = IMP_RGB}, NULL);
        for (int i = 1; i < counts[k]; i++) {
            snprintf(want, sizeof want, "bsdf none%d (bad.xml:%d:22 and elsewhere)", i,
                     i + 2);
            told += strstr(message, want) != NULL;
        }
        const char *rest = strstr(message, " and ");
        while (rest && sscanf(rest, " and %d more types", &more) != 1)
            rest = strstr(rest + 1, " and ");
        tap_ok(strncmp(message, "bad.xml:2:22: bsdf (none0): ", 28) == 0 &&
                   1 + told + more == counts[k] && (more == 0) == (counts[k] < 10),
               "%d types that do not exist: %d are told, and %d more", counts[k],
               1 + told, more);
    }
}

static void put_file(const char *name, const void *bytes, size_t n)
{
    char path[96];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = bytes ? fopen(path, "wb") : NULL;
    if (!bytes) remove(path);
    else if (!f || fwrite(bytes, 1, n, f) != n || fclose(f)) exit(99);
}

static void files_make(void)
{
    static const char curve[] = "0 0 0 1\n1 0 0 1\n2 0 0 1\n3 0 0 1\n4 0 0 1\n";
    char mesh[4096];
    FILE *f = fopen(IMP_SCENES "/../fuzz/corpus/mesh/v4.serialized", "rb");
    if (!f || !mkdtemp(folder)) exit(99);
    const size_t n = fread(mesh, 1, sizeof mesh, f);
    fclose(f);
    put_file("mesh.serialized", mesh + 1, n - 1); /* the first byte is the fuzzer's */
    put_file("curve.txt", curve, sizeof curve - 1);
}

int main(void)
{
    static const char *const tags[] = {"bsdf",    "texture", "shape", "emitter", "sensor",
                                       "rfilter", "volume",  "phase", "medium"};
    ctx = test_context(1);
    scene_text.ctx = ctx;
    files_make();
    for (int c = 0; c <= IMP_CONCEPT_MEDIUM; c++) {
        const struct {
            size_t size;
            const char *name;
        } * head;
        for (size_t i = 0; (head = imp__kind_at(ctx, (enum imp_concept)c, i)); i++)
            /* These two are no XML: their numbers come by calls, or with a mesh. */
            if (strcmp(head->name, "mesh") != 0 && strcmp(head->name, "attribute") != 0)
                kind(tags[c], head->name);
    }
    for (size_t i = 0; imp__integrator_kinds[i]; i++)
        kind("integrator", imp__integrator_kinds[i]->name);
    static const char *const others[][2] = {
        {"spectrum", "uniform"},     {"spectrum", "srgb"},
        {"spectrum", "rawconstant"}, {"spectrum", "d65"},
        {"spectrum", "regular"},     {"spectrum", "irregular"},
        {"spectrum", "blackbody"},   {"spectrum", "illuminant"},
        {"spectrum", "rayleigh"},    {"spectrum", "glass"},
        {"spectrum", "sellmeier"},   {"spectrum", "cauchy"},
        {"shape", "shapegroup"},     {"shape", "instance"},
        {"medium", "graded"},        {"film", "hdrfilm"},
        {"film", "specfilm"},        {"sampler", "independent"},
        {"sampler", "stratified"}};
    for (size_t k = 0; k < imp_count(others); k++) kind(others[k][0], others[k][1]);
    missing();
    imp__bytes_free(ctx, &scene_text.bytes);
    imp_context_destroy(ctx);
    put_file("mesh.serialized", NULL, 0);
    put_file("curve.txt", NULL, 0);
    rmdir(folder);
    return tap_done();
}
