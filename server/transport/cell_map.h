// Where on a surface a ray ends -> the surfel that stands for it, by one table read. Every triangle has, on each side,
// cells in barycentric coordinates, finer than surfels lie apart. A cell is filled when a ray first ends in it. Any
// thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/transport/surfels.h"

namespace gonio::transport {

class CellMap {
public:
    // Both outlive it. most_bytes: beyond, cells are larger, down to one a triangle and side.
    CellMap(const trace::Geometry& geometry, const Surfels& surfels, std::size_t most_bytes);
    static constexpr std::size_t kLeastBytesPerTriangle = 16;

    // Result: the surfel nearest to barycentric (u, v) on the front or the back of a triangle that nothing hides
    // from there; `surfels.count`: none. The same for every point of a cell, unless something stands
    // in the cell or surfels lie closer together there.
    std::uint16_t surfel_at(unsigned instance, unsigned triangle, float u, float v, bool front) const;
    // What shaders read in its place: ids by cell, `surfels.count` none. Cells that no ray has ended in yet take after
    // those next to them; of a side that no ray has ended on, the middle one is filled. A cell in which what is seen
    // differs has the surfel of its middle.
    struct Table {
        std::vector<glm::uvec2> triangles;  // first cell, cells along each edge; the back's follow the front's
        std::vector<std::uint16_t> cells;   // v × that + u
    };
    Table table(Pool& pool) const;
    std::size_t bytes() const { return size_ * sizeof(std::uint32_t) + triangles_.size() * sizeof(Triangle); }

private:
    struct Triangle {
        std::uint32_t first;  // into cells_: the front's, then the back's
        std::uint32_t side;   // cells along each edge
    };
    std::uint32_t fill(unsigned instance, unsigned triangle, std::uint32_t cell, std::uint32_t side, bool front) const;

    const trace::Geometry& geometry_;
    const Surfels& surfels_;
    std::vector<std::uint32_t> first_triangle_;  // by instance
    std::vector<Triangle> triangles_;
    std::size_t size_ = 0;
    std::unique_ptr<std::atomic<std::uint32_t>[]> cells_;  // id; with kDivided: what is seen differs within the cell
};

}  // namespace gonio::transport
