#include "server/scene/console.h"

#include <algorithm>
#include <cmath>

#include "protocol/osc.h"
#include "protocol/patch.h"
#include "protocol/surface_map.h"

namespace gonio {
namespace {

bool names(const PropertyValue& value, const std::string& name) {
    return value.pattern ? osc_matches(value.target, encode_osc_name(name)) : value.target == name;
}

// Result: the lights that the value is for, in scene order, each once.
std::vector<const Light*> lights_of(const Scene& scene, const PropertyValue& value) {
    std::vector<const Light*> lights;
    for (const Light& light : scene.lights) {
        bool wanted = value.kind != PropertyValue::Kind::group && names(value, light.name);
        if (!wanted && value.kind != PropertyValue::Kind::light) {
            for (const auto& [group, members] : scene.groups) {
                const bool member = std::find(members.begin(), members.end(), light.name) != members.end();
                wanted = wanted || (member && names(value, group));
            }
        }
        if (wanted) lights.push_back(&light);
    }
    return lights;
}

using Vector = google::protobuf::RepeatedField<double>;

void put(Vector* field, const std::array<double, 3>& value) {
    field->Clear();
    for (const double one : value) field->Add(one);
}

// One of three components; the others stay as the command or else the light has them.
void put_component(Vector* field, const glm::dvec3& now, int component, double value) {
    if (field->empty()) put(field, {now.x, now.y, now.z});
    field->Set(component, value);
}

void put_value(v1::SetLight& set, const Light& light, const PropertyValue& value) {
    const double one = value.value[0];
    // aim and pan, tilt, roll exclude each other: the later one counts.
    const auto turn = [&] { set.clear_aim(); };
    switch (value.property) {
        case Property::level:
            return set.set_level_ratio(one);
        case Property::red:
        case Property::green:
        case Property::blue:
            return put_component(set.mutable_color_rgb(), light.color,
                                 static_cast<int>(value.property) - static_cast<int>(Property::red), one);
        case Property::color:
            return put(set.mutable_color_rgb(), value.value);
        case Property::pan:
            return turn(), set.set_pan_rad(one);
        case Property::tilt:
            return turn(), set.set_tilt_rad(one);
        case Property::roll:
            return turn(), set.set_roll_rad(one);
        case Property::x:
        case Property::y:
        case Property::z:
            return put_component(set.mutable_position_m(), light.position,
                                 static_cast<int>(value.property) - static_cast<int>(Property::x), one);
        case Property::position:
            return put(set.mutable_position_m(), value.value);
        case Property::aim:
            set.clear_pan_rad();
            set.clear_tilt_rad();
            set.clear_roll_rad();
            return put(set.mutable_aim(), value.value);
        case Property::profile:
        case Property::master:
        case Property::exposure:
        case Property::orbit:
        case Property::elevation:
        case Property::distance:
        case Property::preset:
            return;  // commands of their own
    }
}

// The eye as seen from the target.
struct Orbit {
    double azimuth_rad = 0, elevation_rad = 0, distance_m = 1;
};

Orbit orbit_of(const Camera& camera) {
    const glm::dvec3 away = camera.eye - camera.target;
    const double distance = glm::length(away);
    return {std::atan2(away.x, away.z), std::asin(std::clamp(away.y / distance, -1.0, 1.0)), distance};
}

double& orbit_component(Orbit& orbit, Property property) {
    return property == Property::orbit       ? orbit.azimuth_rad
           : property == Property::elevation ? orbit.elevation_rad
                                             : orbit.distance_m;
}

void put_orbit(v1::SetCamera& set, const Camera& camera, const Orbit& orbit) {
    const double up = std::cos(orbit.elevation_rad);
    const glm::dvec3 away{std::sin(orbit.azimuth_rad) * up, std::sin(orbit.elevation_rad),
                          std::cos(orbit.azimuth_rad) * up};
    const glm::dvec3 eye = camera.target + away * orbit.distance_m;
    put(set.mutable_eye_m(), {eye.x, eye.y, eye.z});
}

bool is_patched_target(const Scene& scene, const std::string& name) {
    return scene.groups.contains(name) ||
           std::any_of(scene.lights.begin(), scene.lights.end(), [&](const Light& l) { return l.name == name; });
}

}  // namespace

v1::Patch patch_in_force(const Scene& scene) {
    if (!scene.patch) {
        std::vector<std::string> lights;
        for (const Light& light : scene.lights) lights.push_back(light.name);
        return default_patch(lights);
    }
    v1::Patch patch;
    *patch.mutable_rows() = scene.patch->rows();
    for (int i = 0; i < patch.rows_size(); ++i) {
        const v1::PatchRow& row = patch.rows(i);
        if (row.target().empty() || is_patched_target(scene, row.target())) continue;
        patch.add_warnings("row " + std::to_string(i) + " (" + row.protocol() + " " + std::to_string(row.universe()) +
                           "/" + std::to_string(row.address()) + "): there is no light or group '" + row.target() +
                           "'");
    }
    return patch;
}

std::vector<std::string> surface_warnings(const Scene& scene) {
    std::vector<std::string> warnings;
    if (!scene.surfaces) return warnings;
    for (int i = 0; i < scene.surfaces->rows_size(); ++i) {
        const v1::SurfaceRow& row = scene.surfaces->rows(i);
        if (row.target().empty() || light_number(row.target()) || is_patched_target(scene, row.target())) continue;
        warnings.push_back("row " + std::to_string(i) + " (" + row.device() + " " + row.control() +
                           "): there is no light or group '" + row.target() + "'");
    }
    return warnings;
}

std::vector<v1::Command> commands_of(const Scene& scene, std::span<const PropertyValue> values,
                                     std::vector<std::size_t>* unknown) {
    std::vector<v1::Command> commands;
    std::vector<std::pair<const Light*, std::size_t>> of_light;  // which command is the light's
    std::optional<std::size_t> master, exposure, camera;
    std::optional<Orbit> orbit;
    const auto scene_command = [&](std::optional<std::size_t>& slot) -> v1::Command& {
        if (!slot) {
            slot = commands.size();
            commands.emplace_back();
        }
        return commands[*slot];
    };
    for (std::size_t i = 0; i < values.size(); ++i) {
        const PropertyValue& value = values[i];
        if (value.property == Property::master) {
            scene_command(master).mutable_set_master()->set_ratio(value.value[0]);
            continue;
        }
        if (value.property == Property::exposure) {
            scene_command(exposure).mutable_set_exposure()->set_ev100(value.value[0]);
            continue;
        }
        if (row_of(value.property).of_camera) {
            if (!orbit) orbit = orbit_of(scene.camera);
            orbit_component(*orbit, value.property) = value.value[0];
            put_orbit(*scene_command(camera).mutable_set_camera(), scene.camera, *orbit);
            continue;
        }
        if (value.property == Property::preset) {
            v1::RecallPreset& recall = *commands.emplace_back().mutable_recall_preset();
            recall.set_name(value.profile);
            recall.set_fade_s(value.value[0]);
            continue;
        }
        const std::vector<const Light*> lights = lights_of(scene, value);
        if (lights.empty() && unknown != nullptr) unknown->push_back(i);
        for (const Light* light : lights) {
            if (value.property == Property::profile) {  // it is read from a file first: nothing else shall wait for it
                v1::SetLight& set = *commands.emplace_back().mutable_set_light();
                set.set_name(light->name);
                set.mutable_profile()->set_name(value.profile);
                continue;
            }
            auto at =
                std::find_if(of_light.begin(), of_light.end(), [&](const auto& one) { return one.first == light; });
            if (at == of_light.end()) {
                at = of_light.insert(of_light.end(), {light, commands.size()});
                commands.emplace_back().mutable_set_light()->set_name(light->name);
            }
            put_value(*commands[at->second].mutable_set_light(), *light, value);
        }
    }
    return commands;
}

std::optional<double> value_now(const Scene& scene, const std::string& target, Property property) {
    if (row_of(property).of_camera) {
        Orbit orbit = orbit_of(scene.camera);
        return orbit_component(orbit, property);
    }
    if (property == Property::master) return scene.master_ratio;
    if (property == Property::exposure) return scene.exposure_ev100;
    PropertyValue named;
    named.target = target;
    const std::vector<const Light*> lights = lights_of(scene, named);
    if (lights.empty()) return std::nullopt;
    const Light& light = *lights.front();
    switch (property) {
        case Property::level:
            return light.level_ratio;
        case Property::red:
        case Property::green:
        case Property::blue:
            return light.color[static_cast<int>(property) - static_cast<int>(Property::red)];
        case Property::pan:
            return light.pan_rad;
        case Property::tilt:
            return light.tilt_rad;
        case Property::roll:
            return light.roll_rad;
        case Property::x:
        case Property::y:
        case Property::z:
            return light.position[static_cast<int>(property) - static_cast<int>(Property::x)];
        default:
            return std::nullopt;
    }
}

}  // namespace gonio
