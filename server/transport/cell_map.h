// Where on a surface a ray ends -> the surfel that stands for it, by one table read. Every triangle has, on each side,
// cells in barycentric coordinates, finer than surfels lie apart. A cell is filled when a ray first ends in it. Where
// all cells are too many, a hash table holds those that light reaches. Any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/transport/surfels.h"

namespace gonio::transport {

class CellMap {
public:
    // Both outlive it. most_bytes: of the cells, and again of Table. A cell that finds no room is looked up anew by
    // each ray.
    CellMap(const trace::Geometry& geometry, const Surfels& surfels, std::size_t most_bytes);
    static constexpr std::size_t kLeastBytesPerTriangle = 12;

    // Result: the surfel nearest to barycentric (u, v) on the front or the back of a triangle that nothing hides
    // from there; `surfels.count`: none. The same for every point of a cell, unless something stands
    // in the cell or surfels lie closer together there.
    std::uint16_t surfel_at(unsigned instance, unsigned triangle, float u, float v, bool front) const;
    // What shaders read in its place: ids by cell, `surfels.count` none. Where all cells do not fit they are larger,
    // down to one a triangle and side. Cells that no ray has ended in yet take after those next to them; of a side that
    // no ray has ended on, the middle one is filled. A cell in which what is seen differs has the surfel of its middle.
    struct Table {
        std::vector<glm::uvec2> triangles;  // first cell, cells along each edge; the back's follow the front's
        std::vector<std::uint16_t> cells;   // v × that + u
    };
    Table table(Pool& pool) const;
    std::size_t bytes() const {
        return own_count_ * sizeof(own_[0]) + (mask_ + 1) * sizeof(hashed_[0]) +
               triangles_.size() * (sizeof(Triangle) + sizeof(float));
    }

private:
    struct Triangle {
        std::uint64_t first : 47;  // cell: the front's, then the back's
        std::uint64_t side : 17;   // cells along each edge
    };
    // A cell of a triangle's front or back.
    struct Cell {
        unsigned instance, triangle;
        bool front;
        std::uint32_t column, row, side;
    };
    std::uint32_t known(std::uint64_t number) const;
    void keep(std::uint64_t number, std::uint32_t value) const;
    std::uint32_t fill(const Cell& cell) const;

    const trace::Geometry& geometry_;
    const Surfels& surfels_;
    const std::size_t most_bytes_;
    std::vector<std::uint32_t> first_triangle_;  // by instance
    std::vector<float> longest_m_;               // edge, by triangle
    std::vector<Triangle> triangles_;
    // Where all cells fit: of each, 1 + its value, an id, with kDivided where what is seen differs within the cell; 0:
    // not filled.
    std::unique_ptr<std::atomic<std::uint32_t>[]> own_;
    std::size_t own_count_ = 0;
    // Else, by hash: 1 + the number of a cell and, below it, its value; 0: no cell. mask_ + 1 of them.
    std::unique_ptr<std::atomic<std::uint64_t>[]> hashed_;
    std::uint64_t mask_ = ~std::uint64_t{0};
};

}  // namespace gonio::transport
