#include "server/transport/cell_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

namespace gonio::transport {
namespace {

constexpr std::uint32_t kUnknown = ~0u, kDivided = 1u << 16;
constexpr unsigned kValueBits = 17;
constexpr std::uint64_t kMostCells = std::uint64_t{1} << 46, kProbes = 32;
constexpr float kMostAlongEdge = 65'536.0f;  // barycentric coordinates of floats tell no more apart
constexpr float kUndividedRadii = 0.35f;     // smaller ones are never divided
constexpr float kCellRadii = 0.7f;           // a cell's edge, of the surfels' radius

float longest_edge(const std::array<glm::vec3, 3>& c) {
    return std::max({glm::distance(c[0], c[1]), glm::distance(c[1], c[2]), glm::distance(c[2], c[0])});
}

std::uint32_t side_of(float edge_m, float cell_m) {
    return edge_m > cell_m && cell_m > 0.0f
               ? static_cast<std::uint32_t>(std::min(std::ceil(edge_m / cell_m), kMostAlongEdge))
               : 1u;
}

// Result: the edge of cells as large as `cell_m`, or as much larger as it takes for both sides of all triangles to have
// `most` cells.
float cells_of(std::span<const float> longest_m, float cell_m, std::uint64_t most) {
    for (;; cell_m *= 1.5f) {
        std::uint64_t count = 0;
        for (const float edge_m : longest_m) {
            const std::uint64_t side = side_of(edge_m, cell_m);
            count += 2 * side * side;
        }
        if (count <= std::max<std::uint64_t>(most, 2 * longest_m.size()) || !(cell_m > 0.0f)) return cell_m;
    }
}

// Where in the hash table to look for a cell first. Those beside it on the triangle share its cache line.
std::uint64_t slot_of(std::uint64_t number) {
    constexpr unsigned kLineBits = 3;
    return (number >> kLineBits) * 0x9e3779b97f4a7c15u >> 20 << kLineBits | (number & ((1u << kLineBits) - 1));
}

}  // namespace

CellMap::CellMap(const trace::Geometry& geometry, const Surfels& surfels, std::size_t most_bytes)
    : geometry_(geometry), surfels_(surfels), most_bytes_(most_bytes) {
    static_assert(sizeof(Triangle) + sizeof(float) == kLeastBytesPerTriangle);
    const SceneAsset& asset = geometry.asset();
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        first_triangle_.push_back(static_cast<std::uint32_t>(longest_m_.size()));
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t)
            longest_m_.push_back(longest_edge(geometry.corners(static_cast<int>(i), static_cast<int>(t))));
    }
    const float cell_m = cells_of(longest_m_, kCellRadii * surfels.radius_m, kMostCells);
    std::uint64_t cells = 0;
    triangles_.reserve(longest_m_.size());
    for (const float edge_m : longest_m_) {
        const std::uint32_t side = side_of(edge_m, cell_m);
        triangles_.push_back({cells, side});
        cells += std::uint64_t{2} * side * side;
    }
    const std::uint64_t taken = kLeastBytesPerTriangle * triangles_.size(),
                        room = most_bytes > taken ? most_bytes - taken : 0;
    if (cells * sizeof(own_[0]) <= room) {
        own_count_ = cells;
        own_ = std::make_unique<std::atomic<std::uint32_t>[]>(cells);
        return;
    }
    // Surfels are as large as four cells, small triangles have one on each side, and the table is to be half full.
    constexpr std::uint64_t kEachSurfel = 16, kEachTriangle = 8, kLeast = 1024;
    const std::uint64_t lit = kEachSurfel * surfels.count + kEachTriangle * triangles_.size(),
                        most = std::max<std::uint64_t>(room / sizeof(hashed_[0]), kLeast);
    mask_ = std::min(std::bit_ceil(std::max(lit, kLeast)), std::bit_floor(most)) - 1;
    hashed_ = std::make_unique<std::atomic<std::uint64_t>[]>(mask_ + 1);
}

