#include "server/transport/cell_points.h"

#include <algorithm>
#include <limits>

namespace gonio::transport {
namespace {

struct Mean {
    glm::dvec3 position{0.0}, squares{0.0};
    double lit = 0.0, area_m2 = 0.0;
};
Mean mean_of(std::span<const CellMember> members) {
    Mean mean;
    for (const CellMember& one : members) {
        const glm::dvec3 p(one.position);
        mean.position += one.area_m2 * p;
        mean.squares += one.area_m2 * p * p;
        mean.lit += one.area_m2 * one.lit;
        mean.area_m2 += one.area_m2;
    }
    mean.position /= mean.area_m2, mean.squares /= mean.area_m2, mean.lit /= mean.area_m2;
    return mean;
}

const glm::vec3& typical(std::span<const CellMember> members, const Mean& mean, float spacing_m) {
    constexpr double kLit = 5.0;  // a fifth off in light is as far off as a spacing
    const CellMember* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const CellMember& one : members) {
        const glm::dvec3 off = (glm::dvec3(one.position) - mean.position) / static_cast<double>(spacing_m);
        const double lit = mean.lit > 0.0 ? kLit * (one.lit / mean.lit - 1.0) : 0.0,
                     far = glm::dot(off, off) + lit * lit;
        if (best && far >= least) continue;
        best = &one, least = far;
    }
    return best->position;
}

// Result: how many of the members are on one side of a cut into halves of equal area, across the longest way.
std::size_t halve(std::span<CellMember> members) {
    const Mean mean = mean_of(members);
    const glm::dvec3 spread = mean.squares - mean.position * mean.position;
    const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
    std::sort(members.begin(), members.end(),
              [axis](const CellMember& a, const CellMember& b) { return a.position[axis] < b.position[axis]; });
    double sum_m2 = 0.0;
    std::size_t count = 0;
    while (count + 1 < members.size() && (count == 0 || sum_m2 + 0.5 * members[count].area_m2 < 0.5 * mean.area_m2))
        sum_m2 += members[count++].area_m2;
    return count;
}

}  // namespace

CellPoints cell_points(std::span<CellMember> members, const glm::vec3& centre, float spacing_m) {
    CellPoints points{};
    points.at.fill(centre);
    points.share[0] = 1.0f;
    if (members.empty()) return points;
    std::array<std::span<CellMember>, kCellPoints> parts{members};
    for (std::size_t count = 1; count < kCellPoints; count *= 2) {
        for (std::size_t k = count; k-- > 0;) {
            const std::span<CellMember> whole = parts[k];
            const std::size_t half = whole.size() < 2 ? whole.size() : halve(whole);
            parts[2 * k] = whole.first(half), parts[2 * k + 1] = whole.subspan(half);
        }
    }
    const double all_m2 = mean_of(members).area_m2;
    for (std::size_t k = 0; k < kCellPoints; ++k) {
        if (parts[k].empty()) {
            points.share[k] = 0.0f;
            continue;
        }
        const Mean mean = mean_of(parts[k]);
        points.at[k] = typical(parts[k], mean, spacing_m);
        points.share[k] = static_cast<float>(mean.area_m2 / all_m2);
    }
    return points;
}

}  // namespace gonio::transport
