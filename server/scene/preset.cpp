#include "server/scene/preset.h"

#include <algorithm>

#include "protocol/schema/command.pb.h"
#include "server/base/clock.h"
#include "server/scene/scene.h"
#include "server/scene/white.h"

namespace gonio {
Preset preset_of(const Scene& scene) {
    Preset preset;
    for (const Light& light : scene.lights) preset.push_back({static_cast<const LightValues&>(light), light.name});
    return preset;
}

Numbers between(const LightRow& light_row, const Numbers& from, const Numbers& to, double ratio) {
    if (ratio >= 1.0) return to;
    const PropertyRow& row = row_of(light_row.property);
    const bool white = row.property == Property::cct, from_none = from[0] == 0 || to[0] == 0;
    if (row.whole || (row.or_none && from_none && !white)) return ratio > 0.0 ? to : from;  // nothing lies between
    const auto way = [&](double end) { return white && end == 0 ? kWhiteCct_k : end; };
    Numbers numbers{};
    for (std::size_t i = 0; i < count_of(light_row); ++i)
        numbers[i] = way(from[i]) + (way(to[i]) - way(from[i])) * ratio;
    return numbers;
}

Fade::Fade(const Scene& scene, const Preset& to, double fade_s, std::int64_t now_ns)
    : began_ns_(now_ns), fade_s_(fade_s) {
    for (const PresetLight& kept : to) {
        const Light* light = find_light(scene, kept.name);
        if (light == nullptr) continue;
        for (const LightRow& light_row : light_rows()) {
            const Numbers from = numbers_of(*light, light_row), end = numbers_of(kept, light_row);
            if (from != end) parts_.push_back({kept.name, &light_row, from, end, from});
        }
    }
}

std::vector<v1::Command> Fade::step(const Scene& scene, std::int64_t now_ns) {
    const double t = std::clamp(seconds_between(began_ns_, now_ns) / fade_s_, 0.0, 1.0);
    std::erase_if(parts_, [&](const Part& part) {
        const Light* light = find_light(scene, part.light);
        return light == nullptr || numbers_of(*light, *part.light_row) != part.said;
    });
    std::vector<v1::Command> commands;
    for (Part& part : parts_) {
        if (commands.empty() || commands.back().set_light().name() != part.light)
            commands.emplace_back().mutable_set_light()->set_name(part.light);
        part.said = between(*part.light_row, part.from, part.to, t);
        write_numbers(*commands.back().mutable_set_light(), row_of(part.light_row->property).field, *part.light_row,
                      part.said);
    }
    if (t >= 1.0) parts_.clear();
    return commands;
}

void Fade::follow(const std::string& name, const std::string& new_name) {
    for (Part& part : parts_)
        if (part.light == name) part.light = new_name;
}

}  // namespace gonio
