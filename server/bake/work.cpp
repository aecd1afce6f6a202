#include "server/bake/work.h"

#include <algorithm>

#include "server/trace/parallel.h"

namespace gonio::bake {

bool Work::tiles(int count, int tile, const std::function<void(int, int)>& job) {
    const int tiles = (count + tile - 1) / tile;
    std::atomic<int> done{0};
    return trace::parallel(tiles, threads, false, stop, [&](int i) {
        job(i * tile, std::min(count, (i + 1) * tile));
        const int now = ++done;
        if (progress) progress(static_cast<double>(now) / tiles);
    });
}

}  // namespace gonio::bake
