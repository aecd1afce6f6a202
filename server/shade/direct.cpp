#include <algorithm>

#include "server/shade/screen.h"

namespace gonio::shade {
namespace {

// Shadow rays start this share of a pixel's width off its surface: depth and normals are those of pixels, not exact.
constexpr float kOffPerPixel = 0.02f;

}  // namespace

void direct_light(const Surfaces& surfaces, const trace::Geometry& geometry, const DirectLight& light,
                  std::vector<float>& out, Pool& pool) {
    out.resize(surfaces.row_length * static_cast<std::size_t>(surfaces.height));
    const float off_m = 4.0f * geometry.step_off(light.position);
    // Strips of four rows: a packet is a square of 4 × 4 pixels, whose rays stay close together.
    constexpr int kSide = 4;
    static_assert(kSide * kSide == trace::kPacket);
    pool.run((surfaces.height + kSide - 1) / kSide, [&](int strip) {
        static thread_local std::vector<float> from[3];
        const int top = strip * kSide, rows = std::min(kSide, surfaces.height - top);
        const std::size_t length = surfaces.row_length;
        for (std::vector<float>& array : from) array.resize(length * kSide);
        for (int y = 0; y < rows; ++y) {
            const std::size_t row = static_cast<std::size_t>(top + y) * length,
                              own = static_cast<std::size_t>(y) * length;
            direct_row(light, top + y, static_cast<int>(length), surfaces.rays, off_m,
                       kOffPerPixel * surfaces.depth_per_pixel, surfaces.depth.data() + row,
                       surfaces.normal.data() + row, out.data() + row, from[0].data() + own, from[1].data() + own,
                       from[2].data() + own);
        }
        trace::RayPacket query;
        for (std::size_t x = 0; x < length; x += kSide) {
            unsigned lit = 0;
            for (int i = 0; i < trace::kPacket; ++i) {
                const std::size_t at =
                    static_cast<std::size_t>(i / kSide) * length + x + static_cast<std::size_t>(i % kSide);
                if (i / kSide >= rows || !(out[static_cast<std::size_t>(top) * length + at] > 0.0f)) continue;
                lit |= 1u << i;
                query.from_x[i] = from[0][at], query.from_y[i] = from[1][at], query.from_z[i] = from[2][at];
                query.along_x[i] = light.position.x - from[0][at];
                query.along_y[i] = light.position.y - from[1][at];
                query.along_z[i] = light.position.z - from[2][at];
                query.far[i] = 1.0f - 1e-5f;  // a luminaire mounted on a surface is not hidden by it
            }
            if (lit == 0) continue;
            const unsigned hidden = geometry.occluded(query, lit);
            for (int i = 0; i < trace::kPacket; ++i) {
                if ((hidden >> i & 1u) != 0)
                    out[static_cast<std::size_t>(top + i / kSide) * length + x + static_cast<std::size_t>(i % kSide)] =
                        0.0f;
            }
        }
    });
}

}  // namespace gonio::shade
