/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer of a design, as text, JSON, and settings of the scene. */
#ifndef IMP_CLI_DESIGN_ANSWER_H
#define IMP_CLI_DESIGN_ANSWER_H

#include "design_lamps.h"
#include "design_moves.h"
#include "text/json.h"

struct design_answer {
    const struct design_lamps *lamps;
    const struct design_moves *moves;
    const struct imp_design_want *wants;
    const struct imp_design_options *options;
    const struct imp_design_answer *answer;
};

const struct imp_design_finding *design_finding(const struct design_answer *a, size_t k);

void design_print(const struct design_answer *a);
void design_json(const struct design_answer *a);
/* The scene becomes that of the answer. 0, or an exit code. */
int design_levels_apply(const struct design_answer *a);
/* Lines for --set @FILE: the levels and places of the answer. 0, or an exit code. */
int design_settings_write(const char *path, const struct design_answer *a);

#endif
