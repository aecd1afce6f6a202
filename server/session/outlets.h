// Lights that shine into nothing, as warnings. Render thread: rays, but with commands alone.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/scene/asset.h"
#include "server/scene/light.h"
#include "server/trace/outlet.h"

namespace gonio {

struct Scene;

inline constexpr std::size_t kMostOutletWarnings = 16;  // others are counted
inline constexpr std::size_t kMostOutletsAsked = 64;    // of a change: a drag of many does not wait for rays

// The lights that are known to shine into nothing, by id.
struct HiddenLights {
    struct Hidden {
        trace::Obstacle obstacle;
        Revision asked_rev = 0;  // of the scene
    };
    std::map<std::uint32_t, Hidden> by_id;
    std::shared_ptr<const SceneAsset> asset;  // that was asked; null: none yet

    // Asks those again that were moved, turned or given another profile since, and all of another asset; forgets those
    // that are gone. Of those that moved kMostOutletsAsked are asked, and the others the next time. Result: a sentence
    // for each one that is known to be hidden now.
    std::vector<std::string> warnings(const Scene& scene);
};

// Result: a sentence for each light whose light gets nowhere. before: null, or of another asset: all are asked.
// Otherwise those are asked that came since, or were moved, turned or given another profile. A light that shone into
// nothing before is not told again. hidden: null, or what gets to know of them. Nothing where no rays can be cast yet.
std::vector<std::string> outlet_warnings(const Scene& scene, const Scene* before = nullptr,
                                         HiddenLights* hidden = nullptr);

}  // namespace gonio
