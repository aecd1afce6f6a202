#include "server/transport/cell_map.h"

#include <algorithm>
#include <cmath>

namespace gonio::transport {
namespace {

constexpr std::uint32_t kUnknown = ~0u, kDivided = 1u << 16;
constexpr float kUndividedRadii = 0.35f;  // smaller ones are never divided
constexpr float kCellRadii = 0.7f;        // a cell's edge, of the surfels' radius

float longest_edge(const std::array<glm::vec3, 3>& c) {
    return std::max({glm::distance(c[0], c[1]), glm::distance(c[1], c[2]), glm::distance(c[2], c[0])});
}

}  // namespace

CellMap::CellMap(const trace::Geometry& geometry, const Surfels& surfels, std::size_t most_bytes)
    : geometry_(geometry), surfels_(surfels) {
    const SceneAsset& asset = geometry.asset();
    std::vector<float> longest;
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        first_triangle_.push_back(static_cast<std::uint32_t>(longest.size()));
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t)
            longest.push_back(longest_edge(geometry.corners(static_cast<int>(i), static_cast<int>(t))));
    }
    const auto side_of = [](float edge, float cell) -> std::uint32_t {
        return edge > cell && cell > 0.0f ? static_cast<std::uint32_t>(std::min(std::ceil(edge / cell), 4096.0f)) : 1u;
    };
    float cell = kCellRadii * surfels.radius_m;
    for (;; cell *= 1.5f) {
        std::size_t size = 0;
        for (const float edge : longest) size += std::size_t{2} * side_of(edge, cell) * side_of(edge, cell);
        const std::size_t bytes = size * sizeof(std::uint32_t) + longest.size() * sizeof(Triangle);
        if (bytes <= std::max(most_bytes, kLeastBytesPerTriangle * longest.size())) break;
    }
    triangles_.reserve(longest.size());
    for (const float edge : longest) {
        const std::uint32_t side = side_of(edge, cell);
        triangles_.push_back({static_cast<std::uint32_t>(size_), side});
        size_ += std::size_t{2} * side * side;
    }
    cells_ = std::make_unique<std::atomic<std::uint32_t>[]>(size_);
    for (std::size_t i = 0; i < size_; ++i) cells_[i].store(kUnknown, std::memory_order_relaxed);
}

std::uint16_t CellMap::surfel_at(unsigned instance, unsigned triangle, float u, float v, bool front) const {
    const Triangle& own = triangles_[first_triangle_[instance] + triangle];
    const auto along = [&](float share) {
        return std::min(static_cast<std::uint32_t>(std::max(share, 0.0f) * static_cast<float>(own.side)), own.side - 1);
    };
    const std::uint32_t cell = along(v) * own.side + along(u);
    std::atomic<std::uint32_t>& entry = cells_[own.first + (front ? 0u : own.side * own.side) + cell];
    std::uint32_t value = entry.load(std::memory_order_relaxed);
    if (value == kUnknown) {  // threads that come at once find the same
        value = fill(instance, triangle, cell, own.side, front);
        entry.store(value, std::memory_order_relaxed);
    }
    if ((value & kDivided) == 0) return static_cast<std::uint16_t>(value);
    trace::SurfaceHit hit;
    const auto i = static_cast<int>(instance), t = static_cast<int>(triangle);
    if (!geometry_.surface_at(i, t, u, v, front, hit, false)) return static_cast<std::uint16_t>(surfels_.count);
    const auto known = static_cast<std::uint16_t>(value);
    if (known < surfels_.count && !surfels_.crowded(known) && surfels_.sees(geometry_, hit, known)) return known;
    return surfels_.visible_from(geometry_, hit);
}

