/* SPDX-License-Identifier: Apache-2.0
 *
 * Layers into canvases: by WebGL2, and without it by the processor. One hidden canvas
 * draws for all visible ones, since a page may have few contexts. */
"use strict";

/* Matplotlib's viridis (CC0), sixteen of its colours. */
const viridis = [[68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142],
    [35, 136, 142], [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54],
    [210, 226, 27], [253, 231, 37]];

function false_colour(t) {
    const x = Math.min(Math.max(t, 0), 1) * (viridis.length - 1), i = Math.min(Math.floor(x), viridis.length - 2), f = x - i;
    return viridis[i].map((v, c) => v + f * (viridis[i + 1][c] - v));
}
/* Blue, white, red. */
function signed_colour(t) {
    const x = Math.min(Math.max(t, -1), 1), f = 255 * (1 - Math.abs(x));
    return x < 0 ? [f, f, 255] : [255, f, f];
}
const to_srgb = (x) => 255 * (x <= 0.0031308 ? 12.92 * Math.max(x, 0) : x >= 1 ? 1 : 1.055 * x ** (1 / 2.4) - 0.055);
const not_finite = [255, 0, 255];

/* Mean of the channels where a layer has several: what false colour shows. */
const grey = (layer, i) => layer.planes.reduce((sum, p) => sum + p[i], 0) / layer.count;

/* How a layer is coloured: {mode: "colour" | "false" | "signed", gain, range} */
function pixel_colour(layer, i, look) {
    if (look.mode === "colour" && layer.count === 3) {
        const v = layer.planes.map((p) => p[i] * look.gain);
        return v.every(Number.isFinite) ? v.map(to_srgb) : not_finite;
    }
    const v = grey(layer, i);
    if (!Number.isFinite(v)) return not_finite;
    if (look.mode === "signed") return signed_colour(v * look.gain / look.range);
    if (look.mode === "false") return false_colour(v * look.gain / look.range);
    const s = to_srgb(v * look.gain);
    return [s, s, s];
}

/* Nearest texel of a window: x, y of its upper left corner and texels a canvas pixel. */
function draw_by_processor(context, layer, look, at, width, height) {
    const image = context.createImageData(width, height);
    for (let y = 0, k = 0; y < height; y++)
        for (let x = 0; x < width; x++, k += 4) {
            const px = Math.floor(at.x + (x + 0.5) * at.step), py = Math.floor(at.y + (y + 0.5) * at.step);
            const inside = px >= 0 && py >= 0 && px < layer.width && py < layer.height;
            const c = inside ? pixel_colour(layer, py * layer.width + px, look) : [0, 0, 0];
            image.data.set([c[0], c[1], c[2], inside ? 255 : 0], k);
        }
    context.putImageData(image, 0, 0);
}

const vertex_source = `#version 300 es
void main() { vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0; gl_Position = vec4(p, 0, 1); }`;
const fragment_source = `#version 300 es
precision highp float;
uniform sampler2D layer;
uniform vec3 viridis[16];
uniform vec4 at; /* x, y, texels a pixel, height of the canvas */
uniform vec2 size;
uniform float gain, range;
uniform int mode, count;
out vec4 colour;
float srgb(float x) { return x <= 0.0031308 ? 12.92 * max(x, 0.0) : x >= 1.0 ? 1.0 : 1.055 * pow(x, 1.0 / 2.4) - 0.055; }
bool bad(float x) { return isnan(x) || isinf(x); }
void main() {
    vec2 p = floor(at.xy + vec2(gl_FragCoord.x, at.w - gl_FragCoord.y) * at.z);
    if (any(lessThan(p, vec2(0))) || any(greaterThanEqual(p, size))) { colour = vec4(0); return; }
    vec3 v = texelFetch(layer, ivec2(p), 0).rgb;
    float g = count == 3 ? (v.r + v.g + v.b) / 3.0 : v.r;
    if (mode == 0 && count == 3) {
        colour = bad(v.r) || bad(v.g) || bad(v.b) ? vec4(1, 0, 1, 1) : vec4(srgb(v.r * gain), srgb(v.g * gain), srgb(v.b * gain), 1);
        return;
    }
    if (bad(g)) { colour = vec4(1, 0, 1, 1); return; }
    if (mode == 2) {
        float t = clamp(g * gain / range, -1.0, 1.0), f = 1.0 - abs(t);
        colour = vec4(t < 0.0 ? vec3(f, f, 1) : vec3(1, f, f), 1);
    } else if (mode == 1) {
        float t = clamp(g * gain / range, 0.0, 1.0) * 15.0;
        int i = int(min(floor(t), 14.0));
        colour = vec4(mix(viridis[i], viridis[i + 1], t - float(i)), 1);
    } else colour = vec4(vec3(srgb(g * gain)), 1);
}`;

let forget_layer = () => {}; /* of its texture */
const draw = (() => {
    const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl2", {alpha: true, preserveDrawingBuffer: true});
    if (!gl) return (context, layer, look, at) => draw_by_processor(context, layer, look, at, context.canvas.width, context.canvas.height);
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex_source], [gl.FRAGMENT_SHADER, fragment_source]]) {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    const place = (name) => gl.getUniformLocation(program, name);
    const uniform = Object.fromEntries(["at", "size", "gain", "range", "mode", "count"].map((name) => [name, place(name)]));
    gl.uniform3fv(place("viridis"), viridis.flat().map((v) => v / 255));
    const textures = new Map();
    const texture_of = (layer) => {
        if (textures.has(layer)) return textures.get(layer);
        const n = layer.planes[0].length, three = layer.count === 3;
        let data = layer.planes[0];
        if (three) {
            data = new Float32Array(3 * n);
            layer.planes.forEach((p, c) => { for (let i = 0; i < n; i++) data[3 * i + c] = p[i]; });
        }
        const texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texImage2D(gl.TEXTURE_2D, 0, three ? gl.RGB32F : gl.R32F, layer.width, layer.height, 0, three ? gl.RGB : gl.RED, gl.FLOAT, data);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        textures.set(layer, texture);
        return texture;
    };
    forget_layer = (layer) => {
        if (textures.has(layer)) gl.deleteTexture(textures.get(layer));
        textures.delete(layer);
    };
    return (context, layer, look, at) => {
        const {width, height} = context.canvas, limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
        if (gl.isContextLost() || layer.width > limit || layer.height > limit) {
            draw_by_processor(context, layer, look, at, width, height);
            return;
        }
        if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
        gl.viewport(0, 0, width, height);
        gl.bindTexture(gl.TEXTURE_2D, texture_of(layer));
        gl.uniform4f(uniform.at, at.x, at.y, at.step, height);
        gl.uniform2f(uniform.size, layer.width, layer.height);
        gl.uniform1f(uniform.gain, look.gain);
        gl.uniform1f(uniform.range, look.range);
        gl.uniform1i(uniform.mode, ["colour", "false", "signed"].indexOf(look.mode));
        gl.uniform1i(uniform.count, layer.count);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        context.clearRect(0, 0, width, height);
        context.drawImage(canvas, 0, 0);
    };
})();
