// Extensions that say what a material's base colour is, and where its texture lies.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>

#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

using tinygltf::Value;

constexpr float kUnlitWhite_nit = 80.0f;  // of the reference display of sRGB (IEC 61966-2-1)

glm::vec2 pair(const Value& object, const char* member, const glm::vec2& fallback) {
    if (!object.Has(member)) return fallback;
    const Value& value = object.Get(member);
    return {static_cast<float>(value.Get(0).GetNumberAsDouble()), static_cast<float>(value.Get(1).GetNumberAsDouble())};
}

// KHR_texture_transform: uv' = T R S uv, rotation counter-clockwise about the texture's upper left corner.
UvPlacement transformed(const Value& transform, int set) {
    UvPlacement result;
    const auto turn = static_cast<float>(number_of(transform, "rotation", 0.0));
    const glm::vec2 scale = pair(transform, "scale", glm::vec2(1.0f));
    const float c = std::cos(turn), s = std::sin(turn);
    // Columns of R S, with R = [c s; -s c] (the extension's column-major matrix, v pointing down).
    result.linear = glm::mat2(c * scale.x, -s * scale.x, s * scale.y, c * scale.y);
    result.offset = pair(transform, "offset", glm::vec2(0.0f));
    result.set = static_cast<int>(number_of(transform, "texCoord", set));
    return result;
}

}  // namespace

double number_of(const Value& object, const char* member, double fallback) {
    return object.Has(member) ? object.Get(member).GetNumberAsDouble() : fallback;
}

UvPlacement placement_of(const tinygltf::TextureInfo& texture) {
    const auto found = texture.extensions.find("KHR_texture_transform");
    if (found != texture.extensions.end()) return transformed(found->second, texture.texCoord);
    UvPlacement result;
    result.set = texture.texCoord;
    return result;
}

BaseColour base_colour_of(const tinygltf::Material& material) {
    BaseColour base;
    const auto& core = material.pbrMetallicRoughness;
    const auto glossy = material.extensions.find("KHR_materials_pbrSpecularGlossiness");
    if (glossy == material.extensions.end()) {
        std::copy_n(core.baseColorFactor.begin(), 4, base.factor.begin());
        base.texture = core.baseColorTexture.index;
        base.uv = placement_of(core.baseColorTexture);
        return base;
    }
    const Value& from = glossy->second;
    if (from.Has("diffuseFactor")) {
        for (int c = 0; c < 4; ++c) base.factor[c] = from.Get("diffuseFactor").Get(c).GetNumberAsDouble();
    }
    if (!from.Has("diffuseTexture")) return base;
    const Value& texture = from.Get("diffuseTexture");
    base.texture = texture.Get("index").GetNumberAsInt();
    base.uv.set = static_cast<int>(number_of(texture, "texCoord", 0.0));
    if (texture.Has("extensions") && texture.Get("extensions").Has("KHR_texture_transform"))
        base.uv = transformed(texture.Get("extensions").Get("KHR_texture_transform"), base.uv.set);
    return base;
}

void make_unlit(Material& material, Unlit unlit) {
    material.emissive_nit = glm::vec3(0.0f);
    material.emissive_image = -1;
    if (unlit == Unlit::albedo) return;
    material.emissive_nit = kUnlitWhite_nit * glm::vec3(material.base_color);
    material.emissive_image = material.base_color_image;
    material.base_color = glm::vec4(glm::vec3(0.0f), material.base_color.a);
    if (!material.alpha_mask) material.base_color_image = -1;  // else it has the alpha
}

}  // namespace gonio
