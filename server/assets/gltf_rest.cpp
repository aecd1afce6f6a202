#include "server/assets/gltf_rest.h"

#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace gonio {
namespace {

// Animations have not been checked, as nothing else of them is read: whatever is not as it should be is not there.
const nlohmann::json* member_of(const nlohmann::json& value, const char* name) {
    if (!value.is_object()) return nullptr;
    const auto found = value.find(name);
    return found == value.end() ? nullptr : &*found;
}

const nlohmann::json* element_of(const nlohmann::json* list, const nlohmann::json* index) {
    if (!list || !list->is_array() || !index || !index->is_number()) return nullptr;
    const auto at = index->get<double>();
    return at >= 0.0 && at < static_cast<double>(list->size()) ? &(*list)[static_cast<std::size_t>(at)] : nullptr;
}

// Result: N of /nodes/N/extensions/KHR_node_visibility/visible.
std::optional<int> node_of_pointer(std::string_view pointer) {
    constexpr std::string_view kStart = "/nodes/", kEnd = "/extensions/KHR_node_visibility/visible";
    if (!pointer.starts_with(kStart) || !pointer.ends_with(kEnd) || pointer.size() <= kStart.size() + kEnd.size())
        return std::nullopt;
    pointer.remove_prefix(kStart.size());
    pointer.remove_suffix(kEnd.size());
    int node = -1;
    const auto read = std::from_chars(pointer.data(), pointer.data() + pointer.size(), node);
    if (read.ec != std::errc() || read.ptr != pointer.data() + pointer.size() || node < 0) return std::nullopt;
    return node;
}

std::optional<int> node_of_channel(const nlohmann::json& channel) {
    const nlohmann::json* at = member_of(channel, "target");
    for (const char* name : {"extensions", "KHR_animation_pointer", "pointer"})
        at = at ? member_of(*at, name) : nullptr;
    return at && at->is_string() ? node_of_pointer(at->get_ref<const std::string&>()) : std::nullopt;
}

}  // namespace

std::vector<GltfSkin> skins_of(const nlohmann::json& document) {
    std::vector<GltfSkin> skins;
    for (const nlohmann::json& skin : document.value("skins", nlohmann::json::array()))
        skins.push_back({skin["joints"].get<std::vector<int>>(), skin.value("inverseBindMatrices", -1)});
    return skins;
}

std::map<int, int> visibility_keys_of(const nlohmann::json& document) {
    std::map<int, int> keys;
    const nlohmann::json *const animations = member_of(document, "animations"),
                                *const accessors = member_of(document, "accessors"),
                                *const nodes = member_of(document, "nodes");
    if (!animations || !animations->is_array() || !accessors || !nodes) return keys;
    for (const nlohmann::json& animation : *animations) {
        const nlohmann::json *const channels = member_of(animation, "channels"), *const samplers =
                                                                                     member_of(animation, "samplers");
        if (!channels || !channels->is_array()) continue;
        for (const nlohmann::json& channel : *channels) {
            const auto node = node_of_channel(channel);
            if (!node || static_cast<std::size_t>(*node) >= nodes->size()) continue;
            const nlohmann::json* const sampler = element_of(samplers, member_of(channel, "sampler"));
            const nlohmann::json* const output = sampler ? member_of(*sampler, "output") : nullptr;
            const nlohmann::json* const accessor = element_of(accessors, output);
            if (accessor && (*accessor)["type"] == "SCALAR") keys.try_emplace(*node, output->get<int>());
        }
    }
    return keys;
}

void complete_spots(nlohmann::json& document) {
    static const nlohmann::json::json_pointer list("/extensions/KHR_lights_punctual/lights");
    if (!document.contains(list)) return;
    for (nlohmann::json& light : document[list])
        if (light["type"] == "spot" && !light.contains("spot")) light["spot"] = nlohmann::json::object();
}

}  // namespace gonio
