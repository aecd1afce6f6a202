// Shadow cube of alpha-masked meshes: depth only, holes cut out. Opaque meshes need no fragment shader.
#include "lib/material.glsl"
in vec2 uv;
void main() {
    if (material_base_color(uv).a < alpha_cutoff) discard;
}
