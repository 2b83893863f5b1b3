/* SPDX-License-Identifier: Apache-2.0
 *
 * Elements of a solution read from the library, and the coarsest level of at most 3000 of them,
 * which is drawn. */
#include "elements_mesh.h"

#include "shared/command.h"

#include <stdlib.h>

enum { SHOWN = 3000 };

static int whole_parent(const struct elements_mesh *m, size_t k)
{
    const size_t parent = m->all[k].parent;
    return parent == IMP_ELEMENTS_NO_PARENT || m->leaves[parent] > m->most;
}
static int is_shown(const struct elements_mesh *m, size_t k)
{
    return m->all[k].area > 0 && m->leaves[k] <= m->most && whole_parent(m, k);
}
static size_t count_shown(struct elements_mesh *m, size_t most)
{
    size_t n = 0;
    m->most = most;
    for (size_t k = 0; k < m->n; k++) n += (size_t)is_shown(m, k);
    return n;
}

int elements_mesh_read(struct elements_mesh *m, const imp_elements *e, size_t n)
{
    m->e = e;
    m->n = n;
    m->all = cli_alloc(n, sizeof *m->all);
    m->leaves = cli_alloc(n, sizeof *m->leaves);
    m->index = cli_alloc(n, sizeof *m->index);
    m->id = cli_alloc(n, sizeof *m->id);
    m->name = cli_alloc(n, sizeof *m->name);
    for (size_t k = 0; k < n; k++) {
        m->all[k] = (struct imp_elements_element)IMP_ELEMENTS_ELEMENT_INIT;
        const enum imp_status st = imp_elements_get_element(e, k, &m->all[k]);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
        m->n_leaves += (size_t)m->all[k].leaf;
    }
    for (size_t k = n; k-- > 0;) { /* children come after their parents */
        if (m->all[k].leaf) m->leaves[k] = 1;
        if (m->all[k].parent != IMP_ELEMENTS_NO_PARENT)
            m->leaves[m->all[k].parent] += m->leaves[k];
    }
    return 0;
}

size_t elements_mesh_name(struct elements_mesh *m, const char *name)
{
    for (size_t k = m->n_names; k-- > 0;)
        if (m->name[k] == name) return k;
    m->name[m->n_names] = name;
    return m->n_names++;
}

static int descending(const void *p, const void *q)
{
    const double a = *(const double *)p, b = *(const double *)q;
    return (a < b) - (a > b);
}

void elements_mesh_choose(struct elements_mesh *m)
{
    size_t lo = 1, hi = m->n_leaves;
    while (lo < hi) { /* the fewest leaves an element that are not too many elements */
        const size_t mid = lo + (hi - lo) / 2;
        if (count_shown(m, mid) <= SHOWN) hi = mid;
        else lo = mid + 1;
    }
    const size_t n = count_shown(m, lo);
    if (n > SHOWN) {
        double *area = cli_alloc(n, sizeof *area);
        size_t used = 0;
        for (size_t k = 0; k < m->n; k++)
            if (is_shown(m, k)) area[used++] = m->all[k].area;
        qsort(area, n, sizeof *area, descending);
        m->least_area = area[SHOWN - 1];
        free(area);
    }
    for (size_t k = 0; k < m->n; k++) m->id[k] = ELEMENTS_NONE;
    for (size_t k = 0; k < m->n && m->shown < SHOWN; k++)
        if (is_shown(m, k) && m->all[k].area >= m->least_area) {
            m->id[k] = m->shown;
            m->index[m->shown++] = k;
        }
}

size_t elements_mesh_id(struct elements_mesh *m, size_t k)
{
    if (m->id[k] != ELEMENTS_NONE) return m->id[k];
    if (!whole_parent(m, k)) return m->id[k] = elements_mesh_id(m, m->all[k].parent);
    m->id[k] = m->shown + m->others;
    m->index[m->shown + m->others++] = k;
    return m->id[k];
}

void elements_mesh_free(struct elements_mesh *m)
{
    free(m->all);
    free(m->leaves);
    free(m->index);
    free(m->id);
    free(m->name);
}
