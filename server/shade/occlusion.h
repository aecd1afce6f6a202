// Sixteen points that ask VPLs, by a ray each, whether they see them.
#pragma once

#include <span>

#include "server/shade/point_packet.h"
#include "server/shade/screen.h"

namespace gonio::shade {

class VplQuery {
public:
    // points: off their surfaces; active: the lanes that ask.
    VplQuery(const PointPacket& points, unsigned active);
    Points points() const { return points_.points(); }
    // brings: what the VPL brings to each point if nothing stands between; counts `weight` times.
    void ask(const LightView& light, const Vpl& vpl, const float* brings, float weight = 1.0f);
    float open(int i) const { return open_[i]; }        // all that those asked bring
    float blocked(int i) const { return blocked_[i]; }  // of it
    float seen(int i) const { return open_[i] > 0.0f ? 1.0f - blocked_[i] / open_[i] : 1.0f; }

private:
    PointPacket points_;
    unsigned active_;
    trace::RayPacket rays_;
    alignas(64) float open_[trace::kPacket] = {}, blocked_[trace::kPacket] = {};
};

// Sixteen nodes of the same parity, a block of 4 × 4 of them, 8 × 8 nodes wide, and the VPLs that they ask together.
struct AskingNodes {
    Patch nodes;
    std::span<const Vpl> vpls;
};
// How many of them a grid has, and one of them. The grid's node_vpls is not 0, the list not dark.
int asking_nodes(const ScreenGrid& screen);
AskingNodes asking_nodes_at(const ScreenGrid& screen, const VplCast& cast, int number);

}  // namespace gonio::shade
