// The light of many luminaires, each kept apart so that a level is ridden without computing light anew, and their sum.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <span>
#include <vector>

#include "server/pool.h"
#include "server/shade/screen.h"

namespace gonio::shade {

// One luminaire's light per candela of its peak × a unit that all share, in half floats: 2 bytes a pixel for the direct
// light, 6 a grid point for the indirect. Reconstruction is linear in the grid's values, so that what is brought to the
// pixels is the sum of all luminaires' grids, once.
struct LightLayer {
    std::vector<std::uint16_t> direct;                   // at the pixels, Surfaces::row_length a row
    std::array<std::vector<std::uint16_t>, 3> indirect;  // rgb, in the shape of ScreenGrid::grid
    std::uint64_t version = 0;                           // another one with every change
};

// A luminaire's share of one picture. quanta: per value of the layer and channel.
struct LayerTerm {
    std::uint32_t light = 0;  // its id
    const LightLayer* layer = nullptr;
    glm::vec3 quanta{0.0f};
};

// Sums in whole quanta: a term is rounded to integers and bounded by cap() before it is added, so that a sum is the
// same in whatever order it was made and however much of it was kept from earlier pictures.
class LayerSum {
public:
    // The terms of the next picture, each of another light, no more than `most` ever. Luminaires that have not changed
    // for a while are summed up and kept, 13 bytes a pixel in all, so that a picture reads the kept sum and the others
    // only.
    void take(std::vector<LayerTerm> terms, std::size_t most, bool direct, bool indirect, Pool& pool);

    // Of the direct light: what is kept, row_length pixels a row, null if nothing is; and the terms to be added to it.
    const std::int32_t* kept_direct(int channel) const;
    std::span<const LayerTerm> others() const { return others_; }
    float cap() const { return cap_; }
    // out: 3 planes in the shape of the grid: all terms' indirect light × per_quantum.
    void indirect(float per_quantum, Planes& out, Pool& pool) const;
    // Counts pictures that differ from the one before.
    std::uint64_t changes() const { return changes_; }

private:
    struct Known {
        std::uint64_t version = 0, changed_in = 0;  // changed_in: the last picture in which it changed among few
        glm::vec3 quanta{0.0f};
        bool kept = false;
    };
    void keep(std::span<const LayerTerm> terms, bool anew, Pool& pool);

    std::map<std::uint32_t, Known> known_;  // by light
    std::array<std::vector<std::int32_t>, 3> direct_, indirect_;
    bool with_direct_ = false, with_indirect_ = false, any_kept_ = false;
    std::vector<LayerTerm> others_;
    float cap_ = 0.0f;
    std::uint64_t pictures_ = 0, changes_ = 0;
};

}  // namespace gonio::shade
