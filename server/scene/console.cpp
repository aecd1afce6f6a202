#include "server/scene/console.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>

#include "protocol/dmx/patch.h"
#include "protocol/osc/osc.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_map.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

constexpr std::size_t kNone = ~std::size_t{0};

// The scene's names, looked up for each of many values.
class Targets {
public:
    explicit Targets(const Scene& scene) : scene_(scene), wanted_(scene.lights.size()) {
        for (std::size_t i = 0; i < scene.lights.size(); ++i) lights_.emplace(scene.lights[i].name, i);
    }

    // Result: the lights that the value is for, by their index in the scene, ascending, each once; until the next call.
    const std::vector<std::size_t>& of(const PropertyValue& value) {
        const bool of_lights = value.kind != PropertyValue::Kind::group;
        const bool of_groups = value.kind != PropertyValue::Kind::light;
        found_.clear();
        if (of_lights && !value.pattern) {
            if (const auto light = lights_.find(value.target); light != lights_.end()) {
                found_.push_back(light->second);
                return found_;  // no group has the name of a light
            }
        }
        std::fill(wanted_.begin(), wanted_.end(), false);
        if (value.pattern) {
            for (std::size_t i = 0; i < scene_.lights.size() && of_lights; ++i)
                if (osc_matches(value.target, encode_osc_name(scene_.lights[i].name))) wanted_[i] = true;
            for (const auto& [name, members] : scene_.groups)
                if (of_groups && osc_matches(value.target, encode_osc_name(name))) want(members);
        } else if (const auto group = scene_.groups.find(value.target); of_groups && group != scene_.groups.end()) {
            want(group->second);
        }
        for (std::size_t i = 0; i < wanted_.size(); ++i)
            if (wanted_[i]) found_.push_back(i);
        return found_;
    }

private:
    void want(const std::vector<std::string>& names) {
        for (const std::string& name : names)
            if (const auto light = lights_.find(name); light != lights_.end()) wanted_[light->second] = true;
    }
    const Scene& scene_;
    std::unordered_map<std::string_view, std::size_t> lights_;
    std::vector<bool> wanted_;
    std::vector<std::size_t> found_;
};

void put_value(v1::SetLight& set, const Light& light, const PropertyValue& value) {
    const PropertyRow& row = row_of(value.property);
    const LightRow* light_row = light_row_of(value.property);
    // aim and pan, tilt, roll exclude each other: the later one counts.
    if (value.property == Property::aim) {
        for (const LightRow& angle : light_rows())
            if (angle.stale == &Light::aim_rev) clear_numbers(set, row_of(angle.property).field);
    } else if (light_row != nullptr && light_row->stale == &Light::aim_rev) {
        set.clear_aim();
    }
    Numbers numbers = value.value;
    if (row.component >= 0) {  // the others stay as the command or else the light has them
        numbers = numbers_of(light, *light_row);
        if (has_numbers(set, row.field)) std::ranges::copy(read_numbers(set, row.field), numbers.begin());
        numbers[static_cast<std::size_t>(row.component)] = value.value[0];
    }
    write_numbers(set, row.field, std::span(numbers).first(row.component >= 0 ? 3 : row.values));
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
    set.clear_eye_m();
    for (const double one : {eye.x, eye.y, eye.z}) set.add_eye_m(one);
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
    for (std::string& warning : patch_limits(patch)) patch.add_warnings(std::move(warning));
    for (int i = 0; i < patch.rows_size(); ++i) {
        const v1::PatchRow& row = patch.rows(i);
        if (row.target().empty() || is_taken(scene, row.target())) continue;
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
        if (row.target().empty() || light_number(row.target()) || is_taken(scene, row.target())) continue;
        warnings.push_back("row " + std::to_string(i) + " (" + row.device() + " " + row.control() +
                           "): there is no light or group '" + row.target() + "'");
    }
    return warnings;
}

v1::Command cue_command(const std::string& what) {
    v1::Command command;
    if (what == "go")
        command.mutable_cue_go();
    else if (what == "back")
        command.mutable_cue_back();
    else if (what == "stop")
        command.mutable_cue_stop();
    else
        command.mutable_cue_goto()->set_number(what);
    return command;
}

