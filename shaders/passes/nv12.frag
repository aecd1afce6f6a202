// Display R'G'B' -> NV12 in one R8 target of width × 3/2 height: rows of Y', then rows of interleaved Cb Cr, each the
// mean of 2 × 2 pixels. Row 0 of the picture is its top: GL's rows are turned here.
#include "lib/display.glsl"
layout(binding = 0) uniform sampler2D display;
layout(location = 1) uniform bool filters_edges;
layout(location = 0) out float out_byte;

// From the top left.
float luma_at(ivec2 pixel) {
    ivec2 size = textureSize(display, 0);
    ivec2 at = clamp(ivec2(pixel.x, size.y - 1 - pixel.y), ivec2(0), size - 1);
    return dot(texelFetch(display, at, 0).rgb, vec3(0.2126, 0.7152, 0.0722));
}
#include "lib/edge_filter.glsl"

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    ivec2 size = textureSize(display, 0);
    if (at.y < size.y) {
        out_byte = (16.0 + 219.0 * (filters_edges ? edge_filtered(at) : luma_at(at))) / 255.0;
    } else {
        ivec2 block = ivec2(at.x & ~1, size.y - 2 - 2 * (at.y - size.y));
        vec3 rgb = 0.25 * (texelFetch(display, block, 0).rgb + texelFetch(display, block + ivec2(1, 0), 0).rgb +
                           texelFetch(display, block + ivec2(0, 1), 0).rgb + texelFetch(display, block + ivec2(1, 1), 0).rgb);
        vec3 ycc = ycbcr_709(rgb);
        out_byte = (at.x & 1) == 0 ? ycc.y : ycc.z;
    }
}
