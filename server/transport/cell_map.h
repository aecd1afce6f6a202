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
    // The table that shaders read in place of surfel_at(). It holds the surfel of every cell, or `surfels.count` for
    // none. If all cells do not fit in most_bytes, the table's cells are larger than the map's, down to one for each
    // side of a triangle. A cell that no ray has ended in copies its neighbour. On a side that no ray has ended on, all
    // cells get the surfel at its middle. A cell that several surfels share gets the one at the cell's middle.
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
        std::uint32_t column, row;
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
    // The value of a cell is a surfel's id. kDivided is added if rays that end in the cell must look for the surfel
    // themselves. If all cells fit in most_bytes, own_ holds each cell's value + 1, or 0 until the cell is filled.
    std::unique_ptr<std::atomic<std::uint32_t>[]> own_;
    std::size_t own_count_ = 0;
    // If they do not fit, hashed_ is a hash table of the filled cells, with mask_ + 1 entries. The high bits of an
    // entry hold the cell's number + 1, its low kValueBits bits the value. An empty entry is 0.
    std::unique_ptr<std::atomic<std::uint64_t>[]> hashed_;
    std::uint64_t mask_ = ~std::uint64_t{0};
};

}  // namespace gonio::transport
