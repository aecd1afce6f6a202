// EXT_mesh_gpu_instancing: a node's mesh at many places.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <string>

#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
constexpr std::size_t kBytesOfPlace = 256;  // a matrix and what it is read from

// Whether so many values from there are numbers; where there are none the instance has the default.
bool has_place(const std::vector<float>& values, std::size_t first, std::size_t count) {
    if (values.empty()) return true;
    return std::all_of(&values[first], &values[first] + count, [](float value) { return std::isfinite(value); });
}

}  // namespace

Result<std::vector<glm::dmat4>> instances_of(GltfImport& import, const tinygltf::Node& node, const std::string& where) {
    const auto found = node.extensions.find(kInstancing);
    if (found == node.extensions.end()) return std::vector<glm::dmat4>{glm::dmat4(1.0)};
    const std::string place = where + "/extensions/" + kInstancing + "/attributes";
    const tinygltf::Value& attributes = found->second.Get("attributes");
    std::vector<glm::dmat4> result;
    bool counted = false;
    // Values of an attribute, none where the node has none of it. The first one says how many instances there are.
    const auto read = [&](const char* name, std::size_t components) -> Result<std::vector<float>> {
        if (!attributes.Has(name)) return std::vector<float>{};
        const std::string here = place + "/" + name;
        const int accessor = attributes.Get(name).GetNumberAsInt();
        const std::size_t count = accessor_count(import.document, accessor);
        if (accessor_components(import.document, accessor) != components)
            return Error{"bad_gltf", here, std::to_string(accessor),
                         "the accessor's type does not suit this attribute"};
        if (counted && count != result.size())
            return Error{"bad_gltf", here, std::to_string(count), "the node's attributes have not the same count"};
        if (!counted) {
            import.instanced += count;
            if (import.instanced > kMaxSceneInstances)
                return Error{"too_large", here, std::to_string(count), "the scene has too many instances"};
            if (auto full = take_memory(import.room, count, kBytesOfPlace, here)) return *full;
            result.assign(count, glm::dmat4(1.0));
            counted = true;
        }
        return read_any_floats(import.document, accessor);
    };
    const auto moves = read("TRANSLATION", 3);
    if (!moves) return moves.error();
    const auto turns = read("ROTATION", 4);
    if (!turns) return turns.error();
    const auto scales = read("SCALE", 3);
    if (!scales) return scales.error();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < result.size(); ++i) {
        if (!has_place(*moves, 3 * i, 3) || !has_place(*turns, 4 * i, 4) || !has_place(*scales, 3 * i, 3)) continue;
        if (!turns->empty()) {
            const float* const q = &(*turns)[4 * i];
            const glm::dquat turn(static_cast<double>(q[3]), static_cast<double>(q[0]), static_cast<double>(q[1]),
                                  static_cast<double>(q[2]));
            if (!(glm::length(turn) > 1e-6)) continue;
            result[i] = glm::dmat4(glm::mat3_cast(glm::normalize(turn)));
        }
        for (int c = 0; c < 3; ++c) {
            if (!scales->empty()) result[i][c] *= static_cast<double>((*scales)[3 * i + c]);
            if (!moves->empty()) result[i][3][c] = static_cast<double>((*moves)[3 * i + c]);
        }
        result[kept++] = result[i];
    }
    if (const std::size_t lost = result.size() - kept; lost > 0)
        import.warn(std::to_string(lost) + (lost == 1 ? " instance" : " instances") +
                    " whose place is no numbers, or whose rotation has no length, left out; changes lux (" + place +
                    ")");
    result.resize(kept);
    return result;
}

}  // namespace gonio
