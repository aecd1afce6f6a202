// The light of many luminaires, each kept apart so that a level is ridden without computing light anew, and their sum.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <span>
#include <vector>

#include "server/base/pool.h"
#include "server/lighting/screen.h"

namespace gonio::lighting {

// One luminaire's light per candela of its peak × a unit that all share, in half floats. The direct light takes 2 bytes
// a pixel. The indirect takes 6 a grid point; 8 a pixel once it is gathered. Reconstruction is linear in the grid's
// values. So what is brought to the pixels is the sum of all luminaires' grids, once.
struct LightLayer {
    std::vector<std::uint16_t> direct;                   // at the pixels, GBuffer::row_length a row
    std::array<std::vector<std::uint16_t>, 3> indirect;  // rgb, in the shape of ScreenGrid::grid
    std::vector<std::uint16_t> gathered;                 // indirect, at the pixels, rgb and 1; empty: not yet
};

// What a luminaire adds to a picture, by which a change is known.
struct LayerShare {
    std::uint64_t version = 0;              // of its layer: another one with every change
    glm::vec3 steps{0.0f};                  // per value of the layer and channel
    bool direct = false, indirect = false;  // what is shown
    bool operator==(const LayerShare&) const = default;
};
struct LayerTerm : LayerShare {
    std::uint32_t light = 0;  // its id
    const LightLayer* layer = nullptr;
    const std::uint16_t* direct_pixels() const { return direct ? layer->direct.data() : nullptr; }
    const std::uint16_t* indirect_pixels() const {
        return indirect && !layer->gathered.empty() ? layer->gathered.data() : nullptr;
    }
    bool on_grid() const { return indirect && layer->gathered.empty(); }
};

// Sums in whole steps: a term is rounded to integers and bounded by cap() before it is added. So a sum is the same in
// whatever order it was made and however much of it was kept from earlier pictures.
class LayerSum {
public:
    // The terms of the next picture, each of another light, no more than `most` ever. Luminaires that have not changed
    // for a while are summed up and kept, 13 bytes a pixel in all. So a picture reads the kept sum and the others only.
    // A layer holds so many pixels and points of each kind.
    void take(const std::vector<LayerTerm>& terms, std::size_t most, std::size_t pixels, std::size_t points,
              Pool& pool);

    // At the pixels: what is kept, row_length a row, null if nothing is; and the terms to be added to it.
    const std::int32_t* kept_pixels(int channel) const;
    std::span<const LayerTerm> others() const { return others_; }
    float cap() const { return cap_; }
    // out: 3 planes in the shape of the grid: indirect light of all terms on it × per_step.
    void grid(float per_step, Planes& out, Pool& pool) const;
    // Counts pictures that differ from the one before.
    std::uint64_t changes() const { return changes_; }

private:
    struct Known {
        LayerShare share;
        std::uint64_t changed_in = 0;  // the last picture in which it changed among few
        bool kept = false;
    };
    void keep(std::span<const LayerTerm> terms, Pool& pool);

    std::map<std::uint32_t, Known> known_;  // by light
    std::array<std::vector<std::int32_t>, 3> pixels_, grid_;
    bool any_kept_ = false;
    std::vector<LayerTerm> others_;
    float cap_ = 0.0f;
    std::uint64_t pictures_ = 0, changes_ = 0;
};

}  // namespace gonio::lighting