// Result: what was kept of a cell; kUnknown: nothing.
std::uint32_t CellMap::known(std::uint64_t number) const {
    if (own_) return own_[number].load(std::memory_order_relaxed) - 1;
    for (std::uint64_t k = 0; k < kProbes; ++k) {
        const std::uint64_t entry = hashed_[(slot_of(number) + k) & mask_].load(std::memory_order_relaxed);
        if (entry >> kValueBits == number + 1) return entry & ((1u << kValueBits) - 1);
        if (entry == 0) break;
    }
    return kUnknown;
}

void CellMap::keep(std::uint64_t number, std::uint32_t value) const {
    if (own_) return own_[number].store(value + 1, std::memory_order_relaxed);
    for (std::uint64_t k = 0; k < kProbes; ++k) {
        std::uint64_t there = 0;
        if (hashed_[(slot_of(number) + k) & mask_].compare_exchange_strong(there, (number + 1) << kValueBits | value,
                                                                           std::memory_order_relaxed) ||
            there >> kValueBits == number + 1)
            return;
    }
}

std::uint16_t CellMap::surfel_at(unsigned instance, unsigned triangle, float u, float v, bool front) const {
    const Triangle own = triangles_[first_triangle_[instance] + triangle];
    const auto along = [&](float share) {
        return std::min(static_cast<std::uint32_t>(std::max(share, 0.0f) * static_cast<float>(own.side)),
                        static_cast<std::uint32_t>(own.side - 1));
    };
    const std::uint64_t side = own.side, column = along(u), row = along(v),
                        number = own.first + (front ? 0 : side * side) + row * side + column;
    std::uint32_t value = known(number);
    if (value == kUnknown) {  // threads that come at once find the same
        value = fill({instance, triangle, front, along(u), along(v)});
        keep(number, value);
    }
    if ((value & kDivided) == 0) return static_cast<std::uint16_t>(value);
    trace::SurfaceHit hit;
    const auto i = static_cast<int>(instance), t = static_cast<int>(triangle);
    if (!geometry_.surface_at(i, t, u, v, front, hit, false)) return static_cast<std::uint16_t>(surfels_.count);
    const auto id = static_cast<std::uint16_t>(value);
    if (id < surfels_.count && !surfels_.crowded(id) && surfels_.sees(geometry_, hit, id)) return id;
    return surfels_.visible_from(geometry_, hit);
}

std::uint32_t CellMap::fill(const Cell& cell) const {
    const auto i = static_cast<int>(cell.instance), t = static_cast<int>(cell.triangle);
    const std::uint32_t triangle = first_triangle_[cell.instance] + cell.triangle;
    const float edge = 1.0f / static_cast<float>(triangles_[triangle].side),
                u0 = static_cast<float>(cell.column) * edge, v0 = static_cast<float>(cell.row) * edge,
                edge_m = longest_m_[triangle] * edge;
    const std::uint32_t none = static_cast<std::uint32_t>(surfels_.count) | kDivided;
    // On a triangle that is too large for its cells they are larger than surfels.
    if (edge_m > 1.5f * kCellRadii * surfels_.radius_m) return none;
    // A cell on the diagonal is half a square.
    const bool half = u0 + v0 + 1.5f * edge > 1.0f;
    const float middle = (half ? 1.0f / 3.0f : 0.5f) * edge;
    trace::SurfaceHit hit;
    if (!geometry_.surface_at(i, t, u0 + middle, v0 + middle, cell.front, hit, false))
        return none;  // a hole in the middle says nothing of the rest
    const std::uint16_t id = surfels_.visible_from(geometry_, hit);
    if (id < surfels_.count && surfels_.crowded(id) && edge_m > kCellRadii * surfels_.spacing_m[id])
        return id | kDivided;
    // A cell much smaller than a surfel stands for itself.
    if (edge_m < kUndividedRadii * surfels_.radius_m) return id;
    // What stands in the cell hides the surfel from one of its corners, or from its middle alone.
    constexpr float kIn = 0.03f;  // of a cell: corners often lie on the edge of the next wall
    const glm::vec2 corners[4] = {
        {kIn, kIn}, {1.0f - 2.0f * kIn, kIn}, {kIn, 1.0f - 2.0f * kIn}, {1.0f - kIn, 1.0f - kIn}};
    for (int k = 0; k < (half ? 3 : 4); ++k) {
        trace::SurfaceHit corner;
        if (!geometry_.surface_at(i, t, u0 + corners[k].x * edge, v0 + corners[k].y * edge, cell.front, corner, false))
            continue;
        if (id == surfels_.count ? surfels_.visible_from(geometry_, corner) != id
                                 : !surfels_.sees(geometry_, corner, id))
            return id | kDivided;
    }
    return id;
}

