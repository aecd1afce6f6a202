// The parts of a merge (apply_merge.h) beside the lights themselves: presets and cues, the patch, groups.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/scene/asset.h"
#include "server/scene/imported.h"
#include "server/scene/light.h"
#include "server/scene/merge_report.h"

namespace gonio {

struct Scene;

inline constexpr double kSamePlace_m = 1e-5;  // files are written in millimetres with decimals
// Whether two orientations differ by more than 1e-5 rad.
bool differ(const glm::dquat& a, const glm::dquat& b);

// What the file changed of a light. Presets and cues that keep it as it was follow.
struct MergedLight {
    LightValues before;  // as it was here
    glm::dvec3 position{0.0};
    glm::dquat world_from_light{1.0, 0.0, 0.0, 0.0};  // those of the last import
    bool moved = false, turned = false;               // by the file
    bool mounted = false;                             // its axes hang in another way
    bool other_profile = false;
};
// light: as it is now. Gives the values what the file changed, where they have what was there before.
void follow_merge(LightValues& values, const MergedLight& merged, const Light& light);

// A light that was merged, and what the patch said of it at the last import and says now.
struct MergedRows {
    std::string light;  // its name in the scene
    std::string file;   // in the file; empty: it is not in it
    std::string was, now, addresses_was, addresses_now;
    bool fresh = false;  // it was not there before
};
// Result: the patch with the rows of the file where that changed them or they are as it says; of all else those that
// are there. Errors: of check_patch, as Refused.
std::shared_ptr<const v1::SetPatch> merged_patch(const Scene& before, const SceneAsset& asset,
                                                 const std::vector<MergedRows>& lights,
                                                 const std::shared_ptr<const v1::SetPatch>& patch, MergeReport& report);

// Groups of the last import get and lose the lights that they do in the file. What was added and removed here stays.
// names_was, names_now: of the lights in the scene, by their index. Where one is empty, there is no such light.
void merge_groups(Scene& scene, const Imported& was, const std::vector<std::string>& names_was, const Imported& now,
                  const std::vector<std::string>& names_now, MergeReport& report);

}  // namespace gonio
