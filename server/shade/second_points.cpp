#include "server/shade/second_points.h"

#include <algorithm>
#include <array>

namespace gonio::shade {
namespace {

constexpr int kCell = 4;      // pixels
constexpr int kTogether = 8;  // rows of cells whose points come column by column, neighbours together

// How many pixels of a cell show a surface that the points around them are poorly like.
int poor_pixels(const Surfaces& surfaces, const ScreenGrid& screen, int cell_x, int cell_y) {
    int count = 0;
    for (int y = cell_y * kCell; y < std::min((cell_y + 1) * kCell, surfaces.height); ++y) {
        const std::size_t row = static_cast<std::size_t>(y) * surfaces.row_length / kCell;
        count += screen.to_pixels.poor[row + static_cast<std::size_t>(cell_x)];
    }
    return count;
}

struct Pixel {
    int x = 0, y = 0;
};
// The middle one of them, row by row.
Pixel middle_poor(const Surfaces& surfaces, const ScreenGrid& screen, int cell_x, int cell_y, int count) {
    int before = count / 2;
    for (int y = cell_y * kCell; y < std::min((cell_y + 1) * kCell, surfaces.height); ++y) {
        for (int x = cell_x * kCell; x < std::min((cell_x + 1) * kCell, surfaces.width); ++x) {
            const std::size_t at = static_cast<std::size_t>(y) * surfaces.row_length + static_cast<std::size_t>(x);
            if (!ToPixels::is_poor(screen.to_pixels.weights[at]) || !(surfaces.depth[at] > 0.0f)) continue;
            if (before-- == 0) return {x, y};
        }
    }
    return {};
}

// Takes `some` of `of`, evenly.
struct Some {
    std::size_t some, of, sum = 0;
    bool next() {
        sum += some;
        if (sum < of) return false;
        sum -= of;
        return true;
    }
};

}  // namespace

void find_second_points(const Surfaces& surfaces, float share, ScreenGrid& screen, Pool& pool) {
    Grid& grid = screen.grid;
    std::vector<std::uint8_t> poor(grid.first_spare());
    pool.run(grid.height, [&](int y) {
        for (int x = 0; x < grid.width; ++x)
            poor[static_cast<std::size_t>(grid.at(x, y))] =
                static_cast<std::uint8_t>(poor_pixels(surfaces, screen, x, y));
    });

    // Cells with as many such pixels or more fit; of those with one less, so many of each `rest.of`.
    std::array<std::size_t, kCell * kCell + 1> cells{};
    for (const std::uint8_t count : poor) ++cells[count];
    const auto most =
        std::min(grid.spare, static_cast<std::size_t>(share * static_cast<float>(grid.width * grid.height)));
    std::size_t least = cells.size(), taken = 0;
    while (least > 1 && taken + cells[least - 1] <= most) taken += cells[--least];
    Some rest{most - taken, least > 1 ? cells[least - 1] : 0};

    screen.second.assign(grid.first_spare(), 0);
    std::size_t next = grid.first_spare();
    for (int first = 0; first < grid.height; first += kTogether) {
        for (int x = 0; x < grid.width; ++x) {
            for (int y = first; y < std::min(first + kTogether, grid.height); ++y) {
                const auto at = static_cast<std::size_t>(grid.at(x, y));
                const bool wanted = poor[at] >= least || (least > 1 && poor[at] + 1u == least && rest.next());
                if (!wanted) continue;
                const Pixel pixel = middle_poor(surfaces, screen, x, y, poor[at]);
                const Spot spot = spot_at(surfaces, pixel.x, pixel.y);
                screen.second_pixels.push_back(static_cast<std::uint32_t>(pixel.y) *
                                                   static_cast<std::uint32_t>(surfaces.row_length) +
                                               static_cast<std::uint32_t>(pixel.x));
                grid.set(next, spot.position, spot.normal, spot.depth);
                screen.second[at] = static_cast<std::uint32_t>(next);
                ++next;
            }
        }
    }
}

}  // namespace gonio::shade
