#include "server/scene/moved_scene.h"

#include <cmath>

#include <google/protobuf/repeated_field.h>

#include "protocol/schema/grid.pb.h"
#include "server/scene/cue.h"
#include "server/scene/farthest.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Moves positions, and knows whether all of them can be set.
struct Mover {
    glm::dvec3 by_m;
    bool fits = true;

    void move(glm::dvec3& position) {
        position += by_m;
        for (int k = 0; k < 3; ++k) fits &= std::abs(position[k]) <= kFarthest_m;
    }
    void move(Camera& camera) {
        move(camera.eye);
        move(camera.target);
    }
    void move(google::protobuf::RepeatedField<double>& numbers) {
        for (int k = 0; k < numbers.size(); ++k) {
            numbers[k] += by_m[k % 3];
            fits &= std::abs(numbers[k]) <= kFarthest_m;
        }
    }
};

}  // namespace

std::optional<Scene> moved_by(const Scene& scene, const glm::dvec3& by_m) {
    Mover mover{by_m};
    Scene moved = scene;
    for (Light& light : moved.lights) mover.move(light.position);
    mover.move(moved.camera);
    for (auto& [name, view] : moved.saved_views) mover.move(view);
    std::map<const Preset*, std::shared_ptr<const Preset>> presets;  // a cue may share one
    const auto moved_preset = [&](const std::shared_ptr<const Preset>& preset) {
        std::shared_ptr<const Preset>& known = presets[preset.get()];
        if (known) return known;
        auto lights = std::make_shared<Preset>(*preset);
        for (PresetLight& light : *lights) mover.move(light.position);
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
        mover.move(*other->mutable_corner_m());
        grid = std::move(other);
    }
    for (auto& [name, observer] : moved.observers) {
        auto other = std::make_shared<v1::Observer>(*observer);
        mover.move(*other->mutable_eye_m());
        observer = std::move(other);
    }
    moved.presets_rev = moved.cues_rev = moved.saved_views_rev = moved.grids_rev = moved.observers_rev =
        scene.scene_rev + 1;
    if (!mover.fits) return std::nullopt;
    return moved;
}

}  // namespace gonio
