/* SPDX-License-Identifier: Apache-2.0
 *
 * A solution in a file: which elements were split, their coefficients, the links.
 * Geometry and materials come from the scene again and must be the same. A checksum finds
 * damage; what it cannot find, a file made to deceive, is checked number by number. */
#include "base/file.h"
#include "elements.h"
#include "math/hash.h"
#include <string.h>

/* The last character is the version of the format. */
static const char magic[8] = "IMPELEM2";
#define FILE_LIMIT ((size_t)64 << 30)

struct header {
    char magic[8];
    uint32_t order_mark, order, channels, link_bytes; /* order_mark: byte order */
    uint64_t polygons, splits, links, coefficients, geometry, sources;
    uint64_t checksum; /* of the header with 0 here and of all that follows */
};

static uint64_t geometry_of(const imp_elements *e)
{
    uint64_t h = 1;
    for (size_t k = 0; k < e->n_roots; k++) {
        const struct imp__el_root *r = &e->roots[k];
        const int n[3] = {r->corners, imp__el_n(e, r), r->shape};
        h = imp__hash(imp__hash(h, n, sizeof n), r->v, sizeof r->v);
    }
    return h;
}

static uint64_t sources_of(const imp_elements *e)
{
    uint64_t h = 2;
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *s = &e->sources[k];
        h = imp__hash(h, &s->kind, sizeof s->kind);
        h = imp__hash(h, &s->weight, sizeof s->weight);
        h = imp__hash(h, &s->sensor, sizeof s->sensor);
        h = imp__hash(h, s->region, sizeof s->region);
        h = imp__hash(h, s->origin, sizeof s->origin);
        h = imp__hash(h, s->edge_u, sizeof s->edge_u);
        h = imp__hash(h, s->edge_v, sizeof s->edge_v);
        if (s->shape) h = imp__hash(h, s->shape, strlen(s->shape));
    }
    return h;
}

static uint64_t checksum_of(const unsigned char *data, size_t size)
{
    struct header h;
    memcpy(&h, data, sizeof h);
    h.checksum = 0;
    return imp__hash(imp__hash(0, &h, sizeof h), data + sizeof h, size - sizeof h);
}

enum imp_status imp_elements_save(const imp_elements *e, const char *path)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes out = {0};
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, path, "path");
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    struct header h = {.order_mark = 0x01020304,
                       .order = (uint32_t)e->basis.order,
                       .channels = (uint32_t)e->ch,
                       .link_bytes = sizeof *e->links,
                       .polygons = e->n_roots,
                       .splits = (e->n_elements - e->n_roots) / 4,
                       .links = e->n_links,
                       .coefficients = (size_t)e->ch * e->n_coef,
                       .geometry = geometry_of(e),
                       .sources = sources_of(e)};
    memcpy(h.magic, magic, sizeof magic);
    bool ok = imp__bytes_add(e->ctx, &out, &h, sizeof h);
    /* Children come in fours behind the polygons, in the order of their making. */
    for (size_t k = e->n_roots; k < e->n_elements && ok; k += 4)
        ok = imp__bytes_add(e->ctx, &out, &e->elements[k].parent, sizeof(uint32_t));
    const double *const all[] = {e->l, e->g, e->c, e->b};
    for (size_t k = 0; k < imp_count(all) && ok; k++)
        ok = imp__bytes_add(e->ctx, &out, all[k],
                            (size_t)e->ch * e->n_coef * sizeof(double));
    ok = ok && imp__bytes_add(e->ctx, &out, e->links, e->n_links * sizeof *e->links);
    if (!ok)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the elements' file"));
    h.checksum = checksum_of(out.data, out.size);
    memcpy(out.data, &h, sizeof h);
    IMP_TRY(imp__file_write(e->ctx, path, out.data, out.size));
out:
    imp__bytes_free(e->ctx, &out);
    return st;
}

static enum imp_status links_check(imp_elements *e, const char *path)
{
    for (size_t k = 0; k < e->n_links; k++) {
        const struct imp__el_link *l = &e->links[k];
        bool good = l->src < e->n_elements && l->rcv < e->n_elements;
        for (int s = 0; s < 4; s++) {
            good &= isfinite(l->k[s]) && l->k[s] >= 0;
            for (int a = 0; a < 3; a++) good &= fabsf(l->w[a][s]) <= 1.001f;
        }
        if (!good || imp__el_n(e, imp__el_root_of(e, &e->elements[l->rcv])) == 0)
            return imp__error(e->ctx, IMP_E_SCENE, "%s: link %zu makes no sense", path,
                              k);
    }
    return IMP_OK;
}

