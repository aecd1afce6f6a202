#include "server/scene/moved_scene.h"

#include <algorithm>

#include <google/protobuf/repeated_field.h>

#include "protocol/schema/grid.pb.h"
#include "server/scene/cue.h"

namespace gonio {
namespace {

void move(glm::dvec3& position, const glm::dvec3& by_m) {
    position = glm::clamp(position + by_m, -kFarthestSet_m, kFarthestSet_m);
}

// The target at the eye's distance.
void move(Camera& camera, const glm::dvec3& by_m) {
    const glm::dvec3 ahead = camera.target - camera.eye;
    move(camera.eye, by_m);
    camera.target = camera.eye + ahead;
}

void move(google::protobuf::RepeatedField<double>& numbers, const glm::dvec3& by_m) {
    for (int k = 0; k < numbers.size(); ++k)
        numbers[k] = std::clamp(numbers[k] + by_m[k % 3], -kFarthestSet_m, kFarthestSet_m);
}

}  // namespace

Scene moved_by(const Scene& scene, const glm::dvec3& by_m) {
    Scene moved = scene;
    for (Light& light : moved.lights) move(light.position, by_m);
    move(moved.camera, by_m);
    for (auto& [name, view] : moved.saved_views) move(view, by_m);
    std::map<const Preset*, std::shared_ptr<const Preset>> presets;  // a cue may share one
    const auto moved_preset = [&](const std::shared_ptr<const Preset>& preset) {
        std::shared_ptr<const Preset>& known = presets[preset.get()];
        if (known) return known;
        auto lights = std::make_shared<Preset>(*preset);
        for (PresetLight& light : *lights) move(light.position, by_m);
        return known = std::move(lights);
    };
    for (auto& [name, preset] : moved.presets) preset = moved_preset(preset);
    if (moved.cues) {
        auto cues = std::make_shared<CueList>();
        for (const auto& cue : *moved.cues) {
            auto other = std::make_shared<Cue>(*cue);
            other->content = moved_preset(cue->content);
            cues->push_back(std::move(other));
        }
        moved.cues = std::move(cues);
    }
    for (auto& [name, grid] : moved.grids) {
        auto other = std::make_shared<v1::Grid>(*grid);
        move(*other->mutable_corner_m(), by_m);
        grid = std::move(other);
    }
    for (auto& [name, observer] : moved.observers) {
        auto other = std::make_shared<v1::Observer>(*observer);
        move(*other->mutable_eye_m(), by_m);
        observer = std::move(other);
    }
    moved.presets_rev = moved.cues_rev = moved.saved_views_rev = moved.grids_rev = moved.observers_rev =
        scene.scene_rev + 1;
    return moved;
}

}  // namespace gonio
