// KHR_lights_punctual, EXT_lights_area and EXT_lights_ies -> LightSeed.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/assets/gltf_import.h"
#include "server/scene/light_tables.h"
#include "server/scene/limits.h"

namespace gonio {
namespace {

using tinygltf::Value;

constexpr double kMostCandela = 1e12;  // as in photometric files
constexpr double kLeastPanel_m = 1e-6,
                 kMostPanel_m = 1e5;  // of an area light's sides; its numbers are as great at most

// Lights are told apart by name: repeats get a number.
std::string unique_name(const SceneAsset& scene, const std::string& wanted) {
    const auto taken = [&](const std::string& name) {
        return std::any_of(scene.lights.begin(), scene.lights.end(),
                           [&](const LightSeed& light) { return light.name == name; });
    };
    const std::string_view base = wanted.empty() ? "light" : std::string_view(wanted);
    std::string name = shortened_text(base, kMaxNameBytes);
    for (int number = 2; taken(name); ++number) {
        const std::string suffix = " " + std::to_string(number);
        name = shortened_text(base, kMaxNameBytes - suffix.size()) + suffix;
    }
    return name;
}

Result<glm::dvec3> colour(const Value& list, const std::string& where) {
    glm::dvec3 result(1.0);
    for (int c = 0; c < 3; ++c) {
        result[c] = list.Get(c).GetNumberAsDouble();
        if (!(result[c] >= 0.0 && result[c] <= 1e6)) {
            return Error{"bad_gltf", where, std::to_string(result[c]), "a colour must lie between 0 and 1e6"};
        }
    }
    return result;
}

bool has_room(GltfImport& import) {
    if (import.scene.lights.size() < kMaxLights) return true;
    import.warn("the scene has more than " + std::to_string(kMaxLights) +
                " lights: the rest was left out; changes lux");
    return false;
}

// Where Gonio wrote the file the level is told apart; for others it is within the multiplier. Both must still agree.
void take_level(const Value& extras, LightSeed& light) {
    if (!extras.Has("gonio")) return;
    const Value& own = extras.Get("gonio");
    const double level = number_of(own, "level_ratio", -1.0), multiplier = number_of(own, "multiplier", -1.0);
    if (!(level >= 0.0 && level <= 1.0 && multiplier >= 0.0 && multiplier <= kMostCandela)) return;
    if (std::abs(level * multiplier - light.multiplier) > 1e-9 * light.multiplier) return;
    light.level_ratio = level;
    light.multiplier = multiplier;
}

void add_light(GltfImport& import, const LightNode& node, const std::string& fallback_name, LightSeed light) {
    const std::string& node_name = import.document.model->nodes[node.index].name;
    light.name = unique_name(import.scene, node_name.empty() ? fallback_name : node_name);
    light.position = node.position;
    light.world_from_light = node.world_from_light;
    take_level(import.document.model->nodes[node.index].extras, light);
    import.scene.lights.push_back(std::move(light));
}

std::optional<Error> add_punctual(GltfImport& import, const LightNode& node, int index) {
    const tinygltf::Light& from = import.document.model->lights[index];
    const std::string where = "/extensions/KHR_lights_punctual/lights/" + std::to_string(index);
    if (!has_room(import)) return std::nullopt;
    LightSeed light;
    light.sun = from.type == "directional";
    if (light.sun) {
        light.profile = sun_profile();
    } else if (from.type == "point") {
        light.profile = punctual_point_profile();
    } else if (from.type == "spot") {
        const double inner = from.spot.innerConeAngle, outer = from.spot.outerConeAngle;
        if (!(inner >= 0.0 && inner <= std::numbers::pi) || !(outer > 0.0 && outer <= std::numbers::pi)) {
            return Error{"bad_gltf", where + "/spot", print_number(inner) + ", " + print_number(outer),
                         "cone angles lie between 0 and pi/2"};
        }
        if (outer > std::numbers::pi / 2.0 + 1e-6)
            import.warn("a cone angle beyond pi/2 was limited to it; changes lux (" + where + ")");
        if (!(inner < outer))
            import.warn("the inner cone of a spot is not inside its outer one: its edge is sharp; changes lux (" +
                        where + "/spot)");
        std::shared_ptr<const Profile>& spot = import.spots[{inner, outer}];
        if (!spot) {
            if (auto full = take_memory(import.room, 1, kBytesOfProfile, where)) return full;
            spot = punctual_spot_profile(inner, outer);
        }
        light.profile = spot;
    } else {
        return Error{"bad_gltf", where + "/type", from.type, "there is no such type of light"};
    }
    if (!(from.intensity >= 0.0 && from.intensity <= kMostCandela)) {
        return Error{"bad_gltf", where + "/intensity", print_number(from.intensity),
                     light.sun ? "the intensity must lie between 0 and 1e12 lx"
                               : "the intensity must lie between 0 and 1e12 cd"};
    }
    light.multiplier = from.intensity;
    for (int c = 0; c < std::ssize(from.color) && c < 3; ++c) {
        if (!(from.color[c] >= 0.0 && from.color[c] <= 1e6)) {
            return Error{"bad_gltf", where + "/color", print_number(from.color[c]),
                         "a colour must lie between 0 and 1e6"};
        }
        light.color[c] = from.color[c];
    }
    if (from.range > 0.0 && !light.sun)
        import.warn("the range of lights is ignored: light falls off by the inverse square; changes lux (" + where +
                    ")");
    tables_of(*light.profile);
    add_light(import, node, from.name, std::move(light));
    return std::nullopt;
}

// The opening of a light of EXT_lights_area, in metres as the scene is scaled.
Result<ies::Opening> opening_of_area(const Value& from, double scale, const std::string& where) {
    const std::string type = from.Get("type").Get<std::string>();
    const double size = number_of(from, "size", 1.0);
    if (!(size > 0.0 && size <= kMostPanel_m))
        return Error{"bad_gltf", where + "/size", print_number(size), "the size must be more than 0, at most 1e5"};
    ies::Opening opening{ies::OpeningShape::ellipse, size * scale * m, size * scale * m, 0.0 * m};
    if (type == "disk" || type == "disc") return opening;
    if (type != "rect") return Error{"bad_gltf", where + "/type", type, "there is no such type of light"};
    const double aspect = from.Has("rect") ? number_of(from.Get("rect"), "aspect", 1.0) : 1.0;
    if (!(aspect > 0.0 && aspect <= kMostPanel_m))
        return Error{"bad_gltf", where + "/rect/aspect", print_number(aspect),
                     "the aspect must be more than 0, at most 1e5"};
    opening.shape = ies::OpeningShape::rectangle;
    opening.length = size * aspect * scale * m;  // along X, as C0 is
    return opening;
}

// The draft of the Khronos Group's pull request 2525. The luminance is `intensity`; earlier files call it `luminance`.
std::optional<Error> add_area(GltfImport& import, const LightNode& node, int index) {
    const Value& from = import.document.model->extensions.at("EXT_lights_area").Get("lights").Get(index);
    const std::string where = "/extensions/EXT_lights_area/lights/" + std::to_string(index);
    if (!has_room(import)) return std::nullopt;
    const auto opening = opening_of_area(from, node.scale * import.options.scale, where);
    if (!opening) return opening.error();
    const double length_m = opening->length.in(m), width_m = opening->width.in(m);
    const char* const unit = from.Has("intensity") || !from.Has("luminance") ? "intensity" : "luminance";
    LightSeed light;
    light.multiplier = number_of(from, unit, 1000.0);
    if (!(light.multiplier >= 0.0 && light.multiplier <= kMostCandela) ||
        !(light.multiplier * length_m * width_m <= kMostCandela))
        return Error{"bad_gltf", where + "/" + unit, print_number(light.multiplier),
                     "the luminance must lie between 0 and 1e12 cd/m², and give 1e12 cd at most"};
    if (from.Has("color")) {
        const auto read = colour(from.Get("color"), where + "/color");
        if (!read) return read.error();
        light.color = *read;
    }
    if (!(std::min(length_m, width_m) >= kLeastPanel_m && std::max(length_m, width_m) <= kMostPanel_m)) {
        import.warn("an area light of less than a micrometre or more than 100 km was left out; changes lux (/nodes/" +
                    std::to_string(node.index) + ")");
        return std::nullopt;
    }
    std::shared_ptr<const Profile>& panel = import.panels[{static_cast<double>(opening->shape), length_m, width_m}];
    if (!panel) {
        if (auto full = take_memory(import.room, 1, kBytesOfProfile, where)) return full;
        panel = panel_profile(*opening);
    }
    light.profile = panel;
    tables_of(*light.profile);
    const std::string name = from.Has("name") ? from.Get("name").Get<std::string>() : std::string();
    add_light(import, node, name, std::move(light));
    return std::nullopt;
}

Result<std::shared_ptr<const Profile>> read_ies_profile(const GltfDocument& document,
                                                        const GltfDocument::IesSource& source,
                                                        const std::string& where) {
    std::string place = where, shown, name = source.name;
    std::vector<std::byte> bytes;
    if (!source.uri.empty()) {
        place += "/uri";
        shown = shown_uri(source.uri);
        if (name.empty() && !is_data_uri(source.uri)) name = source.uri.substr(source.uri.rfind('/') + 1);
        auto read = read_uri(document.directory, source.uri, place, ies::kMaxFileBytes, ies::kMaxFileBytes);
        if (!read) return read.error();
        bytes = std::move(*read);
    } else if (source.buffer_view >= 0) {
        place += "/bufferView";
        shown = std::to_string(source.buffer_view);
        const ByteView held = view_bytes(document, source.buffer_view);
        bytes.assign(held.begin(), held.end());
    } else {
        return Error{"bad_gltf", where, "", "a light without uri and bufferView"};
    }
    if (name.empty()) name = "ies";
    auto profile =
        make_profile(shortened_text(name, kMaxNameBytes), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (profile) return profile;
    const Error& cause = profile.error();
    return Error{"bad_profile", place, shown, "the photometric file is refused: " + cause.code + ", " + cause.text()};
}

// What a luminaire has whose photometric file cannot be read: it is there and dark until it gets another profile.
std::shared_ptr<const Profile> dark_profile(GltfImport& import, const GltfDocument::IesSource& source, int index,
                                            const Error& why) {
    import.dark_profiles.emplace(index, why);
    std::string name = source.name;
    if (name.empty() && !is_data_uri(source.uri)) name = source.uri.substr(source.uri.rfind('/') + 1);
    return unlit_profile(shortened_text(name.empty() ? "ies" : name, kMaxNameBytes), why.code, why.message);
}

std::optional<Error> add_ies(GltfImport& import, const LightNode& node, const Value& extension) {
    const int index = extension.Get("light").GetNumberAsInt();
    const std::string root = "/extensions/EXT_lights_ies/lights/" + std::to_string(index);
    const std::string where = "/nodes/" + std::to_string(node.index) + "/extensions/EXT_lights_ies";
    if (!has_room(import)) return std::nullopt;
    std::shared_ptr<const Profile>& profile = import.ies_profiles[index];
    if (!profile) {
        if (auto full = take_memory(import.room, 1, kBytesOfProfile, root)) return full;
        auto read = read_ies_profile(import.document, import.document.ies_lights[index], root);
        profile = read ? *read : dark_profile(import, import.document.ies_lights[index], index, read.error());
        for (const auto& diagnostic : profile->photometry.diagnostics) {
            if (read && diagnostic.severity == "warning") import.warn(diagnostic.message + " (" + root + ")");
        }
        const std::string& thinned = tables_of(*profile).thinned;
        if (!thinned.empty()) import.warn(thinned + " This changes lux (" + root + ")");
    }
    LightSeed light;
    light.profile = profile;
    if (extension.Has("multiplier")) light.multiplier = extension.Get("multiplier").GetNumberAsDouble();
    if (!(light.multiplier >= 0.0 && light.multiplier <= 1e9)) {
        return Error{"bad_gltf", where + "/multiplier", print_number(light.multiplier),
                     "the multiplier must lie between 0 and 1e9"};
    }
    if (extension.Has("color")) {
        const auto read = colour(extension.Get("color"), where + "/color");
        if (!read) return read.error();
        light.color = *read;
    }
    add_light(import, node, profile->name, std::move(light));
    return std::nullopt;
}

}  // namespace

std::optional<Error> warn_of_dark_lights(GltfImport& import) {
    constexpr std::size_t kNamed = 3;
    for (const auto& [index, why] : import.dark_profiles) {
        std::string names;
        std::size_t count = 0;
        for (const LightSeed& light : import.scene.lights) {
            if (light.profile != import.ies_profiles[index] || ++count > kNamed) continue;
            names += (count > 1 ? ", \"" : "\"") + light.name + "\"";
        }
        if (count > kNamed) names += " and " + std::to_string(count - kNamed) + " more";
        const bool named = !why.value.empty() && !is_data_uri(why.value);
        import.warn((count == 1 ? "a luminaire is dark: " : "luminaires are dark: ") + names + ", because " +
                    why.message + "; changes lux (" + why.where + (named ? ": " + why.value : "") + ")");
    }
    return std::nullopt;
}

std::optional<Error> import_node_light(GltfImport& import, const LightNode& node) {
    const auto& extensions = import.document.model->nodes[node.index].extensions;
    const auto light_of = [&](const char* extension) {
        const auto found = extensions.find(extension);
        return found == extensions.end() ? nullptr : &found->second;
    };
    const Value *const punctual = light_of("KHR_lights_punctual"), *const area = light_of("EXT_lights_area"),
                       *const ies = light_of("EXT_lights_ies");
    // A light on the node of a better one is the fallback of viewers that know no better: both would count twice. That
    // of a scene that Gonio saved is understood.
    const bool own = import.document.model->nodes[node.index].extras.Has("gonio");
    const std::string where = "; changes lux (/nodes/" + std::to_string(node.index) + ")";
    if (ies && area) import.warn("the area light beside the measured one was left out" + where);
    if (ies && punctual && !own) import.warn("the punctual light beside the measured one was left out" + where);
    if (!ies && area && punctual) import.warn("the punctual light beside the area light was left out" + where);
    if (ies) return add_ies(import, node, *ies);
    if (area) return add_area(import, node, area->Get("light").GetNumberAsInt());
    if (punctual) return add_punctual(import, node, punctual->Get("light").GetNumberAsInt());
    return std::nullopt;
}

}  // namespace gonio