enum imp_status imp_elements_open(const imp_scene *scene,
                                  const struct imp_elements_options *options,
                                  const char *path, imp_elements **out)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes in = {0};
    struct header h;
    imp_elements *e = NULL;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, path, "path");
    IMP_REQUIRE(scene->ctx, out, "out");
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    imp_context *ctx = scene->ctx;
    IMP_TRY(imp_elements_create(scene, options, &e));
    IMP_TRY(imp__file_read(ctx, path, FILE_LIMIT, &in));
    if (in.size < sizeof magic || memcmp(in.data, magic, sizeof magic - 1) != 0)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: not a file of finite elements", path));
    if (in.data[sizeof magic - 1] != (unsigned char)magic[sizeof magic - 1])
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "%s: written by another version of importon: solve the scene "
                           "again",
                           path));
    if (in.size < sizeof h)
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: is cut short or damaged", path));
    memcpy(&h, in.data, sizeof h);
    if (h.order_mark != 0x01020304 || h.link_bytes != sizeof *e->links)
        IMP_TRY(
            imp__error(ctx, IMP_E_UNSUPPORTED, "%s: from another kind of machine", path));
    if (h.checksum != checksum_of(in.data, in.size))
        IMP_TRY(imp__error(ctx, IMP_E_IO,
                           "%s: is cut short or damaged: its checksum is wrong", path));
    if (h.order != (uint32_t)e->basis.order || h.channels != (uint32_t)e->ch ||
        h.polygons != e->n_roots || h.geometry != geometry_of(e))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: was made from another scene, or with other "
                           "options (order %u, %u channels, %llu polygons)",
                           path, h.order, h.channels, (unsigned long long)h.polygons));
    const uint64_t limit = UINT32_MAX;
    if (h.splits > limit / 4 || h.links > limit ||
        h.coefficients > limit * EL_N_MAX * 3 ||
        in.size != sizeof h + h.splits * sizeof(uint32_t) +
                       4 * h.coefficients * sizeof(double) + h.links * sizeof *e->links)
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: is cut short or damaged", path));

    const unsigned char *at = in.data + sizeof h;
    for (uint64_t k = 0; k < h.splits; k++, at += sizeof(uint32_t)) {
        uint32_t parent;
        memcpy(&parent, at, sizeof parent);
        if (parent >= e->n_elements || e->elements[parent].child ||
            e->elements[parent].level >= EL_LEVEL_MAX)
            IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                               "%s: element %u is split in a way that makes "
                               "no sense",
                               path, parent));
        IMP_TRY(imp__el_split(e, &parent, 1));
    }
    if (h.coefficients != (size_t)e->ch * e->n_coef)
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: is cut short or damaged", path));
    double *const all[] = {e->l, e->g, e->c, e->b};
    for (size_t k = 0; k < imp_count(all); k++, at += h.coefficients * sizeof(double))
        memcpy(all[k], at, h.coefficients * sizeof(double));
    for (size_t k = 0; k < imp_count(all); k++)
        for (uint64_t i = 0; i < h.coefficients; i++)
            if (!isfinite(all[k][i]))
                IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: a coefficient is not finite",
                                   path));
    e->links = imp__grow(ctx, NULL, &e->cap_links, (size_t)h.links + 1, sizeof *e->links);
    if (!e->links) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory for links"));
    memcpy(e->links, at, h.links * sizeof *e->links);
    e->n_links = h.links;
    IMP_TRY(links_check(e, path));
    IMP_TRY(imp__el_links_sort(e, NULL, e->n_links));
    IMP_TRY(imp__el_sources(e));
    IMP_TRY(imp__el_bin(e));
    e->solved = true;
    e->reason = "read from a file";
    e->has_importance = !e->opt.no_importance;
    /* Other measurements than those it was solved for need their importance. */
    if (h.sources != sources_of(e) && e->has_importance)
        IMP_TRY(imp__el_settle(e, 8, true, 1e-7));
    IMP_TRY(imp__el_measure_each(e, e->each));
    *out = e;
    e = NULL;
out:
    imp__bytes_free(ctx, &in);
    imp_elements_destroy(e);
    return st;
}
