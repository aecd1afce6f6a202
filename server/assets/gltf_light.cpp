// KHR_lights_punctual and EXT_lights_ies -> LightSeed.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/assets/gltf_import.h"
#include "server/scene/light_tables.h"

namespace gonio {
namespace {

using tinygltf::Value;

constexpr double kMostCandela = 1e12;  // as in photometric files

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

Result<std::shared_ptr<const Profile>> read_ies_profile(const GltfDocument& document,
                                                        const GltfDocument::IesSource& source,
                                                        const std::string& where) {
    std::string place = where, shown, name = source.name;
    std::vector<std::byte> bytes;
    if (!source.uri.empty()) {
        place += "/uri";
        shown = shown_uri(source.uri);
        if (name.empty() && source.uri.rfind("data:", 0) != 0) name = source.uri.substr(source.uri.rfind('/') + 1);
        auto read = read_uri(document.directory, source.uri, place, ies::kMaxFileBytes, ies::kMaxFileBytes);
        if (!read) return read.error();
        bytes = std::move(*read);
    } else if (source.buffer_view >= 0) {
        place += "/bufferView";
        shown = std::to_string(source.buffer_view);
        const Bytes held = view_bytes(document, source.buffer_view);
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

std::optional<Error> add_ies(GltfImport& import, const LightNode& node, const Value& extension) {
    const int index = extension.Get("light").GetNumberAsInt();
    const std::string root = "/extensions/EXT_lights_ies/lights/" + std::to_string(index);
    const std::string where = "/nodes/" + std::to_string(node.index) + "/extensions/EXT_lights_ies";
    if (!has_room(import)) return std::nullopt;
    std::shared_ptr<const Profile>& profile = import.ies_profiles[index];
    if (!profile) {
        if (auto full = take_memory(import.room, 1, kBytesOfProfile, root)) return full;
        auto read = read_ies_profile(import.document, import.document.ies_lights[index], root);
        if (!read) return read.error();
        profile = *read;
        for (const auto& diagnostic : profile->photometry.diagnostics) {
            if (diagnostic.severity == "warning") import.warn(diagnostic.message + " (" + root + ")");
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

std::optional<Error> import_node_light(GltfImport& import, const LightNode& node) {
    const auto& extensions = import.document.model->nodes[node.index].extensions;
    const auto punctual = extensions.find("KHR_lights_punctual");
    const auto ies = extensions.find("EXT_lights_ies");
    if (ies != extensions.end()) {
        // A punctual light on the same node is the fallback of viewers without photometry: both would count twice.
        if (punctual != extensions.end()) {
            import.warn("the punctual light beside the measured one was left out; changes lux (/nodes/" +
                        std::to_string(node.index) + ")");
        }
        return add_ies(import, node, ies->second);
    }
    if (punctual == extensions.end()) return std::nullopt;
    return add_punctual(import, node, punctual->second.Get("light").GetNumberAsInt());
}

}  // namespace gonio
