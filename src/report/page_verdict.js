/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer in words: what a fit says of itself, and whether pictures agree with their
 * targets. */
"use strict";

function verdict(fit) {
    const lines = [];
    if (is_number(fit.value)) lines.push(make("p", {}, `The search ended after ${fit.iterations} iterations${fit.reason ? `: ${fit.reason}` : ""}. ${fit.loss ? `Loss (${fit.loss})` : "Objective"}: ${show_error(fit.value, fit.se)}.`));
    if (is_number(fit.residual_hi)) {
        const p = (x) => `${show(100 * x, 2)} %`;
        lines.push(make("p", {class: fit.residual > 0.2 ? "warning" : ""}, fit.residual_hi <= 0 ? "The residual is within its noise."
            : fit.residual_hi > 1.5 * fit.residual ? `The residual is below ${p(fit.residual_hi)} of the targets.` : `The residual is ${p(fit.residual)} of the targets.`));
    }
    if (is_number(fit.chi2_per_freedom)) lines.push(make("p", {}, fit.chi2_se < 1 || fit.chi2_per_freedom > 3 * fit.chi2_se
        ? `Chi-square per degree of freedom of the fit: ${show(fit.chi2_per_freedom, 4)}; where the scene explains the targets, ${show(Math.max(0, 1 - 2 * fit.chi2_se), 3)} to ${show(1 + 2 * fit.chi2_se, 3)}. Its noise is that of the targets' standard errors.`
        : "Whether the fit explains the targets takes more samples per pixel: the pictures that it made have more noise than the targets."));
    else if (is_number(fit.residual)) lines.push(make("p", {}, "The fit knows no noise of its targets: intervals take what is left over as noise, so they cannot tell whether the scene explains it."));
    if (fit.warning) lines.push(make("p", {class: "warning"}, String(fit.warning)));
    if (fit.complete === false) lines.push(make("p", {class: "warning"}, "The fit was interrupted; this is the state that it had reached."));
    return lines;
}

/* Where a region lies, as people say it. */
function place_in_words(r, width, height) {
    const x = (r.x + r.width / 2) / width, y = (r.y + r.height / 2) / height, third = (v, words) => words[Math.min(Math.floor(3 * v), 2)];
    const v = third(y, ["at the top", "", "at the bottom"]), h = third(x, ["left", "", "right"]);
    if (r.width >= 0.9 * width && r.height >= 0.9 * height) return "all over the picture";
    return [v || (h ? "at the" : "in the middle"), h].filter(Boolean).join(" ");
}

/* Is the picture explained? One paragraph a view; `go(region, view)` shows one. */
function explained_lines(items, pictures, go) {
    return items.filter((i) => i.data).map((item) => {
        const d = item.data, picture = pictures.find((p) => p.view === item.view && p.role === "picture") || {width: 1, height: 1};
        const regions = Array.isArray(d.regions) ? d.regions : [], range = Array.isArray(d.expected) ? d.expected : null;
        const view = items.length > 1 ? ` of view ${item.view}` : "", noise = {both: "the standard errors of the picture and of its target", picture: "the picture's standard errors; the target's own noise is not known", target: "the target's standard errors; the picture's own noise is not known"}[d.noise];
        const answer = d.explained === true ? `The picture${view} is explained: what is left over is what noise makes.`
            : d.explained === false ? `The picture${view} is not explained: more is left over than noise makes.`
            : noise ? `Whether the picture${view} is explained cannot be told: ${d.noise === "both" ? "the standard errors come from too few samples" : `the noise of ${d.noise === "picture" ? "its target" : "the picture itself"} is not known`}.` : `Whether the picture${view} is explained cannot be told: neither it nor its target has standard errors.`;
        const chi2 = !is_number(d.chi2) ? "" : range ? ` Chi-square per number is ${show(d.chi2, 4)}; noise alone makes ${show(range[0], 3)} to ${show(range[1], 3)}.${d.chi2 < range[0] ? " It is less: standard errors from few samples are too large where bright light comes seldom." : ""}` : ` Chi-square per number is ${show(d.chi2, 4)}.`;
        const left = d.left_out > 0 ? ` ${d.left_out} channel values without a standard error are left out.` : "";
        const list = regions.map((r) => {
            const by = is_number(r.relative) ? `${percent_of(Math.abs(r.relative))} ${r.difference > 0 ? "brighter" : "darker"} than the target` : `${show(Math.abs(r.difference), 3)} ${r.difference > 0 ? "above" : "below"} the target`;
            const row = make("li", {}, `${place_in_words(r, picture.width, picture.height)}, ${r.width} x ${r.height} pixels from ${r.x}, ${r.y}: ${by}${is_number(r.z) ? `, by ${show(Math.abs(r.z), 2)} standard errors` : ""} `);
            if (go) row.append(make("button", {type: "button", class: "noprint", click: () => go(r, item.view)}, "show"));
            return row;
        });
        return make("div", {class: "explained"}, make("h2", {}, "Is the picture explained?"),
            make("p", {class: d.explained === false ? "warning" : ""}, make("b", {}, answer), chi2, left), noise ? make("p", {class: "faint"}, `Noise: ${noise}. The range is two standard deviations about 1, by blocks of ${d.block} x ${d.block} pixels.`) : null,
            list.length ? make("p", {}, d.n_regions > list.length ? `The ${list.length} regions with the largest residuals, of ${d.n_regions}:` : "Where the largest residuals lie:") : null,
            list.length ? make("ul", {}, ...list) : make("p", {}, "No region of the picture stands out."));
    });
}

const percent_of = (x) => (is_number(x) ? `${show(100 * x, 2)} %` : "–");