std::uint32_t CellMap::fill(unsigned instance, unsigned triangle, std::uint32_t cell, std::uint32_t side,
                            bool front) const {
    const auto i = static_cast<int>(instance), t = static_cast<int>(triangle);
    const std::uint32_t column = cell % side, row = cell / side;
    const float edge = 1.0f / static_cast<float>(side), u0 = static_cast<float>(column) * edge,
                v0 = static_cast<float>(row) * edge;
    // A cell on the diagonal is half a square.
    const bool half = u0 + v0 + 1.5f * edge > 1.0f;
    const float middle = (half ? 1.0f / 3.0f : 0.5f) * edge;
    trace::SurfaceHit hit;
    if (!geometry_.surface_at(i, t, u0 + middle, v0 + middle, front, hit, false)) {
        return static_cast<std::uint32_t>(surfels_.count) | kDivided;  // a hole in the middle says nothing of the rest
    }
    const std::uint16_t id = surfels_.visible_from(geometry_, hit);
    if (id < surfels_.count && surfels_.crowded(id) &&
        longest_edge(geometry_.corners(i, t)) * edge > kCellRadii * surfels_.spacing_m[id])
        return id | kDivided;
    // A cell much smaller than a surfel stands for itself.
    if (longest_edge(geometry_.corners(i, t)) * edge < kUndividedRadii * surfels_.radius_m) return id;
    // What stands in the cell hides the surfel from one of its corners, or from its middle alone.
    constexpr float kIn = 0.03f;  // of a cell: corners often lie on the edge of the next wall
    const glm::vec2 corners[4] = {
        {kIn, kIn}, {1.0f - 2.0f * kIn, kIn}, {kIn, 1.0f - 2.0f * kIn}, {1.0f - kIn, 1.0f - kIn}};
    for (int k = 0; k < (half ? 3 : 4); ++k) {
        trace::SurfaceHit corner;
        if (!geometry_.surface_at(i, t, u0 + corners[k].x * edge, v0 + corners[k].y * edge, front, corner, false))
            continue;
        if (id == surfels_.count ? surfels_.visible_from(geometry_, corner) != id
                                 : !surfels_.sees(geometry_, corner, id))
            return id | kDivided;
    }
    return id;
}

CellMap::Table CellMap::table(Pool& pool) const {
    const auto none = static_cast<std::uint16_t>(surfels_.count);
    Table table;
    table.triangles.resize(triangles_.size());
    table.cells.assign(size_ + size_ % 2, none);
    const auto set_side = [&](unsigned instance, unsigned triangle, bool front) {
        const Triangle& own = triangles_[first_triangle_[instance] + triangle];
        const std::uint32_t side = own.side, first = own.first + (front ? 0u : side * side);
        std::vector<bool> known(std::size_t{side} * side, false);
        bool any = false;
        const auto take = [&](std::uint32_t cell, std::uint32_t value) {
            if (value == kUnknown || (value & ~kDivided) == surfels_.count) return;
            table.cells[first + cell] = static_cast<std::uint16_t>(value);
            known[cell] = any = true;
        };
        for (std::uint32_t cell = 0; cell < side * side; ++cell)
            take(cell, cells_[first + cell].load(std::memory_order_relaxed));
        if (!any) {  // of the first links few end on the long triangles of a column
            const std::uint32_t middle = side / 3 * side + side / 3,
                                value = fill(instance, triangle, middle, side, front);
            cells_[first + middle].store(value, std::memory_order_relaxed);
            take(middle, value);
        }
        if (!any) return;
        const auto spread = [&](std::uint32_t cell, bool has, std::uint32_t from) {
            if (known[cell] || !has || !known[from]) return;
            table.cells[first + cell] = table.cells[first + from];
            known[cell] = true;
        };
        for (std::uint32_t v = 0; v < side; ++v) {
            for (std::uint32_t u = 0; u + v < side; ++u) {
                spread(v * side + u, u > 0, v * side + u - 1);
                spread(v * side + u, v > 0, (v - 1) * side + u);
            }
        }
        for (std::uint32_t v = side; v-- > 0;) {
            for (std::uint32_t u = side - v; u-- > 0;) {
                spread(v * side + u, u + v + 1 < side, v * side + u + 1);
                spread(v * side + u, u + v + 1 < side, (v + 1) * side + u);
            }
        }
    };
    for (unsigned i = 0; i < first_triangle_.size(); ++i) {
        const std::size_t end = i + 1 < first_triangle_.size() ? first_triangle_[i + 1] : triangles_.size();
        pool.run_chunks(end - first_triangle_[i], 64, [&](std::size_t first, std::size_t count) {
            for (std::size_t t = first; t < first + count; ++t) {
                const Triangle& own = triangles_[first_triangle_[i] + t];
                table.triangles[first_triangle_[i] + t] = {own.first, own.side};
                for (const bool front : {true, false}) set_side(i, static_cast<unsigned>(t), front);
            }
        });
    }
    return table;
}

}  // namespace gonio::transport