std::vector<v1::Command> commands_of(const Scene& scene, std::span<const PropertyValue> values) {
    std::vector<v1::Command> commands;
    Targets targets(scene);
    std::vector<std::size_t> of_light(scene.lights.size(), kNone);  // which command is the light's
    std::size_t master = kNone, exposure = kNone, camera = kNone;
    std::optional<Orbit> orbit;
    const auto command_at = [&](std::size_t& index) -> v1::Command& {
        if (index == kNone) {
            index = commands.size();
            commands.emplace_back();
        }
        return commands[index];
    };
    for (const PropertyValue& value : values) {
        if (value.property == Property::master) {
            command_at(master).mutable_set_master()->set_ratio(value.value[0]);
            continue;
        }
        if (value.property == Property::exposure) {
            command_at(exposure).mutable_set_exposure()->set_ev100(value.value[0]);
            continue;
        }
        if (row_of(value.property).of_camera) {
            if (!orbit) orbit = orbit_of(scene.camera);
            orbit_component(*orbit, value.property) = value.value[0];
            put_orbit(*command_at(camera).mutable_set_camera(), scene.camera, *orbit);
            continue;
        }
        if (value.property == Property::preset) {
            v1::RecallPreset& recall = *commands.emplace_back().mutable_recall_preset();
            recall.set_name(value.name);
            recall.set_fade_s(value.value[0]);
            continue;
        }
        if (value.property == Property::cue) {
            commands.push_back(cue_command(value.name));
            continue;
        }
        for (const std::size_t index : targets.of(value)) {
            const Light& light = scene.lights[index];
            if (value.property == Property::profile) {  // it is read from a file first: nothing else shall wait for it
                v1::SetLight& set = *commands.emplace_back().mutable_set_light();
                set.set_name(light.name);
                set.mutable_profile()->set_name(value.name);
                continue;
            }
            v1::SetLight& set = *command_at(of_light[index]).mutable_set_light();
            if (set.name().empty()) set.set_name(light.name);
            if (value.property == Property::gel) {
                set.set_gel(value.name);
                continue;
            }
            put_value(set, light, value);
        }
    }
    return commands;
}

std::map<std::string, std::vector<std::uint32_t>> targets_of(const Scene& scene) {
    std::map<std::string, std::vector<std::uint32_t>> targets;
    for (const Light& light : scene.lights) targets[light.name] = {light.id};
    for (const auto& [name, members] : scene.groups) {
        std::vector<std::uint32_t> ids;
        for (const std::string& member : members)
            if (const auto light = targets.find(member); light != targets.end()) ids.push_back(light->second.front());
        targets[name] = std::move(ids);
    }
    return targets;
}

static std::optional<double> value_of(const Light& light, Property property) {
    const PropertyRow& row = row_of(property);
    const LightRow* light_row = row.values == 1 ? light_row_of(property) : nullptr;
    if (light_row == nullptr) return std::nullopt;
    return numbers_of(light, *light_row)[static_cast<std::size_t>(std::max(row.component, 0))];
}

ValueNow values_now(const Scene& scene) {
    std::map<std::string, std::size_t> first;  // light of each target
    for (std::size_t i = 0; i < scene.lights.size(); ++i) first.emplace(scene.lights[i].name, i);
    for (const auto& [name, members] : scene.groups) {
        std::size_t least = scene.lights.size();
        for (const std::string& member : members)
            if (const auto light = first.find(member); light != first.end()) least = std::min(least, light->second);
        if (least < scene.lights.size()) first.emplace(name, least);  // no group has the name of a light
    }
    return [&scene, first = std::move(first)](const std::string& target, Property property) -> std::optional<double> {
        if (row_of(property).of_camera) {
            Orbit orbit = orbit_of(scene.camera);
            return orbit_component(orbit, property);
        }
        if (property == Property::master) return scene.master_ratio;
        if (property == Property::exposure) return scene.exposure_ev100;
        const auto light = first.find(target);
        return light == first.end() ? std::nullopt : value_of(scene.lights[light->second], property);
    };
}

}  // namespace gonio