CellMap::Table CellMap::table(Pool& pool) const {
    const auto none = static_cast<std::uint16_t>(surfels_.count);
    const float cell_m = cells_of(longest_m_, kCellRadii * surfels_.radius_m, most_bytes_ / sizeof(std::uint32_t));
    Table table;
    table.triangles.reserve(triangles_.size());
    std::uint32_t size = 0;
    for (const float edge_m : longest_m_) {
        const std::uint32_t side = side_of(edge_m, cell_m);
        table.triangles.emplace_back(size, side);
        size += 2 * side * side;
    }
    table.cells.assign(size + size % 2, none);
    // The map's filled cells by number, in order. If a cell of the table covers several of them, it takes the first.
    std::vector<std::uint64_t> kept;
    for (std::uint64_t i = 0; i < own_count_; ++i)
        if (const std::uint32_t value = known(i); value != kUnknown) kept.push_back((i + 1) << kValueBits | value);
    for (std::uint64_t i = 0; hashed_ && i <= mask_; ++i)
        if (const std::uint64_t entry = hashed_[i].load(std::memory_order_relaxed)) kept.push_back(entry);
    if (hashed_) std::sort(kept.begin(), kept.end());
    const auto set_side = [&](unsigned instance, unsigned triangle, bool front) {
        const std::uint32_t of = first_triangle_[instance] + triangle, side = table.triangles[of].y,
                            first = table.triangles[of].x + (front ? 0u : side * side);
        const std::uint64_t own_side = triangles_[of].side,
                            own_first = triangles_[of].first + (front ? 0 : own_side * own_side);
        std::vector<bool> known(std::size_t{side} * side, false);
        bool any = false;
        const auto take = [&](std::uint32_t cell, std::uint32_t value) {
            if (known[cell] || (value & ~kDivided) == surfels_.count) return;
            table.cells[first + cell] = static_cast<std::uint16_t>(value);
            known[cell] = any = true;
        };
        for (auto entry = std::lower_bound(kept.begin(), kept.end(), (own_first + 1) << kValueBits);
             entry != kept.end() && *entry >> kValueBits <= own_first + own_side * own_side; ++entry) {
            const std::uint64_t number = (*entry >> kValueBits) - 1 - own_first;
            take(static_cast<std::uint32_t>(number / own_side * side / own_side * side +
                                            number % own_side * side / own_side),
                 *entry & ((1u << kValueBits) - 1));
        }
        if (!any) {  // of the first links few end on the long triangles of a column
            trace::SurfaceHit middle;
            if (geometry_.surface_at(static_cast<int>(instance), static_cast<int>(triangle), 1.0f / 3.0f, 1.0f / 3.0f,
                                     front, middle, false))
                take(side / 3 * side + side / 3, surfels_.visible_from(geometry_, middle));
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
            for (std::size_t t = first; t < first + count; ++t)
                for (const bool front : {true, false}) set_side(i, static_cast<unsigned>(t), front);
        });
    }
    return table;
}

}  // namespace gonio::transport
