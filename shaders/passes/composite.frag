// All luminaires together: irradiance layers × their weights -> luminance -> the view -> display, or raw values (RAW).
// VIEW is one of the numbers of server/scene/scene.h's enum View.
#include "shared/layouts.h"
#include "shared/composite.h"
#include "lib/cube.glsl"
#include "lib/octahedral.glsl"
#include "lib/vpl.glsl"
#include "lib/display.glsl"
#include "lib/false_color.glsl"
#include "lib/tone.glsl"
layout(std140, binding = 0) uniform WeightBlock { LightWeight weights[GONIO_MAX_LAYERS]; };
#if (VIEW == 3 || VIEW == 4) && !defined(RAW)
layout(std140, binding = 1) uniform FalseColors { FalseColorBlock scale; };
#endif
layout(location = kAtLightCount) uniform int light_count;
layout(location = kAtEv100) uniform float ev100;
layout(location = kAtGain) uniform float gain;  // of the indirect view
layout(location = kAtCubeScale) uniform float cube_scale;  // rsm-depth: 1 / greatest depth shown; mask: peak cd of the RAW view
layout(binding = kUnitDirect) uniform sampler2DArray direct_layers;      // lux per weight
layout(binding = kUnitIndirect) uniform sampler2DArray indirect_layers;  // rgb, lux per weight
layout(binding = kUnitAlbedo) uniform sampler2D albedo;
layout(binding = kUnitEmissive) uniform sampler2D emissive;      // cd/m²
layout(binding = kUnitBesides) uniform sampler2DArray besides;   // light without a layer: direct, after bounces
layout(location = kAtIndirectInLayers) uniform bool indirect_in_layers;  // else `besides` has it of all luminaires
layout(location = kAtBesidesUnit) uniform vec2 besides_unit_lx;  // lux per value of it; 0: there is none
layout(binding = kUnitCube) uniform samplerCube cube;            // mask and rsm views
#ifdef WORK_LIGHT
#include "lib/surface.glsl"
layout(location = kAtWorkLight) uniform float work_light;  // display-linear value of a white surface that faces the camera
#else
layout(binding = kUnitDepth) uniform sampler2D gbuffer_depth;
#endif
#ifdef HAZE
layout(binding = kUnitAir) uniform sampler2D air;  // light before the surfaces × air_unit_nit, and what passes of theirs
layout(location = kAtAirUnit) uniform float air_unit_nit;
#endif
#ifdef OPENINGS
layout(binding = kUnitOpenings) uniform sampler2D openings;  // of luminaires: rgb cd/m² × the share of the pixel, and that share
layout(location = kAtOpenings) uniform ivec2 openings_at;    // the pixel of its lower left
#endif
#ifdef EDGES
layout(std430, binding = 0) readonly buffer EdgeRows { uint edge_rows[]; };  // where a row of the picture begins
layout(std430, binding = 1) readonly buffer EdgePixels { EdgePixel edge_pixels[]; };
layout(std430, binding = 2) readonly buffer EdgeTaps { EdgeTap edge_taps[]; };
#endif
in vec2 ndc;
layout(location = 0) out vec4 out_color;

const float PI = 3.14159265358979;

#define VIEW_DIRECT 1
#define VIEW_INDIRECT 2
#define VIEW_ILLUMINANCE 3
#define VIEW_LUMINANCE 4
#define VIEW_MASK 5
#define VIEW_RSM_DEPTH 6
#define VIEW_RSM_NORMAL 7
#define VIEW_RSM_FLUX 8

#ifdef TONE
layout(location = kAtWhite) uniform mat3 white;
// Another look than the default: TONE is one of the numbers of server/scene/scene.h's enum Tone.
vec3 look(vec3 exposed) {
    vec3 shown = max(white * exposed, vec3(0.0));
#if TONE == 1
    return min(shown, vec3(1.0));
#elif TONE == 2
    return tone_aces(shown);
#elif TONE == 3
    return tone_agx(shown);
#elif TONE == 4
    return tone_neutral(shown);
#else
    return vec3(shoulder(shown.x), shoulder(shown.y), shoulder(shown.z));
#endif
}
vec3 encode_shown(vec3 exposed) {
    vec3 shown = look(exposed);
    return vec3(srgb_encode(shown.x), srgb_encode(shown.y), srgb_encode(shown.z)) +
           vec3(display_dither(int(gl_FragCoord.x), int(gl_FragCoord.y)));
}
#endif

vec3 encode(vec3 display) { return encode_display(display, int(gl_FragCoord.x), int(gl_FragCoord.y)); }
#ifndef TONE
vec3 encode_shown(vec3 exposed) { return encode(exposed); }
#endif

