// The part of the indirect light that the VPLs' kernel leaves out, found by short cosine-distributed rays.
#pragma once

#include "server/shade/screen.h"

namespace gonio::shade {

// Sixteen directions about +Z, one per lane.
struct Directions {
    alignas(64) float x[trace::kPacket], y[trace::kPacket], z[trace::kPacket];

    void set(int lane, const glm::vec3& d) { x[lane] = d.x, y[lane] = d.y, z[lane] = d.z; }
    void set_all(const glm::vec3& d) {
        for (int i = 0; i < trace::kPacket; ++i) set(i, d);
    }
};

// Result: for each of sixteen points `rays` directions, cosine-distributed about +Z, those of a point in a row, each a
// stratum of its own. round: which part of the sequence.
std::vector<glm::vec3> stratified_directions(unsigned rays, unsigned round);

// Sums of what rays bring, rgb per candela of peak.
struct alignas(64) NearSums {
    float red[trace::kPacket] = {}, green[trace::kPacket] = {}, blue[trace::kPacket] = {};
};

// Result: how long the short rays are, m.
float near_reach(const VplCast& vpls, float kappa);

// Adds to the sums of each active lane what the ray along its direction brings. points: kPacket of them, on their
// surfaces; about_z: drawn as their cosine, turned to each point's normal.
void add_near_light(const LightView& light, const Points& points, unsigned active, const Directions& about_z,
                    float kappa, NearSums& sums);
// Result: the sums of stratified_directions, each point along its own.
NearSums near_light(const LightView& light, const Points& points, unsigned active,
                    const std::vector<glm::vec3>& directions, float kappa);

}  // namespace gonio::shade
