// A still picture's indirect light, getting better: the estimate of the live picture (screen.h) at every pixel, round
// after round with VPLs and rays of its own, and the mean of all rounds.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "server/shade/screen.h"

namespace gonio::shade {

// One luminaire's refinement. While it goes on: 16 bytes a pixel, and some 20 MB for a band.
class Refinement {
public:
    // Starts anew. rounds: how many there shall be, at least 1.
    void start(int rounds);
    bool finished() const { return round_ >= rounds_; }
    int rounds_done() const { return round_; }
    int rounds() const { return rounds_; }
    // Does a band of rows of the round: some 150 ms at 800 pixels a row. rays: the luminaire's, of any round; light:
    // its other fields. interrupted: asked every few milliseconds; if true the band is given up, and one half as high
    // is done later. Result: whether that completed a round.
    bool continue_with(const Surfaces& surfaces, const LightView& light, Pool& pool,
                       const std::function<bool()>& interrupted);
    // After the first round: the live picture counts too, as a part of a round. live: as `out` below.
    void count(const std::vector<std::uint16_t>& live, Pool& pool);
    // out: the mean of the rounds so far, rgb and 1 in half floats, surfaces.row_length pixels a row, irradiance per
    // candela of peak × unit_m2; share: of it, and the rest of what `out` holds already.
    void mean(float share, std::vector<std::uint16_t>& out, Pool& pool) const;

private:
    // Result: whether the band was completed and counts.
    bool work_on_band(const Surfaces& surfaces, const LightView& light, Pool& pool, int rows,
                      const std::function<bool()>& interrupted);
    void add_band(const Planes& light, int first, int end, std::size_t row_length);

    int round_ = 0, rounds_ = 0, next_row_ = 0;
    int band_rows_ = 1 << 24;  // at most; of the next band
    std::vector<float> sums_;  // 4 per pixel
    float weight_ = 0.0f;      // rounds that they hold
    std::optional<VplRays> rays_;
    VplCast vpls_;
    Surfaces band_;
    ScreenGrid grid_;
};

}  // namespace gonio::shade