#if VIEW >= VIEW_MASK && VIEW <= VIEW_RSM_FLUX
// The six faces unfolded into a 4 × 3 cross, seen from outside: +Y above, -Z -X +Z +X in the middle row.
vec4 cube_cross() {
    vec2 cell = vec2(ndc.x * 0.5 + 0.5, 0.5 - ndc.y * 0.5) * vec2(4.0, 3.0);
    ivec2 c = ivec2(cell);
    vec2 st = fract(cell) * 2.0 - 1.0;
    int face = -1;
    if (c.y == 1) face = c.x == 0 ? 1 : c.x == 1 ? 4 : c.x == 2 ? 0 : 5;
    if (c.x == 1 && c.y == 0) face = 2;
    if (c.x == 1 && c.y == 2) face = 3;
    if (face < 0) return vec4(-1.0);
    return textureLod(cube, cube_direction(face, st), 0.0);
}
#endif

#if VIEW < VIEW_MASK || VIEW > VIEW_RSM_FLUX
// Result: the light that the view shows at a pixel, lux.
vec3 light_at(ivec2 pixel) {
#ifdef WORK_LIGHT
    Surface surface = surface_at(pixel);
    vec3 to_eye = -normalize(surface.position);
    return vec3(work_light * max(dot(surface.normal, to_eye), 0.0) * PI / expose(vec3(1.0), ev100).x);
#endif
    vec3 direct_lx = vec3(0.0);
    vec3 indirect_lx = vec3(0.0);
    for (int k = 0; k < light_count; ++k) {
        if (weights[k].rgb.rgb == vec3(0.0)) continue;
        direct_lx += weights[k].rgb.rgb * texelFetch(direct_layers, ivec3(pixel, k), 0).r;
        if (indirect_in_layers)
            indirect_lx += weights[k].rgb.rgb * texelFetch(indirect_layers, ivec3(pixel, k), 0).rgb;
    }
    if (besides_unit_lx.x > 0.0) direct_lx += besides_unit_lx.x * texelFetch(besides, ivec3(pixel, 0), 0).rgb;
    if (besides_unit_lx.y > 0.0) indirect_lx += besides_unit_lx.y * texelFetch(besides, ivec3(pixel, 1), 0).rgb;
#if VIEW == VIEW_DIRECT
    return direct_lx;
#elif VIEW == VIEW_INDIRECT
    return indirect_lx;
#else
    return direct_lx + indirect_lx;
#endif
}

// What a pixel shows: illuminance, lux, or rgb luminance, cd/m²; how much of it is surfaces.
struct Shown {
    vec3 lx;
    vec3 nit;
    float covered;
};
Shown centre_of(ivec2 pixel) {
    if (!(texelFetch(gbuffer_depth, pixel, 0).r > 0.0)) return Shown(vec3(0.0), vec3(0.0), 0.0);
    vec3 lx = light_at(pixel), nit = texelFetch(albedo, pixel, 0).rgb / PI * lx;
#if defined(EMISSIVE) && VIEW != VIEW_DIRECT && VIEW != VIEW_INDIRECT
    nit += texelFetch(emissive, pixel, 0).rgb;
#endif
    return Shown(lx, nit, 1.0);
}

#ifdef EDGES
// Pixels of several surfaces (server/lighting/antialias.h).
Shown with_edges(ivec2 pixel, Shown centre) {
    uint low = edge_rows[pixel.y], end = edge_rows[pixel.y + 1], high = end;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (edge_pixels[middle].x < uint(pixel.x))
            low = middle + 1u;
        else
            high = middle;
    }
    if (low == end || edge_pixels[low].x != uint(pixel.x)) return centre;
    EdgePixel edge = edge_pixels[low];
    Shown sum = Shown(edge.own * centre.lx, edge.own * centre.nit, edge.own * centre.covered);
#if defined(EMISSIVE) && VIEW != VIEW_DIRECT && VIEW != VIEW_INDIRECT
    sum.nit += edge.emission_nit.rgb;
#endif
    for (uint t = edge.first_tap; t < edge.first_tap + edge.count; ++t) {
        EdgeTap tap = edge_taps[t];
        if (tap.x == GONIO_NO_PIXEL) continue;
        vec3 lx = light_at(ivec2(tap.x, tap.y));
        sum.lx += tap.albedo_share.a * lx;
        sum.nit += tap.albedo_share.rgb / PI * lx;
        sum.covered += tap.albedo_share.a;
    }
    return sum;
}
#endif

#ifdef OPENINGS
Shown with_openings(ivec2 pixel, Shown here) {
    ivec2 at = pixel - openings_at;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, textureSize(openings, 0)))) return here;
    vec4 seen = texelFetch(openings, at, 0);
    here.nit += seen.rgb;
    here.covered = max(here.covered, seen.a);
    return here;
}
#endif

Shown shown_at(ivec2 pixel) {
    Shown here = centre_of(pixel);
#ifdef EDGES
    here = with_edges(pixel, here);
#endif
#ifdef OPENINGS
    here = with_openings(pixel, here);
#endif
#ifdef HAZE
    vec4 before = texelFetch(air, pixel, 0);
    here.nit = here.nit * before.a + before.rgb * air_unit_nit;
    here.covered = 1.0;
#endif
    return here;
}

