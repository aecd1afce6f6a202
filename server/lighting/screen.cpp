#include "server/lighting/screen.h"

#include <algorithm>
#include <cmath>

#include "server/lighting/upsample.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::lighting {
void look_through(const Eye& eye, const trace::Geometry& geometry, float near_m, int width, int height, GBuffer& s) {
    s.width = width;
    s.height = height;
    constexpr std::size_t kRow = 4 * kSimdWidth;
    s.row_length = (static_cast<std::size_t>(width) + kRow - 1) / kRow * kRow;
    s.depth.resize(s.row_length * static_cast<std::size_t>(height));
    s.normal.resize(s.depth.size());
    const glm::dvec3 x = eye.right * eye.tan_half_x, y = eye.up * eye.tan_half_y;
    const glm::dvec3 right = x * (2.0 * eye.window_half.x / width), up = y * (2.0 * eye.window_half.y / height);
    s.rays.eye = geometry.local(eye.position);
    s.rays.right = glm::vec3(right);
    s.rays.up = glm::vec3(up);
    s.rays.corner = glm::vec3(eye.forward + x * (eye.window_centre.x - eye.window_half.x) +
                              y * (eye.window_centre.y - eye.window_half.y) + 0.5 * (right + up));
    s.rays.near_m = near_m;
    s.depth_per_pixel = static_cast<float>(glm::length(up));
}

Spot spot_at(const GBuffer& s, int x, int y) {
    const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
    Spot spot;
    if (!(s.depth[at] > 0.0f)) return spot;
    spot.depth = s.rays.near_m / s.depth[at];
    spot.position =
        s.rays.eye +
        (s.rays.corner + static_cast<float>(x) * s.rays.right + static_cast<float>(y) * s.rays.up) * spot.depth;
    const auto part = [](std::uint32_t bits) {
        return std::max(static_cast<float>(static_cast<std::int16_t>(bits)) / 32767.0f, -1.0f);
    };
    spot.normal = glsl::octahedral_decode({part(s.normal[at] & 0xffffu), part(s.normal[at] >> 16)});
    return spot;
}

void make_grid(const GBuffer& gbuffer, bool own_points, ScreenGrid& screen, Pool& pool) {
    screen.depth_per_point = gbuffer.depth_per_pixel * static_cast<float>(kStep);
    Grid& grid = screen.grid;
    const int width = (gbuffer.width + kStep - 1) / kStep, height = (gbuffer.height + kStep - 1) / kStep;
    // Layers keep their shape as quality levels change.
    const std::size_t places = static_cast<std::size_t>(width * height) * kStep * kStep / kOwnPoints;
    grid.resize(width, height, places);
    pool.run(grid.height, [&](int y) {
        for (int x = 0; x < grid.width; ++x) {
            const Spot spot = spot_at(gbuffer, std::min(x * kStep + kStep / 2, gbuffer.width - 1),
                                      std::min(y * kStep + kStep / 2, gbuffer.height - 1));
            grid.set(static_cast<std::size_t>(grid.at(x, y)), spot.position, spot.normal, spot.depth);
        }
    });
    for (std::vector<float>& array : grid.values) grid.extend(array);

    make_weights(gbuffer, screen, pool);
    take_after(gbuffer, own_points ? places : 0, screen, pool);
}

}  // namespace gonio::lighting
