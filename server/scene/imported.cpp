#include "server/scene/imported.h"

#include <algorithm>

#include "protocol/schema/console.pb.h"
#include "server/base/sha256.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {

// A show has thousands of rows: their digest is kept, not they themselves.
std::map<std::string, std::string> row_digests(const v1::SetPatch* patch) {
    std::map<std::string, std::string> said;
    if (patch == nullptr) return said;
    for (const v1::PatchRow& row : patch->rows()) {
        v1::PatchRow rest = row;
        rest.clear_target();  // a light may have got another name
        const std::string bytes = rest.SerializeAsString();
        said[row.target()] += std::to_string(bytes.size()) + ' ' + bytes;
    }
    constexpr std::size_t kDigits = 16;
    for (auto& [target, text] : said) text = sha256(text).substr(0, kDigits);
    return said;
}

std::shared_ptr<const Imported> imported_of(const SceneAsset& asset) {
    if (!asset.imported) return nullptr;
    auto imported = std::make_shared<Imported>(*asset.imported);
    const auto rows = row_digests(asset.patch.get());
    for (std::size_t i = 0; i < imported->lights.size() && i < asset.lights.size(); ++i) {
        ImportedLight& light = imported->lights[i];
        light.name = asset.lights[i].name;
        light.position = asset.lights[i].position;
        light.world_from_light = glm::normalize(asset.lights[i].world_from_light);
        const auto own = rows.find(light.name);
        light.rows = own == rows.end() ? "" : own->second;
    }
    return imported;
}

void note_own_profile(Scene& scene, const Light& light) {
    if (light.seed >= 0 || light.imported < 0 || !scene.imported) return;  // what is of the scene's file is compared
    const auto index = static_cast<std::size_t>(light.imported);
    if (index >= scene.imported->lights.size() || scene.imported->lights[index].own_web) return;
    auto imported = std::make_shared<Imported>(*scene.imported);
    imported->lights[index].own_web = true;
    scene.imported = std::move(imported);
    scene.lights_rev = scene.scene_rev + 1;  // followers get what the show said along with the list of lights
}

std::string_view fixture_of(const Scene& scene, const Light& light) {
    const auto index = static_cast<std::size_t>(light.imported);
    if (light.imported < 0 || !scene.imported || index >= scene.imported->lights.size()) return {};
    return scene.imported->lights[index].number;
}

void take_imported(Scene& scene) {
    scene.imported = imported_of(*scene.asset);
    if (!scene.imported) return;
    for (Light& light : scene.lights)
        if (static_cast<std::size_t>(light.seed) < scene.imported->lights.size()) light.imported = light.seed;
    for (const ImportedGroup& group : scene.imported->groups) {
        if (scene.groups.size() >= kMaxGroups || is_taken(scene, group.name)) continue;
        std::vector<std::string> names;
        for (const std::uint32_t index : group.lights)
            if (index < scene.lights.size()) names.push_back(scene.lights[index].name);
        if (!names.empty()) scene.groups[group.name] = std::move(names);
    }
}

}  // namespace gonio
