#include "server/bake/packer.h"

#include <algorithm>
#include <numeric>

namespace gonio::bake {
namespace {

// A level stretch of the upper edge of what is packed.
struct Step {
    int x, y, width;
};

}  // namespace

std::optional<std::vector<glm::ivec2>> pack(std::span<const glm::ivec2> sizes, const glm::ivec2& room) {
    std::vector<std::size_t> order(sizes.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return sizes[a].y != sizes[b].y ? sizes[a].y > sizes[b].y : sizes[a].x > sizes[b].x;
    });
    std::vector<glm::ivec2> places(sizes.size());
    std::vector<Step> skyline{{0, 0, room.x}};
    for (const std::size_t i : order) {
        const glm::ivec2 size = sizes[i];
        if (size.x > room.x || size.y > room.y) return std::nullopt;
        int best_y = room.y + 1;
        std::size_t best = 0;
        for (std::size_t s = 0; s < skyline.size(); ++s) {
            if (skyline[s].x + size.x > room.x) break;
            int y = skyline[s].y, left = size.x;
            for (std::size_t k = s; left > 0; ++k) {
                y = std::max(y, skyline[k].y);
                left -= skyline[k].width;
            }
            if (y < best_y) best_y = y, best = s;
        }
        if (best_y + size.y > room.y) return std::nullopt;
        places[i] = {skyline[best].x, best_y};
        const Step top{skyline[best].x, best_y + size.y, size.x};
        int covered = size.x;
        std::size_t end = best;
        while (end < skyline.size() && covered >= skyline[end].width) covered -= skyline[end++].width;
        if (covered > 0) skyline[end].x += covered, skyline[end].width -= covered;
        skyline.erase(skyline.begin() + static_cast<std::ptrdiff_t>(best),
                      skyline.begin() + static_cast<std::ptrdiff_t>(end));
        skyline.insert(skyline.begin() + static_cast<std::ptrdiff_t>(best), top);
    }
    return places;
}

}  // namespace gonio::bake
