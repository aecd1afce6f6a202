#include "server/scene/preset.h"

#include <algorithm>

namespace gonio {
namespace {

const Light* find_light(const Scene& scene, const std::string& name) {
    const auto at =
        std::find_if(scene.lights.begin(), scene.lights.end(), [&](const Light& light) { return light.name == name; });
    return at == scene.lights.end() ? nullptr : &*at;
}

std::array<double, 3> three(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

}  // namespace

Preset preset_of(const Scene& scene) {
    Preset preset;
    for (const Light& light : scene.lights)
        preset.push_back({light.name, light.position, light.world_from_light, light.pan_rad, light.tilt_rad,
                          light.roll_rad, light.level_ratio, light.color, light.profile});
    return preset;
}

Fade::Fade(const Scene& scene, const Preset& to, double fade_s, std::int64_t now_ns)
    : began_ns_(now_ns), fade_s_(fade_s) {
    for (const PresetLight& kept : to) {
        if (find_light(scene, kept.name) == nullptr) continue;
        const std::pair<Kind, std::array<double, 3>> ends[] = {
            {Kind::level, {kept.level_ratio}}, {Kind::color, three(kept.color)}, {Kind::position, three(kept.position)},
            {Kind::pan, {kept.pan_rad}},       {Kind::tilt, {kept.tilt_rad}},    {Kind::roll, {kept.roll_rad}}};
        for (const auto& [kind, end] : ends) {
            Part part{kept.name, kind, {}, end, {}};
            part.from = part.said = *value_of(scene, part);
            if (part.from != part.to) parts_.push_back(std::move(part));
        }
    }
}

std::optional<std::array<double, 3>> Fade::value_of(const Scene& scene, const Part& part) {
    const Light* light = find_light(scene, part.light);
    if (light == nullptr) return std::nullopt;
    switch (part.kind) {
        case Kind::level:
            return std::array{light->level_ratio, 0.0, 0.0};
        case Kind::color:
            return three(light->color);
        case Kind::position:
            return three(light->position);
        case Kind::pan:
            return std::array{light->pan_rad, 0.0, 0.0};
        case Kind::tilt:
            return std::array{light->tilt_rad, 0.0, 0.0};
        case Kind::roll:
            return std::array{light->roll_rad, 0.0, 0.0};
    }
    return std::nullopt;
}

void Fade::put(v1::SetLight& set, Kind kind, const std::array<double, 3>& value) {
    const auto vector = [&](auto* field) { field->Assign(value.begin(), value.end()); };
    switch (kind) {
        case Kind::level:
            return set.set_level_ratio(value[0]);
        case Kind::color:
            return vector(set.mutable_color_rgb());
        case Kind::position:
            return vector(set.mutable_position_m());
        case Kind::pan:
            return set.set_pan_rad(value[0]);
        case Kind::tilt:
            return set.set_tilt_rad(value[0]);
        case Kind::roll:
            return set.set_roll_rad(value[0]);
    }
}

std::vector<v1::Command> Fade::step(const Scene& scene, std::int64_t now_ns) {
    const double t = std::clamp(static_cast<double>(now_ns - began_ns_) * 1e-9 / fade_s_, 0.0, 1.0);
    std::erase_if(parts_, [&](const Part& part) { return value_of(scene, part) != part.said; });
    std::vector<v1::Command> commands;
    for (Part& part : parts_) {
        if (commands.empty() || commands.back().set_light().name() != part.light)
            commands.emplace_back().mutable_set_light()->set_name(part.light);
        for (std::size_t i = 0; i < 3; ++i)
            part.said[i] = t < 1.0 ? part.from[i] + (part.to[i] - part.from[i]) * t : part.to[i];
        put(*commands.back().mutable_set_light(), part.kind, part.said);
    }
    if (t >= 1.0) parts_.clear();
    return commands;
}

}  // namespace gonio