#if (VIEW == VIEW_ILLUMINANCE || VIEW == VIEW_LUMINANCE) && !defined(RAW)
// Of what a pixel shows: lux or cd/m².
float value_of(Shown here) {
#if VIEW == VIEW_ILLUMINANCE
    return luminance(here.lx) / max(here.covered, 1e-6);
#else
    return luminance(here.nit) / max(here.covered, 1e-6);
#endif
}

// server/scene/false_color.h has the same for captures of reference quality.
vec3 color_of(float value) {
    if (scale.marks.x > 0.0 && value < scale.marks.x) return scale.below_mark.rgb;
    if (value < scale.range.x) return scale.under.rgb;
    if (value > scale.range.y) return scale.over.rgb;
    float t = stepped_position(scale_position(value, scale.range.x, scale.range.y, scale.range.z), scale.range.w);
    float at = clamp(t, 0.0, 1.0) * float(GONIO_FALSE_COLORS - 1);
    int first = min(int(at), GONIO_FALSE_COLORS - 2);
    return mix(scale.colors[first], scale.colors[first + 1], at - float(first)).rgb;
}

int levels_reached(float value) {
    int reached = 0;
    for (int i = 0; i < int(scale.marks.y); ++i) reached += value >= scale.levels[i / 4][i % 4] ? 1 : 0;
    return reached;
}

// Result: the level whose line runs between the pixel and the ones on its right and above it, from 1 on; 0: none.
int line_at(ivec2 pixel, float value) {
    int own = levels_reached(value), line = 0;
    for (int k = 0; k < 2; ++k) {
        ivec2 beside = pixel + (k == 0 ? ivec2(1, 0) : ivec2(0, 1));
        if (any(greaterThanEqual(beside, textureSize(gbuffer_depth, 0)))) continue;
        Shown there = shown_at(beside);
        if (!(there.covered > 0.0)) continue;
        int other = levels_reached(value_of(there));
        if (other != own) line = max(own, other);
    }
    return line;
}
#endif
#endif

void main() {
#if VIEW >= VIEW_MASK && VIEW <= VIEW_RSM_FLUX
    vec4 value = cube_cross();
    vec3 shown = vec3(0.0);
    bool inside = value.a >= 0.0;
#if VIEW == VIEW_MASK
    vec3 raw = value.rrr;  // cd
    if (inside) shown = vec3(value.g);
#elif VIEW == VIEW_RSM_DEPTH
    vec3 raw = value.rrr;  // m
    if (inside) shown = vec3(value.r * cube_scale);
#elif VIEW == VIEW_RSM_NORMAL
    vec3 raw = octahedral_decode(value.rg);
    if (inside) shown = raw * 0.5 + 0.5;
#else
    vec3 raw = value.rgb;  // lm per cd of peak
    if (inside) shown = value.rgb * cube_scale;
#endif
#ifdef RAW
    out_color = inside ? vec4(raw, 1.0) : vec4(0.0);
#else
    out_color = vec4(inside ? encode(shown) : vec3(0.11), 1.0);
#endif
#else
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Shown here = shown_at(pixel);
#ifdef RAW
#if VIEW == VIEW_ILLUMINANCE
    vec3 raw = vec3(luminance(here.lx));  // lux
#elif VIEW == VIEW_LUMINANCE
    vec3 raw = vec3(luminance(here.nit));  // cd/m²
#elif VIEW == VIEW_INDIRECT
    vec3 raw = here.nit * gain;
#else
    vec3 raw = here.nit;
#endif
    out_color = vec4(raw, here.covered);
#elif VIEW == VIEW_ILLUMINANCE || VIEW == VIEW_LUMINANCE
    // A line's level is told to captures in the alpha, of 255; else it is 1.
    float value = value_of(here), alpha = 1.0;
    vec3 encoded = color_of(value);
    int line = scale.marks.y > 0.0 && here.covered > 0.0 ? line_at(pixel, value) : 0;
    if (line > 0) {
        encoded = vec3(luminance(encoded) > 0.5 ? 0.0 : 1.0);
        alpha = float(line) / 255.0;
    }
    out_color = vec4(mix(vec3(background_shade()), encoded, here.covered), alpha);
#else
    vec3 of_surfaces = here.nit / max(here.covered, 1e-6);
#if VIEW == VIEW_INDIRECT
    of_surfaces *= gain;
#endif
    vec3 encoded = here.covered > 0.0 ? encode_shown(expose(of_surfaces, ev100)) : vec3(0.0);
    out_color = vec4(here.covered == 1.0 ? encoded : mix(vec3(background_shade()), encoded, here.covered), 1.0);
#endif
#endif
}
