#include "server/shade/refine.h"

#include <algorithm>

namespace gonio::shade {
namespace {

constexpr unsigned kVpls = 8192;
// Nothing glides: blocks need not fade. From the third round on more of them are looked at: then windows are what is
// left of the error.
constexpr Quality kRound{1, true, 4, 1024, 4, 16.0f, 0, 0.0f, {0.06f, 0.0f, kVpls, 64, 1024, 12}};
constexpr float kLaterShare = 0.25f;
constexpr int kFirstRounds = 2;
// Its error is another one and some 1.7 times a round's: weighed by its variance, the live picture is a third of a
// round.
constexpr float kLiveRounds = 1.0f / 3.0f;
// A band's margins are done again by its neighbours: it is as high as these pixels allow, for which it takes some 130
// bytes each, and lower for a while where messages come before it is done.
constexpr int kBandPixels = 1 << 17, kLeastRows = 8;
constexpr std::size_t kPiece = std::size_t{1} << 14;  // values at a time, of 4 per pixel
// Rows around a band that its windows see: three points of the grid; two nodes and the tent over their neighbours.
constexpr int kMargin = 16;
static_assert(kMargin % 4 == 0 && kMargin >= 3 * kRound.node_stride);

// Result: a height near this one that leaves the grids' pattern where it is.
int whole_rows(int rows) {
    return std::max(rows / 8 * 8, kLeastRows);
}

// Rows first … first + rows − 1 of a picture as one of its own.
void take_band(const Surfaces& from, int first, int rows, Surfaces& band) {
    band.width = from.width;
    band.height = rows;
    band.row_length = from.row_length;
    band.rays = from.rays;
    band.rays.corner = from.rays.corner + static_cast<float>(first) * from.rays.up;
    band.depth_per_pixel = from.depth_per_pixel;
    const auto low = static_cast<std::ptrdiff_t>(static_cast<std::size_t>(first) * from.row_length),
               high = low + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(rows) * from.row_length);
    band.depth.assign(from.depth.begin() + low, from.depth.begin() + high);
    band.normal.assign(from.normal.begin() + low, from.normal.begin() + high);
}

}  // namespace

void Refinement::start(int rounds) {
    round_ = next_row_ = 0;
    rounds_ = rounds;
    weight_ = 0.0f;
    rays_.reset();
}

bool Refinement::continue_with(const Surfaces& surfaces, const LightView& light, Pool& pool,
                               const std::function<bool()>& interrupted) {
    if (finished() || interrupted()) return false;
    const int most_rows = whole_rows(kBandPixels / static_cast<int>(surfaces.row_length)),
              rows = std::min(band_rows_, most_rows);
    if (!work_on_band(surfaces, light, pool, rows, interrupted)) {
        if (rays_) band_rows_ = whole_rows(rows / 2);  // else it did not come to the band
        return false;
    }
    band_rows_ = std::min(2 * rows, most_rows);
    if (next_row_ < surfaces.height) return false;
    next_row_ = 0;
    ++round_;
    weight_ += 1.0f;
    rays_.reset();
    return true;
}

bool Refinement::work_on_band(const Surfaces& surfaces, const LightView& light, Pool& pool, int rows,
                              const std::function<bool()>& interrupted) {
    const Pool::Interruptible work(pool, interrupted);
    if (!rays_) {
        rays_.emplace(light.rays.table, kVpls, static_cast<unsigned>(round_) + 1);
        vpls_ = cast(*rays_, light.geometry, light.position, light.world_from_light, pool);
        if (work.stopped()) {
            rays_.reset();
            return false;
        }
        if (round_ == 0) sums_.assign(surfaces.row_length * static_cast<std::size_t>(surfaces.height) * 4, 0.0f);
    }
    LightView own{light.geometry,         *rays_,    vpls_,       light.position,
                  light.world_from_light, light.web, light.looks, light.unit_m2};
    const int first = std::max(0, next_row_ - kMargin), end = std::min(surfaces.height, next_row_ + rows),
              last = std::min(surfaces.height, end + kMargin);
    take_band(surfaces, first, last - first, band_);
    Quality quality = kRound;
    quality.round = static_cast<unsigned>(round_);
    if (round_ >= kFirstRounds) quality.close.share = kLaterShare;
    quality.close.from_row = next_row_ - first;
    quality.close.to_row = end - first;
    make_grid(band_, quality, grid_, pool);
    if (work.stopped()) return false;
    const Planes occlusion = trace_occlusion(grid_, own, pool);
    if (work.stopped()) return false;
    const Planes light_of = gather_grid(grid_, own, occlusion, pool);
    if (work.stopped()) return false;
    add_band(light_of, first, end, surfaces.row_length);
    next_row_ = end;
    return true;
}

// Whole or not at all: nothing may interrupt it.
void Refinement::add_band(const Planes& light, int first, int end, std::size_t row_length) {
    for (int y = next_row_; y < end; ++y) {
        float* to = sums_.data() + 4 * static_cast<std::size_t>(y) * row_length;
        for (int x = 0; x < grid_.grid.width; ++x, to += 4) {
            const auto at = static_cast<std::size_t>(grid_.grid.at(x, y - first));
            for (std::size_t k = 0; k < 3; ++k) to[k] += light[k][at];
            to[3] += 1.0f;
        }
    }
}

void Refinement::count(const std::vector<std::uint16_t>& live, Pool& pool) {
    pool.run_chunks(sums_.size(), kPiece, [&](std::size_t first, std::size_t count) {
        add_halves(live.data() + first, kLiveRounds, count, sums_.data() + first);
    });
    weight_ += kLiveRounds;
}

void Refinement::mean(float share, std::vector<std::uint16_t>& out, Pool& pool) const {
    out.resize(sums_.size());
    pool.run_chunks(sums_.size(), kPiece, [&](std::size_t first, std::size_t count) {
        mix_halves(sums_.data() + first, 1.0f / weight_, share, count, out.data() + first);
    });
}

}  // namespace gonio::shade
