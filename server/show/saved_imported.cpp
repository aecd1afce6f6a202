#include "server/show/saved_imported.h"

#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "protocol/text/shortened_text.h"
#include "server/scene/imported.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Those of the scene, and as many that are missing.
constexpr int kMostImported = 2 * static_cast<int>(kMaxLights);

std::string text_of(const std::string& text) {
    return shortened_text(text, kMaxNameBytes);
}

ImportedLight light_of(const saved::ImportedLight& saved) {
    ImportedLight light;
    light.uuid = text_of(saved.uuid());
    light.beam = text_of(saved.beam());
    light.number = text_of(saved.number());
    light.type = text_of(saved.type());
    light.mode = text_of(saved.mode());
    light.addresses = text_of(saved.addresses());
    light.name = text_of(saved.name());
    light.rows = text_of(saved.rows());
    light.own_web = saved.own_web();
    light.gone = saved.gone();
    if (saved.position_m_size() == 3)
        for (int i = 0; i < 3; ++i) light.position[i] = saved.position_m(i);
    if (saved.orientation_xyzw_size() == 4) {
        const glm::dquat turn(saved.orientation_xyzw(3), saved.orientation_xyzw(0), saved.orientation_xyzw(1),
                              saved.orientation_xyzw(2));
        // A unit one stays as it is to the last bit: whoever follows a show compares hashes.
        if (const double length = glm::length(turn); std::isfinite(length) && length > 1e-6)
            light.world_from_light = std::abs(length - 1.0) < 1e-9 ? turn : turn / length;
    }
    return light;
}

}  // namespace

void put_imported(const Scene& scene, saved::Show& show) {
    if (!scene.imported) return;
    show.set_imported(true);
    show.set_imported_universe_offset(scene.imported->universe_offset);
    for (const ImportedLight& light : scene.imported->lights) {
        saved::ImportedLight& out = *show.add_imported_lights();
        out.set_uuid(light.uuid);
        out.set_beam(light.beam);
        out.set_number(light.number);
        out.set_type(light.type);
        out.set_mode(light.mode);
        out.set_addresses(light.addresses);
        out.set_name(light.name);
        for (int i = 0; i < 3; ++i) out.add_position_m(light.position[i]);
        const glm::dquat& turn = light.world_from_light;
        for (const double part : {turn.x, turn.y, turn.z, turn.w}) out.add_orientation_xyzw(part);
        out.set_rows(light.rows);
        out.set_own_web(light.own_web);
        out.set_gone(light.gone);
    }
    for (const ImportedGroup& group : scene.imported->groups) {
        saved::ImportedGroup& out = *show.add_imported_groups();
        out.set_name(group.name);
        out.mutable_lights()->Add(group.lights.begin(), group.lights.end());
    }
}

void restore_imported(const saved::Show& show, Scene& scene) {
    if (!show.imported() || show.imported_lights_size() > kMostImported) return;
    auto imported = std::make_shared<Imported>();
    if (show.has_imported_universe_offset())
        imported->universe_offset = show.imported_universe_offset();
    else if (scene.asset->imported)
        imported->universe_offset = scene.asset->imported->universe_offset;
    for (const saved::ImportedLight& light : show.imported_lights()) imported->lights.push_back(light_of(light));
    for (const saved::ImportedGroup& group : show.imported_groups()) {
        if (imported->groups.size() == kMaxGroups) break;
        ImportedGroup& own = imported->groups.emplace_back();
        own.name = text_of(group.name());
        for (const std::uint32_t light : group.lights())
            if (light < imported->lights.size() && own.lights.size() < imported->lights.size())
                own.lights.push_back(light);
    }
    std::map<std::string, const saved::Light*> saved;
    for (const saved::Light& light : show.lights()) saved.emplace(light.name(), &light);
    for (Light& light : scene.lights) {
        light.missing = false;
        light.imported = -1;
        const auto at = saved.find(light.name);
        if (at == saved.end() || !at->second->has_imported() || at->second->imported() >= imported->lights.size())
            continue;
        light.imported = static_cast<int>(at->second->imported());
        light.missing = at->second->missing();
    }
    scene.imported = std::move(imported);
}

}  // namespace gonio
